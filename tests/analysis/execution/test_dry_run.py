import pytest

from analysis import run_study
from analysis.execution import dry_run, effort
from analysis.execution.dry_run import budget, check_effort, plan_study
from analysis.execution.effort import LONG_TRIAL, ONE, TRIAL
from dess import InputError
from dess.code import memory
from tests.analysis.small import files_of, grid, small_study


class Clock:
    """Every look at it is that many seconds after the last one."""

    def __init__(self, step):
        self.now, self.step = 0.0, step

    def __call__(self):
        self.now += self.step
        return self.now


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
    assert [p.seconds for p in done] == [0.0]


@pytest.mark.parametrize(("step", "trial"), [(60.0, ONE), (1.0, TRIAL), (0.01, LONG_TRIAL)])
def test_the_time_is_that_of_a_trial(step, trial, tmp_path):
    plan = plan_study(small_study(tmp_path), tmp_path / "out", clock=Clock(step))
    assert [p.seconds for p in plan] == pytest.approx([10 * step / trial] * 2)


def test_event_logs_take_time_as_well(tmp_path):
    logged = small_study(tmp_path, logged=4)
    plan = plan_study(logged, tmp_path / "out", clock=Clock(1.0))
    assert [p.seconds for p in plan] == pytest.approx([(10 + 4) / TRIAL] * 2)
    run_study(logged, tmp_path / "out")
    assert [p.seconds for p in plan_study(logged, tmp_path / "out")] == [0.0, 0.0]


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


def test_a_long_run_has_to_be_confirmed(tmp_path, monkeypatch):
    study, out = small_study(tmp_path), tmp_path / "out"
    check_effort(study, out, clock=Clock(1e9))  # few missions are run without a trial
    monkeypatch.setattr(dry_run, "FEW", 19)
    monkeypatch.setattr(effort, "FEW", 19)
    check_effort(study, out, clock=Clock(1.0))
    before = files_of(tmp_path)
    line = (
        r"study trial: 20 missions to simulate \(policies: 2, design points: 1, workers: 2\), "
        r"about 3 hours; allowed: --yes, or less"
    )
    with pytest.raises(InputError, match=line):
        check_effort(study, out, workers=2, clock=Clock(3 * 3600 * 2 / 20))
    check_effort(study, out, clock=Clock(1e9), yes=True)
    assert files_of(tmp_path) == before
    run_study(study, out)
    check_effort(study, out, clock=Clock(1e9))  # all of it is there


def test_missions_are_counted_and_not_listed(tmp_path, monkeypatch):
    study = small_study(tmp_path, missions=10**9)
    monkeypatch.setattr(memory, "available_memory", lambda: 2**40)
    line = r"2,000,000,000 missions .*: about 2,23\d\.\d GiB of memory, of which 1,024.0 are avail"
    with pytest.raises(InputError, match=line):
        check_effort(study, tmp_path / "out", clock=Clock(0.0))
    assert [p.missions for p in plan_study(study, tmp_path / "out")] == [10**9] * 2


def test_bounds_are_part_of_the_plan_and_of_the_time(tmp_path, monkeypatch):
    monkeypatch.setattr(dry_run, "upper_bound", lambda *_, **__: None)
    study = small_study(tmp_path, bounds=True)
    plan = plan_study(study, tmp_path / "out", clock=Clock(60.0))
    assert (plan[2].missions, plan[2].present, plan[2].seconds) == (10, 0, 600.0)
    assert len(plan_study(small_study(tmp_path), tmp_path / "out")) == 2
