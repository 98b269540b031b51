"""The SimPy model: one mission as processes and events.

This module decides when things happen; ``rules.py`` decides what they change. One SimPy process,
the mission clock, opens each mission slot t, runs its communication slots at the times t + n/m, and
adds the arrivals at its end. A charging zone is a ``simpy.Resource`` (``ChargingZone``): a UAV that
may charge asks for a pad, and gives it back when it may not any more.

    record = simulate(load_scenario("paper"), dess.policies.load("greedy"), seed=1, events=True)
    record.success, record.collection_ratio, record.events.columns()

Several things happen at the start of a slot, at the same simulation time, in this order, which
``docs/concepts/model.md`` also shows as a drawing:

1. the policies decide, and the safety controller resolves the moves;
2. in index order, UAVs that now may charge ask for a pad, and UAVs that may not any more (charged,
   moved on or out of the mission) give back their pad or leave the queue;
3. free pads are granted to the next UAVs in the queue, and charging starts.

A slot in which no UAV asks for a pad or gives one back has neither 2 nor 3, unless pads may fail.

For numba, a numpy record as an argument takes longer (3 us) than the arrays of the whole state, so
the compiled functions here take the arrays and hand their first records to the rules. A tuple of
arrays takes longer (1 us) than its arrays one by one.
"""

from collections import namedtuple
from collections.abc import Generator, Sequence
from math import inf, nan
from typing import Any

import numpy as np
import simpy
from simpy.resources.resource import Request

from dess.base.kernels import kernel
from dess.model import channel, rules
from dess.model.channel import empty_scratch, world_of
from dess.model.packets import Packets
from dess.model.record import (
    PARAMETER_EVENTS,
    EventLog,
    MissionRecord,
    empty_records,
    write_records,
)
from dess.model.state import (
    BATTERY,
    LANDED,
    LOST,
    QUOTA,
    State,
    check_seed,
    spaces_of,
    starts_of,
    state_of,
)
from dess.model.view import decide, team_of
from dess.physics import fleet
from dess.physics.chart import Chart
from dess.physics.failures import strike
from dess.physics.wind import ways_home
from dess.scenario.scenario import AnyScenario, ScenarioSpace


class ChargingZone(simpy.Resource):
    """The pads of a charging zone, granted in the order of the scenario (``rules.grant_pads``).

    The UAVs of a slot ask one after the other at the same time. Pads are granted when all have
    asked, so that the order of asking does not matter. A pad out of order is not granted.

    Attributes:
        requests: For each UAV its request, waiting or granted, or None.
    """

    def __init__(self, env: simpy.Environment, mission: np.void, uavs: np.ndarray, zone: int = 0):
        pads = mission["zone_pads"]
        super().__init__(env, int(pads[zone]))
        self._mission, self._uavs = mission, uavs
        self._pads = slice(int(pads[:zone].sum()), int(pads[: zone + 1].sum()))
        self.requests: list[Request | None] = [None] * int(mission["uavs"])

    @property
    def capacity(self) -> int:
        """The number of pads that work."""
        pads = self._pads
        return pads.stop - pads.start - int(self._mission["pads_out"][pads].sum())

    def _do_put(self, event: Request) -> None:
        """Let a request wait until ``grant``."""

    def ask(self, uav: int) -> None:
        """Put a UAV into the queue."""
        self.leave(uav)
        self.requests[uav] = self.request()

    def leave(self, uav: int) -> None:
        """Take a UAV out of the queue, or take back its pad."""
        request, self.requests[uav] = self.requests[uav], None
        if request is not None:
            request.cancel()  # of no effect if the pad has been granted
            self.release(request)

    def holds_pad(self, uav: int) -> bool:
        """Whether a UAV has been granted a pad and has not left it."""
        request = self.requests[uav]
        return request is not None and request.triggered

    def grant(self) -> list[int]:
        """Grant the free pads to the first UAVs in the queue; return these UAVs."""
        waiting = [i for i, r in enumerate(self.requests) if r is not None and not r.triggered]
        waiting.sort(key=self._order)
        granted = waiting[: max(self.capacity - self.count, 0)]
        for uav in granted:
            request = self.requests[uav]
            assert request is not None
            self.put_queue.remove(request)
            super()._do_put(request)
        return granted

    def _order(self, uav: int) -> tuple[int, int, int]:
        """The place of a UAV in the queue (``charging.is_before``)."""
        u = self._uavs[uav]
        battery = int(u["battery"]) if self._mission["lowest_battery_first"] else 0
        return battery, int(u["pad_request"]), uav


