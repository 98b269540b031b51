"""Figures of what is paid for a metric, as costs or as time for decisions, with the Pareto front.

Each returns a figure of its own; nothing touches pyplot's state.
"""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from analysis import numbers
from analysis.figures import style
from analysis.names import COST, METRICS, PRODUCT, metric_name

WIDE = 20.0  # if the costs differ by this factor, their axis is logarithmic
MOST_NAMES = 6  # largest number of settings that are named, of all or of those on the front
FAINT = 0.15  # the opacity of a setting that is not on the front


def costs(table: pd.DataFrame, metric: str, currency: str, required: float | None = None) -> Figure:
    """Cost against a metric under one condition, with 95 % intervals and the front.

    The larger and darker a mark, the higher the probability that the setting is on the front.

    Args:
        table: Rows of ``questions.costs.front``.
        metric: The metric of the front.
        currency: The currency of the costs.
        required: The required mean of the metric, drawn as a line.
    """
    looks = style.policy_colours(table["policy"])
    best = table[table["on_front"]].sort_values(COST)
    with style.panels(4.1) as (figure, ax):
        if len(best) > 1:
            _front(best[COST], best[metric], "front of the estimates", ax)
        for _, row in table.iterrows():
            colour, marker = looks[row["policy"]]
            x_arm, y_arm = (style.arms(row, m, f"{m}_low", f"{m}_high") for m in (COST, metric))
            ax.errorbar(row[COST], row[metric], xerr=x_arm, yerr=y_arm, color=colour, elinewidth=1,
                        marker=marker, markersize=4 + 5 * row["probability"],
                        alpha=FAINT + (1 - FAINT) * row["probability"])  # fmt: skip
        for policy, (colour, marker) in looks.items():
            ax.plot([], [], color=colour, marker=marker, linestyle="", label=policy)
        named = table.sort_values(COST) if len(table) <= MOST_NAMES else best
        for n, row in enumerate(named.to_dict("records") if len(named) <= MOST_NAMES else ()):
            side = ("top", -5) if n % 2 else ("bottom", 5)  # so that neighbours do not overlap
            ax.annotate(row["fleet"].replace(" and ", "\n"), (row[COST], row[metric]), va=side[0],
                        fontsize=8, xytext=(7, side[1]), textcoords="offset points",
                        **style.OUTLINED)  # fmt: skip
        if required is not None:
            ax.axhline(required, color=style.MUTED, linestyle="--", linewidth=1.1, label="required")
        ax.margins(x=0.12, y=0.12)
        style.in_units(ax.xaxis, "", 5)
        if table[COST].max() > WIDE * table[COST].min() > 0:
            ax.set_xscale("log")
            ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            ax.xaxis.set_minor_locator(NullLocator())
            ax.xaxis.set_major_formatter("{x:,g}")
        style.in_units(ax.yaxis, "%")
        ax.set(xlabel=f"cost [{currency}]", ylabel=metric_name(metric).lower())
    return figure


def decision_times(table: pd.DataFrame) -> Figure:
    """Decision time against the product of all policies, and their Pareto front.

    Args:
        table: Rows of ``optimality.planner.front``.
    """
    looks = style.policy_colours(table["policy"])
    best = table[table["on_front"]].sort_values("seconds")
    with style.panels(4.2) as (figure, ax):
        _front(best["seconds"], best["mean"], "Pareto front", ax)
        for _, row in table.iterrows():
            ax.errorbar(row["seconds"], row["mean"], yerr=style.arms(row), label=row["policy"],
                        linestyle="", **style.dot(looks[row["policy"]]))  # fmt: skip
        ax.set(xscale="log", title="Decision time against quality", ylabel=METRICS[PRODUCT])
        ax.set_xlabel("time of a decision for one mission, median")
        ax.set_xlim(table["seconds"].min() / 2, table["seconds"].max() * 2)
        ax.xaxis.set_major_formatter(lambda time, _: numbers.seconds(time))
        ax.xaxis.set_minor_locator(NullLocator())
        style.in_units(ax.yaxis, "%")
    return figure


def _front(paid: pd.Series, reached: pd.Series, label: str, ax: Axes) -> None:
    ax.step(paid, reached, where="post", color=style.INK, linewidth=1.1, zorder=1, label=label)
