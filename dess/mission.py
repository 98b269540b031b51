"""The SimPy model: one mission as processes and events.

This module decides when things happen; ``rules.py`` decides what they change. One SimPy process,
the mission clock, opens each mission slot t, runs its communication slots at the times t + n/m, and
adds the arrivals at its end. One process per UAV requests a charging pad and gives it back. The
charging zone is a ``simpy.Resource`` that logs its use.

    record = simulate(load_scenario("paper"), policies.load("greedy"), seed=1, events=True)
    record.success, record.collection_ratio, record.events.columns()

Several things happen at the start of a slot, at the same simulation time. SimPy processes the
events of one time in the order in which they were scheduled, so a timeout of zero
(``_after_due_events``) resumes the clock only when everything already scheduled for this time is
done. This fixes the order inside a slot, which ``docs/concepts/model.md`` also shows as a drawing:

1. the UAVs that were charged in the slot before have given back their pads;
2. the policies decide, the safety controller resolves the moves, and ``slot_opens`` resumes the
   processes of the UAVs;
3. the UAVs have requested pads, left the queue or given back their pads;
4. pads that were given back are granted to the next UAVs in the queue, and charging starts.
"""

from collections.abc import Generator, Sequence
from typing import Any

import numpy as np
import simpy

from dess import rules
from dess.channel import empty_scratch, world_of
from dess.record import EventLog, MissionRecord, empty_records, write_operations, write_record
from dess.scenario import Scenario, ScenarioSpace
from dess.sections import fleet
from dess.state import (
    BATTERY,
    QUOTA,
    check_seed,
    constants_of,
    empty_state,
    ranges_of,
    spaces_of,
    teeth_lengths,
    types_of,
)
from dess.view import decide, team_of

Process = Generator[simpy.Event, Any, None]


def simulate(
    scenario: Scenario | ScenarioSpace,
    policy: Any,
    seed: int = 0,
    replication: int = 0,
    *,
    events: bool = False,
) -> MissionRecord:
    """Simulate one mission with the SimPy model.

    Args:
        scenario: The scenario, or the space from which the replication draws its parameters.
        policy: A policy, or a sequence of policies; UAV i follows ``policy[i % len(policy)]``.
        seed: Seed of the study.
        replication: Number of the replication.
        events: Whether to keep the event log.

    Returns:
        The record of the mission.

    Raises:
        InputError: If the seed or the replication is out of range, or if the team has more policies
            than the largest fleet has UAVs.
        ValueError: If a policy does not return actions.
    """
    check_seed(seed, replication)
    log = EventLog() if events else None
    space = spaces_of([scenario])[0]
    return MissionModel(space, team_of(policy, [space]), seed, replication, log).run()


class ChargingZone(simpy.Resource):
    """The charging pads of the zone, granted first come first served, with a log of their use."""

    def __init__(self, env: simpy.Environment, pads: int, log: EventLog | None):
        super().__init__(env, capacity=pads)
        self._log = log

    def log_event(self, event: str, time: float, i: int, u: np.void) -> None:
        """Log ``charge_request``, ``charge_start`` or ``charge_end`` of UAV ``i``."""
        if self._log is not None:
            self._log.add(time, event, i, -1, u["battery"], u["x"], u["y"])


