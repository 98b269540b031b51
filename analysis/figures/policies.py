"""Figures of the metrics of policies in a study: a row per policy, or by the number of UAVs.

Each returns a figure of its own; nothing touches pyplot's state.
"""

from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from analysis.figures import style
from analysis.names import METRICS

_PRINTED: dict = {"color": style.INK, "linestyle": "--", "linewidth": 1.3}


def performance(summary: pd.DataFrame, metric: str, printed: float | None = None) -> Figure:
    """A metric of every policy: means with intervals, and the paper's number as a line.

    Args:
        summary: Rows of ``analysis.summary`` by ``policy``.
        metric: One of ``METRICS``.
        printed: The paper's number.
    """
    rows = summary[summary["metric"] == metric].reset_index(drop=True)
    colours = style.policy_colours(rows["policy"])
    with style.panels(1.3 + 0.42 * len(rows), values="x") as (figure, ax):
        style.policy_rows(rows, colours, ax)
        for y, mean in enumerate(rows["mean"]):
            style.note_at_right(f"{mean:.1%}", y, ax)
        if printed is not None:
            ax.axvline(printed, **_PRINTED, label=f"paper {printed:.1%}", zorder=1)
            style.legend_below(figure, ax)
        ax.set(title=METRICS[metric], xlim=(-0.02, 1.02))
        ax.set_xticks(np.linspace(0, 1, 6))
        ax.xaxis.set_major_formatter(PercentFormatter(1))
    return figure


def by_fleet(
    summary: pd.DataFrame, metric: str, printed: Mapping[int, float] | None = None
) -> Figure:
    """A metric of every policy against the number of UAVs, with intervals.

    Args:
        summary: Rows of ``analysis.summary`` by ``policy`` and ``uavs``.
        metric: One of ``METRICS``.
        printed: The paper's numbers by number of UAVs.
    """
    rows = summary[summary["metric"] == metric]
    colours = style.policy_colours(summary["policy"])
    with style.panels(3.9, values="y") as (figure, ax):
        style.policy_means(rows, "uavs", colours, 0.12, ax, alpha=0.9)
        if printed:
            ax.plot(*zip(*sorted(printed.items()), strict=True), marker="D", markersize=6,
                    label="paper", **_PRINTED)  # fmt: skip
        ax.set(title=METRICS[metric], xlabel="UAVs", ylim=(-0.03, 1.04))
        ax.set_xticks(sorted(rows["uavs"].unique()))
        ax.set_yticks(np.linspace(0, 1, 6))
        ax.yaxis.set_major_formatter(PercentFormatter(1))
        style.legend_below(figure, ax, 5)
    return figure
