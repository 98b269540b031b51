"""The look that all figures share, and what they are drawn of.

A figure is made inside ``figure_look`` and touches no state of pyplot::

    with style.new_panels(height=3.5, values="x") as (figure, ax):
        arms = style.error_bar_arms(row)
        ax.errorbar(row["mean"], 0, xerr=arms, **style.dot_style(styles["greedy"]))

Functions that draw rows of a tidy table on axes take estimates with ``mean``, ``low`` and
``high``, the ends of the interval; rows along a field also have ``position``, the place on the
axis, and ``value``, the text at this place, see ``place_values``.
"""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from io import BytesIO
from math import ceil
from typing import Any, Literal, TypeAlias

import matplotlib as mpl
import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from matplotlib.colors import to_hex, to_rgb
from matplotlib.container import ErrorbarContainer
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import MaxNLocator, PercentFormatter
from pandas.api.types import is_numeric_dtype

from dess.analysis.names import value_text
from dess.analysis.numbers import format_minus
from dess.policies.shipped import WITH_LOOK

PointStyle: TypeAlias = tuple[str, str]  # a colour and a marker
Values: TypeAlias = Literal["x", "y", "xy"]

INK, MUTED, GRID = "#22303c", "#7a8791", "#dde4e9"
SEA, ZONE, ZONE_EDGE, LAND = "#f3f8fb", "#ffe08a", "#d9a400", "#cdbf9f"  # of maps
UAVS = ("#1b1b1b", "#b3123f", "#1f5fbf", "#00734d", "#8a4b00", "#7b2fa0", "#007a8a", "#66707a")

LINES = ("-", "--", ":", "-.")
MARKERS = "os^vPX*"
TRAIL = 12  # number of last moves that are drawn behind a UAV
WIDTH, DPI = 5.2, 150  # inches, dots per inch
READABLE = 4.5  # the least contrast of a text with its ground (WCAG 2.1, 1.4.3)
OUTLINED: dict = {"path_effects": [withStroke(linewidth=2.5, foreground="white")]}  # of texts
# In all figures, blue means better, orange worse, and grey inconclusive.
BETTER, WORSE = "#0173b2", "#c05000"
NAMED_PART = 0.05  # the smallest part of a bar in which its share is written
PALE = 0.35  # the opacity of what a bar allows for rare failures
# The hours of a day: those in which UAVs can fly, and the others by what closes them.
OPEN_HOURS, CLOSED_HOURS = "#8ec5e8", {"night": "#45535f", "wind": WORSE, "missing": "#bcc7ce"}
LIMITS = ("#d9a400", "#7b2fa0", "#00734d", "#b3123f")  # hours beyond limits of the weather
ZERO: dict = {"color": INK, "linewidth": 1, "zorder": 1}  # the line of no difference

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


class Picture(Figure):
    """A figure that notebooks show as a picture, though nothing has imported pyplot.

    Jupyter shows other figures so only once pyplot is imported, which it has a hook for.
    """

    def place_legend(self, columns: int, heading: str | None = None) -> None:
        """Put a legend of all that has a label below the axes, no wider than the figure.

        Args:
            columns: The largest number of its columns; there are fewer where they do not fit.
            heading: The title of the legend.
        """
        entries = [zip(*ax.get_legend_handles_labels(), strict=True) for ax in self.axes]
        handles = {label: handle for pairs in entries for handle, label in pairs}
        if not handles:
            return
        self._legend_options = (columns, heading)
        place: dict[str, Any] = {"loc": "outside lower center", "title": heading}
        for count in range(min(columns, len(handles)), 0, -1):
            below = self.legend(handles.values(), handles, ncols=count, **place)
            below.get_title().set_parse_math(True)
            if count == 1 or below.get_window_extent().width <= self.bbox.width:
                return
            below.remove()

    def resize(self, width: float, height: float) -> None:
        """Give the figure another size [inches], and its legend the columns that fit there."""
        self.set_size_inches(width, height)
        if not self.legends:
            return
        for legend in [*self.legends]:
            legend.remove()
        with figure_look():
            self.place_legend(*self._legend_options)

    def _repr_png_(self) -> bytes:
        """The picture, as IPython asks for it."""
        buffer = BytesIO()
        self.savefig(buffer, format="png", bbox_inches="tight")
        return buffer.getvalue()


