"""The page of a study: which sections it has, their sentences, figures and tables."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from pathlib import Path
from types import MappingProxyType
from typing import Any

import pandas as pd
from IPython.display import HTML

from analysis import numbers
from analysis.answers import costs, settings, summary
from analysis.answers import main_effects as one_by_one
from analysis.answers.settings import varied
from analysis.figures import settings as figures
from analysis.names import COST, METRICS, PRODUCT, SUCCESS, metric_name, parameter, value_text
from analysis.results.tables import Results, load_results
from analysis.stats.intervals import LEVEL
from analysis.study.cheapest import Cheapest
from analysis.study.design import NOISE
from analysis.study.selection import Selection
from dess import InputError
from reports import tables
from reports.folders import PREFIX
from reports.pages import html, notebook
from reports.pages.html import Drawing
from reports.pages.notebook import SHIPPED, Report, tags_of

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
    fixed = [f"{parameter(field).within} {_set(value)}" for field, value in study.set.items()]
    policies = numbers.words([html.code(policy) for policy in results.policies])
    missions = numbers.span(n for of_policy in manifest.missions for n in of_policy)
    each = f" per policy{' and design point' * (points > 1)}"
    lines = [
        html.marked(
            "- **Scenario:** {scenario}{fixed}.",
            scenario=html.code(study.scenario),
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


def page_title(results: Results) -> str:
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


FRAMED = (
    "The star marks the cell with the best mean of this policy. Orange frames: cells that are not "
    "significantly worse than any other, so each may be the best."
)


def leading(results: Results, metric: str) -> Drawing:
    """The figure that shows the answer of a study: the metric over all that the design varies."""
    count, kind = len(settings.varied(results)), results.design
    if kind == "saltelli":
        return next(index_figures(results, metric))
    if not count:
        return next(mean_figures(results, [metric]))
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
    return next(effect_figures(results, [metric]))


def mean_figures(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
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


def effect_figures(results: Results, metrics: Iterable[str]) -> Iterator[Drawing]:
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


def index_figures(results: Results, metric: str = PRODUCT) -> Iterator[Drawing]:
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


def ranked(results: Results, rows: pd.DataFrame, metric: str) -> HTML:
    """The best settings.

    Args:
        results: The study.
        rows: Its ``settings.ranked``.
        metric: The metric that ranks them.
    """
    caption = (
        f"The first {min(len(rows), MOST_ROWS)} of {len(rows):,} settings by "
        f"{metric_name(metric).lower()}: means with {INTERVALS}"
    )
    top = rows.head(MOST_ROWS)
    shown = _settings(results, top, metric)
    shown.insert(0, "Rank", top["rank"])
    shown.insert(1, "May be the best", top["tied"].map({True: "yes", False: "no"}))
    return html.table(shown, caption, data=rows)


def best_of_policies(results: Results, metric: str) -> HTML:
    """The best setting of every policy, and how many of its settings may be as good."""
    own = [settings.ranked(results, metric, policy) for policy in results.policies]
    best = pd.concat([rows.head(1) for rows in own], ignore_index=True)
    shown = _settings(results, best, metric)
    shown["May be its best"] = [f"{rows['tied'].sum():,} of {len(rows):,} settings" for rows in own]
    caption = f"The best setting of every policy by {metric_name(metric).lower()}"
    return html.table(shown, caption, data=best.drop(columns=["rank", "tied"]))


def main_effects(results: Results, metric: str) -> HTML:
    """The size of the effect of every field on a metric."""
    effects = settings.main_effects(results, metric)
    write = numbers.percent if metric in METRICS else numbers.quantity
    rows = []
    for (field, policy), part in effects.groupby(["field", "policy"], sort=False):
        low, high = part.loc[part["mean"].idxmin()], part.loc[part["mean"].idxmax()]
        ends = [f"{write(row['mean'])} at {row['value']}" for row in (low, high)]
        span = write(high["mean"] - low["mean"]).replace(" %", " points")
        rows.append((parameter(str(field)).name, policy, *ends, span))
    columns = ["Field", "Policy", "Lowest mean", "Highest mean", "Difference"]
    caption = f"The effect of each field on {metric_name(metric).lower()}, averaged over the others"
    data = effects.drop(columns="tied")
    return html.table(pd.DataFrame(rows, columns=columns), caption, data=data)


def sensitivity(results: Results) -> HTML:
    """Sobol indices."""
    data = summary.sensitivities(results)
    caption = f"Sobol indices as shares of the variance, with {INTERVALS}"
    return html.table(summary.index_table(data), caption, data=data)


def selected(results: Results) -> HTML:
    """The setting that was selected for every policy."""
    data = summary.selections(results)
    words = settings.in_words(results)
    columns = {
        "Policy": data["policy"],
        "Selected setting": [words[point] for point in data["point"]],
        "Missions of the selection": data["missions"].map("{:,}".format),
        "Settings not ruled out": data["left"],
    }
    caption = "The setting that was selected for every policy"
    return html.table(pd.DataFrame(columns), caption, data=data)


def checked(results: Results) -> HTML:
    """The check of the selected settings on independent missions."""
    caption = f"The check of the selected settings: means with {INTERVALS}"
    return _means(summary.checks(results), caption)


def means(results: Results) -> HTML:
    """The means of every policy at the only design point."""
    return _means(summary.means(results), f"Means with {INTERVALS}")


def precisions(results: Results) -> HTML:
    """The precision that a study had to reach, and whether it did."""
    data = summary.precisions(results)
    caption = f"Half-widths of {INTERVALS}, and their targets"
    return html.table(tables.precisions(data.head(MOST_ROWS)), caption, data=data)


def against(results: Results, baseline: int, metric: str) -> HTML:
    """Every design point compared with a baseline."""
    data = settings.against(results, baseline, metrics_of(metric))
    rows = data[data["metric"] == metric]
    order = rows["difference"].abs().sort_values(ascending=False, kind="stable").index
    top = rows.loc[order[:MOST_ROWS]].sort_values("difference", ascending=False, kind="stable")
    write = numbers.points if metric in METRICS else numbers.quantities
    columns = {"Policy": top["policy"], "Point": top["point"]} | _fields(results, top)
    columns["Difference"] = [write(*row) for row in top[["difference", "low", "high"]].to_numpy()]
    columns["p (Holm)"] = top["p_adjusted"].map(numbers.p_value)
    columns["Pairs"] = top["n"].map("{:,}".format)
    unit = " in percentage points" if metric in METRICS else ""
    caption = (
        f"{metric_name(metric)}: paired difference from the baseline{unit} with "
        f"{INTERVALS}; the {len(top):,} largest of {len(rows):,} differences"
    )
    return html.table(pd.DataFrame(columns), caption, data=data)


def comparisons(results: Results) -> HTML:
    """Every policy compared with the best one."""
    data = summary.comparisons(results)
    return _compared(data, "policy", f"Differences from {data['baseline'].iloc[0]}")


def learners(results: Results) -> HTML:
    """Every learner compared with the best heuristic."""
    data = summary.learned_against_heuristic(results)
    caption = f"Learned policies: differences from {data['baseline'].iloc[0]}, the best heuristic"
    return _compared(data, "learner", caption)


def worst(results: Results, rows: pd.DataFrame) -> HTML:
    """The worst missions.

    Args:
        results: The study.
        rows: The result of ``summary.worst``.
    """
    columns = {
        "Replication": rows["replication"],
        "Success": rows["success"].map({1: "yes", 0: "no"}),
        "Collection ratio": rows["collection_ratio"].map(numbers.percent),
        "Reward": rows["reward"].map(numbers.quantity),
    }
    policy, point = rows["policy"].iloc[0], {*rows["point"]}
    where = f", {settings.in_words(results)[point.pop()]}" if len(point) == 1 else ""
    caption = f"The worst missions of {policy}{where}"
    return html.table(pd.DataFrame(columns), caption, data=rows)


def spread(distributions: pd.DataFrame, metric: str) -> HTML:
    """The quantiles of a metric over missions.

    Args:
        distributions: Rows of ``analysis.distribution``.
        metric: The metric.
    """
    caption = f"Quantiles of {metric_name(metric).lower()} over missions, with {INTERVALS}"
    return html.table(tables.spread(distributions, metric), caption, data=distributions)


def _settings(results: Results, rows: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Rows of ``settings.ranked`` as text."""
    columns = {"Policy": rows["policy"], "Point": rows["point"]} | _fields(results, rows)
    for name in metrics_of(metric):
        columns[metric_name(name)] = numbers.estimates(rows, name, numbers.written(name))
    return pd.DataFrame(columns | {"Missions": rows["n"].map("{:,}".format)})


