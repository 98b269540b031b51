"""Processes of a user: a mission has what they take and tell, and is else what it was."""

import runpy
from collections.abc import Iterator
from pathlib import Path

import pytest
import simpy
from simpy import Environment

import dess
from dess import InputError
from dess.model.mission import AFTER_ALL_UAVS, BatteryQueue, EndOfTime, Mission
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.test_engines import BUSY, FAILING
from tests.drawn import Wanderer

EXAMPLES = runpy.run_path(str(Path(__file__).parents[3] / "examples" / "processes.py"))
moor_boat, log_queue = EXAMPLES["moor_boat"], EXAMPLES["log_queue"]
ARRIVAL, STAY = EXAMPLES["ARRIVAL"], EXAMPLES["STAY"]
# UAVs that need the pads in turn.
SCENARIO = dess.load_scenario("paper", uavs=3, pads=2, quota=400)


@pytest.mark.parametrize("replication", range(4))
def test_a_boat_takes_a_pad_while_it_stays(replication):
    record = dess.simulate(
        SCENARIO, "greedy", 1, replication, events=True, processes=[moor_boat, log_queue]
    )
    assert record.events is not None
    boat, charging = [], set()
    for row in record.events:
        if row.event.startswith("boat"):
            boat.append((row.time, row.event))
        elif row.event == "charge_start":
            charging.add(row.uav)
        elif row.event == "charge_end":
            charging.discard(row.uav)
        is_moored = boat and boat[-1][1] == "boat_moors"
        assert len(charging) + bool(is_moored) <= 2
    (moored, _), (left, _) = boat
    assert moored >= ARRIVAL
    assert left == moored + STAY
    alone = dess.simulate(SCENARIO, "greedy", 1, replication)
    assert record.uavs["slots_waiting"].sum() > alone.uavs["slots_waiting"].sum()


@pytest.mark.parametrize("policy", ["greedy", "random"])
def test_the_logger_counts_the_slots_of_waiting(policy):
    record = dess.simulate(SCENARIO, policy, 2, events=True, processes=[log_queue])
    assert record.events is not None
    rows = [row for row in record.events if row.event == "queue"]
    assert [row.time for row in rows] == [slot + 0.5 for slot in range(record.slots)]
    assert sum(row.value for row in rows) == record.uavs["slots_waiting"].sum()


def wake_often(mission: Mission) -> Iterator[simpy.Event]:
    """Wakes at the edges of slots and between, and does nothing."""
    while True:
        yield mission.env.timeout(0.25)
        yield mission.env.timeout(0)


def keep_own_time(mission: Mission) -> Iterator[simpy.Event]:
    """A second clock, which waits at the edges of slots for all else, as the first one does."""
    while True:
        yield EndOfTime(mission.env)
        yield mission.env.timeout(1)


@pytest.mark.parametrize("sections", [{}, FAILING, FAILING | {"landing": True, "quota": 100}])
@pytest.mark.parametrize("process", [wake_often, keep_own_time, log_queue])
def test_a_process_that_takes_nothing_changes_nothing(sections, process):
    space = ScenarioSpace.of(BUSY, **sections)
    for replication in range(5):
        about = (space, Wanderer(), 7, replication)
        alone = dess.simulate(*about, events=True)
        beside = dess.simulate(*about, events=True, processes=[process])
        assert beside.metrics.tobytes() == alone.metrics.tobytes()
        assert beside.uavs.tobytes() == alone.uavs.tobytes()
        assert beside.events is not None
        own = [row for row in beside.events if row.event != "queue"]
        assert repr(own) == repr([*(alone.events or ())])


def test_whoever_is_no_uav_waits_behind_all_of_them():
    env = Environment()
    queue = BatteryQueue(env, 1)
    served: list[str] = []

    def stay(name: str, *priority: object) -> Iterator[simpy.Event]:
        with queue.request(*priority) as pad:
            yield pad
            served.append(name)
            yield env.timeout(1)

    names = {"first": ((0, 0, 0),), "boat": (), "low": ((50, 1, 1),), "high": ((80, 1, 2),)}
    waiting = {name: env.process(stay(name, *priority)) for name, priority in names.items()}
    env.run(until=0.5)
    queue.reorder({waiting["high"]: (40, 1, 2)})
    assert queue.queue[-1].priority == AFTER_ALL_UAVS
    env.run()
    assert served == ["first", "high", "low", "boat"]


def moor_at_once(mission: Mission) -> None:
    """Forgets to yield."""
    mission.zones[0].request()


def log_a_move(mission: Mission) -> Iterator[simpy.Event]:
    """Uses a name of the model."""
    mission.log("move")
    yield mission.env.timeout(0)


@pytest.mark.parametrize(
    ("process", "line"),
    [
        (moor_at_once, "processes: moor_at_once yields nothing"),
        (log_a_move, "event: move is an event of the model; allowed: another name"),
    ],
)
def test_what_is_no_process_is_refused(process, line):
    with pytest.raises(InputError, match=line):
        dess.simulate(SCENARIO, "greedy", processes=[process])
