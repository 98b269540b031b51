"""The ranges of metrics: the least and the largest value that missions can have of each."""

from collections.abc import Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np
import pandas as pd

from dess.analysis.metrics import (
    COLLECTED,
    IDLE,
    LEAST_COST,
    MOST_COST,
    MOST_SLOTS,
    MOST_WAITING,
    NODES_BEHIND,
    QUEUE,
    SHEET_UNITS,
    Metric,
    are_years,
    in_either,
    metric_of,
    size_of,
)
from dess.scenario.data_sheet import Units
from dess.scenario.scenario import ScenarioSpace

# What a mission collects and what it leaves are all of its data.
_DATA = (COLLECTED, "residual")
_PER_UAV = "collected_per_uav"


def metric_for_length(
    column: str, slots: int, units: Units | None, uavs: int = 1, idle: float = 0.0
) -> Metric:
    """The metric of a column of missions of at most this length, with its range.

    Args:
        column: The column.
        slots: The longest that a mission, or what the metric measures in it, may last.
        units: What a slot is, of missions with a data sheet.
        uavs: The most UAVs that a mission has.
        idle: How long nodes were idle before it, which ages begin with [slots].
    """
    metric = metric_of(column)
    if not metric.horizons:
        return metric
    longest = metric.horizons * slots
    if metric.grows:
        longest += idle
    if units and metric.is_in_sheet_unit:
        longest *= size_of(metric.unit, units)
    if metric.is_sum:
        longest *= uavs
    return replace(metric, most=longest)


def metric_of_years(metric: Metric) -> Metric:
    """The same metric of years with weather, of which each has hundreds of missions.

    An outcome is the share of its windows, and no rare year lies far from all others.
    """
    if metric.is_outcome:
        metric = replace(metric, kind="share")
    return replace(metric, fails=False, failure=0.0, is_of_years=True)


def metric_in_space(column: str, space: ScenarioSpace) -> Metric:
    """The metric of a column of missions of a scenario space, with its range and its nodes."""
    slots = space.longest_slots
    if metric_of(column).is_wait:
        slots = longest_wait(space)
    metric = metric_for_length(column, slots, space.units, space.uavs[1], space.idle_slots)
    if space.weather.is_on:
        metric = metric_of_years(metric)
    if column in NODES_BEHIND:
        return replace(metric, among=len(space.nodes))
    return metric


def metric_in_missions(missions: pd.DataFrame, column: str) -> Metric:
    """The metric of a column of missions, with the range that it has in these missions.

    Args:
        missions: The missions, with the columns that ``ranges_of_missions`` needs, as the missions
            of results have them.
        column: The column.
    """
    metric = metric_of(column)
    if not len(missions):
        return metric
    if are_years(missions):
        metric = metric_of_years(metric)
    nodes = NODES_BEHIND.get(column)
    if nodes in missions:
        metric = replace(metric, among=len(np.asarray(missions[nodes])[0]))
    least, most = ranges_of_missions(missions, column)
    return replace(metric, least=float(np.min(least)), most=float(np.max(most)))


def metric_in_groups(
    missions: pd.DataFrame, column: str, by: Sequence[str], groups: pd.DataFrame
) -> Metric:
    """The metric of a column of missions, with a range for each group of them.

    Args:
        missions: The missions, as in ``metric_in_missions``, and the columns ``by``.
        column: The column.
        by: The columns that tell the groups apart.
        groups: A row per group, with these columns.

    Returns:
        The metric. The ends of its range are arrays in the order of the groups, or numbers if all
        missions have the same.
    """
    metric = metric_in_missions(missions, column)
    least, most = ranges_of_missions(missions, column)
    if all((np.asarray(end) == np.ravel(end)[0]).all() for end in (least, most)):
        return metric
    ends = missions[[*by]].assign(least=least, most=most).groupby([*by], dropna=False)
    place = pd.MultiIndex.from_frame(groups[[*by]])
    lowest, highest = ends["least"].min(), ends["most"].max()
    if len(by) == 1:
        place = pd.Index(groups[by[0]])
    return replace(
        metric, least=lowest.reindex(place).to_numpy(), most=highest.reindex(place).to_numpy()
    )


def ranges_of_missions(missions: pd.DataFrame, column: str) -> tuple[Any, Any]:
    """The least and the largest value that each mission can have of a metric.

    A time may be as long as the mission (``MOST_SLOTS``), a wait as long as somebody can wait
    (``MOST_WAITING``), and where no UAV can, there is no queue. A cost has the range of
    ``LEAST_COST`` and ``MOST_COST``. No more data can be collected, or left, than both together.
    No value is above what a column named ``most_`` and the metric says, as of what cannot happen.

    Args:
        missions: The missions. Of a column that they lack, nothing is known.
        column: The column of the metric.

    Returns:
        (n,) arrays, or numbers that are those of all missions.
    """
    least, most = _ranges_by_metric(missions, column)
    if (limit := limit_of(column)) in missions:
        most = np.minimum(most, np.asarray(missions[limit], float))
    return least, most


def limit_of(column: str) -> str:
    """The column of the largest value that a metric can have in each mission, if there is one."""
    return f"most_{column}"


def _ranges_by_metric(missions: pd.DataFrame, column: str) -> tuple[Any, Any]:
    """The least and the largest value of a metric by its kind, as ``ranges_of_missions``."""
    metric = metric_of(column)
    if metric.kind == "cost" and MOST_COST in missions:
        return np.asarray(missions[LEAST_COST]), np.asarray(missions[MOST_COST])
    if column in in_either(*_DATA, _PER_UAV):
        parts = [metric_of(part) for part in _DATA]
        if metric.is_in_sheet_unit:
            parts = [part.in_units for part in parts]
        if all(part.column in missions for part in parts):
            most = sum(np.asarray(missions[part.column]) for part in parts)
            if column in in_either(_PER_UAV):
                most = most / np.asarray(missions["uavs"])
            return metric.range[0], most
    if column == QUEUE and MOST_WAITING in missions:
        return metric.range[0], np.where(np.asarray(missions[MOST_WAITING]) > 0, inf, 0.0)
    if not metric.horizons:
        return metric.range
    longest, idle = metric_of(MOST_SLOTS), metric_of(IDLE)
    if metric.is_wait and MOST_WAITING in missions:
        longest = metric_of(MOST_WAITING)
    if metric.is_in_sheet_unit:
        longest, idle = longest.in_units, idle.in_units
    if longest.column not in missions or (metric.is_sum and "uavs" not in missions):
        return metric.range
    most = metric.horizons * np.asarray(missions[longest.column], float)
    if metric.grows and idle.column in missions:
        most += np.asarray(missions[idle.column])
    if metric.is_in_sheet_unit:
        most *= SHEET_UNITS[longest.unit][1] / SHEET_UNITS[metric.unit][1]
    if metric.is_sum:
        most *= np.asarray(missions["uavs"])
    return metric.range[0], most


def longest_wait(space: ScenarioSpace) -> int:
    """The most slots that a UAV may wait for a pad: none where each zone has pads for all UAVs."""
    failures = space.failures
    may_fail = failures.pad_rate > 0 or any(failures.pad_rates)
    if may_fail or min(space.zone_pads) < space.uavs[1]:
        return space.longest_slots
    return 0
