"""Figures of the settings of a study: along a field, over two or three fields, all effects.

A figure of ``results`` comes with its caption, its alternative text and its data (``Drawing``).
"""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from math import ceil
from textwrap import fill
from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from dess.analysis import numbers
from dess.analysis.answers.settings.effects import (
    JUDGED,
    average_over_others,
    fields_by_influence,
    main_effects,
    means_by_field,
)
from dess.analysis.answers.settings.points import varied_values
from dess.analysis.answers.settings.ranking import rank_settings
from dess.analysis.answers.settings.shapes import compare_values_by_field
from dess.analysis.figures import Drawing, best_place, name_best_mean, style
from dess.analysis.metrics import METRICS, PRODUCT, Metric, metric_of
from dess.analysis.names import field_named, value_text
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import NOT_RULED_OUT, SEEN_WORSE, WORSE
from dess.analysis.tables import BARS, INTERVALS

MOST_PANELS, COLUMNS = 12, 3  # of the values of a third field: panels, and columns of panels


_LEAST_AROUND = 0.01  # what colours cover at least to either side of means that are all equal


MARK = "#d55e00"  # colour that marks the best cell and cells that are not significantly worse


# What the mean of a main effect is taken over, if the design is a sample of single missions or not.
_MEANT = {
    False: "all design points with the value, so over the other fields as the design has them, "
    "replication by replication",
    True: "the missions with the value, whatever the other fields are",
}


_FRAMED = (
    "The star marks the best cell of this policy. Orange frames: cells that may be the best by "
    "what was seen."
)
_DOTTED = f" Dotted frames: cells that are worse in what was seen, where {NOT_RULED_OUT}."


def draw_curves(
    results: Results,
    x: str,
    hue: str | None = None,
    metric: str = PRODUCT,
    policy: str | None = None,
) -> Drawing:
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
    data = average_over_others(results, [x, hue] if hue else [x], metric, policy)
    drawing = plot_curves(data, x, hue or "policy", metric, "policy" if hue else None)
    mark = "dot" if hue else "point"
    caption = name_best_mean(data, metric, ["policy", x, *filter(None, [hue])])
    caption += f"n = {counted_replications(results, data)} per {mark}; bars are {INTERVALS}."
    alt = f"{metric_of(metric).name} against the {field_named(x).within}"
    return Drawing(drawing, alt, caption, data.drop(columns="selected"))


def plot_curves(
    rows: pd.DataFrame, x: str, line: str, metric: str, panel: str | None = None
) -> Figure:
    """A metric against a field: a curve for each value of a column, with 95 % intervals.

    Args:
        rows: The means of the metric, with ``mean``, ``low`` and ``high``.
        x: The field on the horizontal axis.
        line: The column with a curve for each value: a field, or ``policy``.
        metric: The metric.
        panel: A column with a panel for each value; by default there is one panel.
    """
    parts = [*style.place_values(rows, x).groupby(panel or (lambda _: ""), sort=False)]
    of_policies = line == "policy"
    shared = {"sharex": True, "sharey": True, "squeeze": False}
    values = style.ordered_values(rows[line])
    if of_policies:
        styles = style.policy_colours(values)
    else:
        styles = style.graded_colours(values)
    heading = None
    if not of_policies:
        heading = field_named(line).label
    height = 2.9 * len(parts) + 0.9
    with style.new_panels(height, len(parts), "y", 4, heading, **shared) as (figure, axes):
        for ax, (value, part) in zip(axes.flat, parts, strict=True):
            style.plot_along(part, styles, metric_of(metric).axis, ax, line)
            title = ""
            if panel:
                title = field_named(panel).words(value)
            ax.set_title(title[:1].upper() + title[1:], fontsize=10, fontweight="normal")
        figure.supylabel(metric_of(metric).label, fontsize=10)
        axes.flat[-1].set_xlabel(field_named(x).label, parse_math=True)
    return figure


