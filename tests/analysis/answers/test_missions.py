"""How a team shares out the nodes, on layouts worked by hand."""

import shutil
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pandas as pd
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, load_scenario
from dess.analysis import load_results, run_study
from dess.analysis.answers import missions
from dess.analysis.results.chunks import DERIVED
from dess.analysis.results.resimulate import LoggedMission
from dess.analysis.results.tables import Results
from tests.analysis.small import SHEET, grid, small_study, write_scenario


@pytest.fixture(scope="module")
def results(studied):
    return studied(design=grid(uavs=[1, 3]), logged=2, missions=6)


# --- missions simulated again ---

WANTED = [("greedy", 1), ("random", 0)]


def logs_in(results: Results) -> dict[Path, bytes]:
    """The files of the logs that are kept, and their bytes."""
    folder = results.store.folder / DERIVED
    return {path: path.read_bytes() for path in folder.glob("*.parquet")}


def test_kept_logs_are_those_that_the_study_keeps(results):
    """They are kept: a second call writes nothing, but in place of a damaged file."""
    assert missions.kept_missions(results, WANTED) == []
    steps: list[tuple[int, int]] = []
    missions.keep_logs(results, WANTED, lambda *step: steps.append(step))
    assert steps == [(1, 2), (2, 2)]
    kept = missions.kept_missions(results, WANTED)
    for (policy, replication), mission in zip(WANTED, kept, strict=True):
        same = LoggedMission.of(results, policy, 0, replication)
        pd.testing.assert_frame_equal(mission.events, same.events)
        assert mission.record.equals(same.record) and mission.scenario == same.scenario
    files = logs_in(results)
    damaged = min(files)
    damaged.write_bytes(b"damaged")
    before = max(files).stat().st_mtime_ns
    missions.keep_logs(results, WANTED, print)
    assert logs_in(results) == files
    assert max(files).stat().st_mtime_ns == before


def test_logs_of_other_results_and_of_other_records_are_not_shown(results, tmp_path):
    missions.keep_logs(results, WANTED, print)
    other = run_study(small_study(tmp_path, seed=8, missions=2), tmp_path / "other")
    shutil.copytree(results.store.folder / DERIVED, other.store.folder / DERIVED)
    assert missions.kept_missions(other, WANTED[:1]) == []
    other.missions["slots"] += 1  # as of other code
    missions.keep_logs(other, WANTED[:1], print)
    assert missions.kept_missions(other, WANTED[:1]) == []


def test_what_is_kept_is_no_part_of_the_results(results):
    """Neither their key, nor what there is to do, nor the logs that are checked."""
    before = results.store.manifest.key, results.store.files
    missions.keep_logs(results, [("greedy", 5)], print)
    again = load_results(results.store.folder).store
    assert (again.manifest.key, again.files) == before
    assert not any(replication == 5 for _, replication in again.contents.logged)


def test_nothing_is_written_where_a_link_leads(results, tmp_path):
    folder = tmp_path / "copy"
    shutil.copytree(results.store.folder, folder, ignore=shutil.ignore_patterns(DERIVED))
    (tmp_path / "elsewhere").mkdir()
    (folder / DERIVED).symlink_to(tmp_path / "elsewhere")
    with pytest.raises(InputError, match="is a link"):
        missions.keep_logs(load_results(folder), WANTED, print)
    assert not [*(tmp_path / "elsewhere").iterdir()]


SQUARE = np.array([(0, 0), (1, 0), (0, 1), (1, 1)])
PAPER = np.array([(x, y) for y in (6, 11, 16, 21, 26) for x in (3, 8, 13, 18, 23)])

EVENTS = {
    "event": ["mission_start", "mission_start", "mission_start", "communication", "arrival"]
    + ["communication", "communication"],
    "uav": [0, -1, -1, 0, -1, 1, 1],
    "node": [-1, 0, 1, 0, 1, 0, 1],
    "value": [80.0, 6.0, 4.0, 2.0, 1.0, 1.5, 1.0],
}


def test_what_is_collected_and_held():
    """The battery at the start is no data."""
    assert missions.data_by_uav_and_node(EVENTS, 2, 2).tolist() == [[2.0, 0.0], [1.5, 1.0]]
    assert missions.data_by_node(EVENTS, 2).tolist() == [6.0, 5.0]
    # 3.5 of 6, 1 of 5.
    assert missions.left_behind(EVENTS, 2).tolist() == [False, True]


