"""The record of a mission: a row of metrics, a row per UAV and, on demand, the event log."""

from collections.abc import Iterable
from dataclasses import dataclass
from math import isnan
from typing import Any, NamedTuple

import numpy as np

from dess.base.kernels import inlined, kernel
from dess.model.events import EventLog
from dess.model.rules import data_left
from dess.model.state import BATTERY, END_NAMES, LANDED, LOST, QUOTA, fields
from dess.physics.age import age_of_node, write_age
from dess.physics.charging import write_use
from dess.physics.energy import PERCENT, slot_cost_at
from dess.physics.failures import write_failures
from dess.physics.section import for_sections
from dess.scenario.scenario import Constants, ScenarioSpace

# One mission. Data are in data units; rewards are summed over the slots and the UAVs (eq. 14).
MISSION_RECORD = np.dtype(
    [
        ("seed", np.uint64),
        *fields(np.int64, "replication uavs flying_time charge_start charge_complete"),
        *fields(np.int64, "slots uav_slots success"),
        *fields(np.float64, "collection_ratio collection_ratio_and_communication"),
        *fields(np.float64, "initial arrived collected residual reward"),
        ("home", np.int64),  # 1 if every UAV ended with the battery for its way home, else 0
    ]
)

# One UAV of a mission; ``quota`` are the communications counted toward it. Where a mission has
# fewer UAVs than the array, the other rows have end 0.
UAV_RECORD = np.dtype(
    [
        *fields(np.int64, "quota battery slots_flying slots_charging slots_waiting end"),
        *fields(np.float64, "collected reward"),
        ("way_home", np.int64),  # the battery for its shortest way to a zone cell [%]
        ("charged", np.int64),  # the battery that its charges have added [%]
        # 1 if it is lost: its battery was empty, it failed for good, or it floats out at sea.
        ("down", np.int64),
    ]
)

# What extended scenarios measure beyond the paper's metrics; nan where a scenario does not measure
# it. Times are in mission slots, data in data units.
OPERATIONS = np.dtype(
    [
        # The age of information: its mean over time and nodes, the mean of the ages just before
        # newer data were collected, and its 99th percentile over time and nodes.
        *fields(np.float64, "age peak_age age_p99"),
        # Packets: their mean time from generation to delivery, its 99th percentile, and their
        # numbers; then the data lost by full buffers and failures.
        *fields(np.float64, "latency latency_p99 generated delivered lost_packets lost"),
        # UAVs that wait for a pad, mean over time; their mean time from the request to its grant or
        # withdrawal; how often they have asked; the mean share of the pads in use.
        *fields(np.float64, "queue waiting pad_requests utilisation"),
        *fields(np.float64, "failures slots_grounded"),  # of UAVs
    ]
)

# The same of a year at sea (``dess.model.campaign``): ``success`` and ``home`` are the shares of
# its windows that have it. Then the share of the data that is on land later than ``due``, the
# share of the operating hours that was open, the number of windows, and the longest time without
# one [h].
YEAR_RECORD = np.dtype(
    [
        (name, np.float64 if name in ("success", "home") else MISSION_RECORD[name])
        for name in MISSION_RECORD.names or ()
    ]
)
# Last come the mean ages in its months.
AGES_OF_MONTHS = tuple(f"age_month_{month}" for month in range(1, 13))
YEAR_OPERATIONS = np.dtype(
    [
        *OPERATIONS.descr,
        *fields(np.float64, "late open windows longest_gap"),
        *fields(np.float64, " ".join(AGES_OF_MONTHS)),
    ]
)

# One node of a mission: its data [data units], of which ``collected`` is what UAVs have taken from
# it (also what was lost with a UAV), its mean age, and its age at the end [slots].
NODE_RECORD = np.dtype(fields(np.float64, "initial arrived collected residual age age_at_end"))


def measures_of(space: Constants) -> list[str]:
    """The fields of ``OPERATIONS`` that a scenario measures.

    In some missions one may still be nan, such as the latency where no packet was delivered.
    """
    measured = {
        ("age", "peak_age", "age_p99"): space.age.measured,
        ("latency", "latency_p99", "generated", "delivered", "lost_packets"): space.needs_events,
        ("lost",): space.needs_events or space.failures.is_on,
        ("queue", "waiting", "pad_requests", "utilisation"): space.charging.is_on,
        ("failures", "slots_grounded"): space.failures.is_on,
    }
    if space.weather.is_on:
        measured[("age",)] = True
        measured[("peak_age", "age_p99")] = False
        measured[("late", "open", "windows", "longest_gap")] = True
    return [name for names, is_measured in measured.items() if is_measured for name in names]


