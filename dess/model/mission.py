"""The SimPy model: a mission as processes that wait for each other.

    >>> record = simulate(load_scenario("paper"), dess.policies.load("greedy"), seed=1, events=True)
    >>> record.success, record.events.event[0]
    (1, 'mission_start')

The processes decide when things happen; ``rules.py`` decides what they change. Time is counted in
mission slots. The processes of a mission are:

- the *clock* opens and closes the slots, and lets the policies decide for all UAVs together;
- each *UAV* flies slot by slot, or asks for a pad of its charging zone and charges on it;
- the *radio* lets all UAVs in the air collect data in the m communication slots of a slot, of which
  number n ends at the time t + n/m;
- the *arrivals* bring new data to the nodes;
- the *failures* strike UAVs, pads and nodes; each *pad* has a process that holds it while it is out
  of order.

Further processes are functions of the mission (``simulate``, ``processes``), such as a supply boat.

A charging zone is a ``BatteryQueue``, and its pads are the capacity of this resource. SimPy counts
the pads in use; which pad a UAV stands on is known to the rules. A ``Signal`` is an event that
happens again and again.

Slot t, from the time t to the time t + 1, is:

1. The policies decide, and the safety controller resolves the moves (``decide_moves``).
2. The UAVs take their turns at the pads, one after the other (``give_turns``).
3. The batteries lose or gain what the slot takes or adds (``update_batteries``).
4. UAVs in the air collect data at t + 1/m, ..., t + 1 (``run_radio``).
5. New data arrive (``bring_data``), UAVs whose quota is filled or whose battery is empty end
   (``settle``), and things fail or are repaired (``run_failures``).

1 to 3 happen at the time t, and 5 happens at the time t + 1, after the last communication slot;
where data arrive in continuous time, each packet has a time of its own.
``docs/concepts/processes.md`` shows the lines that matter.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import inf, nan
from typing import Any, TypeAlias

import numpy as np
import simpy
from simpy.events import NORMAL, EventPriority, ProcessGenerator
from simpy.resources.resource import PriorityRequest, Request

from dess.base.errors import InputError, shown
from dess.base.kernels import kernel
from dess.model import channel, rules
from dess.model.channel import empty_scratch, world_of
from dess.model.events import Listener, LogWriter, check_own_event
from dess.model.packets import Packets
from dess.model.record import MissionRecord, empty_records_of, write_records
from dess.model.state import LOST, Starts, check_seed, spaces_of, starts_of, state_of
from dess.model.view import decide, team_of
from dess.model.ways import Ways
from dess.physics.charging import may_change_order, queue_key
from dess.physics.failures import strike_nodes, strike_pads, strike_uavs
from dess.physics.landing import is_over
from dess.scenario.scenario import AnyScenario, ScenarioSpace

# Why a UAV is interrupted: while it waits in a queue, or while it is on a pad.
CALLED_AWAY = "it no longer wants a pad"
PAD_FAILED = "its pad has failed"
# Priorities in the queue of a zone, of whoever is no UAV; a pad that has failed comes first.
BEFORE_ALL_UAVS: Any = (-inf,)
AFTER_ALL_UAVS: Any = (inf,)
# SimPy orders the events of one time by their priorities.
AFTER_ALL_EVENTS = EventPriority(NORMAL + 1)


def simulate(
    scenario: AnyScenario,
    policy: Any,
    seed: int = 0,
    replication: int = 0,
    *,
    events: bool = False,
    processes: Sequence["Process"] = (),
    starts: Starts | None = None,
) -> MissionRecord:
    """Simulate one mission with the SimPy model.

    Args:
        scenario: The scenario, or the space from which the replication draws its parameters; or
            what ``load_scenario`` takes.
        policy: A policy, or a list of policies; UAV i follows ``policy[i % len(policy)]``.
        seed: Seed of the study.
        replication: Number of the replication.
        events: Whether to keep the event log.
        processes: Further processes, functions of the ``Mission`` that yield SimPy events.
        starts: What the mission starts from, of a window of a year with weather
            (``dess.model.years.start_of_window``); by default what the scenario says.

    Returns:
        The record of the mission.

    Raises:
        InputError: If the seed or the replication is out of range, or if the team has more policies
            than the largest fleet has UAVs; if there is no scenario of a name, or a process yields
            nothing.
        ValueError: If a policy does not return actions.
    """
    check_seed(seed, replication)
    space = spaces_of([scenario])[0]
    team = team_of(policy, [space])
    mission = Mission(
        space, team, seed, replication, events=events, processes=processes, starts=starts
    )
    return mission.run()


class Signal:
    """An event that happens again and again.

    A SimPy event happens once; a signal has a new one each time. Who waits for it must do so before
    it is sent: a signal for which no process waits is lost.
    """

    def __init__(self, env: simpy.Environment):
        self._env = env
        self._next = env.event()

    def wait(self) -> simpy.Event:
        """The event of the next time, for a process to yield."""
        return self._next

    def send(self, value: Any = None) -> None:
        """Let it happen now, and wake the processes that wait for it."""
        event = self._next
        self._next = self._env.event()
        event.succeed(value)


class EndOfTime(simpy.Event):
    """Happens when nothing else is due any more at the present time.

    All that follows at this time from what is due, from zero delays too, has happened then.
    """

    def __init__(self, env: simpy.Environment):
        super().__init__(env)
        self._ok = True
        self._value = None
        env.schedule(self, AFTER_ALL_EVENTS)


class BatteryQueue(simpy.PriorityResource):
    """The pads of a charging zone, and the queue of those who wait for one of them.

    The priority of a UAV is its ``queue_key``; others come before or after all of them.
    """

    def request(self, priority: Any = AFTER_ALL_UAVS, preempt: bool = False) -> PriorityRequest:
        """Ask for a pad; who has the lowest priority is given the next one."""
        return PriorityRequest(self, priority, preempt)

    def reorder(self, priorities: Mapping[simpy.Process, Any]) -> None:
        """Sort those who wait, some of whom have other priorities now."""
        for request in self.queue:
            if request.proc in priorities:
                request.key = (priorities[request.proc], *request.key[1:])
        self.queue[:] = sorted(self.queue, key=lambda request: request.key)


class Mission:
    """The SimPy model of one mission.

    Attributes:
        env: The SimPy environment; its time is in mission slots.
        state: The state of the mission, as arrays that the rules change; ``mission``, ``uavs``,
            ``residual`` and ``sensors`` are parts of it.
        fleet: The numbers of the UAVs.
        zones: The charging zones, whose capacity is the number of their pads.
        turns: Tell each UAV that in this slot it may act at the pads. A UAV in a queue gets none:
            it waits for its pad.
        uav_processes: The processes of the UAVs.
        packets: The packets, where data arrive in continuous time.
        listener: Is told what happens; it may write the event log.
        further: The processes of the user.
    """

    def __init__(
        self,
        scenario: ScenarioSpace,
        policies: Sequence[Any],
        seed: int,
        replication: int,
        *,
        events: bool = False,
        processes: Sequence["Process"] = (),
        starts: Starts | None = None,
    ):
        self.scenario = scenario
        self.policies = policies
        self.world = world_of(scenario)
        self.shown_world = self.world.shown()  # what policies may see of it
        starts = starts or starts_of([scenario], seed)
        self.state = state_of([scenario], 1)
        self.ways = Ways(starts.constants, self.world.chart)
        rules.launch(self.state, 0, starts, 0, replication)
        self.mission = self.state.missions[0]
        self.uavs = self.state.uavs[0]
        self.residual = self.state.residual[0]
        self.sensors = self.state.sensors[0]
        self.fleet = range(int(self.mission["uavs"]))
        self.wants_pad_bits = 0  # bit i tells whether UAV i wants a pad in this slot
        self.scratch = empty_scratch(scenario.uavs[1], len(scenario.nodes))
        self.listener = LogWriter(self.state, self.world.nodes) if events else Listener()
        self.further = processes
        self.packets: Packets | None = None
        if scenario.needs_events:
            self.packets = Packets(scenario, self.state, self.listener)

        # The zones, and what the processes wait for.
        self.env = simpy.Environment()
        self.zones = [BatteryQueue(self.env, pads) for pads in scenario.zone_pads]
        self.queues_change = may_change_order(self.mission)
        self.zone_of_pad = [zone for zone in self.zones for _ in range(int(zone.capacity))]
        self.uav_processes: list[simpy.Process] = []
        self.turns = [Signal(self.env) for _ in self.fleet]
        self.radio_starts = Signal(self.env)
        self.radio_is_done = Signal(self.env)
        self.data_are_due = Signal(self.env)
        self.failures_are_due = Signal(self.env)
        self.slot_closes = Signal(self.env)
        self.repaired_pads_return = Signal(self.env)
        self.pad_fails: list[Signal] = []
        if self.mission["pad_rate"] > 0:
            self.pad_fails = [Signal(self.env) for _ in self.zone_of_pad]

    def run(self) -> MissionRecord:
        """Run the mission to its end."""
        self.listener.note_start(self.packets.initial_packets() if self.packets else {})
        self.uav_processes = [self.env.process(self.run_uav(uav)) for uav in self.fleet]
        for process in self.list_processes():
            self.env.process(process)
        # The clock comes last: when it sends its first signal, all others wait for theirs.
        self.env.run(until=self.env.process(self.run_clock()))
        self.listener.note_end()
        return self.write_record()

    def list_processes(self) -> Iterator[ProcessGenerator]:
        """The processes of the mission beside its UAVs and its clock, in their order."""
        yield self.run_radio()
        if self.packets is None:
            yield self.bring_data()
        else:
            yield self.bring_packets(self.packets)
        if self.mission["has_failures"]:
            yield self.run_failures()
        for pad in range(len(self.pad_fails)):
            yield self.run_pad(pad, self.zone_of_pad[pad])
        for process in self.further:
            yield _started(process, self)

    def log(self, event: str, value: float = nan, **columns: Any) -> None:
        """Write a row of a process of the user into the event log, if the mission keeps one.

        Args:
            event: What happens, in a name that no event of dess has.
            value: A number that tells more.
            **columns: Other columns of ``dess.model.events.Event``.

        Raises:
            InputError: If the name is one of dess.
        """
        check_own_event(event)
        self.listener.note_own(self.env.now, event, value, **columns)

    # --- the clock ---

    def run_clock(self) -> ProcessGenerator:
        """Open the slots and close them, until the mission is over."""
        while not _is_over(self.state.missions):
            self.decide_moves()
            yield from self.give_turns()
            self.update_batteries()
            self.radio_starts.send()
            yield self.radio_is_done.wait()
            yield from self.announce(self.data_are_due)
            self.settle()
            if self.mission["has_failures"]:
                yield from self.announce(self.failures_are_due)
            yield from self.announce(self.slot_closes)

    def announce(self, signal: Signal) -> ProcessGenerator:
        """Send a signal, and wait until all else that is due at this time has happened."""
        signal.send()
        yield EndOfTime(self.env)

    def decide_moves(self) -> None:
        """Let the policies decide for all UAVs together, and the safety controller move them.

        This also tells which UAVs want a pad in this slot.
        """
        decide(self.policies, self.state, self.shown_world, self.ways)
        zones = self.world.chart.zones
        self.wants_pad_bits = _resolve(self.state.missions, self.state.uavs, zones)

    def give_turns(self) -> ProcessGenerator:
        """Let each UAV take its turn in this slot, one after the other; pads are granted.

        First, UAVs are called away from the queues: an interrupt comes before all other events of
        the same time. Then UAVs ask for pads, in the order of the queue, since a pad that is free
        goes to the first who asks. Then come those who give a pad back, with all others. The pads
        that have been repaired come last, and the clock waits until all turns have been taken.
        """
        asking = []
        others = []
        for uav in self.fleet:
            if self.waits_for_pad(uav):
                if not self.wants_pad(uav):
                    self.uav_processes[uav].interrupt(CALLED_AWAY)
            elif self.wants_pad(uav) and not self.is_charging(uav):
                asking.append(uav)
            else:
                others.append(uav)
        if self.queues_change:
            self.sort_queues()
        asking.sort(key=self.queue_key_of)
        for uav in asking + others:
            self.turns[uav].send()
        yield from self.announce(self.repaired_pads_return)

    def sort_queues(self) -> None:
        """Bring the UAVs that wait for pads into the order of this slot."""
        waiting = filter(self.waits_for_pad, self.fleet)
        priorities = {self.uav_processes[uav]: self.queue_key_of(uav) for uav in waiting}
        for zone in self.zones:
            zone.reorder(priorities)

    def update_batteries(self) -> None:
        """Charge and discharge the batteries for this slot, and prepare the search of the radio."""
        _update_batteries(
            self.state.missions, self.state.uavs, self.world.nodes, self.world.mean_snr,
            self.world.order, self.world.means, self.world.chart.zones, self.scratch.search,
        )  # fmt: skip
        self.listener.note_moves()

    def settle(self) -> None:
        """Set rewards, and end the missions of UAVs that are done or whose battery is empty.

        The slot that the state has is the next one from here on.
        """
        _settle(self.state.missions, self.state.uavs)
        self.listener.note_close(self.scratch.arrivals)

    # --- the UAVs ---

    def run_uav(self, uav: int) -> ProcessGenerator:
        """A UAV's mission: it flies slot by slot, with stays at the pads between, until it ends.

        The rules move it and charge it; the process says when it does what.
        """
        while self.is_active(uav):
            yield self.turns[uav].wait()
            while self.wants_pad(uav):  # once more, if its pad fails and it still wants one
                yield from self.charge(uav)
            yield self.radio_is_done.wait()  # the UAV flies, and collects data on its way
            yield self.slot_closes.wait()

    def charge(self, uav: int) -> ProcessGenerator:
        """Wait for a pad and charge on it, both over as many slots as it takes.

        A UAV that is fully charged gives its pad back at its next turn. One that is called away
        from the queue leaves it at once. One whose pad has failed leaves that at once, and may ask
        again at its next turn.
        """
        zone = self.zones[self.uavs[uav]["zone"]]
        self.note_request(uav)
        try:
            with zone.request(priority=self.queue_key_of(uav)) as place:
                yield place
                self.start_charging(uav)
                while self.is_charging(uav):  # spend charges it, settle ends the charge
                    yield self.turns[uav].wait()
        except simpy.Interrupt as interrupt:
            if interrupt.cause == PAD_FAILED:  # at the end of a slot; the next one is to come
                yield self.turns[uav].wait()
            if not self.wants_pad(uav):
                self.note_withdrawal(uav)

    def note_request(self, uav: int) -> None:
        """Note the slot of the request; a UAV whose pad has failed keeps that of its first one."""
        if self.uavs[uav]["pad_request"] < 0:
            self.uavs[uav]["pad_request"] = self.mission["slot"]
            self.mission["pad_requests"] += 1
            self.listener.note_request(uav)

    def note_withdrawal(self, uav: int) -> None:
        """Note that a UAV does not ask for a pad any more."""
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
        """Whether a UAV is on a pad and not yet fully charged."""
        return bool(self.uavs[uav]["charging"])

    def wants_pad(self, uav: int) -> bool:
        """Whether a UAV hovers in a zone by its own choice, with a battery that may be charged.

        It stays true while the UAV waits and while it charges.
        """
        return bool(self.wants_pad_bits >> uav & 1)

    def waits_for_pad(self, uav: int) -> bool:
        """Whether a UAV is in the queue of a zone: then its process waits for the request alone."""
        return isinstance(self.uav_processes[uav].target, Request)

    def queue_key_of(self, uav: int) -> tuple[int, int, int]:
        """What UAVs are sorted by in the queue of a zone; the lowest is given the next pad."""
        return queue_key(self.mission, self.uavs[uav], uav)

    # --- the radio, the data and the failures ---

    def run_radio(self) -> ProcessGenerator:
        """Let all UAVs in the air collect data in the communication slots 1..m of every slot."""
        m = int(self.mission["communication_slots"])
        batches, search, _ = self.scratch
        arrays = (*self.state, self.world.order, self.world.means, batches, search)
        while True:
            yield self.radio_starts.wait()
            slot = int(self.mission["slot"])
            for n in range(1, m + 1):
                time = slot + n / m  # not a sum of n parts, whose rounding would add up
                yield self.env.timeout(time - self.env.now)
                _communicate(*arrays, n)
                self.listener.note_communications(n)
                if self.packets is not None:
                    self.packets.deliver(time)
            self.radio_is_done.send()

    def bring_data(self) -> ProcessGenerator:
        """Let new data arrive at the nodes at the end of every slot."""
        _, _, residual, sensors, _ = self.state
        while True:
            yield self.data_are_due.wait()
            _arrive(self.state.missions, residual, sensors, self.scratch)

    def bring_packets(self, packets: Packets) -> ProcessGenerator:
        """Let packets arrive, each at its own time."""
        time, node = packets.next_arrival()
        while time < inf:
            yield self.env.timeout(max(time - self.env.now, 0.0))
            packets.arrive(node)
            time, node = packets.next_arrival()

    def run_failures(self) -> ProcessGenerator:
        """Let UAVs, pads and nodes fail and be repaired at the end of every slot."""
        while True:
            yield self.failures_are_due.wait()
            strike_uavs(self.mission, self.uavs, LOST)
            self.fail_pads()
            strike_nodes(self.mission, self.residual, self.sensors)
            self.listener.note_failures()
            if self.packets is not None:
                self.packets.fall_silent(float(self.mission["slot"]))

    def fail_pads(self) -> None:
        """Let pads fail and be repaired; tell those that fail which UAV is on them."""
        were_out = self.mission["pads_out"].copy()
        were_charging = self.uavs["charging"].copy()
        strike_pads(self.mission, self.uavs)
        (stopped,) = np.nonzero(were_charging & ~self.uavs["charging"])
        uav_on = dict(zip(self.uavs["pad"][stopped].tolist(), stopped.tolist(), strict=True))
        for pad in np.nonzero(self.mission["pads_out"] > were_out)[0].tolist():
            self.pad_fails[pad].send(uav_on.get(pad))

    def run_pad(self, pad: int, zone: BatteryQueue) -> ProcessGenerator:
        """A pad: from when it fails until it is repaired, it takes a place of its zone.

        It asks before the UAV on it leaves, so that no other UAV is given that place.
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
        records = empty_records_of([self.scenario], 1)
        write_records(np.zeros(1, np.int64), self.state, self.ways.home, records)
        if self.packets is not None:
            self.packets.write(records.operations[0])
        return records.mission(0, self.listener.log)


