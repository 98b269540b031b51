"""Figures of the settings of a study: curves, heat maps, main effects, single design points.

Each returns a figure of its own; nothing touches pyplot's state. Shares are in percent.
"""

from collections.abc import Callable, Sequence
from math import ceil
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.axis import Axis, XAxis, YAxis
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from matplotlib.ticker import FuncFormatter, PercentFormatter
from pandas.api.types import is_numeric_dtype

from analysis.figures import style
from analysis.names import (
    LESS_IS_BETTER,
    METRICS,
    PRODUCT,
    metric_label,
    parameter,
    value_text,
)
from analysis.questions import settings
from analysis.results.tables import Results

MOST_PANELS = 12  # largest number of values of a third field with their own panels
MOST_TICKS = 12
MARK = "#d55e00"  # colour that marks the best cell and cells that are not significantly worse
COLUMNS = 3  # of panels


def plot(
    results: Results,
    x: str,
    hue: str | None = None,
    metric: str = PRODUCT,
    policy: str | None = None,
) -> Figure:
    """A metric against a field, with 95 % intervals: a curve per policy, or per value of ``hue``.

    Args:
        results: The study.
        x: The field; means are taken over all fields except ``x`` and ``hue``.
        hue: A field with a curve for each value; then there is a panel for each policy.
        metric: The metric.
        policy: The policy; by default all policies.

    Raises:
        InputError: If there is no such field, metric or policy.
    """
    rows = settings.averaged(results, [x, hue] if hue else [x], metric, policy)
    values = settings.varied(results)
    if hue:
        return lines(rows, x, values[x], metric, graded(values[hue]), hue, "policy")
    colours = style.policy_colours(results.policies)
    looks = {name: colours[name] for name in rows["policy"].unique()}
    return lines(rows, x, values[x], metric, looks, "policy")


def lines(
    rows: pd.DataFrame,
    x: str,
    values: Sequence[Any],
    metric: str,
    looks: dict[str, tuple[str, str]],
    line: str,
    panel: str | None = None,
) -> Figure:
    """A metric against a field: a curve for each value of a column, with 95 % intervals.

    Args:
        rows: The means of the metric, with ``mean``, ``low`` and ``high``.
        x: The field on the horizontal axis.
        values: Its values.
        metric: The metric.
        looks: The looks of the curves, by name.
        line: The column with a curve for each value: a field, or ``policy``.
        panel: A column with a panel for each value; by default there is one panel.
    """
    panels = [*rows.groupby(panel, sort=False)] if panel else [("", rows)]
    height, count = 2.9 * len(panels) + 0.9, len(panels)
    with style.panels(height, count, "y", sharex=True, sharey=True, squeeze=False) as (
        figure,
        axes,
    ):
        for ax, (value, part) in zip(axes.flat, panels, strict=True):
            curves(part.assign(policy=part[line].map(value_text)), x, looks, values, ax)
            name = "" if panel in (None, "policy") else parameter(str(panel)).name
            ax.set_title(f"{name} {value_text(value)}".strip(), fontsize=10, fontweight="normal")
            of_metric(ax.yaxis, metric)
        figure.suptitle(metric_label(metric), fontsize=11, fontweight="bold")
        axes.flat[-1].set_xlabel(parameter(x).label, parse_math=True)
        title = None if line == "policy" else parameter(line).label
        style.legend_below(figure, axes.flat[0], 4, title)
    return figure


def heat_map(
    results: Results,
    x: str,
    y: str,
    metric: str = PRODUCT,
    policy: str | None = None,
    facet: str | None = None,
) -> Figure:
    """A metric of a policy over two fields: the best cell, and those that may be as good.

    A star marks the best cell; framed cells are not significantly worse (``averaged``).

    Args:
        results: The study.
        x: The field of the columns; means are taken over fields that are not named.
        y: The field of the rows.
        metric: The metric.
        policy: The policy; by default that of the best setting.
        facet: A third field, with a panel for each of the values that ``shown`` selects.

    Raises:
        InputError: If there is no such field, metric or policy.
    """
    policy = policy or str(settings.ranked(results, metric)["policy"].iloc[0])
    fields = [y, x, facet] if facet else [y, x]
    rows = settings.averaged(results, fields, metric, policy)
    values = settings.varied(results)
    best = rows["mean"].idxmin() if metric in LESS_IS_BETTER else rows["mean"].idxmax()
    rows = rows.assign(best=rows.index == best, row=_places(rows[y], values[y]),
                       column=_places(rows[x], values[x]))  # fmt: skip
    facets = shown(values[facet]) if facet else [None]
    columns = min(COLUMNS, len(facets))
    lines = ceil(len(facets) / columns)
    height = min(1.6 + 0.5 * len(values[y]), 5.5) if not facet else 0.9 + 1.75 * lines
    with style.panels(
        height, lines, "xy", ncols=columns, sharex=True, sharey=True, squeeze=False
    ) as (figure, axes):
        for ax, value in zip(axes.flat, facets, strict=False):
            part = rows if value is None else rows[rows[facet] == value]
            ends = rows["mean"].min(), rows["mean"].max()
            mesh = _cells(part, (len(values[y]), len(values[x])), ends, metric, columns, ax)
            if value is not None:
                title = f"{parameter(str(facet)).tick} {value_text(value)}"
                ax.set_title(title, fontsize=9, parse_math=True)
            _name_ticks(ax.xaxis, values[x], MOST_TICKS if columns == 1 else 4, 0.5)
            _name_ticks(ax.yaxis, values[y], MOST_TICKS if columns == 1 else 5, 0.5)
        for ax in axes.flat[len(facets) :]:
            ax.set_visible(False)
        bar = figure.colorbar(mesh, ax=axes, shrink=0.9, aspect=30)
        of_metric(bar.ax.yaxis, metric)
        figure.supxlabel(parameter(x).label, fontsize=10, parse_math=True)
        figure.supylabel(parameter(y).tick, fontsize=10, parse_math=True)
        figure.suptitle(f"{metric_label(metric)}: {policy}", fontsize=11, fontweight="bold", x=0.02,
                        ha="left")  # fmt: skip
    return figure


