"""The explorer shows the means of the grid, wherever its sliders stand, in a real browser."""

from functools import cache
from pathlib import Path

import pandas as pd
import pytest
from playwright.sync_api import Locator, Page

from dess import InputError
from dess.analysis.metrics import HOME, METRICS
from dess.analysis.results.tables import Results
from dess.analysis.stats.intervals import interval_of
from dess.reports.explorer import Grid, make_explorer
from tests.analysis.small import grid

DESIGN = {"uavs": [1, 2, 3], "charge_complete": [40, 60], "initial_data": [[1, 2], 5]}
# As the study has them; the page has numbers in ascending order.
SHUFFLED = DESIGN | {"uavs": [3, 1, 2]}
SHOWN = ("success", HOME, *[*METRICS][1:])  # missions of the small scenario end in the air
START = (1, 1, 1)  # the places of the sliders at first
POLICIES = ["greedy", "random"]
MISSIONS = 12


@pytest.fixture(scope="module")
def results(studied):
    return studied(policies=POLICIES, missions=MISSIONS, design=grid(**SHUFFLED))


@pytest.fixture(scope="module")
def document(results, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    head = (
        '<!DOCTYPE html><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
    )
    path.write_text(head + make_explorer(results).data, "utf-8")
    return path


@cache
def stored_missions(folder: Path) -> pd.DataFrame:
    """The missions in the files of the results."""
    return pd.read_parquet(folder / "missions")


def estimate(results: Results, places: tuple[int, ...], policy: str, metric: str) -> list[float]:
    """A mean and its interval in percent, of the files of the results."""
    sliders = zip(DESIGN.items(), places, strict=True)
    values = {field: values[place] for (field, values), place in sliders}
    manifest = results.store.manifest
    (point,) = (n for n, p in enumerate(manifest.points) if p.values == values)
    missions = stored_missions(results.store.folder)
    cell = manifest.cells[POLICIES.index(policy)][point].key
    sample = missions.loc[missions["cell"].astype(str) == cell, metric]
    assert len(sample) == MISSIONS
    return [100 * end for end in interval_of(metric, sample.to_numpy(float))]


def text_of(mean: float, low: float, high: float) -> str:
    return f"{mean:.1f} % [{low:.1f}, {high:.1f}], n = {MISSIONS}".replace("-", "−")


def row(page: Page, metric: str, policy: str) -> Locator:
    return page.locator(f'[data-metric="{metric}"] tr[data-policy="{policy}"]')


def check(page: Page, results: Results, places: tuple[int, ...]) -> None:
    """The numbers and the dots of all policies and metrics are those of the setting."""
    for metric in SHOWN:
        for policy in POLICIES:
            mean, *ends = estimate(results, places, policy, metric)
            shown = row(page, metric, policy)
            assert shown.locator(".estimate").text_content() == text_of(mean, *ends)
            dot = shown.locator("circle").get_attribute("cx")
            whisker = shown.locator("line").nth(3)
            drawn = [dot, *(whisker.get_attribute(name) for name in ("x1", "x2"))]
            exact = [mean, *(min(max(end, 0), 100) for end in ends)]
            for text, value in zip(drawn, exact, strict=True):
                assert float(str(text).removesuffix("%")) == pytest.approx(value, abs=0.051)


def check_curve(page: Page, results: Results, places: tuple[int, ...], along: int) -> None:
    """The curve has a dot for every policy and every value of a slider."""
    read = "dots => dots.map(dot => parseFloat(dot.getAttribute('cy')))"
    heights = page.locator(".curve circle").evaluate_all(read)
    metric = SHOWN[int(page.locator("[name=metric]").input_value())]
    stops = [
        tuple(n if slider == along else place for slider, place in enumerate(places))
        for n in range(len([*DESIGN.values()][along]))
    ]
    means = [estimate(results, stop, policy, metric)[0] for policy in POLICIES for stop in stops]
    assert heights == pytest.approx([100 - mean for mean in means], abs=0.051)


def test_moving_a_slider_shows_the_figures_of_the_grid(visit, results, document):
    opened = visit(document, 390)
    page, places = opened.page, [*START]
    check(page, results, START)
    for number, (field, values) in enumerate(DESIGN.items()):
        slider = page.locator(f"input[name=explorer-{field}]")
        page.locator("[name=along]").select_option(str(number))
        for key, place in (("Home", 0), ("ArrowRight", 1), ("End", len(values) - 1)):
            slider.press(key)
            places[number] = place
            check(page, results, tuple(places))
            check_curve(page, results, tuple(places), number)
    page.locator("[name=metric]").select_option("0")
    check_curve(page, results, tuple(places), len(DESIGN) - 1)
    assert (
        page.locator("[name=explorer-initial_data]").get_attribute("aria-valuetext")
        == "5 data units"
    )
    assert page.get_by_role("slider", name="Number of UAVs").get_attribute("id") == "explorer-uavs"
    command = page.locator(".setting code").text_content()
    assert command == "--set uavs=3 --set charge_complete=60 --set initial_data=5"
    assert page.evaluate("document.documentElement.scrollWidth") <= 390
    assert opened.complaints == []
    assert opened.requests == [document.as_uri()]


def test_the_answer_names_the_setting_at_which_the_sliders_start(results):
    """Two of them start at an end of their values, not in the middle of a range."""
    said = Grid(results).describe_start()
    assert said.startswith("With ") and "middle" not in said
    assert "2 UAVs" in said.partition(", the product is ")[0]
    assert "60" in said.partition(", the product is ")[0]


def test_policies_are_chosen(visit, document):
    page = visit(document, 1280).page
    page.get_by_role("checkbox", name="greedy").uncheck()
    for metric in SHOWN:
        assert row(page, metric, "greedy").is_hidden()
        assert row(page, metric, "random").is_visible()
    assert page.locator(".curve circle").count() == len(DESIGN["uavs"])


def test_without_scripts_one_setting_is_shown(chromium, results, document):
    page = chromium.new_page(java_script_enabled=False)
    page.goto(document.as_uri())
    assert "The sliders need JavaScript" in str(page.locator("noscript").inner_html())
    for metric in SHOWN:
        shown = row(page, metric, "greedy").locator(".estimate").inner_text()
        assert shown == text_of(*estimate(results, START, "greedy", metric))
    assert page.get_by_label("Metric").is_hidden()
    page.close()


def test_what_is_no_grid_is_refused(studied):
    rows = [{"uavs": 1, "quota": 50}, {"uavs": 2, "quota": 60}]
    for changes in ({}, {"design": grid(uavs=[1, 2])}, {"design": {"kind": "table", "rows": rows}}):
        results = studied(policies=["random"], missions=2, **changes)
        with pytest.raises(InputError, match="is not a full grid of two fields or more"):
            make_explorer(results)
