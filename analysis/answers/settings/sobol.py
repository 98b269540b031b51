"""Sobol indices: which share of the variance of a metric each field and the noise explain."""

from collections.abc import Iterator, Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
from scipy.special import ndtri

from dess import InputError
from dess.analysis import numbers
from dess.analysis.figures import Drawing
from dess.analysis.metrics import METRICS, PRODUCT, metric_group, metric_of
from dess.analysis.names import field_named, value_text
from dess.analysis.results.tables import Results
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.study.design import NOISE, Saltelli
from dess.analysis.tables import INTERVALS, Table, stack_by_policy

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure

RESAMPLES = 1000  # bootstrap resamples of the blocks of the design; every metric has the same


def plot_indices(rows: pd.DataFrame, title: str) -> "Figure":
    """Sobol indices of every parameter as dots with intervals; the noise has its own row.

    Args:
        rows: Rows of ``sobol_indices_of`` of a policy and a metric.
        title: The title of the figure.
    """
    from dess.analysis.figures import style

    rows = rows.reset_index(drop=True)
    look = style.dot_style((style.readable_palette()[0], "o"))
    with style.new_panels(1.5 + 0.45 * len(rows), values="x", legend=2) as (figure, ax):
        for index, label, fill_style in (
            ("first", "alone (first order)", "none"),
            ("total", "with all interactions (total)", "full"),
        ):
            spots = np.arange(len(rows)) + (0.12 if index == "total" else -0.12)
            bars = style.error_bar_arms(rows, index, f"{index}_low", f"{index}_high")
            ax.errorbar(rows[index], spots, xerr=bars, linestyle="", label=label,
                        fillstyle=fill_style, **look)  # fmt: skip
        ax.axvline(0, **style.ZERO)
        for y in rows.index[rows["parameter"] == NOISE]:
            ax.axhline(y - 0.5, color=style.MUTED, linewidth=0.9, linestyle=":")
        noise = "noise of the\nreplication"
        names = [noise if name == NOISE else field_named(name).tick for name in rows["parameter"]]
        ax.set_yticks(range(len(rows)), names, parse_math=True)
        ax.set(title=title, ylim=(len(rows) - 0.5, -0.5), xlabel="share of the variance")
        style.set_axis_unit(ax.xaxis, "%")
    return figure


def draw_indices(results: Results, metric: str = PRODUCT) -> Iterator[Drawing]:
    """Sobol indices of every parameter for every policy."""
    table = sobol_indices_of(results)
    called = metric_of(metric).within
    for policy, data in table[table["metric"] == metric].groupby("policy", sort=False):
        caption = (
            f"{policy}: n = {data['n'].min():,} missions; lines are {INTERVALS} by bootstrap. "
            "Below the dotted line is the noise, which no setting removes."
        )
        alt = f"Sobol indices of {called} for {policy}"
        yield Drawing(plot_indices(data, str(policy)), alt, caption, data)


def sobol_indices(
    design: Saltelli,
    missions: pd.DataFrame,
    metrics: Sequence[str] = (*metric_group("paper", "reward"),),
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
        missions: The missions of one policy, a row per design point in order, with the metrics.
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
        InputError: If there is not one mission of every point of the design.
    """
    if len(missions) != design.count:
        problem = f"{len(missions)} are not those of the design"
        allowed = f"one for each of its {design.count} design points"
        raise InputError("missions", problem, allowed)
    tables = {
        metric: _estimate_indices(design, missions[metric].to_numpy(float)) for metric in metrics
    }
    return pd.concat(tables, names=["metric"]).reset_index("metric").reset_index(drop=True)


def index_table(indices: pd.DataFrame) -> Table:
    """Sobol indices with their intervals.

    Args:
        indices: Rows of ``sobol_indices_of``.
    """
    names = indices["parameter"].map(lambda p: "noise" if p == NOISE else field_named(p).name)
    cells = {
        "Policy": indices["policy"],
        "Metric": indices["metric"].map(METRICS),
        "Parameter": names,
        "Alone": numbers.format_estimates(indices, "first"),
        "With all interactions": numbers.format_estimates(indices, "total"),
    }
    caption = f"Sobol indices as shares of the variance, with {INTERVALS}"
    return Table(pd.DataFrame(cells), caption, indices)


def variance_sentence(results: Results, metric: str) -> str:
    """Which fields explain most of the variance of a metric for the first policy, in a sentence."""
    rows = sobol_indices_of(results)
    called = metric_of(metric).within
    rows = rows[(rows["metric"] == metric) & (rows["policy"] == results.policies[0])].dropna()
    parts = [
        f"{field_named(row.parameter).within if row.parameter != NOISE else 'the replication'} "
        f"{numbers.format_percent(row.total)}"
        for row in rows.nlargest(3, "total").itertuples()
    ]
    if not parts:
        return f"The {called} is the same in all missions: no variance."
    return (
        f"Of the variance of the {called} of {results.policies[0]}, with all interactions: "
        f"{numbers.join_words(parts)}."
    )


def ranges_in_words(ranges: Mapping[str, Sequence[float]]) -> str:
    """``number of UAVs 1–3 and initial data per node 5–20``."""
    return numbers.join_words(
        [f"{field_named(field).within} {value_text(ends)}" for field, ends in ranges.items()]
    )


def _estimate_indices(design: Saltelli, values: np.ndarray) -> pd.DataFrame:
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
    half = ndtri(0.5 + LEVEL / 2)
    for name, share in (("first", b * (mixed - a)), ("total", (a - mixed) ** 2 / 2)):
        if varies:
            indices = weights @ share / variance
        else:
            indices = np.full((3, len(table)), np.nan)
        error = half * indices[1:].std(axis=0, ddof=1)
        table[name] = indices[0]
        table[f"{name}_low"] = table[name] - error
        table[f"{name}_high"] = table[name] + error
    return table.assign(n=len(values))


def sobol_indices_of(results: Results) -> pd.DataFrame:
    """The Sobol indices of each metric of each policy for each parameter and for the noise.

    Returns:
        A row per policy, metric and parameter: ``policy``, and the columns of
        ``sobol_indices``. Empty if the design is not of the kind ``saltelli``.
    """
    design = results.study.design
    if not isinstance(design, Saltelli):
        return pd.DataFrame()
    missions = results.missions.groupby("policy", sort=False)
    return stack_by_policy(
        {name: sobol_indices(design, rows, [*METRICS]) for name, rows in missions}
    )
