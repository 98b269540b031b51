"""The arrays of a scenario for the WebAssembly module, and what settings change in them.

An image has all arrays of ``table.ARRAYS``: the bytes of those that Python computes, and the shapes
of the others. A setting that a page offers is a ``Slider``. If its value stands in some words of
the arrays, the slider has a recipe, which says where; otherwise it has, for each of its values, the
bytes that differ. Either way, the arrays are those that Python makes of the changed scenario.

    image = make_image(load_scenario("paper"), ["greedy"], seed=7, missions=25,
                       settings={"uavs": range(1, 7)})
    image.document()  # as JSON
"""

import math
from base64 import b64encode
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from dess.analysis.metric_ranges import metric_for_length
from dess.analysis.metrics import metric_of, size_of
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.sequences import SEQUENCE
from dess.analysis.study.prices import Costs, full_packs_of, has_priced_types
from dess.analysis.wasm.entry import METRICS, NETWORK, POLICIES, PRICES, TOTALS
from dess.analysis.wasm.table import ARRAYS
from dess.base.errors import InputError
from dess.envs.observations.sets import empty_tables
from dess.model.channel import Site, empty_scratch, make_world
from dess.model.record import empty_records
from dess.model.state import (
    MISSION,
    SENSOR,
    peak_values,
    starts_of,
    state_of,
    types_of,
)
from dess.model.view import check_team
from dess.model.ways import Ways
from dess.physics.fleet import move_phases, type_of
from dess.policies.choices import plan_circuit
from dess.policies.integers import Integers
from dess.policies.learner.policy import LearnedPolicy
from dess.policies.registry import load
from dess.scenario.scenario import ScenarioSpace

# The arrays of which only the shape is in an image: what missions write, and what ``prepare``
# fills. They begin with zeros, the records of ``operations`` with nan.
EMPTY = {
    *("missions", "uavs", "residual", "sensors", "peaks", "order", "means", "ways", "batches"),
    *("arrivals", "reach", "ways_home", "mission_records", "uav_records"),
    *("operations", "node_records", "values", "baseline", "totals", "sequences", "ends"),
    *("rates_by_distance", "sea_constants", "node_ways", "zone_ways", "home", "node_home"),
    *("around", "near", "shares", "parts"),
}
SHAPES = EMPTY - {"operations"}  # which begin with nan
MOST_MEMORY = 2**27  # of an image [bytes]; each worker of a page has its own

_LEAST_NORMAL = np.finfo(np.float64).tiny

Patch = dict[str, list[tuple[int, bytes]]]  # by array, the bytes from an offset on


class Word(NamedTuple):
    """A word of eight bytes that has the value of a setting, times a factor.

    Attributes:
        array: The name of its array.
        offset: Where it begins [bytes].
        kind: ``i8`` for an integer, ``f8`` for a float; both little-endian.
        factor: The factor.
    """

    array: str
    offset: int
    kind: str
    factor: float


@dataclass(frozen=True)
class Slider:
    """A setting that a page may change.

    Attributes:
        setting: The field of the scenario.
        values: The values that it may have.
        recipe: The words that have its value; empty if the slider has ``patches``.
        patches: What differs from the image at each value.
    """

    setting: str
    values: tuple[Any, ...]
    recipe: tuple[Word, ...] = ()
    patches: tuple[Patch, ...] = ()

    def apply(self, arrays: dict[str, np.ndarray], value: Any) -> None:
        """Change the arrays as a page does for a value."""
        for array, offset, kind, factor in self.recipe:
            word = np.array([value * factor], f"<{kind}")
            _bytes_of(arrays[array])[offset : offset + 8] = word.view(np.uint8)
        if self.patches:
            for array, parts in self.patches[self.values.index(value)].items():
                for offset, part in parts:
                    end = offset + len(part)
                    _bytes_of(arrays[array])[offset:end] = np.frombuffer(part, np.uint8)


