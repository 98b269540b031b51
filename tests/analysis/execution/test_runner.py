import errno
from pathlib import Path

import pandas as pd
import pytest

from dess import InputError, simulate
from dess.analysis import load_results, run_study
from dess.analysis.execution import jobs
from dess.analysis.results import parquet, store
from dess.model.record import MISSION_RECORD
from dess.policies import load_team
from dess.policies.heuristics import Greedy
from tests.analysis.small import files_of, grid, small_study


def assert_same(ours, other):
    pd.testing.assert_frame_equal(ours.missions, other.missions)
    pd.testing.assert_frame_equal(ours.uavs, other.uavs)


def test_a_mission_of_a_study_equals_the_same_one_alone(tmp_path):
    study = small_study(tmp_path, policies=["greedy,tour"])
    results = run_study(study, tmp_path / "out")
    for replication in (0, 4, 9):
        alone = simulate(study.scenarios[0], load_team("greedy,tour"), study.seed, replication)
        row = results.missions.iloc[replication]
        assert {name: row[name] for name in MISSION_RECORD.names} == {
            name: alone.metrics[name].item() for name in MISSION_RECORD.names
        }
        uavs = results.uavs[results.uavs["replication"] == replication]
        assert (
            uavs[["quota", "battery", "slots_charging", "end"]].to_dict("records")
            == alone.uav_rows()
        )


def test_equal_runs_have_equal_bytes_under_any_number_of_workers(tmp_path):
    study = small_study(tmp_path, design=grid(uavs=[1, 3]), logged=2)
    done: list[int] = []
    for workers in (1, 2):
        run_study(study, tmp_path / str(workers), workers, progress=done.append)
        assert sum(done) == (40 + 8) * workers  # missions and event logs
    assert files_of(tmp_path / "1") == files_of(tmp_path / "2")
    assert str(tmp_path) not in (tmp_path / "1" / "manifest.json").read_text()


def test_raising_the_missions_tops_up_and_lowering_loads_fewer(tmp_path):
    few, many = (small_study(tmp_path, missions=n) for n in (10, 21))
    at_once = run_study(many, tmp_path / "at_once")
    run_study(few, tmp_path / "out")
    before, done = files_of(tmp_path / "out"), []
    assert_same(run_study(many, tmp_path / "out", progress=done.append), at_once)
    assert done[0] == 2 * 10  # kept
    after = files_of(tmp_path / "out")
    assert all(after[name] == before[name] for name in before if name != "manifest.json")
    lowered = run_study(few, tmp_path / "out")
    assert_same(lowered, run_study(few, tmp_path / "few"))


def test_a_slow_policy_is_stored_in_chunks_of_its_own_size(tmp_path, monkeypatch):
    whole = run_study(small_study(tmp_path), tmp_path / "whole")
    monkeypatch.setattr(Greedy, "chunk", 3, raising=False)
    parts = run_study(small_study(tmp_path), tmp_path / "parts")
    assert_same(whole, parts)
    counts = [
        sorted(
            len(pd.read_parquet(path))
            for path in (tmp_path / "parts" / "missions" / f"policy={policy}").iterdir()
        )
        for policy in ("greedy", "random")
    ]
    assert counts == [[1, 3, 3, 3], [2, 4, 4]]


def test_policies_and_points_can_be_added(tmp_path):
    run_study(small_study(tmp_path, design=grid(uavs=[2])), tmp_path / "out")
    more = small_study(
        tmp_path, design=grid(uavs=[1, 2]), policies=["tour", "greedy", "random"], logged=1
    )
    done: list[int] = []
    extended = run_study(more, tmp_path / "out", progress=done.append)
    assert done[0] == 2 * 10
    assert_same(extended, run_study(more, tmp_path / "fresh"))


def check_that_an_interrupted_run_is_completed(study, folder, after, workers):
    """Interrupt a run after some missions, and run it again."""
    done = 0

    def interrupt(missions: int) -> None:
        nonlocal done
        done += missions
        if done >= after:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run_study(study, folder / "out", progress=interrupt)
    with pytest.raises(InputError, match="incomplete.*"):
        load_results(folder / "out")
    run_study(study, folder / "out", workers)
    run_study(study, folder / "undisturbed")
    assert files_of(folder / "out") == files_of(folder / "undisturbed")


def precise(folder):
    """A study that runs until the success of every cell is known well enough."""
    targets = {"success": {"absolute": 0.2}, "reward": {"relative": 0.2}}
    rule = {"first": 5, "look_ahead": 3, "budget": 60, "targets": targets}
    return small_study(folder, precision=rule, design=grid(quota=[20, 60]))


def selecting(folder, design=None, budget=160):
    """A study that selects the best of some settings."""
    rule = {"procedure": "kn", "metric": "collection_ratio", "indifference": 0.02}
    rule |= {"first": 8, "budget": budget, "check": 5}
    return small_study(folder, selection=rule, design=design or grid(quota=[20, 40, 60, 80]))


