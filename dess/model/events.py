"""The event log of a mission, and who writes it: a listener to the SimPy model.

    >>> log = EventLog()
    >>> log.add(0.0, "mission_start", 0, -1, 80)
    >>> log.event
    ['mission_start']
    >>> log.columns()["time"]
    array([0.])

The SimPy model tells a listener what happens. A ``Listener`` does nothing; a ``LogWriter`` writes
the event log. It knows the state of the mission, and compares it with what it was before where that
tells what has happened. ``docs/reference/event-log.md`` describes the rows and their order.
"""

from collections import namedtuple
from collections.abc import Mapping
from math import nan
from typing import Any, NamedTuple

import numpy as np

from dess.base.errors import InputError, shown
from dess.model.state import BATTERY, LANDED, LOST, QUOTA, State
from dess.physics import fleet


class Event(NamedTuple):
    """A row of the event log; ``docs/reference/event-log.md`` says what its columns mean."""

    time: float
    event: str
    uav: int
    node: int
    value: float
    x: float = -1.0
    y: float = -1.0
    battery: int = -1
    other: int = -1
    snr: float = nan
    packet: int = -1
    generated: float = nan


# Columns of the event log, and the types of their arrays.
_TYPES = {float: np.float64, int: np.int64, str: object}
EVENT_COLUMNS = {name: _TYPES[kind] for name, kind in Event.__annotations__.items()}
FAILURE_EVENTS = (
    *("uav_failure", "uav_repair", "pad_failure", "pad_repair"),
    *("node_failure", "node_repair", "data_lost"),
)
# Parameters of the mission, a row each.
PARAMETER_EVENTS = (
    *("mission_seed", "mission_replication", "mission_flying_time"),
    *("mission_charge_start", "mission_charge_complete"),
)
# What becomes of packets in continuous time, besides ``arrival``.
PACKET_EVENTS = ("delivery", "loss")
EVENT_NAMES = (
    *("mission_start", *PARAMETER_EVENTS, "move", "collision"),
    *("charge_request", "charge_start", "charge_end", "charge_withdrawal"),
    *("communication", "arrival", "quota_filled", "battery_empty", "landing"),
    *(*FAILURE_EVENTS, *PACKET_EVENTS, "remainder", "mission_end"),
)


def check_own_event(name: str) -> None:
    """Refuse a name that is no name, or that of an event of the model.

    Raises:
        InputError: If it is one.
    """
    if name in EVENT_NAMES:
        raise InputError("event", f"{name} is an event of the model", "another name")
    if not name.isidentifier():
        raise InputError("event", f"{shown(name)} is no name", "letters, digits and _")


class EventLog(list[Event]):
    """The events of one mission, in the order in which they happened.

    Every column is also an attribute, as in ``log.time``.
    """

    def __repr__(self) -> str:
        return f"EventLog of {len(self)} events"

    def add(self, *values: Any, **others: Any) -> None:
        """Append one event; the arguments are those of ``Event``."""
        self.append(Event(*values, **others))

    def __getattr__(self, name: str) -> list:
        """A column as a list, as in ``log.event``."""
        if name not in EVENT_COLUMNS:
            raise AttributeError(name)
        return [getattr(row, name) for row in self]

    def columns(self) -> dict[str, np.ndarray]:
        """The log as named columns."""
        columns = zip(*self, strict=True) if self else ([] for _ in EVENT_COLUMNS)
        return {
            name: np.array(column, kind)
            for (name, kind), column in zip(EVENT_COLUMNS.items(), columns, strict=True)
        }


class Listener:
    """Is told what happens in a mission, and does nothing.

    Attributes:
        log: The event log, if the listener writes one.
    """

    log: EventLog | None = None

    def note_start(self, packets: Mapping[int, int]) -> None:
        """The mission starts; ``packets`` has the numbers of the first packets, by their nodes."""

    def note_request(self, uav: int) -> None:
        """A UAV asks for a pad."""

    def note_withdrawal(self, uav: int) -> None:
        """A UAV leaves the queue for a pad."""

    def note_charging(self, uav: int) -> None:
        """A UAV is given a pad, and begins to charge."""

    def note_moves(self) -> None:
        """The UAVs depart, when the pads have been granted and the batteries updated."""

    def note_communications(self, n: int) -> None:
        """The radio has served the UAVs in communication slot ``n`` = 1..m."""

    def note_close(self, arrivals: np.ndarray) -> None:
        """A slot is settled; these are the (K,) new data of the nodes [data units]."""

    def note_failures(self) -> None:
        """UAVs, pads and nodes may have failed or been repaired at the end of a slot."""

    def note_packet(
        self, event: str, time: float, number: int, node: int, uav: int, value: float, born: float
    ) -> None:
        """A packet arrives, is delivered to a UAV or is lost; it was generated at ``born``."""

    def note_own(self, time: float, event: str, value: float, **columns: Any) -> None:
        """A process of the user tells something; ``columns`` are those of ``Event``."""

    def note_end(self) -> None:
        """The mission ends."""


