"""Times of decisions in words: those of the policies of a study, as they were kept."""

from types import SimpleNamespace

import pytest

from analysis.execution.decision_time import Cost
from analysis.questions import decision_costs
from analysis.questions.head_to_head import Pair
from analysis.results.provenance import Member


def cost(policy, median):
    member = Member(name=policy, **{"class": "m:C"}, code="0" * 64)
    return Cost(policy=policy, members=[member], calls=4, rows=6, median=median, slow=2 * median,
                batch_rows=1200, batch=median / 10)  # fmt: skip


@pytest.fixture
def times():
    return SimpleNamespace(
        costs=[cost("greedy", 2e-6), cost("ddqn", 5e-4)],
        missions=30,
        scenario="paper",
        space=SimpleNamespace(cell_size=800.0),
        processor="Chip",
        threads=1,
    )


def test_costs_come_in_the_order_of_the_study(times):
    def names(*policies):
        return [cost.policy for cost in decision_costs.timed(times, policies)]

    assert names("tour", "ddqn", "greedy") == ["ddqn", "greedy"]
    assert names("tour") == ["greedy", "ddqn"]  # none of the study: all that were timed


def test_a_line_has_the_speed_at_which_a_cell_takes_as_long_as_a_slow_call(times):
    _, line = decision_costs.listed(times, times.costs).to_numpy().tolist()
    assert line == ["ddqn", "500 µs", "1 ms", "1.50", "4", "50 µs", "1,200", "800,000"]


def test_remarks_compare_the_pair_and_name_what_was_not_timed_alike(times, monkeypatch):
    results = SimpleNamespace(
        policies=["greedy", "ddqn", "tour"], store=SimpleNamespace(manifest=None)
    )
    monkeypatch.setattr(decision_costs, "unlike", lambda times, manifest: ["greedy"])
    text = decision_costs.remarks(times, results, Pair("ddqn", "greedy", 1))
    assert "ddqn takes 250 times as long as greedy for one mission, by the medians." in text
    assert "Not timed: tour." in text
    assert text.endswith("Timed with other code or weights than those of the study: greedy.")
    without = decision_costs.remarks(times, results, Pair("tour", "greedy", 1))
    assert "times as long" not in without
