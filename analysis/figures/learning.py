"""Figures of trainings: the paper's Fig. 3, the variants' final metrics, and single trainings.

Each returns a figure of its own; nothing touches pyplot's state.
"""

import textwrap
from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, MaxNLocator, PercentFormatter

from analysis import numbers
from analysis.figures import style
from analysis.names import METRICS
from analysis.questions.learning.curves import ALPHA, BAND, FEWEST, REWARD, bands, smoothed

EVALUATED = {f"evaluation_{metric}": name for metric, name in METRICS.items()}
# The metrics that are evaluated while training, and their names.
NAMES = {REWARD: "Cumulative reward", **EVALUATED}

# A variant is off the axis if all of its trainings reach less than this share of the baseline.
OFF = 0.5


def trainings(curves: pd.DataFrame, metric: str, labels: Mapping[str, str]) -> Figure:
    """A metric against the training step, over several trainings: Fig. 3.

    A thick line is the mean of the exponential moving averages over the trainings of a variant, a
    band is its interval, and a thin line is one training. Phases before the last one are dotted,
    and a vertical line marks the beginning of the last phase.

    Args:
        curves: Curves, see ``analysis.questions.learning.curves``.
        metric: One of ``NAMES``.
        labels: The variants to draw, with their names in the legend.
    """
    averages = smoothed(curves[curves["variant"].isin(labels)], metric)
    colours = dict(zip(labels, style.palette(), strict=False))
    with style.panels(3.9, values="y") as (figure, ax):
        for number, (variant, label) in enumerate(labels.items()):
            of_variant = averages[averages["variant"] == variant]
            _trainings(of_variant, colours[variant], ax)
            _mean(of_variant, colours[variant], style.LINES[number], label, metric in EVALUATED, ax)
        low, high = averages["value"].min(), averages["value"].max()
        room = 0.12 * (high - low) or 0.1
        ax.set(title=NAMES[metric], ylim=(low - room, high + room))
        if metric in EVALUATED:
            ax.set_ylim(max(low - room, -0.02), min(high + room, 1.02))
            ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=0))
        _steps_axis(averages["updates"].max(), ax)
        style.legend_below(figure, ax, 2)
    return figure


def trainings_caption(counts: Sequence[int]) -> str:
    """The caption of ``trainings`` for the given numbers of trainings of the variants."""
    level = numbers.level(BAND)
    if min(counts) >= FEWEST:
        n = numbers.words([str(count) for count in counts])
        band = f"Bands: {level} by Student's t over n = {n} trainings."
    else:
        band = (
            f"There is no band, since a band of {level} over n = {min(counts)} would be too wide."
        )
    return (
        f"Thick: mean of the exponential moving averages (weight of the newest evaluation {ALPHA:g}"
        f"); thin: single trainings; dotted: phase I. {band}"
    )


def ablation(table: pd.DataFrame, last: pd.DataFrame, metric: str, baseline: str) -> Figure:
    """The final metric of every variant: trainings as dots, their mean with interval as a diamond.

    Args:
        table: Rows of ``analysis.questions.learning.ablation.ablation``.
        last: Rows of ``analysis.questions.learning.ablation.finals``.
        metric: The column of the final metric, ``final_`` and one of ``METRICS``.
        baseline: The variant whose mean is drawn as a line. Variants of which no training reaches
            ``OFF`` times as much are an arrow at the edge.
    """
    values = last.groupby("variant")[metric]
    level = table.loc[table["variant"] == baseline, "mean"].item()
    left, right = _ends(table, last[metric], OFF * level)
    with style.panels(0.9 + 0.42 * len(table), values="x") as (figure, ax):
        ax.axvline(level, color=style.INK, linestyle="--", linewidth=1, zorder=1, gid="baseline")
        for y, row in table.reset_index(drop=True).iterrows():
            reached = values.get_group(row["variant"])
            if reached.max() < left:
                ax.plot(
                    left, y, "<", color=style.INK, markersize=7, clip_on=False, gid=row["variant"]
                )
            else:
                _seeds(reached, row, y, ax)
            style.note_at_right(f"{row['mean']:.1%}, n = {row['n']}", y, ax)
        names = ["\n".join(textwrap.wrap(variant, 22)) for variant in table["variant"]]
        ax.set_yticks(range(len(table)), names)
        ax.set(title=METRICS[metric.removeprefix("final_")], ylim=(len(table) - 0.4, -0.6))
        ax.set_xlim(left, right)
        style.round_ticks(ax.xaxis, 5)
        ax.xaxis.set_major_formatter(PercentFormatter(1, decimals=0))
    return figure