class Records(NamedTuple):
    """The records of N missions with up to I UAVs.

    Attributes:
        missions: (N,) ``MISSION_RECORD``.
        uavs: (N, I) ``UAV_RECORD``.
        operations: (N,) ``OPERATIONS`` if one of the scenarios is extended, otherwise (0,).
        nodes: (N, K) ``NODE_RECORD`` if one of the scenarios has a data sheet, otherwise (0, 0).
            Where a mission has fewer nodes than the array, the other rows are nan.
    """

    missions: np.ndarray
    uavs: np.ndarray
    operations: np.ndarray = np.zeros(0, OPERATIONS)
    nodes: np.ndarray = np.zeros((0, 0), NODE_RECORD)

    def mission(self, row: int, events: EventLog | None = None) -> "MissionRecord":
        """The record of one mission, with its event log if there is one."""
        metrics = self.missions[row]
        operations = self.operations[row] if len(self.operations) else None
        nodes = nodes_of(self.nodes[row]) if len(self.nodes) else None
        return MissionRecord(metrics, self.uavs[row, : metrics["uavs"]], events, operations, nodes)

    def add(self, row: int, record: "MissionRecord") -> None:
        """Put the record of one mission into a row."""
        self.missions[row], self.uavs[row, : len(record.uavs)] = record.metrics, record.uavs
        if record.operations is not None:
            self.operations[row] = record.operations
        if record.nodes is not None:
            self.nodes[row, : len(record.nodes)] = record.nodes


def nodes_of(records: np.ndarray) -> np.ndarray:
    """The records of the nodes of a mission, of a row of ``Records.nodes``."""
    return records[~np.isnan(records["initial"])]


def node_ratios(records: np.ndarray) -> np.ndarray:
    """The collection ratio of every node, of an array of ``NODE_RECORD``; without any data it is 1.

    As in ``MISSION_RECORD``, rounding does not put it below 0 or above 1.
    """
    total = records["initial"] + records["arrived"]
    ratios = np.ones(records.shape)
    np.divide(records["collected"], total, out=ratios, where=total != 0)
    return np.clip(ratios, 0.0, 1.0)


@kernel
def write_records(places, state, ways, records):
    """Write the records of the missions at these (N,) places of the state.

    ``ways`` are the tables ``Ways.home``.
    """
    for row in range(len(places)):
        write_record(state, places[row], ways, records, row)


@inlined
def write_record(state, b, ways, records, row):
    """Write the record of mission ``b`` of a state into a row of ``Records``."""
    mission, uavs, residual = state.missions[b], state.uavs[b], state.residual[b]
    record, uav_records = records.missions[row], records.uavs[row]
    record.seed = mission.seed
    record.replication = mission.replication
    record.uavs = mission.uavs
    record.flying_time = mission.flying_time
    record.charge_start = mission.charge_start
    record.charge_complete = mission.charge_complete
    record.slots = mission.slot
    record.initial = mission.initial
    record.arrived = mission.arrived
    record.collected = mission.collected
    record.residual = data_left(mission, residual)
    record.uav_slots = 0
    record.success = record.home = 1
    record.reward = 0.0
    for i in range(mission.uavs):
        u, out = uavs[i], uav_records[i]
        out.quota = u.communications
        out.battery = u.battery
        out.slots_flying = u.slots_flying
        out.slots_charging = u.slots_charging
        out.slots_waiting = u.slots_waiting
        out.end = u.end
        out.collected = u.collected
        out.reward = u.total_reward
        record.uav_slots += u.slots_flying + u.slots_charging
        record.reward += u.total_reward
        if u.end != QUOTA and u.end != LANDED:
            record.success = 0
        way = _battery_home(mission, u, ways)
        out.way_home = mission.flight_cost * way
        out.charged = u.charged
        out.down = u.end == BATTERY or u.end == LOST or (u.grounded and way > 0)
        if out.down or u.battery < out.way_home:
            record.home = 0
    total = record.initial + record.arrived
    # Rounding may put the ratio a little below 0 or above 1; without any data it is 1.
    record.collection_ratio = min(max(record.collected / total, 0.0), 1.0) if total > 0.0 else 1.0
    record.collection_ratio_and_communication = record.collection_ratio * record.success
    sensors = state.sensors[b]
    _write_operations(mission, uavs, sensors, state.peaks[b], records.operations, row)
    _write_nodes(mission, residual, sensors, records.nodes, row)


