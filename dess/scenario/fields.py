"""The fields of a scenario: all constants of the model, and what follows from them alone."""

from fractions import Fraction
from functools import cache
from math import fsum, sqrt
from typing import Annotated, Any

from pydantic import AfterValidator, BeforeValidator, Field, TypeAdapter
from pydantic.fields import FieldInfo

from dess.base.descriptions import Description
from dess.physics.age import Age
from dess.physics.arrivals import MOST_AMOUNT, Arrivals
from dess.physics.charging import Charging, charge_fraction
from dess.physics.chart import MOST_CHARTED, Cell, Chart, Rectangle, chart_at
from dess.physics.energy import Consumption, Wind
from dess.physics.failures import Failures
from dess.physics.fleet import UavType
from dess.physics.radio import Radio
from dess.physics.section import Integer, Number, Section, Strict
from dess.scenario.data_sheet import DataSheet, Units
from dess.scenario.weather import Weather

# Section VI-A: all combinations of five columns and five rows.
PAPER_NODES = tuple((x, y) for x in (3, 8, 13, 18, 23) for y in (6, 11, 16, 21, 26))

# The largest scenario: cells along a side of the grid, nodes, mission slots and UAVs.
MOST_CELLS, MOST_NODES, MOST_SLOTS, MOST_UAVS = 256, 1024, 100_000, 64

MOST_ZONES = 8  # charging zones

# Largest amount of initial data of a node [data units].
MOST_DATA = MOST_AMOUNT

# The fields that go beyond the paper.
SECTIONS = (
    *("arrivals", "age", "charging", "radio", "failures", "wind", "consumption", "fleet"),
    *("data_sheet", "weather"),
)
# The fields of seas that the paper does not have; records are the same with and without them.
GEOMETRY = ("rows", "zones", "no_fly", "names", "moved", "centre")
LANDING = "landing"
MOST_YEAR = 366 * 86_400  # [s]
ZONE_PADS = "zones.pads"  # sets the pads of the zones of ``zones``, and leaves their cells

# The parameters that vary from mission to mission (Table II), in the order in which they are drawn.
SAMPLED = ("uavs", "flying_time", "charge_start", "charge_complete")

# A reward per event. Sums of many of them are still finite, and so are their squares.
Reward = Annotated[Number, Field(ge=-(10**9), le=10**9)]

Longitude = Annotated[Number, Field(ge=-180, le=180)]
Latitude = Annotated[Number, Field(ge=-90, le=90)]


def is_number(value: Any) -> bool:
    """Whether a value is an integer or a float, and no truth value."""
    return isinstance(value, int | float) and not isinstance(value, bool)


def _whole(value: float) -> float:
    """A number without a fraction as an integer: compiled code has one type for all of them."""
    if value == int(value):
        return int(value)
    return value


# Lets a single number stand for a range of one element.
AS_RANGE = BeforeValidator(lambda value: (value, value) if is_number(value) else value)


class Zone(Strict):
    """A further charging zone."""

    cells: Rectangle = Field(description="[x, y, width, height] in cells")
    pads: Integer | None = Field(
        None,
        ge=1,
        description=Description(
            "charging pads of a further zone",
            note="without it, as many as the zone has cells; a zone with 0 is left out",
        ),
    )


