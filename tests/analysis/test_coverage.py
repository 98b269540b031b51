"""Intervals cover and tests keep their level, where the answer is known.

A 95 % interval covers in 93 to 97 % of the trials. Of 2000 trials the share covered has a standard
deviation of 0.49 %, so an interval that keeps its level leaves that band with a chance below 1e-4;
where fewer trials are run, the band is widened to 4 standard deviations. The quantile's interval
depends on a binomial count only, so its coverage is summed, not drawn.
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dess import load_scenario, simulate_batch
from dess.analysis.metric_ranges import metric_in_missions, metric_in_space
from dess.analysis.metrics import AGE, LEAST_COST, MOST_COST, MOST_SLOTS, PRODUCT, REWARD, metric_of
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.distribution import quantile_interval
from dess.analysis.stats.intervals import (
    column_intervals,
    interval_of,
    mean_interval,
    share_interval,
    stratified_interval,
)
from dess.analysis.stats.kinds import Sample, ends_of_means, level_after
from dess.analysis.stats.learners import compare_crossed
from dess.analysis.stats.sequences import add_values, sequence_ends
from dess.analysis.study.cheapest import Cheapest, Setting
from tests.compiled import new_sequence

Drawing = tuple[Callable[[np.random.Generator, tuple[int, int]], np.ndarray], float]

TABLES = Path(__file__).with_name("coverage.md")
TRIALS = 2000
QUICK = [150, pytest.param(TRIALS, marks=pytest.mark.slow)]


def rng(*seed: int) -> np.random.Generator:
    return np.random.default_rng(seed)


def covered(intervals: Iterable[tuple[float, float]], truth: float) -> float:
    """Share of (low, high) that hold the truth."""
    return float(np.mean([low <= truth <= high for low, high in intervals]))


def error(trials: int, share: float = 0.95) -> float:
    """Four standard deviations of a share of trials."""
    return 4 * float(np.sqrt(share * (1 - share) / trials))


def holds(coverage: float, trials: int = TRIALS) -> bool:
    margin = max(0.02, error(trials))
    return 0.95 - margin <= coverage <= 0.95 + margin


# Means of values from 0 to 1


def product(failures: float, a: float, b: float) -> Drawing:
    """Products of missions: 0 of those that fail, of the others a ratio of Beta(a, b)."""

    def draw(generator: np.random.Generator, size: tuple[int, int]) -> np.ndarray:
        return np.where(generator.random(size) < failures, 0.0, generator.beta(a, b, size))

    return draw, (1 - failures) * a / (a + b)


PRODUCTS: dict[str, Drawing] = {
    "no failures": product(0, 60, 2),
    "narrow": product(0, 600, 400),
    "one failure in 100": product(0.01, 60, 2),
    "one failure in 20": product(0.05, 30, 3),
    "failures but one in 200": product(0.995, 30, 3),
}


def bounded(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    sample = Sample(values.mean(axis=1), values.var(axis=1), 0.0, values.shape[1])
    return ends_of_means(metric_of(PRODUCT), sample)


def student(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    mean, error = values.mean(axis=1), stats.sem(values, axis=1)
    half = stats.t.ppf(0.975, values.shape[1] - 1) * error
    return mean - half, mean + half


def betting(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The hedged capital interval of Waudby-Smith and Ramdas (2024, Section 4.4), by bisection.

    Its bets are the predictable ones for a confidence interval (their equation 26), at most half of
    what would lose all; each end is where one of the two capitals reaches 2 / alpha.
    """
    n, most = values.shape[1], np.log(2 / 0.05)
    counts = np.arange(1, n + 1)
    means = (0.5 + np.cumsum(values, axis=1)) / (counts + 1)
    variances = (0.25 + np.cumsum((values - means) ** 2, axis=1)) / (counts + 1)
    before = np.concatenate([np.full((len(values), 1), 0.25), variances[:, :-1]], axis=1)
    bets = np.sqrt(2 * most / (n * before))

    def low_end(values: np.ndarray) -> np.ndarray:
        low, high = np.full(len(values), 1e-9), np.maximum(values.mean(axis=1), 1e-9)
        for _ in range(25):
            middle = (low + high) / 2
            stakes = np.minimum(bets, 0.5 / middle[:, None])
            rejected = np.log1p(stakes * (values - middle[:, None])).sum(axis=1) >= most
            low, high = np.where(rejected, middle, low), np.where(rejected, high, middle)
        return low

    return low_end(values), 1 - low_end(1 - values)


