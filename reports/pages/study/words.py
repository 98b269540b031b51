"""Sentences of the page of a study, in Markdown: what was simulated, and what is the best."""

from collections.abc import Iterator, Sequence
from typing import Any

import pandas as pd

from analysis import numbers
from analysis.names import METRICS, PRODUCT, metric_name, parameter, value_text
from analysis.questions import settings, summary
from analysis.results.tables import Results
from analysis.stats.intervals import LEVEL
from analysis.study.cheapest import Cheapest
from analysis.study.design import NOISE
from dess import InputError
from reports.pages import html

INTERVALS = f"{numbers.level(LEVEL)} intervals"
MOST_NAMES = 3  # the largest number of settings that are named because they may be as good
MOST_ROWS = 25  # the largest number of rows of a table on the page; its data have all rows
_BEST = "Which setting is the best for {}?"
_MOST_VALUES = 12  # the largest number of values of a field in a list


def metric_of(results: Results, metric: str | None = None) -> str:
    """The metric that ranks the settings: the given one, the one of the selection, or the product.

    Raises:
        InputError: If there is no such metric.
    """
    if metric is not None:
        settings.check_metric(results, metric)
        return metric
    return (results.manifest["study"]["selection"] or {}).get("metric", PRODUCT)


def setting(results: Results, point: int) -> str:
    """The design point with which all others are compared, in words.

    Raises:
        InputError: If there is no such design point.
    """
    points = settings.in_words(results)
    if point not in range(len(points)):
        raise InputError(
            f"baseline: {point!r} is not a design point; allowed: 0..{len(points) - 1}"
        )
    return points[point]


def metrics_of(metric: str) -> list[str]:
    """The metrics on the page: the metric that ranks the settings, and those of the paper."""
    return [*dict.fromkeys((metric, *METRICS))]


def simulated(results: Results) -> html.Marked:
    """What was simulated: scenario, policies, design and missions, as a list."""
    manifest = results.store.manifest
    study, points = manifest.study, len(manifest.points)
    fixed = [f"{parameter(field).within} {_set(value)}" for field, value in study["set"].items()]
    policies = numbers.words([html.code(policy) for policy in results.policies])
    missions = numbers.span(n for of_policy in manifest.missions for n in of_policy)
    each = f" per policy{' and design point' * (points > 1)}"
    lines = [
        html.marked(
            "- **Scenario:** {scenario}{fixed}.",
            scenario=html.code(study["scenario"]),
            fixed=", with " * bool(fixed) + numbers.words(fixed),
        ),
        f"- **Policies:** {policies}.",
        *_design(results),
        f"- **Missions:** {missions}{each}, {len(results.missions):,} in all.",
    ]
    return html.Marked("\n".join(lines))


def answer(results: Results, ranked: pd.DataFrame, metric: str) -> str:
    """The best setting, and how many settings may be as good.

    Args:
        results: The study.
        ranked: The result of ``settings.ranked`` for the metric.
        metric: The metric.
    """
    best, others, tied = ranked.iloc[0], len(ranked) - 1, int(ranked["tied"].sum()) - 1
    value = numbers.written(metric)(*best[[metric, f"{metric}_low", f"{metric}_high"]])
    where = [f" with {w}" * (w != settings.AS_IT_IS) for w in settings.in_words(results)]
    names = [p + where[k] for p, k in ranked.loc[ranked["tied"], ["policy", "point"]].to_numpy()]
    what = "setting" if settings.varied(results) else "policy"
    if others == 1:
        rest = f" The other {what} {'may be as good' if tied else 'is significantly worse'}."
    elif not tied:
        rest = f" All {others:,} others are significantly worse." if others else ""
    else:
        named = f" ({'; '.join(names[1:])})" * (tied <= MOST_NAMES)
        rest = (
            f" Of the {others:,} others, {tied:,} may be as good{named}; the rest are "
            "significantly worse."
        )
    best_one = f"The best {what} is {names[0]}: {metric_name(metric).lower()} {value}, "
    policies = settings.dependence(results, ranked, metric) if len(results.policies) == 2 else []
    edge = settings.edge(results, best["point"], settings.ends(results, best["point"]))
    return " ".join([f"{best_one}n = {best['n']:,}.{rest}{edge}", *policies])


def of_variance(results: Results, metric: str) -> str:
    """Which fields explain most of the variance of a metric for the first policy."""
    rows = summary.sensitivities(results)
    rows = rows[(rows["metric"] == metric) & (rows["policy"] == results.policies[0])].dropna()
    parts = [
        f"{parameter(row.parameter).within if row.parameter != NOISE else 'the replication'} "
        f"{numbers.percent(row.total)}"
        for row in rows.nlargest(3, "total").itertuples()
    ]
    if not parts:
        return f"The {metric_name(metric).lower()} is the same in all missions: no variance."
    return (
        f"Of the variance of the {metric_name(metric).lower()} of {results.policies[0]}, with all "
        f"interactions: {numbers.words(parts)}."
    )


def title(results: Results) -> str:
    """The question that a study answers."""
    if isinstance(results.store.manifest.selection, Cheapest):
        question = "Which fleet is the cheapest for {}?"
    elif results.design == "saltelli":
        question = "Which parameters matter for {}?"
    elif fields := [parameter(field).within for field in settings.varied(results)]:
        question = f"Which {numbers.words(fields)} for {{}}?" if len(fields) < 4 else _BEST
    else:
        question = "Which policy for {}?"
    return question.format(results.manifest["study"]["scenario"])


def guarantees(results: Results) -> html.Marked:
    """What is guaranteed about the selections, as a list."""
    rows = summary.selections(results).itertuples()
    lines = [html.marked("- {name}: {known}", name=row.policy, known=row.guarantee) for row in rows]
    return html.Marked("\n".join(lines))


def commands(results: Results, missions: pd.DataFrame) -> html.Marked:
    """The commands that simulate missions again, and the folder that they name.

    Args:
        results: The study.
        missions: Rows of ``summary.worst``.
    """
    return html.marked(
        "These commands simulate them again. {folder} stands for the results folder of the study, "
        "wherever it is:\n\n{lines}",
        folder=html.code(results.usual_folder),
        lines=html.commands(missions["command"]),
    )


def _design(results: Results) -> Iterator[html.Marked]:
    """The fields that the design varies, as items of the list."""
    points = len(results.store.manifest.points)
    if fields := settings.varied(results):
        line = "- **Design:** {kind}, {points:,} design points. It varies:"
        yield html.marked(line, kind=html.code(results.design), points=points)
    for field, values in fields.items():
        unit = f" [{parameter(field).unit}]".removesuffix(" []")
        line = "    - {field}{unit}: {values}"
        yield html.marked(line, field=parameter(field).within, unit=unit, values=_values(values))


def _values(values: Sequence[Any]) -> str:
    """The values of a field as text; only the first and the last if there are many."""
    texts = [value_text(value) for value in values]
    if len(texts) <= _MOST_VALUES:
        return ", ".join(texts)
    return f"{len(texts):,} values, {texts[0]} to {texts[-1]}"


def _set(value: Any) -> str:
    """A value of the study's table ``set`` as text; of a list of cells, only their number."""
    if isinstance(value, list | tuple) and any(isinstance(item, list | tuple) for item in value):
        return f"of {len(value)} cells"
    return value_text(value)
