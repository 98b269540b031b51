"""The settings of a panel: what its reader may change, and by which values."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import Any

from dess import InputError
from dess.analysis.metrics import size_of
from dess.analysis.names import RANGES, ZONE_PADS, field_named, value_text
from dess.analysis.numbers import format_quantity
from dess.base.files.writing import toml_value
from dess.scenario.data_sheet import Units
from dess.scenario.quantities import measured, printed, times
from dess.scenario.scenario import ScenarioSpace
from dess.scenario.values import dotted

# What a reader may change wherever the scenario lets him, and by which values.
COUNTS = {"uavs": 8, "pads": 16}  # every number up to this one, or to that of the page
_MOST_POSITIONS = 64  # of a slider
_SCALED = {
    "arrival_rate": (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0),
    "max_slots": (0.5, 0.75, 1.0, 1.5, 2.0),
}
_LEVELS = {
    "initial_data": (5.0, 7.5, 10.0, 12.5, 15.0, 17.5, 20.0),
    "flying_time": (60, 70, 75, 80, 90, 100),
    "charge_start": (10, 20, 30, 40, 50),
    "charge_complete": (60, 70, 80, 90, 100),
    "failures.uav_rate": (0.0, 0.0005, 0.001, 0.002, 0.005),
}
_MTBF = "data_sheet.mtbf"
# What a data sheet says, in which units, times these factors.
OF_SHEET = {
    "data_sheet.data_rate": ("bit/s", (0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0, 3.0, 4.0)),
    "data_sheet.wind": ("m/s from deg", (0.0, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5, 2.0)),
    _MTBF: ("s", (0.1, 0.25, 0.5, 1.0, 2.0, 4.0, 10.0)),
}
_OF_PAPER = ("initial_data", "flying_time")  # a data sheet says it in its own words
# How often UAVs fail, which is told as the mean time between failures.
_FAILURES = ("failures.uav_rate", _MTBF)
OFFERED = (*COUNTS, ZONE_PADS, *_SCALED, *OF_SHEET, *_LEVELS)


def settings_of(
    baseline: ScenarioSpace,
    variation: ScenarioSpace,
    varied: Mapping[str, Sequence[Any]] = MappingProxyType({}),
) -> Iterator[tuple[str, list[Any]]]:
    """The settings of the panel: by field, the values that the scenario allows, in their order."""
    ours, theirs = (dotted(space.model_dump(mode="json")) for space in (baseline, variation))
    differing = [key for key in ours | theirs if ours.get(key) != theirs.get(key)]
    if _MTBF in differing and not all(space.value(_MTBF) for space in (baseline, variation)):
        # The sheet of one side says nothing of failures: they are told by what follows from it.
        differing = [key for key in differing if key not in (_MTBF, "data_sheet.repair")]
        differing.append("failures.uav_repair")
    # Another line of the data sheet would change the same words of the arrays.
    has_other_sheet = any(key.startswith("data_sheet.") for key in {*differing} - {*OF_SHEET})
    for key in OFFERED:
        if key in OF_SHEET and has_other_sheet:
            continue
        if not _has_setting(baseline, key) or not _has_setting(variation, key):
            continue
        present = [value_of(space, key) for space in (baseline, variation)]
        values = [*_candidates_of(baseline, key, present), *varied.get(key, ())]
        allowed = [value for value in values if _is_allowed(baseline, key, value)]
        ordered = _in_order(key, [*allowed, *present])
        if len(ordered) > 1:
            yield key, ordered
            differing = [other for other in differing if other != key]
    for key in differing:
        values = [value_of(space, key) for space in (baseline, variation)]
        if values[0] != values[1]:
            yield key, values


def _candidates_of(space: ScenarioSpace, key: str, present: Sequence[Any]) -> Sequence[Any]:
    """The values of a setting that are offered on any page."""
    if key in (*COUNTS, ZONE_PADS):
        usual = COUNTS.get(key, COUNTS["pads"])
        most = max([usual, *(value for value in present if isinstance(value, int))])
        return range(1, min(most, _MOST_POSITIONS) + 1)
    if key in OF_SHEET:
        return [_times(space.plain_value(key), factor) for factor in OF_SHEET[key][1]]
    if key in _SCALED:
        value = getattr(space, key)
        scaled = [float(f"{factor * value:.6g}") for factor in _SCALED[key]]
        return [*map(round, scaled)] if isinstance(value, int) else scaled
    return _LEVELS[key]


def _has_setting(space: ScenarioSpace, key: str) -> bool:
    """Whether a scenario has what a setting changes: further zones, or a line of its data sheet."""
    if key == ZONE_PADS:
        return bool(space.zones)
    if key in OF_SHEET:
        return bool(space.units and space.value(key))
    if key in _OF_PAPER:
        return not space.units
    return True


def _times(value: Any, factor: float) -> Any:
    """What a data sheet says, times a factor: a text, or one for each node."""
    if factor == 1.0:
        return value
    if isinstance(value, str):
        return times(value, factor)
    return [times(of_node, factor) for of_node in value]


def _amount_of(key: str, value: Any) -> float:
    """The amount of what a data sheet says; of a list for the nodes, that of the first."""
    if not isinstance(value, str):
        value = value[0]
    return measured(value, OF_SHEET[key][0])[0]


def _is_allowed(space: ScenarioSpace, key: str, value: Any) -> bool:
    try:
        ScenarioSpace.of(space, **{key: value})
    except InputError:
        return False
    return True


def value_of(space: ScenarioSpace, key: str) -> Any:
    """The value of a field as a reader knows it: of a range with equal ends, one number."""
    if key == "pads" and space.pads is None:
        *_, width, height = space.zone
        return width * height
    value = space.plain_value(key)
    if key == ZONE_PADS and len({*value}) == 1:
        return value[0]
    if key in RANGES and value[0] == value[1]:
        return value[0]
    return value


def _in_order(key: str, values: Sequence[Any]) -> list[Any]:
    """Each value once: ranges, which differ between missions, before numbers.

    What a data sheet says is in the order of the amounts.
    """
    different = [value for n, value in enumerate(values) if value not in values[:n]]
    if key in OF_SHEET:
        return sorted(different, key=partial(_amount_of, key))
    numbers = sorted(value for value in different if not isinstance(value, list))
    return [value for value in different if isinstance(value, list)] + numbers


def describe_setting(
    key: str, values: Sequence[Any], space: ScenarioSpace, default: Any
) -> dict[str, Any]:
    """A setting for the page; a command need not name the default, which the scenario has."""
    field = field_named(key)
    place = ""
    if key == "pads" and space.zones:  # those of the other zones are settings of their own
        place = " in zone 1"
    name, unit = field.name, field.unit
    texts = [value_text(value) for value in values]
    if key in _FAILURES:
        name, unit = _failure_in_words(space), ""
        texts = [_time_between(value, space.units) for value in values]
    if key in OF_SHEET and not isinstance(values[0], str):
        listed = _amount_of(key, space.plain_value(key))
        texts = [f"{_amount_of(key, of_nodes) / listed:g} times the sheet's" for of_nodes in values]
    return {
        "default": values.index(default) if default in values else None,
        "key": key,
        "name": name + place,
        "place": place,
        "unit": unit,
        "values": values,
        "texts": texts,
        "options": [f"{key}={toml_value(value)}" for value in values],
    }


def _time_between(rate: float | str, units: Units | None) -> str:
    """A rate per mission slot, or a time, as the mean time from one event to the next."""
    if isinstance(rate, str):
        return f"one every {rate}"
    if rate == 0.0:
        return "none"
    if units is None:
        return f"one every {format_quantity(1 / rate)} mission slots"
    return f"one every {format_quantity(size_of('h', units) / rate)} h"


def _failure_in_words(space: ScenarioSpace) -> str:
    """What a failure of a UAV does, and for how long."""
    repair = space.failures.uav_repair
    if repair == 0.0:
        return "Failures of a UAV in flight, which is then lost for good"
    length = f"{format_quantity(repair)} mission slots"
    if space.units:
        length = printed(repair * space.units.slot, "s")
    return f"Failures of a UAV in flight, which is then grounded for {length} in the mean"
