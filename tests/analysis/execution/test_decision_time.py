"""Times of decisions are those of the calls alone, and are kept with what they were measured on."""

import json
from collections import Counter

import numpy as np
import pytest

import dess
from analysis import load_results, run_study
from analysis.execution import decision_time
from analysis.execution.decision_time import ROUNDS
from analysis.results.provenance import engine_code, members_of
from dess import InputError, load_scenario, simulate, simulate_batch
from policies import load, load_team
from tests.analysis.small import small_study, write_scenario, write_timing

SEED, MISSIONS = 5, 6
TICK = 2.0**-10  # seconds, so that no sum of ticks is rounded


class Ticks:
    """A clock that goes on by its step whenever it is read."""

    def __init__(self, *steps):
        self.steps, self.reads, self.time = steps, 0, 0.0

    def __call__(self):
        self.time += self.steps[self.reads % len(self.steps)]
        self.reads += 1
        return self.time


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("timing")


@pytest.fixture(scope="module")
def scenario(folder):
    return write_scenario(folder)


@pytest.fixture(scope="module")
def measured(scenario):
    """Calls that all take 2 ticks, with a tick in between."""
    policies = ["greedy", "random,greedy"]
    return decision_time.measure(policies, scenario, SEED, MISSIONS, clock=Ticks(TICK, 2 * TICK))


class Counting:
    """A policy that counts its calls and their rows."""

    def __init__(self, policy):
        self.name, self.policy, self.rows = policy.name, policy, []

    def act(self, view):
        self.rows.append(len(view))
        return self.policy.act(view)


@pytest.mark.parametrize("policy", ["greedy", "random,greedy"])
def test_calls_and_rows_are_those_of_the_missions(measured, scenario, policy):
    (cost,) = (cost for cost in measured.costs if cost.policy == policy)
    team, space = [*map(Counting, load_team(policy))], load_scenario(scenario)
    for replication in range(MISSIONS):
        simulate(space, team, SEED, replication)
    rows = [n for member in team for n in member.rows]
    assert (cost.calls, cost.rows) == (len(rows), sum(rows))
    assert cost.batch_rows == cost.rows  # the same missions, whichever engine


def test_times_are_those_of_the_calls_alone(measured):
    for cost in measured.costs:
        assert cost.median == cost.slow == 2 * TICK


def test_the_batch_shares_a_call_among_its_rows(measured, scenario):
    team = [Counting(load("greedy"))]
    simulate_batch(load_scenario(scenario), team, SEED, MISSIONS)
    calls, rows = len(team[0].rows), sum(team[0].rows)
    assert calls < rows
    assert measured.costs[0].batch == pytest.approx(2 * TICK * calls / rows)


def test_slow_calls_make_the_upper_quantile(scenario):
    """Of ten calls one takes 9 ticks, the others one."""
    clock = Ticks(*([0.0, TICK] * 9), 0.0, 9 * TICK)
    cost = decision_time.measure(["greedy"], scenario, SEED, MISSIONS, clock=clock).costs[0]
    assert (cost.median, cost.slow) == (TICK, 9 * TICK)


def test_a_slow_policy_is_timed_on_fewer_missions(scenario, monkeypatch):
    """One call is enough of it, and a mission has several."""
    monkeypatch.setattr(decision_time, "ENOUGH", TICK)
    slow = decision_time.measure(["greedy"], scenario, SEED, 4, clock=Ticks(0.0, TICK)).costs[0]
    monkeypatch.undo()
    one, four = (
        decision_time.measure(["greedy"], scenario, SEED, n, clock=Ticks(0.0, TICK)).costs[0]
        for n in (1, 4)
    )
    assert slow == one
    assert one.calls < four.calls


def test_warm_up_does_not_count(scenario):
    """The first calls take an hour."""
    first = Counting(load("greedy"))
    simulate(load_scenario(scenario), first, SEED, 0)
    slow, reads = 2 * len(first.rows), 0

    def clock():
        nonlocal reads
        reads += 1
        return float(reads) if reads > slow else 3600.0 * reads

    cost = decision_time.measure(["greedy"], scenario, SEED, 1, clock=clock).costs[0]
    assert cost.calls == len(first.rows)
    assert cost.median == cost.slow == 1.0


def test_the_policies_decide_as_ever(measured, scenario):
    """They are asked through a wrapper, and still fly the same missions."""
    team = decision_time._Team("greedy", Ticks(1.0))
    ours = simulate(load_scenario(scenario), team.policies, SEED, 1)
    assert ours.metrics == simulate(load_scenario(scenario), load("greedy"), SEED, 1).metrics


def test_progress_ends_with_the_last_step(scenario):
    steps = []
    policies = ["greedy", "random"]
    decision_time.measure(
        policies, scenario, SEED, 3, Ticks(TICK), lambda *step: steps.append(step)
    )
    total = 2 * (1 + 3 + 1 + ROUNDS)
    assert steps == [(n, total) for n in range(1, total + 1)]


