"""Scenarios: all constants of the model, and the ranges from which missions draw parameters.

space = load_scenario("paper", uavs=3)             # Table II, with three UAVs
space = ScenarioSpace.of(space, quota=200)         # the same with another quota
scenario = Scenario.of(uavs=2, forbid_swaps=True)  # a single scenario; Table III for the rest
"""

from math import inf
from pathlib import Path
from typing import Annotated, Any, Self

import tomli_w
from pydantic import (
    BaseModel,
    ConfigDict,
    Field,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidationError,
    field_validator,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo

from dess.errors import InputError, one_of, validation_line
from dess.files import Shipped
from dess.sea import Cell, nodes_in
from dess.sections.age import MOST_TEETH, Age
from dess.sections.arrivals import Arrivals, schedule_in
from dess.sections.charging import Charging
from dess.sections.failures import MOST_PADS, Failures
from dess.sections.fleet import UavType, legs, places_per_slot
from dess.sections.section import Integer, Number, Section, tuples
from dess.sections.wind import Wind

_SCENARIOS = Shipped("scenario", "dess", "scenarios")

# Section VI-A: all combinations of five columns and five rows.
PAPER_NODES = tuple((x, y) for x in (3, 8, 13, 18, 23) for y in (6, 11, 16, 21, 26))

# The parameters that vary from mission to mission (Table II), in the order in which they are drawn.
SAMPLED = ("uavs", "flying_time", "charge_start", "charge_complete")

# The fields that go beyond the paper.
EXTENSIONS = ("arrivals", "age", "charging", "failures", "wind", "fleet")

# Largest amount of initial data of a node [data units].
_MOST_DATA = 10**9

# Largest number of entries in the channel's table (dess.channel): 8 GiB if all of it were filled.
_CHANNEL_LIMIT = 2**30

# A reward per event. Sums of many of them are still finite, and so are their squares.
Reward = Annotated[float, Field(ge=-(10**9), le=10**9, allow_inf_nan=False)]


class _Constants(BaseModel):
    """The constants that are never sampled: the common base of both kinds of scenario."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    # World
    grid: Integer = Field(
        32, ge=2, le=256, description="cells along one side of the square grid (M)"
    )
    cell_size: Number = Field(800.0, ge=0.01, le=100_000, description="side of a cell [m] (c)")
    altitude: Number = Field(10.0, ge=0.01, le=100_000, description="flying altitude [m] (h)")
    nodes: tuple[Cell, ...] = Field(
        PAPER_NODES,
        min_length=1,
        max_length=1024,
        description="cells of the sensor nodes: [x, y] for each",
    )
    zone: tuple[int, int, int, int] = Field(
        (26, 2, 4, 4), description="start and charging zone (L): [x, y, width, height] in cells"
    )
    pads: Integer | None = Field(
        None, ge=1, description="charging pads; without it, as many as the zone has cells"
    )
    forbid_swaps: bool = Field(False, description="cancel the moves of two UAVs that swap cells")

    # Time
    slot_length: Number = Field(
        1.0, ge=1e-6, le=1_000_000, description="length of a mission slot (delta_t)"
    )
    communication_slots: Integer = Field(
        4, ge=1, le=64, description="communication slots in a mission slot (m)"
    )
    max_slots: Integer = Field(
        500, ge=1, le=100_000, description="mission slots after which a mission is truncated"
    )

    # Energy
    charge_rate: Integer = Field(
        10, ge=1, le=100, description="battery gained in a charging slot [%]"
    )
    flight_cost: Integer = Field(
        1,
        ge=0,
        le=1,
        description="battery spent in a slot without charging [%]; 0 to fly without battery "
        "decrease (Algorithm 1, phase I)",
    )

    # Channel
    edge_snr: Number = Field(
        -25.0, ge=-300, le=300, description="mean SNR at half the grid's diagonal [dB]"
    )
    path_loss_exponent: Number = Field(
        2.27, ge=0.01, le=10, description="path loss exponent (alpha)"
    )
    shadowing_variance: Number = Field(
        2.0, ge=0, le=400, description="variance of shadowing [dB^2]"
    )

    # Data
    initial_data: tuple[Number, Number] = Field(
        (5.0, 20.0), description="initial data per node [data units]: a number or [low, high]"
    )
    arrival_rate: Number = Field(
        0.02, ge=0, le=100, description="new data per node and mission slot [data units] (lambda)"
    )
    quota: Integer = Field(
        440, ge=1, le=1_000_000, description="communication slots that a UAV must fill (U_C)"
    )

    # Reward (Table III)
    reward_data: Reward = Field(
        1.3, description="reward per data unit that the team collects (alpha)"
    )
    reward_overruled: Reward = Field(
        -1.0, description="reward of an action that the safety controller overrules (beta)"
    )
    reward_depleted: Reward = Field(
        -300.0, description="reward of a UAV whose battery is empty before its quota is filled (nu)"
    )
    reward_charging: Reward = Field(0.05, description="reward per charging slot (c)")
    reward_quota: Reward = Field(100.0, description="reward of a UAV that fills its quota (omega)")
    reward_step: Reward = Field(-0.1, description="reward per mission slot (zeta)")

    # Beyond the paper; off by default
    arrivals: Arrivals = Arrivals.off()
    age: Age = Age.off()
    charging: Charging = Charging.off()
    failures: Failures = Failures.off()
    wind: Wind = Wind.off()
    fleet: tuple[UavType, ...] = Field(
        (),
        max_length=64,
        description="types of UAVs: a table for each; UAV i has type i modulo their number",
    )

    @model_serializer(mode="wrap")
    def _without_what_is_off(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the sections that are off: so scenarios without them are stored as before."""
        values = handler(self)
        return {n: v for n, v in values.items() if n not in EXTENSIONS or self._has(n)}

    @field_validator("nodes", "zone", "fleet", mode="before")
    @classmethod
    def _lists_to_tuples(cls, value: Any) -> Any:
        return tuples(value)

    @field_validator("initial_data", mode="before")
    @classmethod
    def _number_to_range(cls, value: Any) -> Any:
        return (value, value) if _is_number(value) else tuples(value)

    @model_validator(mode="after")
    def _fits_the_grid(self) -> Self:
        x, y, width, height = self.zone
        if min(x, y) < 0 or min(width, height) < 1 or max(x + width, y + height) > self.grid:
            raise ValueError(
                f"zone: {list(self.zone)} does not lie on the {self.grid} x {self.grid} grid; "
                "allowed: [x, y, width, height] with 0 <= x, y and x + width, y + height <= grid"
            )
        for node in self.nodes:
            if not all(0 <= coordinate < self.grid for coordinate in node):
                raise ValueError(
                    f"nodes: {list(node)} is off the grid; allowed: 0 <= x, y < {self.grid}"
                )
        if len(set(self.nodes)) < len(self.nodes):
            twice = next(node for node in self.nodes if self.nodes.count(node) > 1)
            raise ValueError(f"nodes: {list(twice)} is listed twice; allowed: distinct cells")
        steps = 5 * self.grid**2 * len(self.nodes) * self.communication_slots
        places = self.grid**2 * self.communication_slots * places_per_slot(self.fleet)
        if max(steps * legs(self.fleet), places) > _CHANNEL_LIMIT:
            if self.fleet and steps <= _CHANNEL_LIMIT:
                raise ValueError(
                    "fleet: slots_per_cell of the types need too large a table of the channel; "
                    "allowed: smaller or fewer different ones"
                )
            raise ValueError(
                "grid, nodes, communication_slots: too many together; allowed: "
                f"5 * grid^2 * nodes * communication_slots <= {_CHANNEL_LIMIT}"
            )
        if (
            self.age.measured
            and not self.needs_events
            and self.max_slots * self.communication_slots > MOST_TEETH
        ):
            raise ValueError(
                "age.measured: the mission has too many communication slots; allowed: "
                f"max_slots * communication_slots <= {MOST_TEETH}"
            )
        if self.arrivals.rates and len(self.arrivals.rates) != len(self.nodes):
            raise ValueError(
                f"arrivals.rates: there are {len(self.arrivals.rates)} rates for "
                f"{len(self.nodes)} nodes; allowed: a rate per node"
            )
        if self.pads is not None and self.pads > self.zone_cells:
            raise ValueError(
                f"pads: {self.pads} is more than the zone has cells; allowed: 1..{self.zone_cells}"
            )
        if self.failures.pad_rate > 0 and self.charging_pads > MOST_PADS:
            raise ValueError(
                f"pads: {self.charging_pads} are too many to fail; allowed: {MOST_PADS} at most "
                "where failures.pad_rate is above 0"
            )
        low, high = self.initial_data
        if not 0 <= low <= high <= _MOST_DATA:
            raise ValueError(
                f"initial_data: {[low, high]} is not a range; allowed: a number 0..{_MOST_DATA:,} "
                f"or [low, high] with 0 <= low <= high <= {_MOST_DATA:,}"
            )
        return self

    @property
    def zone_cells(self) -> int:
        """Number of cells of the start and charging zone."""
        return self.zone[2] * self.zone[3]

    @property
    def charging_pads(self) -> int:
        """Number of charging pads: ``pads``, or as many as the zone has cells."""
        return self.zone_cells if self.pads is None else self.pads

    @property
    def is_extended(self) -> bool:
        """Whether the scenario goes beyond the paper, so that records have ``OPERATIONS``."""
        return any(self._has(name) for name in EXTENSIONS)

    def _has(self, extension: str) -> bool:
        """Whether an extension is on."""
        value = getattr(self, extension)
        return value.is_on if isinstance(value, Section) else bool(value)

    @property
    def needs_events(self) -> bool:
        """Whether only the SimPy engine can simulate the scenario."""
        return self.arrivals.process != "slotted"

    def value(self, field: str) -> Any:
        """The value of a field; ``failures.uav_rate`` is the field of a section."""
        section, _, name = field.rpartition(".")
        return getattr(getattr(self, section) if section else self, name)

    def plain_value(self, field: str) -> Any:
        """The value of a field as JSON has it: lists for tuples, a dictionary for a type of UAV."""
        return TypeAdapter(Any).dump_python(self.value(field), mode="json")

    def to_toml(self) -> str:
        """The scenario as TOML text that ``load_scenario`` reads back to an equal one."""
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))