@contextmanager
def figure_look() -> Iterator[None]:
    """The look of all figures, for the figures and axes that are made inside."""
    with mpl.rc_context():
        mpl.rcdefaults()  # whatever the user's matplotlibrc says
        sns.set_style("whitegrid")
        mpl.rcParams.update(_LOOK)
        yield


@contextmanager
def new_panels(
    height: float,
    rows: int = 1,
    values: Values = "xy",
    legend: int = 3,
    heading: str | None = None,
    **options: Any,
) -> Iterator[tuple[Figure, Any]]:
    """A new figure with its axes, one below the other, and inside the look of all figures.

    At the end, a legend of all that has a label is put below the axes.

    Args:
        height: The height of the figure [inches].
        rows: The number of axes.
        values: The axes that have grid lines.
        legend: The largest number of columns of the legend.
        heading: The title of the legend.
        options: Further arguments of ``Figure.subplots``.
    """
    with figure_look():
        figure = Picture(figsize=(WIDTH, height), dpi=DPI, layout="constrained")
        axes = figure.subplots(rows, **options)
        for ax in np.ravel(axes):
            grid_of(values, ax)
        yield figure, axes
        figure.place_legend(legend, heading)


def grid_of(values: Values, ax: Axes) -> None:
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


def readable_palette() -> list[str]:
    """Ten colour-blind safe colours, as dark as readers need on white paper."""
    return [to_hex(_darken_until_readable(colour)) for colour in sns.color_palette("colorblind")]


def _darken_until_readable(colour: tuple[float, ...]) -> tuple[float, ...]:
    """The colour, darkened until its contrast with white is 3 to 1 (WCAG 2.1, 1.4.11)."""
    darker = tuple(0.97 * c for c in colour)
    if _contrast_with_white(colour) >= 3:
        return colour
    return _darken_until_readable(darker)


def _contrast_with_white(colour: Sequence[float] | np.ndarray) -> float:
    """The contrast of a colour with white, from 1 to 21 (WCAG 2.1, 1.4.3)."""
    linear = [c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in colour[:3]]
    luminance = float(np.dot([0.2126, 0.7152, 0.0722], linear))
    return 1.05 / (luminance + 0.05)


def policy_colours(
    policies: Iterable[str], drawn: Iterable[str] | None = None
) -> dict[str, PointStyle]:
    """Colour and marker of every policy; those of ``WITH_LOOK`` always have the same.

    Args:
        policies: All policies of a study, so that each looks the same in all of its figures.
        drawn: Those of them that a figure shows; by default all.
    """
    names = list(dict.fromkeys(policies))
    numbers = {name: WITH_LOOK.index(name) for name in names if name in WITH_LOOK}
    free = [n for n in range(len(names)) if n not in numbers.values()]
    numbers |= dict(zip((name for name in names if name not in numbers), free, strict=False))
    shown = names
    if drawn is not None:
        shown = list(dict.fromkeys(drawn))
    return {
        name: (readable_palette()[numbers[name] % 10], MARKERS[numbers[name] % 7]) for name in shown
    }


def graded_colours(values: Sequence[Any]) -> dict[str, PointStyle]:
    """Colours from light to dark, and markers, for values in their order."""
    shades = [
        to_hex(_darken_until_readable(colour)) for colour in sns.color_palette("flare", len(values))
    ]
    return {value_text(v): (shades[k], MARKERS[k % 7]) for k, v in enumerate(values)}


def dot_style(look: PointStyle) -> dict:
    """The style of means with that colour and marker, as arguments of ``Axes.errorbar``."""
    colour, marker = look
    return {"color": colour, "marker": marker, "markersize": 4.5, "capsize": 4, "elinewidth": 1.8}


