"""Checks of all that is random: draws, the channel, and how often intervals contain the mean."""

from collections.abc import Sequence
from itertools import combinations
from typing import Any

import numpy as np
import pandas as pd
from scipy import special, stats

from dess.analysis.names import field_named
from dess.analysis.numbers import format_decimals, format_interval, format_minus
from dess.analysis.stats.intervals import Interval, mean_interval, share_interval
from dess.physics import streams
from dess.physics.fleet import type_of
from dess.scenario.fields import SAMPLED
from dess.scenario.scenario import ScenarioSpace
from tests.verification import closed_forms
from tests.verification.checks import (
    ARRIVALS,
    CHANNEL,
    COVERAGE,
    DRAWS,
    LEAST,
    Check,
    Fit,
    chi_square,
    poisson_fit,
    uniform_fit,
)
from tests.verification.measurements import Log

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
        counts: (T, K) data units that arrived, by slot and node.
        rate: The arrival rate.
    """
    if not rate:
        units = int(counts.sum())
        seen = f"{units:,} data units"
        return [Check(ARRIVALS, "Arrivals", "none", seen, counts.size, error=float(units))]
    checks = [
        Check(ARRIVALS, f"{name}: chi-square", f"Poisson({mean:g})", fit.shares, fit.n, fit.p)
        for name, fit, mean in arrival_fits(counts, rate)
    ]
    totals = counts.sum(1)
    mean = counts.shape[1] * rate
    return [
        *checks,
        _rates_check(counts, rate),
        _dispersion_check(totals),
        _lag_check(totals, mean),
    ]


def _rates_check(counts: np.ndarray, rate: float) -> Check:
    """Check that the total of each node has the known rate."""
    slots, nodes = counts.shape
    expected = slots * rate
    totals = counts.sum(0)
    p = None
    if expected >= LEAST:
        p = chi_square(totals, np.full(nodes, expected), nodes)
    rates = totals / max(slots, 1)
    seen = ""
    if slots:
        seen = f"{rates.min():.4g} to {rates.max():.4g}"
    test = f"Rates of the {nodes} nodes: chi-square"
    return Check(ARRIVALS, test, f"{rate:g} each", seen, int(totals.sum()), p)


def _dispersion_check(totals: np.ndarray) -> Check:
    """Check the variance / mean of the counts per slot, by its moments conditional on the sum."""
    test = "Index of dispersion per slot"
    n = totals.size
    units = int(totals.sum())
    if n < _FEWEST or units < _FEWEST:
        return Check(ARRIVALS, test, "1", "", n)
    index = totals.var(ddof=1) / totals.mean()
    error = np.sqrt(2 * (1 - 1 / units) / (n - 1))
    return Check.normal(ARRIVALS, test, 1, index, error, n)


def _lag_check(totals: np.ndarray, mean: float) -> Check:
    """Check that the counts of successive slots are uncorrelated."""
    test = "Correlation of a slot and the next"
    n = totals.size - 1
    if n < _FEWEST:
        return Check(ARRIVALS, test, "0", "", max(n, 0))
    correlation = ((totals[1:] - mean) * (totals[:-1] - mean)).mean() / mean
    return Check.normal(ARRIVALS, test, 0, correlation, 1 / np.sqrt(n), n)


def arrived_check(missions: pd.DataFrame, space: ScenarioSpace) -> Check:
    """Compare the arrivals of all missions with lambda per node and mission slot."""
    slots = int(missions["slots"].sum()) * len(space.nodes)
    test = "Arrivals of all missions: rate per node and slot"
    rate = space.arrival_rate
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
    fits = parameter_fits(missions, space)
    n = len(missions)
    checks = []
    for field, fit in fits.items():
        low, high = getattr(space, field)
        test = f"{field_named(field).name}: chi-square"
        checks.append(Check(DRAWS, test, f"uniform on {low}..{high}", fit.range, n, fit.p))
    return [*checks, *_independence_checks(missions[[*fits]])]


def _independence_checks(values: pd.DataFrame) -> list[Check]:
    """Check that all pairs of columns are uncorrelated, by one test for all pairs."""
    pairs = [*combinations(values, 2)]
    n = len(values)
    if not pairs or n < _FEWEST:
        return []
    table = np.corrcoef(values.rank(), rowvar=False)
    off = table[np.triu_indices(len(table), 1)]
    p = float(stats.chi2.sf(n * (off**2).sum(), len(pairs)))
    seen = " to ".join(format_minus(f"{end:+.3f}") for end in (off.min(), off.max()))
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
        value = f"{low:g}"
        return [Check.exact(DRAWS, "Initial data per node", value, value, starts.size, error)]
    range_of = f"U({low:g}, {high:g})"
    per_node = stats.uniform(low, high - low)
    total = closed_forms.initial_total(space)
    return [
        _distribution_check("node", starts.ravel(), per_node, range_of),
        _distribution_check("mission", totals, total, f"sum of {len(space.nodes)} {range_of}"),
    ]


def _distribution_check(per: str, values: np.ndarray, law: Any, known: str) -> Check:
    test = f"Initial data per {per}: Kolmogorov-Smirnov"
    if not values.size:
        return Check(DRAWS, test, known, "", 0)
    seen = f"mean {format_decimals(*mean_interval(values))}; known {law.mean():.3f}"
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
    test = "Start cell of the first UAV: chi-square"
    distribution = f"uniform on {width * height} cells"
    return Check(DRAWS, test, distribution, fit.range, len(cells), fit.p)


# Units in the last place by which two ways to compute a rate may differ. Each has few steps, and
# the conversion of the SNR from dB to a ratio increases the rounding error most.
_ROUNDINGS = 1000
_COMMUNICATIONS = ["node", "value", "best", "known", "residual"]


def rate_check(rates: pd.DataFrame) -> Check:
    """Compare the rates of ``measurements.compare_rates`` with the integral over all shadowing."""
    test = "Mean rate of a lone UAV at each distance: chi-square"
    expectation = "E[δ log₂(1 + SNR)] by integration"
    n = int(rates["n"].sum())
    off = float((rates["mean"] / rates["known"] - 1).abs().max())
    seen = f"within {100 * off:.2g} % at {len(rates)} distances"
    if not (rates["error"] > 0).all():  # without shadowing, nothing is random
        return Check.exact(CHANNEL, test, expectation, seen, n, off, bound=1e-9)
    square = (((rates["mean"] - rates["known"]) / rates["error"]) ** 2).sum()
    return Check(CHANNEL, test, expectation, seen, n, float(stats.chi2.sf(square, len(rates))))


def shadowing_checks(deviates: np.ndarray) -> list[Check]:
    """Compare ``measurements.shadowing_deviates`` with independent normal variables."""
    n = deviates.size
    test = "Correlation of a communication slot and the next"
    mean, deviation = (format_minus(f"{value:.3f}") for value in (deviates.mean(), deviates.std()))
    seen = f"mean {mean}, deviation {deviation}"
    p = float(stats.kstest(deviates, stats.norm.cdf).pvalue)
    correlation = float((deviates[1:] * deviates[:-1]).mean())
    return [
        Check(CHANNEL, "Shadowing of a lone UAV: Kolmogorov-Smirnov", "N(0, 1)", seen, n, p),
        Check.normal(CHANNEL, test, 0, correlation, 1 / np.sqrt(n - 1), n - 1),
    ]


def communication_checks(logs: Sequence[Log], seed: int) -> list[Check]:
    """Check the served node and the amount of data of every communication in the logs.

    Both are computed again from the formula, with the shadowing of that communication slot: the
    node with the highest SNR of those with data, and the smaller of its rate and its data.
    """
    tables = [recompute_communications(log, seed) for log in logs]
    if tables:
        table = pd.concat(tables)
    else:
        table = pd.DataFrame(columns=_COMMUNICATIONS, dtype=float)
    same = table[table["node"] == table["best"]]
    off = 0.0
    if len(same):
        off = float((same["value"] / same["known"] - 1).abs().max())
    emptied = int((same["known"] == same["residual"]).sum())
    seen = f"off by {off:.1e} of it at most; {emptied:,} times the node was emptied"
    test, rule = "Node served in a communication slot", "the best SNR among nodes with data"
    choice = Check.counted(CHANNEL, test, rule, len(table) - len(same), len(table))
    test, rule = "Data of a communication", "min(R, D) with the shadowing that was drawn"
    bound = _ROUNDINGS * np.finfo(float).eps
    return [choice, Check.exact(CHANNEL, test, rule, seen, len(same), off, bound)]


def recompute_communications(log: Log, seed: int) -> pd.DataFrame:
    """Compute every communication of a log again.

    Returns:
        A row per communication: ``node`` and ``value`` as logged; ``best``, the node with the
        highest SNR of those with data; ``known``, the smaller of its rate and its ``residual``
        [data units].
    """
    scenario = log.scenario
    m = log.scenario.communication_slots
    served = log.events["event"] == "communication"
    rows = log.events[served]
    slot = np.ceil(rows["time"]).to_numpy(np.int64) - 1
    number = np.rint((rows["time"] - slot) * m).to_numpy(np.int64) - 1
    offset = rows[["x", "y"]].to_numpy()[:, None] - np.array(scenario.nodes)
    distance = closed_forms.distance_to_node(scenario, offset[..., 0], offset[..., 1])
    eta = _shadowing_of_slots(seed, log, rows["uav"].to_numpy(np.int64), slot, number)
    snr = closed_forms.mean_snr(scenario, distance) + eta
    residual = log.residuals[served.to_numpy()]
    best = np.where(residual > 0, snr, -np.inf).argmax(1)
    row = np.arange(len(rows))
    factor = rows["uav"].map(lambda i: type_of(scenario.fleet, int(i)).rate).to_numpy()
    rate = factor * closed_forms.rate_at_snr(scenario, snr[row, best])
    left = residual[row, best]
    columns = (rows["node"].array, rows["value"].array, best, np.minimum(rate, left), left)
    return pd.DataFrame(dict(zip(_COMMUNICATIONS, columns, strict=True)))


def _shadowing_of_slots(
    seed: int, log: Log, uav: np.ndarray, slot: np.ndarray, n: np.ndarray
) -> np.ndarray:
    """The (E, K) shadowing [dB] of communication slots ``n`` = 0..m-1, for all nodes.

    Four communication slots share a block of four random words. One counter word of the generator
    is made of the UAV and the number of this group of four slots.
    """
    block = (n // 4 * 65536 + uav).astype(np.uint64)
    lane = (np.uint64(streams.SHADOWING) << np.uint64(24)) | block
    key = np.uint64(seed)
    mask = np.uint64(2**32 - 1)
    half = np.uint64(32)
    words = streams.philox.py_func(
        np.arange(len(log.scenario.nodes), dtype=np.uint64)[None, :],
        slot.astype(np.uint64)[:, None],
        lane[:, None],
        np.uint64(log.replication),
        key & mask,
        key >> half,
    )
    word = np.choose(n[:, None] % 4, words)
    deviates = special.ndtri((word.astype(float) + 0.5) / 2.0**32)
    return np.sqrt(log.scenario.shadowing_variance) * deviates


def intervals_of_blocks(values: np.ndarray, size: int, share: bool) -> pd.DataFrame:
    """Intervals of blocks of missions, and whether each contains the mean of all missions.

    Args:
        values: (n,) a metric of missions; those after the last complete block are left out.
        size: Number of missions in a block.
        share: Whether the metric is 0 or 1 and has Wilson's interval, or Student's t otherwise:
            both have a coverage of independent missions that is known in closed form. Tables print
            wider intervals of the other metrics, as for ``stats.intervals.interval_of``.

    Returns:
        A row per block: ``mean``, ``low``, ``high``, ``reference`` (the mean of all missions) and
        ``holds``.
    """
    whole = values[: len(values) // size * size].reshape(-1, size)
    rows = [share_interval(int(b.sum()), size) if share else mean_interval(b) for b in whole]
    table = pd.DataFrame(rows, columns=Interval._fields)
    reference = np.nan
    if whole.size:
        reference = whole.mean()
    holds = (table["low"] <= reference) & (reference <= table["high"])
    return table.assign(reference=reference, holds=holds)


def coverage_check(metric: str, values: np.ndarray, size: int, share: bool) -> Check:
    """Compare the observed coverage of the blocks' intervals with the known coverage.

    Args:
        metric: The name of the metric.
        values: (n,) a metric of missions; those after the last complete block are left out.
        size: Number of missions in a block.
        share: Whether the metric is 0 or 1 in each mission.
    """
    table = intervals_of_blocks(values, size, share)
    n = len(table)
    test = f"{metric}: intervals of blocks of {size:,} missions"
    if n < 2 or np.ptp(values) == 0:  # coverage cannot be tested
        return Check(COVERAGE, test, "", "", n)
    missions = n * size
    hits = int(table["holds"].sum())
    if share:
        coverage = closed_forms.wilson_coverage(round(values[:missions].sum()), missions, size)
    else:
        coverage = closed_forms.t_coverage(missions, size)
    seen = f"{hits:,} of {n:,}: {format_interval(*share_interval(hits, n))}"
    p = float(stats.binomtest(hits, n, min(coverage, 1.0)).pvalue)
    return Check(COVERAGE, test, f"{100 * coverage:.1f} %", seen, n, p)