@pytest.mark.parametrize("n", [10, 30, 100, 300])
@pytest.mark.parametrize("drawing", PRODUCTS.values(), ids=PRODUCTS)
def test_bounded_intervals_cover_wherever_the_values_lie(drawing, n):
    draw, mean = drawing
    low, high = bounded(draw(rng(1, n), (500, n)))
    assert np.mean((low <= mean) & (mean <= high)) >= 0.95 - error(500)


def in_markdown(*rows: list[str]) -> str:
    """A table whose first row is its head."""
    head, *others = rows
    return "\n".join(f"| {' | '.join(row)} |" for row in (head, ["---"] * len(head), *others))


def told(ends: tuple[np.ndarray, np.ndarray], truth: float) -> str:
    """The coverage and the mean length [points] of intervals."""
    low, high = ends
    coverage = np.mean((low <= truth) & (truth <= high))
    return f"{100 * coverage:.1f} %, {100 * np.mean(high - low):.1f}"


def table_of_the_docs() -> str:
    """Of the intervals of some products."""
    rows = [["missions", "n", "Student's t", "0 and 1 added", "betting"]]
    cases = [("no failures", 300), ("one failure in 100", 100), ("one failure in 100", 1000)]
    for name, n in [*cases, ("one failure in 20", 300), ("failures but one in 200", 100)]:
        draw, mean = PRODUCTS[name]
        values = draw(rng(1, n), (1000, n))
        rows.append([name, str(n), *(told(f(values), mean) for f in (student, bounded, betting))])
    return in_markdown(*rows)


@pytest.mark.slow
def test_the_table_of_the_docs_is_measured():
    assert table_of_the_docs() in TABLES.read_text("utf-8")


@pytest.mark.parametrize("trials", QUICK)
@pytest.mark.parametrize("shared", [0.0, 0.5, 1.0])
def test_stratified_intervals_cover_the_mean_over_the_points(shared, trials):
    """Of points of unlike means, whose failures happen in the same replications, or do not."""
    generator, means = rng(11), np.array([0.5, 0.7, 0.9])

    def values() -> np.ndarray:
        own, common = generator.random((60, 3)), generator.random((60, 1))
        fails = np.where(generator.random((60, 1)) < shared, common, own) < 0.1
        return np.where(fails, 0.0, means + generator.uniform(-0.05, 0.05, (60, 3)))

    intervals = (stratified_interval(values(), PRODUCT)[1:] for _ in range(trials))
    assert covered(intervals, 0.9 * means.mean()) >= 0.95 - max(0.02, error(trials))


# After a search


@pytest.mark.parametrize("trials", QUICK)
def test_intervals_cover_after_a_search_has_decided_how_many_missions_there_are(trials):
    """Also near the requirement, where a search stops as soon as the results are extreme."""
    shares = np.array([0.8, 0.88, 0.9, 0.92, 1.0])
    rule = Cheapest(
        procedure="cheapest", requirements={"success": 0.9}, tolerance=0.03, indifference=300.0,
        budget=6000,
    )  # fmt: skip
    settings = [Setting({"uavs": number}, 0.0) for number in range(len(shares))]
    covers = np.zeros((trials, len(shares)))
    for trial in range(trials):
        generator = rng(31, trial)
        success = (generator.random((len(shares), 6000)) < shares[:, None]).astype(float)
        costs = generator.normal(1000.0 * np.arange(len(shares)), 300.0, (6000, len(shares))).T
        samples = [{"success": s, "cost": c} for s, c in zip(success, costs, strict=True)]
        choice = rule.choice(samples, settings)
        for point, (n, analyses) in enumerate(zip(choice.counts, choice.analyses, strict=True)):
            _, low, high = share_interval(
                int(success[point][:n].sum()), n, float(level_after(analyses))
            )
            covers[trial, point] = low <= shares[point] <= high
    assert (covers.mean(axis=0) >= 0.95 - max(0.02, error(trials) / 2)).all()