def test_it_is_told_what_was_measured_on_what(measured, scenario):
    assert (measured.version, measured.code) == (dess.__version__, engine_code())
    assert (measured.seed, measured.missions) == (SEED, MISSIONS)
    assert (measured.scenario, measured.space) == ("small.toml", load_scenario(scenario))
    assert measured.libraries["numpy"] == np.__version__ and "torch" in measured.libraries
    assert measured.processor and measured.cores >= 1 and measured.threads == 1
    assert [cost.members for cost in measured.costs] == [
        members_of("greedy"),
        members_of("random,greedy"),
    ]


def test_it_is_read_as_it_was_written(measured, tmp_path):
    path = write_timing(measured, tmp_path / "new" / "timing")
    assert path == tmp_path / "new" / "timing" / "timing.json"
    assert decision_time.read(path.parent) == measured
    before = path.read_bytes()
    write_timing(decision_time.read(path.parent), path.parent)
    assert path.read_bytes() == before
    assert str(tmp_path).encode() not in before


def damaged(measured, **changes):
    return json.dumps(json.loads(measured.model_dump_json(by_alias=True)) | changes)


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"seed": None}, "seed: "),
        ({"costs": []}, "costs: "),
        ({"host": "here"}, "host: unknown key"),
        ({"missions": 0}, "missions: "),
        ({"constants": {"quota": 0}}, "quota: "),
        ({"version": "0.0.0"}, r"made by dess 0\.0\.0 \(schema 1\)"),
    ],
)
def test_what_is_damaged_is_refused_in_a_line(measured, tmp_path, changes, complaint):
    (tmp_path / "timing.json").write_text(damaged(measured, **changes))
    with pytest.raises(InputError, match=f"timing.json: .*{complaint}") as error:
        decision_time.read(tmp_path)
    assert "\n" not in str(error.value)
    assert f"allowed: what is made by: dess timing --out {tmp_path}" in str(error.value)


def test_what_is_missing_or_no_json_is_refused_in_a_line(tmp_path):
    with pytest.raises(InputError, match="no such file; allowed: .* dess timing --out /"):
        decision_time.read(tmp_path / "none")
    (tmp_path / "timing.json").write_text("{")
    with pytest.raises(InputError, match="timing.json: not valid JSON: "):
        decision_time.read(tmp_path)
    (tmp_path / "timing.json").write_text("[]")
    with pytest.raises(InputError, match="timing.json: "):
        decision_time.read(tmp_path)


def test_a_policy_that_is_listed_twice_is_refused(measured, tmp_path):
    data = json.loads(measured.model_dump_json(by_alias=True))
    (tmp_path / "timing.json").write_text(json.dumps(data | {"costs": data["costs"][:1] * 2}))
    with pytest.raises(InputError, match="costs: a policy is listed twice"):
        decision_time.read(tmp_path)


def test_where_nothing_can_be_written_is_refused(measured, tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file: cannot be written: Not a directory"):
        write_timing(measured, tmp_path / "file")


@pytest.mark.parametrize(
    ("changes", "complaint"),
    [
        ({"policies": []}, "at least one of each"),
        ({"missions": 0}, "at least one of each"),
        ({"missions": 1001}, "1,000 missions at most"),
        ({"policies": ["none"]}, "policy: 'none' is unknown"),
        ({"scenario": "none"}, "none: no such scenario"),
        ({"seed": -1}, "seed"),
    ],
)
def test_what_cannot_be_measured_is_refused(changes, complaint):
    with pytest.raises(InputError, match=complaint):
        decision_time.measure(**{"policies": ["greedy"], "missions": 1} | changes)


def test_timed_with_other_code_or_weights_is_told(measured, folder):
    study = small_study(folder, policies=["greedy", "random,greedy", "nearest"], missions=2)
    run_study(study, folder / "out")
    manifest = load_results(folder / "out").store.manifest
    assert decision_time.unlike(measured, manifest) == []  # one that was not timed has no time
    greedy, team = measured.costs
    member = greedy.members[0].model_copy(update={"weights": "other"})
    changed = [greedy.model_copy(update={"members": [member]}), team]
    assert decision_time.unlike(measured.model_copy(update={"costs": changed}), manifest) == [
        "greedy"
    ]
    other = measured.model_copy(update={"code": "other"})
    assert decision_time.unlike(other, manifest) == ["greedy", "random,greedy"]


def test_every_policy_takes_its_turn(scenario, monkeypatch):
    """So that a slow machine slows down all of them alike."""
    flown = []
    monkeypatch.setattr(
        decision_time, "simulate", lambda *a: (flown.append(a[1][0].name), simulate(*a))
    )
    decision_time.measure(["greedy", "random"], scenario, SEED, 2, Ticks(TICK))
    assert flown == ["greedy", "random"] * 3
    assert Counter(flown) == {"greedy": 3, "random": 3}
