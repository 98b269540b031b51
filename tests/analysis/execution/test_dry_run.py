import pytest

from analysis import run_study
from analysis.execution import effort
from analysis.execution.dry_run import budget, check_run, plan_study, total
from analysis.execution.effort import BOUND, SPREAD, START, Range
from dess import InputError
from dess.code import memory
from tests.analysis.small import files_of, grid, small_study


def test_a_plan_counts_and_writes_nothing(tmp_path):
    study = small_study(tmp_path, design=grid(uavs=[1, 2]))
    before = files_of(tmp_path)
    plan = plan_study(study, tmp_path / "out")
    assert [(p.policy, p.missions, p.present) for p in plan] == [
        ("greedy", 20, 0),
        ("random", 20, 0),
    ]
    assert files_of(tmp_path) == before


def test_a_plan_knows_what_is_there(tmp_path):
    run_study(small_study(tmp_path, policies=["greedy"]), tmp_path / "out")
    before = files_of(tmp_path / "out")
    plan = plan_study(small_study(tmp_path, missions=25), tmp_path / "out")
    assert [(p.missions, p.present) for p in plan] == [(25, 10), (25, 0)]
    assert files_of(tmp_path / "out") == before
    done = plan_study(small_study(tmp_path, policies=["greedy"]), tmp_path / "out")
    assert [p.seconds for p in done] == [(0.0, 0.0)]
    assert total(done, 1) == (0.0, 0.0)


DECISIONS = 2 * 60 / 4  # of a mission of the small scenario


def test_the_time_is_a_range_and_nothing_is_simulated(tmp_path, monkeypatch):
    monkeypatch.setattr("analysis.execution.engines.simulate", None)
    monkeypatch.setattr("analysis.execution.engines.simulate_batch", None)
    study = small_study(tmp_path, policies=["greedy", "planner"])
    plan = plan_study(study, tmp_path / "out")
    expected = [10 * DECISIONS * each for each in (2e-6, 4e-4)]
    for planned, seconds in zip(plan, expected, strict=True):
        assert planned.seconds == pytest.approx((seconds / SPREAD, seconds * SPREAD))
    ends = sum(expected) / 2 / SPREAD, sum(expected) / 2 * SPREAD + START
    assert total(plan, 2) == pytest.approx(ends)
    assert str(Range(1.0, 90.0)) == "up to 90 seconds"
    assert str(Range(5.0, 90.0)) == "5 to 90 seconds"
    assert str(Range(5.0, 240.0)) == "5 seconds to 4 minutes"


def test_event_logs_take_time_as_well(tmp_path):
    logged, plain = small_study(tmp_path, logged=4), small_study(tmp_path)
    plans = [plan_study(study, tmp_path / "out") for study in (logged, plain)]
    for more, less in zip(*plans, strict=True):
        assert more.seconds.low - less.seconds.low == pytest.approx(4 * DECISIONS * 1.2e-5 / SPREAD)
    run_study(logged, tmp_path / "out")
    assert [p.seconds for p in plan_study(logged, tmp_path / "out")] == [(0.0, 0.0)] * 2


def test_a_rule_has_a_least_and_a_most(tmp_path):
    targets = {"success": {"absolute": 0.1}}
    precise = {"first": 5, "look_ahead": 5, "budget": 50, "targets": targets}
    design = grid(uavs=[1, 2])
    study = small_study(tmp_path, precision=precise, design=design)
    assert [p.missions for p in plan_study(study, tmp_path / "out")] == [2 * 5] * 2
    assert budget(study) == 2 * 2 * 50
    rule = {
        "procedure": "kn",
        "metric": "collection_ratio",
        "first": 8,
        "indifference": 0.1,
        "budget": 200,
        "check": 7,
    }
    study = small_study(tmp_path, selection=rule, design=design)
    assert [p.missions for p in plan_study(study, tmp_path / "out")] == [2 * 8] * 2
    assert budget(study) == 2 * (200 + 7)
    run_study(study, tmp_path / "out")
    done = plan_study(study, tmp_path / "out")
    assert all(p.missions == p.present > 7 for p in done)


def test_a_plan_refuses_what_a_run_would(tmp_path):
    with pytest.raises(InputError, match="holds other files"):
        plan_study(small_study(tmp_path), tmp_path)
    with pytest.raises(InputError, match="workers: 0 is out of range"):
        plan_study(small_study(tmp_path), tmp_path / "out", workers=0)


def test_a_run_that_is_surely_long_has_to_be_confirmed(tmp_path, monkeypatch):
    """The lower end of the range decides; what may be long is run."""
    study, out = small_study(tmp_path), tmp_path / "out"
    ends = total(plan_study(study, out, workers=2), 2)
    monkeypatch.setattr(effort, "LONG_RUN", ends.low * 1.01)
    check_run(study, out, workers=2)
    monkeypatch.setattr(effort, "LONG_RUN", ends.low * 0.99)
    before = files_of(tmp_path)
    line = (
        r"study trial: 20 missions to simulate \(policies: 2, design points: 1, workers: 2\), "
        r"about up to 15 seconds; allowed: --yes, or less"
    )
    with pytest.raises(InputError, match=line):
        check_run(study, out, workers=2)
    check_run(study, out, yes=True)
    assert files_of(tmp_path) == before
    run_study(study, out)
    check_run(study, out)  # all of it is there


def test_missions_are_counted_and_not_listed(tmp_path, monkeypatch):
    study = small_study(tmp_path, missions=10**9)
    monkeypatch.setattr(memory, "available_memory", lambda: 2**40)
    monkeypatch.setattr(effort, "LONG_RUN", 1e9)
    line = r"2,000,000,000 missions .*: about 2,23\d\.\d GiB of memory, of which 1,024.0 are avail"
    with pytest.raises(InputError, match=line):
        check_run(study, tmp_path / "out")
    assert [p.missions for p in plan_study(study, tmp_path / "out")] == [10**9] * 2


def test_bounds_are_part_of_the_plan_and_of_the_time(tmp_path):
    study = small_study(tmp_path, bounds=True)
    plan = plan_study(study, tmp_path / "out")
    assert (plan[2].missions, plan[2].present) == (10, 0)
    assert plan[2].seconds == pytest.approx([10 * DECISIONS * each for each in BOUND])
    assert len(plan_study(small_study(tmp_path), tmp_path / "out")) == 2
