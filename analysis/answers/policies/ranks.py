"""The order of policies by their means: which is the best, and which leads where."""

from collections.abc import Iterable

import pandas as pd

from dess.analysis.measured import usual_metric
from dess.analysis.metrics import metric_of
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.analysis.stats.weights import values_within
from dess.policies.shipped import HEURISTICS


def rank_policies(missions: pd.DataFrame, among: Iterable[str] | None = None) -> list[str]:
    """The policies by their mean product, or in years age, the best one first.

    Every design point has the same weight. Of policies with equal means, the one that appears first
    is ranked first.

    Args:
        missions: A row per mission.
        among: The policies to rank; by default all.
    """
    if among is None:
        among = missions["policy"].unique()
    else:
        among = [*among]
    cell = ["policy", "point"]
    metric = usual_metric(missions)
    values = missions[cell].assign(value=values_within(missions, metric, cell))
    at_points = values.groupby(cell, sort=False)["value"].mean()
    means = at_points.groupby("policy", sort=False).mean()
    ranked = means.sort_values(ascending=metric_of(metric).less_is_better, kind="stable").index
    return [str(policy) for policy in ranked if policy in among]


def best_policy(missions: pd.DataFrame, among: Iterable[str] | None = None) -> str:
    """The policy with the highest mean product, or in years with the youngest data."""
    return rank_policies(missions, among)[0]


def rank_learned_and_others(results: Results) -> tuple[list[str], list[str]]:
    """The learned policies of a study and its heuristics, the best of each first.

    Of a study without a heuristic that is part of dess, these are all other policies.
    """
    trained = trained_policies_by_learner(results).values()
    learned = {policy for trainings in trained for policy in trainings}
    ranked = rank_policies(results.missions)
    others = [policy for policy in ranked if policy not in learned]
    heuristics = [policy for policy in others if policy in HEURISTICS]
    return [policy for policy in ranked if policy in learned], heuristics or others


def leading_policies(
    results: Results, learned: str | None = None, heuristic: str | None = None
) -> list[str]:
    """The best learned policy of a study, if it has one, and its best heuristic.

    Args:
        results: The study.
        learned: The learned policy to take instead of the best one.
        heuristic: The heuristic to take instead of the best one.

    Raises:
        InputError: If the study lacks a policy that is named.
    """
    for name in (learned, heuristic):
        if name is not None:
            results.check_policy(name)
    all_learned, others = rank_learned_and_others(results)
    learned = learned or next(iter(all_learned), None)
    heuristic = heuristic or next(iter(others), None)
    return [policy for policy in (learned, heuristic) if policy]