def test_precision_decides_how_many_missions_there_are(tmp_path):
    study = precise(tmp_path)
    results = run_study(study, tmp_path / "out")
    counts = results.missions.groupby(["policy", "point"], sort=False).size()
    assert counts.nunique() > 1  # or this test says little
    assert counts.tolist() == [n for of_team in results.manifest["missions"] for n in of_team]
    fields = ["success", "reward"]
    for (_, _), cell in results.missions.groupby(["policy", "point"]):
        assert cell["replication"].tolist() == [*range(len(cell))]
        assert study.precision.wanted([{f: cell[f].to_numpy() for f in fields}]) == [len(cell)]


def test_an_interrupt_in_compiled_code_is_an_interrupt(tmp_path, monkeypatch):
    """numba makes it a SystemError; the chunk has not failed."""

    def run(*_):
        raise SystemError("returned a result with an exception set") from KeyboardInterrupt()

    monkeypatch.setattr(jobs.MissionsJob, "run", run)
    with pytest.raises(KeyboardInterrupt):
        run_study(small_study(tmp_path), tmp_path / "out")
    assert not [*(tmp_path / "out" / "failures").iterdir()]


@pytest.mark.parametrize("kind", [precise, selecting])
@pytest.mark.parametrize(
    ("after", "workers"),
    [(47, 1), *(pytest.param(after, 2, marks=pytest.mark.slow) for after in (11, 47, 71))],
)
def test_an_interrupted_run_of_rounds_is_completed(kind, after, workers, tmp_path):
    check_that_an_interrupted_run_is_completed(kind(tmp_path), tmp_path, after, workers)


def test_a_saltelli_design_runs_every_point_at_its_own_replication(tmp_path):
    design = {"kind": "saltelli", "base": 4, "ranges": {"uavs": [1, 2], "quota": [20, 60]}}
    study = small_study(tmp_path, policies=["greedy"], missions=1, design=design)
    missions = run_study(study, tmp_path / "out").missions
    assert missions["point"].tolist() == [*range(len(study.points))]
    assert missions["replication"].tolist() == [point.replication for point in study.points]
    assert missions["replication"].nunique() > 4


def test_points_that_are_one_scenario_share_their_missions(tmp_path):
    """Where a list holds the scenario's own value, or drawn integers fall together."""
    values = {"quota": [20, 60], "flying_time": [[20, 30], 20]}
    study = selecting(tmp_path, {"kind": "one-at-a-time", "values": values}, budget=60)
    results = run_study(study, tmp_path / "out")
    cells = results.store.manifest.cells[0]
    assert cells[1].key == cells[2].key
    for counts in results.manifest["missions"]:
        assert sum(counts) <= 60
    sizes = results.missions.groupby(["policy", "point"], sort=False).size().tolist()
    assert sizes == [n for of_team in results.manifest["missions"] for n in of_team]
    stored = pd.read_parquet(tmp_path / "out" / "missions" / "policy=greedy")
    assert not stored.duplicated(["cell", "replication"]).any()


def test_the_missions_of_rounds_end_in_the_files_of_one(tmp_path, monkeypatch):
    """Asked again, nothing is written; after an end between writing and deleting, it goes on."""
    study, folder = selecting(tmp_path), tmp_path / "out"
    monkeypatch.setattr(store.Store, "merge", lambda *_: None)
    before = run_study(study, folder)
    many = [*folder.rglob("*.parquet")]
    monkeypatch.undo()
    with monkeypatch.context() as patch, pytest.raises(KeyboardInterrupt):
        patch.setattr(store, "delete", raises(KeyboardInterrupt()))
        run_study(study, folder)
    merged = run_study(study, folder)
    few = [*folder.rglob("*.parquet")]
    assert len(few) == 2 * len(study.policies) < len(many)
    for old, new in ((before, merged), (before, load_results(folder))):
        pd.testing.assert_frame_equal(old.missions, new.missions)
        pd.testing.assert_frame_equal(old.checks, new.checks)
        pd.testing.assert_frame_equal(old.uavs, new.uavs)
    monkeypatch.setattr(parquet, "write", raises(AssertionError()))
    run_study(study, folder)
    assert [*folder.rglob("*.parquet")] == few


def test_a_full_disk_is_no_failure_of_a_chunk(tmp_path, monkeypatch):
    """Neither where results are stored nor where numba keeps compiled code: one line says it."""
    write, full = parquet.write, OSError(errno.ENOSPC, "No space left on device")

    def fill_up(folder, name, table):
        with monkeypatch.context() as patch, pytest.raises(InputError) as refusal:
            patch.setattr(Path, "write_bytes", raises(full))
            write(folder, name, table)
        raise refusal.value

    monkeypatch.setattr(parquet, "write", fill_up)
    with pytest.raises(InputError, match="parquet: cannot be written: No space left on device"):
        run_study(small_study(tmp_path), tmp_path / "out")
    assert files_of(tmp_path / "out").keys() == {"manifest.json"}
    monkeypatch.setattr(jobs, "simulate_missions", raises(full))
    with pytest.raises(InputError, match="greedy: No space left on device"):
        run_study(small_study(tmp_path), tmp_path / "out")


def raises(error):
    def fail(*_, **__):
        raise error

    return fail
