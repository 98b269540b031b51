"""Figures over time: trainings, as in the paper's Fig. 3, their final metrics, and mean courses.

Each returns a figure of its own; nothing touches pyplot's state.
"""

import textwrap
from collections.abc import Mapping

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from analysis.answers.learning import ALPHA, smoothed
from analysis.answers.learning import LEARNED_REWARD as REWARD
from analysis.figures import style
from analysis.metrics import METRICS
from analysis.names import value_text

EVALUATED = {f"evaluation_{metric}": name for metric, name in METRICS.items()}
# The metrics that are evaluated while training, and their names.
NAMES = {REWARD: "Cumulative reward", **EVALUATED}

# A variant is off the axis if all of its trainings reach less than this share of the baseline.
OFF = 0.5


def trainings(curves: pd.DataFrame, metric: str, labels: Mapping[str, str]) -> Figure:
    """A metric against the training step, a line for each training: Fig. 3.

    Phases before the last one are dotted, and a vertical line marks the beginning of the last
    phase. The axis at the top shows the UAV-slots that have been simulated.

    Args:
        curves: Curves, see ``analysis.answers.learning``.
        metric: One of ``NAMES``.
        labels: The variants to draw, with their names in the legend.
    """
    drawn = curves[curves["variant"].isin(labels)]
    averages = smoothed(drawn, metric)
    looks = zip(labels.items(), style.palette(), style.LINES, strict=False)
    with style.panels(3.9, values="y", legend=2) as (figure, ax):
        for (variant, label), colour, line in looks:
            of_variant = averages[averages["variant"] == variant]
            last, n = of_variant["phase"].iloc[-1], of_variant["seed"].nunique()
            names = {last: f"{label}, n = {n}"}
            for (_, phase), curve in of_variant.groupby(["seed", "phase"], sort=False):
                ax.plot(curve["updates"], curve["value"], line if phase == last else ":",
                        color=colour, linewidth=1.6, label=names.pop(phase, ""))  # fmt: skip
            _last_phase(of_variant, ax)
        low, high = averages["value"].min(), averages["value"].max()
        room = 0.12 * (high - low) or 0.1
        style.in_units(ax.yaxis, "%" if metric in EVALUATED else "")
        ax.set(title=NAMES[metric], ylim=(low - room, high + room))
        _steps_axis(drawn, ax)
    return figure


# The caption of ``trainings``.
TRAININGS = (
    "A line is the exponential moving average of a training, n = 1 (weight of the newest "
    f"evaluation {ALPHA:g}); dotted: phase I."
)


def ablation(table: pd.DataFrame, last: pd.DataFrame, metric: str, baseline: str) -> Figure:
    """The final metric of every variant: trainings as dots, their mean with interval as a diamond.

    Args:
        table: Rows of ``analysis.answers.learning.ablation``.
        last: Rows of ``analysis.answers.learning.finals``.
        metric: The column of the final metric, ``final_`` and one of ``METRICS``.
        baseline: The variant whose mean is drawn as a line. Variants of which no training reaches
            ``OFF`` times as much are an arrow at the edge, unless another has some that do.
    """
    values = last.groupby("variant")[metric]
    level = table.loc[table["variant"] == baseline, "mean"].item()
    drawn = pd.concat([last[metric], table["low"], table["high"]])
    split = ((values.min() < OFF * level) & (values.max() >= OFF * level)).any()
    ends = drawn[drawn >= (0 if split else OFF * level)].agg(["min", "max"])
    room = 0.06 * (ends["max"] - ends["min"]) or 0.01
    left, right = max(ends["min"] - room, -0.02), min(ends["max"] + room, 1.02)
    with style.panels(0.9 + 0.42 * len(table), values="x") as (figure, ax):
        ax.axvline(level, color=style.INK, linestyle="--", linewidth=1, zorder=1, gid="baseline")
        for y, (_, row) in enumerate(table.iterrows()):
            name, reached = row["variant"], values.get_group(row["variant"])
            if reached.max() < left:
                ax.plot(left, y, "<", color=style.INK, markersize=7, clip_on=False, gid=name)
            else:
                ax.scatter(reached, np.full(len(reached), y + 0.18 * (row["n"] > 1)), s=18,
                           color=style.MUTED, zorder=3, gid=name)  # fmt: skip
                if row["n"] > 1:
                    look = style.dot((style.palette()[0], "D"))
                    ax.errorbar(row["mean"], y - 0.14, xerr=style.arms(row), **look)
            style.note_at_right(f"{row['mean']:.1%}, n = {row['n']}", y, ax)
        names = ["\n".join(textwrap.wrap(variant, 22)) for variant in table["variant"]]
        ax.set_yticks(range(len(table)), names)
        ax.set(title=METRICS[metric.removeprefix("final_")], ylim=(len(table) - 0.4, -0.6))
        style.in_units(ax.xaxis, "%", 5)
        ax.set_xlim(left, right)
    return figure


def courses(
    rows: pd.DataFrame, line: str, unit: str, titles: Mapping[object, str], heading: str = ""
) -> Figure:
    """Means over the slots of the mission: a curve for each value of a column, with its band.

    Args:
        rows: Rows with ``panel``, ``slot``, ``mean``, ``low`` and ``high``.
        line: The column.
        unit: The unit of the means, as for ``style.in_units``.
        titles: The titles of the panels, by ``panel``.
        heading: The title of the legend.
    """
    values = sorted(rows[line].unique()) if line != "policy" else rows[line].unique()
    looks = style.policy_colours(values) if line == "policy" else style.graded(values)
    height, shape = 1.9 * len(titles) + 1.3, {"sharex": True, "squeeze": False}
    with style.panels(height, len(titles), "y", 4, heading, **shape) as (figure, axes):
        for ax, (panel, title) in zip(axes.flat, titles.items(), strict=True):
            for value, course in rows[rows["panel"] == panel].groupby(line, sort=False):
                colour = looks[value_text(value)][0]
                ax.fill_between(course["slot"], course["low"], course["high"], step="post",
                                color=colour, alpha=0.25, linewidth=0)  # fmt: skip
                ax.plot(course["slot"], course["mean"], color=colour, label=value_text(value))
            ax.set(title=title, ylim=(0, None), xlim=(0, rows["slot"].max()))
            style.in_units(ax.yaxis, unit, 4)
        axes.flat[-1].set_xlabel("mission slot")
    return figure


def _last_phase(curve: pd.DataFrame, ax: Axes) -> None:
    """A vertical line at the beginning of the last phase, if there is a phase before it."""
    start = curve.loc[curve["phase"] != curve["phase"].iloc[-1], "updates"].max()
    if start > 0:  # not if it is nan
        ax.axvline(start, color=style.MUTED, linewidth=1, zorder=1, gid="last phase")
        ax.annotate("phase II", (start, 0), xycoords=("data", "axes fraction"), xytext=(4, 12),
                    textcoords="offset points", fontsize=8.5, **style.OUTLINED)  # fmt: skip


def _steps_axis(curves: pd.DataFrame, ax: Axes) -> None:
    """The training step below the axes, and the UAV-slots simulated until then above them."""
    longest = curves.sort_values("updates").iloc[-1]
    ax.set(xlim=(0, longest["updates"] * 1.02), xlabel="training step [1000 updates]")
    ax.xaxis.set_major_formatter(lambda x, _: f"{x / 1000:g}")
    slots = longest["uav_slots"] / longest["updates"] / 1e6
    top = ax.secondary_xaxis("top", (lambda x: x * slots, lambda x: x / slots))
    top.set_xlabel("UAV-slots [millions]")
