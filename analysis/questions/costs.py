"""The costs of the settings of a study, and the cheapest setting that meets requirements.

    results = load_results("results/fleets")  # of a study with a table [costs]
    front(results, "success")  # cost and success, with the probability of being on the front
    judged(results)  # of a search for the cheapest setting: which settings meet the requirements

A setting is a policy at a design point. The fields that an operator decides on, such as the numbers
of UAVs and pads, make up the fleet. All other fields that the design varies are conditions under
which the fleet has to work. Fleets are compared under one condition at a time, and under all
conditions together by ``everywhere``.
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.names import COST, DECISIONS, METRICS, SUCCESS
from analysis.questions.settings import points, ranked, value_in_words
from analysis.results.tables import Results
from analysis.stats.front import membership, on_front
from analysis.study.cheapest import Cheapest, CheapestChoice
from analysis.study.costs import PARTS, Costs
from dess.errors import InputError, one_of

MISSED, OPEN, MET = "missed", "open", "met"  # the most serious first
VERDICTS = {MET: "shown", OPEN: "not shown", MISSED: "refuted"}  # the words used in tables
EVERYWHERE = "all conditions"
_WHY_NOT = {
    MET: "meets the requirements as well, and saves less than the indifference",
    OPEN: "is not known to meet the requirements",
    MISSED: "misses the requirements",
}


def priced(results: Results) -> pd.DataFrame:
    """The settings with their costs: condition by condition, the cheapest first.

    Returns:
        A row per policy and design point: ``condition`` and ``fleet`` in words, ``policy``,
        ``point``, the varied fields, for every metric and for ``cost`` the mean and the ends of its
        95 % interval (as in ``settings.ranked``), and ``n`` missions.

    Raises:
        InputError: If the study has no prices.
    """
    _prices(results)
    table = ranked(results, COST).drop(columns=["rank", "tied"])
    conditions, fleets = _conditions(results), _fleets(results)
    table.insert(0, "condition", [conditions[point] for point in table["point"]])
    table.insert(1, "fleet", [fleets[point] for point in table["point"]])
    order = {"kind": "stable", "key": lambda texts: texts.map(conditions.index)}
    return table.sort_values("condition", ignore_index=True, **order)


def parts(results: Results) -> pd.DataFrame:
    """The mean parts of the cost of every setting.

    Returns:
        A row per policy and design point: ``policy``, ``point``, ``purchase``, ``charging``,
        ``hours``, ``losses``, and ``cost``, their sum.

    Raises:
        InputError: If the study has no prices.
    """
    prices, missions = _prices(results), results.missions
    amounts = prices.parts(results.store.manifest.scenarios, missions, results.uavs)
    table = missions[["policy", "point", COST]].assign(**amounts)
    return table.groupby(["policy", "point"], sort=False, as_index=False)[[*PARTS, COST]].mean()


def front(results: Results, metric: str = SUCCESS) -> pd.DataFrame:
    """The Pareto front of cost and a metric: the settings that no other one dominates.

    Args:
        results: The study.
        metric: A column of the missions; more is better.

    Returns:
        The rows of ``priced`` with two more columns. ``on_front`` tells whether the setting is on
        the front of the estimates, under its condition. ``probability`` is the probability that it
        is on the front of the true means (``stats.front.membership``).

    Raises:
        InputError: If the study has no prices, or there is no such metric.
    """
    if metric not in METRICS:
        raise InputError(f"metric: {metric!r} is unknown{one_of(metric, METRICS)}")
    generator = np.random.default_rng(results.store.manifest.seed)
    tables = []
    for _, rows in priced(results).groupby("condition", sort=False):
        costs, values = (_samples(results, rows, name) for name in (COST, metric))
        estimates = on_front(rows[COST].to_numpy(), rows[metric].to_numpy())
        share = membership(costs, values, metric == SUCCESS, generator)
        tables.append(rows.assign(on_front=estimates, probability=share))
    return pd.concat(tables, ignore_index=True)


def judged(results: Results) -> pd.DataFrame:
    """Which settings meet the requirements, and the cheapest of these under each condition.

    Args:
        results: A study that searches for the cheapest setting.

    Returns:
        The rows of ``priced`` with two more columns: ``verdict`` (``met``, ``missed`` or ``open``),
        and ``selected``, which is true for the cheapest setting of each policy under each condition
        whose verdict is ``met``. Both have the guarantee of the search.
    """
    tables = []
    for policy, rows in priced(results).groupby("policy", sort=False):
        choice = _choice(results, str(policy))
        selected = [a.points[0] for a in choice.answers if a.condition is not None and a.points]
        verdicts = rows["point"].map(dict(enumerate(choice.verdicts)))
        tables.append(rows.assign(verdict=verdicts, selected=rows["point"].isin(selected)))
    return pd.concat(tables).sort_index()


def checks(results: Results) -> pd.DataFrame:
    """The check of the selected settings on missions that were not used for the selection.

    Returns:
        A row per policy and selected design point, with the columns of ``priced``.
    """
    return priced(replace(results, missions=results.checks))


def everywhere(results: Results, table: pd.DataFrame) -> pd.DataFrame:
    """The fleets under all conditions together; empty if there is only one condition.

    Args:
        results: The study.
        table: The result of ``judged``.

    Returns:
        A row per policy and fleet that the design has under every condition, the cheapest first:
        ``policy``, ``fleet``, ``cost`` (the mean over the conditions), ``verdict`` under all
        conditions, and ``selected``, which is true for the cheapest fleet of each policy that meets
        the requirements under every condition.
    """
    conditions = table["condition"].nunique()
    rows = []
    for (policy, fleet), part in table.groupby(["policy", "fleet"], sort=False):
        if len(part) == conditions > 1:
            verdict = min(part["verdict"], key=[MISSED, OPEN, MET].index)
            selected = {*_choice(results, policy).answers[-1].points} == {*part["point"]}
            rows.append((policy, fleet, part[COST].mean(), verdict, selected))
    fleets = pd.DataFrame(rows, columns=["policy", "fleet", COST, "verdict", "selected"])
    return fleets.sort_values(COST, kind="stable", ignore_index=True)


def answers(results: Results, table: pd.DataFrame) -> list[str]:
    """In words: the cheapest setting for each policy and condition, and why no cheaper one.

    Args:
        results: The study.
        table: The result of ``judged``.
    """
    rule, currency = results.store.manifest.selection, _prices(results).currency
    wanted = rule.requirements if isinstance(rule, Cheapest) else {}
    together = everywhere(results, table).assign(condition=f"{EVERYWHERE} together")
    sentences = []
    for rows, required in ((table, wanted), (together, {})):
        for (condition, policy), part in rows.groupby(["condition", "policy"], sort=False):
            where = f"{condition}, `{policy}`" if condition else f"`{policy}`"
            sentences.append(f"{where[:1].upper()}{where[1:]}: {_answer(part, required, currency)}")
    return sentences


def answer(results: Results) -> str:
    """In words: the cheapest setting of the first policy, and what the others would have said.

    If there are several conditions, it is the setting for all of them together.
    """
    table, first = judged(results), results.policies[0]
    return " ".join([answers(results, table[table["policy"] == first])[-1], *dependence(results)])


def dependence(results: Results) -> list[str]:
    """A sentence for each further policy: what its cheapest fleet is, so how much depends on it."""
    fleets = selections(results).groupby("policy", sort=False)["setting"].last()
    first, *others = results.policies
    return [
        f"`{policy}` gives the same answer."
        if fleets[policy] == fleets[first]
        else f"With `{policy}`, it would be **{fleets[policy]}**."
        for policy in others
    ]


def cheapest_fleet(results: Results) -> str:
    """The cheapest fleet of the first policy that meets the requirements under every condition."""
    found = selections(results)
    return str(found[found["policy"] == results.policies[0]]["setting"].iloc[-1])


def selections(results: Results) -> pd.DataFrame:
    """What was selected by a study that searches for the cheapest settings.

    Returns:
        A row per policy and condition and, if there are several conditions, one for all of them:
        ``policy``, ``condition`` in words, ``point`` (None if no setting is selected, or for all
        conditions), ``setting`` (the fleet in words), ``missions`` of the policy, ``left`` (number
        of settings that may be as good), ``guaranteed`` and ``guarantee``.
    """
    conditions, fleets = [*dict.fromkeys(_conditions(results)), EVERYWHERE], _fleets(results)
    rows = []
    for policy in results.policies:
        choice = _choice(results, policy)
        for condition, answer in zip(conditions, choice.answers, strict=False):
            fleet = fleets[answer.points[0]] if answer.points else "none"
            point = answer.points[0] if answer.points and answer.condition is not None else None
            found = (policy, condition, point, fleet, choice.missions, len(answer.left))
            rows.append((*found, answer.settled, choice.guarantee))
    columns = ["policy", "condition", "point", "setting", "missions", "left", "guaranteed"]
    return pd.DataFrame(rows, columns=[*columns, "guarantee"]).astype({"point": "Int64"})


def _answer(rows: pd.DataFrame, wanted: Mapping[Any, float], currency: str) -> str:
    """The answer for one policy under one condition.

    Args:
        rows: The rows of ``judged`` or ``everywhere``, the cheapest first.
        wanted: The requirements, for what the rows have of their metrics.
        currency: The currency of the costs.
    """
    best = rows[rows["selected"]]
    if len(best):
        found = _told(best.iloc[0], wanted, currency)
        cheaper = rows[rows[COST] < best[COST].iloc[0]].tail(1)
        text, which = (
            f"the cheapest setting that meets the requirements is {found}.",
            "next cheaper",
        )
    else:
        leads = pd.DataFrame({metric: rows[metric] - least for metric, least in wanted.items()})
        cheaper = rows.loc[leads.min(axis=1).nlargest(1).index]
        text, which = "no setting is known to meet the requirements.", "closest"
    for _, row in cheaper.iterrows():
        text += f" The {which} one, {_told(row, wanted, currency)}, {_WHY_NOT[row['verdict']]}."
    return text


def _told(row: pd.Series, wanted: Mapping[Any, float], currency: str) -> str:
    """A setting, its cost, and its metrics with the requirements, in words."""
    metrics = [
        f"{'success' if metric == SUCCESS else METRICS[metric].lower()} "
        f"{numbers.interval(*row[[metric, f'{metric}_low', f'{metric}_high']])} "
        f"({numbers.level(least)} required)"
        for metric, least in wanted.items()
    ]
    text = f"**{row['fleet']}** for {numbers.money(row[COST], currency)}"
    return f"{text} with {numbers.words(metrics)}" if metrics else text


def _prices(results: Results) -> Costs:
    prices = results.store.manifest.costs
    if prices is None:
        raise InputError(
            f"{results.store.folder}: the study has no prices; allowed: one with a table [costs]"
        )
    return prices


def _choice(results: Results, policy: str) -> CheapestChoice:
    choice = results.cheapest(policy)
    if choice is None:
        raise InputError(
            f"{results.store.folder}: does not search for the cheapest setting; allowed: a study "
            'with the procedure "cheapest"'
        )
    return choice


def _samples(results: Results, rows: pd.DataFrame, name: str) -> np.ndarray:
    """The (k, n) values of the settings of k rows; nan where a setting lacks a replication."""
    missions = results.missions[results.missions["point"].isin(rows["point"])]
    wide = missions.pivot(index="replication", columns=["policy", "point"], values=name)
    keys = pd.MultiIndex.from_frame(rows[["policy", "point"]])
    return wide.reindex(columns=keys).to_numpy(float).T


def _fleets(results: Results) -> list[str]:
    """The fleet of every design point in words."""
    return [numbers.words(row) or "the fleet of the scenario" for row in _words(results, True)]


def _conditions(results: Results) -> list[str]:
    """The condition of every design point in words."""
    return [", ".join(row) for row in _words(results, False)]


def _words(results: Results, decisions: bool) -> list[list[str]]:
    """The fields of every design point that an operator decides on, or all others, in words."""
    rows = points(results).to_dict("records")
    return [
        [value_in_words(str(f), v) for f, v in r.items() if (f in DECISIONS) == decisions]
        for r in rows
    ]
