"""Figures of a what-if question: the variation and its baseline."""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from analysis.figures import style
from analysis.figures.settings import of_metric
from analysis.names import METRICS, metric_label
from analysis.questions.what_if.question import SIDES

# Share of the missions that the second panel of ``spread`` shows.
MIDDLE = 0.9


def means(table: pd.DataFrame, metric: str, settings: Sequence[Sequence[str]]) -> Figure:
    """A metric of every policy in the baseline and in the variation, with intervals.

    Args:
        table: Rows of ``questions.what_if_answer.means``.
        metric: One of their metrics.
        settings: What the baseline and the variation set, in words.
    """
    rows = table[table["metric"] == metric].dropna(subset="mean")
    colours = style.policy_colours(rows["policy"])
    with style.panels(4.1, values="y") as (figure, ax):
        style.policy_means(rows, "point", colours, 0.025 * (len(colours) - 1), ax)
        ax.set(title=metric_label(metric), xlim=(-0.45, 1.45))
        ticks = ["\n".join((s, *words)) for s, words in zip(SIDES, settings, strict=True)]
        ax.set_xticks((0, 1), ticks)
        of_metric(ax.yaxis, metric)
        if metric in METRICS:
            ax.set_ylim(style.ends(rows, 0.05))
            ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=0))
        style.legend_below(figure, ax)
    return figure


def gains(answers: pd.DataFrame) -> Figure:
    """The paired differences of the metrics of every policy, with intervals.

    Args:
        answers: Rows of ``questions.what_if_answer.answers``.
    """
    rows = answers[answers["metric"].isin([*METRICS])].rename(columns={"difference": "mean"})
    colours = style.policy_colours(rows["policy"])
    with style.panels(1.6 + len(METRICS) * (0.35 + 0.22 * len(colours)), values="x") as (
        figure,
        ax,
    ):
        offsets = style.shifts(len(colours), 0.055 * (len(colours) - 1))
        for policy, shift in zip(colours, offsets, strict=True):
            changes = rows[rows["policy"] == policy].set_index("metric").loc[[*METRICS]]
            ax.errorbar(changes["mean"], np.arange(len(METRICS)) + shift, xerr=style.arms(changes),
                        linestyle="", label=policy, **style.dot(policy, colours))  # fmt: skip
        ax.axvline(0, color=style.INK, linewidth=0.9, zorder=1)
        ax.set_yticks(range(len(METRICS)), map(_broken, METRICS.values()))
        ax.set(title="Variation − baseline (paired differences)", xlabel="percentage points",
               ylim=(len(METRICS) - 0.5, -0.5))  # fmt: skip
        style.points_axis(ax.xaxis, 7)
        style.legend_below(figure, ax)
    return figure


def spread(differences: Mapping[str, pd.Series]) -> Figure:
    """The distribution of the paired differences of every policy: all, and the central part.

    Args:
        differences: For each policy the result of ``questions.what_if.answer.differences``.
    """
    tails = (1 - MIDDLE) / 2
    ends = np.array([gaps.quantile([tails, 1 - tails]) for gaps in differences.values()])
    low, high = min(ends[:, 0].min(), 0.0), max(ends[:, 1].max(), 0.0)
    room = max(0.04 * (high - low), 0.002)
    with style.panels(5.6, 2, sharey=True) as (figure, axes):
        titles = ("Share of missions with that difference or less", "The central part of it")
        for ax, title in zip(axes, titles, strict=True):
            style.distributions(differences, ax)
            ax.axvline(0, color=style.INK, linewidth=0.9, zorder=1)
            ax.axhline(0.5, color=style.MUTED, linewidth=0.9, linestyle=":", zorder=1)
            ax.set_title(title)
            style.points_axis(ax.xaxis, 7)
        axes[1].set(xlim=(low - room, high + room), xlabel="percentage points")
        style.legend_below(figure, axes[0])
    return figure


def _broken(name: str) -> str:
    """A long name in two lines."""
    first, separator, rest = name.partition(" and ")
    return f"{first}\nand {rest}" if separator else name.replace(" ", "\n", 1)