def main_effects(results: Results, metric: str = PRODUCT, policy: str | None = None) -> Figure:
    """The partial dependence of a metric on every varied field, with intervals, in several panels.

    Args:
        results: The study; its design varies one field or more.
        metric: The metric.
        policy: The policy; by default all policies.
    """
    effects = settings.main_effects(results, metric, policy)
    fields = settings.by_influence(effects)
    colours = style.policy_colours(results.policies)
    looks = {name: colours[name] for name in effects["policy"].unique()}

    def draw(field: str, ax: Axes) -> None:
        part = effects[effects["field"] == field]
        ticks = part.drop_duplicates("position").sort_values("position")["value"].tolist()
        style.policy_means(part, "position", looks, 0.02 * len(ticks), ax)
        _name_ticks(ax.xaxis, ticks, 6)
        ax.set_xlim(-0.5, len(ticks) - 0.5)

    return _panel_per_field(fields, metric, draw)


def scatter(results: Results, metric: str = PRODUCT, policy: str | None = None) -> Figure:
    """The mean of a metric at every design point, against every varied field in several panels.

    Args:
        results: The study; its design varies one field or more.
        metric: The metric.
        policy: The policy; by default all policies.
    """
    table = settings.ranked(results, metric, policy)
    values = settings.varied(results)
    colours = style.policy_colours(results.policies)

    def draw(field: str, ax: Axes) -> None:
        places, names = _axis(values[field])
        for name, part in table.groupby("policy", sort=False):
            spots = part[field].map(dict(zip(values[field], places, strict=True)))
            ax.scatter(spots, part[metric], s=18, alpha=0.7, color=colours[str(name)][0],
                       marker=colours[str(name)][1], linewidths=0, label=name,
                       rasterized=len(table) > 2000)  # fmt: skip
        if names:
            _name_ticks(ax.xaxis, names, 6)
        elif len(places) <= 6:
            ax.set_xticks(places)

    return _panel_per_field([*values], metric, draw)


def distribution(missions: pd.DataFrame, metric: str = PRODUCT) -> Figure:
    """The share of missions with at most a value of a metric: a curve per policy.

    Args:
        missions: A row per mission, with ``policy`` and the metric.
        metric: The metric.
    """
    values = {str(name): part[metric] for name, part in missions.groupby("policy", sort=False)}
    with style.panels(3.9) as (figure, ax):
        style.distributions(values, ax)
        ax.set(xlabel=metric_label(metric), ylabel="share of the missions")
        of_metric(ax.xaxis, metric)
        style.legend_below(figure, ax, 4)
    return figure


def shown(values: Sequence[Any]) -> list[Any]:
    """The values of a third field with a panel in ``heat_map``; evenly spaced if there are many."""
    places = np.linspace(0, len(values) - 1, min(MOST_PANELS, len(values)))
    return [values[round(place)] for place in places]


def curves(
    rows: pd.DataFrame, x: str, looks: dict[str, tuple[str, str]], values: Sequence[Any], ax: Axes
) -> None:
    """Means with intervals along a field; values that are not numbers are evenly spaced."""
    places, names = _axis(values)
    spots = rows[x].map(dict(zip(values, places, strict=True))).astype(float)
    gap = float(np.diff(places).min()) if len(places) > 1 else 1.0
    half_width = min(0.12 * gap, 0.02 * float(np.ptp(places)))
    style.policy_means(rows.assign(spot=spots), "spot", looks, half_width, ax)
    if names or len(values) <= MOST_TICKS:
        names = names or [*map(value_text, values)]
        ax.set_xticks(places, names)
        if max(map(len, names)) * np.ptp(places) / gap > _room(ax):
            ax.xaxis.set_tick_params(rotation=30)