# Distributions


def quantile_coverage(share: float, n: int) -> float:
    """Of the values below the quantile there are N ~ Bin(n, share): between which ranks it lies."""
    low, high = quantile_interval(np.arange(1.0, n + 1), share)[1:]
    count = stats.binom(n, share)
    return float(count.cdf(min(high, n + 1) - 1) - count.cdf(max(low, 0) - 1))


@pytest.mark.parametrize("n", [1, 5, 20, 100, 1000])
@pytest.mark.parametrize("share", [0.05, 0.25, 0.5, 0.9])
def test_quantile_intervals_cover_at_their_level(share, n):
    # Each end misses with 2.5 % at most, and with no more than one value's probability less.
    step = stats.binom.pmf(np.arange(n + 1), n, share).max()
    assert 0.95 <= quantile_coverage(share, n) <= 0.95 + 2 * step


# Pairs


def pairs(generator: np.random.Generator, n: int, difference: float) -> tuple[np.ndarray, ...]:
    """Values of a common realisation, with skewed noise of their own, that differ in mean."""
    common, noise = generator.beta(8, 2, n), generator.exponential(0.05, (2, n))
    return common + noise[0] + difference, common + noise[1]


@pytest.mark.parametrize("trials", QUICK)
@pytest.mark.parametrize("n", [20, 200])
def test_the_paired_interval_covers_and_its_test_keeps_its_level(n, trials):
    generator = rng(7)
    results = [compare_pairs(*pairs(generator, n, 0.0)) for _ in range(trials)]
    assert holds(covered(((r.low, r.high) for r in results), 0.0), trials)
    assert np.mean([r.p <= 0.05 for r in results]) == pytest.approx(0.05, abs=error(trials, 0.05))


# Failures of one policy alone, which are rare


def lone(
    a_fails: float, b_fails: float, scale: float, n: int, trials: int
) -> tuple[np.ndarray, ...]:
    """Products (trials, n) of two policies in the same missions, of which those of B are scaled."""
    generator = rng(21, n)
    ratio = generator.beta(60, 15, (trials, n))
    a, b = ratio + generator.normal(0, 0.02, (2, trials, n))
    fails = generator.random((2, trials, n)) < np.array([a_fails, b_fails])[:, None, None]
    return np.where(fails[0], 0.0, a.clip(0, 1)), np.where(fails[1], 0.0, scale * b.clip(0, 1))


def compared(a: np.ndarray, b: np.ndarray, metric: str) -> tuple[np.ndarray, ...]:
    """The low and high ends of the differences, and the p-values, by trial."""
    rows = [compare_pairs(*pair, metric=metric) for pair in zip(a, b, strict=True)]
    return tuple(np.array([getattr(row, name) for row in rows]) for name in ("low", "high", "p"))


RARE = [(0.02, 50), (0.01, 100), (0.003, 300), (0.001, 1000), (0.03, 100), (0.06, 100)]


@pytest.mark.parametrize("trials", QUICK)
@pytest.mark.parametrize("metric", [PRODUCT, REWARD])
@pytest.mark.parametrize(("share", "n"), RARE)
def test_paired_intervals_cover_where_one_policy_never_fails(share, n, metric, trials):
    a, b = lone(0.0, share, 1.0, n, trials)
    truth = share * 0.8
    # A product of 0 is a failure, which costs 400 and the data.
    if metric == REWARD:
        a, b, truth = 300 * a - 400 * (a == 0), 300 * b - 400 * (b == 0), share * (240 + 400)
    low, high, p = compared(a, b, metric)
    assert np.mean((low <= truth) & (truth <= high)) >= 0.95 - error(trials)
    assert ((p < 0.05) == ((low > 0) | (high < 0))).all()


@pytest.mark.parametrize("trials", QUICK)
@pytest.mark.parametrize(("share", "n"), RARE)
def test_equal_means_are_seldom_told_apart_where_one_policy_fails(share, n, trials):
    p = compared(*lone(share, 0.0, 1 - share, n, trials), PRODUCT)[2]
    assert np.mean(p < 0.05) <= 0.05 + error(trials, 0.05)


