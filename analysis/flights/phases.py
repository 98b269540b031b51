"""What each UAV of a mission does: phases of flight, charging and standing, and shares of time."""

from collections.abc import Iterator
from itertools import groupby
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from dess.analysis.results.event_log import (
    Events,
    battery_levels,
    causes_of_failure,
    mission_length,
    slots_of,
    uav_slots,
)
from dess.base.errors import InputError
from dess.physics.chart import Cell
from dess.physics.fleet import type_of
from dess.scenario.scenario import Scenario

FLIGHT, CHARGING, STANDING = "flight", "charging", "standing"
# What a UAV does with its time, in the words of a sentence.
SERVES, CHARGES, WAITS = "collects data", "charges", "waits for a pad"
KEPT, FLIES, STANDS = "is kept from a cell", "flies without collecting", "stands"
ACTIVITIES = (SERVES, CHARGES, WAITS, KEPT, FLIES, STANDS)


class Visit(NamedTuple):
    """A cell that a UAV flies to.

    Attributes:
        cell: The cell.
        slots: How long the UAV hovers there [mission slots].
    """

    cell: Cell
    slots: int


class Phase(NamedTuple):
    """What a UAV does from one time to another.

    Attributes:
        uav: The number of the UAV, from 0.
        kind: ``FLIGHT``, ``CHARGING`` or ``STANDING``.
        start: When it begins [mission slots].
        end: When it ends [mission slots].
        battery: The battery at both times [%].
        visits: The cells, from that of the take-off to that of the landing; on the ground only the
            cell where the UAV is.
    """

    uav: int
    kind: str
    start: int
    end: int
    battery: tuple[int, int]
    visits: tuple[Visit, ...]

    @property
    def moves(self) -> int:
        """The cells that the UAV flies."""
        return len(self.visits) - 1


def list_phases(events: Events, scenario: Scenario) -> list[list[Phase]]:
    """The phases of each UAV; who moves from one cell of a zone to another stands there.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
        scenario: The scenario of the mission, whose UAVs land.

    Raises:
        InputError: If a UAV fails, or does not end its mission on the ground.
    """
    log = pd.DataFrame(events)
    _check_landings(log, scenario)
    levels = battery_levels(log).set_index(["uav", "time"])["battery"]
    of_uavs = []
    for uav, rows in enumerate(slots for _, slots in uav_slots(log).groupby("uav")):
        phases: list[Phase] = []
        labelled = _label_slots(rows, scenario, uav)
        for kind, group in groupby(labelled, key=lambda slot: slot.kind):
            slots = [*group]
            start = slots[0].number
            end = slots[-1].number + 1
            battery = (int(levels[uav, start]), int(levels[uav, end]))
            phases.append(Phase(uav, kind, start, end, battery, tuple(_list_visits(slots, kind))))
        of_uavs.append([*_without_hops(phases, scenario)])
    return of_uavs


def share_of_activities(events: Events, scenario: Scenario) -> pd.Series:
    """The share of time that the UAVs of a mission spend with each of ``ACTIVITIES``.

    A UAV collects data in the communication slots in which it serves a node. The rest of its slot
    counts for the first of these: it charges; waits for a pad; is kept from a cell, where the
    safety controller overrules it because of other UAVs; flies or hovers. Otherwise it stands: in a
    zone, under repair, or since its own mission has ended.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
        scenario: The scenario of the mission.

    Returns:
        The shares of all slots of all UAVs, whose sum is 1, by the words of ``ACTIVITIES``.
    """
    log = pd.DataFrame(events)
    overruled = slots_of(log[log["other"] >= 0], "collision")
    slots = dict.fromkeys(ACTIVITIES, 0.0)
    communications = _count_communications(log)
    for uav, rows in uav_slots(log).groupby("uav"):
        labels = _label_slots(rows, scenario, int(uav))
        for row, label in zip(rows.itertuples(), labels, strict=True):
            is_kept = (uav, label.number) in overruled
            count = communications.get((uav, label.number), 0)
            served = count / scenario.communication_slots
            slots[SERVES] += served
            slots[_name_activity(row, label.kind == FLIGHT, is_kept)] += 1 - served
    in_all = scenario.uavs * mission_length(log)
    slots[STANDS] += in_all - sum(slots.values())
    return pd.Series(slots) / in_all


