"""Missions with packets: conservation, latency, and the event log packet by packet."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings

from dess import InputError, parallel_env
from dess.batch import simulate_batch
from dess.mission import MissionModel, simulate
from dess.record import EventLog, MissionRecord
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from dess.sections.age import age_of_teeth
from dess.sections.buffers import DELIVERED, LOST, WAITING
from dess.view import View
from tests.drawn import Commuter, Wanderer, continuous_spaces, policies, replications, seeds

# A mission of any small space with packets under any of the test policies.
missions = given(continuous_spaces(), policies, seeds, replications)


def _flown(space: ScenarioSpace, policy: Any, seed: int, replication: int) -> tuple[Any, Any]:
    """A mission that has been flown, and its record."""
    model = MissionModel(space, [policy], seed, replication, EventLog())
    return model, model.run()


@settings(max_examples=30)
@missions
def test_conservation_in_missions_and_at_each_node(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    model, record = _flown(space, policy, seed, replication)
    packets = model.packets.buffers.packets
    ours = record.operations
    assert len(packets) == ours["generated"]
    assert (packets["status"] == DELIVERED).sum() == ours["delivered"]
    assert (packets["status"] == LOST).sum() == ours["lost_packets"]
    assert record.initial + record.arrived == pytest.approx(
        record.collected + record.residual + ours["lost"]
    )
    assert 0.0 <= record.collection_ratio <= 1.0
    log = record.events.columns()
    for k in range(len(space.nodes)):
        own = packets[packets["node"] == k]
        waiting = own["remaining"][own["status"] == WAITING]
        assert model.residual[k] == pytest.approx(waiting.sum(), abs=1e-9)
        assert space.arrivals.buffer == 0 or len(waiting) <= space.arrivals.buffer
        # Data of the node: what it had and what arrived is collected, lost or still there.
        collected = log["value"][(log["event"] == "communication") & (log["node"] == k)].sum()
        started = log["value"][(log["event"] == "mission_start") & (log["node"] == k)].sum()
        arrived = (own["generated"] > 0.0).sum()
        lost = own["remaining"][own["status"] == LOST].sum()
        assert started + arrived == pytest.approx(collected + lost + waiting.sum())


@settings(max_examples=30)
@missions
def test_the_log_tells_what_became_of_each_packet(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    record = simulate(space, policy, seed, replication, events=True)
    assert record.events is not None
    log = record.events.columns()
    rows = {name: log["event"] == name for name in ("arrival", "delivery", "loss")}
    start = (log["event"] == "mission_start") & (log["packet"] >= 0)
    born = np.concatenate([log["packet"][start], log["packet"][rows["arrival"]]]).tolist()
    assert born == [*range(len(born))]
    generated = {
        **dict.fromkeys(log["packet"][start].tolist(), 0.0),
        **dict(zip(log["packet"][rows["arrival"]], log["time"][rows["arrival"]], strict=True)),
    }
    gone = [log["packet"][rows[name]].tolist() for name in ("delivery", "loss")]
    assert len({*gone[0], *gone[1]}) == len(gone[0]) + len(gone[1])
    assert record.generated == len(born)
    assert (record.delivered, record.lost_packets) == (len(gone[0]), len(gone[1]))
    for name in rows:
        for packet, born_at in zip(
            log["packet"][rows[name]], log["generated"][rows[name]], strict=True
        ):
            assert generated[packet] == born_at
    of_uavs = (log["event"] == "data_lost") & (log["uav"] >= 0)
    assert record.lost == pytest.approx(log["value"][rows["loss"] | of_uavs].sum())
    latency = log["time"][rows["delivery"]] - log["generated"][rows["delivery"]]
    if len(latency):
        assert record.latency == pytest.approx(latency.mean())
        assert (latency <= record.latency_p99).mean() >= 0.99
        assert (latency < record.latency_p99).mean() < 0.99
    else:
        assert math.isnan(record.latency)
    _check_littles_law(record, log, len(born))
    _check_ages(record, space, log)


def _check_littles_law(record: MissionRecord, log: dict[str, np.ndarray], born: int) -> None:
    """The packets in all buffers over time, and the time that each of them was there."""
    start = (log["event"] == "mission_start") & (log["packet"] >= 0)
    number, before, area = int(start.sum()), 0.0, 0.0
    for time, name in zip(log["time"], log["event"], strict=True):
        area += number * (time - before)
        before = time
        number += {"arrival": 1, "delivery": -1, "loss": -1}.get(name, 0)
    lost = log["event"] == "loss"
    there = (log["time"][lost] - log["generated"][lost]).sum()
    gone = np.isin(log["event"], ("delivery", "loss"))
    waiting = {*log["packet"][log["packet"] >= 0].tolist()} - {*log["packet"][gone].tolist()}
    for row in range(len(log["time"])):
        if log["packet"][row] in waiting:
            there += record.slots - log["generated"][row]
    delivered = record.latency * record.delivered if record.delivered else 0.0
    assert number == len(waiting) == born - record.delivered - record.lost_packets
    assert area == pytest.approx(there + delivered)


def _check_ages(record: MissionRecord, space: ScenarioSpace, log: dict[str, np.ndarray]) -> None:
    """The ages of a record are those of the deliveries in its log."""
    teeth, peaks = [], []
    done = log["event"] == "delivery"
    for k in range(len(space.nodes)):
        own = done & (log["node"] == k)
        since = newest = 0.0
        for time in sorted({*log["time"][own]}):
            fresh = log["generated"][own & (log["time"] == time)].max()
            if fresh > newest:
                teeth.append((since - newest, time - newest))
                peaks.append(time - newest)
                newest, since = fresh, time
        teeth.append((since - newest, record.slots - newest))
    lows, highs = np.array(teeth).T.copy()
    assert (record.age, record.age_p99) == pytest.approx(
        age_of_teeth(lows, highs, np.ones(len(lows)))
    )
    assert record.peak_age == pytest.approx(np.mean(peaks) if peaks else math.nan, nan_ok=True)


@settings(max_examples=15)
@given(continuous_spaces(), seeds, replications)
def test_arrivals_do_not_depend_on_the_policy(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    records = [simulate(space, p, seed, replication, events=True) for p in (Wanderer(), Commuter())]
    end = min(record.slots for record in records)
    arrivals = []
    for record in records:
        assert record.events is not None
        log = record.events.columns()
        rows = (log["event"] == "arrival") & (log["time"] < end)
        arrivals.append([*zip(log["time"][rows], log["node"][rows], strict=True)])
    assert arrivals[0] == arrivals[1]


class _Hover:
    name = "hover"

    def act(self, view: View) -> np.ndarray:
        return np.full(len(view), 4)


def _over_a_node(**values: Any) -> Scenario:
    """A UAV hovers over a node; it collects up to ``slot_length`` data units per slot or so."""
    base = {
        "grid": 4,
        "zone": [1, 1, 1, 1],
        "nodes": [[1, 1]],
        "uavs": 1,
        "initial_data": 0.0,
        "quota": 100_000,
        "flying_time": 100,
        "max_slots": 50,
        "edge_snr": 300,
        "arrivals.process": "continuous",
    }
    return Scenario.of(**(base | values))


@pytest.mark.parametrize("m", [1, 3, 4, 7])
def test_a_packet_is_served_in_the_next_communication_slot(m: int) -> None:
    """Also where the node was empty before, and inside a group of communication slots."""
    scenario = _over_a_node(communication_slots=m, slot_length=100, arrival_rate=1.5)
    model, record = _flown(ScenarioSpace.of(scenario), _Hover(), 5, 0)
    done = model.packets.buffers.packets[model.packets.buffers.delivered]
    assert len(done) > 50
    assert done["left"] == pytest.approx(np.ceil(done["generated"] * m) / m)
    assert record.latency == pytest.approx((done["left"] - done["generated"]).mean())


def test_policies_see_the_age_of_the_newest_data() -> None:
    seen = {}

    class Reader(_Hover):
        def act(self, view: View) -> np.ndarray:
            seen[int(view.constants["slot"][0])] = float(view.age[0, 0])
            return super().act(view)

    scenario = _over_a_node(slot_length=100, arrival_rate=0.3, **{"age.reward": -2.0})
    model, record = _flown(ScenarioSpace.of(scenario), Reader(), 5, 0)
    packets = model.packets.buffers.packets
    for slot, age in seen.items():
        known = packets["generated"][packets["left"] <= slot]
        assert age == pytest.approx(slot - known.max(initial=0.0))
    plain = simulate(_over_a_node(slot_length=100, arrival_rate=0.3), _Hover(), 5, 0)
    ends = [
        *[seen[slot] for slot in range(1, 50)],
        record.slots - packets["generated"][packets["left"] <= record.slots].max(),
    ]
    assert record.reward - plain.reward == pytest.approx(-2.0 * sum(ends))


def test_only_the_simpy_engine_has_continuous_arrivals() -> None:
    space = load_scenario("paper", **{"arrivals.process": "continuous"})
    for refused in (lambda: simulate_batch(space, _Hover()), lambda: parallel_env(space)):
        with pytest.raises(InputError, match="arrivals.process: continuous needs the SimPy"):
            refused()


@pytest.mark.parametrize("node_data", ["kept", "lost"])
def test_packets_of_silent_nodes_wait_or_are_lost(node_data: str) -> None:
    """A node falls silent after slot 0 for good: later packets arrive, and nobody gets them."""
    scenario = _over_a_node(
        slot_length=100,
        arrival_rate=1.0,
        **{"failures.node_rate": 1.0, "failures.node_data": node_data},
    )
    model, record = _flown(ScenarioSpace.of(scenario), _Hover(), 5, 0)
    packets = model.packets.buffers.packets
    assert (packets["generated"] > 1).sum() == (packets["status"] != DELIVERED).sum() > 20
    expected = LOST if node_data == "lost" else WAITING
    assert set(packets["status"][packets["generated"] > 1]) == {expected}
    silent = (packets["generated"] > 1).sum()
    assert (record.lost, record.residual) == ((silent, 0) if node_data == "lost" else (0, silent))