class MissionModel:
    """The SimPy processes of one mission: a clock and one process per UAV."""

    def __init__(
        self,
        scenario: ScenarioSpace,
        team: Sequence[Any],
        seed: int,
        replication: int,
        log: EventLog | None,
    ):
        self.team, self.log, self.world = team, log, world_of(scenario)
        self.state = empty_state(
            1, scenario.uavs[1], len(scenario.nodes), teeth_lengths([scenario])
        )
        self.scratch = empty_scratch(scenario.uavs[1], len(scenario.nodes))
        self.arrivals = np.zeros(len(scenario.nodes), np.int64)
        self.state.missions[:] = constants_of(scenario)
        self.state.missions["seed"] = seed
        self.state.missions["replication"] = replication
        self.mission = self.state.missions[0]
        self.uavs, self.residual = self.state.uavs[0], self.state.residual[0]
        self.sensors, self.teeth = self.state.sensors[0], self.state.teeth[0]
        rules.launch(
            self.mission, ranges_of(scenario), types_of(scenario),
            self.uavs, self.residual, self.sensors, self.teeth,
        )  # fmt: skip
        self.fleet = range(int(self.mission["uavs"]))
        self.env = simpy.Environment()
        self.zone = ChargingZone(self.env, int(self.mission["pads"]), log)
        self.pads: list[Any] = [None] * len(self.fleet)  # pending or granted requests

    def run(self) -> MissionRecord:
        """Run the mission to its end."""
        self.slot_opens, self.slot_ends = self.env.event(), self.env.event()
        self._log_state("mission_start")
        for i in self.fleet:
            self.env.process(self._uav(i))
        self.env.run(self.env.process(self._clock()))
        self._log_state("mission_end")
        is_extended = bool(self.mission["is_extended"])
        records = empty_records(1, len(self.fleet), is_extended)
        write_record(self.mission, self.uavs, self.residual, records.missions[0], records.uavs[0])
        operations = None
        if is_extended:
            operations = records.operations[0]
            write_operations(self.mission, self.uavs, self.sensors, self.teeth, operations)
        return MissionRecord(records.missions[0], records.uavs[0], self.log, operations)

    def _clock(self) -> Process:
        """Open every mission slot, run its communication slots and close it."""
        env, mission, uavs = self.env, self.mission, self.uavs
        m = int(mission["communication_slots"])
        while mission["active"] > 0:
            start = int(mission["slot"])
            yield _after_due_events(env)  # the UAVs have given back the pads of the last slot
            decide(self.team, self.state, self.world)
            rules.resolve(mission, uavs)
            opened, self.slot_opens = self.slot_opens, env.event()
            opened.succeed()
            yield _after_due_events(env)  # the UAVs have asked for pads or given them back
            yield _after_due_events(env)  # free pads are granted to the next in the queue
            self._start_charging()
            rules.spend(mission, uavs)
            self._log_moves()
            for n in range(1, m + 1):
                yield env.timeout(start + n / m - env.now)
                rules.communicate(
                    mission, uavs, self.residual, self.sensors, self.teeth,
                    *self.world, *self.scratch, n,
                )  # fmt: skip
                self._log_communications(start, n, m)
            rules.arrive(mission, self.residual, self.arrivals)
            self._log_arrivals()
            self._settle()
            ended, self.slot_ends = self.slot_ends, env.event()
            ended.succeed()
        yield _after_due_events(env)  # the last UAV has given back its pad

    def _uav(self, i: int) -> Process:
        """Ask for a pad when UAV ``i`` may charge; give it back when it is charged or leaves.

        All UAVs wait for the same two events of a slot, so they act in index order.
        """
        u = self.uavs[i]
        while u["active"]:
            yield self.slot_opens
            if not rules.may_charge(self.mission, u):
                self._give_back(i)
            elif self.pads[i] is None:
                self.pads[i] = self.zone.request()
                u["pad_request"] = self.mission["slot"]
                self.zone.log_event("charge_request", float(self.mission["slot"]), i, u)
            yield self.slot_ends
            if u["pad_request"] < 0:  # charged, or out of the mission
                self._give_back(i)

    def _give_back(self, i: int) -> None:
        """Release the pad of UAV ``i``, or leave the queue."""
        pad, self.pads[i] = self.pads[i], None
        if pad is None:
            return
        self.uavs[i]["pad_request"] = -1
        if pad.triggered:
            self.zone.release(pad)
        else:
            pad.cancel()

    def _start_charging(self) -> None:
        """Let the UAVs that have been granted a pad charge in this slot."""
        for i in self.fleet:
            pad, u = self.pads[i], self.uavs[i]
            if pad is not None and pad.triggered and not u["charging"]:
                u["charging"] = True
                self.zone.log_event("charge_start", float(self.mission["slot"]), i, u)

    def _settle(self) -> None:
        """Close the slot; log the charging sessions and the UAVs that ended with it."""
        before = self.uavs.copy() if self.log is not None else None
        rules.settle(self.mission, self.uavs)
        if before is None or self.log is None:
            return
        time = float(self.mission["slot"])
        for i in self.fleet:
            was, u = before[i], self.uavs[i]
            if was["charging"] and not u["charging"]:
                self.zone.log_event("charge_end", time, i, u)
            if was["active"] and u["end"] == QUOTA:
                self.log.add(time, "quota_filled", i, -1, u["communications"], u["x"], u["y"])
            if was["active"] and u["end"] == BATTERY:
                self.log.add(time, "battery_empty", i, -1, u["battery"], u["x"], u["y"])

    def _log_state(self, event: str) -> None:
        if self.log is None:
            return
        time = float(self.mission["slot"])
        for i in self.fleet:
            u = self.uavs[i]
            self.log.add(time, event, i, -1, u["battery"], u["x"], u["y"])
        for k, (x, y) in enumerate(self.world.nodes):
            self.log.add(time, event, -1, k, self.residual[k], x, y)

    def _log_moves(self) -> None:
        if self.log is None:
            return
        time = float(self.mission["slot"])
        for i in self.fleet:
            u = self.uavs[i]
            if u["active"]:
                if u["overruled"]:
                    self.log.add(time, "collision", i, -1, u["action"], u["x"], u["y"])
                self.log.add(time, "move", i, -1, u["battery"], u["x"], u["y"])

    def _log_communications(self, start: int, n: int, m: int) -> None:
        if self.log is None:
            return
        for i in self.fleet:
            u = self.uavs[i]
            if u["active"] and u["served"] >= 0:
                flown = fleet.share_flown(self.mission, u, n)
                x = u["from_x"] + (u["x"] - u["from_x"]) * flown
                y = u["from_y"] + (u["y"] - u["from_y"]) * flown
                self.log.add(start + n / m, "communication", i, u["served"], u["amount"], x, y)

    def _log_arrivals(self) -> None:
        if self.log is None or self.mission["arrival_rate"] == 0:
            return
        time = float(self.mission["slot"] + 1)
        for k in np.nonzero(self.arrivals)[0].tolist():
            x, y = self.world.nodes[k]
            self.log.add(time, "arrival", -1, k, self.arrivals[k], x, y)


def _after_due_events(env: simpy.Environment) -> simpy.Timeout:
    """An event that SimPy processes after all events already scheduled for the current time."""
    return env.timeout(0)
