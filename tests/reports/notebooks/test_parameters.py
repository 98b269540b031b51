"""The page on scenario parameters shows numbers that are computed here anew from the results."""

import json
from pathlib import Path

import pytest

from analysis import load_results, load_study, run_study
from tests.by_hand import bounded
from tests.reports.small import POLICIES, run_small_studies, said_by

PRODUCT = "collection_ratio_and_communication"
PRINTED = 0.93  # product at the paper's sweet spot


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Small results; the sensitivity's success is the same everywhere."""
    names = ("fig5", "sweet-spot", "sensitivity")
    return run_small_studies(tmp_path_factory.mktemp("results"), *names)


@pytest.fixture(scope="module")
def text(results: Path) -> str:
    return said_by("parameters", results=str(results))


def test_every_parameter_is_shown_from_its_first_value_to_its_last(
    results: Path, text: str
) -> None:
    points = json.loads((results / "fig5" / "manifest.json").read_text("utf-8"))["points"]
    missions = load_results(results / "fig5").missions
    for policy in ("ddqn", "greedy"):  # random is neither learned nor the best heuristic
        means = missions[missions["policy"] == policy].groupby("point")[PRODUCT].mean()
        for field in ("uavs", "charge_start", "flying_time"):
            of_field = [n for n, point in enumerate(points) if field in point["values"]]
            ends = of_field[0], of_field[-1]
            first, last = (f"{100 * means[n]:.1f} % at {points[n]['values'][field]}" for n in ends)
            gap = f"{100 * (means[ends[1]] - means[ends[0]]):+.1f}".replace("-", "−")
            assert f" {first} {last} {gap} [" in text
    assert "random falls" not in text and "random rises" not in text


def test_the_sweet_spot_is_checked_by_missions_of_its_own(results: Path, text: str) -> None:
    """And metrics without variance have no Sobol indices."""
    assert "greedy Collection ratio Number of UAVs" in text
    assert "greedy Success Number of UAVs" not in text
    checks = load_results(results / "sweet-spot").checks
    for policy in POLICIES:
        values = checks.loc[checks["policy"] == policy, PRODUCT].to_numpy(float)
        mean, low, high = bounded(values)
        mark = "▲" if low > PRINTED else "▼" if high < PRINTED else "≈"
        shown = f"{100 * mean:.1f} % [{100 * low:.1f}, {100 * high:.1f}] "
        shown += f"{100 * (mean - PRINTED):+.1f} {mark}"
        assert shown.replace("-", "−") in text


def test_without_a_learned_policy_the_heuristics_are_shown(results: Path, tmp_path: Path) -> None:
    folder = tmp_path / "results"
    folder.mkdir()
    for name in ("sweet-spot", "sensitivity"):
        (folder / name).symlink_to(results / name)
    run_study(load_study("fig5", policies=["random", "greedy"], missions=4), folder / "fig5")
    text = said_by("parameters", results=str(folder))
    assert "The product of greedy depends most on the" in text
