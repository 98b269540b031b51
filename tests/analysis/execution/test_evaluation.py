"""Evaluations of any number of missions: their means, and the memory that they take."""

import pytest

from dess import InputError, load_scenario
from dess.analysis.execution import effort, evaluation
from dess.analysis.execution.evaluation import Asked, check_evaluation, estimate_means, evaluate
from dess.analysis.metrics import metric_group
from dess.analysis.stats.intervals import interval_of
from dess.analysis.stats.weights import post_stratified
from dess.base.files import memory

SPACE = load_scenario("paper", quota=30)


@pytest.fixture
def handed(monkeypatch):
    """The replications that the batch engine is given at a time."""
    calls = []
    simulate = evaluation.simulate_batch

    def counted(scenario, team, seed, replications, **options):
        calls.append(replications)
        return simulate(scenario, team, seed, replications, **options)

    monkeypatch.setattr(evaluation, "simulate_batch", counted)
    return calls


def test_means_are_those_of_all_records(monkeypatch, handed):
    records = evaluate(SPACE, "greedy,random", 300, 5).records.missions
    found = estimate_means(Asked(SPACE, "greedy,random", 300, 5, workers=2))
    for metric in metric_group("paper", "reward"):
        values = post_stratified(records[metric], records["uavs"])
        expected = pytest.approx(interval_of(metric, values), rel=1e-12)
        assert found.moments[metric].interval(metric) == expected
    assert found.uav_slots == records["uav_slots"].sum()
    events = estimate_means(Asked(SPACE, "greedy,random", 300, 5, "events"))
    assert events.moments == found.moments
    # 32 missions of three UAVs.
    monkeypatch.setattr(evaluation, "MEMORY", 20_000)
    handed.clear()
    pieces = estimate_means(Asked(SPACE, "greedy,random", 300, 5))
    assert handed == [1, *(range(n, min(n + 32, 300)) for n in range(0, 300, 32))]
    for metric in metric_group("paper", "reward"):
        assert pieces.moments[metric] == pytest.approx(found.moments[metric], rel=1e-12)


def test_the_missions_that_are_simulated_together_do_not_grow(handed):
    size = evaluation._missions_at_once(SPACE)
    fleets = [load_scenario("paper", uavs=n) for n in (1, 16)]
    assert evaluation._missions_at_once(fleets[0]) > size > evaluation._missions_at_once(fleets[1])
    records = evaluate(SPACE, "random", 2).records
    assert sum(kind.nbytes for kind in records) / 2 * size <= evaluation.MEMORY


def test_what_takes_too_much_is_refused_before_it_begins(monkeypatch, handed):
    monkeypatch.setattr(effort, "LONG_RUN", 500.0)
    check_evaluation([Asked(SPACE, "random", 1_000_000)])
    two = [Asked(SPACE, team, 10**9, workers=4) for team in ("random", "greedy")]
    line = r"evaluate: 2,000,000,000 missions \(policies: 2, workers: 4\), "
    line += "about 89 minutes to 13 hours; allowed"
    with pytest.raises(InputError, match=f"{line}: --yes, or less"):
        check_evaluation(two)
    check_evaluation([Asked(SPACE, "random", 10**9)], yes=True)
    monkeypatch.setattr(memory, "available_memory", lambda: 2**20)
    with pytest.raises(InputError, match=r"GiB of memory, of which 0.0 are available"):
        check_evaluation([Asked(SPACE, "random", 10)])
    assert handed == []
