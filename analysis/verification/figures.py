"""Figures of the verification: observed and known values, and the parts of a mission slot.

Each returns a figure of its own; nothing touches pyplot's state.
"""

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy import stats

from dess.analysis.figures import style
from dess.analysis.stats.intervals import LEVEL
from dess.analysis.verification import closed_forms
from dess.analysis.verification.checks import Fit
from dess.scenario.scenario import ScenarioSpace

SEEN, MISS, KNOWN = "#0072b2", "#d55e00", "#c9d3da"
_ABOVE: dict = {"rows": 2, "values": "y", "sharex": True, "height_ratios": (2, 1), "legend": 2}


def plot_fit(observed: Fit, title: str, label: str) -> Figure:
    """Observed and expected numbers of observations, and their difference in standard errors.

    If the expected numbers differ by more than a factor of 100, their axis is logarithmic.

    Args:
        observed: The classes with their numbers.
        title: The title of the figure.
        label: The label of the classes.
    """
    table = observed.table
    spots = np.arange(len(observed.table))
    expected = table["expected"]
    error = np.sqrt(expected * (1 - expected / expected.sum()).clip(lower=1e-12))
    with style.new_panels(4.6, **_ABOVE) as (figure, (ax, below)):
        ax.bar(spots, expected, 0.8, color=KNOWN, label="expected")
        ax.scatter(spots, table["observed"], s=26, color=SEEN, zorder=3, label="observed")
        ax.set_title(title, parse_math=True)
        ax.set(ylabel="observations")
        if expected.max() > 100 * expected.min():
            ax.set(
                yscale="log", ylim=(max(table[["expected", "observed"]].min().min(), 1) / 3, None)
            )
        ax.yaxis.set_major_formatter("{x:,.0f}")
        _plot_deviations(below, spots, (table["observed"] - expected) / error)
        step = -(-len(table) // 12)  # as many labels as there is room for
        labels = [name.replace(" or ", "\nor ") for name in table["label"]]
        below.set_xticks(spots[::step], labels[::step])
        below.set_xlabel(label)
    return figure


def plot_rates(table: pd.DataFrame, space: ScenarioSpace) -> Figure:
    """The mean rate against the distance: closed form, simulation and their difference.

    Args:
        table: The result of ``measurements.compare_rates``.
        space: The scenario.
    """
    away = np.geomspace(table["distance"].min(), table["distance"].max(), 60)
    expected = [closed_forms.rate_moments(space, d).mean for d in away]
    with style.new_panels(4.6, **_ABOVE) as (figure, (ax, below)):
        ax.plot(away, expected, color=style.INK, linewidth=1.3, zorder=1, label="by integration")
        ax.scatter(table["distance"], table["mean"], s=30, color=SEEN, zorder=3, label="simulated")
        ax.set(title="Mean rate of a lone UAV", ylabel="data units per\ncommunication slot")
        ax.set(xscale="log", yscale="log")
        ax.yaxis.set_major_formatter("{x:g}")
        error = table["error"].where(table["error"] > 0)
        _plot_deviations(below, table["distance"], (table["mean"] - table["known"]) / error)
        below.xaxis.set_major_formatter("{x:,.0f}")
        below.set_xlabel("distance [m]")
    return figure


def plot_slot(steps: list[tuple[str, str]], repeated: str, end: str) -> Figure:
    """The order of events in a mission slot: a column of boxes, and an arrow back to the first.

    Args:
        steps: The name and description of every step; the first step happens once, before the first
            slot, the others in every slot.
        repeated: The condition for another slot.
        end: What follows after the last slot.
    """
    last = len(steps)
    arrow = {"arrowstyle": "-|>", "color": style.INK}
    box = {"boxstyle": "round", "edgecolor": style.MUTED}
    with style.new_panels(0.8 * (last + 1)) as (figure, ax):
        for number, (name, text) in enumerate([*steps, (end, "")]):
            if number in (0, last):
                fill = style.ZONE
            else:
                fill = style.SEA
            ax.text(0, -number, f"{name}\n{text}".strip(), va="center", fontsize=9.5,
                    bbox={**box, "facecolor": fill})  # fmt: skip
            if number:
                ax.annotate("", (0.4, 0.3 - number), (0.4, 0.7 - number), arrowprops=arrow)
        ax.annotate("", (9.6, -1), (9.6, 1 - last), arrowprops=arrow)
        ax.text(9.8, -last / 2, repeated, rotation=-90, va="center", fontsize=9.5)
        ax.set(xlim=(-0.2, 10.4), ylim=(-0.5 - last, 0.5))
        ax.axis("off")
    return figure


def _plot_deviations(ax: Axes, spots: "np.ndarray | pd.Series", deviations: pd.Series) -> None:
    """Deviations in standard errors, and a band that contains all in 95 % of such figures."""
    band = stats.norm.ppf(1 - (1 - LEVEL) / 2 / max(len(deviations), 1))
    ax.axhspan(-band, band, color=KNOWN, alpha=0.45, linewidth=0)
    ax.axhline(0, **style.ZERO)
    out = deviations.abs() > band
    for which, colour, marker in ((~out, SEEN, "o"), (out, MISS, "X")):
        ax.scatter(np.asarray(spots)[which], deviations[which], s=26, color=colour, marker=marker,
                   zorder=3)  # fmt: skip
    reach = max(1.15 * float(deviations.abs().max()), 1.25 * band)
    ax.set(ylabel="standard\nerrors", ylim=(-reach, reach))