@dataclass(frozen=True)
class Image:
    """The arrays of missions of a scenario, and the settings that may change.

    Attributes:
        arrays: The arrays by name, in the order of ``table.ARRAYS``.
        sliders: The settings.
    """

    arrays: dict[str, np.ndarray]
    sliders: tuple[Slider, ...] = ()

    @property
    def memory(self) -> int:
        """The memory that the arrays need [bytes]."""
        return sum(array.nbytes for array in self.arrays.values())

    @property
    def network(self) -> bytes:
        """The bytes of the arrays of the network, one behind the other."""
        return b"".join(self.arrays[name].tobytes() for name in Integers._fields)

    def document(self) -> dict[str, Any]:
        """The image for JSON; bytes are in base64. Those of ``network`` are not part of it."""
        return {
            "arrays": [*map(_describe_array, self.arrays, self.arrays.values())],
            "fields": {
                name: fields_of(array.dtype)
                for name, array in self.arrays.items()
                if array.dtype.names
            },
            "metrics": [*METRICS],
            "totals": [*TOTALS],
            "policies": POLICIES,
            "network": [*Integers._fields],
            "sliders": [*map(_describe_slider, self.sliders)],
        }


def explain_refusal(space: ScenarioSpace, team: Sequence[str]) -> str:
    """One sentence that says why the module cannot fly missions; empty if it can."""
    for name in team:
        if name not in POLICIES:
            return f"The policy {name} decides in Python."
    if space.needs_events:
        return "Packets that arrive in continuous time need the event engine, which is in Python."
    if space.chart.rows is not None:
        return "With no-fly cells, a grid of more than 10,000 cells needs more memory than a page."
    if (needed := _memory_of_radio(space)) > MOST_MEMORY:
        return f"The tables of its radio need {needed >> 20} MiB, more memory than a page."
    return ""


def _memory_of_radio(space: ScenarioSpace) -> int:
    """The bytes of the tables ``order`` and ``means`` of ``World``, before they are made."""
    columns, rows = space.size
    steps = 5 * columns * rows * move_phases(space.fleet)
    return steps * len(space.nodes) * (2 + 8 * space.communication_slots)


def make_image(
    space: ScenarioSpace,
    team: Sequence[str],
    seed: int = 0,
    missions: int = 25,
    settings: Mapping[str, Sequence[Any]] | None = None,
    costs: Costs | None = None,
) -> Image:
    """The image of missions of a scenario.

    Args:
        space: The scenario.
        team: The names of the policies; UAV i follows the policy ``team[i % len(team)]``.
        seed: Seed of the missions.
        missions: The most missions of a call, each of which has a row of records.
        settings: By the fields of the scenario that may change, the values that they may have.
        costs: The prices, if missions have costs.

    Raises:
        InputError: If the module cannot fly these missions (``explain_refusal``), the team has more
            policies than the largest fleet has UAVs, a setting changes the shape of an array, or
            two change the same words.
    """
    settings = settings or {}
    if why := explain_refusal(space, team):
        raise InputError("the WebAssembly module", why, "heuristics in the slotted model")
    check_team(len(team), [space])
    varied = {
        (setting, position): ScenarioSpace.of(space, **{setting: value})
        for setting, values in settings.items()
        for position, value in enumerate(values)
    }
    everywhere = [space, *varied.values()]
    fleet = max(variant.uavs[1] for variant in everywhere)
    peaks = peak_values(everywhere)

    def arrays_at(scenario: ScenarioSpace) -> dict[str, np.ndarray]:
        return _arrays_of(scenario, team, seed, missions, fleet, peaks, costs)

    arrays = arrays_at(space)
    sliders = []
    for setting, values in settings.items():
        others = [arrays_at(varied[setting, position]) for position in range(len(values))]
        sliders.append(_make_slider(setting, values, arrays, others))
    _check_independence(sliders)
    image = Image(arrays, tuple(sliders))
    if image.memory > MOST_MEMORY:
        size = f"{image.memory >> 20} MiB of memory"
        raise InputError("the WebAssembly module", size, f"{MOST_MEMORY >> 20} MiB at most")
    return image


