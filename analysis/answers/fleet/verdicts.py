"""Which fleets meet the requirements: what a search for the cheapest fleet has shown of each.

A fleet is judged for every policy and under every condition and, if there are several conditions,
under all of them together.
"""

from dataclasses import replace

import pandas as pd

from dess import InputError
from dess.analysis.answers.fleet.costs import priced_settings
from dess.analysis.answers.fleet.requirements import metric_asked_for, requirements_of
from dess.analysis.answers.settings.home import with_way_home
from dess.analysis.metrics import COST, SUCCESS, Metric
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.verdict import Verdict
from dess.analysis.study.cheapest import CheapestChoice

ALL_CONDITIONS = "all conditions"
# For tables with a column of verdicts.
VERDICTS_EXPLAINED = (
    "met or missed: what the search has shown of all requirements together; open: what it did not "
    "need to decide, or could not"
)


@compute_once
def judge_settings(results: Results) -> pd.DataFrame:
    """Which settings meet the requirements, and the cheapest of these under each condition.

    Args:
        results: A study that searches for the cheapest fleet.

    Returns:
        The rows of ``costs.priced_settings`` with two more columns: ``verdict`` (``met``,
        ``missed`` or ``open``), and ``selected``, which is true for the cheapest setting of each
        policy under each condition whose verdict is ``met``. Both have the guarantee of the search.
    """
    tables = []
    for policy, rows in priced_settings(results).groupby("policy", sort=False):
        choice = cheapest_choice(results, str(policy))
        selected = [a.points[0] for a in choice.answers if a.condition is not None and a.points]
        verdicts = rows["point"].map(dict(enumerate(choice.verdicts)))
        tables.append(rows.assign(verdict=verdicts, selected=rows["point"].isin(selected)))
    return pd.concat(tables).sort_index()


@compute_once
def judge_fleets_everywhere(results: Results) -> pd.DataFrame:
    """The fleets under all conditions together.

    Returns:
        A row per policy and fleet that the design has under every condition, the cheapest first,
        with the columns of ``judge_settings``: ``cost`` is the mean over the conditions,
        ``verdict`` holds under all of them, and a metric is that of the condition under which the
        fleet is worst at it. ``n`` is the least number of missions under a condition.
    """
    table = judge_settings(results)
    rows = []
    conditions = table["condition"].nunique()
    for (policy, _), under_conditions in table.groupby(["policy", "fleet"], sort=False):
        if len(under_conditions) == conditions:
            rows.append(_judge_under_all_conditions(results, str(policy), under_conditions))
    fleets = pd.DataFrame(rows, columns=table.columns)
    return fleets.sort_values(COST, kind="stable", ignore_index=True)


def _judge_under_all_conditions(results: Results, policy: str, rows: pd.DataFrame) -> pd.Series:
    """The row of ``judge_fleets_everywhere`` of a fleet, of its rows under all conditions."""
    together = rows.iloc[0].copy()
    for metric in reported_metrics(results):
        if metric.less_is_better:
            worst = rows[metric.column].idxmax()
        else:
            worst = rows[metric.column].idxmin()
        ends_of = interval_columns(metric.column)
        together[ends_of] = rows.loc[worst, ends_of]
    together[interval_columns(COST)] = rows[interval_columns(COST)].mean()
    together["condition"] = ALL_CONDITIONS
    together["verdict"] = Verdict.of_all(rows["verdict"])
    together["n"] = rows["n"].min()
    selected = cheapest_choice(results, policy).answers[-1].points
    together["selected"] = {*selected} == {*rows["point"]}
    return together


def reported_metrics(results: Results) -> list[Metric]:
    """What the tables and sentences of a search tell of a fleet: success, and what is required."""
    asked = [requirement.column for requirement in requirements_of(results)]
    columns = with_way_home(results, [SUCCESS, *asked])
    return [metric_asked_for(results, column) for column in columns]


def interval_columns(column: str) -> list[str]:
    """The columns of a mean and the ends of its interval."""
    return [column, f"{column}_low", f"{column}_high"]


@compute_once
def checked_settings(results: Results) -> pd.DataFrame:
    """The check of the selected settings on missions that were not used for the selection.

    Returns:
        A row per policy and selected design point, with the columns of ``costs.priced_settings``.
    """
    return priced_settings(replace(results, missions=results.checks))


@compute_once
def quoted_settings(results: Results) -> pd.DataFrame:
    """The settings with the estimates that answers quote.

    A search gives most missions to a setting whose results were good so far. The check had no part
    in the search, so its means are unbiased.

    Returns:
        The rows of ``judge_settings``. The metrics, the cost and ``n`` of settings that were
        checked are those of ``checked_settings``.
    """
    table = judge_settings(results)
    setting = ["policy", "point"]
    if results.checks.empty:
        return table
    rows = table.set_index(setting)
    checked = checked_settings(results).set_index(setting)
    rows.loc[checked.index, checked.columns] = checked
    return rows.reset_index()[[*table]]


def cheapest_choice(results: Results, policy: str) -> CheapestChoice:
    """What the search has chosen for a policy.

    Raises:
        InputError: If the study does not search for the cheapest setting.
    """
    choice = results.cheapest(policy)
    if choice is None:
        raise InputError(
            results.store.folder,
            "does not search for the cheapest setting",
            'a study with the procedure "cheapest"',
        )
    return choice