def _count_communications(log: pd.DataFrame) -> dict[tuple[int, int], int]:
    """The communication slots in which a UAV serves a node, by UAV and slot."""
    served = log[log["event"] == "communication"]
    slots = np.ceil(served["time"]).astype(int) - 1  # the last one is at the end of the slot
    return served.groupby([served["uav"], slots]).size().to_dict()


def _name_activity(row: Any, is_flying: bool, is_kept: bool) -> str:
    """What a UAV does in a slot while it serves no node; ``row`` is one of ``uav_slots``."""
    if row.charging:
        return CHARGES
    if row.waiting:
        return WAITS
    if is_kept:
        return KEPT
    if is_flying and not row.grounded:
        return FLIES
    return STANDS


def _without_hops(phases: list[Phase], scenario: Scenario) -> Iterator[Phase]:
    """The phases; a UAV that moves within a zone stands there."""
    zones = scenario.chart.zones
    pending: Phase | None = None
    for phase in phases:
        visited = {int(zones[y, x]) for (x, y), _ in phase.visits}
        is_hop = len(visited) == 1 and min(visited) >= 0
        if phase.kind == STANDING or (phase.kind == FLIGHT and is_hop):
            standing = phase._replace(kind=STANDING, visits=phase.visits[-1:])
            if pending:
                battery = (pending.battery[0], standing.battery[1])
                standing = standing._replace(start=pending.start, battery=battery)
            pending = standing
            continue
        if pending:
            yield pending
            pending = None
        yield phase
    if pending:
        yield pending


class _Slot(NamedTuple):
    """A slot of a UAV.

    Attributes:
        number: The number of the slot.
        kind: The kind of its phase.
        source: The cell from which the UAV comes.
        target: The cell to which it flies, or where it is.
        begins_move: Whether the UAV departs to another cell in this slot.
        hovers: Whether it hovers in the air.
    """

    number: int
    kind: str
    source: Cell
    target: Cell
    begins_move: bool
    hovers: bool


def _check_landings(log: pd.DataFrame, scenario: Scenario) -> None:
    allowed = "a mission in which every UAV lands, such as another --replication or --policy"
    causes = causes_of_failure(log, scenario)
    if causes:
        problem, *_ = causes[0].split(";")
        raise InputError("--plan", problem, allowed)
    failed = log.loc[log["event"] == "uav_failure", "uav"]
    if len(failed):
        raise InputError("--plan", f"UAV {failed.iloc[0] + 1} fails in this mission", allowed)


def _label_slots(rows: pd.DataFrame, scenario: Scenario, uav: int) -> Iterator[_Slot]:
    """The slots of a UAV; that of a slow UAV is in the air as long as its move takes."""
    zones = scenario.chart.zones
    duration = type_of(scenario.fleet, uav).slots_per_cell
    until = 0  # the slot in which the present move has ended
    row: Any
    for row in rows.itertuples():
        source = (int(row.from_x), int(row.from_y))
        target = (int(row.x), int(row.y))
        if row.moved:
            until = row.slot + duration
        is_moving = row.slot < until
        if is_moving or zones[target[1], target[0]] < 0:
            kind = FLIGHT
        elif row.charging:
            kind = CHARGING
        else:
            kind = STANDING
        hovers = kind == FLIGHT and not is_moving
        yield _Slot(int(row.slot), kind, source, target, bool(row.moved), hovers)


def _list_visits(slots: list[_Slot], kind: str) -> Iterator[Visit]:
    """The cells of a phase, each with the slots of hovering."""
    cell = slots[0].source
    hovering = 0
    for slot in slots:
        if kind == FLIGHT and slot.begins_move:
            yield Visit(cell, hovering)
            cell = slot.target
            hovering = 0
        hovering += slot.hovers
    yield Visit(cell, hovering)
