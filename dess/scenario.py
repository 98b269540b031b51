"""Scenarios: all constants of the model, and the ranges from which missions draw parameters.

space = load_scenario("paper", uavs=3)             # Table II, with three UAVs
space = ScenarioSpace.of(space, quota=200)         # the same with another quota
scenario = Scenario.of(uavs=2, forbid_swaps=True)  # a single scenario; Table III for the rest
"""

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from functools import cache, partial
from math import inf
from pathlib import Path
from typing import Annotated, Any, Self

import numpy as np
import tomli_w
from pydantic import (
    BeforeValidator,
    Field,
    SerializerFunctionWrapHandler,
    TypeAdapter,
    ValidationError,
    ValidationInfo,
    model_serializer,
    model_validator,
)
from pydantic.fields import FieldInfo

from dess.errors import InputError, check_type, listed, one_of, shown, validated
from dess.files.reading import Shipped, parse_toml
from dess.sea.chart import (
    FAR,
    MOST_CHARTED,
    NO_FLY,
    Cell,
    Chart,
    Rectangle,
    chart_at,
    parking_of,
    spread,
    zones_of,
)
from dess.sea.families import FAMILIES, is_generated, sea_of
from dess.sea.own import OwnSea, unread
from dess.sections.age import MOST_TEETH, Age
from dess.sections.arrivals import MOST as MOST_RATE
from dess.sections.arrivals import Arrivals
from dess.sections.charging import Charging
from dess.sections.data_sheet import OPEN, DataSheet, Units
from dess.sections.failures import MOST_PADS, Failures
from dess.sections.fleet import UavType, legs, places_per_slot
from dess.sections.radio import Radio
from dess.sections.section import Integer, Number, Section, Strict, tuples
from dess.sections.wind import Wind

# Section VI-A: all combinations of five columns and five rows.
PAPER_NODES = tuple((x, y) for x in (3, 8, 13, 18, 23) for y in (6, 11, 16, 21, 26))

# The largest scenario: cells along a side of the grid, nodes, mission slots and UAVs.
MOST_CELLS, MOST_NODES, MOST_SLOTS, MOST_UAVS = 256, 1024, 100_000, 64

MOST_ZONES = 8  # charging zones

# Largest amount of initial data of a node [data units].
MOST_DATA = 10**9

# Largest number of packets of a mission with continuous arrivals, at their highest rate: some 70
# bytes each, and less than a second of compiled code to draw them all.
MOST_PACKETS = 2_000_000

# Largest number of entries in the channel's table (dess.channel): 8 GiB if all of it were filled.
MOST_ENTRIES = 2**30

# The fields that go beyond the paper.
SECTIONS = ("arrivals", "age", "charging", "radio", "failures", "wind", "fleet", "data_sheet")
# The fields of seas that the paper does not have; records are the same with and without them.
GEOMETRY = ("rows", "zones", "no_fly", "names", "moved", "centre")
LANDING = "landing"
ZONE_PADS = "zones.pads"  # sets the pads of the zones of ``zones``, and leaves their cells

# The parameters that vary from mission to mission (Table II), in the order in which they are drawn.
SAMPLED = ("uavs", "flying_time", "charge_start", "charge_complete")

# What a design calls the scenario of its points, if it differs from point to point.
SEA = "scenario"

_SCENARIOS = Shipped("scenario", "dess", "scenarios")

# The context of a scenario whose cells may be where they must not be.
DRAFT = "draft"

# A reward per event. Sums of many of them are still finite, and so are their squares.
Reward = Annotated[Number, Field(ge=-(10**9), le=10**9)]

Longitude = Annotated[Number, Field(ge=-180, le=180)]
Latitude = Annotated[Number, Field(ge=-90, le=90)]


