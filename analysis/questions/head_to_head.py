"""Two policies in the same missions: mean differences, and the missions with the worst results.

The functions are for studies with one design point whose missions draw their parameters. Both
policies meet the same random draws, so they are compared mission by mission:

    pair = pair_of(results)           # the best learned policy and the best baseline
    missions = duels(results, pair)   # a row per mission, with the difference of the two
    overall(results, pair)            # mean differences with intervals

``questions.regions`` says where in the space of parameters a policy is ahead.
"""

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import pandas as pd

from analysis import numbers
from analysis.names import METRICS, PARAMETERS, PRODUCT, RATIO, SUCCESS, parameter
from analysis.questions.summary import learners, ranked_policies
from analysis.results.tables import Results
from analysis.stats.correction import for_choice
from analysis.stats.intervals import by_replication, wilson
from analysis.stats.paired import compare
from dess.errors import InputError, one_of

OF_BASELINE = "_baseline"  # suffix of the names of the baseline's metrics

_ROUNDING = 1e-12  # the largest difference between equal results


class Pair(NamedTuple):
    """Two policies to compare.

    Attributes:
        policy: The policy that is compared with the other one.
        baseline: The other policy.
        candidates: Number of pairs among which this pair was chosen, by the same data.
    """

    policy: str
    baseline: str
    candidates: int


def pair_of(results: Results, learned: str | None = None, heuristic: str | None = None) -> Pair:
    """The best learned policy of a study, and the best of the other policies.

    Policies are ranked by mean product. A learner with several trainings
    is ranked by their mean and represented by its first training, because the best of several
    trainings would give a biased picture of the learner. If all policies are learned, or none is,
    the best two policies are compared.

    Args:
        results: The study.
        learned: The first policy, in place of the best learned one.
        heuristic: The second policy, in place of the best of the others.

    Raises:
        InputError: If the study has fewer than two policies, or lacks a policy that is named.
    """
    for name, given in (("learned", learned), ("heuristic", heuristic)):
        if given is not None and given not in results.policies:
            allowed = one_of(given, results.policies)
            raise InputError(f"{name}: {given!r} is not in the study{allowed}")
    means = by_replication(results.missions, PRODUCT, ["policy", "point"]).mean()
    means = means.groupby("policy").mean()
    trained = sorted(learners(results).values(), key=lambda trainings: -means[trainings].mean())
    ranked, of_learners = ranked_policies(results.missions), {*sum(trained, [])}
    firsts = [trainings[0] for trainings in trained]
    others = [policy for policy in ranked if policy not in of_learners]
    if not firsts or not others:
        firsts = others = ranked
    asked = product([learned] if learned else firsts, [heuristic] if heuristic else others)
    pairs = [pair for pair in asked if pair[0] != pair[1]]
    if not pairs:
        raise InputError(
            f"learned, heuristic: no two policies to compare among {', '.join(results.policies)}; "
            "allowed: two or more, and not one for both"
        )
    return Pair(*pairs[0], len({frozenset(pair) for pair in pairs}))


def answer(comparison: pd.DataFrame, missions: pd.DataFrame, pair: Pair) -> str:
    """By how much a policy is ahead of the other one on average, and in how many missions.

    Args:
        comparison: The rows of ``overall``.
        missions: The rows of ``duels``.
        pair: The policies.
    """
    row = comparison.set_index("metric").loc[PRODUCT]
    share = numbers.percent((missions["difference"] > 0).mean())
    return (
        f"The product of {pair.policy} minus that of {pair.baseline} is "
        f"{numbers.points(*row[['difference', 'low', 'high']])} points on average over "
        f"{len(missions):,} missions; {pair.policy} is ahead in {share} of them."
    )


def duels(results: Results, pair: Pair) -> pd.DataFrame:
    """Two policies in the same missions.

    Returns:
        A row per mission: ``replication``, the parameters (``initial_data`` is the mean over the
        nodes), ``METRICS`` of the policy, those of the baseline under names that end in
        ``_baseline``, and ``difference``, by how much the policy is ahead in collection ratio and
        communication.

    Raises:
        InputError: If the study has several design points.
    """
    if (points := len(results.store.manifest.points)) > 1:
        name = results.store.manifest.study["name"]
        raise InputError(f"study {name}: {points} design points; allowed: one for all missions")
    table = results.missions.assign(
        initial_data=results.missions["initial"] / len(results.scenario().nodes)
    )
    columns = ["replication", *PARAMETERS, *METRICS]
    of_policy = table.loc[table["policy"] == pair.policy, columns]
    of_baseline = table.loc[table["policy"] == pair.baseline, ["replication", *METRICS]]
    both = of_policy.merge(of_baseline, on="replication", suffixes=("", OF_BASELINE))
    difference = both[PRODUCT] - both[PRODUCT + OF_BASELINE]
    return both.assign(difference=difference.where(difference.abs() > _ROUNDING, 0.0))