def band(colour: str) -> dict:
    """The keywords of a band, of confidence or of quantiles, around a line of this colour."""
    return {"color": colour, "alpha": 0.25, "linewidth": 0}


def error_bar_arms(
    rows: pd.DataFrame | pd.Series, mean: str = "mean", low: str = "low", high: str = "high"
) -> np.ndarray:
    """Lengths of the arms of error bars, (2, N), from the columns of estimate and interval."""
    return np.array([rows[mean] - rows[low], rows[high] - rows[mean]]).reshape(2, -1)


def plot_with_bars(rows: pd.DataFrame, places: pd.Series, ax: Axes, **look: Any) -> None:
    """Means with their intervals as bars, in two tones where rows have ``student``.

    The dark part of a bar is Student's interval; its pale ends are what is allowed for failures
    that are too rare to be in the missions.

    Args:
        rows: The rows, with ``mean``, ``low`` and ``high``, and with ``student`` or without it.
        places: The places of the means on the horizontal axis.
        ax: The axes to draw on.
        look: Further arguments of ``Axes.errorbar``.
    """
    arms = error_bar_arms(rows)
    if "student" in rows:
        pale = {"linestyle": "", "ecolor": look["color"], "alpha": PALE, "capsize": look["capsize"]}
        ax.errorbar(places, rows["mean"], yerr=arms, elinewidth=look["elinewidth"], **pale)
        arms = np.fmin(arms, rows["student"].to_numpy(float))
    ax.errorbar(places, rows["mean"], yerr=arms, **look)


def side_by_side_shifts(count: int, half_width: float) -> np.ndarray:
    """The (count,) offsets from ``-half_width`` to ``half_width`` that keep marks apart."""
    if count > 1:
        return np.linspace(-half_width, half_width, count)
    return np.zeros(count)


def axis_ends(rows: pd.DataFrame, length: float = 0.0, zero: bool = False) -> tuple[float, float]:
    """The ends of an axis for all intervals, at least ``length`` long, and with 0 if asked."""
    low = rows["low"].min()
    high = rows["high"].max()
    if zero:
        low = min(low, 0.0)
        high = max(high, 0.0)
    room = max(0.06 * (high - low), 0.005)
    return min(low - room, high - length), high + room


def signed_points(share: float, _: float = 0) -> str:
    """A difference of shares in percentage points, as ``+2.5`` for ``0.025``: a tick label."""
    if round(share, 9):
        return format_minus(f"{100 * share:+.3g}")
    return "0"


def set_axis_unit(axis: Axis, unit: str, nbins: int = 6) -> None:
    """Ticks at round values: in percent ("%"), in signed percentage points, or as numbers ("")."""
    axis.set_major_locator(MaxNLocator(nbins=nbins, steps=[1, 2, 5, 10]))
    numbers = {"points": signed_points, "": lambda value, _: f"{value:,.6g}"}
    axis.set_major_formatter(PercentFormatter(1) if unit == "%" else numbers[unit])


def set_axis_size(axis: Axis, size: float, nbins: int = 8) -> None:
    """Ticks at round values of a unit of which the axis, with its limits, has ``size`` in 1."""
    low, high = sorted(axis.get_view_interval())
    values = MaxNLocator(nbins, steps=[1, 2, 5, 10]).tick_values(low * size, high * size)
    shown = [value for value in values if low * size <= value <= high * size]
    axis.set_ticks([value / size for value in shown], [f"{value:,.6g}" for value in shown])


def note_at_right(text: str, level: float, ax: Axes, size: float = 9) -> Any:
    """A note in the right margin, at a level of the y axis."""
    return ax.annotate(text, (1, level), xycoords=("axes fraction", "data"), xytext=(4, 0),
                       textcoords="offset points", va="center", fontsize=size)  # fmt: skip


