"""Charging pads: queues worked by hand, shared power, Little's law."""

from typing import Any

import numpy as np
import pytest
from hypothesis import event, given

import policies
from dess import InputError
from dess.batch import simulate_batch
from dess.mission import simulate
from dess.record import MissionRecord
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from tests.drawn import Commuter, Fidget, Script, extended_spaces, replications, seeds

# Three UAVs hover in a zone of three cells, far from the only node; all may charge at once.
THREE: dict[str, Any] = {
    "grid": 4,
    "zone": [0, 1, 3, 1],
    "uavs": 3,
    "nodes": [[3, 3]],
    "initial_data": 1000.0,
    "charge_start": 11,
    "charge_complete": 20,
    "charge_rate": 5,
    "fleet": [{"flying_time": 11}, {"flying_time": 10}, {"flying_time": 9}],
    "max_slots": 7,
}


def _simulate(scenario: Scenario, *routes: str) -> MissionRecord:
    """The mission; both engines must agree on it."""
    record = simulate(scenario, Script(*routes), 0, 0, events=True)
    batch = simulate_batch(scenario, Script(*routes), 0, 1)
    assert batch.missions[0].tobytes() == record.metrics.tobytes()
    assert batch.uavs[0].tobytes() == record.uavs.tobytes()
    if record.operations is not None:
        assert batch.operations[0].tobytes() == record.operations.tobytes()
    return record


def _batteries(record: MissionRecord) -> list[list[int]]:
    """The batteries of each UAV at the ends of the slots."""
    assert record.events is not None
    log = record.events.columns()
    moves = log["event"] == "move"
    values, uavs = log["value"][moves].astype(int), log["uav"][moves]
    return [values[uavs == i].tolist() for i in range(len(record.uavs))]


def test_three_uavs_and_one_pad_first_come() -> None:
    """All ask in slot 0, so the index decides; 7 UAV-slots of waiting in 7 slots."""
    record = _simulate(Scenario.of(**THREE, pads=1, charging={"measured": True}), "", "", "")
    assert _batteries(record) == [
        [16, 20, 19, 18, 17, 16, 15],
        [9, 8, 13, 18, 20, 19, 18],
        [8, 7, 6, 5, 4, 9, 14],
    ]
    assert record.uavs["slots_waiting"].tolist() == [0, 2, 5]
    assert (record.queue, record.waiting, record.utilisation) == (1.0, 7 / 3, 1.0)
    assert record.pad_requests == 3


def test_three_uavs_and_one_pad_lowest_battery() -> None:
    """UAV 2 has the least battery, then UAV 1: 9 UAV-slots of waiting in 7 slots."""
    scenario = Scenario.of(**THREE, pads=1, charging={"order": "lowest-battery"})
    record = _simulate(scenario, "", "", "")
    assert _batteries(record) == [
        [10, 9, 8, 7, 6, 5, 10],
        [9, 8, 7, 12, 17, 20, 19],
        [14, 19, 20, 19, 18, 17, 16],
    ]
    assert (record.queue, record.waiting, record.utilisation) == (9 / 7, 3.0, 1.0)


def test_of_equal_batteries_the_earlier_request_comes_first() -> None:
    """UAV 0 leaves the queue in slot 1 and asks again in slot 3; UAV 1 has waited since slot 0."""
    values = THREE | {"fleet": [{"flying_time": 10}, {"flying_time": 10}, {"flying_time": 9}]}
    scenario = Scenario.of(**values, pads=1, charging={"order": "lowest-battery"})
    record = _simulate(scenario, ".NS....", "", "")
    assert _batteries(record)[:2] == [[9, 8, 7, 6, 5, 4, 9], [9, 8, 7, 12, 17, 20, 19]]
    assert record.events is not None
    log = record.events.columns()
    left = log["event"] == "charge_withdrawal"
    assert list(zip(log["time"][left], log["uav"][left], strict=True)) == [(1.0, 0)]
    assert record.pad_requests == 4


@pytest.mark.parametrize(
    ("order", "batteries"),
    [
        ("first-come", [[16, 20, 19, 18, 17], [12, 15, 20, 19, 18], [9, 9, 11, 16, 20]]),
        ("lowest-battery", [[11, 16, 16, 20, 19], [12, 14, 19, 19, 20], [14, 14, 16, 19, 20]]),
    ],
)
def test_pads_share_the_power_in_the_order_of_the_queue(
    order: str, batteries: list[list[int]]
) -> None:
    """Three pads share 7 % per slot; each takes 5 %, or what it lacks to 20 %, of what is left."""
    scenario = Scenario.of(
        **THREE | {"max_slots": 5}, pads=3, charging={"order": order, "power": 7}
    )
    record = _simulate(scenario, "", "", "")
    assert _batteries(record) == batteries
    assert (record.queue, record.waiting) == (0.0, 0.0)
    assert record.utilisation == record.uavs["slots_charging"].sum() / 15


def test_power_for_all_is_no_limit() -> None:
    limited = Scenario.of(**THREE, pads=3, charging={"power": 15})
    unlimited = Scenario.of(**THREE, pads=3)
    assert _batteries(_simulate(limited, "", "", "")) == _batteries(
        _simulate(unlimited, "", "", "")
    )


def _waits(record: MissionRecord) -> list[float]:
    """From the log: the time from each request to its grant, its withdrawal or the end."""
    assert record.events is not None
    log, since, waits = record.events.columns(), dict[int, float](), list[float]()
    for name, time, uav in zip(log["event"], log["time"], log["uav"], strict=True):
        if name == "charge_request":
            since[uav] = time
        elif name in ("charge_start", "charge_withdrawal"):
            waits.append(time - since.pop(uav))
    return waits + [record.slots - time for time in since.values()]


@given(extended_spaces(**{"charging.measured": True, "pads": 1}), seeds, replications)
def test_littles_law_holds_in_every_mission(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    """The mean queue times the time is the sum of the waiting times."""
    for policy in (Commuter(), Fidget()):
        record = simulate(space, policy, seed, replication, events=True)
        waits = _waits(record)
        assert record.pad_requests == len(waits)
        assert record.queue * record.slots == pytest.approx(sum(waits))
        assert record.waiting == pytest.approx(np.mean(waits) if waits else 0.0)
        if record.queue > 0:
            event("queue")


@given(extended_spaces(charging={}), seeds, replications)
def test_measuring_changes_nothing(space: ScenarioSpace, seed: int, replication: int) -> None:
    measured = ScenarioSpace.of(space, charging={"measured": True})
    for policy in (Commuter(), policies.load("greedy")):
        one = simulate_batch(space, policy, seed, [replication])
        other = simulate_batch(measured, policy, seed, [replication])
        assert one.missions.tobytes() == other.missions.tobytes()
        assert one.uavs.tobytes() == other.uavs.tobytes()


@pytest.mark.parametrize(
    ("field", "value", "message"),
    [
        ("order", "last-come", "'last-come' is unknown"),
        ("power", -1, "-1 is out of range; allowed: an integer 0..6,400"),
        ("power", 1.5, "1.5 is not an integer"),
        ("measured", "yes", "allowed: true or false"),
        ("queue", True, "unknown key"),
    ],
)
def test_what_a_scenario_may_not_say(field: str, value: Any, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scenario("paper", **{f"charging.{field}": value})
