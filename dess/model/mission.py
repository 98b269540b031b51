"""The SimPy model: a mission as processes that wait for each other.

    record = simulate(load_scenario("paper"), dess.policies.load("greedy"), seed=1, events=True)
    record.success, record.collection_ratio, record.events.columns()

The processes decide when things happen; ``rules.py`` decides what they change. Time is counted in
mission slots. The processes of a mission are:

- the *clock* opens and closes the slots, and lets the policies decide for all UAVs together;
- each *UAV* flies slot by slot, or waits for a pad of its charging zone and charges on it;
- the *radio* serves all flying UAVs m times in a slot, at the times t + n/m;
- the *arrivals* bring new data to the nodes;
- the *failures* strike UAVs, pads and nodes; each *pad* has a process that holds it while it is out
  of order.

A charging zone is a ``simpy.PriorityResource``, and its pads are the capacity of the resource. A
``Signal`` is an event that happens again and again.

Slot t, from the time t to the time t + 1, is:

1. The policies decide, and the safety controller resolves the moves (``decide_moves``).
2. The UAVs take their turns at the pads, one after the other (``give_turns``).
3. The batteries lose or gain what the slot takes or adds, and the UAVs depart (``depart``).
4. The radio serves the UAVs at t + 1/m, ..., t + 1 (``run_radio``).
5. New data arrive (``bring_data``), UAVs whose quota is filled or whose battery is empty end
   (``settle``), and things fail or are repaired (``run_failures``).

1 to 3 happen at the time t, and 5 happens at the time t + 1. ``docs/concepts/processes.md`` shows
the lines that matter.

For numba, a numpy record as an argument takes longer (3 us) than the arrays of the whole state, so
the compiled functions that are called in every slot take the arrays and hand their first records to
the rules. A tuple of arrays takes longer (1 us) than its arrays one by one.
"""

from collections.abc import Sequence
from math import inf
from typing import Any

import numpy as np
import simpy
from simpy.events import ProcessGenerator
from simpy.resources.resource import Request

from dess.base.kernels import kernel
from dess.model import channel, rules
from dess.model.channel import empty_scratch, world_of
from dess.model.events import Listener, LogWriter
from dess.model.packets import Packets
from dess.model.record import MissionRecord, empty_records, write_records
from dess.model.state import LOST, check_seed, spaces_of, starts_of, state_of
from dess.model.view import decide, team_of
from dess.physics.charging import queue_key
from dess.physics.chart import Chart
from dess.physics.failures import strike_nodes, strike_pads, strike_uavs
from dess.physics.landing import is_over
from dess.physics.wind import ways_home
from dess.scenario.scenario import AnyScenario, ScenarioSpace

# Why a UAV is interrupted while it waits for a pad or charges.
CALLED_AWAY = "it may not charge any more"
PAD_FAILED = "its pad has failed"
# The place of a failed pad in the queue of its zone.
BEFORE_ALL_UAVS: Any = (-inf,)


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
    space = spaces_of([scenario])[0]
    return Mission(space, team_of(policy, [space]), seed, replication, events=events).run()


class Signal:
    """An event that happens again and again."""

    def __init__(self, env: simpy.Environment):
        self._env = env
        self._next = env.event()

    def wait(self) -> simpy.Event:
        """The next time that it happens, for a process to wait for."""
        return self._next

    def send(self, value: Any = None) -> None:
        """Let it happen now, and wake the processes that wait for it."""
        event = self._next
        self._next = self._env.event()
        event.succeed(value)


