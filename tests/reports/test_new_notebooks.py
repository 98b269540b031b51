"""The notebooks on learning and on parameters render whole, from whatever results there are."""

import re
from pathlib import Path
from typing import Any

import pandas as pd
import pytest

from analysis import curves, effects, findings, load_results, load_study, run_study
from analysis.paper import METRICS
from reports import page
from reports import render as module
from reports.render import render
from tests.reports.test_render import EMBEDDED, Links

NAMES = ["learning", "parameters"]
POLICIES = ["random", "greedy", "ddqn"]
PRODUCT = "collection_ratio_and_communication"


@pytest.fixture(scope="module", autouse=True)
def _known() -> Any:
    """Only these reports are known."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "report_names", lambda: NAMES)
        yield


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small results of the three studies; the sensitivity's success is the same everywhere."""
    folder = tmp_path_factory.mktemp("results")
    rule = {"procedure": "kn-bounded", "first": 4, "indifference": 0.01, "budget": 60, "check": 12}
    corners = {"uavs": [1, 3], "initial_data": [[5, 7.5], 10]}
    sweep = {"kind": "saltelli", "base": 8, "ranges": {"uavs": [1, 3], "charge_start": [10, 50]}}
    studies: dict[str, dict[str, Any]] = {
        "fig5": {"policies": POLICIES, "missions": 8},
        "sweet-spot": {
            "policies": POLICIES,
            "selection": rule,
            "design": {"kind": "grid", "values": corners},
        },
        "sensitivity": {"policies": ["greedy"], "design": sweep | {"seed": 1}},
    }
    for name, changes in studies.items():
        run_study(load_study(name, **changes), folder / name)
    return folder


@pytest.fixture(scope="module")
def pages(results: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The two reports by name."""
    out = tmp_path_factory.mktemp("out")
    render(NAMES, results, out)
    return {name: (out / f"{name}.html").read_text("utf-8") for name in NAMES}


def text_of(html: str) -> str:
    """The words of a page, without its drawings and its code."""
    main = EMBEDDED.sub("", html.split("<main")[1].split('<details class="code">')[0])
    return re.sub(r"\s+", " ", re.sub(r"<[^>]+>", " ", main))


@pytest.mark.parametrize("name", NAMES)
def test_pages_are_whole_and_load_nothing(pages: dict[str, str], name: str) -> None:
    links = Links(pages[name])
    assert not {"script", "link", "iframe", "object"} & links.tags
    for target in links.found:
        assert target.startswith("data:image/svg+xml;base64,") or target == "index.html"
    assert not re.search(
        r"Traceback|Warning|stderr|Figure\(|\bnan\b|NaN|None", text_of(pages[name])
    )


@pytest.mark.parametrize("name", NAMES)
def test_every_figure_has_a_caption_with_its_number(pages: dict[str, str], name: str) -> None:
    captions = re.findall(r"<figcaption>(.*?)</figcaption>", pages[name], re.S)
    assert len(captions) == pages[name].count("<figure>") == pages[name].count("<img ") > 0
    assert all(re.search(r"\bn\b", caption) for caption in captions)
    assert len(captions) == {"learning": 4 + 1 + 2, "parameters": 5 + 3 + 1}[name]


def test_pages_tell_no_places_and_no_times(pages: dict[str, str], results: Path) -> None:
    for html in pages.values():
        assert str(results) not in html
        assert str(Path(module.__file__).parents[1]) not in html
        assert not re.search(r"\b\d\d:\d\d:\d\d\b|\b20\d\d-\d\d-\d\d\b", html)


def test_the_same_results_give_the_same_bytes(
    pages: dict[str, str], results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("TZ", "Pacific/Auckland")
    monkeypatch.setenv("PYTHONHASHSEED", "7")
    (tmp_path / "elsewhere").symlink_to(results)
    render(NAMES, tmp_path / "elsewhere", tmp_path / "again")
    for name in NAMES:
        assert (tmp_path / "again" / f"{name}.html").read_text("utf-8") == pages[name]


def test_the_learning_page_tells_the_ablation(pages: dict[str, str]) -> None:
    file = Path(module.__file__).parents[1] / "policies" / "trained" / "curves.parquet"
    last = curves.finals(pd.read_parquet(file))
    table = curves.ablation(last, f"final_{PRODUCT}", "quick")
    text = text_of(pages["learning"])
    for row in table.itertuples():
        shown = page.percent(row.mean)
        if row.low < row.high:
            shown = page.interval(row.mean, row.low, row.high)
        assert re.search(rf"{re.escape(row.variant)} {row.n} {re.escape(shown)}", text)


def test_the_learning_page_judges_by_the_curves_it_is_given(results: Path, tmp_path: Path) -> None:
    """Where transfer learning surely wins, the page says that the claim holds."""
    same = {"phase": "battery", "uav_slots": 1e6, "final_success": 1, "final_collection_ratio": 1}
    rows = [
        {
            "variant": variant,
            "seed": seed,
            "updates": 1000 * step,
            "evaluation_reward": top * step + seed / 1000,
            f"evaluation_{PRODUCT}": top * step / 4 + seed / 1000,
            f"final_{PRODUCT}": top + seed / 1000,
        }
        | same
        for variant, top in (("quick", 0.8), ("no transfer", 0.4))
        for seed in (1, 2, 3)
        for step in (1, 2, 3, 4)
    ]
    pd.DataFrame(rows).to_parquet(tmp_path / "curves.parquet")
    shipped = Path(module.__file__).parents[1] / "policies" / "trained" / "ddqn"
    (tmp_path / "ddqn").symlink_to(shipped)
    render(["learning"], results, tmp_path / "out", parameters={"trained": str(tmp_path)})
    text = text_of((tmp_path / "out" / "learning.html").read_text("utf-8"))
    assert "By this rule the claim holds , in all 2 comparisons." in text
    assert text.count("holds : is above in all of phase II") == 2
    assert "worse : no transfer" in text


def test_the_parameters_page_tells_what_the_studies_found(
    pages: dict[str, str], results: Path
) -> None:
    text = text_of(pages["parameters"])
    fig5 = load_results(results / "fig5")
    table = effects.effects(fig5)
    for policy in ("ddqn", "greedy"):  # random is neither learned nor the best heuristic
        for field in ("uavs", "initial_data"):
            pairs = effects.changes(fig5, table, policy, field, PRODUCT)
            assert f"{policy} {effects.shape(pairs).words}" in text
    sweet = load_results(results / "sweet-spot")
    for _, row in findings.checks(sweet).iterrows():
        if row["metric"] in METRICS:
            assert page.interval(row["mean"], row["low"], row["high"]) in text
    for row in findings.selections(sweet).itertuples():
        assert row.guarantee in text
    for _, row in findings.sensitivities(load_results(results / "sensitivity")).dropna().iterrows():
        assert page.interval(row["total"], row["total_low"], row["total_high"]) in text
    assert "random falls" not in text and "random rises" not in text


def test_without_a_learned_policy_the_heuristics_are_shown(results: Path, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    for name in ("sweet-spot", "sensitivity"):
        (folder / name).symlink_to(results / name)
    run_study(load_study("fig5", policies=["random", "greedy"], missions=4), folder / "fig5")
    render(["parameters"], folder, tmp_path / "out")
    text = text_of((tmp_path / "out" / "parameters.html").read_text("utf-8"))
    assert "Shown is greedy ." in text
