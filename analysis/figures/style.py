"""The look that all figures share: colours, fonts, axes and marks.

A figure is made inside ``look`` and touches no state of pyplot::

    with style.panels(height=3.5, values="x") as (figure, ax):
        ax.errorbar(row["mean"], 0, xerr=style.arms(row), **style.dot("greedy", colours))
        style.legend_below(figure, ax)
"""

from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any, Literal

import matplotlib as mpl
import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.ticker import FuncFormatter, MaxNLocator, PercentFormatter

from analysis.numbers import minus

INK, MUTED, GRID = "#22303c", "#7a8791", "#dde4e9"
SEA, ZONE, ZONE_EDGE = "#f3f8fb", "#ffe08a", "#d9a400"  # of maps
UAVS = ("#1b1b1b", "#b3123f", "#1f5fbf", "#00734d", "#8a4b00", "#7b2fa0", "#007a8a", "#66707a")
# Policies that look the same in all figures, whatever other policies are drawn.
KNOWN_POLICIES = (
    *("random", "nearest", "greedy", "tour", "ddqn", "ddqn-paper"),
    *("planner-long", "age", "random-unguarded", "planner"),
)
LINES = ("-", "--", ":", "-.")
WIDTH, DPI = 5.2, 150  # inches, dots per inch

_LOOK = {
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.edgecolor": MUTED,
    "axes.labelcolor": INK,
    "text.color": INK,
    "xtick.color": INK,
    "ytick.color": INK,
    "legend.frameon": False,
    "legend.fontsize": 9,
    "grid.color": GRID,
    "text.parse_math": False,  # names are no formulas; a label with an index switches it on
}


@contextmanager
def look() -> Iterator[None]:
    """The look of all figures, for the figures and axes that are made inside."""
    with mpl.rc_context():
        mpl.rcdefaults()  # whatever the user's matplotlibrc says
        sns.set_style("whitegrid")
        mpl.rcParams.update(_LOOK)
        yield


