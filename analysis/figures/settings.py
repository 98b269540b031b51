"""Figures of the settings of a study: along a field, effects, fronts of two metrics.

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
from matplotlib.ticker import LogLocator, NullLocator

from dess.analysis import numbers
from dess.analysis.answers import costs as priced
from dess.analysis.answers import main_effects as one_field
from dess.analysis.answers import settings, summary
from dess.analysis.answers.fleet import cheapest
from dess.analysis.answers.fleet.requirements import Verdict, in_words, required
from dess.analysis.figures import Drawing, style
from dess.analysis.metrics import COST, METRICS, PRODUCT, Metric, metric_of
from dess.analysis.names import parameter, value_text
from dess.analysis.results.tables import Results
from dess.analysis.study.design import NOISE
from dess.analysis.tables import INTERVALS

MOST_PANELS, COLUMNS = 12, 3  # of the values of a third field: panels, and columns of panels
MARK = "#d55e00"  # colour that marks the best cell and cells that are not significantly worse
# What the mean of a main effect is taken over, if the design is a sample of single missions or not.
_MEANT = {
    False: "all design points with the value, so over the other fields as the design has them, "
    "replication by replication",
    True: "the missions with the value, whatever the other fields are",
}
_FRAMED = (
    "The star marks the cell with the best mean of this policy. Orange frames: cells that are not "
    "significantly worse than any other, so each may be the best."
)
_MARKS = (
    "The larger and darker a mark, the higher the probability that the setting is on the front."
)
_PRINTED: dict = {"color": style.INK, "linestyle": "--", "linewidth": 1.3}


def performance(summary: pd.DataFrame, metric: str, printed: float | None = None) -> Figure:
    """A metric of every policy: means with intervals, and the paper's number as a line.

    Args:
        summary: Rows of ``dess.analysis.summary`` by ``policy``.
        metric: The metric.
        printed: The paper's number.
    """
    rows, of = summary[summary["metric"] == metric], metric_of(metric)
    with style.panels(1.3 + 0.42 * len(rows), values="x") as (figure, ax):
        style.in_rows(rows, ax)
        for y, mean in enumerate(rows["mean"]):
            style.note_at_right(of.write(mean), y, ax)
        if printed is not None:
            ax.axvline(printed, **_PRINTED, label=f"paper {of.write(printed)}", zorder=1)
        ax.set(title=of.name, xlim=(-0.02, 1.02) if of.is_bounded else None)
        style.in_units(ax.xaxis, of.axis, 5)
    return figure


def by_fleet(
    summary: pd.DataFrame, metric: str, printed: Mapping[int, float] | None = None
) -> Figure:
    """A metric of every policy against the number of UAVs, with intervals.

    Args:
        summary: Rows of ``dess.analysis.summary`` by ``policy`` and ``uavs``.
        metric: One of ``METRICS``.
        printed: The paper's numbers by number of UAVs.
    """
    rows = style.placed(summary[summary["metric"] == metric], "uavs")
    with style.panels(3.9, values="y", legend=5) as (figure, ax):
        style.along(rows, style.policy_colours(rows["policy"]), "%", ax)
        if printed:
            ax.plot(*zip(*sorted(printed.items()), strict=True), "D", label="paper", **_PRINTED)
        ax.set(title=METRICS[metric], xlabel="UAVs", ylim=(-0.03, 1.04))
    return figure


def means(results: Results, metric: str) -> Drawing:
    """A metric of every policy at the only design point."""
    table = summary.means(results)
    data = table[table["metric"] == metric]
    caption = f"n = {_counted(data)} missions per policy; bars are {INTERVALS}."
    alt = f"{metric_of(metric).name} of every policy"
    return Drawing(performance(table, metric), alt, caption, data)


def plot(
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
    data = settings.averaged(results, [x, hue] if hue else [x], metric, policy)
    drawing = lines(data, x, hue or "policy", metric, "policy" if hue else None)
    each = "dot" if hue else "point"
    caption = f"n = {_counted(data)} missions per {each}; bars are {INTERVALS}."
    alt = f"{metric_of(metric).name} against the {parameter(x).within}"
    return Drawing(drawing, alt, caption, data)


def lines(rows: pd.DataFrame, x: str, line: str, metric: str, panel: str | None = None) -> Figure:
    """A metric against a field: a curve for each value of a column, with 95 % intervals.

    Args:
        rows: The means of the metric, with ``mean``, ``low`` and ``high``.
        x: The field on the horizontal axis.
        line: The column with a curve for each value: a field, or ``policy``.
        metric: The metric.
        panel: A column with a panel for each value; by default there is one panel.
    """
    parts = [*style.placed(rows, x).groupby(panel or (lambda _: ""), sort=False)]
    of_policies, shared = line == "policy", {"sharex": True, "sharey": True, "squeeze": False}
    values = style.ordered(rows[line])
    looks = style.policy_colours(values) if of_policies else style.graded(values)
    heading = None if of_policies else parameter(line).label
    height = 2.9 * len(parts) + 0.9
    with style.panels(height, len(parts), "y", 4, heading, **shared) as (figure, axes):
        for ax, (value, part) in zip(axes.flat, parts, strict=True):
            style.along(part, looks, metric_of(metric).axis, ax, line)
            title = parameter(panel).words(value) if panel else ""
            ax.set_title(title[:1].upper() + title[1:], fontsize=10, fontweight="normal")
        figure.suptitle(metric_of(metric).label, fontsize=11, fontweight="bold")
        axes.flat[-1].set_xlabel(parameter(x).label, parse_math=True)
    return figure


def heat_map(
    results: Results,
    x: str,
    y: str,
    metric: str = PRODUCT,
    policy: str | None = None,
    facet: str | None = None,
) -> Drawing:
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
    of, named = metric_of(metric), [x, y, *filter(None, [facet])]
    data = settings.averaged(results, [*named[2:], x, y], metric, policy)
    values = settings.varied(results)
    panels = shown(values[facet]) if facet else [None]
    columns = min(COLUMNS, len(panels))
    has_room = len(values[x]) * columns <= 9 and len(values[y]) * columns <= 12
    rows = data.dropna(subset="mean")
    rows = rows.assign(
        row=rows[y].map(values[y].index),
        column=rows[x].map(values[x].index),
        text=[_short(mean, of) if has_room else "" for mean in rows["mean"]],
    )
    best = rows["mean"].idxmin() if of.less_is_better else rows["mean"].idxmax()
    scale = {"vmin": rows["mean"].min(), "vmax": rows["mean"].max(), "cmap": "YlGnBu"}
    scale |= {"cmap": "YlGnBu_r"} if of.less_is_better else {}
    height = 1.2 + (1.75 if facet else 0.5 * len(values[y])) * ceil(len(panels) / columns)
    with _grid(min(height, 9), len(panels), columns, sharex=True) as (figure, axes):
        for ax, value in zip(axes, panels, strict=True):
            part = rows if value is None else rows[rows[facet] == value]
            mesh = style.cells(part, (values[y], values[x]), ax, **scale)
            for row in part[part["tied"]].itertuples():
                corner = row.column + 0.06, row.row + 0.06
                ax.add_patch(Rectangle(corner, 0.88, 0.88, fill=False, edgecolor=MARK))
            if best in part.index:
                place = rows.loc[best, "column"] + 0.5, rows.loc[best, "row"] + 0.8
                ax.plot(*place, "*", color=MARK, markersize=9, markeredgecolor="white")
            title = "" if value is None else f"{parameter(str(facet)).tick} {value_text(value)}"
            ax.set_title(title, fontsize=9, parse_math=True)
        bar = figure.colorbar(mesh, ax=axes, shrink=0.9, aspect=30)
        style.in_units(bar.ax.yaxis, of.axis)
        figure.supxlabel(parameter(x).label, fontsize=10, parse_math=True)
        figure.supylabel(parameter(y).tick, fontsize=10, parse_math=True)
        title = f"{of.label}: {policy}"
        figure.suptitle(title, fontsize=11, fontweight="bold", x=0.02, ha="left")
    caption = f"Means of {policy}, {'in percent, ' * of.in_percent}n = {_counted(data)} "
    caption += f"{'replications' if facet else 'missions'} per cell. "
    if facet:
        caption += f"One panel for each value of the {parameter(facet).within}"
        caption += f"{_left_out(values[facet], panels)}. "
    fields = settings.by_influence(settings.main_effects(results, metric))
    if others := [field for field in fields if field not in named]:
        caption += f"Cells are averaged over {_listed(others)}. "
    alt = f"{of.name} of {policy} over {_listed(named)}"
    return Drawing(figure, alt, caption + _FRAMED, data)


def heat_maps(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
    """Every metric of every policy over the two fields that the design varies."""
    values, metrics = settings.varied(results), [*metrics]
    y, x = sorted(values, key=lambda field: len(values[field]))
    for policy in results.policies:
        for metric in metrics:
            yield heat_map(results, x, y, metric, policy)


def small_multiples(results: Results, metric: str = PRODUCT) -> Iterator[Drawing]:
    """A metric of every policy over the three fields with the largest effect, in several panels."""
    x, y, facet = settings.by_influence(settings.main_effects(results, metric))[:3]
    for policy in results.policies:
        yield heat_map(results, x, y, metric, policy, facet)


def main_effects(results: Results, metric: str = PRODUCT, policy: str | None = None) -> Drawing:
    """The partial dependence of a metric on every varied field, with intervals, in several panels.

    Args:
        results: The study; its design varies one field or more.
        metric: The metric.
        policy: The policy; by default all policies.
    """
    effects, of = settings.main_effects(results, metric, policy), metric_of(metric)
    looks = style.policy_colours(results.policies, effects["policy"])

    def draw(field: str, ax: Axes) -> None:
        style.along(effects[effects["field"] == field], looks, of.axis, ax)

    drawing = _panel_per_field(settings.by_influence(effects), of, draw)
    caption = (
        "One panel for each field, the one with the largest effect first. A dot is the mean over "
        f"{_MEANT[results.design == 'saltelli']}; n = {_counted(effects)}; bars are {INTERVALS}."
    )
    alt = f"{of.name} against each field, averaged over the others"
    return Drawing(drawing, alt, caption, effects.drop(columns="tied"))


def scatter(results: Results, metric: str = PRODUCT, policy: str | None = None) -> Drawing:
    """The mean of a metric at every design point, against every varied field in several panels.

    Args:
        results: The study; its design varies one field or more.
        metric: The metric.
        policy: The policy; by default all policies.
    """
    table, of = settings.ranked(results, metric, policy), metric_of(metric)
    looks = style.policy_colours(results.policies, table["policy"])

    def draw(field: str, ax: Axes) -> None:
        rows = style.placed(table, field)
        for name, part in rows.groupby("policy", sort=False):
            colour, marker = looks[str(name)]
            ax.scatter(part["position"], part[metric], s=18, alpha=0.7, color=colour, label=name,
                       marker=marker, linewidths=0, rasterized=len(table) > 2000)  # fmt: skip
        ticks = rows.drop_duplicates("position").sort_values("position")
        if len(ticks) <= style.MOST_TICKS:
            style.name_ticks(ax.xaxis, [*ticks["value"]], [*ticks["position"]])
        style.in_units(ax.yaxis, of.axis)

    caption = (
        f"One panel for each field. A dot is the mean of a policy at a design point, over "
        f"n = {_counted(table)} missions. All fields vary at once, so dots above each other "
        "differ in the other fields."
    )
    drawing = _panel_per_field([*settings.varied(results)], of, draw)
    return Drawing(drawing, f"{of.name} at every design point", caption, table)


def distribution(missions: pd.DataFrame, metric: str = PRODUCT) -> Drawing:
    """The share of missions with at most a value of a metric: a curve per policy.

    Args:
        missions: A row per mission, with ``policy`` and the metric.
        metric: The metric.
    """
    of, by_policy = metric_of(metric), missions.groupby("policy", sort=False)
    with style.panels(3.9, legend=4) as (figure, ax):
        style.distributions({str(name): part[metric] for name, part in by_policy}, ax)
        ax.set_xlabel(of.label)
        style.in_units(ax.xaxis, of.axis)
    caption = (
        "The height of a curve is the share of the missions "
        f"(n = {numbers.span(by_policy.size())} per policy) with at most the value on the axis. A "
        "step at 0 shows missions that failed."
    )
    columns = ["policy", "point", "replication", metric]
    data = missions[columns].sort_values(columns[:3], kind="stable")
    return Drawing(figure, f"Distribution of {of.within} over the missions", caption, data)


def effect(
    table: pd.DataFrame, field: str, changes: Mapping[str, pd.DataFrame], policies: list[str]
) -> Figure:
    """The metrics against a parameter: a part of Fig. 5.

    There is a panel per metric, with the same axis for every parameter of the table, and a panel
    with the differences from the first value, which has its own axis.

    Args:
        table: Rows of ``answers.main_effects.effects``, of the policies to draw.
        field: The parameter.
        changes: For each policy to draw, its ``main_effects.changes`` in the last of ``METRICS``.
        policies: All policies of the study, so that every policy has the same colour on all pages.
    """
    rows, looks = table[table["field"] == field], style.policy_colours(policies, changes)
    first = rows[rows["position"] == 0]
    steps = pd.concat(
        [pairs[pairs["first"] == 0].assign(policy=name) for name, pairs in changes.items()]
    ).rename(columns={"difference": "mean", "second": "position"})
    steps = pd.concat([first.assign(mean=0.0, low=0.0, high=0.0).drop_duplicates("policy"), steps])
    steps["value"] = steps["position"].map(rows.set_index("position")["value"].to_dict())
    ratios: dict = {"sharex": True, "height_ratios": (1, 1.6, 1.6, 1.2)}
    with style.panels(7.6, 4, "y", **ratios) as (figure, axes):
        for ax, (metric, name) in zip(axes, METRICS.items(), strict=False):
            style.along(rows[rows["metric"] == metric], looks, "%", ax)
            ax.set(title=name, ylim=style.ends(table[table["metric"] == metric], 0.1))
        style.along(steps, looks, "points", axes[-1])
        axes[-1].axhline(0, **style.ZERO)
        title = f"Paired difference from the value at {first['value'].iloc[0]}"
        axes[-1].set(title=title, ylabel="points")
        axes[-1].set_xlabel(parameter(field).label, parse_math=True)
    return figure


def one_at_a_time(results: Results) -> Iterator[Drawing]:
    """The paper's metrics against every field, with all other fields as in the scenario."""
    table = one_field.effects(results)
    for field, pairs in one_field.changes_by_field(results, table).items():
        data = table[table["field"] == field]
        caption = (
            f"n = {_counted(data)} missions per point; bars are {INTERVALS}. The lowest panel "
            "shows the paired difference from the first value, with an axis of its own."
        )
        alt = f"The metrics against the {parameter(field).within}"
        yield Drawing(effect(table, field, pairs, results.policies), alt, caption, data)