MOST_NAMED_LINES = 4  # lines that have their names beside them; of more, a legend is below
_HEIGHT_OF_NAME = 0.06  # of the axes


def name_lines(places: Mapping[str, tuple[float, float]], ax: Axes) -> bool:
    """Write the name of each line beside it, in its colour, where it would be in a legend.

    Names that would cover each other are moved apart. Of more than ``MOST_NAMED_LINES`` lines, the
    names stay in the legend.

    Args:
        places: By the label of a line, its place [data], to the right of which it is named.
        ax: The axes, with the limits that they keep.

    Returns:
        Whether they are named.
    """
    lines = {name: line for line, name in zip(*ax.get_legend_handles_labels(), strict=True)}
    if len(places) > MOST_NAMED_LINES or not {*places} <= {*lines}:
        return False
    to_axes = ax.transData + ax.transAxes.inverted()
    ends = {name: to_axes.transform(place) for name, place in places.items()}
    lowest = -np.inf
    for name in sorted(ends, key=lambda name: ends[name][1]):
        x, y = ends[name]
        lowest = max(y, lowest + _HEIGHT_OF_NAME)
        line = lines[name]
        artist: Any = line
        if isinstance(line, ErrorbarContainer):
            artist = line.lines[0]
        ax.annotate(name, (x, lowest), xycoords="axes fraction", xytext=(7, 0), fontsize=9,
                    textcoords="offset points", va="center", color=artist.get_color(),
                    gid=f"name-{name}", zorder=10, **OUTLINED)  # fmt: skip
        line.set_label(f"_{name}")
    return True


MOST_TICKS = 12


def ordered_values(column: pd.Series) -> list[Any]:
    """The values of a column: numbers in ascending order, others in order of appearance."""
    if is_numeric_dtype(column):
        return sorted(column.unique())
    return [*column.unique()]


def place_values(rows: pd.DataFrame, field: str) -> pd.DataFrame:
    """Rows with the places of a field: numbers where they are, other values evenly spaced."""
    column = rows[field]
    if is_numeric_dtype(column):
        places = column
    else:
        places = pd.factorize(column)[0]
    return rows.assign(position=places, value=column.map(value_text))


def plot_along(
    rows: pd.DataFrame,
    styles: Mapping[str, PointStyle],
    unit: str,
    ax: Axes,
    line: str = "policy",
    **options: Any,
) -> None:
    """Means with intervals along a field: a curve for each value of a column, side by side.

    Args:
        rows: The rows; see ``place_values``.
        styles: The curves to draw, by the value of the column as text.
        unit: The unit of the means: ``%``, ``points``, or empty for plain numbers.
        ax: The axes to draw on.
        line: The column.
        options: Further arguments of ``Axes.errorbar``.
    """
    ticks = rows.drop_duplicates("position").sort_values("position")
    span = float(np.ptp(ticks["position"]))
    gap = ticks["position"].diff().min()
    if span:
        half_width = min(0.12 * gap, 0.02 * span)
    else:
        half_width = 0.02
    curves = rows[line].map(value_text)
    for name, shift in zip(styles, side_by_side_shifts(len(styles), half_width), strict=True):
        means = rows[curves == name].sort_values("position")
        look = {"label": name, "linewidth": 1, **dot_style(styles[name]), **options}
        plot_with_bars(means, means["position"] + shift, ax, **look)
    name_ticks(ax.xaxis, [*ticks["value"]], [*ticks["position"]])
    set_axis_unit(ax.yaxis, unit)


def plot_in_rows(rows: pd.DataFrame, ax: Axes, *columns: str) -> None:
    """A row per policy, the first on top: its mean as a dot with its interval.

    Args:
        rows: The rows, with ``policy``.
        ax: The axes to draw on.
        columns: The mean and the ends of its interval; by default ``mean``, ``low`` and ``high``.
    """
    styles = policy_colours(rows["policy"])
    for y, (_, row) in enumerate(rows.iterrows()):
        mean = row[columns[0] if columns else "mean"]
        ax.errorbar(mean, y, xerr=error_bar_arms(row, *columns), **dot_style(styles[row["policy"]]))
    ax.set_yticks(range(len(rows)), rows["policy"])
    ax.set_ylim(len(rows) - 0.4, -0.6)