@contextmanager
def panels(
    height: float, rows: int = 1, values: Literal["x", "y", "xy"] = "xy", **options: Any
) -> Iterator[tuple[Figure, Any]]:
    """A new figure with its axes, one below the other, and inside the look of all figures.

    Args:
        height: The height of the figure [inches].
        rows: The number of axes.
        values: The axes that have grid lines.
        options: Further arguments of ``Figure.subplots``.
    """
    with look():
        figure = Figure(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
        axes = figure.subplots(rows, **options)
        for ax in np.ravel(axes):
            grid_of(values, ax)
        yield figure, axes


def grid_of(values: Literal["x", "y", "xy"], ax: Axes) -> None:
    """Draw grid lines only for axes of values, and neither a frame nor a line for axes of names."""
    ax.xaxis.grid("x" in values)
    ax.yaxis.grid("y" in values)
    sns.despine(ax=ax, left=values == "x")


def node_colours(count: int) -> list[str]:
    """A colour per node: nine colour-blind safe hues in three shades; neighbours differ in hue."""
    hues = [c for c in sns.color_palette("colorblind") if np.ptp(c) > 0.05]  # all but the grey
    hues = [min(c, sns.set_hls_values(c, l=0.5), key=sum) for c in hues]  # readable on white
    mixes = (("white", 0.0), ("black", 0.45), ("white", 0.33))
    shades = [(1 - share) * np.array(hues) + share * np.array(to_rgb(c)) for c, share in mixes]
    palette = np.concatenate(shades)
    return [to_hex(palette[k % len(palette)]) for k in range(count)]


def uav_colours(count: int) -> list[str]:
    """A dark colour per UAV, the same for fleets of any size; colours repeat after eight UAVs."""
    return [UAVS[uav % len(UAVS)] for uav in range(count)]


def palette() -> list[str]:
    """Ten colour-blind safe colours."""
    return sns.color_palette("colorblind").as_hex()


def policy_colours(policies: Iterable[str]) -> dict[str, tuple[str, str]]:
    """Colour and marker of every policy; those of ``KNOWN_POLICIES`` always have the same."""
    names = list(dict.fromkeys(policies))
    numbers = {name: KNOWN_POLICIES.index(name) for name in names if name in KNOWN_POLICIES}
    free = [n for n in range(len(names)) if n not in numbers.values()]
    numbers |= dict(zip((name for name in names if name not in numbers), free, strict=False))
    return {name: (palette()[numbers[name] % 10], "os^vPX*"[numbers[name] % 7]) for name in names}


def dot(policy: str, colours: Mapping[str, tuple[str, str]]) -> dict:
    """The style of the means of a policy, as arguments of ``Axes.errorbar``."""
    colour, marker = colours[policy]
    return {"color": colour, "marker": marker, "markersize": 4.5, "capsize": 4, "elinewidth": 1.8}


def arms(
    rows: pd.DataFrame | pd.Series, mean: str = "mean", low: str = "low", high: str = "high"
) -> np.ndarray:
    """Lengths of the arms of error bars, (2, N), from the columns of estimate and interval."""
    return np.array([rows[mean] - rows[low], rows[high] - rows[mean]]).reshape(2, -1)


def policy_means(
    rows: pd.DataFrame,
    x: str,
    looks: Mapping[str, tuple[str, str]],
    half_width: float,
    ax: Axes,
    **options: Any,
) -> None:
    """The means of every policy against a column, with intervals, side by side at each value.

    Args:
        rows: A row per ``policy`` and value of ``x``, with ``mean``, ``low`` and ``high``.
        x: The column.
        looks: The policies to draw, as ``policy_colours`` returns them.
        half_width: Half the distance between the outer policies at a value.
        ax: The axes to draw on.
        options: Further arguments of ``Axes.errorbar``.
    """
    for policy, shift in zip(looks, shifts(len(looks), half_width), strict=True):
        means = rows[rows["policy"] == policy].sort_values(x)
        ax.errorbar(means[x] + shift, means["mean"], yerr=arms(means), linewidth=1, label=policy,
                    **dot(policy, looks), **options)  # fmt: skip


def policy_rows(
    rows: pd.DataFrame, looks: Mapping[str, tuple[str, str]], ax: Axes, *columns: str
) -> None:
    """A row per policy, the first on top: its mean as a dot with its interval.

    Args:
        rows: The rows, with ``policy``.
        looks: The looks of the policies.
        ax: The axes to draw on.
        columns: The mean and the ends of its interval; by default ``mean``, ``low`` and ``high``.
    """
    for y, (_, row) in enumerate(rows.iterrows()):
        mean = row[columns[0] if columns else "mean"]
        ax.errorbar(mean, y, xerr=arms(row, *columns), **dot(row["policy"], looks))
    ax.set_yticks(range(len(rows)), rows["policy"])
    ax.set_ylim(len(rows) - 0.4, -0.6)


def distributions(values: Mapping[str, pd.Series], ax: Axes) -> None:
    """The share of the missions with at most a value: a curve per policy."""
    colours = policy_colours(values)
    for number, (policy, of_policy) in enumerate(values.items()):
        ax.ecdf(of_policy, label=policy, color=colours[policy][0], linewidth=1.7,
                linestyle=LINES[number % 4])  # fmt: skip
    ax.set_ylim(-0.02, 1.02)
    ax.yaxis.set_major_formatter(PercentFormatter(1, decimals=0))


def ends(rows: pd.DataFrame, length: float = 0.0, zero: bool = False) -> tuple[float, float]:
    """The ends of an axis for all intervals, at least ``length`` long, and with 0 if asked."""
    low, high = rows["low"].min(), rows["high"].max()
    if zero:
        low, high = min(low, 0.0), max(high, 0.0)
    room = max(0.06 * (high - low), 0.005)
    return min(low - room, high - length), high + room


def shifts(count: int, half_width: float) -> np.ndarray:
    """The (count,) offsets from ``-half_width`` to ``half_width`` that keep marks apart."""
    return np.linspace(-half_width, half_width, count) if count > 1 else np.zeros(count)


def signed_points(share: float, _: float = 0) -> str:
    """A difference of shares in percentage points, as ``+2.5`` for ``0.025``: a tick label."""
    return minus(f"{100 * share:+.3g}") if round(share, 9) else "0"


def points_axis(axis: Axis, nbins: int) -> None:
    """Ticks in percentage points at round values."""
    round_ticks(axis, nbins)
    axis.set_major_formatter(FuncFormatter(signed_points))


def round_ticks(axis: Axis, nbins: int) -> None:
    """At most ``nbins`` intervals between ticks, at round values."""
    axis.set_major_locator(MaxNLocator(nbins=nbins, steps=[1, 2, 5, 10]))


def note_at_right(text: str, level: float, ax: Axes, size: float = 9) -> Any:
    """A note in the right margin, at a level of the y axis."""
    return ax.annotate(text, (1, level), xycoords=("axes fraction", "data"), xytext=(4, 0),
                       textcoords="offset points", va="center", fontsize=size)  # fmt: skip


def legend_below(figure: Figure, ax: Axes, columns: int = 3, title: str | None = None) -> None:
    """A legend of what is drawn on the axes, below the figure."""
    entries = ax.get_legend_handles_labels()
    legend = figure.legend(*entries, loc="outside lower center", ncols=columns, title=title)
    legend.get_title().set_parse_math(True)