@inlined
def _battery_home(mission, u, ways):
    """The battery [%] that a UAV must have for its cheapest way to a zone cell, at least.

    What it has spent of the next percent is included.
    """
    way = np.int64(ways[mission.energy, u.slots_per_cell - 1, u.y, u.x])
    way += u.slots_left * slot_cost_at(mission, u.slots_per_cell, u.executed, u.x, u.y)
    spent = u.remainder if way > 0 else 0
    return (way + spent + PERCENT - 1) // PERCENT


@for_sections
def _write_operations(mission, uavs, sensors, peaks, operations, row):
    """Write what an extended scenario measures into an ``OPERATIONS`` record filled with nan."""
    out = operations[row]
    if mission.age_measured != 0:
        write_age(mission, sensors, peaks, out)
    if mission.has_charging:
        write_use(mission, uavs, out)
    if mission.has_failures:
        write_failures(mission, out)


@for_sections
def _write_nodes(mission, residual, sensors, nodes, row):
    """Write the ``NODE_RECORD`` of every node, if there is an array for them."""
    if row >= len(nodes):
        return
    for k in range(mission.nodes):
        out, sensor = nodes[row, k], sensors[k]
        out.initial = sensor.initial
        out.arrived = sensor.arrived
        out.collected = sensor.collected
        out.residual = residual[k] + sensor.hidden
        out.age, out.age_at_end = age_of_node(mission, sensor)


def empty_records(missions: int, uavs: int, is_extended: bool = False, nodes: int = 0) -> Records:
    """Zeroed records of that many missions and UAVs per mission; ``operations`` are nan.

    With ``nodes`` there is also room for the records of so many nodes, which are nan.
    """
    operations = np.full(missions if is_extended else 0, np.nan, OPERATIONS)
    of_nodes = np.full((missions if nodes else 0, nodes), np.nan, NODE_RECORD)
    return Records(
        np.zeros(missions, MISSION_RECORD),
        np.zeros((missions, uavs), UAV_RECORD),
        operations,
        of_nodes,
    )


def empty_records_of(spaces: Iterable[ScenarioSpace], missions: int) -> Records:
    """``empty_records`` for missions of some scenarios, or for years of some with weather."""
    all_spaces = [*spaces]
    fleet = max((space.uavs[1] for space in all_spaces), default=0)
    nodes = max((len(space.nodes) for space in all_spaces if space.units), default=0)
    is_extended = any(space.is_extended for space in all_spaces)
    records = empty_records(missions, fleet, is_extended, nodes)
    if not any(space.weather.is_on for space in all_spaces):
        return records
    years = np.zeros(missions, YEAR_RECORD)
    return records._replace(missions=years, operations=np.full(missions, np.nan, YEAR_OPERATIONS))


@dataclass(frozen=True)
class MissionRecord:
    """The record of one mission; every metric is also an attribute, as in ``record.success``.

    Attributes:
        metrics: ``MISSION_RECORD`` scalar.
        uavs: (I,) ``UAV_RECORD`` array.
        events: The event log, or None.
        operations: ``OPERATIONS`` scalar of an extended scenario, or None.
        nodes: (K,) ``NODE_RECORD`` of a scenario with a data sheet, or None.
    """

    metrics: np.void
    uavs: np.ndarray
    events: EventLog | None = None
    operations: np.void | None = None
    nodes: np.ndarray | None = None

    def __getattr__(self, name: str) -> Any:
        if name in (MISSION_RECORD.names or ()):
            return self.metrics[name].item()
        operations = None
        if name in (YEAR_OPERATIONS.names or ()):  # also while it is unpickled
            operations = self.operations
        if operations is not None and name in (operations.dtype.names or ()):
            return operations[name].item()
        raise AttributeError(name)

    def __repr__(self) -> str:
        """The metrics of the paper in a line, without the rows of the UAVs and the log."""
        shown = ("seed", "replication", "slots", "success", "collection_ratio", "home")
        metrics = [f"{name}={self.metrics[name].item()!r}" for name in shown]
        return f"MissionRecord({', '.join(metrics)}, events={self.events!r})"

    @property
    def measured(self) -> dict[str, float]:
        """What was measured beyond the paper's metrics, without the columns that are nan."""
        if self.operations is None:
            return {}
        names = self.operations.dtype.names or ()
        values = {name: self.operations[name].item() for name in names}
        return {name: value for name, value in values.items() if not isnan(value)}

    def uav_rows(self) -> list[dict[str, Any]]:
        """A row per UAV: communications, battery [%], charging slots and how its mission ended."""
        names = ["quota", "battery", "slots_charging", "end"]
        rows = (dict(zip(names, row, strict=True)) for row in self.uavs[names].tolist())
        return [row | {"end": END_NAMES[row["end"]]} for row in rows]
