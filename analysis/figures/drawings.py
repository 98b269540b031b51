"""What figures are drawn of: estimates along a field or in rows, cells, distributions, fronts.

Every function draws rows of a tidy table on axes. Rows of estimates have ``mean``, ``low`` and
``high``, the ends of its interval; rows along a field also have ``position``, the place on the
axis, and ``value``, the text at this place, see ``placed``.
"""

from collections.abc import Mapping, Sequence
from math import ceil
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis
from pandas.api.types import is_numeric_dtype

from analysis.figures import style
from analysis.figures.style import Look
from analysis.names import value_text

MOST_TICKS = 12


def ordered(column: pd.Series) -> list[Any]:
    """The values of a column: numbers in ascending order, others in order of appearance."""
    return sorted(column.unique()) if is_numeric_dtype(column) else [*column.unique()]


def placed(rows: pd.DataFrame, field: str) -> pd.DataFrame:
    """Rows with the places of a field: numbers where they are, other values evenly spaced."""
    column = rows[field]
    places = column if is_numeric_dtype(column) else pd.factorize(column)[0]
    return rows.assign(position=places, value=column.map(value_text))


def along(
    rows: pd.DataFrame,
    looks: Mapping[str, Look],
    unit: str,
    ax: Axes,
    line: str = "policy",
    **options: Any,
) -> None:
    """Means with intervals along a field: a curve for each value of a column, side by side.

    Args:
        rows: The rows; see ``placed``.
        looks: The curves to draw, by the value of the column as text.
        unit: The unit of the means, as for ``style.in_units``.
        ax: The axes to draw on.
        line: The column.
        options: Further arguments of ``Axes.errorbar``.
    """
    ticks = rows.drop_duplicates("position").sort_values("position")
    span, gap = float(np.ptp(ticks["position"])), ticks["position"].diff().min()
    half_width = min(0.12 * gap, 0.02 * span) if span else 0.02
    curves = rows[line].map(value_text)
    for name, shift in zip(looks, style.shifts(len(looks), half_width), strict=True):
        means = rows[curves == name].sort_values("position")
        ax.errorbar(means["position"] + shift, means["mean"], yerr=style.arms(means), label=name,
                    linewidth=1, **style.dot(looks[name]) | options)  # fmt: skip
    name_ticks(ax.xaxis, [*ticks["value"]], [*ticks["position"]])
    style.in_units(ax.yaxis, unit)


def in_rows(rows: pd.DataFrame, ax: Axes, *columns: str) -> None:
    """A row per policy, the first on top: its mean as a dot with its interval.

    Args:
        rows: The rows, with ``policy``.
        ax: The axes to draw on.
        columns: The mean and the ends of its interval; by default ``mean``, ``low`` and ``high``.
    """
    looks = style.policy_colours(rows["policy"])
    for y, (_, row) in enumerate(rows.iterrows()):
        mean = row[columns[0] if columns else "mean"]
        ax.errorbar(mean, y, xerr=style.arms(row, *columns), **style.dot(looks[row["policy"]]))
    ax.set_yticks(range(len(rows)), rows["policy"])
    ax.set_ylim(len(rows) - 0.4, -0.6)


def cells(rows: pd.DataFrame, names: Sequence[Sequence[Any]], ax: Axes, **colours: Any) -> Any:
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
    for row in rows.itertuples():
        ax.annotate(row.text, (row.column + 0.5, row.row + 0.5), ha="center", va="center",
                    fontsize=9, **style.OUTLINED)  # fmt: skip
    for axis, values in zip((ax.yaxis, ax.xaxis), names, strict=True):
        name_ticks(axis, values, np.arange(len(values)) + 0.5)
    ax.grid(visible=False)
    return ax.pcolormesh(means, edgecolors="white", rasterized=means.size > 400, **colours)


def distributions(values: Mapping[str, pd.Series], ax: Axes) -> None:
    """The share of the missions with at most a value: a curve per policy."""
    colours = style.policy_colours(values)
    for number, (policy, of_policy) in enumerate(values.items()):
        ax.ecdf(of_policy, label=policy, color=colours[policy][0], linewidth=1.7,
                linestyle=style.LINES[number % 4])  # fmt: skip
    ax.set(ylim=(-0.02, 1.02), ylabel="share of the missions")
    style.in_units(ax.yaxis, "%")


def name_ticks(axis: Axis, values: Sequence[Any], places: Sequence[float] | np.ndarray) -> None:
    """Ticks with the names of values: as many as there is room for, turned if they are long."""
    spec = axis.axes.get_subplotspec()
    columns = spec.get_gridspec().ncols if spec else 1
    step = ceil(len(values) * columns / MOST_TICKS)
    names = [value_text(value) for value in values[::step]]
    axis.set_ticks(places[::step], names)
    gap = min(np.diff(places[::step]), default=1.0)
    longest = max(map(len, "\n".join(names).split("\n")))
    if isinstance(axis, XAxis) and longest * np.ptp(places) / gap > 44 / columns:
        axis.set_tick_params(rotation=30)