_NOBODY = np.zeros(0, np.int64)
Process = Generator[simpy.Event, Any, None]
# The fields of a UAV that the event log is written from.
_LOGGED = [
    *("x", "y", "from_x", "from_y", "battery", "communications", "quota", "end", "active"),
    *("slots_per_cell", "slots_left", "action", "overruled", "overruled_by", "charging"),
    *("served", "amount", "snr"),
]
_Uav: Any = namedtuple("_Uav", _LOGGED)  # type: ignore[misc]


def simulate(
    scenario: AnyScenario,
    policy: Any,
    seed: int = 0,
    replication: int = 0,
    *,
    events: bool = False,
) -> MissionRecord:
    """Simulate one mission with the SimPy model.

    Args:
        scenario: The scenario, or the space from which the replication draws its parameters; or
            what ``load_scenario`` takes.
        policy: A policy, or a list of policies; UAV i follows ``policy[i % len(policy)]``.
        seed: Seed of the study.
        replication: Number of the replication.
        events: Whether to keep the event log.

    Returns:
        The record of the mission.

    Raises:
        InputError: If the seed or the replication is out of range, or if the team has more policies
            than the largest fleet has UAVs; if there is no scenario of a name.
        ValueError: If a policy does not return actions.
    """
    check_seed(seed, replication)
    log = EventLog() if events else None
    space = spaces_of([scenario])[0]
    return MissionModel(space, team_of(policy, [space]), seed, replication, log).run()


