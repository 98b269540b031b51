"""Figures of the verification: observed and known values, and the parts of a mission slot.

Each returns a figure of its own; nothing touches pyplot's state.
"""

from contextlib import AbstractContextManager
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import FancyArrowPatch, FancyBboxPatch
from matplotlib.ticker import FuncFormatter, MaxNLocator, PercentFormatter
from scipy import stats

from analysis.figures import style
from analysis.stats.intervals import LEVEL
from analysis.verification import closed_forms
from analysis.verification.fits import Fit
from dess.scenario import ScenarioSpace

SEEN, MISS, KNOWN = "#0072b2", "#d55e00", "#c9d3da"
SHOWN = 60  # number of blocks in a caterpillar plot


def fit(observed: Fit, title: str, label: str) -> Figure:
    """Observed and expected numbers of observations, and their difference in standard errors.

    If the expected numbers differ by more than a factor of 100, their axis is logarithmic.

    Args:
        observed: The classes with their numbers.
        title: The title of the figure.
        label: The label of the classes.
    """
    table, spots = observed.table, np.arange(len(observed.table))
    n = table["expected"].sum()
    error = np.sqrt(table["expected"] * (1 - table["expected"] / n).clip(lower=1e-12))
    with _with_deviations() as (figure, (ax, below)):
        ax.bar(spots, table["expected"], 0.8, color=KNOWN, label="expected")
        ax.scatter(spots, table["observed"], s=26, color=SEEN, zorder=3, label="observed")
        ax.set_title(title, parse_math=True)
        ax.set(ylabel="observations")
        if table["expected"].max() > 100 * table["expected"].min():
            ax.set_yscale("log")
            ax.set_ylim(bottom=max(table[["expected", "observed"]].min().min(), 1) / 3)
            ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:,.0f}"))
        else:
            ax.yaxis.set_major_locator(MaxNLocator(nbins=5, integer=True))
        _deviations(below, spots, (table["observed"] - table["expected"]) / error)
        step = -(-len(table) // 12)  # as many labels as there is room for
        labels = [name.replace(" or ", "\nor ") for name in table["label"]]
        below.set_xticks(spots[::step], labels[::step])
        below.set_xlabel(label)
        style.legend_below(figure, ax, 2)
    return figure


def rates(table: pd.DataFrame, space: ScenarioSpace) -> Figure:
    """The mean rate against the distance: closed form, simulation and their difference.

    Args:
        table: The result of ``lone_uav.rates``.
        space: The scenario.
    """
    away = np.geomspace(table["distance"].min(), table["distance"].max(), 60)
    known = [closed_forms.rate_moments(space, d).mean for d in away]
    with _with_deviations() as (figure, (ax, below)):
        ax.plot(away, known, color=style.INK, linewidth=1.3, zorder=1, label="by integration")
        ax.scatter(table["distance"], table["mean"], s=30, color=SEEN, zorder=3, label="simulated")
        ax.set(title="Mean rate of a lone UAV", ylabel="data units per\ncommunication slot")
        ax.set(xscale="log", yscale="log")
        ax.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
        below.set_xscale("log")
        error = table["error"].where(table["error"] > 0)
        _deviations(below, table["distance"], (table["mean"] - table["known"]) / error)
        below.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,.0f}"))
        below.set_xlabel("distance [m]")
        style.legend_below(figure, ax, 2)
    return figure


def initial_data(values: np.ndarray, space: ScenarioSpace) -> Figure:
    """The initial data of missions, and the density of the sum over their nodes.

    Args:
        values: (n,) initial data of missions [data units].
        space: The scenario, with a range of initial data.
    """
    law = closed_forms.initial_total(space)
    with style.panels(3.4) as (figure, ax):
        bins = int(np.clip(np.sqrt(len(values)), 8, 50))
        ax.hist(values, bins, density=True, color=KNOWN, label="observed")
        reach = law.mean() + 3 * law.std() * np.array([-1, 1])
        spots = np.linspace(min(values.min(), reach[0]), max(values.max(), reach[1]), 120)
        ax.plot(spots, law.pdf(spots), color=SEEN, linewidth=1.8, label="known density")
        ax.set(title="Initial data of a mission", ylabel="density")
        ax.set_xlabel("data units, all nodes together")
        ax.yaxis.set_major_locator(MaxNLocator(nbins=5))
        style.legend_below(figure, ax, 2)
    return figure