def one_by_one(table: pd.DataFrame, policies: list[str]) -> Figure:
    """The product against every parameter, in panels side by side with the same axis.

    Args:
        table: Rows of ``answers.main_effects.effects``, of the policies to draw.
        policies: All policies of the study, so that every policy has the same colour on all pages.
    """
    rows = table[table["metric"] == PRODUCT]
    fields, looks = [*rows["field"].unique()], style.policy_colours(policies, rows["policy"])
    with _grid(3.4, len(fields), len(fields)) as (figure, axes):
        for ax, field in zip(axes, fields, strict=True):
            style.along(rows[rows["field"] == field], looks, "%", ax)
            ax.set_xlabel(fill(parameter(field).label, 24), parse_math=True)
            ax.tick_params(axis="x", labelsize=8)
        figure.suptitle(metric_of(PRODUCT).label, fontsize=11, fontweight="bold", x=0.01, ha="left")
    return figure


def sensitivity(rows: pd.DataFrame, title: str) -> Figure:
    """Sobol indices of every parameter as dots with intervals; the noise has its own row.

    Args:
        rows: Rows of ``dess.analysis.answers.summary.sensitivities`` of a policy and a metric.
        title: The title of the figure.
    """
    rows, look = rows.reset_index(drop=True), style.dot((style.palette()[0], "o"))
    with style.panels(1.5 + 0.45 * len(rows), values="x", legend=2) as (figure, ax):
        for index, label, fill_style in (
            ("first", "alone (first order)", "none"),
            ("total", "with all interactions (total)", "full"),
        ):
            spots = np.arange(len(rows)) + (0.12 if index == "total" else -0.12)
            bars = style.arms(rows, index, f"{index}_low", f"{index}_high")
            ax.errorbar(rows[index], spots, xerr=bars, linestyle="", label=label,
                        fillstyle=fill_style, **look)  # fmt: skip
        ax.axvline(0, **style.ZERO)
        for y in rows.index[rows["parameter"] == NOISE]:
            ax.axhline(y - 0.5, color=style.MUTED, linewidth=0.9, linestyle=":")
        noise = "noise of the\nreplication"
        names = [noise if name == NOISE else parameter(name).tick for name in rows["parameter"]]
        ax.set_yticks(range(len(rows)), names, parse_math=True)
        ax.set(title=title, ylim=(len(rows) - 0.5, -0.5), xlabel="share of the variance")
        style.in_units(ax.xaxis, "%")
    return figure


