import math
from statistics import variance

import numpy as np
import pytest
from pydantic import ValidationError

from dess.analysis.study.selection import Selection

METRIC = "collection_ratio"


def rule(procedure="kn", **fields):
    defaults = {"metric": METRIC, "first": 10, "budget": 10**9, "indifference": 0.5}
    return Selection.model_validate(defaults | {"procedure": procedure} | fields)


def samples_of(data, counts):
    return [{METRIC: row[:count]} for row, count in zip(data, counts, strict=True)]


def finished(rule, data):
    """The samples with which the rule is content, from ones of ``first`` missions each."""
    counts = [rule.first] * len(data)
    while (wanted := rule.wanted(samples_of(data, counts))) != counts:
        counts = wanted
    samples = samples_of(data, counts)
    assert [len(sample[METRIC]) for sample in samples] == counts, "the data are too short"
    return samples


def chosen(rule, data):
    choice = rule.choice(finished(rule, data))
    assert choice.done
    return choice


def normal(seed, means, missions=3000, correlation=0.0, spread=1.0):
    """(k, missions) values; ``correlation`` comes from what all points share in a mission."""
    generator = np.random.default_rng(seed)
    shared, own = generator.normal(size=missions), generator.normal(size=(len(means), missions))
    noise = math.sqrt(correlation) * shared + math.sqrt(1 - correlation) * own
    return np.asarray(means)[:, None] + spread * noise


def slow_race(data, first, delta, alpha, bounded=False):
    """Kim and Nelson's procedure, a mission and a pair at a time: best, stage, who left when."""
    k = len(data)
    eta = 0.5 * ((2 * alpha / (k - 1)) ** (-2 / (first - 1)) - 1)
    h2 = 2 * eta * (first - 1)
    rare = 2 * math.log((k - 1) / alpha) / 3 if bounded else 0.0

    def squares(r):
        pairs = [(i, j) for i in range(k) for j in range(k) if i != j]
        return {(i, j): variance(data[i][:r] - data[j][:r]) for i, j in pairs}

    inside, left_at, r = list(range(k)), {}, first
    known, renewal = squares(first), first + first // 2
    while True:
        means = [sum(row[:r].tolist()) / r for row in data]

        def width(i, j, r=r, known=known):
            return max(0.0, delta / (2 * r) * (h2 * known[i, j] / delta**2 - r) + rare / r)

        out = [
            i for i in inside if any(means[i] < means[j] - width(i, j) for j in inside if j != i)
        ]
        left_at |= dict.fromkeys(out, r)
        inside = [i for i in inside if i not in out]
        best = max(inside, key=lambda i: means[i])
        ends = [
            h2 * known[i, j] / delta**2 + 2 * rare / delta for i in inside for j in inside if i != j
        ]
        if len(inside) == 1 or r > max(ends):
            return best, r, left_at
        if bounded and r == renewal:
            known, renewal = squares(r), r + r // 2
        r += 1


def mixed(seed):
    """Two to six points of any means."""
    generator = np.random.default_rng(seed)
    means = generator.normal(0.0, 0.3, generator.integers(2, 7))
    return normal([1, seed], means, correlation=0.5 * (seed % 2))


def in_pairs(seed):
    """Six points, two by two almost alike: margins of very different widths."""
    means = np.random.default_rng(seed).normal(0.0, 0.2, 3)
    pairs = np.repeat(normal([2, seed], means), 2, axis=0)
    return pairs + normal([3, seed], np.zeros(6), spread=0.3)


@pytest.mark.parametrize("procedure", ["kn", "kn-bounded"])
@pytest.mark.parametrize("draw", [mixed, in_pairs])
@pytest.mark.parametrize("seed", [*range(8), 16, 40])
def test_the_race_is_the_one_of_the_paper(procedure, draw, seed):
    data = draw(seed)
    first, alpha = (4, 0.3) if draw is in_pairs else (5 + seed, [0.01, 0.05, 0.3][seed % 3])
    best, stage, left_at = slow_race(data, first, 0.4, alpha, procedure == "kn-bounded")
    race = rule(procedure, first=first, indifference=0.4, confidence=1 - alpha)
    choice = chosen(race, data)
    assert (choice.best, choice.stage) == (best, stage)
    assert set(choice.survivors) == set(range(len(data))) - left_at.keys()
    assert all(choice.counts[i] >= r for i, r in left_at.items())
    assert choice.counts[best] == max(choice.counts) >= stage
    assert choice.guaranteed


def test_a_race_by_hand():
    # k = 2, n0 = 3, alpha = 0.1: eta = (0.2^-1 - 1) / 2 = 2, h2 = 2 * 2 * 2 = 8. The first three
    # differences have variance 1: W(r) = (8 - r) / (2 r), above their mean at r = 3, 4, 5
    # (0, 0, 0.2 against 0.833, 0.5, 0.3) and below it at r = 6 (0.333 against 0.167).
    ahead = np.array([1.0, 0.0, -1.0, 0.0, 1.0, 1.0, 0.0, 0.0])
    by_hand = rule(first=3, indifference=1.0, confidence=0.9)
    choice = chosen(by_hand, np.stack([np.zeros(8), ahead]))
    assert (choice.best, choice.stage, choice.survivors) == (1, 6, (1,))
    assert chosen(by_hand, np.stack([np.zeros(8), -ahead])).best == 0
    # nothing but noise: the margin is zero at r = 8, and the race over after it
    level = np.array([1.0, 0.0, -1.0, 0.0, 0.5, 0.0, 0.0, -0.4, 0.0])
    assert chosen(by_hand, np.stack([np.zeros(9), level])).stage == 8
    level[7] = -0.5
    choice = chosen(by_hand, np.stack([np.zeros(9), level]))
    assert (choice.stage, choice.best, choice.survivors) == (9, 0, (0, 1))


