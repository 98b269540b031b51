"""The answer to a what-if question: what the variation changes, mission by mission.

results = ask(question({"uavs": 5}), folder)   # of questions.what_if
table = answers(results)                       # a row per policy and metric
verdict(table.iloc[0])                         # 'above': the variation has more
"""

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from analysis import numbers
from analysis.names import METRICS, PRODUCT, RATIO, SUCCESS, measured_in, metric_label
from analysis.questions import summary
from analysis.questions.missions import estimate
from analysis.questions.settings import value_in_words
from analysis.questions.what_if.question import BASELINE, SIDES, VARIATION, fields, settings_of
from analysis.results.tables import Results
from analysis.stats.intervals import LEVEL, by_replication
from analysis.stats.paired import compare
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE, MARKS, position

# Further quantities per mission, in addition to the paper's metrics.
MEASURES = {
    "slots": "Mission slots",
    "collected": "Data collected",
    "collected_per_uav": "Data collected per UAV",
    "residual": "Data left",
    "charging_per_uav": "Slots charging per UAV",
    "waiting_per_uav": "Slots waiting per UAV",
    "depleted": "Depleted batteries in 100 missions",
}

# Power, for ``missions_needed``: the probability that a difference of this size is significant.
POWER = 0.8

# What is 0 where nothing can fail and no buffer is limited, which is not measured then.
_NOTHING = ("failures", "slots_grounded", "lost")

_SHORT = {SUCCESS: "Success", RATIO: "Collection ratio", PRODUCT: "Their product"}
_MISSION = ["policy", "point", "replication"]


def missions_of(results: Results) -> pd.DataFrame:
    """``results.missions`` with all of ``MEASURES``; nothing failed where nothing can fail."""
    uavs = results.uavs.assign(depleted=100 * (results.uavs["end"] == "battery"))
    sums = uavs.groupby(_MISSION)[["slots_charging", "slots_waiting", "depleted"]].sum()
    missions = results.missions.join(sums, on=_MISSION)
    fillable = [name for name in _NOTHING if name in measured(results)]
    return missions.fillna(dict.fromkeys(fillable, 0.0)).assign(
        collected_per_uav=missions["collected"] / missions["uavs"],
        charging_per_uav=missions["slots_charging"] / missions["uavs"],
        waiting_per_uav=missions["slots_waiting"] / missions["uavs"],
    )


def measured(results: Results) -> list[str]:
    """What scenarios beyond the paper measure, on at least one of both sides."""
    missions = results.missions
    return [name for name in measured_in(missions) if missions[name].notna().any()]


def means(results: Results) -> pd.DataFrame:
    """Means with intervals: rows of ``analysis.summary`` by ``policy`` and ``point``."""
    table = summary.means(replace(results, missions=missions_of(results)))
    return table[table["metric"].isin([*METRICS, *measured(results)])].reset_index(drop=True)


def answers(results: Results) -> pd.DataFrame:
    """The variation compared with the baseline, mission by mission.

    Returns:
        A row per policy and metric (those of ``METRICS``, what is ``measured``, then those of
        ``MEASURES``): ``policy``, the means ``before`` and ``after``, and the columns of
        ``analysis.compare``. Every interval has its own level of 95 %; see
        ``stats.paired.paired``. Of what only one side measures, ``n`` is 0 and all else nan but the
        mean of this side.
    """
    missions = missions_of(results)
    metrics = [*METRICS, *measured(results), *MEASURES]
    tables = []
    for policy, rows in missions.groupby("policy", sort=False):
        table = compare(rows, BASELINE, metrics, correction=None, of="point")
        table = table.set_index("metric").reindex(metrics).rename_axis("metric").reset_index()
        table["n"] = table["n"].fillna(0).astype(int)
        sides = pd.DataFrame({m: by_replication(rows, m, "point").mean() for m in metrics})
        table.insert(0, "policy", policy)
        table["before"] = table["metric"].map(sides.loc[BASELINE])
        table["after"] = table["metric"].map(sides.loc[VARIATION])
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def verdict(answer: Any) -> str:
    """Whether the variation is significantly ``ABOVE`` or ``BELOW`` the baseline.

    The complete interval has to be above or below 0. If it has no length, it tells nothing about
    the variance, so the sign test must be significant as well.

    Args:
        answer: A row of ``answers``.
    """
    known = answer.low < answer.high or answer.p <= 1 - LEVEL
    return position(answer) if known else INCONCLUSIVE