def index_figures(results: Results, metric: str = PRODUCT) -> Iterator[Drawing]:
    """Sobol indices of every parameter for every policy."""
    table, called = summary.sensitivities(results), metric_of(metric).within
    for policy, data in table[table["metric"] == metric].groupby("policy", sort=False):
        caption = (
            f"{policy}: n = {data['n'].min():,} missions; lines are {INTERVALS} by bootstrap. "
            "Below the dotted line is the noise, which no setting removes."
        )
        alt = f"Sobol indices of {called} for {policy}"
        yield Drawing(sensitivity(data, str(policy)), alt, caption, data)


def leading(results: Results, metric: str) -> Drawing:
    """The figure that shows the answer of a study.

    It is the metric over all that the design varies, or what decides a search for a fleet.
    """
    if required(results):
        return deciding(results)
    fields, kind = [*settings.varied(results)], results.design
    if kind == "saltelli":
        return next(index_figures(results, metric))
    if not fields:
        return means(results, metric)
    if len(fields) == 1 or (len(fields) == 2 and kind in ("grid", "table")):
        return plot(results, fields[0], next(iter(fields[1:]), None), metric)
    if kind == "one-at-a-time":
        return next(one_at_a_time(results))
    return (scatter if kind == "latin-hypercube" else main_effects)(results, metric)


