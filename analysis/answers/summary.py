"""The means of a study: of every policy, at every design point or in every fleet."""

from collections.abc import Mapping

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.policies.ranks import best_policy
from dess.analysis.metric_ranges import metric_in_groups
from dess.analysis.metrics import PRODUCT, metric_of
from dess.analysis.results.tables import Results
from dess.analysis.stats.alternatives import ONLY, judge_alternatives
from dess.analysis.stats.groups import summary
from dess.analysis.stats.kinds import level_after
from dess.analysis.stats.requirement import Requirement
from dess.analysis.stats.verdict import Verdict
from dess.analysis.stats.weights import by_replication


def means_of_points(results: Results) -> pd.DataFrame:
    """Means with intervals of every policy at every design point.

    Returns:
        A row per policy, design point and metric, as ``dess.analysis.summary`` returns it. After a
        search, the intervals allow for it (``stats.kinds.level_after``).
    """
    cell = ["policy", "point"]
    analyses = {name: results.analyses(name) for name in results.policies}
    if not any(of_policy.any() for of_policy in analyses.values()):
        return summary(results.missions, by=cell)
    tables = [
        summary(missions, cell, float(level_after(analyses[policy][point])))
        for (policy, point), missions in results.missions.groupby(cell, sort=False)
    ]
    return pd.concat(tables, ignore_index=True)


def settings_meeting(means: pd.DataFrame, targets: Mapping[str, float]) -> pd.DataFrame:
    """The rows of ``means_of_points`` of the settings that meet all targets.

    A setting is a policy at a design point. It meets a target if the whole interval of the mean
    does, so that chance alone seldom lets a setting pass that does not meet it.

    Args:
        means: Rows of ``means_of_points``.
        targets: Metric -> the least mean, or the largest of a metric of which less is better.
    """
    for metric, bound in targets.items():
        requirement = Requirement(metric_of(metric), bound)
        rows = means[means["metric"] == metric]
        verdicts = map(requirement.judge, rows["low"], rows["high"])
        passed = rows[[verdict == Verdict.MET for verdict in verdicts]]
        means = means.merge(passed[["policy", "point"]])
    return means


def add_verdicts(results: Results, means: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``means_of_points`` with a ``verdict``: how a policy compares with the others there.

    Compared are the policies of the table at the same design point, by each metric, on the
    replications that they have in common, by ``stats.alternatives.judge_alternatives``.

    Args:
        results: The study.
        means: Rows of ``means_of_points``.

    Returns:
        The rows, with the verdicts of ``judge_alternatives``.
    """
    verdicts = pd.Series(ONLY, means.index, dtype=object)
    for (metric, point), rows in means.groupby(["metric", "point"], sort=False):
        missions = results.missions[results.missions["point"] == point]
        measure = metric_in_groups(missions, str(metric), ["policy"], rows[["policy"]])
        if measure.is_neutral:
            continue
        wide = by_replication(missions, str(metric), "policy")
        values = wide[rows["policy"]].to_numpy(float)
        analyses = np.array([results.analyses(policy)[point] for policy in rows["policy"]])
        verdicts[rows.index] = judge_alternatives(
            values, rows["low"], rows["high"], measure, analyses
        )
    return means.assign(verdict=verdicts)


def weights_in_words(results: Results) -> str:
    """How means weigh missions with different numbers of UAVs; empty if a study has one number."""
    ends = {space.uavs for space in results.store.manifest.scenarios}
    if all(low == high for low, high in ends):
        return ""
    policy = best_policy(results.missions)
    missions = results.missions[results.missions["policy"] == policy]
    weighted = summary(missions, by=[]).set_index("metric").loc[PRODUCT, "mean"]
    return (
        "Every number of UAVs that may be drawn has the same weight in a mean, however often the "
        f"missions drew it: the product of {policy} is {numbers.format_percent(weighted)}, and "
        f"would be {numbers.format_percent(missions[PRODUCT].mean())} "
        "as a plain mean of all missions."
    )


def means_by_fleet(missions: pd.DataFrame) -> pd.DataFrame:
    """Means with intervals of every policy by number of UAVs.

    Returns:
        Rows of ``dess.analysis.summary`` by ``policy`` (in order of appearance) and ``uavs``
        (sorted).
    """
    policies = missions.groupby("policy", sort=False)
    tables = [summary(part.sort_values("uavs"), by=["policy", "uavs"]) for _, part in policies]
    return pd.concat(tables, ignore_index=True)


def means_of_check(results: Results) -> pd.DataFrame:
    """Means with intervals of the selected points, over missions not used for the selection."""
    return summary(results.checks, by=["policy", "point"])