def of_pairs(a: np.ndarray, b: np.ndarray) -> dict[str, tuple[np.ndarray, np.ndarray]]:
    """The ends of the intervals of differences: Student's, one with 1 and -1 added, and ours."""
    d = a - b
    more = np.concatenate([d, np.tile([1.0, -1.0], (len(d), 1))], axis=1)
    low, high, _ = compared(a, b, PRODUCT)
    return {"Student's t": student(d), "1 and -1 added": student(more), "ours": (low, high)}


def table_of_rare_failures() -> str:
    """Of the intervals of differences."""
    kinds = ["Student's t", "1 and -1 added", "rare differences added"]
    rows = [["B fails, A never", "n", *kinds]]
    for share, n in RARE:
        found = of_pairs(*lone(0.0, share, 1.0, n, 1000)).values()
        rows.append([f"{100 * share:g} %", str(n), *(told(ends, 0.8 * share) for ends in found)])
    return in_markdown(*rows)


@pytest.mark.slow
def test_the_table_of_rare_failures_of_the_docs_is_measured():
    assert table_of_rare_failures() in TABLES.read_text("utf-8")


# Ages and lengths of missions, which a failure changes by much more than a policy does

LONGEST = 500  # slots that a mission may last
FAILURES = (0.007, 0.008, 0.015, 0.035)


def watches(metric: str, share: float, n: int, trials: int) -> tuple[np.ndarray, np.ndarray, float]:
    """Values (trials, n) of A, which never fails, and of B, and the true mean difference.

    An age is then between that of a fleet that is lost late and that of a sea without UAVs; a
    mission ends early, or only at the horizon.
    """
    generator = rng(23, n)
    size = (trials, n)
    common = generator.gamma(16, 2.5, size) if metric == AGE else generator.normal(100, 10, size)
    a, b = common + generator.normal(0, 0.5, (2, *size))
    if metric == AGE:
        failed, mean = generator.uniform(100, LONGEST / 2, size), 40.0 - 175.0
    else:
        early = generator.uniform(10, 60, size)
        failed, mean = np.where(generator.random(size) < 0.5, early, LONGEST), 100.0 - 267.5
    return a, np.where(generator.random(size) < share, failed, b), share * mean