def shown(values: Sequence[Any]) -> list[Any]:
    """The values of a third field with a panel in ``heat_map``; evenly spaced if there are many."""
    places = np.linspace(0, len(values) - 1, min(MOST_PANELS, len(values)))
    return [values[round(place)] for place in places]


@contextmanager
def _grid(
    height: float, count: int, columns: int, **options: Any
) -> Iterator[tuple[Figure, list[Axes]]]:
    """A figure with panels in rows of several columns, and with a common axis of values."""
    layout = {"ncols": columns, "sharey": True, "squeeze": False, **options}
    with style.panels(height, ceil(count / columns), "y", 4, **layout) as (figure, axes):
        for ax in axes.flat[count:]:
            ax.set_visible(False)
        yield figure, [*axes.flat[:count]]


def _panel_per_field(
    fields: Sequence[str], metric: Metric, draw: Callable[[str, Axes], None]
) -> Figure:
    """A panel per field, two in a row, with the same axis of values."""
    columns = min(2, len(fields))
    height = 0.9 + 2.3 * ceil(len(fields) / columns)
    with _grid(height, len(fields), columns) as (figure, axes):
        for ax, field in zip(axes, fields, strict=True):
            draw(field, ax)
            ax.set_xlabel(fill(parameter(field).label, 28), parse_math=True)
        figure.suptitle(metric.label, fontsize=11, fontweight="bold")
    return figure


