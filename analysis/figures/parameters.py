"""Figures of scenario parameters: the paper's Fig. 5, and sensitivity indices.

Each returns a figure of its own; nothing touches pyplot's state.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, PercentFormatter

from analysis.figures import style
from analysis.names import METRICS, parameter
from analysis.study.design import NOISE

# Half the distance between the outer policies at a value, as a share of the width of the axis.
APART = 0.02


def effect(
    table: pd.DataFrame, field: str, changes: Mapping[str, pd.DataFrame], policies: list[str]
) -> Figure:
    """The metrics against a parameter: a part of Fig. 5.

    There is a panel per metric, with the same axis for every parameter of the table, and a panel
    with the differences from the first value, which has its own axis.

    Args:
        table: Rows of ``questions.main_effects.effects``, of the policies to draw.
        field: The parameter.
        changes: For each policy to draw, its ``main_effects.changes`` in the last of ``METRICS``.
        policies: All policies of the study, so that every policy has the same colour on all pages.
    """
    rows = table[table["field"] == field]
    values = rows.drop_duplicates("position").sort_values("position")["value"].tolist()
    colours = style.policy_colours(policies)
    looks, half_width = {policy: colours[policy] for policy in changes}, APART * len(values)
    with style.panels(7.6, 4, "y", sharex=True, height_ratios=(1, 1.6, 1.6, 1.2)) as (figure, axes):
        for ax, metric in zip(axes, METRICS, strict=False):
            style.policy_means(rows[rows["metric"] == metric], "position", looks, half_width, ax)
            ax.set(title=METRICS[metric], ylim=style.ends(table[table["metric"] == metric], 0.1))
            ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=0))
        for policy, shift in zip(changes, style.shifts(len(changes), half_width), strict=True):
            _changes(changes[policy], shift, style.dot(policy, colours), axes[3])
        axes[3].set(
            title=f"Paired difference from the value at {values[0]}",
            ylabel="points",
        )
        axes[3].yaxis.set_major_formatter(FuncFormatter(style.signed_points))
        axes[3].set(xlim=(-0.4, len(values) - 0.6))
        axes[3].set_xlabel(parameter(field).label, parse_math=True)
        axes[3].set_xticks(range(len(values)), values)
        for ax in axes:
            style.round_ticks(ax.yaxis, 5)
        style.legend_below(figure, axes[0])
    return figure


def sensitivity(rows: pd.DataFrame, title: str) -> Figure:
    """Sobol indices of every parameter as bars with intervals; the noise has its own row.

    Args:
        rows: Rows of ``analysis.questions.summary.sensitivities`` of a policy and a metric.
        title: The title of the figure.
    """
    rows = rows.reset_index(drop=True)
    colour = style.palette()[0]
    with style.panels(1.5 + 0.52 * len(rows), values="x") as (figure, ax):
        for index, shift, face in (("first", -0.18, "white"), ("total", 0.18, colour)):
            name = {"first": "alone (first order)", "total": "with all interactions (total)"}[index]
            spots = np.arange(len(rows)) + shift
            ax.barh(spots, rows[index], 0.32, color=face, edgecolor=colour, label=name, zorder=2)
            bars = style.arms(rows, index, f"{index}_low", f"{index}_high")
            ax.errorbar(rows[index], spots, xerr=bars, fmt="none", ecolor=style.INK, capsize=3,
                        elinewidth=1.3, zorder=3)  # fmt: skip
        ax.axvline(0, color=style.INK, linewidth=0.8, zorder=1)
        for y in rows.index[rows["parameter"] == NOISE]:
            ax.axhline(y - 0.5, color=style.MUTED, linewidth=0.9, linestyle=":")
        names = [_tick(name) for name in rows["parameter"]]
        ax.set_yticks(range(len(rows)), names, parse_math=True)
        ax.set(title=title, ylim=(len(rows) - 0.5, -0.5), xlabel="share of the variance")
        ax.xaxis.set_major_formatter(PercentFormatter(1, decimals=0))
        style.legend_below(figure, ax, 2)
    return figure


def _changes(pairs: pd.DataFrame, shift: float, look: dict, ax: Axes) -> None:
    """The differences from the first value; its own difference is 0."""
    rows = pairs[pairs["first"] == 0].sort_values("second")
    bars = np.concatenate([np.zeros((2, 1)), style.arms(rows, "difference")], axis=1)
    spots = np.array([0, *rows["second"]]) + shift
    ax.errorbar(spots, [0, *rows["difference"]], yerr=bars, **look, linewidth=1)
    ax.axhline(0, color=style.MUTED, linewidth=0.9, zorder=1)


def _tick(name: str) -> str:
    return "noise of the\nreplication" if name == NOISE else parameter(name).tick
