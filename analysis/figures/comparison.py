"""Figures that compare policies: paired differences, means, gaps to the bound, claims."""

from collections.abc import Mapping, Sequence
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dess.analysis.figures import style
from dess.analysis.metrics import BOUND, HOME, METRICS, PRODUCT, metric_of
from dess.analysis.numbers import format_count

TAIL = 0.05  # share of the missions beyond each end of the second panel of a difference


def plot_claims(table: pd.DataFrame, width: int = 60) -> Figure:
    """Results minus the numbers that the paper prints: a row per number, a colour per policy.

    Args:
        table: Rows with ``claim``, ``policy``, and the difference ``mean``, ``low`` and ``high``.
        width: The characters in a line of a name.
    """
    names = [*table["claim"].unique()]
    styles = style.policy_colours(table["policy"])
    lines = [fill(name, width) for name in names]
    if width > max(map(len, names)):
        height = 0.3 * len(names)
    else:
        height = 0.52 * len(names)
    with style.new_panels(height, values="x", legend=5) as (figure, ax):
        for shift, (policy, rows) in zip(
            style.side_by_side_shifts(len(styles), 0.3),
            table.groupby("policy", sort=False),
            strict=True,
        ):
            places = rows["claim"].map(names.index) + shift
            arms = style.error_bar_arms(rows)
            ax.errorbar(rows["mean"], places, xerr=arms, linestyle="", label=policy,
                        **style.dot_style(styles[str(policy)]))  # fmt: skip
        ax.axvline(0, **style.ZERO)
        ax.set_yticks(range(len(names)), lines)
        ax.set(ylim=(len(names) - 0.5, -0.5), xlabel="ours minus the paper's [points]")
        style.set_axis_unit(ax.xaxis, "points")
    return figure


def plot_sides(table: pd.DataFrame, metric: str, sides: Sequence[str]) -> Figure:
    """A metric of every policy in the baseline and in the variation, with intervals.

    Args:
        table: Rows of ``answers.sides.means_of_sides``.
        metric: One of their metrics.
        sides: The texts below the baseline and the variation.
    """
    rows = table[table["metric"] == metric].dropna(subset="mean")
    rows = rows.assign(position=rows["point"], value=rows["point"].map(dict(enumerate(sides))))
    with style.new_panels(4.1, values="y") as (figure, ax):
        style.plot_along(rows, style.policy_colours(rows["policy"]), metric_of(metric).axis, ax)
        ax.set(ylabel=metric_of(metric).label, xlim=(-0.45, 1.45))
        ax.set_xticks((0, 1), sides)
        if metric in METRICS:
            ax.set_ylim(style.axis_ends(rows, 0.05))
        last = rows.sort_values("position").groupby("policy", sort=False).last()
        style.name_lines({name: (1.05, mean) for name, mean in last["mean"].items()}, ax)
    return figure


def plot_gains(answers: pd.DataFrame) -> Figure:
    """The paired differences of the metrics of every policy, with intervals.

    Args:
        answers: Rows of ``answers.sides.compare_sides``; the way home is shown if they have it.
    """
    names = METRICS | {HOME: "Battery for\nthe way home"}
    rows = answers[answers["metric"].isin([*names])]
    return plot_differences(rows, rows["metric"].map(names), "Variation − baseline")


def plot_difference_spread(differences: Mapping[str, pd.Series]) -> Figure:
    """The distribution of the paired differences of every policy: all, and the central part.

    Args:
        differences: For each policy the result of ``answers.sides.paired_differences``.
    """
    with style.new_panels(5.6, 2, sharey=True) as (figure, axes):
        titles = ("Share of missions with that difference or less", "The central part of it")
        for ax, title in zip(axes, titles, strict=True):
            style.plot_distributions(differences, ax)
            ax.axvline(0, **style.ZERO)
            ax.axhline(0.5, color=style.MUTED, linewidth=0.9, linestyle=":", zorder=1)
            ax.set_title(title)
            style.set_axis_unit(ax.xaxis, "points", 7)
        axes[1].set(xlim=central_range([*differences.values()], TAIL), xlabel="percentage points")
        shares = np.linspace(0, 1, len(differences) + 2)[1:-1]
        halfway = {
            name: (float(of_policy.quantile(share)), share)
            for share, (name, of_policy) in zip(shares, differences.items(), strict=True)
        }
        if style.name_lines(halfway, axes[1]):
            for line in axes[0].lines:
                line.set_label(f"_{line.get_label()}")
    return figure


def plot_gaps(table: pd.DataFrame) -> Figure:
    """The product of every policy and the upper bound, in a panel per number of UAVs.

    Args:
        table: Rows of ``answers.optimality.fleets_with_useful_bound``.
    """
    fleets = [*table.groupby("uavs", sort=False)]
    height = (0.75 + 0.22 * table["policy"].nunique()) * len(fleets) + 0.6
    with style.new_panels(height, len(fleets), "x", sharex=True, squeeze=False) as (figure, axes):
        for ax, (uavs, rows) in zip(axes.flat, fleets, strict=True):
            bound, low, high = rows[[BOUND, f"{BOUND}_low", f"{BOUND}_high"]].iloc[0]
            ax.axvspan(low, high, **style.band(style.MUTED))
            ax.axvline(bound, color=style.INK, linewidth=1.3, gid="bound")
            ax.annotate("upper bound ", (bound, 0.97), xycoords=("data", "axes fraction"),
                        ha="right", va="top", fontsize=9, color=style.INK)  # fmt: skip
            style.plot_in_rows(rows, ax, PRODUCT, f"{PRODUCT}_low", f"{PRODUCT}_high")
            ax.set(title=f"{format_count(uavs, 'UAV')}: bound {bound:.1%}", xlim=(-0.02, 1.02))
            style.set_axis_unit(ax.xaxis, "%")
        ax.set_xlabel(METRICS[PRODUCT])
    return figure


def plot_differences(rows: pd.DataFrame, names: pd.Series, title: str) -> Figure:
    """Paired differences of every policy by what has these names, in their order.

    Args:
        rows: Rows with ``policy``, ``difference``, ``low`` and ``high``.
        names: The name of what each row is about.
        title: The title of the figure.
    """
    rows = style.place_values(rows.assign(mean=rows["difference"], name=names), "name")
    with style.new_panels(3.6, values="y") as (figure, ax):
        ax.axhline(0, **style.ZERO)
        styles = style.policy_colours(rows["policy"])
        style.plot_along(rows, styles, "points", ax, linestyle="")
        ax.set(title=f"{title} (paired)", ylabel="percentage points")
        ax.margins(x=0.2)
        last = rows.sort_values("position").groupby("policy", sort=False).last()
        beside = last["position"] + 0.03 * np.ptp(rows["position"])
        style.name_lines({name: (beside[name], last["mean"][name]) for name in last.index}, ax)
    return figure


def central_range(values: Sequence[pd.Series], tail: float) -> tuple[float, float]:
    """The ends of an axis with 0 that leaves out a share ``tail`` of the values at each side."""
    low = min(0.0, *(sample.quantile(tail) for sample in values))
    high = max(0.0, *(sample.quantile(1 - tail) for sample in values))
    room = max(0.04 * (high - low), 0.01)
    return low - room, high + room