def _fields(results: Results, rows: pd.DataFrame) -> dict[str, pd.Series]:
    """The columns of the varied fields as text, with the names of the fields as headers."""
    return {parameter(f).name: rows[f].map(value_text) for f in settings.varied(results)}


def _means(rows: pd.DataFrame, caption: str) -> HTML:
    return html.table(tables.means(rows), caption, data=rows)


def _compared(rows: pd.DataFrame, of: str, caption: str) -> HTML:
    units = f"[percentage points], with {INTERVALS} (▲ better, ▼ worse, ≈ inconclusive);"
    caption = (
        f"{caption} {units} p corrected for the number of comparisons and the choice of the best "
        "by these data"
    )
    return html.table(tables.compared(rows, of), caption, data=rows)


MOST_CONDITIONS = 9  # the largest number of conditions with a figure; the table has all
CERTAIN = 0.01  # settings with a lower probability of being on a front are not in the table
MARKS = "The larger and darker a mark, the higher the probability that the setting is on the front."


Fronts = Mapping[str, pd.DataFrame]  # for each metric, the result of ``answers.costs.front``


def fronts_of(results: Results) -> Fronts:
    """The fronts on the page: for the required metrics, or for success and the product."""
    metrics = [*required(results)] or [SUCCESS, PRODUCT]
    return {metric: costs.front(results, metric) for metric in metrics}