def caterpillar(blocks: pd.DataFrame, title: str) -> Figure:
    """The intervals of the first blocks; those that do not contain the mean of all are marked.

    Args:
        blocks: The result of ``analysis.verification.coverage.blocks``.
        title: The title of the figure.
    """
    shown = blocks.head(SHOWN)
    with style.panels(3.6, values="y") as (figure, ax):
        looks = (
            (True, SEEN, "o", "contains the mean of all"),
            (False, MISS, "X", "does not contain it"),
        )
        for holds, colour, marker, name in looks:
            rows = shown[shown["holds"] == holds]
            ax.vlines(rows.index + 1, rows["low"], rows["high"], color=colour,
                      linewidth=1.2 if holds else 2.2)  # fmt: skip
            ax.scatter(rows.index + 1, rows["mean"], s=10 if holds else 34, color=colour,
                       marker=marker, zorder=3, label=name)  # fmt: skip
        ax.axhline(blocks["reference"].iloc[0], color=style.INK, linewidth=1.1, zorder=1)
        ax.set(title=title, xlabel="block of missions", xlim=(0, len(shown) + 1))
        ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=None))
        style.round_ticks(ax.yaxis, 6)
        ax.xaxis.set_major_locator(MaxNLocator(nbins=7, integer=True))
        style.legend_below(figure, ax, 2)
    return figure


def slot(steps: list[tuple[str, str]], repeated: str, end: str) -> Figure:
    """The order of events in a mission slot: a column of boxes, and an arrow back to the first.

    Args:
        steps: The name and description of every step; the first step happens once, before the first
            slot, the others in every slot.
        repeated: The condition for another slot.
        end: What follows after the last slot.
    """
    height, gap = 1.0, 0.35
    tops = [-(height + gap) * number for number in range(len(steps) + 1)]
    with style.panels(0.8 * len(tops)) as (figure, ax):
        for number, (name, text) in enumerate(steps):
            _box(ax, tops[number], height, name, text, style.ZONE if number == 0 else style.SEA)
        _box(ax, tops[-1], height, end, "", style.ZONE)
        for top in tops[1:]:
            _arrow(ax, (5, top + gap), (5, top))
        first, last = tops[1] - height / 2, tops[-2] - height / 2
        ax.plot([10, 10.7, 10.7], [last, last, first], color=style.INK, linewidth=1.2)
        _arrow(ax, (10.7, first), (10, first))
        ax.text(
            11, (first + last) / 2, repeated, rotation=-90, va="center", ha="left", fontsize=9.5
        )
        ax.set(xlim=(-0.1, 11.9), ylim=(tops[-1] - height - 0.1, 0.1))
        ax.axis("off")
    return figure


def _with_deviations() -> AbstractContextManager[tuple[Figure, Any]]:
    """A panel and a lower one for the deviations, over the same axis."""
    return style.panels(4.6, 2, "y", sharex=True, height_ratios=(2, 1))


def _deviations(ax: Axes, spots: Any, deviations: pd.Series) -> None:
    """Deviations in standard errors, and a band that contains all in 95 % of such figures."""
    band = stats.norm.ppf(1 - (1 - LEVEL) / 2 / max(len(deviations), 1))
    ax.axhspan(-band, band, color=KNOWN, alpha=0.45, linewidth=0)
    ax.axhline(0, color=style.INK, linewidth=0.9)
    out = deviations.abs() > band
    for which, colour, marker in ((~out, SEEN, "o"), (out, MISS, "X")):
        ax.scatter(np.asarray(spots)[which], deviations[which], s=26, color=colour, marker=marker,
                   zorder=3)  # fmt: skip
    reach = max(1.15 * float(deviations.abs().max()), 1.25 * band)
    ax.set(ylabel="standard\nerrors", ylim=(-reach, reach))


def _box(ax: Axes, top: float, height: float, name: str, text: str, colour: str) -> None:
    box = FancyBboxPatch((0, top - height), 10, height, boxstyle="round,pad=0,rounding_size=0.2",
                         facecolor=colour, edgecolor=style.MUTED, linewidth=0.9)  # fmt: skip
    ax.add_patch(box)
    middle = top - height / 2
    ax.text(0.3, middle + 0.2 * bool(text), name, va="center", weight="bold", fontsize=10.5)
    ax.text(0.3, middle - 0.24, text, va="center", fontsize=9.2)


def _arrow(ax: Axes, tail: tuple[float, float], head: tuple[float, float]) -> None:
    ax.add_patch(FancyArrowPatch(tail, head, arrowstyle="-|>", mutation_scale=11, color=style.INK,
                                 linewidth=1.2, shrinkA=0, shrinkB=0))  # fmt: skip
