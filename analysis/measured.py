"""Which metrics missions have, and by which of them they can be ranked."""

from collections.abc import Container

import pandas as pd

from dess.analysis.metrics import (
    AGE,
    LEAST,
    OLDEST,
    PRODUCT,
    SUCCESS,
    are_years,
    column_in_sheet_unit,
    metric_group,
    metric_of,
)
from dess.base.errors import InputError, unknown_name
from dess.model.record import MISSION_RECORD, measures_of
from dess.scenario.scenario import ScenarioSpace


def usual_metric(missions: pd.DataFrame) -> str:
    """The column that ranks what was simulated: of missions the product, of years the age.

    The collection ratio of a year tends to 1, whatever flies.
    """
    if are_years(missions):
        return column_in_sheet_unit(AGE, missions)
    return PRODUCT


def measured_in(missions: Container[str]) -> list[str]:
    """The numbers beyond the paper that a table of missions, or a row of it, has.

    Those in units of a data sheet come in the place of those in slots and data units.
    """
    return [
        column_in_sheet_unit(name, missions)
        for name in metric_group("operations")
        if name in missions
    ]


def metrics_in(missions: Container[str]) -> list[str]:
    """The metrics that a table of missions has: those of the paper, then all others."""
    others = [column for column in metric_group("home", "bounds") if column in missions]
    others = [column_in_sheet_unit(column, missions) for column in others]
    return [*metric_group("paper", "reward"), *others, *measured_in(missions)]


def told_metrics(missions: Container[str]) -> list[str]:
    """The metrics that can be told of missions: those that they have, then their cost."""
    costs = [column for column in metric_group("prices") if column in missions]
    return [*metrics_in(missions), *costs]


def check_metric(metric: str, missions: Container[str]) -> None:
    """Refuse a metric that these missions do not have.

    Raises:
        InputError: If they do not have it.
    """
    metrics = told_metrics(missions)
    if metric not in metrics:
        raise unknown_name("metric", f"{metric!r} is unknown", metric, metrics)


def check_ranking_metric(metric: str, missions: Container[str]) -> None:
    """Refuse a metric by which these missions cannot be ranked.

    Raises:
        InputError: If they do not have it, or more of it is neither better nor worse.
    """
    check_metric(metric, missions)
    refuse_neutral(metric)


def refuse_neutral(metric: str, where: str = "metric") -> None:
    """Refuse a metric that ranks nothing.

    Args:
        metric: The metric.
        where: What names it, for messages.

    Raises:
        InputError: If more of it is neither better nor worse.
    """
    if metric_of(metric).is_neutral:
        problem = f"more of {metric_of(metric).within} is neither better nor worse"
        raise InputError(where, problem, "a metric that ranks settings, such as the product")


def ranking_column(metric: str, missions: Container[str]) -> str:
    """The column of a metric by which missions are ranked, in the unit of a data sheet if possible.

    Raises:
        InputError: If the missions do not have it.
    """
    column = column_in_sheet_unit(metric, missions)
    check_ranking_metric(column, missions)
    return column


def metrics_of_scenario(space: ScenarioSpace) -> list[str]:
    """The metrics of the missions of a scenario, as they are measured."""
    of_nodes = [LEAST, OLDEST] if space.units else []
    measured = [*_measured_always(), *measures_of(space), *of_nodes]
    return metrics_in([*metric_group("home"), *measured])


def recorded_metrics() -> list[str]:
    """The metrics that the record of every mission has, in the order in which means are listed."""
    of_all = metric_group("home", "paper", "reward")
    return [*dict.fromkeys((SUCCESS, *of_all, *_measured_always()))]


def _measured_always() -> list[str]:
    operations = metric_group("operations")
    return [name for name in MISSION_RECORD.names or () if name in operations]
