"""The search of the cheapest setting that meets requirements."""

import numpy as np
import pytest
from pydantic import ValidationError
from scipy import stats

from analysis.study.cheapest import Cheapest, Setting, _Search


def rule(**fields):
    defaults = {
        "procedure": "cheapest",
        "requirements": {"success": 0.99},
        "tolerance": 0.005,
        "indifference": 1000.0,
        "budget": 10**9,
    }
    return Cheapest.model_validate(defaults | fields)


def constant(success, costs, conditions=1, missions=5000):
    """Samples and settings without any noise; each fleet comes under every condition."""
    rows = zip(success, costs, strict=True)
    samples = [{"success": np.full(missions, s), "cost": np.full(missions, c)} for s, c in rows]
    places = (divmod(n, conditions) for n in range(len(costs)))
    return samples, [Setting({"uavs": f, "arrival_rate": c}, 0.0) for f, c in places]


def noisy(success, costs, conditions=1, missions=15_000):
    """The same with missions that fail now and then, and noise in the costs."""
    samples, settings = constant(success, costs, conditions, missions)
    generator = np.random.default_rng(3)
    for sample in samples:
        sample["success"] = (generator.random(missions) < sample["success"]).astype(float)
        sample["cost"] = sample["cost"] + generator.normal(0, 3000.0, missions)
    return samples, settings


RARE = noisy([0.985, 0.985, 0.985, 0.99, 0.995, 1.0], [40e3, 41e3, 42e3, 43e3, 44e3, 44.5e3])
CONDITIONS = noisy([0.995, 0.985, 1.0, 0.985, 0.995, 1.0], [40e3, 41e3, 42e3, 43e3, 44e3, 45e3], 2)


def test_a_cost_is_bounded_as_the_method_says():
    """By the t quantile of the differences, and by losses that have not been seen."""
    samples, settings = noisy([1.0, 1.0, 1.0], [50e3, 49e3, 48e3], missions=40)
    settings = [setting._replace(loss=7e4) for setting in settings]
    search = _Search(rule(), samples, settings)
    search._seen = 40
    candidates = np.array([[0], [1], [2]])
    leader, excess = search._leader(0.01, candidates, np.array([True, True, False]))
    assert (leader, excess[1]) == (1, 0.0)
    for other in (0, 2):
        differences = samples[1]["cost"] - samples[other]["cost"]
        width = stats.t.ppf(0.99, 39) * stats.sem(differences) + 7e4 * np.log(100) / 40
        assert excess[other] == pytest.approx(differences.mean() + width)


def test_the_cheapest_that_meets_the_requirements_is_selected():
    samples, settings = constant([0.9, 1.0, 1.0, 0.9], [40e3, 50e3, 60e3, 70e3])
    choice = rule().choice(samples, settings)
    (answer,) = choice.answers
    assert (answer.points, answer.left, answer.settled) == ((1,), ((1,),), True)
    assert choice.selected == [1]
    assert choice.verdicts[:2] == ("missed", "met")
    # Without noise in the costs, point 2 is dearer as soon as point 1 is known to be feasible.
    assert choice.counts[1] == choice.counts[2] > choice.counts[0]
    assert "at least 0.985; one that was found to miss them" in choice.guarantee
    assert "at most 1000 more than any that has" in choice.guarantee


def test_what_saves_less_than_the_indifference_need_not_be_decided():
    samples, settings = noisy([0.99, 1.0], [49.5e3, 50e3])
    for sample, cost in zip(samples, (49.5e3, 50e3), strict=True):
        sample["cost"][:] = cost
    choice = rule().choice(samples, settings)
    assert choice.answers[0].points == (1,)
    assert choice.answers[0].left == ((0,), (1,))
    assert choice.verdicts == ("open", "met")


def test_conditions_have_their_answers_and_one_for_all_of_them():
    # Fleets 0, 1, 2, each under conditions 0 and 1.
    samples, settings = constant(
        [1.0, 0.9, 1.0, 1.0, 1.0, 1.0], [40e3, 41e3, 50e3, 51e3, 60e3, 61e3], conditions=2
    )
    choice = rule().choice(samples, settings)
    assert [a.condition for a in choice.answers] == [{"arrival_rate": 0}, {"arrival_rate": 1}, None]
    assert [a.points for a in choice.answers] == [(0,), (3,), (2, 3)]
    assert choice.selected == [0, 2, 3]


def test_losses_that_have_not_happened_are_reckoned_with():
    samples, settings = constant([1.0, 1.0], [50e3, 52e3])
    risky = [Setting(s.values, 1e6 if n == 0 else 0.0) for n, s in enumerate(settings)]
    alone = rule().choice(samples, settings)
    assert rule().choice(samples, risky).missions > alone.missions


def test_the_budget_is_kept():
    choice = rule(budget=2345).choice(*RARE)
    assert choice.done
    assert 2345 - len(choice.counts) < choice.missions <= 2345
    assert not choice.answers[0].settled
    assert "the budget of 2345 missions ended before all was decided" in choice.guarantee


@pytest.mark.parametrize("budget", [10**9, 3000])
@pytest.mark.parametrize("problem", [RARE, CONDITIONS], ids=["rare", "conditions"])
def test_interruptions_leave_no_trace(problem, budget):
    whole, (data, settings) = rule(budget=budget), problem
    choice = whole.choice(data, settings)
    assert choice.rounds > 3
    generator, counts = np.random.default_rng(4), [0] * len(data)

    def present():
        pairs = zip(data, counts, strict=True)
        return [{name: values[:n] for name, values in sample.items()} for sample, n in pairs]

    while (wanted := whole.wanted(present(), settings)) != counts:
        assert all(w >= count for w, count in zip(wanted, counts, strict=True))
        counts = [
            int(generator.integers(count, w + 1)) for count, w in zip(counts, wanted, strict=True)
        ]
    assert tuple(counts) == choice.counts
    assert whole.choice(present(), settings) == choice


@pytest.mark.parametrize(
    "fields, complaint",
    [
        ({"requirements": {}}, "requirements"),
        ({"requirements": {"speed": 0.9}}, "'success', 'collection_ratio'"),
        ({"requirements": {"success": 1.2}}, "1.2 is out of range; allowed: between 0.005"),
        ({"indifference": 0.0}, "greater than or equal to 0.00"),
    ],
)
def test_what_makes_no_sense_is_refused(fields, complaint):
    with pytest.raises(ValidationError, match=complaint):
        rule(**fields)