def _arrays_of(
    space: ScenarioSpace,
    team: Sequence[str],
    seed: int,
    missions: int,
    fleet: int,
    peaks: int,
    costs: Costs | None,
) -> dict[str, np.ndarray]:
    """All arrays by name, for fleets of at most that many UAVs."""
    state = state_of([space], 1)
    starts = starts_of([space], seed)
    world = make_world(Site.of(space))
    chart = world.chart
    scratch = empty_scratch(fleet, len(space.nodes))
    records = empty_records(missions, fleet, is_extended=True)
    ways = Ways(starts.constants, chart)
    reach = np.zeros((0, 0, 0, 0), np.int32)
    if ways.reach is not None and len(ways.reach):
        reach = ways.reach[0]
    kinds = [POLICIES[team[i % len(team)]] for i in range(fleet)]
    tables = empty_tables(chart.zones.shape, len(world.nodes), len(chart.sizes))
    arrays = {
        "missions": state.missions,
        "uavs": types_of(space, fleet)[None],
        "residual": state.residual,
        "sensors": np.zeros(state.sensors.shape, SENSOR),
        "peaks": np.zeros((1, peaks), np.int32),
        "constants": _without_total(starts.constants.view(MISSION)),
        "ranges": starts.ranges,
        "types": types_of(space, fleet)[None],
        "data": starts.data,
        "rates": starts.rates,
        "ages": starts.ages,
        "silent": starts.silent,
        **{name: getattr(world, name) for name in ("nodes", "mean_snr", "order", "means")},
        **{name: getattr(chart, name) for name in ("zones", "parking", "sizes", "nearest")},
        "ways": chart.ways,
        **scratch._asdict(),
        "reach": reach,
        "ways_home": ways.home,
        "circuit": plan_circuit(world.nodes, chart),
        **_network()._asdict(),
        "rates_by_distance": np.zeros(len(world.mean_snr), np.float32),
        "sea_constants": np.zeros(6, np.float32),
        "node_ways": tables.ways,
        **{name: array for name, array in tables._asdict().items() if name != "ways"},
        "policies": np.array(kinds, np.int64),
        "mission_records": records.missions,
        "uav_records": records.uavs,
        "operations": records.operations,
        "node_records": records.nodes,
        "prices": _prices_of(space, costs),
        "uav_prices": _prices_of_types(space, fleet),
        "full_packs": np.array(full_packs_of(space, fleet)),
        "factors": _factors_of(space),
        "values": np.zeros((missions, len(METRICS))),
        "baseline": np.zeros((missions, len(METRICS))),
        "totals": np.zeros((len(METRICS), len(TOTALS))),
        "bounds": _bounds_of(space, fleet),
        "sequences": np.zeros(len(METRICS), SEQUENCE),
        "ends": np.zeros((len(METRICS), 4)),
    }
    return {
        name: _without_content(arrays[name]) if name in SHAPES else _without_gaps(arrays[name])
        for name in ARRAYS
    }


@cache
def _network() -> Integers:
    """The network of the trained policy of the module."""
    policy = load(NETWORK)
    assert isinstance(policy, LearnedPolicy) and policy.integers is not None
    return policy.integers


def _without_total(constants: np.ndarray) -> np.ndarray:
    """The constants without the sum of all pads: ``prepare`` adds up those that settings change."""
    copy = constants.copy()
    copy["pads"] = 0
    return copy


def _without_content(array: np.ndarray) -> np.ndarray:
    """Zeros of the same shape, which take no memory: there are as many as values of settings."""
    return np.broadcast_to(np.zeros((), array.dtype), array.shape)