RULES = {
    "kn": {"indifference": 0.2},
    "kn-bounded": {"indifference": 0.2},
    "kn out of budget": {"procedure": "kn", "indifference": 0.1, "budget": 1000},
}


@pytest.mark.parametrize("name", RULES)
def test_interruptions_leave_no_trace(name):
    data = normal(3, np.linspace(0.0, 0.5, 6), correlation=0.3)
    whole = rule(**({"procedure": name} | RULES[name]))
    check_that_interruptions_leave_no_trace(whole, samples_of(data, [3000] * 6))


def check_that_interruptions_leave_no_trace(rule, data, settings=()):
    """Ask for missions, simulate some of them, and ask again: the choice is the same."""
    choice = rule.choice(data, settings)
    assert choice.rounds > 3
    generator, counts = np.random.default_rng(4), [0] * len(data)

    def present():
        pairs = zip(data, counts, strict=True)
        return [{name: values[:n] for name, values in sample.items()} for sample, n in pairs]

    while (wanted := rule.wanted(present(), settings)) != counts:
        assert all(w >= count for w, count in zip(wanted, counts, strict=True))
        counts = [
            int(generator.integers(count, w + 1)) for count, w in zip(counts, wanted, strict=True)
        ]
    assert tuple(counts) == choice.counts
    assert rule.choice(present(), settings) == choice


def rate(rule, draw, trials):
    """How often the last point, the best, is selected."""
    choices = [chosen(rule, draw(seed)) for seed in range(trials)]
    return np.mean([choice.best == len(choice.counts) - 1 for choice in choices])


def least(trials, promised=0.95):
    """The promised rate, less three binomial errors."""
    return promised - 3 * math.sqrt(promised * (1 - promised) / trials)


def slippage(k, lead, **fields):
    """The hardest means that the promise is for: all but the best are ``lead`` behind."""
    return lambda seed: normal([5, seed], [0.0] * (k - 1) + [lead], **fields)


@pytest.mark.parametrize("k, correlation", [(5, 0.0), (10, 0.7)])
def test_the_promise_is_kept(k, correlation):
    draw = slippage(k, 0.5, missions=2000, correlation=correlation)
    assert rate(rule(), draw, 300) >= least(300)


def test_the_budget_is_kept():
    data = normal(6, np.linspace(0.0, 0.05, 7))
    choice = chosen(rule(budget=1234, indifference=0.01), data)
    assert 1234 - len(choice.survivors) < choice.missions <= 1234
    assert not choice.guaranteed
    assert choice.guarantee.startswith("none")
    means = [row[:n].mean() for row, n in zip(data, choice.counts, strict=True)]
    assert choice.best == max(choice.survivors, key=lambda i: means[i])


@pytest.mark.parametrize("procedure", ["kn", "kn-bounded"])
def test_a_single_point_needs_no_selection(procedure):
    choice = chosen(rule(procedure), normal(8, [0.3]))
    assert (choice.best, choice.counts, choice.guaranteed) == (0, (10,), True)
    assert "only" in choice.guarantee


def test_a_choice_needs_the_missions_of_round_one():
    data = normal(10, [0.0, 1.0])
    assert rule().wanted(samples_of(data, [10, 0])) == [10, 10]
    for samples in ([], samples_of(data, [10, 9])):
        with pytest.raises(ValueError, match="allowed: 10 or more of each"):
            rule().choice(samples)


@pytest.mark.parametrize(
    "fields, complaint",
    [
        ({"procedure": "best"}, "'kn' or 'kn-bounded'"),
        ({"procedure": "kn-bounded", "indifference": 1.0, "metric": "reward"}, "not bounded"),
        ({"procedure": "kn", "indifference": 0.1, "confidence": 1.0}, "less than or equal to 0.99"),
        ({"procedure": "kn", "indifference": 0.1, "metric": "speed"}, "metric"),
        ({"procedure": "kn-bounded", "indifference": 0.1, "metric": "least"}, "worst over all mis"),
        ({"procedure": "kn", "indifference": 1.0, "metric": "oldest"}, "procedure cheapest that"),
    ],
)
def test_what_makes_no_sense_is_refused(fields, complaint):
    with pytest.raises(ValidationError, match=complaint):
        Selection.model_validate(fields)


@pytest.mark.parametrize("metric", ["success", "collection_ratio_and_communication", None])
def test_what_falls_to_0_in_rare_failures_is_refused_without_an_allowance_for_them(metric):
    table = {"procedure": "kn", "indifference": 0.1} | ({"metric": metric} if metric else {})
    with pytest.raises(ValidationError, match="allowed: procedure kn-bounded with it"):
        Selection.model_validate(table)
    assert Selection.model_validate(table | {"procedure": "kn-bounded"})
    assert Selection.model_validate(table | {"metric": "reward"})
