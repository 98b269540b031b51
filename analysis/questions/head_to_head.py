"""Two policies in the same missions: mean differences, and the missions with the worst results.

The functions are for studies with one design point whose missions draw their parameters. Both
policies meet the same random draws, so they are compared mission by mission:

    pair = pair_of(results)           # the best learned policy and the best baseline
    missions = duels(results, pair)   # a row per mission, with the difference of the two
    overall(missions, pair)           # mean differences with intervals

``questions.regions`` says where in the space of parameters a policy is ahead.
"""

from collections.abc import Iterable, Mapping
from itertools import product
from typing import Any, NamedTuple

import pandas as pd

from analysis import numbers
from analysis.names import METRICS, PARAMETERS, PRODUCT, RATIO, SUCCESS, parameter
from analysis.questions.summary import learned_against_heuristic, learners, ranked_policies
from analysis.results.tables import Results
from analysis.stats.correction import for_choice
from analysis.stats.intervals import wilson
from analysis.stats.paired import compare
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE, MARKS, position_by_test
from dess.errors import InputError, one_of

AHEAD, BEHIND = "ahead", "behind"
OF_BASELINE = "_baseline"  # suffix of the names of the baseline's metrics

_VERDICTS = {ABOVE: AHEAD, BELOW: BEHIND, INCONCLUSIVE: INCONCLUSIVE}
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

    Policies are ranked by mean collection ratio and communication. A learner with several trainings
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
    trained, baselines = _ranked(results)
    firsts = [trainings[0] for trainings in trained]
    if not firsts or not baselines:
        firsts = baselines = ranked_policies(results.missions)
    firsts = [learned] if learned else firsts
    baselines = [heuristic] if heuristic else baselines
    pairs = [pair for pair in product(firsts, baselines) if pair[0] != pair[1]]
    if not pairs:
        raise InputError(
            f"learned, heuristic: no two policies to compare among {', '.join(results.policies)}; "
            "allowed: two or more, and not one for both"
        )
    return Pair(*pairs[0], len({frozenset(pair) for pair in pairs}))


def introduction(results: Results, pair: Pair, missions: pd.DataFrame) -> str:
    """In words: the two policies of a pair, and the number of missions of ``duels``."""
    policy, baseline, candidates = pair
    return (
        f"**{policy}** is {role(results, policy)}, **{baseline}** is {role(results, baseline)}; "
        f"these data chose them among {candidates} {'pair' if candidates == 1 else 'pairs'}. "
        f"They are compared in the same {len(missions):,} missions. Differences are {policy} minus "
        f"{baseline}; a positive difference means that {policy} is better."
    )


def role(results: Results, policy: str) -> str:
    """The role of a policy in a study, such as ``training 1 of 3 of the best learner ...``."""
    trained, baselines = _ranked(results)
    for rank, trainings in enumerate(trained):
        if policy in trainings:
            number, article = trainings.index(policy) + 1, "a" if rank else "the best"
            return f"training {number} of {len(trainings)} of {article} learner of the study"
    article = "the best" if policy == baselines[0] else "a"
    return f"{article} policy of the study that has not learned"


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
    of_policy, of_baseline = (
        table[table["policy"] == name] for name in (pair.policy, pair.baseline)
    )
    both = of_policy[["replication", *PARAMETERS, *METRICS]].merge(
        of_baseline[["replication", *METRICS]], on="replication", suffixes=("", OF_BASELINE)
    )
    difference = both[PRODUCT] - both[PRODUCT + OF_BASELINE]
    return both.assign(difference=difference.where(difference.abs() > _ROUNDING, 0.0))


def overall(missions: pd.DataFrame, pair: Pair) -> pd.DataFrame:
    """The policy compared with the baseline in every metric, over all missions of ``duels``.

    Returns:
        A row per metric, as ``stats.paired.compare`` returns it; ``p_adjusted`` also corrects for
        the choice of the pair.
    """
    parts = [
        pd.DataFrame({metric: missions[metric + end] for metric in METRICS}).assign(
            policy=policy, replication=missions["replication"]
        )
        for policy, end in ((pair.policy, ""), (pair.baseline, OF_BASELINE))
    ]
    return for_choice(compare(pd.concat(parts), pair.baseline, [*METRICS]), pair.candidates)


def learners_against_baseline(results: Results) -> pd.DataFrame:
    """``summary.learned_against_heuristic``, with ``learner`` as ``ddqn (3 trainings)``."""
    table = learned_against_heuristic(results)
    names = [
        row.learner if row.trainings == 1 else f"{row.learner} ({row.trainings} trainings)"
        for row in table.itertuples()
    ]
    return table.assign(learner=names)


def verdict(difference: float, p_adjusted: float) -> str:
    """Whether a policy is significantly ``AHEAD`` or ``BEHIND``, or this is ``INCONCLUSIVE``."""
    return _VERDICTS[position_by_test(difference, p_adjusted)]


def pairing(comparison: pd.DataFrame) -> str:
    """How many times as many independent missions would give equally narrow intervals.

    Args:
        comparison: The rows of ``overall``.
    """
    reduction = comparison.set_index("metric").loc[PRODUCT, "variance_reduction"]
    return f"{1 / (1 - reduction):.0f} times as many" if reduction < 1 else "infinitely many"


