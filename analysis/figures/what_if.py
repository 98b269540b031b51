"""Figures of a question: the variation beside its baseline.

Each returns a figure of its own; nothing touches pyplot's state.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from analysis.figures.style import (
    INK,
    MUTED,
    arms,
    dot,
    legend_below,
    panels,
    points_axis,
    policy_colours,
    round_ticks,
    style,
)
from analysis.names import METRICS
from analysis.questions.what_if import SIDES

# Share of the missions that the second panel of ``spread`` shows.
MIDDLE = 0.9


def means(table: pd.DataFrame, metric: str, settings: Sequence[Sequence[str]]) -> Figure:
    """A metric of every policy in the baseline and in the variation, with intervals.

    Args:
        table: Rows of ``analysis.questions.what_if.means``.
        metric: One of ``METRICS``.
        settings: Of baseline and variation: what is set, in words.
    """
    rows = table[table["metric"] == metric]
    policies = list(dict.fromkeys(rows["policy"]))
    colours = policy_colours(rows["policy"])
    with style():
        figure, ax = panels(4.1)
        for policy, shift in zip(policies, _apart(len(policies), 0.05), strict=True):
            own = rows[rows["policy"] == policy].sort_values("point")
            ax.errorbar(own["point"] + shift, own["mean"], yerr=arms(own), linewidth=1,
                        label=policy, **dot(policy, colours))  # fmt: skip
        ax.set(title=METRICS[metric], xlim=(-0.45, 1.45), ylim=_ends(rows))
        ticks = ["\n".join((s, *words)) for s, words in zip(SIDES, settings, strict=True)]
        ax.set_xticks((0, 1), ticks)
        round_ticks(ax.yaxis, 6)
        ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=0))
        ax.grid(axis="x", visible=False)
        sns.despine(ax=ax)
        legend_below(figure, ax)
    return figure


def gains(answers: pd.DataFrame) -> Figure:
    """The paired differences of the metrics of every policy, with intervals.

    Args:
        answers: Rows of ``analysis.questions.what_if.answers``.
    """
    rows = answers[answers["metric"].isin([*METRICS])].rename(columns={"difference": "mean"})
    policies = list(dict.fromkeys(rows["policy"]))
    colours = policy_colours(rows["policy"])
    with style():
        height = 1.6 + len(METRICS) * (0.35 + 0.22 * len(policies))
        figure, ax = panels(height)
        for policy, shift in zip(policies, _apart(len(policies), 0.11), strict=True):
            own = rows[rows["policy"] == policy].set_index("metric").loc[[*METRICS]]
            ax.errorbar(own["mean"], np.arange(len(METRICS)) + shift, xerr=arms(own),
                        linestyle="", label=policy, **dot(policy, colours))  # fmt: skip
        ax.axvline(0, color=INK, linewidth=0.9, zorder=1)
        ax.set_yticks(range(len(METRICS)), map(_broken, METRICS.values()))
        ax.set(title="Variation − baseline, mission by mission", xlabel="percentage points",
               ylim=(len(METRICS) - 0.5, -0.5))  # fmt: skip
        _points_axis(ax)
        ax.grid(axis="y", visible=False)
        sns.despine(ax=ax, left=True)
        legend_below(figure, ax)
    return figure


def spread(differences: Mapping[str, pd.Series]) -> Figure:
    """The distribution of the paired differences of every policy: all, and those in the middle.

    Args:
        differences: Per policy, as of ``analysis.questions.what_if.differences``.
    """
    colours = policy_colours(differences)
    tails = (1 - MIDDLE) / 2
    ends = np.array([own.quantile([tails, 1 - tails]) for own in differences.values()])
    low, high = min(ends[:, 0].min(), 0.0), max(ends[:, 1].max(), 0.0)
    room = max(0.04 * (high - low), 0.002)
    with style():
        figure, axes = panels(5.6, 2, sharey=True)
        titles = ("Share of missions with that difference or less", "The same, near the middle")
        for ax, title in zip(axes, titles, strict=True):
            for number, (policy, own) in enumerate(differences.items()):
                values = np.sort(own.to_numpy(float))
                shares = np.arange(1, len(values) + 1) / len(values)
                line = ("-", "--", ":", "-.")[number % 4]
                ax.step([values[0], *values], [0, *shares], where="post", label=policy,
                        color=colours[policy][0], linestyle=line, linewidth=1.7)  # fmt: skip
            ax.axvline(0, color=INK, linewidth=0.9, zorder=1)
            ax.axhline(0.5, color=MUTED, linewidth=0.9, linestyle=":", zorder=1)
            ax.set(title=title, ylim=(-0.02, 1.02))
            ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=0))
            _points_axis(ax)
            sns.despine(ax=ax)
        axes[1].set(xlim=(low - room, high + room), xlabel="percentage points")
        legend_below(figure, axes[0])
    return figure


def _apart(count: int, step: float) -> np.ndarray:
    """Where things of one spot are drawn so that they do not hide each other."""
    return step * (np.arange(count) - (count - 1) / 2)


def _ends(rows: pd.DataFrame) -> tuple[float, float]:
    """An axis for all intervals, no shorter than five points."""
    low, high = rows["low"].min(), rows["high"].max()
    room = max(0.08 * (high - low), (0.05 - (high - low)) / 2, 0.005)
    return low - room, high + room


def _points_axis(ax: Axes) -> None:
    points_axis(ax.xaxis, 7)


def _broken(name: str) -> str:
    """A long name in two lines."""
    first, separator, rest = name.partition(" and ")
    return f"{first}\nand {rest}" if separator else name.replace(" ", "\n", 1)