class Fields(Strict):
    """The constants of a mission, which are never sampled."""

    # World
    grid: Integer = Field(
        32,
        ge=2,
        le=MOST_CELLS,
        description=Description("cells of the grid from west to east", symbol="M"),
    )
    rows: Integer | None = Field(
        None,
        ge=2,
        le=MOST_CELLS,
        description=Description(
            "cells of the grid from north to south", note="without it, as many as from west to east"
        ),
    )
    cell_size: Number = Field(
        800.0, ge=0.01, le=100_000, description=Description("side of a cell", unit="m", symbol="c")
    )
    altitude: Number = Field(
        10.0, ge=0.01, le=100_000, description=Description("flying altitude", unit="m", symbol="h")
    )
    nodes: tuple[Cell, ...] = Field(
        PAPER_NODES,
        min_length=1,
        max_length=MOST_NODES,
        description=Description("cells of the sensor nodes", form="[x, y] for each"),
    )
    names: tuple[str, ...] = Field(
        (),
        max_length=MOST_NODES,
        description=Description("names of the sensor nodes", form="one for each"),
    )
    moved: tuple[Integer, ...] = Field(
        (),
        max_length=MOST_NODES,
        description=Description(
            "nodes that are not in their own cells", form="their numbers, from 0"
        ),
    )
    zone: Rectangle = Field(
        (26, 2, 4, 4),
        description=Description(
            "start and charging zone", symbol="L", form="[x, y, width, height] in cells"
        ),
    )
    pads: Integer | None = Field(
        None,
        ge=1,
        description=Description("charging pads", note="without it, as many as the zone has cells"),
    )
    zones: tuple[Zone, ...] = Field(
        (),
        max_length=MOST_ZONES - 1,
        description=Description(
            "further charging zones", form="a table of cells and pads for each"
        ),
    )
    no_fly: tuple[Cell, ...] = Field(
        (),
        description=Description(
            "cells that no UAV may enter, such as islands", form="[x, y] for each"
        ),
    )
    centre: tuple[Longitude, Latitude] | None = Field(
        None, description=Description("centre of the grid", unit="degrees", form="[lon, lat]")
    )
    forbid_swaps: bool = Field(False, description="cancel the moves of two UAVs that swap cells")

    # Time
    slot_length: Number = Field(
        1.0,
        ge=1e-6,
        le=1_000_000,
        description=Description("length of a mission slot", symbol="delta_t"),
    )
    communication_slots: Integer = Field(
        4, ge=1, le=64, description=Description("communication slots in a mission slot", symbol="m")
    )
    max_slots: Integer = Field(
        500, ge=1, le=MOST_SLOTS, description="mission slots after which a mission is truncated"
    )
    landing: bool = Field(
        False,
        description=Description(
            "whether missions end on the ground",
            form="UAVs stand in a zone for nothing, and land when their quota is filled",
        ),
    )

    # Energy
    charge_rate: Annotated[Integer | Number, AfterValidator(_whole)] = Field(
        10,
        ge=0.01,
        le=100,
        description=Description(
            "battery gained in a charging slot",
            unit="%",
            note="what is not whole waits for the next",
        ),
    )
    flight_cost: Integer = Field(
        1,
        ge=0,
        le=1,
        description=Description(
            "battery spent in a slot without charging",
            unit="%",
            note="0 to fly without battery decrease (Algorithm 1, phase I)",
        ),
    )

    # Channel
    edge_snr: Number = Field(
        -25.0,
        ge=-300,
        le=300,
        description=Description(
            "mean SNR at half the grid's diagonal, or at radio.anchor", unit="dB"
        ),
    )
    path_loss_exponent: Number = Field(
        2.27, ge=0.01, le=10, description=Description("path loss exponent", symbol="alpha")
    )
    shadowing_variance: Number = Field(
        2.0, ge=0, le=400, description=Description("variance of shadowing", unit="dB^2")
    )

    # Data
    initial_data: Annotated[tuple[Number, Number], AS_RANGE] = Field(
        (5.0, 20.0),
        description=Description(
            "initial data per node", unit="data units", form="a number or [low, high]"
        ),
    )
    arrival_rate: Number = Field(
        0.02,
        ge=0,
        le=100,
        description=Description(
            "new data per node and mission slot", unit="data units", symbol="lambda"
        ),
    )
    quota: Integer = Field(
        440,
        ge=0,
        le=1_000_000,
        description=Description(
            "communication slots that a UAV must fill",
            symbol="U_C",
            note="0, with landing, for none",
            form="UAVs work, and the mission lasts, until max_slots",
        ),
    )

    # Reward (Table III)
    reward_data: Reward = Field(
        1.3, description=Description("reward per data unit that the team collects", symbol="alpha")
    )
    reward_overruled: Reward = Field(
        -1.0,
        description=Description(
            "reward of an action that the safety controller overrules", symbol="beta"
        ),
    )
    reward_depleted: Reward = Field(
        -300.0,
        description=Description(
            "reward of a UAV whose battery is empty before its quota is filled", symbol="nu"
        ),
    )
    reward_charging: Reward = Field(
        0.05, description=Description("reward per charging slot", symbol="c")
    )
    reward_quota: Reward = Field(
        100.0, description=Description("reward of a UAV that fills its quota", symbol="omega")
    )
    reward_step: Reward = Field(
        -0.1, description=Description("reward per mission slot", symbol="zeta")
    )

    # Beyond the paper; off by default
    arrivals: Arrivals = Arrivals.off()
    age: Age = Age.off()
    charging: Charging = Charging.off()
    radio: Radio = Radio.off()
    failures: Failures = Failures.off()
    wind: Wind = Wind.off()
    consumption: Consumption = Consumption.off()
    fleet: tuple[UavType, ...] = Field(
        (),
        max_length=MOST_UAVS,
        description=Description(
            "types of UAVs", form="a table for each; UAV i has type i modulo their number"
        ),
    )
    data_sheet: DataSheet = DataSheet.off()
    weather: Weather = Weather.off()

    @property
    def snr_distance(self) -> float:
        """The distance at which the mean SNR is ``edge_snr`` [m]."""
        columns, rows = self.size
        half = sqrt(2) * sqrt((columns * columns + rows * rows) / 2) * self.cell_size / 2
        return self.radio.anchor or half

    @property
    def size(self) -> tuple[int, int]:
        """The cells of the grid from west to east, and from north to south."""
        return self.grid, self.grid if self.rows is None else self.rows

    @property
    def rectangles(self) -> tuple[Rectangle, ...]:
        """The cells of all charging zones, the start zone first."""
        return (self.zone, *(zone.cells for zone in self.zones))

    @property
    def geometry(self) -> tuple[Any, ...]:
        """The arguments of ``chart_at``: all that the chart is made of."""
        nodes: tuple[Cell, ...] = ()
        if self.size[0] * self.size[1] > MOST_CHARTED:
            nodes = self.nodes
        return *self.size, self.rectangles, self.no_fly, nodes

    @property
    def chart(self) -> Chart:
        """The zones, the no-fly cells and the ways between cells."""
        return chart_at(*self.geometry)

    @property
    def aim(self) -> str:
        """What every UAV of a successful mission has done, in words."""
        if self.landing:
            return "landed"
        return "filled their quota"

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
    def charge_fraction(self) -> Fraction:
        """The battery gained in a charging slot [%], exactly as it or the data sheet was typed."""
        sheet = self.data_sheet
        if sheet.is_on:
            return charge_fraction(sheet.charge_rate)
        return charge_fraction(Fraction(str(self.charge_rate)))

    def battery_of_type(self, kind: UavType) -> int | None:
        """The full battery of a type of UAVs [%]; None if it is that of the others."""
        if kind.endurance is None:
            return None
        return self.data_sheet.battery_of_type(kind)

    def charge_fraction_of_type(self, kind: UavType) -> Fraction | None:
        """What a type of UAVs gains in a charging slot [%]; None if it is what the others gain."""
        if kind.charging is None:
            return None
        return charge_fraction(self.data_sheet.charge_rate_of_type(kind))

    @property
    def is_extended(self) -> bool:
        """Whether the scenario goes beyond the paper, so that records have ``OPERATIONS``."""
        return any(self.has(name) for name in (*SECTIONS, LANDING)) or self.charge_rate % 1 > 0

    @property
    def units(self) -> Units | None:
        """What a slot, a cell and a data unit are; None without a data sheet."""
        if self.data_sheet.is_on:
            return self.data_sheet.units
        return None

    def has(self, section: str) -> bool:
        """Whether a section is on."""
        value = getattr(self, section)
        if isinstance(value, Section):
            return value.is_on
        return bool(value)

    @property
    def longest_slots(self) -> int:
        """The most mission slots that a mission may last, or with weather a year."""
        if self.weather.is_on and self.units:
            return int(MOST_YEAR / self.units.slot)
        return self.max_slots

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
        return fsum(self.message_rates) * highest * self.max_slots

    @property
    def node_rates(self) -> tuple[float, ...]:
        """The arrival rate of each node [data units per slot]."""
        merged = self.arrivals.merged or (1,) * len(self.nodes)
        return self.arrivals.rates or tuple(self.arrival_rate * count for count in merged)

    @property
    def message(self) -> float:
        """What a node makes at once [data units]: a message or packet."""
        return self.arrivals.message or 1.0

    @property
    def message_rates(self) -> tuple[float, ...]:
        """The messages of each node per slot."""
        return tuple(rate / self.message for rate in self.node_rates)

    @property
    def node_data(self) -> tuple[tuple[float, float], ...]:
        """The range of the initial data of each node [data units].

        Of a node that was idle before the mission they are what it has on average.
        """
        if self.arrivals.initial:
            ranges = [(amount, amount) for amount in self.arrivals.initial]
        else:
            low, high = self.initial_data
            merged = self.arrivals.merged or (1,) * len(self.nodes)
            ranges = [(low * count, high * count) for count in merged]
        idle = self.idle_slots
        if not idle:
            return tuple(ranges)
        collected = [rate * idle for rate in self.node_rates]
        return tuple(
            (low + more, high + more) for (low, high), more in zip(ranges, collected, strict=True)
        )

    @property
    def idle_slots(self) -> float:
        """How long nodes have collected data before the mission [slots]; 0 without a data sheet."""
        if not self.data_sheet.is_on:
            return 0.0
        return self.data_sheet.number("idle") / self.data_sheet.units.slot

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


@cache
def fields_of(model: type[Fields]) -> dict[str, FieldInfo]:
    """The fields of a kind of scenario; those of sections are named as ``failures.uav_rate``."""
    fields: dict[str, FieldInfo] = {}
    for name, field in model.model_fields.items():
        kind = field.annotation
        if isinstance(kind, type) and issubclass(kind, Section):
            fields |= {f"{name}.{part}": inner for part, inner in kind.model_fields.items()}
        else:
            fields[name] = field
        if name == "zones":
            fields[ZONE_PADS] = Zone.model_fields["pads"]
    return fields