def test_nodes_are_named_of_which_the_least_is_collected():
    """1 of 5 data units, and 3.5 of 6; of a node without data nothing can be."""
    space = load_scenario("paper", nodes=[[1, 1], [2, 2], [3, 3]])
    mission = SimpleNamespace(scenario=space, events=EVENTS)
    assert missions.neglected_sentence(mission) == (
        "Least is collected from [2, 2] (20.0 % of its data) and [1, 1] (58.3 % of its data)."
    )
    silent = SimpleNamespace(scenario=space, events=pd.DataFrame(EVENTS).query("node < 0"))
    assert missions.neglected_sentence(silent) == ""


def test_the_far_edges_of_the_paper():
    far = missions.far_edges(PAPER)
    assert sorted(map(tuple, PAPER[far])) == sorted(
        {(3, y) for y in (6, 11, 16, 21, 26)} | {(x, 26) for x in (3, 8, 13, 18, 23)}
    )


def test_division():
    assert missions.share_of_main_uav(np.array([[3, 0], [0, 5]])) == 1
    assert missions.share_of_main_uav(np.array([[3, 5], [3, 5]])) == 0.5
    assert missions.share_of_main_uav(np.array([[4, 1], [0, 3]])) == 7 / 8
    assert np.isnan(missions.share_of_main_uav(np.zeros((2, 2))))


@pytest.mark.parametrize(
    ("first", "second", "share"),
    [
        ([1, 0, 1, 0], [0, 1, 0, 1], 1.0),  # left and right
        ([1, 1, 0, 0], [0, 0, 1, 1], 1.0),  # top and bottom
        ([1, 0, 0, 0], [0, 1, 1, 1], 1.0),  # a corner
        # Crosswise: a line leaves one on the wrong side.
        ([1, 0, 0, 1], [0, 1, 1, 0], 0.75),
        ([4, 0, 0, 1], [0, 3, 2, 0], 0.9),  # that one is the least
        ([1, 1, 1, 1], [1, 1, 1, 1], 0.5),
        ([5, 1, 0, 0], [0, 0, 0, 0], 1.0),  # all on one side
    ],
)
def test_sectors(first, second, share):
    assert missions.share_in_own_sector(np.array([first, second]), SQUARE) == pytest.approx(share)
    assert missions.share_in_own_sector(np.array([second, first]), SQUARE) == pytest.approx(share)


def test_sectors_of_no_data_and_of_one_node():
    assert np.isnan(missions.share_in_own_sector(np.zeros((2, 4)), SQUARE))
    assert missions.share_in_own_sector(np.array([[3.0], [1.0]]), SQUARE[:1]) == 0.75


@given(st.floats(0, 2 * np.pi), st.floats(-12, 12))
def test_any_straight_line_makes_sectors(angle, offset):
    """Whatever way it runs, also beside the rows and columns of the paper's grid."""
    one = (PAPER - (13, 16)) @ (np.cos(angle), np.sin(angle)) < offset
    data = np.array([one, ~one], float)
    assert missions.share_in_own_sector(data, PAPER) == pytest.approx(1)


@pytest.mark.parametrize(
    ("scenario", "ends", "batteries", "words"),
    [
        (SHEET, ["landed", "landed"], [3, 3], "all UAVs landed"),
        (
            SHEET,
            ["landed", "battery"],
            [3, 0],
            "1 of 2 UAVs deplete their battery, so it counts 0",
        ),
        (
            {},
            ["quota", "quota"],
            [9, 8],
            "all UAVs filled their quota and have the battery for the way home",
        ),
        (
            {},
            ["quota", "quota"],
            [9, 7],
            "all UAVs filled their quota, but 1 of 2 have no battery left for the way home",
        ),
    ],
)
def test_the_end_of_a_mission_says_whether_uavs_can_fly_home(
    scenario, ends, batteries, words, tmp_path
):
    """A mission without a quota fills none, and a UAV that has landed is home."""
    space = load_scenario(write_scenario(tmp_path, **scenario))
    uavs = pd.DataFrame({"end": ends, "battery": batteries, "way_home": 8})
    mission = LoggedMission("greedy", space, {}, uavs, pd.DataFrame())
    assert missions.end_in_words(mission) == words


def test_the_answer_counts_the_uavs_that_run_empty():
    """It does not say that they charge in time."""

    class Record(dict[str, float]):
        slots = 100

    def mission(*ends: str) -> SimpleNamespace:
        uavs = pd.DataFrame({"end": ends, "battery": 0, "way_home": 0})
        record, fleet = Record(collection_ratio=0.5), f"{len(ends)} UAVs"
        return SimpleNamespace(policy="random", fleet=fleet, record=record, uavs=uavs)

    said = missions.shared_collection_sentence(
        [mission("quota", "battery"), mission("battery", "battery", "quota")]
    )
    assert "3 of 5 UAVs run out of battery in them." in said and "before" not in said
    assert "No UAV runs out of battery in them." in missions.shared_collection_sentence(
        [mission("quota", "quota")]
    )
