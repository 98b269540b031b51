"""The costs of a study's settings on its page: Pareto fronts, tables, the cheapest settings.

fronts = costs.fronts_of(study)
html.gallery(costs.drawn(study, fronts))
"""

from collections.abc import Iterator, Mapping
from math import inf

import pandas as pd
from IPython.display import HTML

from analysis import numbers
from analysis.figures import fronts as figures
from analysis.names import COST, METRICS, PRODUCT, SUCCESS, metric_name
from analysis.questions import costs as questions
from analysis.results.tables import Results
from analysis.study.cheapest import Cheapest
from reports import tables
from reports.pages import html
from reports.pages.html import Drawing
from reports.pages.study.words import INTERVALS, MOST_ROWS

MOST_CONDITIONS = 9  # the largest number of conditions with a figure; the table has all
CERTAIN = 0.01  # settings with a lower probability of being on a front are not in the table
MARKS = "The larger and darker a mark, the higher the probability that the setting is on the front."


Fronts = Mapping[str, pd.DataFrame]  # for each metric, the result of ``questions.costs.front``


def fronts_of(results: Results) -> Fronts:
    """The fronts on the page: for the required metrics, or for success and the product."""
    metrics = [*required(results)] or [SUCCESS, PRODUCT]
    return {metric: questions.front(results, metric) for metric in metrics}


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
    rows, least = questions.judged(results), required(results)
    rows = rows[rows["policy"] == questions.best_policy(results)].assign(on_front=rows["selected"])
    rows["probability"] = 0.4 + 0.6 * (rows["verdict"] == questions.MET)
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
    rows = questions.priced(results)
    rows = rows.merge(questions.parts(results).drop(columns=COST), on=["policy", "point"])
    top = rows.head(MOST_ROWS)
    shown = tables.priced(top, [])
    for part in questions.PARTS:
        shown[part.capitalize()] = top[part].map("{:,.0f}".format)
    caption = f"The mean cost of the settings [{_currency(results)}], and its parts"
    return html.table(shown, caption, data=rows)


def reasons(results: Results) -> html.Marked:
    """The cheapest settings that meet the requirements, with reasons, and the guarantee."""
    lines = [f"- {text}" for text in questions.sentences(results)]
    said = {choice.guarantee for p in results.policies if (choice := results.cheapest(p))}
    sure = "\n\n".join(f"Guarantee: {text}." for text in sorted(said))
    return html.composed("\n".join(lines) + f"\n\n{sure}")


def judged_table(results: Results) -> HTML:
    """A table of the settings and whether they meet the requirements."""
    table = questions.judged(results)
    top = table.head(MOST_ROWS)
    shown = tables.priced(top, [*required(results)])
    shown["Requirements"] = top["verdict"].map(questions.VERDICTS)
    shown["Selected"] = top["selected"].map({True: "yes", False: ""})
    shown["Missions"] = top["n"].map("{:,}".format)
    caption = f"The settings, the cheapest first; means with {INTERVALS}"
    return html.table(shown, caption, data=table)


def checked_table(results: Results) -> HTML:
    """A table of the check of the selected settings on independent missions."""
    if results.checks.empty:
        return HTML("<p>No setting was checked.</p>")
    rows = questions.checks(results)
    shown = tables.priced(rows, [*METRICS])
    shown["Missions"] = rows["n"].map("{:,}".format)
    caption = f"The check of the selected settings: means with {INTERVALS}"
    return html.table(shown, caption, data=rows)


def _currency(results: Results) -> str:
    return results.manifest["study"]["costs"]["currency"]