def draw_heat_map(
    results: Results,
    x: str,
    y: str,
    metric: str = PRODUCT,
    policy: str | None = None,
    facet: str | None = None,
) -> Drawing:
    """A metric of a policy over two fields: the best cell, and those that may be as good.

    A star marks the best cell; cells in full frames may be as good by what was seen, those in
    dotted frames only if a rare failure was not, see ``average_over_others``.

    Args:
        results: The study.
        x: The field of the columns; means are taken over fields that are not named.
        y: The field of the rows.
        metric: The metric.
        policy: The policy; by default that of the best setting.
        facet: A third field, with a panel for each of the values that ``evenly_spaced`` selects.

    Raises:
        InputError: If there is no such field, metric or policy.
    """
    policy = policy or str(rank_settings(results, metric)["policy"].iloc[0])
    measure = metric_of(metric)
    named = [x, y, *filter(None, [facet])]
    data = average_over_others(results, [*named[2:], x, y], metric, policy)
    values = varied_values(results)
    if facet:
        panels = evenly_spaced(values[facet])
    else:
        panels = [None]
    columns = min(COLUMNS, len(panels))
    has_room = len(values[x]) * columns <= 9 and len(values[y]) * columns <= 12
    rows = data.dropna(subset="mean")
    rows = rows.assign(
        row=rows[y].map(values[y].index),
        column=rows[x].map(values[x].index),
        text=[_format_cell(mean, measure) if has_room else "" for mean in rows["mean"]],
    )
    best = best_place(rows, metric)
    least, most = _range_of_colours(rows["mean"], measure)
    scale = {"vmin": least, "vmax": most, "cmap": "YlGnBu"}
    if measure.less_is_better:
        scale["cmap"] = "YlGnBu_r"
    height = 1.2 + (1.75 if facet else 0.5 * len(values[y])) * ceil(len(panels) / columns)
    with panel_grid(min(height, 9), len(panels), columns, sharex=True) as (figure, axes):
        for ax, value in zip(axes, panels, strict=True):
            if value is None:
                part = rows
            else:
                part = rows[rows[facet] == value]
            mesh = style.plot_cells(part, (values[y], values[x]), ax, **scale)
            for standing, framed in part[part["standing"] != WORSE].groupby("standing"):
                line = ":" if standing == SEEN_WORSE else "-"
                for row in framed.itertuples():
                    corner = row.column + 0.06, row.row + 0.06
                    frame = Rectangle(corner, 0.88, 0.88, fill=False, edgecolor=MARK)
                    frame.set_linestyle(line)
                    ax.add_patch(frame)
            if best in part.index:
                place = rows.loc[best, "column"] + 0.5, rows.loc[best, "row"] + 0.8
                ax.plot(*place, "*", color=MARK, markersize=9, markeredgecolor="white")
            title = ""
            if value is not None:
                title = f"{field_named(str(facet)).tick} {value_text(value)}"
            ax.set_title(title, fontsize=9, parse_math=True)
        bar = figure.colorbar(mesh, ax=axes, shrink=0.9, aspect=30)
        style.set_axis_unit(bar.ax.yaxis, measure.axis)
        figure.supxlabel(field_named(x).label, fontsize=10, parse_math=True)
        figure.supylabel(field_named(y).tick, fontsize=10, parse_math=True)
        title = f"{measure.label}: {policy}"
        figure.suptitle(title, fontsize=11, fontweight="bold", x=0.02, ha="left")
    unit = "in percent, " if measure.in_percent else ""
    counted = counted_replications(results, data)
    if facet:
        counted = f"{numbers.format_span(data['n'])} replications"
    caption = name_best_mean(data, metric, named)
    caption += f"Means of {policy}, {unit}n = {counted} per cell. "
    if facet:
        caption += f"One panel for each value of the {field_named(facet).within}"
        caption += f"{_left_out_in_words(values[facet], panels)}. "
    fields = fields_by_influence(main_effects(results, metric))
    if others := [field for field in fields if field not in named]:
        caption += f"Cells are averaged over {_fields_in_words(others)}. "
    caption += _FRAMED
    if (rows["standing"] == SEEN_WORSE).any():
        caption += _DOTTED
    alt = f"{measure.name} of {policy} over {_fields_in_words(named)}"
    return Drawing(figure, alt, caption, data.drop(columns="selected"))


def _range_of_colours(means: pd.Series, metric: Metric) -> tuple[float, float]:
    """The means with the first and the last colour: of a share, no less than 0 and no more than 1.

    Where all means are equal, a share of 1 has the last colour, and all others the middle one.
    """
    least = float(means.min())
    most = float(means.max())
    if least < most:
        return least, most
    around = max(abs(most) / 10, _LEAST_AROUND)
    ends = np.array([least - around, most + around])
    if metric.is_bounded:
        ends = ends.clip(0.0, 1.0)
    return float(ends[0]), float(ends[1])