class Mission:
    """The SimPy model of one mission.

    Attributes:
        env: The SimPy environment; its time is in mission slots.
        state: The state of the mission, as arrays that the rules change; ``mission``, ``uavs``,
            ``residual`` and ``sensors`` are parts of it.
        fleet: The numbers of the UAVs.
        zones: The charging zones, whose capacity is the number of their pads.
        turns: Tell each UAV that a slot opens.
        packets: The packets, where data arrive in continuous time.
        listener: Is told what happens; it may write the event log.
    """

    def __init__(
        self,
        scenario: ScenarioSpace,
        team: Sequence[Any],
        seed: int,
        replication: int,
        *,
        events: bool = False,
    ):
        self.is_extended = scenario.is_extended
        self.team = team
        self.world = world_of(scenario)
        self.shown_world = self.world.shown()  # what policies may see of it
        self.state = state_of([scenario], 1)
        rules.launch(self.state, 0, starts_of([scenario], seed), 0, replication)
        self.mission = self.state.missions[0]
        self.uavs = self.state.uavs[0]
        self.residual = self.state.residual[0]
        self.sensors = self.state.sensors[0]
        self.fleet = range(int(self.mission["uavs"]))
        self.may_charge_bits = 0  # bit i tells whether UAV i may charge in this slot
        self.arrivals = np.zeros(len(scenario.nodes), np.int64)
        self.scratch = empty_scratch(scenario.uavs[1], len(scenario.nodes))
        self.listener = LogWriter(self.state, self.world.nodes) if events else Listener()
        self.packets: Packets | None = None
        if scenario.needs_events:
            self.packets = Packets(scenario, self.state, self.listener)

        # The zones, and what the processes wait for.
        self.env = simpy.Environment()
        self.zones = [simpy.PriorityResource(self.env, pads) for pads in scenario.zone_pads]
        self.zone_of_pad = [zone for zone in self.zones for _ in range(int(zone.capacity))]
        self.turns = [Signal(self.env) for _ in self.fleet]
        self.slot_opens = Signal(self.env)
        self.uavs_are_served = Signal(self.env)
        self.data_are_due = Signal(self.env)
        self.failures_are_due = Signal(self.env)
        self.slot_closes = Signal(self.env)
        self.repaired_pads_return = Signal(self.env)
        self.pad_fails: list[Signal] = []

    def run(self) -> MissionRecord:
        """Run the mission to its end."""
        env = self.env
        # The clock comes last: when it opens the first slot, all others wait for it.
        self.uav_processes = [env.process(self.fly_mission(uav)) for uav in self.fleet]
        env.process(self.run_radio())
        if self.packets is None:
            env.process(self.bring_data())
        else:
            env.process(self.bring_packets(self.packets))
        if self.mission["has_failures"]:
            env.process(self.run_failures())
        if self.mission["pad_rate"] > 0:
            self.pad_fails = [Signal(env) for _ in self.zone_of_pad]
            for pad, zone in enumerate(self.zone_of_pad):
                env.process(self.hold_failed_pad(pad, zone))
        clock = env.process(self.run_clock())

        self.listener.note_start(self.packets.initial_packets() if self.packets else {})
        env.run(until=clock)
        self.listener.note_end()
        return self.write_record()

    # --- the clock ---

    def run_clock(self) -> ProcessGenerator:
        """Open the slots and close them, until the mission is over."""
        while not _is_over(self.state.missions):
            self.decide_moves()
            yield from self.give_turns()
            self.depart()
            self.slot_opens.send()
            yield self.uavs_are_served.wait()
            yield from self.announce(self.data_are_due)
            self.settle()
            if self.mission["has_failures"]:
                yield from self.announce(self.failures_are_due)
            yield from self.announce(self.slot_closes)

    def announce(self, signal: Signal) -> ProcessGenerator:
        """Send a signal, and wait until all that follows from it at this time has happened."""
        signal.send()
        while self.env.peek() <= self.env.now:
            yield self.env.timeout(0)

    def decide_moves(self) -> None:
        """Let the policies decide for all UAVs together, and the safety controller resolve."""
        decide(self.team, self.state, self.shown_world)
        self.may_charge_bits = _resolve(self.state.missions, self.state.uavs, *self.world.chart)

    def give_turns(self) -> ProcessGenerator:
        """Let each UAV take its turn in this slot, one after the other; pads are granted.

        First, UAVs are called away from the queues: an interrupt comes before all other events of
        the same time. Then UAVs ask for pads, in the order of the queue, since a pad that is free
        goes to the first who asks. Then come those who give a pad back, with all others, and at
        last the pads that have been repaired.
        """
        asking = []
        others = []
        for uav in self.fleet:
            if self.waits_for_pad(uav):
                if not self.may_charge(uav):
                    self.uav_processes[uav].interrupt(CALLED_AWAY)
            elif self.may_charge(uav) and not self.is_charging(uav):
                asking.append(uav)
            else:
                others.append(uav)
        asking.sort(key=self.place_in_queue)
        for uav in asking + others:
            self.turns[uav].send()
        yield from self.announce(self.repaired_pads_return)

    def depart(self) -> None:
        """Charge and discharge the batteries for this slot, and let the UAVs set out."""
        _depart(
            self.state.missions, self.state.uavs, self.world.nodes, self.world.mean_snr,
            self.world.order, self.world.means, *self.world.chart, self.scratch.search,
        )  # fmt: skip
        self.listener.note_moves()

    def settle(self) -> None:
        """Set rewards, and end the missions of UAVs that are done or whose battery is empty."""
        _settle(self.state.missions, self.state.uavs)
        self.listener.note_close(self.arrivals)

    # --- the UAVs ---

    def fly_mission(self, uav: int) -> ProcessGenerator:
        """A UAV's mission: in every slot it flies, waits for a pad or charges, until it ends."""
        while self.is_active(uav):
            yield self.turns[uav].wait()
            while self.may_charge(uav):  # again, if its pad has failed
                yield from self.charge(uav)
            yield self.uavs_are_served.wait()  # it flies its move; the radio serves it on the way
            yield self.slot_closes.wait()

    def charge(self, uav: int) -> ProcessGenerator:
        """Wait for a pad and charge on it, both over as many slots as it takes.

        A UAV that is charged gives its pad back at its next turn, and flies in that slot. So does
        one that is called away from the queue. One whose pad has failed leaves it at once, and may
        ask again at its next turn.
        """
        zone = self.zones[self.uavs[uav]["zone"]]
        self.join_queue(uav)
        try:
            with zone.request(priority=self.place_in_queue(uav)) as pad:
                yield pad
                self.start_charging(uav)
                while self.is_charging(uav):
                    yield self.turns[uav].wait()
        except simpy.Interrupt as interrupt:
            if interrupt.cause == PAD_FAILED:
                yield self.turns[uav].wait()
            if not self.may_charge(uav):
                self.leave_queue(uav)

    def join_queue(self, uav: int) -> None:
        """Note the slot in which a UAV asks for a pad; after a failure of its pad, it is kept."""
        if self.uavs[uav]["pad_request"] < 0:
            self.uavs[uav]["pad_request"] = self.mission["slot"]
            self.mission["pad_requests"] += 1
            self.listener.note_request(uav)

    def leave_queue(self, uav: int) -> None:
        """Forget that a UAV has asked for a pad."""
        self.uavs[uav]["pad_request"] = -1
        self.listener.note_withdrawal(uav)

    def start_charging(self, uav: int) -> None:
        """Connect a UAV to the pad that it has been granted."""
        _start_charging(self.state.missions, self.state.uavs, uav)
        self.listener.note_charging(uav)

    def is_active(self, uav: int) -> bool:
        """Whether the mission of a UAV has not ended."""
        return bool(self.uavs[uav]["active"])

    def is_charging(self, uav: int) -> bool:
        """Whether a UAV is on a pad and not yet charged."""
        return bool(self.uavs[uav]["charging"])

    def may_charge(self, uav: int) -> bool:
        """Whether a UAV meets the charging condition in this slot."""
        return bool(self.may_charge_bits >> uav & 1)

    def waits_for_pad(self, uav: int) -> bool:
        """Whether a UAV is in the queue of a zone."""
        return isinstance(self.uav_processes[uav].target, Request)

    def place_in_queue(self, uav: int) -> tuple[int, int, int]:
        """What a UAV is sorted by in the queue of its zone; the lowest is given the next pad."""
        return queue_key(self.mission, self.uavs[uav], uav)

    # --- the radio, the data and the failures ---

    def run_radio(self) -> ProcessGenerator:
        """Serve all flying UAVs in the communication slots 1..m of every slot."""
        m = int(self.mission["communication_slots"])
        arrays = (*self.state, self.world.order, self.world.means, *self.scratch)
        while True:
            yield self.slot_opens.wait()
            slot = int(self.mission["slot"])
            for n in range(1, m + 1):
                time = slot + n / m
                yield self.env.timeout(time - self.env.now)
                _communicate(*arrays, n)
                self.listener.note_communications(n)
                if self.packets is not None:
                    self.packets.deliver(time)
            self.uavs_are_served.send()

    def bring_data(self) -> ProcessGenerator:
        """Let new data arrive at the nodes at the end of every slot."""
        _, _, residual, sensors, _ = self.state
        while True:
            yield self.data_are_due.wait()
            _arrive(self.state.missions, residual, sensors, self.arrivals, *self.scratch)

    def bring_packets(self, packets: Packets) -> ProcessGenerator:
        """Let packets arrive, each at its own time."""
        time, node = packets.next()
        while time < inf:
            yield self.env.timeout(max(time - self.env.now, 0.0))
            packets.arrive(node)
            time, node = packets.next()

    def run_failures(self) -> ProcessGenerator:
        """Let UAVs, pads and nodes fail and be repaired at the end of every slot."""
        while True:
            yield self.failures_are_due.wait()
            strike_uavs(self.mission, self.uavs, LOST)
            self.strike_pads()
            strike_nodes(self.mission, self.residual, self.sensors)
            self.listener.note_failures()
            if self.packets is not None:
                self.packets.fall_silent(float(self.mission["slot"]))

    def strike_pads(self) -> None:
        """Let pads fail and be repaired; tell those that fail which UAV is on them."""
        were_out = self.mission["pads_out"].copy()
        were_charging = self.uavs["charging"].copy()
        strike_pads(self.mission, self.uavs)
        (stopped,) = np.nonzero(were_charging & ~self.uavs["charging"])
        uav_on = dict(zip(self.uavs["pad"][stopped].tolist(), stopped.tolist(), strict=True))
        for pad in np.nonzero(self.mission["pads_out"] > were_out)[0].tolist():
            self.pad_fails[pad].send(uav_on.get(pad))

    def hold_failed_pad(self, pad: int, zone: simpy.PriorityResource) -> ProcessGenerator:
        """Hold a pad, like a UAV that charges on it, from when it fails until it is repaired.

        A UAV on the pad leaves after the pad has asked, so that no other UAV gets its place.
        """
        while True:
            uav = yield self.pad_fails[pad].wait()
            with zone.request(priority=BEFORE_ALL_UAVS) as outage:
                if uav is not None:
                    self.uav_processes[uav].interrupt(PAD_FAILED)
                yield outage
                while self.mission["pads_out"][pad]:
                    yield self.repaired_pads_return.wait()

    def write_record(self) -> MissionRecord:
        """The record of the mission."""
        records = empty_records(1, len(self.fleet), self.is_extended)
        ways = ways_home(self.state.missions, self.world.chart)
        write_records(np.zeros(1, np.int64), self.state, ways, records)
        if self.packets is not None:
            self.packets.write(records.operations[0])
        return records.mission(0, self.listener.log)


@kernel
def _is_over(missions):
    return is_over(missions[0])


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
def _start_charging(missions, uavs, i):
    rules.start_charging(missions[0], uavs[0], i)


@kernel
def _depart(
    missions, uavs, nodes, mean_snr, order, means,
    zones, parking, sizes, nearest, ways, rows, search,
):  # fmt: skip
    """Update the batteries, and open the slot for the search of the best nodes.

    The slot is opened here, since the functions of communication slots, which are called more
    often, then take fewer arguments.
    """
    chart = Chart(zones, parking, sizes, nearest, ways, rows)
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
def _arrive(missions, residual, sensors, arrivals, batches, search):
    rules.arrive(missions[0], residual[0], sensors[0], arrivals, batches, search)


@kernel
def _settle(missions, uavs):
    rules.settle(missions[0], uavs[0])
