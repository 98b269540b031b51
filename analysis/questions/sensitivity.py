"""Global sensitivity analysis: Sobol indices of a Saltelli design."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from scipy import stats

from analysis import numbers
from analysis.names import MEANS, SHARES, parameter, value_text
from analysis.names import METRICS as METRIC_NAMES
from analysis.stats.intervals import LEVEL
from analysis.study.design import NOISE, Saltelli
from dess import InputError

METRICS = (*SHARES, *MEANS)
RESAMPLES = 1000  # bootstrap resamples of the blocks of the design; every metric has the same


def sensitivity(
    design: Saltelli, missions: pd.DataFrame, metrics: Sequence[str] = METRICS
) -> pd.DataFrame:
    """First-order and total Sobol indices of each metric to each parameter and to the noise.

    A metric of a mission is a function of the parameters, each uniform on its range, and of the
    replication; an index is a share of its variance over the design.

    For a parameter, ``first`` is the share of the variance that disappears, on average, when the
    parameter is fixed. It measures how strongly the parameter alone changes the mean, so parameters
    with a large ``first`` should be set with care. ``total`` is the share that remains when all
    other factors, the replication included, are fixed. If it is near 0, the parameter changes no
    mission and can have any value in its range. A ``total`` above ``first`` means interaction with
    other parameters or with the noise. A parameter with a high ``total`` and a ``first`` of 0
    changes which missions go well, but not how many, unless other parameters are set with it.

    For the noise, ``total`` is the share that remains when all parameters are fixed. On average
    over the settings, no setting can remove it; only more missions reduce its effect on a mean. The
    rest of the variance is what all parameters explain together. ``first`` is the noise that all
    settings share, which common random numbers remove from comparisons. ``total`` above ``first``
    is noise that depends on the setting. Parameters that the scenario draws from ranges, and that
    are not in the design, belong to the noise.

    Args:
        design: The design of the missions.
        missions: The missions of one policy, a row per design point in order: columns ``point``,
            ``replication`` and the metrics.
        metrics: Columns to analyse.

    Returns:
        A row per metric and parameter, the noise last: ``metric``, ``parameter``, ``first``,
        ``first_low``, ``first_high``, ``total``, ``total_low``, ``total_high`` and ``n``, the
        number of missions. Intervals are normal 95 % intervals with the standard error of the
        bootstrap. Their coverage is right where the noise dominates. Where the parameters dominate
        they are too wide, because the design covers the space more evenly than the resamples.
        Estimates are not limited to [0, 1]; that of a small index may be negative. If a metric has
        the same value in all missions of A and B, its indices are nan.

    Raises:
        InputError: If the missions are not one per point of the design, in order.
    """
    expected = [(number, point.replication) for number, point in enumerate(design.points)]
    if [*missions[["point", "replication"]].itertuples(index=False, name=None)] != expected:
        raise InputError(
            f"missions: {len(missions)} that are not those of the design; "
            f"allowed: one for each of its {len(expected)} points, in order, of one policy"
        )
    tables = {metric: _indices(design, missions[metric].to_numpy(float)) for metric in metrics}
    return pd.concat(tables, names=["metric"]).reset_index("metric").reset_index(drop=True)


def index_table(indices: pd.DataFrame) -> pd.DataFrame:
    """Sobol indices as text, with their intervals.

    Args:
        indices: Rows of ``questions.summary.sensitivities``.
    """
    rows = indices
    columns = {
        "Policy": rows["policy"],
        "Metric": rows["metric"].map(METRIC_NAMES),
        "Parameter": rows["parameter"].map(lambda p: "noise" if p == NOISE else parameter(p).name),
        "Alone": numbers.estimates(rows, "first"),
        "With all interactions": numbers.estimates(rows, "total"),
    }
    return pd.DataFrame(columns)


def ranges_in_words(ranges: Mapping[str, Sequence[float]]) -> str:
    """``number of UAVs 1–3 and initial data per node 5–20``."""
    return numbers.words(
        [f"{parameter(field).within} {value_text(ends)}" for field, ends in ranges.items()]
    )


def _indices(design: Saltelli, values: np.ndarray) -> pd.DataFrame:
    """A row per parameter: first-order and total indices, each with the ends of its interval.

    The estimators are those of SALib (Saltelli and others 2010), for all resamples at once.
    """
    rows = (values - values.mean()).reshape(design.base, -1)
    a, b, mixed = rows[:, :1], rows[:, -1:], rows[:, 1:-1]  # A, B, and A with a column of B
    drawn = np.random.default_rng(0).integers(design.base, size=(design.base, RESAMPLES))
    counts = [np.bincount(blocks, minlength=design.base) for blocks in drawn.T]
    weights = np.array([np.ones(design.base), *counts]) / design.base  # the design itself first
    variance = weights @ (a**2 + b**2) / 2 - (weights @ (a + b) / 2) ** 2
    varies = np.ptp([a, b]) > np.finfo(float).eps * np.ptp(values)
    variance[variance <= 0] = np.inf  # of a resample in which nothing varies: its indices are 0
    table = pd.DataFrame({"parameter": design.problem["names"]})
    half = stats.norm.ppf(0.5 + LEVEL / 2)
    for name, share in (("first", b * (mixed - a)), ("total", (a - mixed) ** 2 / 2)):
        indices = weights @ share / variance if varies else np.full((3, len(table)), np.nan)
        table[name], error = indices[0], half * indices[1:].std(axis=0, ddof=1)
        table[f"{name}_low"], table[f"{name}_high"] = table[name] - error, table[name] + error
    return table.assign(n=len(values))