def _short(value: float, metric: Metric) -> str:
    """A value as it is written in a cell."""
    if metric.in_percent:
        return f"{100 * value:.1f}"
    return f"{value:,.0f}" if abs(value) >= 100 else f"{value:.3g}"


def _counted(table: pd.DataFrame) -> str:
    return numbers.span(table["n"])


def _listed(fields: Sequence[str]) -> str:
    return numbers.words([parameter(field).within for field in fields])


def _left_out(values: Sequence[Any], panels: Sequence[Any]) -> str:
    """Which values have a panel, if some have none."""
    if len(panels) == len(values):
        return ""
    drawn = ", ".join(map(value_text, panels))
    return f" ({len(panels)} of {len(values)} values: {drawn}; the others are in the data)"


MOST_CONDITIONS = 9  # the largest number of conditions with a figure; the table has all
WIDE = 20.0  # if the costs differ by this factor, their axis is logarithmic
MOST_NAMES = 6  # largest number of settings that are named, of all or of those on the front
FAINT = 0.15  # the opacity of a setting that is not on the front


def costs(table: pd.DataFrame, metric: str, currency: str, required: float | None = None) -> Figure:
    """Cost against a metric under one condition, with 95 % intervals and the front.

    The larger and darker a mark, the higher the probability that the setting is on the front.

    Args:
        table: Rows of ``answers.costs.front``.
        metric: The metric of the front.
        currency: The currency of the costs.
        required: The required mean of the metric, drawn as a line.
    """
    looks = style.policy_colours(table["policy"])
    best = table[table["on_front"]].sort_values(COST)
    with style.panels(4.1) as (figure, ax):
        if len(best) > 1:
            _front(best[COST], best[metric], "front of the estimates", ax)
        for _, row in table.iterrows():
            colour, marker = looks[row["policy"]]
            x_arm, y_arm = (style.arms(row, m, f"{m}_low", f"{m}_high") for m in (COST, metric))
            ax.errorbar(row[COST], row[metric], xerr=x_arm, yerr=y_arm, color=colour, elinewidth=1,
                        marker=marker, markersize=4 + 5 * row["probability"],
                        alpha=FAINT + (1 - FAINT) * row["probability"])  # fmt: skip
        for policy, (colour, marker) in looks.items():
            ax.plot([], [], color=colour, marker=marker, linestyle="", label=policy)
        named = table.sort_values(COST) if len(table) <= MOST_NAMES else best
        for n, row in enumerate(named.to_dict("records") if len(named) <= MOST_NAMES else ()):
            side = ("top", -5) if n % 2 else ("bottom", 5)  # so that neighbours do not overlap
            ax.annotate(row["fleet"].replace(" and ", "\n"), (row[COST], row[metric]), va=side[0],
                        fontsize=8, xytext=(7, side[1]), textcoords="offset points",
                        **style.OUTLINED)  # fmt: skip
        if required is not None:
            ax.axhline(required, color=style.MUTED, linestyle="--", linewidth=1.1, label="required")
        ax.margins(x=0.12, y=0.12)
        style.in_units(ax.xaxis, "", 5)
        if table[COST].max() > WIDE * table[COST].min() > 0:
            ax.set_xscale("log")
            ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            ax.xaxis.set_minor_locator(NullLocator())
            ax.xaxis.set_major_formatter("{x:,g}")
        of = metric_of(metric)
        style.in_units(ax.yaxis, of.axis)
        ylabel = of.within if of.in_percent else of.label
        ax.set(xlabel=f"cost [{currency}]", ylabel=ylabel)
    return figure


