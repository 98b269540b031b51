"""The costs of the settings of a study, and the cheapest setting that meets requirements.

    results = load_results("results/fleets")  # of a study with a table [costs]
    front(results, "success")  # cost and success, with the probability of being on the front
    judged(results, {"success": 0.99})  # which settings meet that, and the cheapest of them

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
from analysis.names import COST, DECISIONS, METRICS, SUCCESS, parameter, value_text
from analysis.questions.settings import points, ranked
from analysis.results.tables import Results
from analysis.stats.front import membership, on_front
from analysis.study.cheapest import Cheapest
from analysis.study.costs import PARTS, Costs
from dess.errors import InputError, one_of

MET, MISSED, OPEN = "met", "missed", "open"
VERDICTS = {MET: "shown", OPEN: "not shown", MISSED: "refuted"}  # the words used in tables
_UNITS = {"uavs": "UAV", "pads": "pad"}  # fields that are counts


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
    words = {name: _words(results, name == "fleet") for name in ("condition", "fleet")}
    for place, (name, texts) in enumerate(words.items()):
        table.insert(place, name, [texts[point] for point in table["point"]])
    order = {text: number for number, text in enumerate(dict.fromkeys(words["condition"]))}
    return table.sort_values("condition", key=lambda c: c.map(order), kind="stable").reset_index(
        drop=True
    )


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
    means = table.groupby(["policy", "point"], sort=False)[[*PARTS, COST]].mean()
    return means.reset_index()


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


def judged(results: Results, requirements: Mapping[str, float] | None = None) -> pd.DataFrame:
    """Which settings meet requirements, and the cheapest of these under each condition.

    Args:
        results: The study.
        requirements: For each required metric its lowest acceptable mean, between 0 and 1. By
            default those of the study's selection.

    Returns:
        The rows of ``priced`` with two more columns: ``verdict`` (``met``, ``missed`` or ``open``),
        and ``selected``, which is true for the cheapest setting of each policy under each condition
        whose verdict is ``met``. Both are those of the study's selection, with its guarantee. For
        other requirements they follow from the 95 % intervals: met if all intervals are completely
        above the requirements, missed if one is completely below.

    Raises:
        InputError: If the study has no prices, or the requirements are missing or not allowed.
    """
    rule, table = results.store.manifest.selection, priced(results)
    if isinstance(rule, Cheapest) and requirements in (None, rule.requirements):
        choices = {policy: results.cheapest(policy) for policy in results.policies}
        verdicts, selected = [], []
        for policy, point in zip(table["policy"], table["point"], strict=True):
            choice = choices[policy]
            assert choice is not None
            verdicts.append(choice.verdicts[point])
            at_conditions = [a.points for a in choice.answers if a.condition is not None]
            selected.append((point,) in at_conditions)
        return table.assign(verdict=verdicts, selected=selected)
    wanted = _checked(requirements)
    above = [table[f"{metric}_low"] >= least for metric, least in wanted.items()]
    below = [table[f"{metric}_high"] < least for metric, least in wanted.items()]
    met, missed = np.logical_and.reduce(above), np.logical_or.reduce(below)
    table = table.assign(verdict=np.select([met, missed], [MET, MISSED], OPEN))
    best = table[met].drop_duplicates(["condition", "policy"]).index
    return table.assign(selected=table.index.isin(best))


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
            verdicts = {*part["verdict"]}
            verdict = next(v for v in (MISSED, OPEN, MET) if v in verdicts)
            rows.append((policy, fleet, part[COST].mean(), verdict, {*part["point"]}))
    fleets = pd.DataFrame(rows, columns=["policy", "fleet", COST, "verdict", "points"])
    fleets = fleets.sort_values(COST, kind="stable", ignore_index=True)
    choices = {policy: results.cheapest(policy) for policy in fleets["policy"].unique()}
    if any(choices.values()):
        last = {name: {*choice.answers[-1].points} for name, choice in choices.items() if choice}
        selected = [row.points == last[str(row.policy)] for row in fleets.itertuples()]
    else:
        best = fleets[fleets["verdict"] == MET].drop_duplicates("policy").index
        selected = fleets.index.isin(best).tolist()
    return fleets.drop(columns="points").assign(selected=selected)


def answers(
    results: Results, table: pd.DataFrame, requirements: Mapping[str, float] | None = None
) -> list[str]:
    """In words: the cheapest setting for each policy and condition, and why no cheaper one.

    Args:
        results: The study.
        table: The result of ``judged``.
        requirements: As for ``judged``.
    """
    rule, currency = results.store.manifest.selection, _prices(results).currency
    given = requirements or (rule.requirements if isinstance(rule, Cheapest) else {})
    wanted, sentences = {str(metric): least for metric, least in given.items()}, []
    for (condition, policy), rows in table.groupby(["condition", "policy"], sort=False):
        where = f"{condition}, `{policy}`" if condition else f"`{policy}`"
        sentences.append(f"{_capital(where)}: {_answer(rows, wanted, currency)}")
    for policy, fleets in everywhere(results, table).groupby("policy", sort=False):
        text = _answer_everywhere(fleets, table[table["policy"] == policy], currency)
        sentences.append(f"All conditions together, `{policy}`: {text}")
    return sentences


def selections(results: Results) -> pd.DataFrame:
    """What was selected by a study that searches for the cheapest settings.

    Returns:
        A row per policy and condition and, if there are several conditions, one for all of them:
        ``policy``, ``condition`` in words, ``point`` (None if no setting is selected, or for all
        conditions), ``setting`` (the fleet in words), ``missions`` of the policy, ``left`` (number
        of settings that may be as good), ``guaranteed`` and ``guarantee``.
    """
    conditions, fleets = (_words(results, decisions) for decisions in (False, True))
    rows = []
    for policy in results.policies:
        if choice := results.cheapest(policy):
            texts = iter(dict.fromkeys(conditions))
            for answer in choice.answers:
                fleet = fleets[answer.points[0]] if answer.points else "none"
                is_one = answer.condition is not None
                condition = next(texts) if is_one else "all conditions"
                point = answer.points[0] if answer.points and is_one else None
                found = (policy, condition, point, fleet, choice.missions, len(answer.left))
                rows.append((*found, answer.settled, choice.guarantee))
    columns = ["policy", "condition", "point", "setting", "missions", "left", "guaranteed"]
    return pd.DataFrame(rows, columns=[*columns, "guarantee"]).astype({"point": "Int64"})


def _answer(rows: pd.DataFrame, wanted: Mapping[str, float], currency: str) -> str:
    """The answer for one policy under one condition, from its rows of ``judged``."""
    best = rows[rows["selected"]]
    cheaper = rows[rows[COST] < best[COST].iloc[0]] if len(best) else rows
    texts = []
    if len(best):
        row = best.iloc[0]
        texts.append(f"the cheapest setting that meets the requirements is {_what(row, currency)}.")
        texts.append(f"It has {_metrics(row, wanted)}.")
        if cheaper.empty:
            texts.append("No setting of the study is cheaper.")
    else:
        is_open = (rows["verdict"] == OPEN).any()
        found = "is known to meet" if is_open else "meets"
        texts.append(f"no setting {found} the requirements.")
    if len(cheaper):
        leads = np.min([rows[metric] - least for metric, least in wanted.items()], axis=0)
        row = cheaper.iloc[-1 if len(best) else int(np.argmax(leads))]
        which = "next cheaper" if len(best) else "closest"
        texts.append(f"The {which} one, {_what(row, currency)}, {_why_not(row, wanted)}.")
    return " ".join(texts)


def _answer_everywhere(fleets: pd.DataFrame, rows: pd.DataFrame, currency: str) -> str:
    """The answer for one policy over all conditions.

    Args:
        fleets: The rows of ``everywhere`` for the policy.
        rows: The rows of ``judged`` for the policy.
        currency: The currency of the costs.
    """
    best = fleets[fleets["selected"]]
    if best.empty:
        return "no fleet is known to meet the requirements under each of them."
    text = f"the cheapest fleet that meets the requirements is {_what(best.iloc[0], currency)}, "
    text += "the mean cost over the conditions."
    cheaper = fleets[fleets[COST] < best[COST].iloc[0]]
    if cheaper.empty:
        return f"{text} No fleet of the study is cheaper."
    row = cheaper.iloc[-1]
    text += f" The next cheaper one, {_what(row, currency)}, "
    if row["verdict"] == MET:
        return f"{text}saves less than the indifference."
    failed = rows[(rows["fleet"] == row["fleet"]) & (rows["verdict"] == row["verdict"])]
    does = "misses them" if row["verdict"] == MISSED else "is not known to meet them"
    return f"{text}{does} under {numbers.words([*failed['condition']])}."


def _what(row: pd.Series, currency: str) -> str:
    """``**3 UAVs and 1 pad** for 69,000 EUR``."""
    return f"**{row['fleet']}** for {numbers.money(row[COST], currency)}"


def _metrics(row: pd.Series, wanted: Mapping[str, float]) -> str:
    """The metrics of a setting with the requirements, in words."""
    return numbers.words(
        [f"{_name(m)} {_interval(row, m)} ({numbers.level(q)} required)" for m, q in wanted.items()]
    )


def _why_not(row: pd.Series, wanted: Mapping[str, float]) -> str:
    """Why a cheaper setting is not selected, in words."""
    if row["verdict"] == MET:
        return "meets the requirements as well, and saves less than the indifference"
    short = {m: q for m, q in wanted.items() if row[f"{m}_low"] < q}
    if row["verdict"] == MISSED:
        short = {m: q for m, q in short.items() if row[m] < q} or short
        words = "misses the requirements"
    else:
        words = "is not known to meet the requirements"
    return f"{words}: it has {_metrics(row, short or wanted)}"


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def _interval(row: pd.Series, metric: str) -> str:
    return numbers.interval(row[metric], row[f"{metric}_low"], row[f"{metric}_high"])


def _name(metric: str) -> str:
    return "success" if metric == SUCCESS else METRICS[metric].lower()


def _prices(results: Results) -> Costs:
    prices = results.store.manifest.costs
    if prices is None:
        raise InputError(
            f"{results.store.folder}: the study has no prices; allowed: one with a table [costs]"
        )
    return prices


def _checked(requirements: Mapping[str, float] | None) -> Mapping[str, float]:
    if not requirements:
        raise InputError("requirements: none are given; allowed: metric -> least mean")
    for metric, least in requirements.items():
        if metric not in METRICS:
            raise InputError(f"requirements: {metric!r} is unknown{one_of(metric, METRICS)}")
        if not 0 < least < 1:
            raise InputError(f"requirements: {metric}: {least}; allowed: between 0 and 1")
    return requirements


def _samples(results: Results, rows: pd.DataFrame, name: str) -> np.ndarray:
    """The (k, n) values of the settings of k rows; nan where a setting lacks a replication."""
    missions = results.missions[results.missions["point"].isin(rows["point"])]
    wide = missions.pivot(index="replication", columns=["policy", "point"], values=name)
    keys = pd.MultiIndex.from_frame(rows[["policy", "point"]])
    return wide.reindex(columns=keys).to_numpy(float).T


def _words(results: Results, decisions: bool) -> list[str]:
    """The fleet of every design point in words, or its condition."""
    table = points(results)
    fields = [field for field in table if (field in DECISIONS) == decisions]
    rows = [[_value(str(f), row[f]) for f in fields] for row in table.to_dict("records")]
    if decisions:
        return [numbers.words(row) if row else "the fleet of the scenario" for row in rows]
    return [", ".join(row) for row in rows]


def _value(field: str, value: Any) -> str:
    """``3 UAVs``, or ``arrival rate 0.02``."""
    text = value_text(value)
    if unit := _UNITS.get(field):
        return f"{text} {unit}{'' if text == '1' else 's'}"
    return f"{parameter(field).within} {text}"
