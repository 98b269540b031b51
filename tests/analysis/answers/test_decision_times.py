"""Times of decisions are those of the calls alone, measured once and then kept."""

import pytest

from analysis import run_study
from analysis.answers import comparison
from analysis.answers.comparison import CALLS, Pair
from dess import InputError, simulate
from policies import load
from tests.analysis.small import small_study

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
def results(tmp_path_factory):
    folder = tmp_path_factory.mktemp("times")
    (folder / "timed_here.py").write_text(
        "from policies.heuristics import Greedy\nclass Mine(Greedy):\n    pass\n"
    )
    policies = ["greedy", f"{folder / 'timed_here.py'}:Mine", "random,greedy"]
    return run_study(small_study(folder, policies=policies, missions=2), folder / "trial")


@pytest.fixture(scope="module")
def measured(results):
    """Calls that all take 2 ticks, with a tick in between."""
    return comparison.measure(results, Ticks(TICK, 2 * TICK))


def test_times_are_those_of_the_calls_alone(measured):
    for cost in measured.costs:
        assert cost.median == cost.slow == 2 * TICK


def test_calls_are_those_of_whole_missions(measured, results):
    """And no file of the results is run."""
    assert [cost.policy for cost in measured.costs] == ["greedy", "random,greedy"]
    calls, greedy = 0, load("greedy")

    class Counting:
        name = "greedy"

        def act(self, view):
            nonlocal calls
            calls += 1
            return greedy.act(view)

    for replication in range(CALLS):
        if calls < CALLS:
            simulate(results.scenario(), Counting(), 7, replication)
    assert measured.costs[0].calls == calls >= CALLS


def test_slow_calls_make_the_upper_quantile(results):
    """Of ten calls one takes 9 ticks, the others one."""
    clock = Ticks(*([0.0, TICK] * 9), 0.0, 9 * TICK)
    cost = comparison.measure(results, clock).costs[0]
    assert (cost.median, cost.slow) == (TICK, 9 * TICK)


def test_they_are_measured_once_for_the_same_results(results, tmp_path, monkeypatch):
    with pytest.raises(InputError, match=r"times-\w+.json: no such file; .* dess report"):
        comparison.read(tmp_path, results)
    steps = []
    comparison.make(tmp_path, results, lambda *step: steps.append(step))
    assert steps == [(1, 3), (2, 3), (3, 3)]
    kept = comparison.read(tmp_path, results)
    monkeypatch.delattr(comparison, "measure")
    comparison.make(tmp_path, results)
    assert comparison.read(tmp_path, results) == kept


def test_remarks_compare_the_pair_and_name_what_was_not_timed(measured, results):
    text = comparison.remarks(measured, results, Pair("random,greedy", "greedy", 1))
    assert "random,greedy takes 1 times as long as greedy." in text
    assert text.endswith(f"Not timed: {results.policies[1]}.")
    assert measured.processor in text
    without = comparison.remarks(measured, results, Pair("greedy", "tour", 1))
    assert "times as long" not in without