def of_watches(metric: str, a: np.ndarray, b: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ends of the intervals of the differences, by trial."""
    missions = pd.DataFrame({metric: [0.0], MOST_SLOTS: [LONGEST]})
    of = metric_in_missions(missions, metric)
    rows = [compare_pairs(*pair, metric=of) for pair in zip(a, b, strict=True)]
    return np.array([row.low for row in rows]), np.array([row.high for row in rows])


@pytest.mark.parametrize("trials", [150, pytest.param(TRIALS, marks=pytest.mark.slow)])
@pytest.mark.parametrize("n", [100, 300, 500])
@pytest.mark.parametrize("metric", [AGE, "slots"])
def test_paired_intervals_of_ages_and_lengths_cover_where_failures_are_rare(metric, n, trials):
    for share in FAILURES:
        a, b, truth = watches(metric, share, n, trials)
        low, high = of_watches(metric, a, b)
        assert np.mean((low <= truth) & (truth <= high)) >= 0.95 - max(0.02, error(trials))
        assert (low < high).all()


def table_of_watches() -> str:
    """Of the intervals of differences of ages and of lengths of missions."""
    heads = [f"{name}, {kind}" for name in ("age", "slots") for kind in ("Student's t", "ours")]
    rows = [["B fails, A never", "n", *heads]]
    for share in FAILURES:
        for n in (100, 300, 500):
            cells = []
            for metric in (AGE, "slots"):
                a, b, truth = watches(metric, share, n, 1000)
                both = student(a - b), of_watches(metric, a, b)
                cells += [told(tuple(end / 100 for end in ends), truth / 100) for ends in both]
            rows.append([f"{100 * share:g} %", str(n), *cells])
    return in_markdown(*rows)


@pytest.mark.slow
def test_the_table_of_ages_and_lengths_of_the_docs_is_measured():
    assert table_of_watches() in TABLES.read_text("utf-8")


# Means that the loss of a UAV changes: in most samples none is lost

LOSSES = (0.0025, 0.007, 0.035)  # the share of the missions that lose a UAV, of two
SIZES = (50, 100, 300)
_PURCHASE, _LOSS = 10_000.0, 4e6  # for instance 200 missions a year, in which 20,000 EUR are lost
_RANGES = {
    "cost": {LEAST_COST: _PURCHASE, MOST_COST: _PURCHASE + 200 + 2 * _LOSS},
    "uav_slots": {MOST_SLOTS: LONGEST, "uavs": 2},
    "collected": {"residual": 0.0},
}


def with_losses(metric: str, share: float, size: tuple[int, int]) -> tuple[np.ndarray, float]:
    """Values of missions of which few lose a UAV, and their true mean."""
    generator = rng(41, *size)
    is_lost = generator.random(size) < share
    late = generator.random(size)  # how much of the mission was left
    if metric == "cost":
        plain = _PURCHASE + generator.gamma(16, 4, size)
        return plain + _LOSS * is_lost, _PURCHASE + 64 + share * _LOSS
    if metric == REWARD:
        return generator.normal(200, 20, size) - 400 * is_lost, 200 - 400 * share
    if metric == AGE:
        return generator.gamma(16, 2.5, size) + 150 * late * is_lost, 40 + 75 * share
    if metric == "slots":
        return generator.normal(150, 10, size) + 350 * late * is_lost, 150 + 175 * share
    if metric == "uav_slots":
        return generator.normal(800, 20, size) - 500 * late * is_lost, 800 - 250 * share
    if metric == "collected":
        return generator.normal(90, 2, size) - 90 * late * is_lost, 90 - 45 * share
    raise ValueError(metric)


def of_means(metric: str, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ends of the intervals of the means of samples (trials, n), as they are printed."""
    known = _RANGES.get(metric, {MOST_SLOTS: LONGEST})
    missions = pd.DataFrame({metric: values.ravel(), **known})
    if metric == "collected":
        missions["residual"] = 100.0 - missions[metric]
    ends = column_intervals(pd.DataFrame(values.T), metric_in_missions(missions, metric))
    return ends["low"].to_numpy(), ends["high"].to_numpy()


@pytest.mark.parametrize("n", SIZES)
@pytest.mark.parametrize("metric", ["cost", REWARD, AGE, "slots", "uav_slots", "collected"])
def test_means_cover_where_losses_are_rare(metric, n):
    for share in LOSSES:
        values, truth = with_losses(metric, share, (TRIALS, n))
        low, high = of_means(metric, values)
        assert np.mean((low <= truth) & (truth <= high)) >= 0.93
        assert (low < high).all()
        if metric == "cost":
            assert (low >= _PURCHASE).all()


def table_of_costs() -> str:
    """Of the intervals of mean costs, with their mean lengths in 1,000 EUR a year."""
    rows = [["missions with a loss", "n", "Student's t", "ours"]]
    for share in LOSSES:
        for n in SIZES:
            values, truth = with_losses("cost", share, (TRIALS, n))
            cells = []
            for low, high in (student(values), of_means("cost", values)):
                coverage = np.mean((low <= truth) & (truth <= high))
                cells.append(f"{100 * coverage:.1f} %, {np.mean(high - low) / 1000:,.0f}")
            rows.append([f"{100 * share:g} %", str(n), *cells])
    return in_markdown(*rows)


def test_the_table_of_costs_of_the_docs_is_measured():
    assert table_of_costs() in TABLES.read_text("utf-8")


@pytest.mark.parametrize("trials", [40, pytest.param(1000, marks=pytest.mark.slow)])
@pytest.mark.parametrize("metric", ["cost", REWARD])
def test_sequences_of_the_panel_cover_at_all_times_where_losses_are_rare(metric, trials):
    """From the first mission to the last, as a reader watches them."""
    failure = {"cost": 2 * _LOSS, REWARD: metric_of(REWARD).failure}[metric]
    least = {"cost": _PURCHASE, REWARD: -np.inf}[metric]
    for share in LOSSES:
        values, truth = with_losses(metric, share, (trials, 1000))
        covers = 0
        for of_trial in values:
            sequence = new_sequence(least, np.inf, failure=failure)
            is_covered = True
            for mission in of_trial[:, None]:
                add_values(sequence, mission)
                low, high = sequence_ends(sequence)
                is_covered &= low <= truth <= high
            covers += is_covered
        assert covers / trials >= (0.93 if trials >= 1000 else 0.95 - error(trials))


SKEWED: dict[str, Drawing] = {
    "gamma(4)": (lambda g, size: g.gamma(4, 1, size), 4.0),
    "exponential": (lambda g, size: g.exponential(1, size), 1.0),
    "gamma(0.5)": (lambda g, size: g.gamma(0.5, 1, size), 0.5),
    "log-normal": (lambda g, size: g.lognormal(0, 0.75, size), float(np.exp(0.75**2 / 2))),
}


def skewed(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ends of the intervals of samples (trials, n) of a metric without bounds."""
    ends = column_intervals(pd.DataFrame(values.T))
    return ends["low"].to_numpy(), ends["high"].to_numpy()


@pytest.mark.parametrize("drawing", SKEWED.values(), ids=SKEWED)
def test_intervals_of_skewed_values_cover(drawing):
    draw, mean = drawing
    low, high = skewed(draw(rng(24), (4000, 50)))
    assert np.mean((low <= mean) & (mean <= high)) >= 0.935


def table_of_skewed_values() -> str:
    """Of the intervals of means."""
    rows = [["values", "n", "Student's t", "corrected for skewness"]]
    for name, (draw, mean) in SKEWED.items():
        for n in (20, 50, 200):
            values = draw(rng(24, n), (4000, n))
            cells = [told(tuple(of(values)), mean) for of in (student, skewed)]
            rows.append([name, str(n), *(cell.partition(",")[0] for cell in cells)])
    return in_markdown(*rows)


@pytest.mark.slow
def test_the_table_of_skewed_values_of_the_docs_is_measured():
    assert table_of_skewed_values() in TABLES.read_text("utf-8")


# Learners


def layouts(
    size: tuple[int, int], training: float, mission: float, rest: float, trials: int = TRIALS
) -> Iterator[tuple[np.ndarray, float]]:
    """Differences (S, R) of mean 0 with crossed effects, and what one new training would reach."""
    draw = rng(12).normal
    for _ in range(trials):
        crossing = draw(0, training, (size[0], 1)) + draw(0, mission, size[1])
        yield crossing + draw(0, rest, size), draw(0, training)


@pytest.mark.parametrize("trials", QUICK)
@pytest.mark.parametrize("trainings", [3, 5])
def test_the_interval_of_a_learner_covers_trainings_and_missions(trainings, trials):
    drawn = list(layouts((trainings, 200), 0.03, 0.1, 0.1, trials))
    results = [compare_crossed(d) for d, _ in drawn]
    assert holds(covered(((r.low, r.high) for r in results), 0.0), trials)
    level = np.mean([r.p <= 0.05 for r in results])
    assert level == pytest.approx(0.05, abs=max(0.02, error(trials)))
    new = [r.new_low <= value <= r.new_high for r, (_, value) in zip(results, drawn, strict=True)]
    assert holds(float(np.mean(new)), trials)
    missions_alone = (mean_interval(d.mean(axis=0))[1:] for d, _ in drawn)
    assert covered(missions_alone, 0.0) < 0.75


@pytest.mark.slow
def test_the_interval_of_a_few_years_covers_the_mean_of_all():
    space = load_scenario("new-jersey", uavs=1)
    ages = simulate_batch(space, "greedy", 0, 31).operations["age"]
    rng = np.random.default_rng(6)
    metric = metric_in_space("age", space)
    for years in (4, 10, 20):
        covers = 0
        for _ in range(2000):
            interval = interval_of(metric, rng.choice(ages, years, replace=False))
            covers += interval.low <= ages.mean() <= interval.high
        assert covers >= 0.93 * 2000
