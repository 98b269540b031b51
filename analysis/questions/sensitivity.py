"""Global sensitivity analysis: Sobol indices of a Saltelli design, computed with SALib."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.names import MEANS, SHARES, SUCCESS, parameter, value_text
from analysis.names import METRICS as METRIC_NAMES
from analysis.stats.intervals import LEVEL
from analysis.study.design import NOISE, Saltelli
from dess import InputError

METRICS = (*SHARES, *MEANS)


def sensitivity(
    design: Saltelli,
    missions: pd.DataFrame,
    metrics: Sequence[str] = METRICS,
    level: float = LEVEL,
    resamples: int = 1000,
    seed: int = 0,
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
        level: Confidence level.
        resamples: Bootstrap resamples of the blocks of the design.
        seed: Of the resamples; every metric has the same.

    Returns:
        A row per metric and parameter, the noise last: ``metric``, ``parameter``, ``first``,
        ``first_low``, ``first_high``, ``total``, ``total_low``, ``total_high`` and ``n``, the
        number of missions. Intervals are normal intervals with the standard error of the bootstrap.
        Their coverage is right where the noise dominates. Where the parameters dominate they are
        too wide, because the design covers the space more evenly than the resamples. Estimates are
        not limited to [0, 1]; that of a small index may be negative. If a metric has the same value
        in all missions of A and B, its indices are nan.

    Raises:
        InputError: If the missions are not one per point of the design, in order.
    """
    _check(design, missions)
    parameters = design.problem["names"]
    rows = [
        (metric, parameter, *indices, len(missions))
        for metric in metrics
        for parameter, indices in zip(
            parameters,
            _indices(design, missions[metric].to_numpy(float), level, resamples, seed),
            strict=True,
        )
    ]
    ends = [f"{index}{end}" for index in ("first", "total") for end in ("", "_low", "_high")]
    return pd.DataFrame(rows, columns=["metric", "parameter", *ends, "n"])


def index_table(indices: pd.DataFrame) -> pd.DataFrame:
    """Sobol indices as text, with their intervals.

    Args:
        indices: Rows of ``questions.summary.sensitivities``; rows with nan are left out.
    """
    rows = indices.dropna(subset=["first"])
    columns = {
        "Policy": rows["policy"],
        "Metric": rows["metric"].map(METRIC_NAMES),
        "Parameter": rows["parameter"].map(lambda p: "noise" if p == NOISE else parameter(p).name),
        "Alone": numbers.estimates(rows, "first"),
        "With all interactions": numbers.estimates(rows, "total"),
    }
    return pd.DataFrame(columns)


def failures_in_words(missions: pd.DataFrame) -> str:
    """``the failed missions: 0 of greedy and 3 of ddqn``, what shares of the success rest on."""
    failed = missions.groupby("policy", sort=False)[SUCCESS].agg(lambda of: int((of == 0).sum()))
    counts = [f"{count:,} of {policy}" for policy, count in failed.items()]
    return "the failed missions: " + numbers.words(counts)


def ranges_in_words(ranges: Mapping[str, Sequence[float]]) -> str:
    """``number of UAVs 1–3 and initial data per node 5–20``."""
    return numbers.words(
        [f"{parameter(field).within} {value_text(ends)}" for field, ends in ranges.items()]
    )


def _indices(
    design: Saltelli, values: np.ndarray, level: float, resamples: int, seed: int
) -> np.ndarray:
    """(D, 6) first-order and total indices, each with the ends of its interval."""
    from SALib.analyze import sobol

    factors = design.problem["num_vars"]
    samples = values.reshape(design.base, factors + 2)[:, [0, -1]]  # A and B
    if np.ptp(samples) <= np.finfo(float).eps * np.ptp(values):
        return np.full((factors, 6), np.nan)
    indices = sobol.analyze(
        design.problem,
        values,
        calc_second_order=False,
        num_resamples=resamples,
        conf_level=level,
        seed=np.random.default_rng(seed),  # not the seed itself, since SALib takes 0 for "no seed"
    )
    pairs = [(indices[name], indices[f"{name}_conf"]) for name in ("S1", "ST")]
    return np.column_stack(
        [ends for mean, half in pairs for ends in (mean, mean - half, mean + half)]
    )


def _check(design: Saltelli, missions: pd.DataFrame) -> None:
    expected = [(number, point.replication) for number, point in enumerate(design.points)]
    keys = list(missions[["point", "replication"]].itertuples(index=False, name=None))
    if keys != expected:
        raise InputError(
            f"missions: {len(keys)} that are not those of the design; "
            f"allowed: one for each of its {len(expected)} points, in order, of one policy"
        )