def required(results: Results) -> Mapping[str, float]:
    """The requirements of a study that selects the cheapest setting."""
    rule = results.store.manifest.selection
    given = rule.requirements if isinstance(rule, Cheapest) else {}
    return {str(metric): least for metric, least in given.items()}


def drawn(results: Results, fronts: Fronts, marks: str = MARKS) -> Iterator[Drawing]:
    """Figures of the cost against the metrics of the fronts, for every condition."""
    for metric, front in fronts.items():
        for condition, rows in [*front.groupby("condition", sort=False)][:MOST_CONDITIONS]:
            least = required(results).get(metric)
            drawing = figures.costs(rows, metric, _currency(results), least)
            title = f"Cost against {metric_name(metric).lower()}{', ' * bool(condition)}{condition}"
            counted = f"{INTERVALS}; n = {numbers.span(rows['n'])} missions per setting."
            yield drawing, title, f"{title}. {marks} Bars are {counted}", rows


def deciding(results: Results) -> Drawing:
    """The cost against the metric whose requirement asks for the most expensive fleet."""
    rows, least = costs.judged(results), required(results)
    rows = rows[rows["policy"] == costs.best_policy(results)].assign(on_front=rows["selected"])
    rows["probability"] = 0.4 + 0.6 * (rows["verdict"] == costs.MET)
    parts = [(m, part) for m in least for _, part in rows.groupby("condition", sort=False)]
    cheapest = [min(part[COST][part[m] >= least[m]], default=inf) for m, part in parts]
    metric, part = parts[cheapest.index(max(cheapest))]
    wanted = numbers.words([f"{metric_name(m).lower()} {100 * q:g} %" for m, q in least.items()])
    marks = f"Large, dark marks are shown to meet all requirements ({wanted}); faint ones are not."
    return next(drawn(results, {metric: part}, marks))


def front_table(results: Results, fronts: Fronts) -> HTML:
    """The settings that may be on one of the fronts, with the probabilities."""
    first = next(iter(fronts.values()))
    shares = pd.DataFrame({metric: front["probability"] for metric, front in fronts.items()})
    top = first[(shares >= CERTAIN).any(axis=1)].head(MOST_ROWS)
    shown = tables.priced(top, [*fronts])
    for metric in fronts:
        head = f"On the front of {metric_name(metric).lower()}"
        shown[head] = shares.loc[top.index, metric].map(numbers.percent)
    caption = (
        f"Settings that may be on a front: mean cost [{_currency(results)}] and metrics with "
        f"{INTERVALS}, and the probability that they are on it"
    )
    data = first.drop(columns=["on_front", "probability"])
    return html.table(shown, caption, data=data.join(shares.add_prefix("on_front_of_")))


def parts_table(results: Results) -> HTML:
    """A table of the parts of the settings' costs."""
    rows = costs.priced(results)
    rows = rows.merge(costs.parts(results).drop(columns=COST), on=["policy", "point"])
    top = rows.head(MOST_ROWS)
    shown = tables.priced(top, [])
    for part in costs.PARTS:
        shown[part.capitalize()] = top[part].map("{:,.0f}".format)
    caption = f"The mean cost of the settings [{_currency(results)}], and its parts"
    return html.table(shown, caption, data=rows)


def reasons(results: Results) -> html.Marked:
    """The cheapest settings that meet the requirements, with reasons, and the guarantee."""
    lines = [f"- {text}" for text in costs.sentences(results)]
    said = {choice.guarantee for p in results.policies if (choice := results.cheapest(p))}
    sure = "\n\n".join(f"Guarantee: {text}." for text in sorted(said))
    return html.composed("\n".join(lines) + f"\n\n{sure}")


def judged_table(results: Results) -> HTML:
    """A table of the settings and whether they meet the requirements."""
    table = costs.judged(results)
    top = table.head(MOST_ROWS)
    shown = tables.priced(top, [*required(results)])
    shown["Requirements"] = top["verdict"].map(costs.VERDICTS)
    shown["Selected"] = top["selected"].map({True: "yes", False: ""})
    shown["Missions"] = top["n"].map("{:,}".format)
    caption = f"The settings, the cheapest first; means with {INTERVALS}"
    return html.table(shown, caption, data=table)


