"""Tables of single missions agree with the records and the event logs."""

from dataclasses import replace
from pathlib import Path

import pandas as pd
import pytest

from analysis import run_study
from analysis.questions import missions
from analysis.results.tables import Results
from tests.analysis.small import grid, small_study


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Results:
    folder = tmp_path_factory.mktemp("study")
    study = small_study(folder, design=grid(uavs=[1, 3]), logged=2, missions=6)
    return run_study(study, folder / "out")


@pytest.fixture(scope="module")
def shown(results: Results) -> list[missions.LoggedMission]:
    return [missions.logged_mission(results, "greedy", point, 1) for point in (0, 1)]


# --- missions simulated again ---

WANTED = [("greedy", 1), ("random", 0)]


def test_kept_logs_are_those_that_the_study_keeps(results: Results, tmp_path: Path) -> None:
    """They are kept: a second call writes nothing, but in place of a damaged file."""
    assert missions.kept_missions(results, WANTED, tmp_path) == []
    steps: list[tuple[int, int]] = []
    missions.keep_logs(results, WANTED, tmp_path, lambda *step: steps.append(step))
    assert steps == [(1, 2), (2, 2)]
    kept = missions.kept_missions(results, WANTED, tmp_path)
    for (policy, replication), mission in zip(WANTED, kept, strict=True):
        same = missions.logged_mission(results, policy, 0, replication)
        pd.testing.assert_frame_equal(mission.log, same.log)
        assert mission.row.equals(same.row) and mission.scenario == same.scenario
    files = {path: path.read_bytes() for path in (tmp_path / missions.FOLDER).iterdir()}
    damaged = min(files)
    damaged.write_bytes(b"damaged")
    before = max(files).stat().st_mtime_ns
    missions.keep_logs(results, WANTED, tmp_path, print)
    assert {path: path.read_bytes() for path in files} == files
    assert max(files).stat().st_mtime_ns == before


def test_logs_of_other_results_and_of_other_records_are_not_shown(
    results: Results, tmp_path: Path
) -> None:
    missions.keep_logs(results, WANTED, tmp_path, print)
    other = run_study(small_study(tmp_path, seed=8, missions=2), tmp_path / "other")
    assert missions.kept_missions(other, WANTED[:1], tmp_path) == []
    other.missions["slots"] += 1  # as of other code
    missions.keep_logs(other, WANTED[:1], tmp_path, print)
    assert missions.kept_missions(other, WANTED[:1], tmp_path) == []


def test_a_caption_says_what_ended_a_mission(shown: list[missions.LoggedMission]) -> None:
    mission = shown[1]
    filled = mission.log.assign(event=mission.log["event"].replace("battery_empty", "quota_filled"))
    assert ": All UAVs filled their quota. " in replace(mission, log=filled).caption
    end = (filled["event"] == "quota_filled") & (filled["uav"] == 2)
    failed = filled.assign(event=filled["event"].mask(end, "battery_empty"))
    assert ": UAV 3 ran empty after " in replace(mission, log=failed).caption
    assert f". {mission.collected} in {mission.row['slots']} mission slots." in mission.caption


def test_outcomes_are_those_of_the_record(shown: list[missions.LoggedMission]) -> None:
    table = missions.outcome_table(shown)
    for row, mission in zip(table.to_dict("records"), shown, strict=True):
        log = mission.log
        ends = log[(log["event"] == "mission_end") & (log["node"] >= 0)].set_index("node")["value"]
        never = [
            k
            for k in ends.index
            if not (log["event"].eq("communication") & log["node"].eq(k)).any()
        ]
        assert row["Nodes never served"] == f"{len(never)} of 3"
        collected, total = map(float, row["Data collected"].split(" of "))
        assert float(row["Data left"]) == pytest.approx(total - collected)  # as they are printed
        assert float(row["Data left"]) == pytest.approx(ends.sum(), abs=0.1)
        assert row["Fullest node left"].startswith(f"{ends.max():.1f} at (")
        x, y = mission.scenario.nodes[int(ends.idxmax())]
        assert row["Fullest node left"].endswith(f"({x}, {y})")
        assert row["Success"] == ("yes" if mission.row["success"] else "no")