def missions_needed(answer: Any) -> float:
    """The number of missions that would show a difference of the observed size.

    It is computed by the normal approximation from the observed difference and variance, which are
    estimates themselves.

    Returns:
        The number with which the interval excludes 0 with probability ``POWER``; infinite if there
        is no difference, or its variance is unknown.
    """
    if not answer.difference or not answer.low < answer.high:
        return np.inf
    quantile = stats.norm.isf((1 - LEVEL) / 2)
    half = (answer.high - answer.low) / 2 / abs(answer.difference)
    return float(np.ceil(answer.n * (half * (1 + stats.norm.ppf(POWER) / quantile)) ** 2))


def differences(results: Results, policy: str) -> pd.Series:
    """Variation - baseline in product of a policy, by replication."""
    missions = results.missions[results.missions["policy"] == policy]
    sides = missions.pivot(index="replication", columns="point", values=PRODUCT)
    return sides[VARIATION] - sides[BASELINE]


def all_differences(results: Results) -> dict[str, pd.Series]:
    """The ``differences`` of every policy."""
    return {policy: differences(results, policy) for policy in results.policies}


def best_policy(results: Results, point: int) -> str:
    """The policy with the highest mean product on one side."""
    missions = results.missions
    return summary.best_policy(missions[missions["point"] == point])