def copy_inputs(arrays: Mapping[str, np.ndarray]) -> dict[str, np.ndarray]:
    """Copies of the arrays that Python computes, with the bytes between the fields of records."""
    return {
        name: np.frombuffer(bytearray(array.tobytes()), array.dtype).reshape(array.shape)
        for name, array in arrays.items()
        if name not in EMPTY
    }


def _without_gaps(array: np.ndarray) -> np.ndarray:
    """The array in one piece, with zeros between the fields of its records."""
    if not array.dtype.names:
        return np.ascontiguousarray(array)
    copy = np.zeros(array.shape, array.dtype)
    for name in array.dtype.names:
        copy[name] = array[name]
    return copy


def _prices_of(space: ScenarioSpace, costs: Costs | None) -> np.ndarray:
    """The prices in the order of ``PRICES``; none without costs."""
    if costs is None:
        return np.zeros(0)
    seconds = costs.slot_seconds or 0.0
    if space.units:
        seconds = space.units.slot
    interest, worth = costs.annuity
    values = costs.model_dump() | {
        "lost_uav": _price_of_loss(costs),
        "missions": costs.paid_missions,
        "seconds": seconds,
        "of_a_year": costs.years is not None,
        "interest": interest,
        "worth": worth,
    }
    return np.array([values[name] for name in PRICES], np.float64)


def _price_of_loss(costs: Costs) -> float:
    """The price of a lost UAV, nan if it is what the UAV was bought for."""
    if costs.lost_uav is not None:
        return costs.lost_uav
    return math.nan if costs.pays_for_losses else 0.0


def _prices_of_types(space: ScenarioSpace, fleet: int) -> np.ndarray:
    """(I,) the prices of UAVs whose types have their own, nan for the others; (0,) without any."""
    if not has_priced_types(space):
        return np.zeros(0)
    prices = [type_of(space.fleet, uav).price for uav in range(fleet)]
    return np.array([np.nan if price is None else price for price in prices])


def _factors_of(space: ScenarioSpace) -> np.ndarray:
    """What turns the metrics into the units of the data sheet, 1 without one."""
    factors = np.ones(len(METRICS))
    if units := space.units:
        for column, name in enumerate(METRICS):
            if unit := metric_of(name).sheet_unit:
                factors[column] = size_of(unit, units)
    return factors


def _bounds_of(space: ScenarioSpace, fleet: int) -> np.ndarray:
    """(METRICS, 4) what is known of the values of each metric, and the error of intervals.

    Args:
        space: The scenario.
        fleet: The most UAVs that any setting has.
    """
    bounds = np.empty((len(METRICS), 4))
    for column, name in enumerate(METRICS):
        unit = metric_of(name).in_units.column if space.units else name
        metric = metric_for_length(unit, space.max_slots, space.units, fleet, space.idle_slots)
        bounds[column] = *metric.range, metric.failure, 1 - LEVEL
    return bounds


def _make_slider(
    setting: str,
    values: Sequence[Any],
    arrays: Mapping[str, np.ndarray],
    others: Sequence[Mapping[str, np.ndarray]],
) -> Slider:
    """The slider of a setting, from the arrays that Python makes of each of its values."""
    for name, array in arrays.items():
        if any(other[name].shape != array.shape for other in others):
            raise InputError(setting, f"changes the shape of {name}", "settings of the same sea")
    patches = tuple(_difference(arrays, other) for other in others)
    recipe = _find_recipe(values, arrays, others)
    with_recipe = Slider(setting, tuple(values), recipe)
    for value, other in zip(values, others, strict=True):
        changed = copy_inputs(arrays)
        with_recipe.apply(changed, value)
        if any(changed[name].tobytes() != other[name].tobytes() for name in changed):
            return Slider(setting, tuple(values), patches=patches)
    return with_recipe