def plot_cells(rows: pd.DataFrame, names: Sequence[Sequence[Any]], ax: Axes, **colours: Any) -> Any:
    """Cells in the colours of means, with texts.

    Args:
        rows: A row per cell: ``row``, ``column``, ``mean``, and ``text``.
        names: The values of the rows, and those of the columns.
        ax: The axes to draw on.
        colours: Further arguments of ``Axes.pcolormesh``.

    Returns:
        The cells, for a colour bar.
    """
    means = np.full([len(values) for values in names], np.nan)
    means[rows["row"], rows["column"]] = rows["mean"]
    cells = ax.pcolormesh(means, edgecolors="white", rasterized=means.size > 400, **colours)
    for row in rows.itertuples():
        look = OUTLINED
        if _contrast_with_white(cells.to_rgba(row.mean)) >= READABLE:
            look = {"color": "white"}
        ax.annotate(row.text, (row.column + 0.5, row.row + 0.5), ha="center", va="center",
                    fontsize=9, **look)  # fmt: skip
    for axis, values in zip((ax.yaxis, ax.xaxis), names, strict=True):
        name_ticks(axis, values, np.arange(len(values)) + 0.5)
    ax.grid(visible=False)
    return cells


def plot_distributions(values: Mapping[str, pd.Series], ax: Axes) -> None:
    """The share of the missions with at most a value: a curve per policy."""
    colours = policy_colours(values)
    for number, (policy, of_policy) in enumerate(values.items()):
        ax.ecdf(of_policy, label=policy, color=colours[policy][0], linewidth=1.7,
                linestyle=LINES[number % 4])  # fmt: skip
    ax.set(ylim=(-0.02, 1.02), ylabel="share of the missions")
    set_axis_unit(ax.yaxis, "%")


def name_ticks(axis: Axis, values: Sequence[Any], places: Sequence[float] | np.ndarray) -> None:
    """Ticks with the names of values: as many as there is room for, turned if they are long."""
    spec = axis.axes.get_subplotspec()
    columns = 1
    if spec:
        columns = spec.get_gridspec().ncols
    step = ceil(len(values) * columns / MOST_TICKS)
    names = [value_text(value) for value in values[::step]]
    axis.set_ticks(places[::step], names)
    gap = min(np.diff(places[::step]), default=1.0)
    longest = max(map(len, "\n".join(names).split("\n")))
    if isinstance(axis, XAxis) and longest * np.ptp(places) / gap > 44 / columns:
        axis.set_tick_params(rotation=30)


def plot_front(paid: pd.Series, reached: pd.Series, label: str, ax: Axes) -> None:
    """A front as steps: what is reached by paying so much."""
    ax.step(paid, reached, where="post", color=INK, linewidth=1.1, zorder=1, label=label)


def plot_parts(shares: pd.DataFrame, label: str) -> Figure:
    """Parts of a whole, side by side in one bar for each row, from the first row at the top.

    Args:
        shares: (rows, parts) the shares; the sum of a row is 1.
        label: What the whole is.
    """
    with new_panels(1.4 + 0.42 * len(shares), values="x") as (figure, ax):
        left = pd.Series(0.0, shares.index)
        for part, colour in zip(shares, readable_palette(), strict=False):
            bars = ax.barh(shares.index, shares[part], left=left, color=colour, label=part)
            texts = [f"{share:.0%}" if share >= NAMED_PART else "" for share in shares[part]]
            ax.bar_label(bars, texts, label_type="center", color="white", fontsize=8)
            left += shares[part]
        ax.invert_yaxis()
        ax.set(xlim=(0, 1), xlabel=label)
        set_axis_unit(ax.xaxis, "%")
    return figure