# A process of a user, such as a boat that takes a pad.
Process: TypeAlias = Callable[[Mission], ProcessGenerator]


def _started(process: Process, mission: Mission) -> ProcessGenerator:
    """A process of a user as SimPy takes it.

    Raises:
        InputError: If it yields nothing.
    """
    generator = process(mission)
    if not hasattr(generator, "throw"):
        name = getattr(process, "__name__", shown(process))
        raise InputError("processes", f"{name} yields nothing", "a function that yields events")
    return generator


# For numba, a numpy record as an argument takes longer (3 us) than the arrays of the whole state,
# and a tuple of arrays longer (1 us) than its arrays one by one. So these functions, which are
# called in every slot, take the arrays, and hand the records of the only mission to the rules.


@kernel
def _is_over(missions):
    return is_over(missions[0])


@kernel
def _resolve(missions, uavs, zones):
    """Resolve the moves; bit i of the result tells whether UAV i wants a pad (64 UAVs at most)."""
    mission = missions[0]
    fleet = uavs[0]
    rules.resolve(mission, fleet, zones)
    wants_pad = 0
    for i in range(mission.uavs):
        wants_pad |= np.int64(rules.may_charge(mission, fleet[i])) << i
    return wants_pad


@kernel
def _start_charging(missions, uavs, i):
    rules.start_charging(missions[0], uavs[0], i)


@kernel
def _update_batteries(missions, uavs, nodes, mean_snr, order, means, zones, search):
    """Update the batteries, and open the slot for the search of the best nodes.

    The slot is opened here, since the functions of communication slots, which are called more
    often, then take fewer arguments.
    """
    rules.spend(missions[0], uavs[0])
    channel.open_slot(missions[0], uavs[0], nodes, mean_snr, order, means, zones, search)


@kernel
def _communicate(
    missions, uavs, residual, sensors, peaks, order, means, batches, search, n
):  # fmt: skip
    rules.communicate(
        missions[0], uavs[0], residual[0], sensors[0], peaks[0],
        order, means, batches, search, n,
    )  # fmt: skip


@kernel
def _arrive(missions, residual, sensors, scratch):
    rules.arrive(missions[0], residual[0], sensors[0], scratch)


@kernel
def _settle(missions, uavs):
    rules.settle(missions[0], uavs[0])