def by_metric(comparisons: pd.DataFrame, name: str = "policy") -> pd.DataFrame:
    """Comparisons as a table to print: marked differences and p-values, a row per policy.

    Args:
        comparisons: A row per policy and metric, as in ``stats.paired.compare``, or per learner
            and metric, as in ``stats.learners.compare_learners``: the product of these has the
            prediction interval of one new training as well.
        name: The column that tells the rows apart.
    """
    lines: list[dict[tuple[str, str], str]] = []
    for policy, rows in comparisons.groupby(name, sort=False) if len(comparisons) else ():
        line = {("", "Difference"): f"{policy} − {rows['baseline'].iloc[0]}"}
        for row in rows.itertuples():
            side = position_by_test(row.difference, row.p_adjusted)
            points = numbers.points(row.difference, row.low, row.high)
            line[METRICS[row.metric], "points"] = f"{points} {MARKS[side]}"
            if row.metric == PRODUCT and "new_low" in rows:
                line[METRICS[row.metric], "one new training"] = new_training(row)
            line[METRICS[row.metric], "p, adjusted"] = numbers.p_value(row.p_adjusted)
        lines.append(line)
    return numbers.headed(lines)


def new_training(comparison: Any) -> str:
    """The prediction interval of a row of ``compare_learners`` [points]; a single one has none."""
    if comparison.trainings == 1:
        return "unknown"
    ends = comparison.difference, comparison.new_low, comparison.new_high
    return numbers.points(*ends).partition(" ")[2]


def outcomes(missions: pd.DataFrame, pair: Pair) -> pd.DataFrame:
    """A table to print: in how many missions each policy is ahead, and fails alone."""
    gap, n = missions["difference"], len(missions)
    more = missions[SUCCESS] - missions[SUCCESS + OF_BASELINE]
    counts = {
        f"{pair.policy} ahead": gap > 0,
        "level": gap == 0,
        f"{pair.policy} behind": gap < 0,
        f"only {pair.policy} fails": more < 0,
        f"only {pair.baseline} fails": more > 0,
    }
    rows = [
        (outcome, f"{cases.sum():,}", numbers.interval(*wilson(int(cases.sum()), n)))
        for outcome, cases in counts.items()
    ]
    return pd.DataFrame(rows, columns=["Outcome", "Missions", "Share"])


def worst(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``duels`` with the policy's lowest collection ratio and communication.

    The worst mission is first; among equal ones, the one with the lowest collection ratio.
    """
    return missions.sort_values([PRODUCT, RATIO], kind="stable").head(count)


def drawn(missions: pd.DataFrame, pair: Pair, count: int = 2) -> list[tuple[str, int]]:
    """The missions to draw: the worst of ``duels``, each with both policies."""
    replications = worst(missions, count)["replication"]
    return [(policy, int(n)) for n in replications for policy in (pair.policy, pair.baseline)]


def most_lost(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``duels`` in which the policy is furthest behind, if it is behind."""
    lost = missions[missions["difference"] < 0]
    return lost.sort_values("difference", kind="stable").head(count)


def depleted(results: Results, policy: str, replications: Iterable[int]) -> int:
    """The number of UAVs of a policy whose battery is depleted before their quota is filled."""
    uavs = _uavs(results, policy, replications)
    return int((uavs["end"] == "battery").sum())


def commands(results: Results, policy: str, replications: Iterable[int]) -> list[str]:
    """The commands that simulate missions again, from the usual results folder, and draw them."""
    folder = results.usual_folder
    return [
        f"{results.command(policy, 0, number, folder)} --figure mission-{number}.png"
        for number in replications
    ]


def listed(missions: pd.DataFrame, results: Results, pair: Pair) -> pd.DataFrame:
    """Missions of ``duels`` as a table to print: parameters, and the outcome of both policies."""
    return numbers.headed(
        {("", "Mission"): f"{row['replication']:.0f}"}
        | {("", parameter(field).short): f"{row[field]:.3g}" for field in PARAMETERS}
        | {("", "Points"): numbers.difference(row["difference"], 0)}
        | _outcome(row, results, pair.policy, "")
        | _outcome(row, results, pair.baseline, OF_BASELINE)
        for _, row in missions.iterrows()
    )


def _outcome(
    mission: Mapping[str, Any], results: Results, policy: str, end: str
) -> dict[tuple[str, str], str]:
    """The outcome of a mission of ``duels`` for a policy, as cells of a row of ``listed``."""
    ends = _uavs(results, policy, [mission["replication"]])["end"]
    return {
        (policy, "Success"): "yes" if mission[SUCCESS + end] else "no",
        (policy, "Quotas"): f"{(ends == 'quota').sum()} of {len(ends)}",
        (policy, "Collected"): numbers.percent(mission[RATIO + end]),
    }


def _uavs(results: Results, policy: str, replications: Iterable[int]) -> pd.DataFrame:
    uavs = results.uavs
    return uavs[(uavs["policy"] == policy) & uavs["replication"].isin([*replications])]


def _ranked(results: Results) -> tuple[list[list[str]], list[str]]:
    """The trainings of every learner, and the policies that have not learned; the best first."""
    means = results.missions.groupby("policy")[PRODUCT].mean()
    trained = sorted(learners(results).values(), key=lambda trainings: -means[trainings].mean())
    learned = {policy for trainings in trained for policy in trainings}
    ranked = ranked_policies(results.missions)
    return trained, [policy for policy in ranked if policy not in learned]