def checked_table(results: Results) -> HTML:
    """A table of the check of the selected settings on independent missions."""
    if results.checks.empty:
        return HTML("<p>No setting was checked.</p>")
    rows = costs.checks(results)
    shown = tables.priced(rows, [*METRICS])
    shown["Missions"] = rows["n"].map("{:,}".format)
    caption = f"The check of the selected settings: means with {INTERVALS}"
    return html.table(shown, caption, data=rows)


def _currency(results: Results) -> str:
    return results.manifest["study"]["costs"]["currency"]


NOTEBOOK = "study"


def report_of(
    folder: Path, values: Mapping[str, Any] = MappingProxyType({}), notebooks: Path = SHIPPED
) -> Report:
    """The report of a results folder, with the sections and the title of its study.

    Args:
        folder: The results folder.
        values: Values for the parameters of the notebook, to be checked.
        notebooks: The folder of the notebooks.

    Raises:
        InputError: If the folder holds no results, or they are incomplete or damaged; if the study
            has no such metric or baseline.
    """
    results = load_results(folder)
    metric_of(results, values.get("metric"))
    setting(results, values.get("baseline", 0))
    study, original = results.manifest["study"], notebook.parsed(NOTEBOOK, notebooks)
    kept = {tag: has(results) for tag, has in TAGS.items()}
    original.cells = [
        cell for cell in original.cells if all(kept.get(tag, True) for tag in tags_of(cell))
    ]
    points = len(results.store.manifest.points)
    where = f"{points:,} design points" if points > 1 else f"the scenario {study['scenario']}"
    description = study["description"] or f"{numbers.words(results.policies)} at {where}."
    title = page_title(results)
    original.cells[0].source = f"# {html.text(title)}\n\n{html.text(description)}"
    report = notebook.report_of(f"{PREFIX}{study['name']}", original)
    return replace(report, title=title, description=" ".join(description.split()))


def _kind(results: Results) -> str:
    """The kind of the design; a design that varies one field at most is a grid."""
    kind = results.design
    return kind if kind in ("saltelli", "latin-hypercube") or len(varied(results)) > 1 else "grid"


def _is_scan(results: Results, fields: Callable[[int], bool]) -> bool:
    """Whether the design has combinations of values, of a number of fields."""
    count, kind = len(varied(results)), _kind(results)
    return fields(count) and (kind == "grid" or (kind == "table" and count <= 2))


def _has(section: str) -> Callable[[Results], bool]:
    return lambda results: results.manifest["study"][section] is not None


# For each tag, a function that tells whether the page of a study has the cells with this tag.
TAGS: dict[str, Callable[[Results], bool]] = {
    # Several design points whose missions share their replications: settings to rank.
    "if-settings": lambda results: (
        len(results.store.manifest.points) > 1 and _kind(results) != "saltelli"
    ),
    # Settings, one or several, with missions enough to rank them.
    "if-ranked": lambda results: _kind(results) != "saltelli",
    # The answer is the best setting.
    "if-answer": lambda results: (
        _kind(results) != "saltelli" and not isinstance(results.store.manifest.selection, Cheapest)
    ),
    # A single design point: the policies are compared in it.
    "if-one-setting": lambda results: len(results.store.manifest.points) == 1,
    # Fields with several values; such that others are averaged over.
    "if-fields": lambda results: bool(varied(results)),
    "if-effects": lambda results: len(varied(results)) > 1 and _kind(results) != "one-at-a-time",
    # Combinations of values of one field, of two, of three and more.
    "if-one-field": lambda results: _is_scan(results, lambda count: count == 1),
    "if-two-fields": lambda results: _is_scan(results, lambda count: count == 2),
    "if-many-fields": lambda results: _is_scan(results, lambda count: count > 2),
    "if-one-at-a-time": lambda results: _kind(results) == "one-at-a-time",
    # Design points spread over the space of parameters.
    "if-sampled": lambda results: (
        _kind(results) == "latin-hypercube"
        or (_kind(results) == "table" and len(varied(results)) > 2)
    ),
    "if-sensitivity": lambda results: _kind(results) == "saltelli",
    # Several policies with the same missions; some of them learned, some not.
    "if-policies": lambda results: not summary.comparisons(results).empty,
    "if-learned": lambda results: not summary.learned_against_heuristic(results).empty,
    # Tables of the study.
    "if-selection": lambda results: isinstance(results.store.manifest.selection, Selection),
    "if-cheapest": lambda results: isinstance(results.store.manifest.selection, Cheapest),
    "if-precision": _has("precision"),
    "if-costs": _has("costs"),
}