def _find_recipe(
    values: Sequence[Any],
    arrays: Mapping[str, np.ndarray],
    others: Sequence[Mapping[str, np.ndarray]],
) -> tuple[Word, ...]:
    """The words that change with a setting, as if each had its value times a factor."""
    if not all(isinstance(value, int | float) for value in values):
        return ()
    place, largest = max(enumerate(values), key=lambda pair: abs(pair[1]))
    words = []
    for name in arrays:
        if name in EMPTY:
            continue
        versions = [_words_of(other[name]) for other in (arrays, *others)]
        changing = np.any([version != versions[0] for version in versions], axis=0)
        for number in np.flatnonzero(changing):
            word = versions[place + 1][number : number + 1]
            kind = "i8"
            if word[0] != int(largest):
                kind = "f8"
            content = word.view(f"<{kind}")[0]
            if 0 < abs(content) < _LEAST_NORMAL:  # the bits of another integer
                return ()
            words.append(Word(name, int(8 * number), kind, float(content / (largest or 1))))
    return tuple(words)


def _difference(arrays: Mapping[str, np.ndarray], other: Mapping[str, np.ndarray]) -> Patch:
    """The words that differ, those beside each other in one part."""
    patch: Patch = {}
    for name in arrays:
        if name in EMPTY:
            continue
        differs = np.flatnonzero(_words_of(arrays[name]) != _words_of(other[name]))
        runs = np.split(differs, np.flatnonzero(np.diff(differs) > 1) + 1)
        content = other[name].tobytes()
        parts = [
            (int(8 * run[0]), content[8 * run[0] : 8 * run[-1] + 8]) for run in runs if len(run)
        ]
        if parts:
            patch[name] = parts
    return patch


def _check_independence(sliders: Sequence[Slider]) -> None:
    """Refuse two settings that change the same words: together they would change others.

    Raises:
        InputError: If there are such.
    """
    owners: dict[tuple[str, int], str] = {}
    for slider in sliders:
        for place in {*_places_of(slider)}:
            other = owners.setdefault(place, slider.setting)
            if other != slider.setting:
                problem = f"change the same words of {place[0]}"
                raise InputError(f"{other} and {slider.setting}", problem, "one of them")


def _places_of(slider: Slider) -> Iterator[tuple[str, int]]:
    """The array and the offset of each word that a slider changes."""
    yield from ((word.array, word.offset) for word in slider.recipe)
    for patch in slider.patches:
        for name, parts in patch.items():
            for offset, part in parts:
                yield from ((name, at) for at in range(offset, offset + len(part), 8))


def _bytes_of(array: np.ndarray) -> np.ndarray:
    return array.reshape(-1).view(np.uint8)


def _words_of(array: np.ndarray) -> np.ndarray:
    """The array as integers of eight bytes; zeros fill the last."""
    content = array.tobytes()
    return np.frombuffer(content + bytes(-len(content) % 8), "<i8")


def fields_of(kind: np.dtype) -> dict[str, tuple[int, str, int]]:
    """The fields of a record by name: offset [bytes], type and number of entries."""
    fields = {}
    for name in kind.names or ():
        assert kind.fields
        field, offset = kind.fields[name][:2]
        fields[name] = (offset, field.base.str[1:], int(np.prod(field.shape)))
    return fields


def _describe_array(name: str, array: np.ndarray) -> dict[str, Any]:
    described: dict[str, Any] = {"name": name, "item": array.itemsize, "shape": [*array.shape]}
    if name == "operations":
        described["fill"] = "nan"
    if name not in EMPTY and name not in Integers._fields and array.size:
        described["bytes"] = b64encode(array.tobytes()).decode()
    return described


def _describe_slider(slider: Slider) -> dict[str, Any]:
    described: dict[str, Any] = {"setting": slider.setting, "values": [*slider.values]}
    if slider.recipe:
        described["recipe"] = [[*word] for word in slider.recipe]
    if slider.patches:
        described["patches"] = [
            {
                name: [[offset, b64encode(part).decode()] for offset, part in parts]
                for name, parts in patch.items()
            }
            for patch in slider.patches
        ]
    return described
