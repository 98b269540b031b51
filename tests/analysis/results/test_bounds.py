"""The bounds of a study are stored, resumed, checked on reading, and added to its missions."""

import json
import shutil

import numpy as np
import pandas as pd
import pytest

from dess import InputError
from dess.analysis import load_results, run_study
from dess.analysis.bound import Bound
from dess.analysis.execution import jobs, runner
from dess.analysis.results.chunks import Chunk
from dess.analysis.results.manifest import CellPart
from dess.analysis.results.parquet import table_of_bounds, write
from dess.analysis.results.store import Store
from tests.analysis.small import files_of, small_study

NODES = 3  # of the small scenario


def made_up(space, seed, replication, **_):
    """A bound that depends on the mission alone, and takes no time."""
    uavs = space.uavs[1]
    generator = np.random.default_rng([seed, replication, uavs])
    prices = generator.random((2, len(space.nodes)))
    return Bound(0.9 + 0.1 * generator.random(), prices, np.array([5, 30]), uavs)


@pytest.fixture(autouse=True)
def fast(monkeypatch):
    monkeypatch.setattr(jobs, "upper_bound", made_up)
    monkeypatch.setattr(runner, "BOUNDS_CHUNK", 3)


def bounded(folder, **changes):
    return small_study(folder, **{"bounds": True, "missions": 7} | changes)


@pytest.fixture
def out(tmp_path):
    """The results folder of a study with bounds."""
    run_study(bounded(tmp_path), tmp_path / "out")
    return tmp_path / "out"


def test_stored_bounds_are_those_computed(out):
    results = load_results(out)
    assert [*results.bounds] == [(0, number) for number in range(7)]
    for (_, number), bound in results.bounds.items():
        computed = made_up(results.scenario(), 7, number)
        assert bound.ratio == computed.ratio
        assert bound.iterations == computed.iterations
        np.testing.assert_array_equal(bound.prices, computed.prices)
        np.testing.assert_array_equal(bound.cuts, computed.cuts)


def test_the_gap_of_a_mission_is_its_bound_minus_its_product(out):
    missions = load_results(out).missions
    assert [*missions.columns[-2:]] == ["upper_bound", "optimality_gap"]
    greedy, random = (missions[missions["policy"] == p] for p in ("greedy", "random"))
    # Once for all policies.
    assert greedy["upper_bound"].tolist() == random["upper_bound"].tolist()
    product = missions["collection_ratio_and_communication"]
    pd.testing.assert_series_equal(
        missions["optimality_gap"], missions["upper_bound"] - product, check_names=False
    )


@pytest.mark.parametrize("after", [1, 4])
def test_a_run_that_was_interrupted_ends_with_the_same_bytes(after, tmp_path, monkeypatch):
    run_study(bounded(tmp_path), tmp_path / "undisturbed")
    calls = 0

    def interrupted(*arguments, **options):
        nonlocal calls
        calls += 1
        if calls == after:
            raise KeyboardInterrupt
        return made_up(*arguments, **options)

    with monkeypatch.context() as patch:
        patch.setattr(jobs, "upper_bound", interrupted)
        with pytest.raises(KeyboardInterrupt):
            run_study(bounded(tmp_path), tmp_path / "out")
    calls, done = 0, []
    monkeypatch.setattr(jobs, "upper_bound", lambda *a, **o: done.append(a[2]) or made_up(*a, **o))
    run_study(bounded(tmp_path), tmp_path / "out")
    assert len(done) == 7 - 3 * ((after - 1) // 3)  # whole chunks are kept
    assert files_of(tmp_path / "out") == files_of(tmp_path / "undisturbed")


def test_bounds_can_be_added_to_a_study_and_more_missions_to_bounds(tmp_path):
    plain = bounded(tmp_path, bounds=False)
    before = run_study(plain, tmp_path / "out").missions
    more = run_study(bounded(tmp_path), tmp_path / "out").missions
    pd.testing.assert_frame_equal(more[before.columns], before)
    assert len(run_study(bounded(tmp_path, missions=9), tmp_path / "out").bounds) == 9
    with pytest.raises(InputError, match="holds bounds, which study trial does not have"):
        run_study(plain, tmp_path / "out")


def test_bounds_are_as_many_as_the_missions_of_any_policy(tmp_path):
    targets = {"success": {"absolute": 0.2}, "reward": {"relative": 0.2}}
    rule = {"first": 5, "look_ahead": 3, "budget": 60, "targets": targets}
    results = run_study(small_study(tmp_path, bounds=True, precision=rule), tmp_path / "out")
    counts = [n for (n,) in results.manifest["missions"]]
    assert len(results.bounds) == max(counts) > min(counts)


def test_a_bound_that_cannot_be_computed_is_a_failure_of_its_chunk(tmp_path, monkeypatch):
    def failing(space, seed, replication, **_):
        if replication == 4:
            raise ZeroDivisionError("no bound")
        return made_up(space, seed, replication)

    monkeypatch.setattr(jobs, "upper_bound", failing)
    with pytest.raises(runner.ChunkError) as error:
        run_study(bounded(tmp_path), tmp_path / "out")
    ((path, failure),) = error.value.failures.items()
    assert json.loads(path.read_text())["error"] == failure.error == "ZeroDivisionError: no bound"
    assert failure.policy == "the upper bound"
    assert failure.command.startswith("dess study run")
    with pytest.raises(InputError, match="incomplete"):
        load_results(tmp_path / "out")


def test_two_files_with_different_bounds_of_a_mission_are_refused(out, tmp_path):
    """Such as after files of two folders were merged."""
    manifest = Store.read(out).manifest
    part = CellPart(manifest.bound_cells[0], range(2, 4))
    chunk = Chunk(part.cell.team, (part,))
    other = [Bound(0.5, np.ones((1, NODES)), np.array([9]), 1)] * 2
    write(out / "bounds", chunk.name, table_of_bounds(chunk, other))
    with pytest.raises(InputError, match="two files have different records"):
        load_results(out)


@pytest.mark.parametrize("prices", [np.ones((2, 2)), np.zeros((0, 3))])
def test_prices_that_are_not_as_many_for_every_cut_are_damaged(out, prices):
    manifest = Store.read(out).manifest
    chunk = Chunk(-1, (CellPart(manifest.bound_cells[0], range(20, 21)),))
    cuts = np.arange(3 if len(prices) else 0)
    table = table_of_bounds(chunk, [Bound(1.0, prices, cuts, 4)])
    path = write(out / "bounds", chunk.name, table)
    assert Store.read(out).contents.damaged == [path]


def test_results_of_before_have_no_bounds(tmp_path):
    run_study(small_study(tmp_path), tmp_path / "out")
    path = tmp_path / "out" / "manifest.json"
    data = json.loads(path.read_text())
    del data["study"]["bounds"], data["bound_code"]
    path.write_text(json.dumps(data))
    shutil.rmtree(tmp_path / "out" / "bounds")
    assert load_results(tmp_path / "out").bounds == {}
    assert len(run_study(bounded(tmp_path, missions=10), tmp_path / "out").bounds) == 10