class Scenario(_Constants):
    """Every constant of one mission (Sections II and VI-A of the paper), frozen and validated.

    Raises:
        InputError: From ``Scenario.of``, for unknown keys, wrong types and values out of range.
    """

    uavs: Integer = Field(2, ge=1, description="number of UAVs (I)")
    flying_time: Integer = Field(75, ge=1, le=100, description="battery at the start [%] (b(0))")
    charge_start: Integer = Field(
        30, ge=10, le=100, description="battery at which charging may start [%] (C_S)"
    )
    charge_complete: Integer = Field(
        80, ge=10, le=100, description="battery at which charging ends [%] (C_C)"
    )

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        _check_ranges({name: (getattr(self, name),) * 2 for name in SAMPLED}, self.zone_cells)
        return self

    @classmethod
    def of(cls, **values: Any) -> Self:
        """A scenario with the given values, and the paper's values for all other fields.

        Raises:
            InputError: For unknown keys, wrong types and values out of range.
        """
        return _validated(cls, merged({}, values), "scenario")


IntegerRange = tuple[Integer, Integer]


class ScenarioSpace(_Constants):
    """The ranges from which a mission draws its parameters (Table II), both ends included.

    A single value is a range with one element. If one range is narrowed or fixed, the draws of the
    other parameters do not change.
    """

    uavs: IntegerRange = Field((1, 3), description="number of UAVs (I): an integer or [low, high]")
    flying_time: IntegerRange = Field(
        (70, 80), description="battery at the start [%] (b(0)): an integer or [low, high]"
    )
    charge_start: IntegerRange = Field(
        (10, 50),
        description="battery at which charging may start [%] (C_S): an integer or [low, high]",
    )
    charge_complete: IntegerRange = Field(
        (60, 100), description="battery at which charging ends [%] (C_C): an integer or [low, high]"
    )

    @field_validator(*SAMPLED, mode="before")
    @classmethod
    def _integer_to_range(cls, value: Any) -> Any:
        is_integer = isinstance(value, int) and not isinstance(value, bool)
        return (value, value) if is_integer else tuples(value)

    @model_validator(mode="after")
    def _is_consistent(self) -> Self:
        _check_ranges({name: getattr(self, name) for name in SAMPLED}, self.zone_cells)
        return self

    @classmethod
    def of(
        cls, scenario: "Scenario | ScenarioSpace | None" = None, **values: Any
    ) -> "ScenarioSpace":
        """A space of the given values, on top of a scenario or space (default: the paper's)."""
        base = scenario.model_dump() if scenario is not None else {}
        return _validated(cls, merged(base, values), "scenario")

    @property
    def numeric(self) -> list[str]:
        """The fields that hold a number, or a range of numbers."""
        others = (*SAMPLED, "initial_data", "pads")
        names = fields_of(ScenarioSpace)
        return [name for name in names if name in others or _is_number(self.value(name))]

    def limits(self, field: str) -> tuple[float, float]:
        """The least and the largest value that a numeric field may have, infinite without a limit.

        Constraints between fields, such as ``charge_start < charge_complete``, are not included.

        Raises:
            InputError: If the field does not exist, or holds no numbers.
        """
        bounded: dict[str, tuple[float, float]] = {
            "pads": (1, self.zone_cells),
            "initial_data": (0, _MOST_DATA),
            **{name: (low, high) for name, (low, high, _) in _sampled(self.zone_cells).items()},
        }
        if field not in self.numeric:
            raise InputError(f"field: {field!r} is not a number{one_of(field, self.numeric)}")
        if field in bounded:
            return bounded[field]
        metadata = fields_of(ScenarioSpace)[field].metadata
        least = [getattr(m, kind) for m in metadata for kind in ("ge", "gt") if hasattr(m, kind)]
        most = [getattr(m, kind) for m in metadata for kind in ("le", "lt") if hasattr(m, kind)]
        return max(least, default=-inf), min(most, default=inf)

    def scenario_at(self, **parameters: int) -> Scenario:
        """The scenario with the given value for each sampled parameter."""
        return Scenario.of(**(self.model_dump() | parameters))


