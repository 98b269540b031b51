"""Checks of random draws against the distributions of the scenario: parameters, data, arrivals.

The functions take the draws as arrays, and use no code of the simulator.
"""

from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from analysis.names import parameter
from analysis.numbers import decimals, minus
from analysis.stats.intervals import mean_interval
from analysis.verification import closed_forms
from analysis.verification.checks import ARRIVALS, DRAWS, Check
from analysis.verification.fits import LEAST, Fit, chi_square, poisson_fit, uniform_fit
from dess.scenario import SAMPLED, ScenarioSpace

_FEWEST = 30  # with this many values or more, their sum is taken as normal


def arrival_fits(counts: np.ndarray, rate: float) -> list[tuple[str, Fit, float]]:
    """Fits of counts per node and slot, per slot, and per node over many slots.

    Whether a mission has another slot depends only on the slots before it. Therefore the slots of
    several missions, one after another, can be treated like those of one long mission.

    Args:
        counts: (T, K) data units that arrived, by mission slot and node.
        rate: Mean of each count (lambda). Without arrivals there is nothing to fit.

    Returns:
        For each kind of count its name, the fit and the expected mean.
    """
    if not rate:
        return []
    slots, nodes = counts.shape
    window = max(2, round(1 / rate))  # slots in which a node receives about one data unit
    windows = counts[: slots // window * window].reshape(-1, window, nodes).sum(1)
    panels = (
        ("Counts per node and slot", counts, rate),
        ("Counts per slot, all nodes", counts.sum(1), nodes * rate),
        (f"Counts per node and {window} slots", windows, window * rate),
    )
    return [(name, poisson_fit(numbers, mean), mean) for name, numbers, mean in panels]


def arrival_checks(counts: np.ndarray, rate: float) -> list[Check]:
    """Compare counts per mission slot and node with independent Poisson variables.

    Args:
        counts, rate: As for ``arrival_fits``.
    """
    if not rate:
        units = int(counts.sum())
        seen = f"{units:,} data units"
        return [Check(ARRIVALS, "Arrivals", "none", seen, counts.size, error=float(units))]
    checks = [
        Check(ARRIVALS, f"{name}: chi-square", f"Poisson({mean:g})", fit.shares, fit.n, fit.p)
        for name, fit, mean in arrival_fits(counts, rate)
    ]
    totals, mean = counts.sum(1), counts.shape[1] * rate
    return [
        *checks,
        _rates_check(counts, rate),
        _dispersion_check(totals),
        _lag_check(totals, mean),
    ]


def _rates_check(counts: np.ndarray, rate: float) -> Check:
    """Check that the total of each node has the known rate."""
    slots, nodes = counts.shape
    expected, totals = slots * rate, counts.sum(0)
    p = chi_square(totals, np.full(nodes, expected), nodes) if expected >= LEAST else None
    rates = totals / max(slots, 1)
    seen = f"{rates.min():.4g} to {rates.max():.4g}" if slots else ""
    test = f"Rates of the {nodes} nodes: chi-square"
    return Check(ARRIVALS, test, f"{rate:g} each", seen, int(totals.sum()), p)


def _dispersion_check(totals: np.ndarray) -> Check:
    """Check the variance / mean of the counts per slot, by its moments conditional on the sum."""
    test, n, units = "Index of dispersion per slot", totals.size, int(totals.sum())
    if n < _FEWEST or units < _FEWEST:
        return Check(ARRIVALS, test, "1", "", n)
    index = totals.var(ddof=1) / totals.mean()
    error = np.sqrt(2 * (1 - 1 / units) / (n - 1))
    return Check.normal(ARRIVALS, test, 1, index, error, n)


def _lag_check(totals: np.ndarray, mean: float) -> Check:
    """Check that the counts of successive slots are uncorrelated."""
    test, n = "Correlation of a slot and the next", totals.size - 1
    if n < _FEWEST:
        return Check(ARRIVALS, test, "0", "", max(n, 0))
    correlation = ((totals[1:] - mean) * (totals[:-1] - mean)).mean() / mean
    return Check.normal(ARRIVALS, test, 0, correlation, 1 / np.sqrt(n), n)


def arrived_check(missions: pd.DataFrame, space: ScenarioSpace) -> Check:
    """Compare the arrivals of all missions with lambda per node and mission slot."""
    slots = int(missions["slots"].sum()) * len(space.nodes)
    test, rate = "Arrivals of all missions: rate per node and slot", space.arrival_rate
    mean = float(missions["arrived"].sum() / slots)
    if not rate:
        return Check(ARRIVALS, test, "0", f"{mean:g}", slots, error=mean)
    return Check.normal(ARRIVALS, test, rate, mean, np.sqrt(rate / slots), slots, digits=6)


def parameter_fits(missions: pd.DataFrame, space: ScenarioSpace) -> dict[str, Fit]:
    """Fits of the drawn parameters of missions to uniform distributions, by field."""
    ranges = {field: getattr(space, field) for field in SAMPLED}
    return {
        field: uniform_fit(missions[field].to_numpy(), low, high)
        for field, (low, high) in ranges.items()
        if low < high
    }


def parameter_checks(missions: pd.DataFrame, space: ScenarioSpace) -> list[Check]:
    """Check that the drawn parameters are uniform and independent of each other."""
    fits, n = parameter_fits(missions, space), len(missions)
    checks = []
    for field, fit in fits.items():
        low, high = getattr(space, field)
        test = f"{parameter(field).name}: chi-square"
        checks.append(Check(DRAWS, test, f"uniform on {low}..{high}", fit.range, n, fit.p))
    return [*checks, *_independence_checks(missions[[*fits]])]


def _independence_checks(values: pd.DataFrame) -> list[Check]:
    """Check that all pairs of columns are uncorrelated, by one test for all pairs."""
    pairs, n = [*combinations(values, 2)], len(values)
    if not pairs or n < _FEWEST:
        return []
    table = np.corrcoef(values.rank(), rowvar=False)
    off = table[np.triu_indices(len(table), 1)]
    p = float(stats.chi2.sf(n * (off**2).sum(), len(pairs)))
    seen = " to ".join(minus(f"{end:+.3f}") for end in (off.min(), off.max()))
    return [Check(DRAWS, "Correlations of all pairs: chi-square", "0", seen, n, p)]


def initial_checks(starts: np.ndarray, totals: np.ndarray, space: ScenarioSpace) -> list[Check]:
    """Check the distributions of the initial data per node and of their sum per mission.

    Args:
        starts: (N, K) initial data of missions [data units], by node.
        totals: (M,) initial data of missions [data units].
        space: The scenario space from which they are drawn.
    """
    low, high = space.initial_data
    if low == high:
        error = np.abs(starts - low).max(initial=0.0) / (low or 1.0)
        known = f"{low:g}"
        return [
            Check(DRAWS, "Initial data per node", known, known, starts.size, error=float(error))
        ]
    range_of = f"U({low:g}, {high:g})"
    per_node, total = stats.uniform(low, high - low), closed_forms.initial_total(space)
    return [
        _distribution_check("node", starts.ravel(), per_node, range_of),
        _distribution_check("mission", totals, total, f"sum of {len(space.nodes)} {range_of}"),
    ]


def _distribution_check(per: str, values: np.ndarray, law: Any, known: str) -> Check:
    test = f"Initial data per {per}: Kolmogorov-Smirnov"
    if not values.size:
        return Check(DRAWS, test, known, "", 0)
    seen = f"mean {decimals(*mean_interval(values))}; known {law.mean():.3f}"
    return Check(DRAWS, test, known, seen, values.size, float(stats.kstest(values, law.cdf).pvalue))


def start_check(cells: np.ndarray, space: ScenarioSpace) -> Check:
    """Check that the start cell of the first UAV is uniform over the zone.

    Args:
        cells: (N, 2) start cells.
        space: The scenario space from which they are drawn.
    """
    x, y, width, height = space.zone
    offset = np.reshape(cells, (-1, 2)) - [x, y]
    in_zone = ((offset >= 0) & (offset < [width, height])).all(1)
    number = np.where(in_zone, offset @ [1, width], -1)  # -1 for a cell outside the zone
    fit = uniform_fit(number, 0, width * height - 1)
    test, known = "Start cell of the first UAV: chi-square", f"uniform on {width * height} cells"
    return Check(DRAWS, test, known, fit.range, len(cells), fit.p)
