"""Figures of the costs of settings: cost against a metric, with the Pareto front."""

import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, LogLocator, PercentFormatter

from analysis.figures import style
from analysis.names import COST, metric_name

WIDE = 20.0  # if the costs differ by this factor, their axis is logarithmic
MANY = 10_000  # costs above this are written in thousands
MOST_NAMES = 6  # largest number of settings on the front that are named
FAINT = 0.15  # the opacity of a setting that is not on the front


def front(table: pd.DataFrame, metric: str, currency: str, required: float | None = None) -> Figure:
    """Cost against a metric under one condition, with 95 % intervals and the front.

    The larger and darker a mark, the higher the probability that the setting is on the front.

    Args:
        table: Rows of ``questions.costs.front``.
        metric: The metric of the front.
        currency: The currency of the costs.
        required: The required mean of the metric, drawn as a line.
    """
    colours = style.policy_colours(table["policy"])
    with style.panels(4.1) as (figure, ax):
        for policy, rows in table.groupby("policy", sort=False):
            _settings(rows, metric, *colours[str(policy)], ax)
        on_front = table[table["on_front"]].sort_values(COST)
        ax.step(on_front[COST], on_front[metric], where="post", color=style.INK, linewidth=1.1,
                zorder=1, label="front of the estimates")  # fmt: skip
        if len(on_front) <= MOST_NAMES:
            _names(on_front, metric, ax)
        if required is not None:
            ax.axhline(required, color=style.MUTED, linestyle="--", linewidth=1.1, label="required")
        ax.set_ylabel(metric_name(metric).lower())
        ax.margins(x=0.12, y=0.12)
        ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=None))
        _costs_axis(table[COST], currency, ax)
        style.legend_below(figure, ax)
    return figure


def _settings(rows: pd.DataFrame, metric: str, colour: str, marker: str, ax: Axes) -> None:
    """The settings of a policy, with intervals in both directions."""
    shares = rows["probability"].to_numpy()
    ends = [style.arms(rows, name, f"{name}_low", f"{name}_high") for name in (COST, metric)]
    for place, share in enumerate(shares):
        opacity = FAINT + (1 - FAINT) * share
        x_arm, y_arm = (of[:, [place]] for of in ends)
        ax.errorbar(rows[COST].iloc[[place]], rows[metric].iloc[[place]], xerr=x_arm, yerr=y_arm,
                    color=colour, marker=marker, markersize=4 + 5 * share, alpha=opacity,
                    elinewidth=1.1, linestyle="", zorder=2)  # fmt: skip
    ax.plot([], [], color=colour, marker=marker, linestyle="", label=str(rows["policy"].iloc[0]))


def _names(rows: pd.DataFrame, metric: str, ax: Axes) -> None:
    """The names of the settings on the front, below their marks."""
    for x, y, fleet in zip(rows[COST], rows[metric], rows["fleet"], strict=True):
        ax.annotate(fleet.replace(" and ", "\n"), (x, y), xytext=(7, -5), va="top", fontsize=8,
                    textcoords="offset points")  # fmt: skip


def _costs_axis(costs: pd.Series, currency: str, ax: Axes) -> None:
    """A cost axis with round values: in thousands if large, logarithmic if they differ much."""
    least, most = costs.min(), costs.max()
    if least > 0 and most / least > WIDE:
        ax.set_xscale("log")
        ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
        ax.minorticks_off()
    else:
        style.round_ticks(ax.xaxis, 5)
    unit = 1000 if most >= MANY else 1
    ax.xaxis.set_major_formatter(FuncFormatter(lambda cost, _: f"{cost / unit:,g}"))
    ax.set_xlabel(f"cost [{'1,000 ' if unit > 1 else ''}{currency}]")