class MissionModel:
    """The SimPy model of one mission: a clock, and charging zones with their requests for pads."""

    def __init__(
        self,
        scenario: ScenarioSpace,
        team: Sequence[Any],
        seed: int,
        replication: int,
        log: EventLog | None,
    ):
        self.is_extended = scenario.is_extended
        self.team, self.log, self.world = team, log, world_of(scenario)
        self.state = state_of([scenario], 1)
        self.scratch = empty_scratch(scenario.uavs[1], len(scenario.nodes))
        self.arrivals = np.zeros(len(scenario.nodes), np.int64)
        rules.launch(self.state, 0, starts_of([scenario], seed), 0, replication)
        self.mission = self.state.missions[0]
        self.uavs, self.residual = self.state.uavs[0], self.state.residual[0]
        self.sensors, self.teeth = self.state.sensors[0], self.state.teeth[0]
        self.packets = Packets(scenario, self.state, log) if scenario.needs_events else None
        self.fleet = range(int(self.mission["uavs"]))
        self.logged = self.uavs[_LOGGED][: len(self.fleet)]  # of the same memory
        self.env = simpy.Environment()
        self.zones = [
            ChargingZone(self.env, self.mission, self.uavs, zone)
            for zone in range(len(scenario.rectangles))
        ]

    def run(self) -> MissionRecord:
        """Run the mission to its end."""
        self._log_state("mission_start")
        if self.packets is not None:
            self.env.process(self._arrivals(self.packets))
        self.env.run(self.env.process(self._clock()))
        self._log_state("mission_end")
        records = empty_records(1, len(self.fleet), self.is_extended)
        ways = ways_home(self.state.missions, self.world.chart)
        write_records(np.zeros(1, np.int64), self.state, ways, records)
        if self.packets is not None:
            self.packets.write(records.operations[0])
        return records.mission(0, self.log)

    def _clock(self) -> Process:
        """Open every mission slot, run its communication slots and close it."""
        env, missions, uavs = self.env, *self.state[:2]
        nodes, mean_snr, order, means, chart = self.world
        opening = (nodes, mean_snr, order, means, *chart, self.scratch.search)
        arrays, packets = (*self.state, order, means, *self.scratch), self.packets
        shown = self.world.shown()
        m = int(self.mission["communication_slots"])
        has_failures = bool(self.mission["has_failures"])
        pads_fail = bool(self.mission["pad_rate"] > 0)
        # Without a quota, data arrive and things fail until the horizon, though no UAV is active.
        shortest = 0 if self.mission["quota"] else int(self.mission["max_slots"])
        slot, active, allowed = 0, len(self.fleet), 0
        while active or slot < shortest:
            decide(self.team, self.state, shown)
            may_charge, granted = _resolve(missions, uavs, *chart), _NOBODY
            if may_charge != allowed or pads_fail:
                allowed = may_charge
                self._request_pads(slot, may_charge)
                granted = self._grant_pads(slot)
            _depart(missions, uavs, granted, *opening)
            self._log_moves(slot)
            for n in range(1, m + 1):
                yield env.timeout(slot + n / m - env.now)
                _communicate(*arrays, n)
                self._log_communications(slot, n, m)
                if packets is not None:
                    packets.deliver(slot + n / m)
            before = self._team() if self.log is not None else []
            active = _close(*self.state[:4], self.arrivals, *self.scratch)
            slot += 1
            self._log_close(slot, before)
            if has_failures:
                active = self._fail(slot)

    def _arrivals(self, packets: Packets) -> Process:
        """Let packets arrive, each at its own time."""
        time, k = packets.next()
        while time < inf:
            yield self.env.timeout(max(time - self.env.now, 0.0))
            packets.arrive(k)
            time, k = packets.next()

    def _request_pads(self, slot: int, may_charge: int) -> None:
        """Ask for pads and give them back; bit i of ``may_charge`` tells if UAV i may charge."""
        for i in self.fleet:
            u = self.uavs[i]
            asked = next((zone for zone in self.zones if zone.requests[i] is not None), None)
            if may_charge >> i & 1:
                if asked is None:
                    self.zones[u["zone"]].ask(i)
                    u["pad_request"] = slot
                    self.mission["pad_requests"] += 1
                    self._log_uav("charge_request", slot, i)
            elif asked is not None:
                if not asked.holds_pad(i):
                    self._log_uav("charge_withdrawal", slot, i)
                asked.leave(i)
                u["pad_request"] = -1

    def _grant_pads(self, slot: int) -> np.ndarray:
        """Grant the free pads; return the UAVs that charge from this slot on, in their order."""
        granted = [i for zone in self.zones for i in zone.grant()]
        for i in granted:
            self._log_uav("charge_start", slot, i)
        return np.array(granted, np.int64)

    def _fail(self, slot: int) -> int:
        """Let things fail and be repaired; return the number of UAVs that are still active."""
        before = State(*(array.copy() for array in self.state))
        strike(self.mission, self.uavs, self.residual, self.sensors, LOST)
        self._log_failures(float(slot), before)
        for i in self.fleet:
            if before.uavs[0, i]["charging"] and not self.uavs[i]["charging"]:  # its pad has failed
                self._log_uav("charge_end", slot, i)
                self._log_uav("charge_request", slot, i)
                self.zones[self.uavs[i]["zone"]].ask(i)
        if self.packets is not None:
            self.packets.fall_silent(float(slot))
        return int(self.mission["active"])

    def _team(self) -> list[Any]:
        """The UAVs as plain values, which Python reads faster than the fields of a record."""
        return [_Uav(*values) for values in self.logged.tolist()]

    def _log_uav(
        self, event: str, time: float, i: int, value: float | None = None, other: int = -1
    ) -> None:
        """Log an event of a UAV; its value is by default the battery."""
        if self.log is not None:
            u: Any = _Uav(*self.logged[i].item())
            value = u.battery if value is None else value
            self.log.add(float(time), event, i, -1, value, u.x, u.y, u.battery, other)

    def _log_state(self, event: str) -> None:
        if self.log is None:
            return
        time, is_start = int(self.mission["slot"]), event == "mission_start"
        for i in self.fleet:
            self._log_uav(event, time, i)
        for k, (x, y) in enumerate(self.world.nodes):
            waiting = self.packets.buffers.queues[k] if is_start and self.packets else ()
            packet, born = (waiting[0], 0.0) if waiting else (-1, nan)
            self.log.add(
                float(time), event, -1, k, self.residual[k], x, y, packet=packet, generated=born
            )
        for name in PARAMETER_EVENTS if is_start else ():
            self.log.add(0.0, name, -1, -1, self.mission[name.removeprefix("mission_")])

    def _log_moves(self, slot: int) -> None:
        if self.log is None:
            return
        for i, u in enumerate(self._team()):
            if u.active:
                if u.overruled:
                    self._log_uav("collision", slot, i, u.action, u.overruled_by)
                self._log_uav("move", slot, i)

    def _log_communications(self, slot: int, n: int, m: int) -> None:
        if self.log is None:
            return
        for i, u in enumerate(self._team()):
            if u.active and u.served >= 0:
                share = fleet.share_of_move(m, u, n)
                x = u.from_x + (u.x - u.from_x) * share
                y = u.from_y + (u.y - u.from_y) * share
                self.log.add(
                    slot + n / m, "communication", i, u.served, u.amount, x, y, u.battery, snr=u.snr
                )
                if self.mission["landing"] and u.communications == u.quota:
                    self._log_uav("quota_filled", slot + n / m, i, u.communications)

    def _log_close(self, time: int, before: list[Any]) -> None:
        """Log new data, and the charging sessions and the UAVs that ended with a slot."""
        if self.log is None:
            return
        if self.mission["arrival_rate"] > 0:
            for k in np.nonzero(self.arrivals)[0].tolist():
                x, y = self.world.nodes[k]
                self.log.add(float(time), "arrival", -1, k, self.arrivals[k], x, y)
        for i, (was, u) in enumerate(zip(before, self._team(), strict=True)):
            if was.charging and not u.charging:
                self._log_uav("charge_end", time, i)
            if was.active and u.end == QUOTA:
                self._log_uav("quota_filled", time, i, u.communications)
            if was.active and u.end == BATTERY:
                self._log_uav("battery_empty", time, i)
            if was.active and u.end == LANDED:
                self._log_uav("landing", time, i)

    def _log_failures(self, time: float, before: State) -> None:
        """Log what has failed or was repaired since a copy of the state at the end of the slot."""
        log, mission, nodes = self.log, self.mission, self.world.nodes
        if log is None:
            return
        for i, (was, u) in enumerate(zip(before.uavs[0], self.uavs, strict=True)):
            where = u["x"], u["y"], u["battery"]
            if u["grounded"] > was["grounded"] or u["end"] == LOST != was["end"]:
                log.add(time, "uav_failure", i, -1, u["battery"], *where)
            if u["grounded"] < was["grounded"]:
                log.add(time, "uav_repair", i, -1, u["battery"], *where)
            if u["collected"] < was["collected"]:
                log.add(time, "data_lost", i, -1, was["collected"], *where)
        change = mission["pads_out"] - before.missions[0]["pads_out"]
        for pad in np.nonzero(change)[0].tolist():
            log.add(time, "pad_failure" if change[pad] > 0 else "pad_repair", -1, -1, pad)
        silent, held = self.sensors["silent"], before.residual[0]
        for k in np.nonzero(silent != before.sensors[0]["silent"])[0].tolist():
            event, data = ("node_failure", held) if silent[k] else ("node_repair", self.residual)
            log.add(time, event, -1, k, data[k], *nodes[k])
        if mission["node_data_lost"] and not mission["continuous"]:
            for k in np.nonzero(silent & (held > 0))[0].tolist():
                log.add(time, "data_lost", -1, k, held[k], *nodes[k])