def fronts(results: Results) -> Iterator[Drawing]:
    """The cost against the metrics of the fronts, under every condition."""
    for metric, front in priced.fronts_of(results).items():
        for _, rows in [*front.groupby("condition", sort=False)][:MOST_CONDITIONS]:
            yield _costs(results, rows, metric, _MARKS)


def deciding(results: Results) -> Drawing:
    """The cost against the metric of the tightest requirement of a search, with the answer."""
    answer = cheapest.the_answer(results)
    requirement, condition = cheapest.tightest(results)
    rows = cheapest.judged(results)
    rows = rows[(rows["policy"] == answer.policy) & (rows["condition"] == condition)]
    is_answer = rows["point"].isin(answer.points)
    is_met = rows["verdict"] == Verdict.MET
    rows = rows.assign(on_front=is_answer, probability=np.where(is_met, 1.0, 0.4))
    marks = (
        f"With the policy {answer.policy}. Large, dark marks meet all requirements "
        f"({in_words(required(results))}); small, faint ones miss them or are open. "
    )
    marks += "The answer is named." if is_answer.any() else "None is the answer."
    return _costs(results, rows, requirement.column, marks)


def _costs(results: Results, rows: pd.DataFrame, metric: str, marks: str) -> Drawing:
    condition = rows["condition"].iloc[0]
    bounds = {requirement.column: requirement.bound for requirement in required(results)}
    least = bounds.get(metric)
    drawing = costs(rows, metric, results.manifest["study"]["costs"]["currency"], least)
    alt = f"Cost against {metric_of(metric).within}{', ' * bool(condition)}{condition}"
    counted = f"{INTERVALS}; n = {_counted(rows)} missions per setting."
    return Drawing(drawing, alt, f"{alt}. {marks} Bars are {counted}", rows)


