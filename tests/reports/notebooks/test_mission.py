"""The page on missions shows numbers that are computed here anew from the results."""

from pathlib import Path

import pandas as pd
import pytest

from analysis import load_results
from tests.by_hand import bounded
from tests.reports.small import run_small_studies, said_by

RATIO, PRODUCT = "collection_ratio", "collection_ratio_and_communication"


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run_small_studies(tmp_path_factory.mktemp("results"), "fig1", "fig4")


@pytest.fixture(scope="module")
def text(results: Path) -> str:
    return said_by("mission", results=str(results), policy="greedy", replication=0)


def test_missions_and_their_means(results: Path, text: str) -> None:
    missions = load_results(results / "fig4").missions.query("policy == 'greedy'")
    for point, printed in enumerate(("63.4 %", "89.4 %", "93.8 %")):
        at_point = missions[missions["point"] == point]
        values = at_point[RATIO].to_numpy(float)
        mean, low, high = (100 * end for end in bounded(values))
        assert f"is {mean:.1f} % [{low:.1f}, {high:.1f}], the paper's {printed}." in text
        (mission,) = at_point[at_point["replication"] == 0].itertuples()
        total = mission.initial + mission.arrived
        assert f"{mission.slots} slots; {mission.collected:.1f} of {total:.1f} data units" in text
        assert (
            f"{point + 1} UAV{'s' * (point > 0)}, greedy: {100 * mission.collection_ratio:.1f} % "
            "collected" in text
        )


def test_the_policy_of_the_example_is_the_best_one(results: Path, text: str) -> None:
    missions = pd.read_parquet(results / "fig1" / "missions")
    means = missions.groupby("policy")[PRODUCT].mean()
    assert f"n = 1 mission of {means.idxmax()}, replication 0" in text
