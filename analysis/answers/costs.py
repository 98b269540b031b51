"""The costs of the settings of a study, and the cheapest setting that meets requirements.

    results = load_results("results/fleets")  # of a study with a table [costs]
    front(results, "success")  # cost and success, with the probability of being on the front
    judged(results)  # of a search for the cheapest setting: which settings meet the requirements

A setting is a policy at a design point. The fields that an operator decides on, such as the numbers
of UAVs and pads, make up the fleet. All other fields that the design varies are conditions under
which the fleet has to work. Fleets are compared under one condition at a time, and under all
conditions together by ``everywhere``.
"""

from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.settings import (
    edge,
    ends,
    intervals_in_words,
    points,
    ranked,
    words_of,
)
from dess.analysis.metrics import COST, METRICS, PRODUCT, SUCCESS, metric_of, told
from dess.analysis.names import DECISIONS, parameter
from dess.analysis.results.tables import Results, once
from dess.analysis.stats.verdict import membership, on_front
from dess.analysis.study.cheapest import Answer, Cheapest, CheapestChoice
from dess.analysis.study.costs import PARTS, Costs, stranded
from dess.analysis.tables import CHECKED, MOST_ROWS, Table, counts
from dess.errors import one_of
from dess.fields import ZONE_PADS

MISSED, OPEN, MET = "missed", "open", "met"  # the most serious first
VERDICTS = {MET: "shown", OPEN: "not shown", MISSED: "refuted"}  # the words used in tables
COUNTED = ("uavs", "pads", ZONE_PADS)  # the numbers of what has a price
EVERYWHERE = "all conditions"
_WHY_NOT = {
    MET: "meets the requirements as well, and saves less than the indifference",
    OPEN: "is not known to meet the requirements",
    MISSED: "misses the requirements",
}


@once
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
    conditions, words = _conditions(results), fleets(results)
    table.insert(0, "condition", [conditions[point] for point in table["point"]])
    table.insert(1, "fleet", [words[point] for point in table["point"]])
    order = {"kind": "stable", "key": lambda texts: texts.map(conditions.index)}
    return table.sort_values("condition", ignore_index=True, **order)


def parts(results: Results) -> pd.DataFrame:
    """The mean parts of the cost of every setting.

    Returns:
        A row per policy and design point: ``policy``, ``point``, ``purchase``, ``charging``,
        ``hours``, ``losses``, and ``cost``, their sum; ``stranded``, the mean number of UAVs of a
        mission that cannot fly home, beyond those that ``losses`` pays for.

    Raises:
        InputError: If the study has no prices.
    """
    prices, missions, uavs = _prices(results), results.missions, results.uavs
    amounts = prices.parts(results.store.manifest.scenarios, missions, uavs)
    table = missions[["policy", "point", COST]].assign(**amounts)
    means = table.groupby(["policy", "point"], sort=False, as_index=False)[[*PARTS, COST]].mean()
    is_recorded = "down" in uavs and uavs["down"].notna().all()  # results of before are not
    count = stranded(uavs) if is_recorded else np.nan
    number = uavs[["policy", "point"]].assign(stranded=count)
    sums = number.groupby(["policy", "point"], sort=False)["stranded"].sum(min_count=1)
    per_setting = missions.groupby(["policy", "point"], sort=False).size()
    return means.join((sums / per_setting).rename("stranded"), on=["policy", "point"])


@once
def front(results: Results, metric: str = SUCCESS) -> pd.DataFrame:
    """The Pareto front of cost and a metric: the settings that no other one dominates.

    Args:
        results: The study.
        metric: A metric of the paper, or a required one.

    Returns:
        The rows of ``priced`` with two more columns. ``on_front`` tells whether the setting is on
        the front of the estimates, under its condition. ``probability`` is the probability that it
        is on the front of the true means (``stats.verdict.membership``).

    Raises:
        InputError: If the study has no prices, or there is no such metric.
    """
    if metric not in {**METRICS, **required(results)}:
        raise InputError(f"metric: {metric!r} is unknown{one_of(metric, METRICS)}")
    sign = -1 if metric_of(metric).less_is_better else 1
    generator = np.random.default_rng(results.store.manifest.seed)
    tables = []
    for _, rows in priced(results).groupby("condition", sort=False):
        costs, values = (_samples(results, rows, name) for name in (COST, metric))
        estimates = on_front(rows[COST].to_numpy(), sign * rows[metric].to_numpy())
        share = membership(costs, sign * values, metric == SUCCESS, generator)
        tables.append(rows.assign(on_front=estimates, probability=share))
    return pd.concat(tables, ignore_index=True)