def draw_heat_maps(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
    """Every metric of every policy over the two fields that the design varies."""
    values = varied_values(results)
    metrics = [*metrics]
    y, x = sorted(values, key=lambda field: len(values[field]))
    for policy in results.policies:
        for metric in metrics:
            yield draw_heat_map(results, x, y, metric, policy)


def draw_small_multiples(results: Results, metric: str = PRODUCT) -> Iterator[Drawing]:
    """A metric of every policy over the three fields with the largest effect, in several panels."""
    x, y, facet = fields_by_influence(main_effects(results, metric))[:3]
    for policy in results.policies:
        yield draw_heat_map(results, x, y, metric, policy, facet)


def draw_main_effects(
    results: Results, metric: str = PRODUCT, policy: str | None = None
) -> Drawing:
    """The partial dependence of a metric on every varied field, with intervals, in several panels.

    Args:
        results: The study; its design varies one field or more.
        metric: The metric.
        policy: The policy; by default all policies.
    """
    effects = main_effects(results, metric, policy)
    measure = metric_of(metric)
    styles = style.policy_colours(results.policies, effects["policy"])

    def draw(field: str, ax: Axes) -> None:
        style.plot_along(effects[effects["field"] == field], styles, measure.axis, ax)

    drawing = _panel_per_field(fields_by_influence(effects), measure, draw)
    caption = (
        "One panel for each field, the one with the largest effect first. A dot is the mean over "
        f"{_MEANT[results.design == 'saltelli']}; n = {numbers.format_span(effects['n'])}; "
        f"bars are {INTERVALS}."
    )
    alt = f"{measure.name} against each field, averaged over the others"
    return Drawing(drawing, alt, caption, effects.drop(columns=list(JUDGED)))


def draw_scatter(results: Results, metric: str = PRODUCT, policy: str | None = None) -> Drawing:
    """The mean of a metric at every design point, against every varied field in several panels.

    Args:
        results: The study; its design varies one field or more.
        metric: The metric.
        policy: The policy; by default all policies.
    """
    table = rank_settings(results, metric, policy)
    measure = metric_of(metric)
    styles = style.policy_colours(results.policies, table["policy"])

    def draw(field: str, ax: Axes) -> None:
        rows = style.place_values(table, field)
        for name, part in rows.groupby("policy", sort=False):
            colour, marker = styles[str(name)]
            ax.scatter(part["position"], part[metric], s=18, alpha=0.7, color=colour, label=name,
                       marker=marker, linewidths=0, rasterized=len(table) > 2000)  # fmt: skip
        ticks = rows.drop_duplicates("position").sort_values("position")
        if len(ticks) <= style.MOST_TICKS:
            style.name_ticks(ax.xaxis, [*ticks["value"]], [*ticks["position"]])
        style.set_axis_unit(ax.yaxis, measure.axis)

    caption = (
        f"One panel for each field. A dot is the mean of a policy at a design point, over "
        f"n = {counted_replications(results, table)}. All fields vary at once, so dots above each "
        "other differ in the other fields."
    )
    drawing = _panel_per_field([*varied_values(results)], measure, draw)
    return Drawing(drawing, f"{measure.name} at every design point", caption, table)


def plot_distribution(missions: pd.DataFrame, metric: str = PRODUCT) -> Drawing:
    """The share of missions with at most a value of a metric: a curve per policy.

    Args:
        missions: A row per mission, with ``policy`` and the metric.
        metric: The metric.
    """
    measure = metric_of(metric)
    by_policy = missions.groupby("policy", sort=False)
    with style.new_panels(3.9, legend=4) as (figure, ax):
        style.plot_distributions({str(name): part[metric] for name, part in by_policy}, ax)
        ax.set_xlabel(measure.label)
        style.set_axis_unit(ax.xaxis, measure.axis)
    caption = (
        "The height of a curve is the share of the missions "
        f"(n = {numbers.format_span(by_policy.size())} per policy) with at most the value on the "
        "axis. A step at 0 shows missions that failed."
    )
    columns = ["policy", "point", "replication", metric]
    data = missions[columns].sort_values(columns[:3], kind="stable")
    return Drawing(figure, f"Distribution of {measure.within} over the missions", caption, data)


def evenly_spaced(values: Sequence[Any]) -> list[Any]:
    """The values of a third field that get a panel; evenly spaced if there are many."""
    places = np.linspace(0, len(values) - 1, min(MOST_PANELS, len(values)))
    return [values[round(place)] for place in places]


@contextmanager
def panel_grid(
    height: float, count: int, columns: int, **options: Any
) -> Iterator[tuple[Figure, list[Axes]]]:
    """A figure with panels in rows of several columns, and with a common axis of values."""
    layout = {"ncols": columns, "sharey": True, "squeeze": False, **options}
    with style.new_panels(height, ceil(count / columns), "y", 4, **layout) as (figure, axes):
        for ax in axes.flat[count:]:
            ax.set_visible(False)
        yield figure, [*axes.flat[:count]]


def _panel_per_field(
    fields: Sequence[str], metric: Metric, draw: Callable[[str, Axes], None]
) -> Figure:
    """A panel per field, two in a row, with the same axis of values."""
    columns = min(2, len(fields))
    height = 0.9 + 2.3 * ceil(len(fields) / columns)
    with panel_grid(height, len(fields), columns) as (figure, axes):
        for ax, field in zip(axes, fields, strict=True):
            draw(field, ax)
            ax.set_xlabel(fill(field_named(field).label, 28), parse_math=True)
        figure.supylabel(metric.label, fontsize=10)
    return figure


def _format_cell(value: float, metric: Metric) -> str:
    """A value as it is written in a cell."""
    if metric.in_percent:
        return f"{100 * value:.1f}"
    if abs(value) >= 100:
        return f"{value:,.0f}"
    return f"{value:.3g}"


def counted_replications(results: Results, table: pd.DataFrame) -> str:
    """How many missions, or years, the rows of a table have: ``20 to 1,200 missions``."""
    return f"{numbers.format_span(table['n'])} {results.study.replication_name}s"


def _fields_in_words(fields: Sequence[str]) -> str:
    return numbers.join_words([field_named(field).within for field in fields])


def _left_out_in_words(values: Sequence[Any], panels: Sequence[Any]) -> str:
    """Which values have a panel, if some have none."""
    if len(panels) == len(values):
        return ""
    drawn = ", ".join(map(value_text, panels))
    return f" ({len(panels)} of {len(values)} values: {drawn}; the others are in the data)"


def plot_effect(
    table: pd.DataFrame, field: str, changes: Mapping[str, pd.DataFrame], policies: list[str]
) -> Figure:
    """The metrics against a parameter: a part of Fig. 5.

    There is a panel per metric, with the same axis for every parameter of the table, and a panel
    with the differences from the first value, which has its own axis.

    Args:
        table: Rows of ``effects.means_by_field``, of the policies to draw.
        field: The parameter.
        changes: For each policy to draw, its ``shapes.compare_values`` in the last of ``METRICS``.
        policies: All policies of the study, so that every policy has the same colour on all pages.
    """
    rows = table[table["field"] == field]
    styles = style.policy_colours(policies, changes)
    first = rows[rows["position"] == 0]
    steps = pd.concat(
        [pairs[pairs["first"] == 0].assign(policy=name) for name, pairs in changes.items()]
    ).rename(columns={"difference": "mean", "second": "position"})
    steps = pd.concat([first.assign(mean=0.0, low=0.0, high=0.0).drop_duplicates("policy"), steps])
    steps["value"] = steps["position"].map(rows.set_index("position")["value"].to_dict())
    ratios: dict = {"sharex": True, "height_ratios": (1, 1.6, 1.6, 1.2)}
    with style.new_panels(7.6, 4, "y", **ratios) as (figure, axes):
        for ax, (metric, name) in zip(axes, METRICS.items(), strict=False):
            style.plot_along(rows[rows["metric"] == metric], styles, "%", ax)
            ax.set(
                ylabel=fill(name, 16), ylim=style.axis_ends(table[table["metric"] == metric], 0.1)
            )
        style.plot_along(steps, styles, "points", axes[-1])
        axes[-1].axhline(0, **style.ZERO)
        title = f"Paired difference from the value at {first['value'].iloc[0]}"
        axes[-1].set(title=title, ylabel="percentage\npoints")
        axes[-1].set_xlabel(field_named(field).label, parse_math=True)
    return figure


def draw_one_at_a_time(results: Results) -> Iterator[Drawing]:
    """The paper's metrics against every field, with all other fields as in the scenario."""
    table = means_by_field(results)
    for field, pairs in compare_values_by_field(results, table).items():
        data = table[table["field"] == field]
        caption = (
            f"n = {counted_replications(results, data)} per point; bars are {INTERVALS}. The "
            "lowest panel shows the paired difference from the first value, on an axis of its own: "
            f"{BARS}"
        )
        alt = f"The metrics against the {field_named(field).within}"
        yield Drawing(plot_effect(table, field, pairs, results.policies), alt, caption, data)


def plot_one_by_one(table: pd.DataFrame, policies: list[str]) -> Figure:
    """The product against every parameter, in panels side by side with the same axis.

    Args:
        table: Rows of ``effects.means_by_field``, of the policies to draw.
        policies: All policies of the study, so that every policy has the same colour on all pages.
    """
    rows = table[table["metric"] == PRODUCT]
    fields = [*rows["field"].unique()]
    styles = style.policy_colours(policies, rows["policy"])
    with panel_grid(3.4, len(fields), len(fields)) as (figure, axes):
        for ax, field in zip(axes, fields, strict=True):
            style.plot_along(rows[rows["field"] == field], styles, "%", ax)
            ax.set_xlabel(fill(field_named(field).label, 24), parse_math=True)
            ax.tick_params(axis="x", labelsize=8)
        figure.supylabel(metric_of(PRODUCT).label, fontsize=10)
    return figure