def typical(results: Results, policy: str) -> int:
    """The replication whose difference in product is the median.

    With an even number it is the lower one of the two in the middle; among equal ones, the first.
    """
    ordered = differences(results, policy).sort_values(kind="stable")
    middle = ordered.iloc[(len(ordered) - 1) // 2]
    return int(ordered.index[ordered == middle][0])


def worst(results: Results, policy: str) -> int:
    """The replication with the lowest product in the variation.

    Among equal ones it is the one with the lowest collection ratio, then the first.
    """
    missions = results.missions.query("policy == @policy and point == @VARIATION")
    ordered = missions.sort_values([PRODUCT, RATIO], kind="stable")
    return int(ordered["replication"].iloc[0])


def sentence(results: Results, table: pd.DataFrame) -> str:
    """What the variation changes, in a sentence.

    Args:
        results: The results of the question.
        table: The ``answers``.
    """
    sides = fields(results, results.store.manifest.points[VARIATION].values).itertuples()
    new = [f"{value_in_words(s.Field, s.Variation)} instead of {s.Baseline}" for s in sides]
    parts = [
        f"that of {row.policy} by {change(row)} points"
        + " (inconclusive)" * (verdict(row) == INCONCLUSIVE)
        for row in table[table["metric"] == PRODUCT].itertuples()
    ]
    n = numbers.span(table["n"])
    return f"With {numbers.words(new)}, the product changes: {numbers.words(parts)}; n = {n} pairs."


def conclusions(table: pd.DataFrame) -> str:
    """What ``answers`` say about product: a list, an item per policy."""
    words = {
        ABOVE: "is **higher** in the variation",
        BELOW: "is **lower** in the variation",
        INCONCLUSIVE: "is **inconclusive**",
    }
    return "\n".join(
        f"- **{row.policy}**: product {words[verdict(row)]}, by "
        f"{change(row)} points: from {numbers.percent(row.before)} to "
        f"{numbers.percent(row.after)}.{_missing(row) if verdict(row) == INCONCLUSIVE else ''}"
        for row in table[table["metric"] == PRODUCT].itertuples()
    )


def _missing(answer: Any) -> str:
    """How many missions would be needed for a conclusive answer, in words."""
    needed = missions_needed(answer)
    if needed == np.inf:
        return " These missions do not tell how many would show a difference."
    return (
        " If the true difference is as large as this estimate, about "
        f"{float(f'{needed:.2g}'):,.0f} missions (instead of {answer.n:,}) show it with a "
        f"probability of {100 * POWER:g} %. Only the additional missions would be simulated."
    )


def best_of_side(results: Results, point: int) -> str:
    """The best policy of one side with its mean, as ``greedy, 95.3 % [94.5, 96.1]``."""
    policy = best_policy(results, point)
    return f"{policy}, {numbers.estimate(estimate(results, policy, point=point))}"


def winners(changes: Mapping[str, pd.Series]) -> str:
    """In words: the shares of the missions in which each policy is better or worse.

    Args:
        changes: For each policy the result of ``differences``.
    """
    shares = {policy: [(gaps > 0).mean(), (gaps < 0).mean()] for policy, gaps in changes.items()}
    return "; ".join(
        f"{policy} is better in {numbers.percent(more)} and worse in {numbers.percent(less)}"
        for policy, (more, less) in shares.items()
    )


def listed(table: pd.DataFrame, policy: str) -> pd.DataFrame:
    """The rows of ``answers`` of a policy, as a table to print."""
    lines = []
    for row in table[table["policy"] == policy].itertuples():
        write, unit = (numbers.percent, " points") if row.metric in METRICS else (_amount, "")
        sides = ["–" if np.isnan(mean) else write(mean) for mean in (row.before, row.after)]
        name = (_SHORT | MEASURES).get(row.metric) or metric_label(row.metric)
        difference = f"{MARKS[verdict(row)]} {change(row)}{unit}" if row.n else ""
        lines.append([name, *sides, difference])
    heads = ["Mean per mission", "Baseline", "Variation", "Paired difference"]
    return pd.DataFrame(lines, columns=heads)


def pairing(table: pd.DataFrame) -> pd.DataFrame:
    """How much common random numbers narrow the intervals of ``answers``, as a table to print."""
    lines = []
    for row in table[table["metric"].isin([*METRICS])].itertuples():
        left = 1 - row.variance_reduction
        narrower = numbers.percent(1 - left**0.5) if left < 1 else "none"
        worth = f"{row.n / left:,.0f}" if left else "any number"
        amounts = (numbers.minus(f"{row.correlation:.2f}"), numbers.percent(left), narrower, worth)
        lines.append((row.policy, _SHORT[row.metric], *amounts))
    heads = ["Policy", "Metric", "Correlation", "Variance left", "Narrower by", "Worth"]
    return pd.DataFrame(lines, columns=heads)


def outcome(results: Results, policy: str, point: int, replication: int) -> str:
    """The outcome of a mission, in a sentence."""
    where = "policy == @policy and point == @point and replication == @replication"
    (mission,) = results.missions.query(where).itertuples()
    ends = results.uavs.query(where)["end"]
    fates = {"battery": "deplete their battery", "truncated": "run out of time"}
    failures = [
        f"{(ends == end).sum()} of {len(ends)} UAVs {fate}"
        for end, fate in fates.items()
        if (ends == end).any()
    ]
    fate = f"but {numbers.words(failures)}: it counts 0" if failures else "all quotas filled"
    return (
        f"{SIDES[point].capitalize()} ({', '.join(settings_of(results)[point])}): collection ratio "
        f"{numbers.percent(mission.collection_ratio)}, {fate}. {mission.slots} mission slots."
    )


def effect(results: Results, policy: str, replication: int) -> str:
    """By how much the variation changes a mission, in a sentence."""
    gap = numbers.difference(differences(results, policy)[replication], 0)
    return (
        f"Replication {replication} with **{policy}**: the variation changes the product "
        f"by {gap} points."
    )


def commands(results: Results, policy: str, replication: int) -> list[str]:
    """The commands that simulate a replication again, in the baseline and in the variation."""
    points = (BASELINE, VARIATION)
    return [
        line
        for point, side in zip(points, SIDES, strict=True)
        for line in (f"# {side}", results.command(policy, point, replication))
    ]


def change(answer: Any) -> str:
    """The paired difference of a row of ``answers`` with its interval, as text.

    It is in percentage points for the paper's metrics; small numbers have more digits.
    """
    ends = (answer.difference, answer.low, answer.high)
    if answer.metric not in METRICS:
        return _amount(*ends, sign="+")
    if 0 < answer.high - answer.low < 0.01:
        return _amount(*(100 * end for end in ends), sign="+")
    return numbers.points(*ends)


def _amount(value: float, *ends: float, sign: str = "") -> str:
    """A number with two decimals, or more if it is small, and its interval if it has a length."""
    digits = 2 if abs(value) >= 0.1 or not value else 4
    rounded = [round(number, digits) or 0.0 for number in (value, *ends)]  # no -0.00
    texts = [numbers.minus(f"{number:{sign if number else ''}.{digits}f}") for number in rounded]
    return f"{texts[0]} [{', '.join(texts[1:])}]" if len({*ends}) > 1 else texts[0]