def decision_times(table: pd.DataFrame) -> Figure:
    """Decision time against the product of all policies, and their Pareto front.

    Args:
        table: Rows of ``answers.comparison.front``.
    """
    looks = style.policy_colours(table["policy"])
    best = table[table["on_front"]].sort_values("seconds")
    with style.panels(4.2) as (figure, ax):
        _front(best["seconds"], best["mean"], "Pareto front", ax)
        for _, row in table.iterrows():
            ax.errorbar(row["seconds"], row["mean"], yerr=style.arms(row), label=row["policy"],
                        linestyle="", **style.dot(looks[row["policy"]]))  # fmt: skip
        ax.set(xscale="log", title="Decision time against quality", ylabel=METRICS[PRODUCT])
        ax.set_xlabel("time of a decision for one mission, median")
        ax.set_xlim(table["seconds"].min() / 2, table["seconds"].max() * 2)
        ax.xaxis.set_major_formatter(lambda time, _: numbers.seconds(time))
        ax.xaxis.set_minor_locator(NullLocator())
        style.in_units(ax.yaxis, "%")
    return figure


def _front(paid: pd.Series, reached: pd.Series, label: str, ax: Axes) -> None:
    ax.step(paid, reached, where="post", color=style.INK, linewidth=1.1, zorder=1, label=label)