def load_scenario(name_or_path: str | Path = "paper", /, **overrides: Any) -> ScenarioSpace:
    """A shipped scenario by name, or one from a TOML file.

    Args:
        name_or_path: One of ``scenario_names()``, or the path of a TOML file. In such a file,
            ``nodes`` may be the name of a file in the same folder, which ``dess.sea`` reads.
            The ``schedule`` of ``[arrivals]`` may be a CSV file there (``schedule_in``).
        **overrides: Values that replace those of the file. A sampled field that is set to a single
            value is no longer sampled.

    Raises:
        InputError: If there is no such scenario, or it is not valid.
    """
    where, read = _SCENARIOS.load(name_or_path)
    read.pop("description", None)
    values = merged(read, overrides)
    table = read.get("arrivals")
    schedule = table.get("schedule") if isinstance(table, dict) else None
    if isinstance(schedule, str) and not {"arrivals", "arrivals.schedule"} & {*overrides}:
        values["arrivals"]["schedule"] = schedule_in(_SCENARIOS.folder_of(name_or_path) / schedule)
    if isinstance(read.get("nodes"), str) and "nodes" not in overrides:
        without = _validated(ScenarioSpace, values | {"nodes": [[0, 0]], "arrivals": {}}, where)
        path = _SCENARIOS.folder_of(name_or_path) / read["nodes"]
        values["nodes"] = nodes_in(path, without.grid, without.cell_size)
    return _validated(ScenarioSpace, values, where)