@kernel
def _resolve(missions, uavs, zones, parking, sizes, nearest, ways, rows):
    """Resolve the moves; bit i of the result tells whether UAV i may charge now."""
    mission, team = missions[0], uavs[0]
    chart = Chart(zones, parking, sizes, nearest, ways, rows)
    rules.resolve(mission, team, chart)
    may_charge = 0
    for i in range(mission.uavs):
        may_charge |= np.int64(rules.may_charge(mission, team[i])) << i
    return may_charge


@kernel
def _depart(
    missions, uavs, granted, nodes, mean_snr, order, means,
    zones, parking, sizes, nearest, ways, rows, search,
):  # fmt: skip
    """Let the UAVs that were granted pads begin to charge, update the batteries, and open the slot.

    The slot is opened here, since the functions of communication slots, which are called more
    often, then take fewer arguments.
    """
    chart = Chart(zones, parking, sizes, nearest, ways, rows)
    for i in granted:
        rules.start_charging(missions[0], uavs[0], i)
    rules.spend(missions[0], uavs[0])
    channel.open_slot(missions[0], uavs[0], nodes, mean_snr, order, means, chart, search)


@kernel
def _communicate(
    missions, uavs, residual, sensors, teeth, order, means, batches, search, n
):  # fmt: skip
    rules.communicate(
        missions[0], uavs[0], residual[0], sensors[0], teeth[0],
        order, means, batches, search, n,
    )  # fmt: skip


@kernel
def _close(missions, uavs, residual, sensors, arrivals, batches, search):
    """Add the arrivals and settle the slot; return the number of UAVs that are still active."""
    rules.arrive(missions[0], residual[0], sensors[0], arrivals, batches, search)
    rules.settle(missions[0], uavs[0])
    return missions[0].active
