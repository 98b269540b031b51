"""The design points of a study, and the settings made of them, in values and in words.

A setting is a policy at a design point. The fields that an operator decides on, such as the numbers
of UAVs and pads, make up the fleet. All other fields that the design varies are conditions under
which the fleet has to work.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from dess.analysis import numbers
from dess.analysis.metrics import LATE, METRICS, SUCCESS
from dess.analysis.names import DECISIONS, field_named, single_value
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.study.prices import has_priced_types
from dess.analysis.tables import INTERVALS
from dess.scenario.fields import ZONE_PADS, is_number

_COUNTED = ("uavs", "pads", ZONE_PADS)  # the numbers of what has a price


def varied_values(results: Results) -> dict[str, list[Any]]:
    """The fields that have more than one value over the design, in the order of the study.

    Returns:
        For each field its values: numbers in ascending order, others as text in the order of the
        study.
    """
    table = values_of_points(results)
    return {str(field): ordered_values(table[field]) for field in table}


@compute_once
def values_of_points(results: Results) -> pd.DataFrame:
    """The values of the varied fields at every design point.

    Returns:
        A row per design point and a column per field. If a point does not set a field, the value is
        that of the scenario. Values that are not numbers are text, such as ``5–7.5`` for a range.
    """
    manifest = results.store.manifest
    columns = {}
    for field in manifest.values[0]:
        values = [of_point[field] for of_point in manifest.values]
        if field == "pads":  # without a number, it depends on the zone
            values = [results.scenario(number).zone_pads[0] for number in range(len(values))]
        texts = field_named(field).comparable(values)
        if len({*texts}) > 1:
            columns[field] = texts
    return pd.DataFrame(columns, index=range(len(manifest.points)))


def points_left(results: Results, policy: str) -> np.ndarray:
    """Which design points the selection of a study has not ruled out for a policy.

    Returns:
        (points,) of bool; all True if the study selects no best design point.
    """
    left = np.ones(len(results.store.manifest.points), bool)
    if (choice := results.choice(policy)) is not None:
        left[:] = False
        left[[choice.best, *choice.survivors]] = True
    return left


def points_in_words(results: Results) -> list[str]:
    """Every design point in words, as ``3 UAVs, arrival rate 0.02``; empty if nothing varies."""
    return [", ".join(words) for words in rows_in_words(values_of_points(results))]


def rows_in_words(table: pd.DataFrame) -> list[list[str]]:
    """Every row of some columns of ``values_of_points`` in words, each value with its field."""
    rows = table.to_dict("records")
    return [[field_named(str(f)).words(v) for f, v in row.items()] for row in rows]


def setting_in_words(results: Results, policy: str, point: int) -> str:
    """A setting in words: ``greedy with 3 UAVs``; the policy alone if nothing varies."""
    words = points_in_words(results)[point]
    if words:
        return f"{policy} with {words}"
    return policy


@compute_once
def fleets_in_words(results: Results) -> list[str]:
    """The fleet of every design point in words: all that has a price or varies."""
    prices = results.prices
    table = values_of_points(results)
    fleets = []
    for point, others in enumerate(_fields_in_words(results, True)):
        space = results.scenario(point)
        words = []
        has_price = prices.uav or prices.pays_for_losses or has_priced_types(space)
        if has_price or "uavs" in table:
            words.append(field_named("uavs").words(single_value([*space.uavs])))
        if prices.pad or {"pads", ZONE_PADS} & {*table}:
            zone_pads = _zone_pads(results, point)
            words += [
                pads_in_words(len(zone_pads), zone, pads) for zone, pads in enumerate(zone_pads, 1)
            ]
        fleets.append(numbers.join_words([*words, *others]) or "the fleet of the scenario")
    return fleets


def _zone_pads(results: Results, point: int) -> list[int]:
    """The pads of each zone at a design point: 0 of a zone that is left out there."""
    space = results.scenario(point)
    manifest = results.store.manifest
    asked = manifest.points[point].values.get(ZONE_PADS, space.zone_pads[1:])
    if is_number(asked):
        asked = [asked] * len(manifest.space({}).zones)
    return [space.zone_pads[0], *asked]


def pads_in_words(zones: int, zone: int, pads: int) -> str:
    """So many pads in zone 1, 2, ... in words.

    Args:
        zones: The number of zones; of a single one, the zone is not named.
        zone: The number of the zone, from 1.
        pads: Its pads; a zone with 0 is not there.
    """
    number = field_named("pads").words(pads)
    if zones == 1:
        return number
    if pads == 0:
        return f"no zone {zone}"
    return f"{number} in zone {zone}"


@compute_once
def conditions_in_words(results: Results) -> list[str]:
    """The condition of every design point in words."""
    return [", ".join(row) for row in _fields_in_words(results, False)]


def _fields_in_words(results: Results, decisions: bool) -> list[list[str]]:
    """The fields of every design point that are decided on, or the rest; none of ``_COUNTED``."""
    table = values_of_points(results)
    shown = [f for f in table if (f in DECISIONS) == decisions and f not in _COUNTED]
    return rows_in_words(table[shown])


def has_conditions(results: Results) -> bool:
    """Whether fleets have to work under several conditions."""
    return len({*conditions_in_words(results)}) > 1


def ordered_values(values: pd.Series) -> list[Any]:
    """The distinct values: numbers and bins in ascending order, others in order of appearance."""
    unique = values.drop_duplicates()
    ascends = is_numeric_dtype(unique) or isinstance(unique.dtype, pd.CategoricalDtype)
    return (unique.sort_values() if ascends else unique).tolist()


def ends_of_point(results: Results, point: int) -> dict[str, str]:
    """The fields that have the least or the largest of their values at a design point.

    Beyond such an end there may be a better setting. An end that is a limit of the scenario itself,
    such as one UAV, or as many pads as the zone has cells, does not count.

    Args:
        results: The study.
        point: The design point.

    Returns:
        For each of these fields ``least`` or ``largest``.
    """
    space = results.scenario(point)
    ends = {}
    for field, values in values_of_points(results).items():
        if is_numeric_dtype(values) and field in space.numeric:
            low, high = space.limits(field)
            if values[point] == values.min() != low:
                ends[str(field)] = "least"
            elif values[point] == values.max() != high:
                ends[str(field)] = "largest"
    return ends


def ends_in_words(results: Results, point: int, ends: Mapping[str, str]) -> str:
    """At which ends of the values asked for a design point lies, as ``1 pad (least)``.

    Args:
        results: The study.
        point: The design point.
        ends: Its ``ends_of_point``.
    """
    values = values_of_points(results).loc[point]
    return ", ".join(f"{field_named(f).words(values[f])} ({end})" for f, end in ends.items())


def intervals_in_words(results: Results) -> str:
    """What the intervals of the means of a study's settings are called."""
    is_search = any(results.analyses(policy).any() for policy in results.policies)
    if is_search:
        return f"{INTERVALS} that allow for the search"
    return INTERVALS


def metrics_of_page(results: Results, metric: str) -> list[str]:
    """The metrics on the page of a study: the one that ranks the settings, and the paper's.

    Of years they are the success and the late data: the others of the paper tend to 1.
    """
    if results.study.years:
        return [*dict.fromkeys((metric, SUCCESS, LATE))]
    return [*dict.fromkeys((metric, *METRICS))]


def named_cells(results: Results, rows: pd.DataFrame) -> pd.DataFrame:
    """The policy, the number of the design point and its varied fields as text."""
    fields = {field_named(f).name: rows[f].map(field_named(f).cell) for f in varied_values(results)}
    return pd.DataFrame({"Policy": rows["policy"], "Point": rows["point"]} | fields)
