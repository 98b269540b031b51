"""Figures of costs: the fronts of cost and a metric, and the cheapest fleet."""

from collections.abc import Iterator

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, NullLocator

from dess.analysis.answers.fleet import verdicts
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.costs import cost_fronts
from dess.analysis.answers.fleet.requirements import (
    metric_asked_for,
    requirements_in_words,
    requirements_of,
)
from dess.analysis.answers.fleet.verdicts import interval_columns
from dess.analysis.answers.settings.figures import counted_replications
from dess.analysis.figures import Drawing, style
from dess.analysis.figures.style import plot_front
from dess.analysis.metrics import COST, Metric
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import Verdict
from dess.analysis.tables import INTERVALS

MOST_CONDITIONS = 9  # the largest number of conditions with a figure; the table has all


WIDE = 20.0  # if the costs differ by this factor, their axis is logarithmic


MOST_NAMES = 6  # largest number of settings that are named, of all or of those on the front


FAINT = 0.15  # the opacity of a setting that is not on the front


_MARKS = (
    "The larger and darker a mark, the higher the probability that the setting is on the front."
)


def plot_costs(
    table: pd.DataFrame, measure: Metric, currency: str, required: float | None = None
) -> Figure:
    """Cost against a metric under one condition, with 95 % intervals and the front.

    The larger and darker a mark, the higher the probability that the setting is on the front.

    Args:
        table: Rows of ``fleet.costs.cost_front``.
        measure: The metric of the front.
        currency: The currency of the costs.
        required: The required mean of the metric, drawn as a line.
    """
    styles = style.policy_colours(table["policy"])
    metric = measure.column
    ends = interval_columns(metric)
    table = table.assign(**(table[ends] * measure.scale))
    best = table[table["on_front"]].sort_values(COST)
    with style.new_panels(4.1) as (figure, ax):
        if len(best) > 1:
            plot_front(best[COST], best[metric], "front of the estimates", ax)
        for _, row in table.iterrows():
            colour, marker = styles[row["policy"]]
            x_arm, y_arm = (
                style.error_bar_arms(row, m, f"{m}_low", f"{m}_high") for m in (COST, metric)
            )
            ax.errorbar(row[COST], row[metric], xerr=x_arm, yerr=y_arm, color=colour, elinewidth=1,
                        marker=marker, markersize=4 + 5 * row["probability"],
                        alpha=FAINT + (1 - FAINT) * row["probability"])  # fmt: skip
        for policy, (colour, marker) in styles.items():
            ax.plot([], [], color=colour, marker=marker, linestyle="", label=policy)
        if len(table) <= MOST_NAMES:
            named = table.sort_values(COST)
        else:
            named = best
        for n, row in enumerate(named.to_dict("records") if len(named) <= MOST_NAMES else ()):
            # Above its interval or below it, in turn, so that neighbours do not overlap.
            if n % 2:
                end, side, gap = row[f"{metric}_low"], "top", -5
            else:
                end, side, gap = row[f"{metric}_high"], "bottom", 5
            ax.annotate(row["fleet"].replace(", ", "\n").replace(" and ", "\n"), (row[COST], end),
                        va=side, ha="center", fontsize=8, xytext=(0, gap),
                        textcoords="offset points", **style.OUTLINED)  # fmt: skip
        if required is not None:
            ax.axhline(
                required * measure.scale,
                color=style.MUTED,
                linestyle="--",
                linewidth=1.1,
                label="required",
            )
        ax.margins(x=0.12, y=0.25)
        style.set_axis_unit(ax.xaxis, "", 5)
        if table[COST].max() > WIDE * table[COST].min() > 0:
            ax.set_xscale("log")
            ax.xaxis.set_major_locator(LogLocator(subs=(1, 2, 5)))
            ax.xaxis.set_minor_locator(NullLocator())
            ax.xaxis.set_major_formatter("{x:,g}")
        style.set_axis_unit(ax.yaxis, measure.axis)
        if measure.in_percent:
            ylabel = measure.within
        else:
            ylabel = measure.label
        ax.set(xlabel=f"cost [{currency}]", ylabel=ylabel)
    return figure


def draw_cost_fronts(results: Results) -> Iterator[Drawing]:
    """The cost against the metrics of the fronts, under every condition."""
    for metric, front in cost_fronts(results).items():
        for _, rows in [*front.groupby("condition", sort=False)][:MOST_CONDITIONS]:
            yield _draw_costs(results, rows, metric, _MARKS)


def draw_cheapest(results: Results) -> Drawing:
    """The cost against the metric of the requirement that decides a search, with the answer."""
    search = search_of(results)
    requirement, condition = search.deciding_requirement()
    rows = verdicts.judge_settings(results)
    rows = rows[(rows["policy"] == search.best.policy) & (rows["condition"] == condition)]
    is_answer = rows["point"].isin(search.best.points)
    is_met = rows["verdict"] == Verdict.MET
    rows = rows.assign(on_front=is_answer, probability=np.where(is_met, 1.0, 0.4))
    marks = (
        f"With the policy {search.best.policy}. Large, dark marks meet all requirements "
        f"({requirements_in_words(requirements_of(results))}); "
        "small, faint ones miss them or are open. "
    )
    if is_answer.any():
        marks += "The answer is named."
    else:
        marks += "None is the answer."
    return _draw_costs(results, rows, requirement.column, marks)


def _draw_costs(results: Results, rows: pd.DataFrame, metric: str, marks: str) -> Drawing:
    condition = rows["condition"].iloc[0]
    bounds = {requirement.column: requirement.bound for requirement in requirements_of(results)}
    least = bounds.get(metric)
    measure = metric_asked_for(results, metric)
    drawing = plot_costs(rows, measure, results.prices.unit, least)
    alt = f"Cost against {measure.within}"
    if condition:
        alt += f", {condition}"
    counted = f"{INTERVALS}; n = {counted_replications(results, rows)} per setting."
    return Drawing(drawing, alt, f"{alt}. {marks} Bars are {counted}", rows)
