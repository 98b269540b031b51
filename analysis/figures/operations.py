"""Figures of the operation of a fleet: metrics against a field, and the queue for pads over time.

Each returns a figure of its own; nothing touches pyplot's state.
"""

import pandas as pd
from matplotlib.figure import Figure

from analysis.figures import style
from analysis.figures.settings import graded, lines
from analysis.names import parameter, value_text


def against(rows: pd.DataFrame, x: str, line: str, metric: str, panel: str | None = None) -> Figure:
    """A metric against a field: a curve for each value of a second field, with 95 % intervals.

    Args:
        rows: Rows of ``operations.effects.means``.
        x: The field on the horizontal axis.
        line: The column with a curve for each value.
        metric: The metric.
        panel: A column with a panel for each value; by default there is one panel.
    """
    rows = rows[rows["metric"] == metric]
    looks = graded(sorted(rows[line].unique()))
    return lines(rows, x, sorted(rows[x].unique()), metric, looks, line, panel)


def queue(rows: pd.DataFrame) -> Figure:
    """The number of UAVs that wait for a pad over time: a panel per fleet, a band per pads.

    Args:
        rows: Rows of ``operations.queue.over_time``.
    """
    fleets = [*rows.groupby("uavs")]
    looks = graded(sorted(rows["pads"].unique()))
    with style.panels(1.9 * len(fleets) + 0.9, len(fleets), "y", sharex=True, squeeze=False) as (
        figure,
        axes,
    ):
        for ax, (uavs, part) in zip(axes.flat, fleets, strict=True):
            for pads, line in part.groupby("pads"):
                colour = looks[value_text(pads)][0]
                ax.fill_between(line["slot"], line["low"], line["high"], step="post", color=colour,
                                alpha=0.25, linewidth=0)  # fmt: skip
                ax.plot(line["slot"], line["mean"], color=colour, label=value_text(pads))
            ax.set(title=f"UAVs that wait for a pad: {uavs} UAVs", ylim=(0, None))
            style.round_ticks(ax.yaxis, 4)
        axes.flat[-1].set_xlabel("mission slot")
        handles = {h.get_label(): h for ax in axes.flat for h in ax.get_lines()}
        figure.legend(handles.values(), handles, loc="outside lower center", ncols=4,
                      title=parameter("pads").label)  # fmt: skip
    return figure