# The fields of a UAV that most rows are written from.
_LOGGED = [
    *("x", "y", "from_x", "from_y", "battery", "communications", "quota", "end", "active"),
    *("slots_per_cell", "slots_left", "action", "overruled", "overruled_by", "charging"),
    *("served", "amount", "snr"),
]
_Uav: Any = namedtuple("_Uav", _LOGGED)  # type: ignore[misc]
# The event with which the mission of a UAV ends, besides the quota, which has a value of its own.
_LAST_EVENTS = {BATTERY: "battery_empty", LANDED: "landing"}
# The order of the rows at the pads.
_ASKING, _GRANTED = range(2)


class LogWriter(Listener):
    """Writes the event log of a mission.

    What happens at the pads when a slot opens is kept until the UAVs depart, since the processes of
    the UAVs take their turns in another order than that of the rows: first the requests and
    withdrawals in the order of the UAVs, then the charges that start, zone by zone.
    """

    def __init__(self, state: State, nodes: np.ndarray):
        """Begin the log of a mission.

        Args:
            state: The state of the mission.
            nodes: (K, 2) cells of the nodes.
        """
        self.log: EventLog = EventLog()
        self._mission = state.missions[0]
        self._uavs = state.uavs[0][: int(self._mission["uavs"])]
        self._logged = self._uavs[_LOGGED]  # of the same memory
        self._residual = state.residual[0]
        self._sensors = state.sensors[0]
        self._nodes = nodes
        self._rows_at_pads: list[tuple[int, int, Event]] = []
        self._remember()

    def note_start(self, packets: Mapping[int, int]) -> None:
        """Log the state and the parameters with which the mission starts."""
        self._add_state("mission_start", packets)
        for name in PARAMETER_EVENTS:
            self.log.add(0.0, name, -1, -1, self._mission[name.removeprefix("mission_")])

    def note_end(self) -> None:
        """Log the state with which the mission ends."""
        if self._mission["has_costs"]:
            for uav, remainder in enumerate(self._uavs["remainder"].tolist()):
                self._add("remainder", uav, remainder)
        self._add_state("mission_end", {})

    def note_request(self, uav: int) -> None:
        """Keep the row of a request until the UAVs depart."""
        self._rows_at_pads.append((_ASKING, uav, self._row("charge_request", uav)))

    def note_withdrawal(self, uav: int) -> None:
        """Keep the row of a withdrawal until the UAVs depart."""
        self._rows_at_pads.append((_ASKING, uav, self._row("charge_withdrawal", uav)))

    def note_charging(self, uav: int) -> None:
        """Keep the row of a charge that starts until the UAVs depart."""
        zone = int(self._uavs[uav]["zone"])
        self._rows_at_pads.append((_GRANTED, zone, self._row("charge_start", uav)))

    def note_moves(self) -> None:
        """Log what has happened at the pads, and then the moves."""
        self._rows_at_pads.sort(key=lambda row: row[:2])
        self.log.extend(event for *_, event in self._rows_at_pads)
        self._rows_at_pads.clear()
        self._team_before = self._team()
        for uav, u in enumerate(self._team_before):
            if u.active and u.overruled:
                self._add("collision", uav, u.action, u.overruled_by)
            if u.active:
                self._add("move", uav)

    def note_communications(self, n: int) -> None:
        """Log which node each UAV has served."""
        m = int(self._mission["communication_slots"])
        time = self._slot + n / m
        for uav, u in enumerate(self._team()):
            if not u.active or u.served < 0:
                continue
            share = fleet.share_of_move(m, u, n)
            x = u.from_x + (u.x - u.from_x) * share
            y = u.from_y + (u.y - u.from_y) * share
            self.log.add(time, "communication", uav, u.served, u.amount, x, y, u.battery, snr=u.snr)
            if self._mission["landing"] and u.communications == u.quota:
                row = self._row("quota_filled", uav, u.communications)
                self.log.append(row._replace(time=time))

    def note_close(self, arrivals: np.ndarray) -> None:
        """Log new data, and the charges and missions of UAVs that have ended."""
        if self._mission["arrival_rate"] > 0:
            for k in np.nonzero(arrivals)[0].tolist():
                self.log.add(float(self._slot), "arrival", -1, k, arrivals[k], *self._nodes[k])
        for uav, (was, u) in enumerate(zip(self._team_before, self._team(), strict=True)):
            if was.charging and not u.charging:
                self._add("charge_end", uav)
            if was.active and u.end == QUOTA:
                self._add("quota_filled", uav, u.communications)
            if was.active and u.end in _LAST_EVENTS:
                self._add(_LAST_EVENTS[u.end], uav)
        self._remember()

    def note_failures(self) -> None:
        """Log what has failed or was repaired; a UAV whose pad has failed asks for another."""
        self._add_failures_of_uavs()
        self._add_failures_of_pads()
        self._add_failures_of_nodes()
        for uav, was in enumerate(self._uavs_before):
            if was["charging"] and not self._uavs[uav]["charging"]:
                self._add("charge_end", uav)
                self._add("charge_request", uav)

    def note_packet(
        self, event: str, time: float, number: int, node: int, uav: int, value: float, born: float
    ) -> None:
        """Log the arrival, the delivery or the loss of a packet."""
        x, y = self._nodes[node]
        battery = self._uavs[uav]["battery"] if uav >= 0 else -1
        self.log.add(time, event, uav, node, value, x, y, battery, packet=number, generated=born)

    def note_own(self, time: float, event: str, value: float, **columns: Any) -> None:
        """Log what a process of the user tells."""
        self.log.append(Event(time, event, -1, -1, value)._replace(**columns))

    @property
    def _slot(self) -> int:
        """The number of the slot; at its end, that of the next one."""
        return int(self._mission["slot"])

    def _team(self) -> list[Any]:
        """The UAVs as plain values, which Python reads faster than the fields of a record."""
        return [_Uav(*values) for values in self._logged.tolist()]

    def _remember(self) -> None:
        """Keep what failures at the end of the slot may change."""
        self._uavs_before = self._uavs.copy()
        self._pads_out_before = self._mission["pads_out"].copy()
        self._silent_before = self._sensors["silent"].copy()
        self._residual_before = self._residual.copy()

    def _row(self, event: str, uav: int, value: float | None = None, other: int = -1) -> Event:
        """A row about a UAV at the start or the end of a slot; its value is else the battery."""
        u: Any = _Uav(*self._logged[uav].item())
        value = u.battery if value is None else value
        return Event(float(self._slot), event, uav, -1, value, u.x, u.y, u.battery, other)

    def _add(self, event: str, uav: int, value: float | None = None, other: int = -1) -> None:
        self.log.append(self._row(event, uav, value, other))

    def _add_state(self, event: str, packets: Mapping[int, int]) -> None:
        """Add a row for each UAV and node; a packet at a node was generated at time 0."""
        for uav in range(len(self._uavs)):
            self._add(event, uav)
        for k, (x, y) in enumerate(self._nodes):
            packet = packets.get(k, -1)
            born = nan if packet < 0 else 0.0
            self.log.add(
                float(self._slot), event, -1, k, self._residual[k], x, y,
                packet=packet, generated=born,
            )  # fmt: skip

    def _add_failures_of_uavs(self) -> None:
        for uav, (was, u) in enumerate(zip(self._uavs_before, self._uavs, strict=True)):
            is_lost = u["end"] == LOST and was["end"] != LOST
            if is_lost or (u["grounded"] and not was["grounded"]):
                self._add("uav_failure", uav)
            if was["grounded"] and not u["grounded"]:
                self._add("uav_repair", uav)
            if u["collected"] < was["collected"]:
                self._add("data_lost", uav, was["collected"])

    def _add_failures_of_pads(self) -> None:
        change = self._mission["pads_out"] - self._pads_out_before
        for pad in np.nonzero(change)[0].tolist():
            event = "pad_failure" if change[pad] > 0 else "pad_repair"
            self.log.add(float(self._slot), event, -1, -1, pad)

    def _add_failures_of_nodes(self) -> None:
        time = float(self._slot)
        silent = self._sensors["silent"]
        before = self._residual_before
        for k in np.nonzero(silent != self._silent_before)[0].tolist():
            if silent[k]:
                self.log.add(time, "node_failure", -1, k, before[k], *self._nodes[k])
            else:
                self.log.add(time, "node_repair", -1, k, self._residual[k], *self._nodes[k])
        if self._mission["node_data_lost"] and not self._mission["continuous"]:
            for k in np.nonzero(silent & (before > 0))[0].tolist():
                self.log.add(time, "data_lost", -1, k, before[k], *self._nodes[k])
