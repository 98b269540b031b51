"""Pages and results can be checked by whoever has them; what was altered is found."""

import json
import re
import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import pandas as pd
import pytest
from nbformat.v4 import new_output

from dess import InputError
from dess.analysis import load_study, run_study
from dess.analysis.bound import Bound
from dess.analysis.results.evidence import Evidence, learned_files
from dess.analysis.results.tables import load_results
from dess.policies import registry
from dess.policies.registry import TRAINED
from dess.reports.cli import main
from dess.reports.pages import verify
from dess.reports.pages.body import make_page
from dess.reports.pages.index import find_pages, make_index
from dess.reports.pages.notebook import read_report
from dess.reports.pages.page import STUDY, Page
from dess.reports.pages.provenance import (
    STUDIES_BESIDE,
    evidence_tables,
    provenance_table,
    weights_table,
)
from dess.reports.pages.tables import make_table
from dess.reports.pages.verify import verify_page, verify_results
from tests.analysis.hostile import forged
from tests.analysis.small import small_study
from tests.reports.small import made_up, quick

ALL = 10**6


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Small results of two studies."""
    folder = tmp_path_factory.mktemp("results")
    for name, logged in {"table4": 0, "fig4": 1}.items():
        study = load_study(name, missions=6, policies=["random", "greedy"], logged=logged)
        run_study(study, folder / name)
    return folder


@pytest.fixture(scope="module")
def page(results, tmp_path_factory):
    """A page on both, with the index of its folder; its notebook has not been run."""
    out = tmp_path_factory.mktemp("out")
    shown = make_table(pd.DataFrame({"Success": ["97.3 %"]}))
    origins = provenance_table([load_results(results / name) for name in ("table4", "fig4")])
    report, data = read_report("performance"), {"text/html": shown.data + origins.data}
    report.cells[-1].outputs = [new_output("display_data", data)]
    (out / "performance.html").write_text(make_page(report).text, "utf-8")
    (out / "index.html").write_text(make_index(find_pages(out)), "utf-8")
    return out / "performance.html"


def lines_of(path: Path, missions: int = ALL, seed: int = 0) -> list[str]:
    """What is found to differ."""
    check = verify_results if path.is_dir() else verify_page
    return [line for verdict in check(path, missions, seed) for line in verdict.differing]


def altered(path: Path, old: str, new: str, out: Path) -> Path:
    html = path.read_text("utf-8")
    assert old in html
    out.write_text(html.replace(old, new, 1), "utf-8")
    return out


def test_pages_and_results_that_nobody_altered_agree(results, page):
    assert lines_of(page.with_name("index.html")) == []
    of_page, of_results = verify_page(page, ALL, 0), verify_results(results, ALL, 0)
    assert not any(verdict.differing for verdict in (*of_page, *of_results))
    compared = {verdict.what: verdict.compared for verdict in of_page}
    assert compared == {"page": 1, "table4": 12, "fig4": 32}
    compared = {verdict.what: verdict.compared for verdict in of_results}
    assert compared == {"table4": 12, "fig4": 36, "fig4, event logs": 6}


def test_the_origins_of_many_studies_stand_in_several_tables(results):
    """So that no column is beyond the edge of a page."""
    evidence = Evidence.of(load_results(results / "fig4"))
    shown = evidence_tables([evidence] * (STUDIES_BESIDE + 1)).data
    assert shown.count("<table") == 2
    assert len(Page(shown).evidence) == 1  # of the same study


def test_a_page_whose_missions_were_altered_is_found_by_simulating_them(page, tmp_path):
    """Even where the checksum was made anew."""
    text = Page.read(page).find_hidden(STUDY)[0]
    evidence = json.loads(text)
    mission = evidence["sample"][3]
    mission["record"]["collected"] += 1e-9
    forged = altered(page, text, json.dumps(evidence), tmp_path / "page.html")
    forged.write_text(Page.read(forged).sealed.text, "utf-8")
    (line,) = lines_of(forged)
    assert line.startswith(f"collected is {mission['record']['collected']} and ")
    assert f"--policy {mission['policy']} " in line
    assert line.endswith(f"--seed 2022 --replication {mission['replication']}")


@pytest.mark.parametrize(
    ("study", "kind", "column", "differing", "found"),
    [
        ("table4", "missions", "collection_ratio", 6, "collection_ratio is "),
        ("fig4", "uavs", "slots_charging", 18, "uav 1 slots_charging"),
        ("fig4", "events", "value", 1, "the event log differs when simulated again"),
    ],
)
def test_forged_records_and_logs_are_found_by_simulating_their_missions(
    results, tmp_path, study, kind, column, differing, found
):
    """A file that is sound in itself, with the name that belongs to its bytes."""
    folder = shutil.copytree(results / study, tmp_path / study)
    path = sorted((folder / kind).rglob("*.parquet"))[0]
    forged(path, column, lambda v: [x / 2 if kind == "missions" else x + 1 for x in v])
    lines = lines_of(folder)
    assert len(lines) == differing
    assert all(found in line for line in lines) or kind == "uavs" and found in lines[0]


def test_two_files_that_tell_two_things_are_both_damaged(results, tmp_path):
    folder = shutil.copytree(results / "table4", tmp_path / "table4")
    path = sorted((folder / "missions").rglob("*.parquet"))[0]
    content = path.read_bytes()
    forged(path, "reward", lambda values: [value + 1 for value in values])
    path.write_bytes(content)
    lines = lines_of(folder)
    assert len(lines) == 2 and f"{path}: has been changed since it was written" in lines
    with pytest.raises(InputError, match="incomplete"):
        load_results(folder)


def test_a_page_without_missions_says_so(tmp_path):
    bare = tmp_path / "bare.html"
    bare.write_text(Page('<meta name="dess-checksum" content="">').sealed.text)
    (verdict,) = verify_page(bare, ALL, 0)
    assert verdict.notes == ["contains no missions to simulate again"]


def test_an_altered_page_does_not_get_into_the_index(page, tmp_path, caplog):
    folder = shutil.copytree(page.parent, tmp_path / "out")
    assert {*find_pages(folder)} == {"performance.html"}
    altered(page, "How good are the policies", "Perfection", folder / "performance.html")
    (folder / "comparison.html").write_bytes(b"\xff")
    old = page.read_text("utf-8").replace(Page.read(page).find_hidden(STUDY)[0], "{}")
    (folder / "mission.html").write_text(Page(old).sealed.text, "utf-8")
    assert not find_pages(folder)
    told = {record.args[0].name for record in caplog.records}
    assert told == {"comparison.html", "performance.html", "mission.html"}
    caplog.clear()
    # What is made anew is not missed.
    assert not find_pages(folder, but=told) and not caplog.records
    assert "performance.html" not in make_index(find_pages(folder))


def test_an_incomplete_folder_hides_no_other(results, tmp_path):
    folder = shutil.copytree(results, tmp_path / "results")
    manifest = folder / "fig4" / "manifest.json"
    manifest.write_text(manifest.read_text().replace('"complete": true', '"complete": false'))
    fig4, table4 = verify_results(folder, ALL, 0)
    assert fig4.notes == ["incomplete, so not checked"] and table4.compared == 12
    manifest.write_text("{}")
    assert len(verify_results(folder, ALL, 0)[0].differing) == 1


def test_results_under_a_former_name_are_shown_and_verified(tmp_path, monkeypatch, capsys):
    with monkeypatch.context() as before:
        before.setattr(registry, "FORMER", {})
        before.setattr(registry, "TRAINED", tmp_path / "trained")
        shutil.copytree(TRAINED / "generalist", tmp_path / "trained" / "any")
        run_study(load_study("table4", missions=3, policies=["any"]), tmp_path / "results")
    shutil.rmtree(tmp_path / "trained")
    results = load_results(tmp_path / "results")
    assert [*results.missions["policy"].unique()] == ["any"]
    [check] = verify_results(tmp_path / "results", ALL, 0)
    assert (check.compared, check.differing) == (3, [])
    assert main(["study", "show", str(tmp_path / "results")]) == 0
    assert re.search(r"^any ", capsys.readouterr().out, re.M)


def test_other_weights_are_found(tmp_path, capsys):
    folder = shutil.copytree(TRAINED, tmp_path / "trained")
    content = f'<meta name="dess-checksum" content="">{weights_table(folder).data}'
    path = tmp_path / "page.html"
    path.write_text(Page(content).sealed.text, "utf-8")
    assert lines_of(path) == []
    name = "ddqn/model.safetensors"
    (folder / name).write_bytes((folder / name).read_bytes() + b" ")
    shipped, other = learned_files()[name], learned_files(folder)[name]
    assert shipped != other
    path.write_text(Page(content.replace(shipped, other)).sealed.text, "utf-8")
    assert lines_of(path) == [f"{name}: differs from the file here"]


def test_the_sample_is_drawn_at_random(results):
    loaded = load_results(results / "fig4")
    few = [
        {(m.policy, str(m.values), m.replication) for m in Evidence.of(loaded, 20, seed).sample}
        for seed in (1, 1, 2)
    ]
    assert few[0] == few[1] != few[2]
    assert [len(sample) for sample in few] == [20, 20, 20]


@pytest.mark.parametrize("as_json", [False, True])
def test_the_command_says_what_it_found(page, tmp_path, as_json, capsys):
    options = ["--seed", "5", *(["--json"] if as_json else [])]
    assert main(["verify", str(page), *options]) == 0
    out = capsys.readouterr().out
    if as_json:
        checks = json.loads(out)["checks"]
        assert [check["what"] for check in checks] == ["page", "table4", "fig4"]
        assert [check["compared"] for check in checks] == [1, 12, 20]
    else:
        assert re.search(r"table4 +12 +0", out)
    forged = altered(page, "How good are the policies", "Perfection", tmp_path / "page.html")
    assert main(["verify", str(forged), *options]) == 1
    captured = capsys.readouterr()
    assert "the page has been altered" in captured.err.splitlines()[0]
    assert captured.err.splitlines()[-1].endswith("1 of 33 differ (--seed 5)")
    if as_json:
        assert json.loads(captured.out)["checks"][0]["differing"]


def test_forged_bounds_are_found_by_computing_them_again(tmp_path, monkeypatch):
    with quick():
        run_study(small_study(tmp_path, bounds=True, missions=6), tmp_path / "out")
    monkeypatch.setattr(verify, "upper_bound", made_up)
    checks = verify_results(tmp_path / "out", ALL, 0)
    assert [check.what for check in checks] == ["trial", "trial, bounds"]
    assert (checks[1].compared, checks[1].differing) == (verify.BOUNDS_CHECKED, [])

    def lower(*mission: Any) -> Bound:
        return replace(made_up(*mission), ratio=0.5)

    monkeypatch.setattr(verify, "upper_bound", lower)
    lines = lines_of(tmp_path / "out")
    assert len(lines) == verify.BOUNDS_CHECKED
    assert lines[0].endswith("is 0.97, and 0.5 when computed again")