def _cells(
    rows: pd.DataFrame,
    shape: tuple[int, int],
    ends: tuple[float, float],
    metric: str,
    columns: int,
    ax: Axes,
) -> Any:
    """The coloured cells of a panel: a star on the best, a frame on those that may be as good."""
    means = np.full(shape, np.nan)
    means[rows["row"], rows["column"]] = rows["mean"]
    shades = "YlGnBu_r" if metric in LESS_IS_BETTER else "YlGnBu"
    mesh = ax.pcolormesh(means, cmap=shades, vmin=ends[0], vmax=ends[1], edgecolors="white",
                         linewidth=0.6, rasterized=means.size > 400)  # fmt: skip
    roomy = shape[1] * columns <= 9 and shape[0] * columns <= 12
    dark = 0.55 * (ends[1] - ends[0])
    for row in rows.itertuples():
        if row.tied:
            corner, width = (row.column + 0.06, row.row + 0.06), 1.6 if columns == 1 else 1
            ax.add_patch(Rectangle(corner, 0.88, 0.88, fill=False, edgecolor=MARK, linewidth=width))
        if row.best:
            ax.plot(row.column + 0.5, row.row + (0.76 if roomy else 0.5), marker="*", color=MARK,
                    markersize=11 if columns == 1 else 8, markeredgecolor="white",
                    markeredgewidth=0.7, linestyle="")  # fmt: skip
        if roomy and not np.isnan(row.mean):
            is_dark = (row.mean - ends[0] > dark) != (metric in LESS_IS_BETTER)
            ax.text(row.column + 0.5, row.row + 0.42, _short(row.mean, metric), ha="center",
                    va="center", fontsize=8.5, color="white" if is_dark else style.INK)  # fmt: skip
    ax.grid(visible=False)
    return mesh


def _panel_per_field(
    fields: Sequence[str], metric: str, draw: Callable[[str, Axes], None]
) -> Figure:
    """A panel per field, two in a row, with the same axis of values."""
    columns = min(2, len(fields))
    rows = ceil(len(fields) / columns)
    layout = {"ncols": columns, "sharey": True, "squeeze": False}
    with style.panels(0.9 + 2.3 * rows, rows, "y", **layout) as (figure, axes):
        for ax, field in zip(axes.flat, fields, strict=False):
            draw(field, ax)
            ax.set_xlabel(fill(parameter(field).label, 28), parse_math=True)
            of_metric(ax.yaxis, metric)
        for ax in axes.flat[len(fields) :]:
            ax.set_visible(False)
        figure.suptitle(metric_label(metric), fontsize=11, fontweight="bold")
        style.legend_below(figure, axes.flat[0], 4)
    return figure


def _axis(values: Sequence[Any]) -> tuple[list[float], list[str]]:
    """The positions of values on an axis, and the names of those that are not numbers."""
    if is_numeric_dtype(pd.Series(values)):
        return [*map(float, values)], []
    return [*map(float, range(len(values)))], [*map(value_text, values)]


def _name_ticks(axis: XAxis | YAxis, values: Sequence[Any], most: int, first: float = 0.0) -> None:
    """Ticks with the names of values; only every second or third one if there are many."""
    places = range(0, len(values), ceil(len(values) / most))
    names = [value_text(values[place]) for place in places]
    axis.set_ticks([place + first for place in places], names)
    if isinstance(axis, XAxis) and sum(map(len, names)) > _room(axis.axes):
        axis.set_tick_params(rotation=30)


def _room(ax: Axes) -> float:
    """The characters that fit below an axis."""
    spec = ax.get_subplotspec()
    return 44 / (spec.get_gridspec().ncols if spec else 1)


def _places(column: pd.Series, values: Sequence[Any]) -> pd.Series:
    """The number of every value."""
    return column.map({value: place for place, value in enumerate(values)}).astype(int)


def graded(values: Sequence[Any]) -> dict[str, tuple[str, str]]:
    """Colours from light to dark, and markers, for values in their order."""
    shades = sns.color_palette("flare", len(values)).as_hex()
    return {value_text(v): (shades[k], "os^vPX*"[k % 7]) for k, v in enumerate(values)}


def of_metric(axis: Axis, metric: str) -> None:
    """Ticks of a metric: in percent, or as numbers."""
    style.round_ticks(axis, 6)
    if metric in METRICS:
        axis.set_major_formatter(PercentFormatter(1, decimals=None))
    else:
        axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.6g}"))


def _short(value: float, metric: str) -> str:
    """A value as it is written in a cell."""
    if metric in METRICS:
        return f"{100 * value:.1f}"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"
