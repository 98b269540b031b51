"""Checks of chance: what was drawn, against the distributions that it is said to be drawn from."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats

from analysis.names import parameter
from analysis.stats.intervals import LEVEL, Interval, mean_interval, wilson
from analysis.verification import closed_forms
from analysis.verification.checks import Check
from dess.scenario import SAMPLED, ScenarioSpace

ARRIVALS, CHANNEL, DRAWS, COVERAGE = "Arrivals", "Channel", "Draws", "Intervals"

_LEAST = 5.0  # expected observations of a class, for the chi-square distribution to be good
_FEWEST = 30  # values from which their sum counts as normal
_NORMAL = stats.norm.ppf((1 + LEVEL) / 2)


class Fit(NamedTuple):
    """Observed against expected numbers.

    Attributes:
        table: A row per class: ``label``, ``observed``, ``expected``.
        p: Of the chi-square test; none if there are too few observations for two classes.
    """

    table: pd.DataFrame
    p: float | None

    @property
    def n(self) -> int:
        """Number of observations."""
        return int(self.table["observed"].sum())


def poisson_fit(counts: np.ndarray, mean: float) -> Fit:
    """Counts against a Poisson distribution; what is rare is pooled at either end."""
    n, law = counts.size, stats.poisson(mean)
    numbers = np.arange(int(law.ppf(1 - 1e-12)) + 1)
    frequent = numbers[n * law.pmf(numbers) >= _LEAST]
    if not len(frequent):
        return _fit(["0 or more"], np.array([n]), np.array([float(n)]))
    low, high = int(frequent[0]), int(frequent[-1])
    low -= n * law.cdf(low - 1) >= _LEAST
    high += n * law.sf(high) >= _LEAST
    classes = np.arange(low, high + 1)
    observed = np.bincount(np.clip(counts, low, high).ravel() - low, minlength=len(classes))
    below = law.cdf(classes)
    below[-1] = 1.0
    labels = [*map(str, classes)]
    labels[0] += " or less" if low > 0 else ""
    labels[-1] += " or more"
    return _fit(labels, observed, n * np.diff(below, prepend=0.0))


def uniform_fit(values: np.ndarray, low: int, high: int) -> Fit:
    """Integers against the uniform distribution on ``low..high``, ends included."""
    numbers = np.arange(low, high + 1)
    observed = (np.asarray(values)[:, None] == numbers).sum(0)
    fit = _fit([*map(str, numbers)], observed, np.full(len(numbers), len(values) / len(numbers)))
    return fit if fit.n == len(values) else fit._replace(p=0.0)  # some lie outside


def _fit(labels: Sequence[str], observed: np.ndarray, expected: np.ndarray) -> Fit:
    table = pd.DataFrame({"label": labels, "observed": observed, "expected": expected})
    if len(table) < 2 or expected.min() < _LEAST:
        return Fit(table, None)
    square = ((observed - expected) ** 2 / expected).sum()
    return Fit(table, float(stats.chi2.sf(square, len(table) - 1)))


def window_of(rate: float) -> int:
    """Mission slots in which a node receives about one data unit."""
    return max(2, round(1 / rate))


def arrival_fits(counts: np.ndarray, rate: float) -> list[tuple[str, Fit, float]]:
    """Counts per node and slot, per slot, and per node over many slots: name, fit and mean.

    A slot is there or not by what was before it, so the slots of missions one after another are as
    good as those of one long mission: whatever ends the missions, each slot's counts are Poisson.

    Args:
        counts: (T, K) data units that arrived, by mission slot and node.
        rate: Mean of each (lambda), above 0.
    """
    slots, nodes = counts.shape
    window = window_of(rate)
    windows = counts[: slots // window * window].reshape(-1, window, nodes).sum(1)
    return [
        (name, poisson_fit(numbers, mean), mean)
        for name, numbers, mean in (
            ("Counts per node and slot", counts, rate),
            ("Counts per slot, all nodes", counts.sum(1), nodes * rate),
            (f"Counts per node and {window} slots", windows, window * rate),
        )
    ]


def arrival_checks(counts: np.ndarray, rate: float) -> list[Check]:
    """Counts per mission slot and node against independent Poisson variables.

    Args:
        counts, rate: As for ``arrival_fits``; the rate may be 0.
    """
    if rate == 0:
        units = int(counts.sum())
        seen = f"{units:,} data units"
        return [Check(ARRIVALS, "Arrivals", "none", seen, counts.size, error=float(units))]
    totals = counts.sum(1)
    checks = [
        Check(ARRIVALS, f"{name}: chi-square", f"Poisson({mean:g})", _classes(fit), fit.n, fit.p)
        for name, fit, mean in arrival_fits(counts, rate)
    ]
    mean = counts.shape[1] * rate
    return [*checks, _alike(counts, rate), _dispersion(totals), _memory(totals, mean)]


def _classes(fit: Fit) -> str:
    """The shares of the classes, observed and expected, as far as a line holds them."""
    rows = fit.table.head(3)
    if not fit.n:
        return ""
    parts = [f"{row.label}: {100 * row.observed / fit.n:.2f} %" for row in rows.itertuples()]
    expected = " / ".join(f"{100 * each / fit.n:.2f}" for each in rows["expected"])
    return f"{', '.join(parts)}; expected {expected} %"


def _alike(counts: np.ndarray, rate: float) -> Check:
    """The totals of the nodes: each has the same rate, and it is the one that is known."""
    slots, nodes = counts.shape
    expected, totals = slots * rate, counts.sum(0)
    p = None
    if expected >= _LEAST:
        p = float(stats.chi2.sf(((totals - expected) ** 2 / expected).sum(), nodes))
    rates = totals / max(slots, 1)
    seen = f"{rates.min():.4g} to {rates.max():.4g}" if slots else ""
    name = f"Rates of the {nodes} nodes: chi-square"
    return Check(ARRIVALS, name, f"{rate:g} each", seen, int(totals.sum()), p)


def _dispersion(totals: np.ndarray) -> Check:
    """Variance over mean of the counts per slot; its moments are those given their sum."""
    name, known = "Index of dispersion per slot", "1"
    n, units = totals.size, int(totals.sum())
    if n < _FEWEST or units < _FEWEST:
        return Check(ARRIVALS, name, known, "", n)
    index = totals.var(ddof=1) / totals.mean()
    error = np.sqrt(2 * (1 - 1 / units) / (n - 1))
    return Check(ARRIVALS, name, known, _around(index, error), n, _two_sided((index - 1) / error))


def _memory(totals: np.ndarray, mean: float) -> Check:
    """Correlation of the counts of a slot and the next."""
    name, known, n = "Correlation of a slot and the next", "0", totals.size - 1
    if n < _FEWEST:
        return Check(ARRIVALS, name, known, "", max(n, 0))
    correlation = ((totals[1:] - mean) * (totals[:-1] - mean)).mean() / mean
    error = 1 / np.sqrt(n)
    return Check(ARRIVALS, name, known, _around(correlation, error), n,
                 _two_sided(correlation / error))  # fmt: skip


def arrived_check(missions: pd.DataFrame, space: ScenarioSpace) -> Check:
    """All that arrived in all missions, against lambda per node and slot that they lasted."""
    slots = int(missions["slots"].sum()) * len(space.nodes)
    name, rate = "Arrivals of all missions: rate per node and slot", space.arrival_rate
    estimate, error = missions["arrived"].sum() / slots, np.sqrt(rate / slots)
    if rate == 0:
        return Check(ARRIVALS, name, "0", f"{estimate:g}", slots, error=float(estimate))
    p = _two_sided((estimate - rate) / error)
    return Check(ARRIVALS, name, f"{rate:g}", _around(estimate, error, 6), slots, p)


def rate_check(rates: pd.DataFrame) -> Check:
    """Mean rates of ``lone_uav.rates`` against the integral over all shadowing."""
    name = "Mean rate of a lone UAV at each distance: chi-square"
    known, n = "E[δ log₂(1 + SNR)] by integration", int(rates["n"].sum())
    off = (rates["mean"] / rates["known"] - 1).abs().max()
    seen = f"within {100 * off:.2g} % at {len(rates)} distances"
    if not (rates["error"] > 0).all():  # without shadowing nothing is left to chance
        return Check(CHANNEL, name, known, seen, n, error=float(off), bound=1e-9)
    square = (((rates["mean"] - rates["known"]) / rates["error"]) ** 2).sum()
    return Check(CHANNEL, name, known, seen, n, float(stats.chi2.sf(square, len(rates))))


def shadowing_checks(deviates: np.ndarray) -> list[Check]:
    """Shadowing of ``lone_uav.deviates`` against independent standard normal variables."""
    n = deviates.size
    seen = _minus(f"mean {deviates.mean():.3f}, deviation {deviates.std():.3f}")
    p = float(stats.kstest(deviates, stats.norm.cdf).pvalue)
    together = float((deviates[1:] * deviates[:-1]).mean())
    error = 1 / np.sqrt(n - 1)
    return [
        Check(CHANNEL, "Shadowing of a lone UAV: Kolmogorov-Smirnov", "N(0, 1)", seen, n, p),
        Check(CHANNEL, "Correlation of a communication slot and the next", "0",
              _around(together, error), n - 1, _two_sided(together / error)),
    ]  # fmt: skip


def parameter_fits(missions: pd.DataFrame, space: ScenarioSpace) -> dict[str, Fit]:
    """The drawn parameters of missions against their uniform distributions, by field."""
    ranges = {field: getattr(space, field) for field in SAMPLED}
    return {
        field: uniform_fit(missions[field].to_numpy(), low, high)
        for field, (low, high) in ranges.items()
        if low < high
    }


def parameter_checks(missions: pd.DataFrame, space: ScenarioSpace) -> list[Check]:
    """The drawn parameters: each uniform, all independent of each other."""
    fits = parameter_fits(missions, space)
    checks = []
    for field, fit in fits.items():
        low, high = getattr(space, field)
        counts = fit.table["observed"]
        seen = f"each {counts.min():,} to {counts.max():,} times"
        known = f"uniform on {low}..{high}"
        test = f"{parameter(field).name}: chi-square"
        checks.append(Check(DRAWS, test, known, seen, len(missions), fit.p))
    return [*checks, *_independence(missions[[*fits]])]


def _independence(values: pd.DataFrame) -> list[Check]:
    """The correlations of all pairs together; those of independent columns are independent."""
    pairs = [*combinations(values, 2)]
    n = len(values)
    if not pairs or n < _FEWEST:
        return []
    table = np.corrcoef(values.rank(), rowvar=False)
    off = table[np.triu_indices(len(table), 1)]
    p = float(stats.chi2.sf(n * (off**2).sum(), len(pairs)))
    seen = _minus(f"{off.min():+.3f} to {off.max():+.3f}")
    return [Check(DRAWS, "Correlations of all pairs: chi-square", "0", seen, n, p)]


def initial_checks(starts: np.ndarray, totals: np.ndarray, space: ScenarioSpace) -> list[Check]:
    """The initial data per node, and their sums per mission.

    Args:
        starts: (N, K) initial data of missions [data units], by node.
        totals: (M,) initial data of missions.
        space: What they are drawn from.
    """
    low, high = space.initial_data
    each, together = "Initial data per node", "Initial data per mission"
    if low == high:
        off = np.abs(starts / max(low, 1e-300) - 1).max(initial=0.0) if high else starts.max()
        return [Check(DRAWS, each, f"{low:g}", f"{low:g}", starts.size, error=float(off))]
    per_node = stats.uniform(low, high - low)
    count = len(space.nodes)
    return [
        _distribution(f"{each}: Kolmogorov-Smirnov", starts.ravel(), per_node,
                      f"U({low:g}, {high:g})"),
        _distribution(f"{together}: Kolmogorov-Smirnov", totals, closed_forms.initial_total(space),
                      f"sum of {count} U({low:g}, {high:g})"),
    ]  # fmt: skip


def _distribution(name: str, values: np.ndarray, law: Any, known: str) -> Check:
    if not values.size:
        return Check(DRAWS, name, known, "", 0)
    mean = mean_interval(values)
    seen = f"mean {mean.mean:.3f} [{mean.low:.3f}, {mean.high:.3f}]; known {law.mean():.3f}"
    return Check(DRAWS, name, known, seen, values.size, float(stats.kstest(values, law.cdf).pvalue))


def start_check(cells: np.ndarray, space: ScenarioSpace) -> Check:
    """The start cell of the first UAV, uniform over the zone.

    Args:
        cells: (N, 2) start cells.
        space: What they are drawn from.
    """
    x, y, width, height = space.zone
    inside = np.reshape(cells, (-1, 2)) - [x, y]
    # A cell beside the zone must not pass for one of another row.
    number = np.where(
        ((inside >= 0) & (inside < [width, height])).all(1), inside @ [1, width], -1
    )  # fmt: skip
    fit = uniform_fit(number, 0, width * height - 1)
    counts = fit.table["observed"]
    seen = f"each {counts.min():,} to {counts.max():,} times"
    known = f"uniform on {width * height} cells"
    return Check(DRAWS, "Start cell of the first UAV: chi-square", known, seen, len(cells), fit.p)


def blocks(values: np.ndarray, size: int, share: bool) -> pd.DataFrame:
    """Intervals of blocks of missions, and whether each holds the mean of all missions.

    Args:
        values: (n,) a metric of missions; what is left behind the last whole block is left out.
        size: Missions of a block.
        share: Whether the metric is 0 or 1, and has Wilson's interval; Student's t else.

    Returns:
        A row per block: ``mean``, ``low``, ``high``, ``holds``.
    """
    whole = values[: len(values) // size * size].reshape(-1, size)
    rows: list[Interval] = [
        wilson(int(own.sum()), size) if share else mean_interval(own) for own in whole
    ]
    table = pd.DataFrame(rows, columns=Interval._fields)
    reference = whole.mean() if whole.size else np.nan
    return table.assign(holds=(table["low"] <= reference) & (reference <= table["high"]))


def coverage_check(metric: str, values: np.ndarray, size: int, share: bool) -> Check:
    """How often the intervals of blocks hold the mean of all missions.

    Args:
        metric: What it is called.
        values, size, share: As for ``blocks``.
    """
    table = blocks(values, size, share)
    n = len(table)
    name = f"{metric}: intervals of blocks of {size:,} missions"
    if n < 2 or np.ptp(values) == 0:  # nothing to cover
        return Check(COVERAGE, name, "", "", n)
    missions, hits = n * size, int(table["holds"].sum())
    successes = round(values[:missions].sum())
    known = (
        closed_forms.wilson_coverage(successes, missions, size)
        if share
        else closed_forms.t_coverage(missions, size)
    )
    _, low, high = wilson(hits, n)
    seen = f"{hits:,} of {n:,}: {100 * hits / n:.1f} % [{100 * low:.1f}, {100 * high:.1f}]"
    p = float(stats.binomtest(hits, n, min(known, 1.0)).pvalue)
    return Check(COVERAGE, name, f"{100 * known:.1f} %", seen, n, p)


def _around(value: float, error: float, digits: int = 4) -> str:
    """An estimate with its interval."""
    low, high = value - _NORMAL * error, value + _NORMAL * error
    return _minus(f"{value:.{digits}f} [{low:.{digits}f}, {high:.{digits}f}]")


def _minus(text: str) -> str:
    return text.replace("-", "−")


def _two_sided(z: float) -> float:
    return float(2 * stats.norm.sf(abs(z)))
