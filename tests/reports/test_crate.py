"""A study is exported as an RO-Crate that validators accept, and that has all of it."""

import os
from datetime import date
from importlib.resources import files
from pathlib import Path
from zipfile import ZipFile

import pytest
import requests
from rocrate_validator import services
from rocrate_validator.utils.http import HttpRequester

from dess import InputError
from dess.analysis import load_results, load_study, run_study
from dess.analysis.results.manifest import Manifest
from dess.analysis.results.tables import Results
from dess.reports.crate import write_crate
from tests.analysis.small import grid, small_study
from tests.reports.small import quick

DAY = date(2026, 3, 14)
STUDIES = {
    "plain": {"logged": 1, "description": "Does it last?"},
    "grid": {"design": grid(quota=[20, 60], pads=[1, 2]), "policies": ["greedy,random", "tour"]},
    "precision": {"precision": {"budget": 90, "targets": {"success": {"absolute": 0.3}}}},
    "cheapest": {
        "selection": {"procedure": "cheapest", "requirements": {"success": 0.2}, "check": 5}
        | {"indifference": 1, "budget": 500, "first": 8},
        "costs": {"uav": 3, "pad": 1},
        "design": grid(uavs=[1, 2]),
    },
    "bounds": {"bounds": True, "missions": 6, "costs": {"uav": 3}, "set": {"arrival_rate": 0.01}},
}


def results_of(folder: Path, name: str = "plain") -> Results:
    with quick():
        run_study(small_study(folder, **STUDIES[name]), folder / "out")
    return load_results(folder / "out")


def exported(folder: Path, results: Results, name: str = "crate.zip", licence="CC-BY-4.0") -> Path:
    """A crate of the results, with a page."""
    page = folder / "study-trial.html"
    page.write_text("<!doctype html><title>trial</title>", "utf-8")
    write_crate(results, page, folder / name, DAY, licence)
    return folder / name


@pytest.mark.parametrize("name", STUDIES)
def test_what_is_unpacked_is_the_study(name, tmp_path):
    """The results load as they were, and the TOML files are the study that made them."""
    results = results_of(tmp_path, name)
    crate = exported(tmp_path, results)
    with ZipFile(crate) as archive:
        archive.extractall(tmp_path / "unpacked")
    there = load_results(tmp_path / "unpacked" / "results")
    for table in ("missions", "uavs", "checks"):
        assert getattr(there, table).equals(getattr(results, table))
    assert there.manifest == results.manifest
    assert len(there.store.contents.logged) == len(results.store.contents.logged)
    assert there.bounds.keys() == results.bounds.keys()
    again = Manifest.of(load_study(tmp_path / "unpacked" / "study.toml"))
    made = results.store.manifest
    assert again.scenario == made.scenario
    assert again.points == made.points
    assert again.cells == made.cells
    assert again.study.model_copy(update={"scenario": made.study.scenario}) == made.study


# What a crate should tell as well, and only who publishes it knows.
OF_THE_PUBLISHER = {
    "The Root Data Entity SHOULD have a link to a Contextual Entity representing the `author` of "
    "the RO-Crate",
    "The `publisher` property of a `Root Data Entity` SHOULD be an `Organization`",
    "The organization SHOULD have a URL.",
}


@pytest.mark.slow
@pytest.mark.brief
@pytest.mark.filterwarnings("ignore:ConjunctiveGraph is deprecated")
def test_a_validator_accepts_it(tmp_path, monkeypatch):
    """The validator reads the context that the library rocrate has, not that of the network."""

    def context(self, url, **options):
        assert url == "https://w3id.org/ro/crate/1.1/context"
        response = requests.Response()
        response.status_code, response.url = 200, url
        response.headers["Content-Type"] = "application/ld+json"
        response._content = files("rocrate").joinpath("data/ro-crate.jsonld").read_bytes()
        return response

    monkeypatch.setattr(HttpRequester, "get", context, raising=False)
    crate = exported(tmp_path, results_of(tmp_path, "grid"))
    settings = services.ValidationSettings(
        rocrate_uri=str(crate),
        profile_identifier="ro-crate-1.1",
        requirement_severity=services.Severity.RECOMMENDED,
    )
    issues = services.validate(settings).get_issues()
    assert {issue.message for issue in issues} == OF_THE_PUBLISHER


def test_damaged_results_are_not_exported(tmp_path):
    results = results_of(tmp_path)
    log = next((tmp_path / "out" / "events").rglob("*.parquet"))
    log.write_bytes(log.read_bytes()[:-1])
    with pytest.raises(InputError, match="has been changed since it was written"):
        exported(tmp_path, load_results(tmp_path / "out"))
    assert results.store.contents.damaged == []


def test_a_crate_has_the_results_alone_as_equal_bytes(tmp_path):
    """Not what a run leaves beside them, nor where links lead to; and a pipe does not block it."""
    results, secret, out = results_of(tmp_path), tmp_path / "secret", tmp_path / "out"
    secret.write_text("secret")
    expected = exported(tmp_path, results, "expected.zip")
    (out / ".lock").touch()
    (out / "failures" / "x.json").write_text("{}")
    for place in [*out.glob("*/policy=*"), out / "missions"]:
        os.mkfifo(place / f"{'a' * 16}-{'1' * 16}.parquet")
        (place / f"{'a' * 16}-{'2' * 16}.parquet").symlink_to(secret)
        (place / "note.txt").symlink_to(secret)
    assert exported(tmp_path, load_results(out)).read_bytes() == expected.read_bytes()
    with ZipFile(expected) as archive:
        assert {name.split("/")[0] for name in archive.namelist()} == {
            *("LICENSE", "results", "ro-crate-metadata.json"),
            *("scenario.toml", "study-trial.html", "study.toml"),
        }