@once
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


@once
def quoted(results: Results) -> pd.DataFrame:
    """The settings with the estimates that answers quote.

    A search gives most missions to a setting whose results were good so far. The check had no part
    in the search, so its means are unbiased.

    Returns:
        The rows of ``judged``. The metrics, the cost and ``n`` of settings that were checked are
        those of ``checks``.
    """
    table, setting = judged(results), ["policy", "point"]
    if results.checks.empty:
        return table
    rows, checked = table.set_index(setting), checks(results).set_index(setting)
    rows.loc[checked.index, checked.columns] = checked
    return rows.reset_index()[[*table]]


def everywhere(results: Results, table: pd.DataFrame) -> pd.DataFrame:
    """The fleets under all conditions together; empty if there is only one condition.

    Args:
        results: The study.
        table: The result of ``judged``, or of ``quoted``.

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


def sentences(results: Results) -> list[str]:
    """In words: the cheapest setting of all policies, then that of each policy and condition."""
    lines = answers(results, quoted(results))
    return lines if len(results.policies) == 1 else [answer(results), *lines]


def answers(results: Results, table: pd.DataFrame, policies: int = 1) -> list[str]:
    """In words: the cheapest setting for each policy and condition, and why no cheaper one.

    Args:
        results: The study.
        table: The result of ``quoted``, or of ``judged``.
        policies: Of how many policies the answer is the cheapest, for its confidence.
    """
    currency, wanted = _prices(results).currency, required(results)
    together = everywhere(results, table).assign(condition=f"{EVERYWHERE} together")
    sentences, conditions = [], [*dict.fromkeys(_conditions(results))]
    for rows, needed in ((table, wanted), (together, {})):
        for (condition, policy), part in rows.groupby(["condition", "policy"], sort=False):
            where = f"{condition}, `{policy}`" if condition else f"`{policy}`"
            choice = _choice(results, str(policy))
            found = choice.answers[conditions.index(condition) if needed else -1]
            trust = _trust(results, choice, found, policies)
            text = _answer(part, needed, currency, trust)
            sentences.append(f"{where[:1].upper()}{where[1:]}: {text}")
    return sentences


def answer(results: Results) -> str:
    """In words: the cheapest setting of all policies, and what the others would have said.

    If there are several conditions, it is the setting for all of them together.
    """
    table, best, count = quoted(results), best_policy(results), len(results.policies)
    return " ".join(
        [answers(results, table[table["policy"] == best], count)[-1], *dependence(results)]
    )


@once
def best_policy(results: Results) -> str:
    """The policy whose fleet is the cheapest that meets the requirements under every condition."""
    costs = priced(results).set_index(["policy", "point"])[COST]

    def cost(policy: str) -> float:
        points = _choice(results, policy).answers[-1].points
        return float(np.mean([costs[policy, point] for point in points])) if points else np.inf

    return min(results.policies, key=cost)


def dependence(results: Results) -> list[str]:
    """A sentence for each other policy: what its cheapest fleet is, so how much depends on it."""
    fleets = selections(results).groupby("policy", sort=False)["setting"].last()
    best = best_policy(results)
    return [
        f"`{policy}` gives the same answer."
        if fleets[policy] == fleets[best]
        else f"With `{policy}`, it would be **{fleets[policy]}**."
        for policy in results.policies
        if policy != best
    ]


def cheapest_fleet(results: Results) -> str:
    """The cheapest fleet of all policies that meets the requirements under every condition."""
    found = selections(results)
    return str(found[found["policy"] == best_policy(results)]["setting"].iloc[-1])


@once
def selections(results: Results) -> pd.DataFrame:
    """What was selected by a study that searches for the cheapest settings.

    Returns:
        A row per policy and condition and, if there are several conditions, one for all of them:
        ``policy``, ``condition`` in words, ``point`` (None if no setting is selected, or for all
        conditions), ``setting`` (the fleet in words), ``missions`` of the policy, ``left`` (number
        of settings that may be as good), ``guaranteed`` and ``guarantee``.
    """
    conditions, words = [*dict.fromkeys(_conditions(results)), EVERYWHERE], fleets(results)
    rows = []
    for policy in results.policies:
        choice = _choice(results, policy)
        for condition, answer in zip(conditions, choice.answers, strict=False):
            fleet = words[answer.points[0]] if answer.points else "none"
            point = answer.points[0] if answer.points and answer.condition is not None else None
            found = (policy, condition, point, fleet, choice.missions, len(answer.left))
            rows.append((*found, answer.settled, choice.guarantee))
    columns = ["policy", "condition", "point", "setting", "missions", "left", "guaranteed"]
    return pd.DataFrame(rows, columns=[*columns, "guarantee"]).astype({"point": "Int64"})


def _answer(rows: pd.DataFrame, wanted: Mapping[Any, float], currency: str, trust: str) -> str:
    """The answer for one policy under one condition.

    Args:
        rows: The rows of ``quoted`` or ``everywhere``, the cheapest first.
        wanted: The requirements, for what the rows have of their metrics.
        currency: The currency of the costs.
        trust: What else is to be said about the answer.
    """
    best = rows[rows["selected"]]
    if len(best):
        found = _told(best.iloc[0], wanted, currency)
        cheaper = rows[rows[COST] < best[COST].iloc[0]].tail(1)
        text = f"the cheapest setting that meets the requirements is {found}."
        which = "next cheaper"
    else:
        leads = pd.DataFrame({m: lead(rows[m], m, least) for m, least in wanted.items()})
        cheaper = rows.loc[leads.min(axis=1).nlargest(1).index]
        text, which = "no setting is known to meet the requirements.", "closest"
    text += trust
    for _, row in cheaper.iterrows():
        text += f" The {which} one, {_told(row, wanted, currency)}, {_WHY_NOT[row['verdict']]}."
    return text


def _trust(results: Results, choice: CheapestChoice, answer: Answer, policies: int) -> str:
    """What is guaranteed about an answer, what would settle it, and at which ends it lies."""
    rule, text = results.study.selection, ""
    assert isinstance(rule, Cheapest)
    if answer.points:
        horizon = results.store.manifest.settings[answer.points[0]].horizon
        least = [
            f"{of.within} of at most {of.amount(q + rule.tolerance * horizon)}"
            if of.less_is_better
            else f"{of.within} of at least {of.amount(q - rule.tolerance)}"
            for of, q in ((metric_of(metric), q) for metric, q in required(results).items())
        ]
        where = " under every condition" * (answer.condition is None)
        sure = numbers.level(rule.shown(policies))
        text = f" It has a {numbers.words(least)}{where}, shown at {sure}."
        point = answer.points[0]
        text += edge(results, point, _ends(results, point), "a cheaper one")
    if choice.done and not answer.settled:
        enough = f"about {float(f'{choice.enough:.2g}'):,.0f}" if choice.enough else "far more"
        text += (
            f" The budget of {rule.budget:,} missions ended before this was decided; {enough} "
            "would settle it."
        )
    return text


def _ends(results: Results, point: int) -> dict[str, str]:
    """The ends of the swept values at which a fleet lies and beyond which one may be cheaper.

    With more UAVs or pads a fleet is cheaper only if that saves enough of the others.
    """
    table, space, prices = points(results), results.scenario(point), _prices(results)
    of = {"uavs": prices.uav, "pads": prices.pad, ZONE_PADS: prices.pad * len(space.zones)}
    of = {field: price for field, price in of.items() if field in table}
    spent = {
        f: price * (table[f][point] - 1) for f, price in of.items() if is_numeric_dtype(table[f])
    }
    return {
        field: end
        for field, end in ends(results, point).items()
        if field in DECISIONS
        and (end == "least" or not of.get(field) or sum(spent.values()) - spent[field] > of[field])
    }


def _told(row: pd.Series, wanted: Mapping[Any, float], currency: str) -> str:
    """A setting, its cost, and its metrics with the requirements, in words."""
    metrics = [
        f"{of.within} {of.written(*row[[of.column, f'{of.column}_low', f'{of.column}_high']])} "
        f"({of.amount(least)} required)"
        for of, least in ((metric_of(metric), least) for metric, least in wanted.items())
    ]
    text = f"**{row['fleet']}** for {numbers.money(row[COST], currency)}"
    return f"{text} with {numbers.words(metrics)}, n = {row['n']:,}" if metrics else text


def _prices(results: Results) -> Costs:
    prices = results.study.costs
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


@once
def fleets(results: Results) -> list[str]:
    """The fleet of every design point in words: all that has a price or varies."""
    prices, table, fleets = _prices(results), points(results), []
    for point, others in enumerate(_words(results, True)):
        space, words = results.scenario(point), []
        if prices.uav or prices.lost_uav or "uavs" in table:
            low, high = space.uavs
            words.append(parameter("uavs").words(low if low == high else [low, high]))
        if prices.pad or {"pads", ZONE_PADS} & {*table}:
            for zone, pads in enumerate(space.zone_pads, 1):
                words.append(parameter("pads").words(pads) + f" in zone {zone}" * (zone > 1))
        fleets.append(numbers.words([*words, *others]) or "the fleet of the scenario")
    return fleets


@once
def _conditions(results: Results) -> list[str]:
    """The condition of every design point in words."""
    return [", ".join(row) for row in _words(results, False)]


def _words(results: Results, decisions: bool) -> list[list[str]]:
    """The fields of every design point that are decided on, or the rest; none of ``COUNTED``."""
    table = points(results)
    shown = [f for f in table if (f in DECISIONS) == decisions and f not in COUNTED]
    return words_of(table[shown])


CERTAIN = 0.01  # settings with a lower probability of being on a front are not in the table


def required(results: Results) -> Mapping[str, float]:
    """The requirements of a study that selects the cheapest setting; empty for any other one.

    Returns:
        For each column of the missions its least mean, or the largest if less is better.
    """
    rule = results.study.selection
    if not isinstance(rule, Cheapest):
        return {}
    return {told(m, results.missions): rule.amount(m) for m in rule.requirements}


def lead(values: Any, metric: str, required: float) -> Any:
    """By how much values are better than required, as a share of it if less is better."""
    return 1 - values / required if metric_of(metric).less_is_better else values - required


def fronts_of(results: Results) -> dict[str, pd.DataFrame]:
    """The fronts of the required metrics, or of success and the product."""
    metrics = [*required(results)] or [SUCCESS, PRODUCT]
    return {metric: front(results, metric) for metric in metrics}


def cells(rows: pd.DataFrame, metrics: Iterable[str]) -> pd.DataFrame:
    """Rows of ``priced`` as text: condition, fleet, policy, cost and metrics of settings."""
    columns = {"Condition": rows["condition"]} if rows["condition"].any() else {}
    columns |= {"Fleet": rows["fleet"], "Policy": rows["policy"]}
    for of in map(metric_of, (COST, *metrics)):
        columns[of.name] = numbers.estimates(rows, of.column, of.written)
    return pd.DataFrame(columns)


def front_table(results: Results) -> Table:
    """The settings that may be on one of the fronts, with the probabilities."""
    fronts = fronts_of(results)
    first = next(iter(fronts.values()))
    shares = pd.DataFrame({metric: front["probability"] for metric, front in fronts.items()})
    top = first[(shares >= CERTAIN).any(axis=1)].head(MOST_ROWS)
    shown = cells(top, fronts)
    for metric in fronts:
        head = f"On the front of {metric_of(metric).within}"
        shown[head] = shares.loc[top.index, metric].map(numbers.percent)
    caption = (
        f"Settings that may be on a front: mean cost [{_prices(results).currency}] and metrics "
        f"with {intervals_in_words(results)}, and the probability that they are on it"
    )
    data = first.drop(columns=["on_front", "probability"])
    return Table(shown, caption, data.join(shares.add_prefix("on_front_of_")))


def parts_table(results: Results) -> Table:
    """The parts of the settings' costs."""
    rows = priced(results).merge(parts(results).drop(columns=COST), on=["policy", "point"])
    top = rows.head(MOST_ROWS)
    shown = cells(top, [])
    for part in PARTS:
        shown[part.capitalize()] = top[part].map("{:,.0f}".format)
    caption = f"The mean cost of the settings [{_prices(results).currency}], and its parts"
    return Table(shown, caption, rows)


def judged_table(results: Results) -> Table:
    """The settings and whether they meet the requirements."""
    rows = judged(results)
    top = rows.head(MOST_ROWS)
    shown = cells(top, required(results))
    shown["Requirements"] = top["verdict"].map(VERDICTS)
    shown["Selected"] = top["selected"].map({True: "yes", False: ""})
    shown["Missions"] = counts(top["n"])
    caption = f"The settings, the cheapest first; means with {intervals_in_words(results)}"
    return Table(shown, caption, rows)


def checked_table(results: Results) -> Table:
    """The check of the selected settings on independent missions."""
    rows = checks(results)
    shown = cells(rows, METRICS).assign(Missions=counts(rows["n"]))
    return Table(shown, CHECKED, rows)