def training(curve: pd.DataFrame, name: str) -> Figure:
    """The evaluations of one training by training step, with a mark at the selected weights.

    Args:
        curve: The curve of the training, with ``is_best`` where weights were selected.
        name: The name of the policy.
    """
    kept = curve[curve["is_best"]].iloc[-1]
    with style.panels(3.9, values="y") as (figure, ax):
        looks = zip(style.palette()[2:], ("--", ":", "-"), strict=False)
        for metric, (colour, line) in zip(EVALUATED, looks, strict=False):
            for n, (_, phase) in enumerate(curve.groupby("phase", sort=False)):
                ax.plot(phase["updates"], phase[metric], line, color=colour, linewidth=1.5,
                        label="" if n else EVALUATED[metric])  # fmt: skip
        ax.plot(kept["updates"], kept[metric], "*", color=style.INK, markersize=13, zorder=5,
                label=f"selected weights: {kept[metric]:.1%}")  # fmt: skip
        _phases(curve, ax)
        ax.set(title=name, ylim=(-0.02, 1.04))
        ax.yaxis.set_major_formatter(PercentFormatter(1))
        _steps_axis(curve["updates"].max(), ax)
        style.legend_below(figure, ax, 2)
    return figure


def training_caption(seed: int, missions: int) -> str:
    """The caption of ``training`` for a training seed and a number of missions per evaluation."""
    return (
        f"n = 1 training with seed {seed}, which has no interval. Every evaluation has "
        f"{missions:,} missions. The star marks the selected weights, which have the best "
        "moving average."
    )


def _ends(table: pd.DataFrame, values: pd.Series, floor: float) -> tuple[float, float]:
    """The ends of an axis that contains all values and intervals above the floor."""
    drawn = pd.concat([values, table["low"], table["high"]])
    drawn = drawn[drawn >= floor]
    room = 0.06 * (drawn.max() - drawn.min()) or 0.01
    return max(drawn.min() - room, 0.0), min(drawn.max() + room, 1.02)


def _seeds(reached: pd.Series, row: pd.Series, y: float, ax: Axes) -> None:
    """The trainings of a variant, and above them their mean with its interval."""
    colour = style.palette()[0]
    if row["n"] > 1:
        ax.errorbar(row["mean"], y - 0.14, xerr=style.arms(row), marker="D", markersize=5,
                    color=colour, capsize=4, elinewidth=1.8, zorder=2)  # fmt: skip
    spots = np.full(len(reached), y + 0.18 * (row["n"] > 1))
    ax.scatter(reached, spots, color=style.MUTED, s=18, zorder=3, gid=row["variant"])


def _trainings(averages: pd.DataFrame, colour: str, ax: Axes) -> None:
    for _, curve in averages.groupby(["seed", "phase"], sort=False):
        ax.plot(curve["updates"], curve["value"], color=colour, linewidth=0.7, alpha=0.55)


def _mean(
    averages: pd.DataFrame, colour: str, line: str, label: str, share: bool, ax: Axes
) -> None:
    """The mean of the trainings with its band; its last phase in full."""
    rows = bands(averages, share=share)
    last = rows["phase"].iloc[-1]
    for phase, part in rows.groupby("phase", sort=False):
        n = part["n"].iloc[-1]
        named = f"{label}, n = {n}" if phase == last else ""
        look = line if phase == last else ":"
        ax.plot(part["updates"], part["mean"], look, color=colour, linewidth=2.2, label=named)
        if part["low"].notna().all():
            ax.fill_between(part["updates"], part["low"], part["high"], color=colour, alpha=0.16,
                            linewidth=0, gid=f"band-{phase}")  # fmt: skip
    _phases(averages, ax)


def _phases(curve: pd.DataFrame, ax: Axes) -> None:
    """A vertical line at the beginning of the last phase, if there is a phase before it."""
    before = curve.loc[curve["phase"] != curve["phase"].iloc[-1], "updates"]
    if before.empty:
        return
    ax.axvline(before.max(), color=style.MUTED, linewidth=1, zorder=1, gid="last phase")
    ax.annotate(
        "phase II", (before.max(), 0), xycoords=("data", "axes fraction"), xytext=(4, 12),
        textcoords="offset points", fontsize=8.5, color=style.INK,
        path_effects=[withStroke(linewidth=3, foreground="white")],
    )  # fmt: skip


def _steps_axis(last: int, ax: Axes) -> None:
    ax.set(xlim=(0, last * 1.02), xlabel="training step [1000 updates]")
    ax.xaxis.set_major_locator(MaxNLocator(nbins=7))
    ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x / 1000:g}"))
