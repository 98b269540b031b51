"""The risk of a fleet: how often it loses a UAV, and how bad its worst missions are."""

from collections.abc import Sequence

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.fleet.requirements import metric_asked_for, requirements_of
from dess.analysis.facts import Fact
from dess.analysis.metrics import AGE, RATIO, column_in_sheet_unit, metric_of
from dess.analysis.results.tables import Results

_WORST = 0.1  # the share of the missions that are called the worst


def risk_facts(results: Results, policy: str, points: Sequence[int]) -> list[Fact]:
    """In how many missions that check a fleet a UAV is lost, and how bad the worst of them are.

    Args:
        results: A study that searches for the cheapest setting.
        policy: The policy.
        points: The design points of the fleet, one for each condition; none if there is no fleet.

    Returns:
        The facts; none without a fleet or a check.
    """
    checks = results.checks
    if not points or checks.empty:
        return []
    checks = checks[(checks["policy"] == policy) & checks["point"].isin(points)]
    lost = _missions_with_losses(results, policy, points)
    worst = f"worst {numbers.format_level(_WORST)} of the missions"
    return [
        Fact("missions with a lost UAV", f"{lost:,} of {len(checks):,}"),
        Fact(worst, _worst_in_words(results, checks)),
    ]


def _missions_with_losses(results: Results, policy: str, points: Sequence[int]) -> int:
    """The number of missions of the check in which a UAV is lost."""
    manifest = results.store.manifest
    parts = manifest.parts_of_check(results.policies.index(policy))
    uavs = results.store.uavs([part for part in parts if part.cell.point in points])
    return int(uavs.groupby(["point", "replication"])["down"].max().sum())


def _worst_in_words(results: Results, missions: pd.DataFrame) -> str:
    """The age of the data in the worst missions, or the share of the data that they collect."""
    age = column_in_sheet_unit(AGE, missions)
    asked = [requirement.column for requirement in requirements_of(results)]
    if age in asked:
        measure = metric_asked_for(results, age)
        return f"{measure.within} {measure.write(missions[age].quantile(1 - _WORST))} or more"
    measure = metric_of(RATIO)
    return f"{measure.within} {measure.write(missions[RATIO].quantile(_WORST))} or less"
