"""The tables on the page of a study, each with its caption and its data, in the order of the page.

tables.ranked(study, settings.ranked(study, metric), metric)
"""

import pandas as pd
from IPython.display import HTML

from analysis import numbers
from analysis.names import METRICS, metric_name, parameter, value_text
from analysis.questions import sensitivity as indices
from analysis.questions import settings, summary
from analysis.results.tables import Results
from reports import tables
from reports.pages import html
from reports.pages.study.words import INTERVALS, MOST_ROWS, metrics_of


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
    return html.table(indices.index_table(data), caption, data=data)


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
