"""The pages on pads, age and failures begin with the sentence that answers their question."""

from pathlib import Path

import numpy as np
import pytest

from analysis import load_results
from analysis.answers import operations
from tests.by_hand import bounded
from tests.reports.small import run_small_studies, said_by, words


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_small_studies(tmp_path_factory.mktemp("results"), "pads", "age", "failures")


def test_the_page_on_pads(results: Path) -> None:
    text = said_by("pads", results=str(results), margin=0.1)
    study = load_results(results / "pads")
    assert text.lstrip().startswith(words(operations.pads(study, 0.1)).replace("`", "")[:40])
    values = study.missions.query("uavs == 4 and pads == 1")["utilisation"].to_numpy()
    mean, low, high = bounded(values)
    assert f"{mean:.4g} [{low:.4g}, {high:.4g}]" in text


def test_the_page_on_the_age(results: Path) -> None:
    text = said_by("age", results=str(results))
    assert text.lstrip().startswith("From 1 to 2 UAVs the mean age of the data falls from")
    study = load_results(results / "age")
    means = study.missions.query("policy == 'age' and arrival_rate == 0.5").groupby("uavs")["age"]
    change = means.mean()[2] / means.mean()[1] - 1
    assert f"{100 * change:+.1f} % [".replace("-", "−") in text
    assert (study.missions["slots"] == 500).all()  # the fleet keeps watch to the last slot


def test_the_page_on_failures(results: Path) -> None:
    text = said_by("failures", results=str(results))
    assert text.lstrip().startswith("If a UAV fails in each slot with probability 0.01")
    study = load_results(results / "failures")
    rows = study.missions.query("uavs == 2 and `failures.uav_repair` == 0")
    means = rows.groupby("failures.uav_rate")["collection_ratio_and_communication"].mean()
    change = f"{100 * (means[0.01] - means[0.0]):+.1f} [".replace("-", "−")
    assert change in text


def test_the_queue_of_the_logs_is_that_of_the_records(results: Path) -> None:
    study = load_results(results / "pads")
    table = operations.queues(study, "greedy", [3]).set_index("slot")  # four UAVs, one pad
    missions = study.missions.query("point == 3 and replication < 2")
    assert len(table) == missions["slots"].max()
    waited = (missions["queue"] * missions["slots"]).sum() / 2
    assert table["mean"].sum() == pytest.approx(waited)
    assert waited > 0
    assert np.all(table["low"] <= table["high"])