def is_number(value: Any) -> bool:
    """Whether a value is an integer or a float, and no truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


# Lets a single number stand for a range of one element.
AS_RANGE = BeforeValidator(lambda value: (value, value) if is_number(value) else value)


class Zone(Strict):
    """A further charging zone."""

    cells: Rectangle = Field(description="[x, y, width, height] in cells")
    pads: Integer | None = Field(
        None,
        ge=1,
        description="charging pads of a further zone; without it, as many as the zone has cells",
    )


class Constants(Strict):
    """The common base of both kinds of scenario: the constants, which are never sampled."""

    # World
    grid: Integer = Field(
        32, ge=2, le=MOST_CELLS, description="cells of the grid from west to east (M)"
    )
    rows: Integer | None = Field(
        None,
        ge=2,
        le=MOST_CELLS,
        description="cells of the grid from north to south; without it, as many as from west to "
        "east",
    )
    cell_size: Number = Field(800.0, ge=0.01, le=100_000, description="side of a cell [m] (c)")
    altitude: Number = Field(10.0, ge=0.01, le=100_000, description="flying altitude [m] (h)")
    nodes: tuple[Cell, ...] = Field(
        PAPER_NODES,
        min_length=1,
        max_length=MOST_NODES,
        description="cells of the sensor nodes: [x, y] for each",
    )
    names: tuple[str, ...] = Field(
        (), max_length=MOST_NODES, description="names of the sensor nodes: one for each"
    )
    moved: tuple[Integer, ...] = Field(
        (),
        max_length=MOST_NODES,
        description="nodes that are not in their own cells: their numbers, from 0",
    )
    zone: Rectangle = Field(
        (26, 2, 4, 4), description="start and charging zone (L): [x, y, width, height] in cells"
    )
    pads: Integer | None = Field(
        None, ge=1, description="charging pads; without it, as many as the zone has cells"
    )
    zones: tuple[Zone, ...] = Field(
        (),
        max_length=MOST_ZONES - 1,
        description="further charging zones: a table of cells and pads for each",
    )
    no_fly: tuple[Cell, ...] = Field(
        (), description="cells that no UAV may enter, such as islands: [x, y] for each"
    )
    centre: tuple[Longitude, Latitude] | None = Field(
        None, description="centre of the grid [degrees]: [lon, lat]"
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
        500, ge=1, le=MOST_SLOTS, description="mission slots after which a mission is truncated"
    )
    landing: bool = Field(
        False,
        description="whether missions end on the ground: UAVs stand in a zone for nothing, and "
        "land when their quota is filled",
    )

    # Energy
    charge_rate: Integer | Number = Field(
        10,
        ge=0.01,
        le=100,
        description="battery gained in a charging slot [%]; what is not whole waits for the next",
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
        -25.0,
        ge=-300,
        le=300,
        description="mean SNR at half the grid's diagonal, or at radio.anchor [dB]",
    )
    path_loss_exponent: Number = Field(
        2.27, ge=0.01, le=10, description="path loss exponent (alpha)"
    )
    shadowing_variance: Number = Field(
        2.0, ge=0, le=400, description="variance of shadowing [dB^2]"
    )

    # Data
    initial_data: Annotated[tuple[Number, Number], AS_RANGE] = Field(
        (5.0, 20.0), description="initial data per node [data units]: a number or [low, high]"
    )
    arrival_rate: Number = Field(
        0.02, ge=0, le=100, description="new data per node and mission slot [data units] (lambda)"
    )
    quota: Integer = Field(
        440,
        ge=0,
        le=1_000_000,
        description="communication slots that a UAV must fill (U_C); 0, with landing, for none: "
        "UAVs work until max_slots",
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
    radio: Radio = Radio.off()
    failures: Failures = Failures.off()
    wind: Wind = Wind.off()
    fleet: tuple[UavType, ...] = Field(
        (),
        max_length=MOST_UAVS,
        description="types of UAVs: a table for each; UAV i has type i modulo their number",
    )
    data_sheet: DataSheet = DataSheet.off()

    @model_validator(mode="before")
    @classmethod
    def _follow_the_data_sheet(cls, values: Any) -> Any:
        """Add the fields that follow from the data sheet, which may not be given as well."""
        sheet = values.get("data_sheet") if isinstance(values, dict) else None
        try:
            found = DataSheet.model_validate(sheet or {})
        except ValidationError:  # it is told where the field is validated
            return values
        if not found.is_on:
            return values
        values = {n: dict(of) if isinstance(of, Section) else of for n, of in values.items()}
        for name in sorted(found.fields().keys() & dotted(values).keys() - {*OPEN}):
            raise InputError(f"{name}: follows from the data sheet; allowed: without this field")
        return merged(found.fields(), values)

    @model_serializer(mode="wrap")
    def _without_what_is_off(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        """Leave out the sections that are off: so scenarios without them are stored as before.

        What follows from a data sheet is left out as well.
        """
        optional = (*SECTIONS, *GEOMETRY, *(() if self.data_sheet.is_on else (LANDING,)))
        off = [name for name in optional if not self.has(name)]
        values = {name: value for name, value in handler(self).items() if name not in off}
        if not self.data_sheet.is_on:
            return values
        follows = {
            name
            for name, value in self.data_sheet.fields().items()
            if self.value(name) in (value, (value, value))
        }
        return merged({n: of for n, of in dotted(values).items() if n not in follows}, {})

    @model_validator(mode="after")
    def _is_consistent(self, info: ValidationInfo) -> Self:
        checks = (_off_the_grid, _too_large, _unreachable, _unfit, _out_of_range)
        for check in () if info.context == DRAFT else checks:
            for problem in check(self):
                raise ValueError(problem)
        return self

    @classmethod
    def of(cls, scenario: "AnyScenario | None" = None, **values: Any) -> Self:
        """A scenario of the given values, on top of another one (default: the paper's).

        Raises:
            InputError: For unknown names and keys, wrong types and values out of range.
        """
        base = loaded(scenario).model_dump() if scenario is not None else {}
        return validated(cls, merged(base, values), "scenario")

    @property
    def size(self) -> tuple[int, int]:
        """The cells of the grid from west to east, and from north to south."""
        return self.grid, self.grid if self.rows is None else self.rows

    @property
    def rectangles(self) -> tuple[Rectangle, ...]:
        """The cells of all charging zones, the start zone first."""
        return (self.zone, *(zone.cells for zone in self.zones))

    @property
    def chart(self) -> Chart:
        """The zones, the no-fly cells and the ways between cells."""
        nodes = self.nodes if self.size[0] * self.size[1] > MOST_CHARTED else ()
        return chart_at(*self.size, self.rectangles, self.no_fly, nodes)

    @property
    def aim(self) -> str:
        """What every UAV of a successful mission has done, in words."""
        return "landed" if self.landing else "filled their quota"

    @property
    def zone_cells(self) -> int:
        """Number of cells of the start and charging zone."""
        return self.zone[2] * self.zone[3]

    @property
    def zone_pads(self) -> tuple[int, ...]:
        """The charging pads of each zone; by default, as many as the zone has cells."""
        pads = self.pads, *(zone.pads for zone in self.zones)
        cells = zip(self.rectangles, pads, strict=True)
        return tuple(width * height if n is None else n for (*_, width, height), n in cells)

    @property
    def charging_pads(self) -> int:
        """Number of charging pads of all zones together."""
        return sum(self.zone_pads)

    @property
    def is_extended(self) -> bool:
        """Whether the scenario goes beyond the paper, so that records have ``OPERATIONS``."""
        return any(self.has(name) for name in (*SECTIONS, LANDING)) or self.charge_rate % 1 > 0

    @property
    def units(self) -> Units | None:
        """What a slot, a cell and a data unit are; None without a data sheet."""
        return self.data_sheet.units if self.data_sheet.is_on else None

    def has(self, section: str) -> bool:
        """Whether a section is on."""
        value = getattr(self, section)
        return value.is_on if isinstance(value, Section) else bool(value)

    @property
    def needs_events(self) -> bool:
        """Whether only the SimPy engine can simulate the scenario."""
        return self.arrivals.process != "slotted"

    @property
    def packets(self) -> float:
        """The packets of a mission with continuous arrivals at their highest rate; otherwise 0."""
        if not self.needs_events:
            return 0.0
        highest = max([1.0, *(factor for _, factor in self.arrivals.schedule)])
        return sum(self.node_rates) * highest * self.max_slots

    @property
    def node_rates(self) -> tuple[float, ...]:
        """The arrival rate of each node [data units per slot]."""
        merged = self.arrivals.merged or (1,) * len(self.nodes)
        return self.arrivals.rates or tuple(self.arrival_rate * count for count in merged)

    @property
    def node_data(self) -> tuple[tuple[float, float], ...]:
        """The range of the initial data of each node [data units]."""
        if self.arrivals.initial:
            return tuple((amount, amount) for amount in self.arrivals.initial)
        low, high = self.initial_data
        merged = self.arrivals.merged or (1,) * len(self.nodes)
        return tuple((low * count, high * count) for count in merged)

    def value(self, field: str) -> Any:
        """The value of a field; ``failures.uav_rate`` is the field of a section."""
        if field == ZONE_PADS:
            return self.zone_pads[1:]
        section, _, name = field.rpartition(".")
        return getattr(getattr(self, section) if section else self, name)

    def plain_value(self, field: str) -> Any:
        """The value of a field as JSON has it: lists for tuples, a dictionary for a type of UAV."""
        return TypeAdapter(Any).dump_python(self.value(field), mode="json")

    @property
    def numeric(self) -> list[str]:
        """The fields that hold a number, or a range of numbers."""
        others = (*SAMPLED, "initial_data", "pads", *([ZONE_PADS] if self.zones else []))
        return [
            name for name in fields_of(type(self)) if name in others or is_number(self.value(name))
        ]

    def limits(self, field: str) -> tuple[float, float]:
        """The least and the largest value that a numeric field may have, infinite without a limit.

        Constraints between fields, such as ``charge_start < charge_complete``, are not included.

        Raises:
            InputError: If the field does not exist, or holds no numbers.
        """
        if field not in self.numeric:
            raise InputError(f"field: {field!r} is not a number{one_of(field, self.numeric)}")
        return self._limits(field)

    def _limits(self, field: str) -> tuple[float, float]:
        between = {
            "uavs": (1, min(self.zone_cells, MOST_UAVS)),
            "pads": (1, self.zone_cells),
            ZONE_PADS: (1, min((w * h for *_, w, h in self.rectangles[1:]), default=1)),
            "initial_data": (0, MOST_DATA),
        }
        limits = fields_of(Scenario)[field].metadata
        least = [m.ge for m in limits if hasattr(m, "ge")]
        most = [m.le for m in limits if hasattr(m, "le")]
        return between.get(field) or (max(least, default=-inf), min(most, default=inf))

    def to_toml(self) -> str:
        """The scenario as TOML text that ``load_scenario`` reads back to an equal one."""
        return tomli_w.dumps(self.model_dump(mode="json", exclude_none=True))


def merged(base: dict[str, Any], values: dict[str, Any]) -> dict[str, Any]:
    """Values on top of others; ``failures.uav_rate`` and a table replace parts of a section.

    ``zones.pads`` replaces the pads of the further zones: a number for all, or one for each.

    Raises:
        InputError: If ``zones.pads`` has another length than ``zones``.
    """
    result: dict[str, Any] = {}
    if "nodes" in values:  # the names are those of others
        base = {name: value for name, value in base.items() if name not in ("names", "moved")}
    for name, value in (dotted(base) | dotted(values)).items():
        section, _, part = name.partition(".")
        table = result.setdefault(section, {}) if part and section in SECTIONS else None
        if isinstance(table, dict):
            table[part] = value
        else:
            result[name] = value
    if ZONE_PADS in result:
        pads, zones = tuples(result.pop(ZONE_PADS)), result.get("zones") or ()
        each = pads if isinstance(pads, list | tuple) else [pads] * len(zones)
        if not zones or len(each) != len(zones):
            allowed = f"a number, or a list of {len(zones)}" if zones else "with further zones"
            raise InputError(f"{ZONE_PADS}: {shown(pads)} does not fit; allowed: {allowed}")
        result["zones"] = [{**zone, "pads": n} for zone, n in zip(zones, each, strict=True)]
    return result


def dotted(values: dict[str, Any]) -> dict[str, Any]:
    """Values by field: the table of a section becomes fields such as ``failures.uav_rate``."""
    fields: dict[str, Any] = {}
    for name, value in values.items():
        if name in (*SECTIONS, "zones") and isinstance(value, dict):
            fields |= {f"{name}.{part}": of_part for part, of_part in value.items()}
        else:
            fields[name] = value
    return fields


class Scenario(Constants):
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


IntegerRange = Annotated[tuple[Integer, Integer], AS_RANGE]


class ScenarioSpace(Constants):
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

    def scenario_at(self, **parameters: int) -> Scenario:
        """The scenario with the given value for each sampled parameter."""
        return Scenario.of(self, **parameters)


@cache
def fields_of(model: type[Constants]) -> dict[str, FieldInfo]:
    """The fields of a kind of scenario; those of sections are named as ``failures.uav_rate``."""
    found: dict[str, FieldInfo] = {}
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Section):
            found |= {f"{name}.{part}": inner for part, inner in kind.model_fields.items()}
        else:
            found[name] = field
        if name == "zones":
            found[ZONE_PADS] = Zone.model_fields["pads"]
    return found


def load_scenario(name_or_path: str | Path = "paper", /, **overrides: Any) -> ScenarioSpace:
    """A shipped scenario by name, a generated one by family and seed, or one from a TOML file.

    Args:
        name_or_path: One of ``scenario_names()``, a sea such as ``archipelago:7``
            (``dess.sea.families``), or the path of a TOML file. In such a file, ``nodes`` and
            ``no_fly`` may name files in its folder, and zones may have degrees (``dess.sea.own``).
        **overrides: Values that replace those of the file. A sampled field that is set to a single
            value is no longer sampled.

    Raises:
        InputError: If there is no such scenario, or it is not valid.
    """
    return _load(name_or_path, overrides)


def draft_scenario(name_or_path: str | Path, /, **overrides: Any) -> ScenarioSpace:
    """The scenario that ``load_scenario`` loads or refuses for where its cells are, to be drawn."""
    return _load(name_or_path, overrides, DRAFT)


def parsed_scenario(text: str, path: Path) -> ScenarioSpace:
    """The scenario that ``load_scenario`` would load if a file had this text."""
    return _load(path, {}, found=(str(path), parse_toml(text, str(path))))


def _load(
    name_or_path: str | Path, overrides: dict[str, Any], context: str = "", found: Any = None
) -> ScenarioSpace:
    where, read = found or _read(name_or_path)
    read.pop("description", None)
    values = merged(read, overrides)
    if named := unread(read) | unread(values):
        draft = validated(ScenarioSpace, values | named, where, DRAFT)
        own = OwnSea(where, partial(_SCENARIOS.beside, name_or_path), draft)
        given = {field: of for field, of in values.items() if field not in unread(values)}
        values = merged(own.placed(values, read.get("nodes")), given)
    return validated(ScenarioSpace, values, where, context)


# What a function takes for a scenario: one, or what ``load_scenario`` takes.
AnyScenario = Constants | str | Path
_NAMED = "a name such as paper, or the path of a TOML file"


def loaded(scenario: AnyScenario) -> Constants:
    """A scenario, or the one that has this name or path.

    Raises:
        InputError: If there is no such scenario, or this is neither a scenario nor a name.
    """
    check_type("scenario", scenario, AnyScenario, f"{_NAMED}, Scenario or ScenarioSpace")
    return load_scenario(scenario) if isinstance(scenario, str | Path) else scenario


def scenario_names() -> list[str]:
    """The names of the shipped scenarios."""
    return _SCENARIOS.names()


def scenario_at(base: str | Path, values: Mapping[str, Any], /, **overrides: Any) -> ScenarioSpace:
    """The scenario of a design point: ``scenario`` among its values names another sea.

    Args:
        base: The scenario if the values name none.
        values: Fields of the scenario, and perhaps ``scenario``.
        **overrides: Fields that are set in both.

    Raises:
        InputError: If it does not exist, is a file, or is not valid.
    """
    name = values.get(SEA, base)
    if SEA in values and not (isinstance(name, str) and is_scenario_name(name)):
        known = [*scenario_names(), *scenario_families()]
        raise InputError(f"{SEA}: {shown(name)} is unknown{one_of(name, known)}")
    fields = {field: value for field, value in values.items() if field != SEA}
    return load_scenario(name, **overrides, **fields)


def scenario_families() -> dict[str, str]:
    """The families of generated seas as ``FAMILY:SEED``, each with its description."""
    return {f"{name}:SEED": f"{f.description}, e.g. {name}:7" for name, f in FAMILIES.items()}


def is_scenario_name(name: str) -> bool:
    """Whether a scenario is named by what is shipped or generated, and not by its file."""
    return name in scenario_names() or is_generated(name)


def scenario_description(name_or_path: str | Path) -> str:
    """What a scenario is about, as its file says under ``description``.

    Raises:
        InputError: If there is no such scenario.
    """
    return str(_read(name_or_path)[1].get("description", ""))


def _read(name_or_path: str | Path) -> tuple[str, dict[str, Any]]:
    """The name or path of a scenario, for messages, and its fields."""
    check_type("scenario", name_or_path, str | Path, _NAMED)
    name = str(name_or_path)
    if is_generated(name):
        return f"scenario {name}", sea_of(name)
    return _SCENARIOS.load(name_or_path, others=scenario_families())


# --- what no field can check alone ---


def _off_the_grid(c: Constants) -> Iterator[str]:
    columns, rows = c.size
    cells: Counter[Cell] = Counter()
    for number, (x, y, width, height) in enumerate(c.rectangles):
        name = f"zones.{number - 1}.cells" if number else "zone"
        if min(x, y) < 0 or min(width, height) < 1 or x + width > columns or y + height > rows:
            yield (
                f"{name}: {[x, y, width, height]} does not lie on the {columns} x {rows} grid; "
                "allowed: [x, y, width, height] with 0 <= x, y and x + width, y + height <= grid"
            )
            return
        cells.update((x + i % width, y + i // width) for i in range(width * height))
    for cell, count in cells.items():
        if count > 1:
            yield f"zones: two zones have the cell {[*cell]}; allowed: zones without common cells"
    size = f"0 <= x < {columns}, 0 <= y < {rows}" if c.rows else f"0 <= x, y < {columns}"
    for name, names in (("nodes", c.names), ("no_fly", ())):
        places = getattr(c, name)
        beyond = [n for n, (x, y) in enumerate(places) if not (0 <= x < columns and 0 <= y < rows)]
        if beyond:
            yield f"{name}: {_titles(beyond, places, names)} off the grid; allowed: {size}"
        if twice := [places.index(cell) for cell, count in Counter(places).items() if count > 1]:
            yield f"{name}: {_titles(twice, places, names)} listed twice; allowed: distinct cells"


def _titles(
    numbers: Sequence[int],
    cells: Sequence[Cell],
    names: Sequence[str],
    verbs: tuple[str, str] = ("is", "are"),
) -> str:
    """Some of these cells, with their names if they have some, and the verb."""
    known = [
        f"{names[n]} at {[*cells[n]]}" if len(names) > n else f"{[*cells[n]]}" for n in numbers
    ]
    return f"{listed(known)} {verbs[len(known) > 1]}"


def _too_large(c: Constants) -> Iterator[str]:
    """The tables of a mission fit into memory."""
    ways, (columns, rows) = max(5 * len(c.nodes) * legs(c.fleet), places_per_slot(c.fleet)), c.size
    if columns * rows * c.communication_slots * ways > MOST_ENTRIES:
        yield (
            "grid, nodes, communication_slots, fleet: too large together; allowed: 5 * grid^2 * "
            f"nodes * communication_slots <= {MOST_ENTRIES}, and less with slots_per_cell"
        )
    charted = len(c.nodes) + sum(width * height for *_, width, height in c.rectangles)
    if c.no_fly and columns * rows > MOST_CHARTED and charted * columns * rows > MOST_CHARTED**2:
        yield (
            f"no_fly: the {columns} x {rows} grid is too large; allowed: at most "
            f"{MOST_CHARTED**2 // (columns * rows):,} nodes and cells of zones on so many cells"
        )
    has_teeth = c.age.measured and not c.needs_events
    if has_teeth and c.max_slots * c.communication_slots > MOST_TEETH:
        yield (
            "age.measured: the mission has too many communication slots; allowed: "
            f"max_slots * communication_slots <= {MOST_TEETH}"
        )
    if c.packets > MOST_PACKETS:
        yield (
            f"arrivals: {c.packets:,.0f} packets at the highest rate; allowed: "
            f"{MOST_PACKETS:,} at most (rates of all nodes * highest factor * max_slots)"
        )


def _unreachable(c: Constants) -> Iterator[str]:
    """The cells of zones and nodes that no UAV can reach from the start zone."""
    if not c.no_fly:
        return
    zones = zones_of(*c.size, (), c.no_fly)
    x, y, *_ = c.zone
    ways = spread(zones, np.array([[x, y]]))[0].reshape(zones.shape)
    for name, cells, names in (("zone", parking_of(c.rectangles), ()), ("nodes", c.nodes, c.names)):
        cut = [n for n, cell in enumerate(cells) if ways[cell[::-1]] == FAR]
        closed = [n for n in cut if zones[cells[n][::-1]] == NO_FLY]
        lost = [n for n in cut if n not in closed and zones[y, x] != NO_FLY]
        kind = "a no-fly cell" if len(closed) == 1 else "no-fly cells"
        problems = [f"{_titles(closed, cells, names)} {kind}"] if closed else []
        if lost:
            problems.append(f"{_titles(lost, cells, names, ('cannot', 'cannot'))} be reached")
        if problems:
            allowed = "cells with a way from the start zone"
            yield f"{name}: {', and '.join(problems)}; allowed: {allowed}"


def _unfit(c: Constants) -> Iterator[str]:
    """The rates, the pads and the initial data fit to the nodes and the zones."""
    count, (low, high) = len(c.nodes), c.initial_data
    if c.data_sheet.is_on:
        if c.data_sheet.data_rate is None:
            yield f"data_sheet.data_rate: is missing; allowed: {DataSheet.form_of('data_rate')}"
        full = c.data_sheet.fields()["charge_complete"]
        for name in ("flying_time", "charge_complete"):
            if np.max(c.value(name)) > full:
                yield f"{name}: {c.value(name)} is more than the reserve leaves; allowed: {full}"
    if c.quota == 0 and not c.landing:
        yield "quota: 0 needs landing; allowed: 1..1000000, or landing = true"
    for name in ("names", "arrivals.rates", "arrivals.initial", "arrivals.merged"):
        if len(c.value(name)) not in (0, count):
            yield f"{name}: there are {len(c.value(name))}; allowed: {count}, one per node"
    if max(c.node_rates) > MOST_RATE:
        yield f"arrivals.merged: a node has the rate {max(c.node_rates):g}; allowed: {MOST_RATE}"
    for number, ((*_, width, height), pads) in enumerate(
        zip(c.rectangles, c.zone_pads, strict=True)
    ):
        name, cells = f"zones.{number - 1}.pads" if number else "pads", width * height
        if pads > cells:
            yield f"{name}: {pads} is more than the zone has cells; allowed: 1..{cells}"
    if 0 < c.radio.range <= c.altitude:
        yield f"radio.range: {c.radio.range:g} m is too short; allowed: above {c.altitude:g} m"
    if c.failures.pad_rate > 0 and c.charging_pads > MOST_PADS:
        yield f"pads: {c.charging_pads} are too many to fail; allowed: {MOST_PADS} at most"
    if not 0 <= low <= high <= MOST_DATA:
        yield (
            f"initial_data: {[low, high]} is not a range; allowed: a number 0..{MOST_DATA:,} "
            f"or [low, high] with 0 <= low <= high <= {MOST_DATA:,}"
        )


def _out_of_range(c: Constants) -> Iterator[str]:
    """The sampled parameters lie within their limits, and C_S is below C_C."""
    values = {name: getattr(c, name) for name in SAMPLED}
    ends = {name: (of, of) if is_number(of) else of for name, of in values.items()}
    for name, (low, high) in ends.items():
        least, most = c._limits(name)
        if not least <= low <= high <= most:
            given = low if low == high else [low, high]
            reason = f" (cells of the zone, at most {MOST_UAVS})" if name == "uavs" else ""
            yield f"{name}: {given} is out of range; allowed: {least}..{most}{reason}"
    start, complete = ends["charge_start"][1], ends["charge_complete"][0]
    if start >= complete:
        yield (
            f"charge_start: {start} is not below charge_complete {complete}; "
            "allowed: 10 <= charge_start < charge_complete <= 100 (eq. 1)"
        )