def fields_of(model: type[_Constants]) -> dict[str, FieldInfo]:
    """The fields of a kind of scenario; those of sections are named as ``failures.uav_rate``."""
    found: dict[str, FieldInfo] = {}
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Section):
            found |= {f"{name}.{part}": inner for part, inner in kind.model_fields.items()}
        else:
            found[name] = field
    return found


def merged(base: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """Values on top of others; ``failures.uav_rate`` and a table replace parts of a section."""
    result = dict(base)
    for name, value in values.items():
        section, _, part = name.partition(".")
        table = {part: value} if part else value
        before = result.get(section)
        if (
            section in EXTENSIONS
            and isinstance(table, dict)
            and (before is None or isinstance(before, dict))
        ):
            result[section] = (before or {}) | table
        else:
            result[name] = value
    return result


def dotted(values: dict[str, Any]) -> dict[str, Any]:
    """Values by field: the table of a section becomes fields such as ``failures.uav_rate``."""
    fields: dict[str, Any] = {}
    for name, value in values.items():
        if name in EXTENSIONS and isinstance(value, dict):
            fields |= {f"{name}.{part}": of_part for part, of_part in value.items()}
        else:
            fields[name] = value
    return fields


def scenario_names() -> list[str]:
    """The names of the shipped scenarios."""
    return _SCENARIOS.names()


def scenario_description(name_or_path: str | Path) -> str:
    """What a scenario is about, as its file says under ``description``.

    Raises:
        InputError: If there is no such scenario.
    """
    return str(_SCENARIOS.load(name_or_path)[1].get("description", ""))


def _validated(model: type[BaseModel], values: dict[str, Any], where: str) -> Any:
    try:
        return model.model_validate(values)
    except ValidationError as error:
        raise InputError(validation_line(error, where, model)) from None


def _is_number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _sampled(zone_cells: int) -> dict[str, tuple[int, int, str]]:
    """For each sampled parameter the least and the largest value, and the reason for them."""
    return {
        "uavs": (1, min(zone_cells, 64), "cells of the zone, at most 64"),
        "flying_time": (1, 100, "battery capacity"),
        "charge_start": (10, 100, "eq. 1"),
        "charge_complete": (10, 100, "eq. 1"),
    }


def _check_ranges(ranges: dict[str, tuple[int, int]], zone_cells: int) -> None:
    """Check the limits of the sampled parameters and the constraints between them (eq. 1)."""
    limits = _sampled(zone_cells)
    for name, (low, high) in ranges.items():
        least, most, reason = limits[name]
        if not least <= low <= high <= most:
            shown = low if low == high else [low, high]
            raise ValueError(f"{name}: {shown} is not within {least}..{most} ({reason})")
    start, complete = ranges["charge_start"][1], ranges["charge_complete"][0]
    if start >= complete:
        raise ValueError(
            f"charge_start: {start} is not below charge_complete {complete}; "
            "allowed: 10 <= charge_start < charge_complete <= 100 (eq. 1)"
        )
