"""Figures of a study for ``html.gallery``, each with its caption and its data.

html.gallery(drawings.curves(study, metrics))
"""

from collections.abc import Iterable, Iterator, Sequence

import pandas as pd

from analysis import numbers
from analysis.figures import settings as figures
from analysis.names import METRICS, PRODUCT, metric_name, parameter, value_text
from analysis.questions import main_effects as one_by_one
from analysis.questions import settings, summary
from analysis.results.tables import Results
from reports.pages.html import Drawing
from reports.pages.study.words import INTERVALS

FRAMED = (
    "The star marks the cell with the best mean of this policy. Orange frames: cells that are not "
    "significantly worse than any other, so each may be the best."
)


def leading(results: Results, metric: str) -> Drawing:
    """The figure that shows the answer of a study: the metric over all that the design varies."""
    count, kind = len(settings.varied(results)), results.design
    if kind == "saltelli":
        return next(sensitivity(results, metric))
    if not count:
        return next(means(results, [metric]))
    if count == 1:
        return next(curves(results, [metric]))
    if count == 2 and kind in ("grid", "table"):
        x, hue = settings.varied(results)
        data = settings.averaged(results, [x, hue], metric)
        caption = f"n = {_counted(data)} missions per dot; bars are {INTERVALS}."
        title = f"{metric_name(metric)} against the {parameter(x).within}"
        return figures.plot(results, x, hue, metric), title, caption, data
    if kind == "one-at-a-time":
        return next(one_at_a_time(results))
    if kind == "latin-hypercube":
        return next(scatter(results, [metric]))
    return next(main_effects(results, [metric]))


def means(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
    """Every metric of every policy at the only design point."""
    table = summary.means(results)
    for metric in (name for name in metrics if name in METRICS):
        data = table[table["metric"] == metric]
        caption = f"n = {_counted(data)} missions per policy; bars are {INTERVALS}."
        title = f"{metric_name(metric)} of every policy"
        yield figures.performance(table, metric), title, caption, data


def curves(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
    """Every metric against the only field that the design varies, with a curve per policy."""
    (field,) = settings.varied(results)
    for metric in metrics:
        data = settings.averaged(results, [field], metric)
        caption = f"n = {_counted(data)} missions per point; bars are {INTERVALS}."
        title = f"{metric_name(metric)} against the {parameter(field).within}"
        yield figures.plot(results, field, metric=metric), title, caption, data


def heat_maps(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
    """Every metric of every policy over the two fields that the design varies."""
    y, x = sorted(settings.varied(results), key=lambda f: len(settings.varied(results)[f]))
    for policy in results.policies:
        for metric in metrics:
            data = settings.averaged(results, [x, y], metric, policy)
            caption = f"Means of {policy}, {_unit(metric)}n = {_counted(data)} missions per cell. "
            title = f"{metric_name(metric)} of {policy} over {parameter(x).within} and "
            drawing = figures.heat_map(results, x, y, metric, policy)
            yield drawing, title + parameter(y).within, caption + FRAMED, data


def small_multiples(results: Results, metric: str = PRODUCT) -> Iterator[Drawing]:
    """A metric of every policy over the three fields with the largest effect, in several panels."""
    fields = settings.by_influence(settings.main_effects(results, metric))
    x, y, facet = fields[:3]
    values = settings.varied(results)[facet]
    for policy in results.policies:
        data = settings.averaged(results, [facet, x, y], metric, policy)
        caption = (
            f"Means of {policy}, {_unit(metric)}n = {_counted(data)} replications per cell. One "
            f"panel for each value of the {parameter(facet).within}{_left_out(values)}. "
            f"{_averaged(fields[3:])}{FRAMED}"
        )
        title = f"{metric_name(metric)} of {policy} over {_listed(fields[:3])}"
        drawing = figures.heat_map(results, x, y, metric, policy, facet)
        yield drawing, title, caption, data


def main_effects(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
    """Every metric against every varied field, averaged over the other fields."""
    is_sample = results.design == "saltelli"
    for metric in metrics:
        data = settings.main_effects(results, metric)
        caption = (
            "One panel for each field, the one with the largest effect first. A dot is the mean "
            f"over {_MEANT[is_sample]}; n = {_counted(data)}; bars are {INTERVALS}."
        )
        title = f"{metric_name(metric)} against each field, averaged over the others"
        yield figures.main_effects(results, metric), title, caption, data.drop(columns="tied")


def scatter(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
    """Every metric at every design point, against every varied field."""
    for metric in metrics:
        data = settings.ranked(results, metric)
        caption = (
            f"One panel for each field. A dot is the mean of a policy at a design point, over "
            f"n = {_counted(data)} missions. All fields vary at once, so dots above each other "
            "differ in the other fields."
        )
        title = f"{metric_name(metric)} at every design point"
        yield figures.scatter(results, metric), title, caption, data


def one_at_a_time(results: Results) -> Iterator[Drawing]:
    """The three metrics against every field, with all other fields as in the scenario."""
    table = one_by_one.effects(results)
    for field, pairs in one_by_one.changes_by_field(results, table).items():
        data = table[table["field"] == field]
        caption = (
            f"n = {_counted(data)} missions per point; bars are {INTERVALS}. The lowest panel "
            "shows the paired difference from the first value, with an axis of its own."
        )
        title = f"The metrics against the {parameter(field).within}"
        yield figures.effect(table, field, pairs, results.policies), title, caption, data


def sensitivity(results: Results, metric: str = PRODUCT) -> Iterator[Drawing]:
    """Sobol indices of every parameter for every policy."""
    table = summary.sensitivities(results)
    for policy, data in table[table["metric"] == metric].groupby("policy", sort=False):
        caption = (
            f"{policy}: n = {data['n'].min():,} missions; lines are {INTERVALS} by bootstrap. "
            "Below the dotted line is the noise, which no setting removes."
        )
        title = f"Sobol indices of {metric_name(metric).lower()} for {policy}"
        yield figures.sensitivity(data, str(policy)), title, caption, data


def distribution(missions: pd.DataFrame, metric: str = PRODUCT) -> Iterator[Drawing]:
    """How a metric spreads over missions of each policy."""
    counts = missions.groupby("policy", sort=False).size()
    columns = ["policy", "point", "replication", metric]
    caption = (
        f"The height of a curve is the share of the missions (n = {numbers.span(counts)} per "
        "policy) with at most the value on the axis. A step at 0 shows missions that failed."
    )
    title = f"Distribution of {metric_name(metric).lower()} over the missions"
    data = missions[columns].sort_values(columns[:3], kind="stable")
    yield figures.distribution(missions, metric), title, caption, data


# What the mean of a main effect is taken over, if the design is a sample of single missions or not.
_MEANT = {
    False: "all design points with the value, so over the other fields as the design has them, "
    "replication by replication",
    True: "the missions with the value, whatever the other fields are",
}


def _counted(table: pd.DataFrame) -> str:
    return numbers.span(table["n"])


def _unit(metric: str) -> str:
    return "in percent, " if metric in METRICS else ""


def _listed(fields: Sequence[str]) -> str:
    return numbers.words([parameter(field).within for field in fields])


def _left_out(values: Sequence[object]) -> str:
    """Which values have a panel, if some have none."""
    panels = figures.shown(values)
    if len(panels) == len(values):
        return ""
    shown = ", ".join(map(value_text, panels))
    return f" ({len(panels)} of {len(values)} values: {shown}; the others are in the data)"


def _averaged(fields: Sequence[str]) -> str:
    return f"Cells are averaged over {_listed(fields)}. " if fields else ""