def overall(results: Results, pair: Pair) -> pd.DataFrame:
    """The policy compared with the baseline in every metric, over all missions.

    Returns:
        A row per metric, as ``stats.paired.compare`` returns it; ``p_adjusted`` also corrects for
        the choice of the pair.
    """
    missions = results.missions[results.missions["policy"].isin(pair[:2])]
    return for_choice(compare(missions, pair.baseline, [*METRICS]), pair.candidates)


def pairing(comparison: pd.DataFrame) -> str:
    """How many times as many independent missions would give equally narrow intervals.

    Args:
        comparison: The rows of ``overall``.
    """
    reduction = comparison.set_index("metric").loc[PRODUCT, "variance_reduction"]
    return f"{1 / (1 - reduction):.0f} times as many" if reduction < 1 else "infinitely many"


def outcomes(missions: pd.DataFrame, pair: Pair) -> pd.DataFrame:
    """A table to print: in how many missions each policy is ahead, and fails alone."""
    gap = missions["difference"]
    more = missions[SUCCESS] - missions[SUCCESS + OF_BASELINE]
    cases = {
        f"{pair.policy} ahead": gap > 0,
        "level": gap == 0,
        f"{pair.policy} behind": gap < 0,
        f"only {pair.policy} fails": more < 0,
        f"only {pair.baseline} fails": more > 0,
    }
    counts = pd.DataFrame(cases).sum()
    shares = [numbers.interval(*wilson(count, len(missions))) for count in counts]
    columns = {"Outcome": counts.index, "Missions": counts.map("{:,}".format), "Share": shares}
    return pd.DataFrame(columns).reset_index(drop=True)


def worst(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``duels`` with the policy's lowest product.

    The worst mission is first; among equal ones, the one with the lowest collection ratio.
    """
    return missions.sort_values([PRODUCT, RATIO], kind="stable").head(count)


def drawn(missions: pd.DataFrame, pair: Pair) -> list[tuple[str, int]]:
    """The missions to draw: the worst two of ``duels``, each with both policies."""
    replications = worst(missions, 2)["replication"]
    return [(policy, int(n)) for n in replications for policy in (pair.policy, pair.baseline)]


def most_lost(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``duels`` in which the policy is furthest behind, if it is behind."""
    lost = missions[missions["difference"] < 0]
    return lost.sort_values("difference", kind="stable").head(count)


def depleted(results: Results, policy: str, replications: Iterable[int]) -> int:
    """The number of UAVs of a policy whose battery is depleted before their quota is filled."""
    return int(_ends(results, policy, replications)["battery"].sum())


def commands(results: Results, policy: str, replications: Iterable[int]) -> list[str]:
    """The commands that simulate missions again, from the usual results folder, and draw them."""
    folder = results.usual_folder
    return [
        f"{results.command(policy, 0, number, folder)} --figure mission-{number}.png"
        for number in replications
    ]


def listed(missions: pd.DataFrame, results: Results, pair: Pair) -> pd.DataFrame:
    """Missions of ``duels`` as a table to print: parameters, and the outcome of both policies."""
    table = missions.reset_index(drop=True)
    columns = {("", "Mission"): table["replication"].astype(str)}
    for field in PARAMETERS:
        columns["", parameter(field).short] = table[field].map("{:.3g}".format)
    columns["", "Points"] = table["difference"].map(lambda gap: numbers.difference(gap, 0))
    for policy, end in ((pair.policy, ""), (pair.baseline, OF_BASELINE)):
        ends = _ends(results, policy, table["replication"])
        filled = [f"{quota} of {n}" for quota, n in ends[["quota", "all"]].to_numpy()]
        columns[policy, "Success"] = table[SUCCESS + end].map({1: "yes", 0: "no"})
        columns[policy, "Quotas"] = pd.Series(filled, dtype=object)
        columns[policy, "Collected"] = table[RATIO + end].map(numbers.percent)
    return pd.DataFrame(columns)


def _ends(results: Results, policy: str, replications: Iterable[int]) -> pd.DataFrame:
    """How the UAVs of missions end: a row per mission, and a column of counts per kind of end."""
    uavs = results.uavs[results.uavs["policy"] == policy]
    ends = pd.crosstab(uavs["replication"], uavs["end"], margins=True, margins_name="all")
    return ends.reindex([*replications], columns=["quota", "battery", "all"], fill_value=0)
