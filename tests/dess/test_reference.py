"""Whole missions against the plain reference, and the laws that no mission may break."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import event, given

from dess.mission import simulate
from dess.record import MissionRecord
from dess.scenario import Scenario
from dess.state import END_NAMES
from tests.drawn import Recorder, policies, replications, scenarios, seeds
from tests.reference import Reference

TOLERANCE = 1e-9


def _agree(record: MissionRecord, reference: Reference) -> None:
    assert record.slots == reference.slot
    assert len(record.uavs) == len(reference.uavs)
    for row, u in zip(record.uavs, reference.uavs, strict=True):
        assert END_NAMES[row["end"]] == u.end
        assert row["quota"] == u.communications
        for name in ("battery", "slots_flying", "slots_charging", "slots_waiting"):
            assert row[name] == getattr(u, name), name
        assert row["collected"] == pytest.approx(u.collected, abs=TOLERANCE)
        assert row["reward"] == pytest.approx(u.reward, abs=TOLERANCE, rel=TOLERANCE)
    assert record.success == all(u.end == "quota" for u in reference.uavs)
    collected = sum(u.collected for u in reference.uavs)
    assert record.initial == pytest.approx(reference.initial, abs=TOLERANCE)
    assert record.arrived == reference.arrived
    assert record.collected == pytest.approx(collected, abs=TOLERANCE)
    assert record.residual == pytest.approx(reference.residual.sum(), abs=TOLERANCE)
    assert record.reward == pytest.approx(sum(u.reward for u in reference.uavs), abs=TOLERANCE)
    total = reference.initial + reference.arrived
    assert record.collection_ratio == pytest.approx(collected / total, abs=TOLERANCE)
    assert record.collection_ratio_and_communication == record.collection_ratio * record.success


@given(
    scenarios(shadowing_variance=4.0, initial_data=(0.1, 15.0), max_slots=50),
    policies,
    seeds,
    replications,
)
def test_a_mission_equals_the_reference(
    scenario: Scenario, policy: object, seed: int, replication: int
) -> None:
    recorder = Recorder(policy)
    record = simulate(scenario, recorder, seed, replication)
    reference = Reference(scenario, seed, replication, recorder.asked).run()
    _agree(record, reference)
    for u in reference.uavs:
        event(f"end {u.end}")
    if any(u.slots_waiting for u in reference.uavs):
        event("queue")


@given(scenarios(), policies, seeds, replications)
def test_nothing_is_lost_and_everything_counted_once(
    scenario: Scenario, policy: object, seed: int, replication: int
) -> None:
    record = simulate(scenario, policy, seed, replication, events=True)
    assert record.events is not None
    log = record.events.columns()

    def rows(name: str) -> dict[str, np.ndarray]:
        chosen = log["event"] == name
        return {column: values[chosen] for column, values in log.items()}

    # Data, in total and per node.
    balance = record.initial + record.arrived - record.collected - record.residual
    assert balance == pytest.approx(0.0, abs=TOLERANCE)
    start, end = rows("mission_start"), rows("mission_end")
    arrivals, served = rows("arrival"), rows("communication")
    for k in range(len(scenario.nodes)):
        before = start["value"][start["node"] == k].sum()
        after = end["value"][end["node"] == k].sum()
        arrived = arrivals["value"][arrivals["node"] == k].sum()
        taken = served["value"][served["node"] == k].sum()
        assert before + arrived - taken - after == pytest.approx(0.0, abs=TOLERANCE)
        assert after >= 0.0
    assert record.initial == pytest.approx(start["value"][start["node"] >= 0].sum(), abs=TOLERANCE)
    assert record.arrived == arrivals["value"].sum()
    assert record.collected == pytest.approx(served["value"].sum(), abs=TOLERANCE)
    assert record.collected == pytest.approx(record.uavs["collected"].sum(), abs=TOLERANCE)
    assert 0.0 <= record.collection_ratio <= 1.0

    # Communications: at most one per UAV and communication slot, each counted once, in no slot
    # in which the UAV charges.
    instants = list(zip(served["uav"].tolist(), served["time"].tolist(), strict=True))
    assert len(set(instants)) == len(instants)
    counts = Counter(served["uav"].tolist())
    for i, row in enumerate(record.uavs):
        assert counts[i] == row["quota"] <= scenario.communication_slots * row["slots_flying"]

    # Battery: a flying slot costs flight_cost, a charging slot gives charge_rate, the last less.
    moves = rows("move")
    for i, row in enumerate(record.uavs):
        levels = [scenario.flying_time, *moves["value"][moves["uav"] == i].astype(int).tolist()]
        steps = np.diff(levels)
        flying = steps == -scenario.flight_cost
        capped = np.minimum(np.array(levels[:-1]) + scenario.charge_rate, scenario.charge_complete)
        assert (np.array(levels[1:])[~flying] == capped[~flying]).all()
        assert flying.sum() == row["slots_flying"]
        assert (~flying).sum() == row["slots_charging"]
        assert levels[-1] == row["battery"]
        assert min(levels) >= 0
        assert max(levels) <= max(scenario.flying_time, scenario.charge_complete)
        assert row["slots_waiting"] <= row["slots_flying"]
    assert record.uav_slots == len(moves["uav"])
    event(f"success {record.success}")
