"""Figures of the operation of a fleet: metrics against a field, and the queue for pads over time.

Each returns a figure of its own; nothing touches pyplot's state.
"""

import pandas as pd
from matplotlib.figure import Figure

from analysis.figures import style
from analysis.figures.settings import curves, graded, of_metric
from analysis.names import metric_label, parameter, value_text


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
    panels = [*rows.groupby(panel, sort=False)] if panel else [("", rows)]
    values = sorted(rows[x].unique())
    with style.look():
        figure, axes = style.panels(2.9 * len(panels) + 0.9, len(panels), "y", sharex=True,
                                    sharey=True, squeeze=False)  # fmt: skip
        for ax, (value, part) in zip(axes.flat, panels, strict=True):
            looks = graded(sorted(rows[line].unique()))
            curves(part.assign(policy=part[line].map(value_text)), x, looks, values, ax)
            about = parameter(str(panel))
            name = "" if panel in (None, "policy") else f"{about.name} "
            ax.set_title(f"{name}{value_text(value)}".strip(), fontsize=10, fontweight="normal")
            of_metric(ax.yaxis, metric)
        figure.suptitle(metric_label(metric), fontsize=11, fontweight="bold")
        axes.flat[-1].set_xlabel(parameter(x).label)
        handles = axes.flat[0].get_legend_handles_labels()
        title = parameter(line).label
        figure.legend(*handles, loc="outside lower center", ncols=4, title=title)
    return figure


def queue(rows: pd.DataFrame) -> Figure:
    """The number of UAVs that wait for a pad over time: a panel per fleet, a band per pads.

    Args:
        rows: Rows of ``operations.queue.over_time``.
    """
    fleets = [*rows.groupby("uavs")]
    looks = graded(sorted(rows["pads"].unique()))
    with style.look():
        figure, axes = style.panels(1.9 * len(fleets) + 0.9, len(fleets), "y", sharex=True,
                                    squeeze=False)  # fmt: skip
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
