"""Failures: missions worked by hand, conservation of data, times to failure and repair."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st
from scipy import stats

from dess.mission import simulate
from dess.scenario import Scenario, ScenarioSpace
from dess.sections.failures import strike
from dess.state import LOST, constants_of, empty_state
from dess.view import View
from tests.dess.flights import CHANNEL, flown, rows_of
from tests.drawn import Commuter, extended_spaces, failures, replications, seeds

# A UAV over the only node, of which it takes 8 units in each slot; all batteries last.
ALONE: dict[str, Any] = {
    **CHANNEL,
    "uavs": 1,
    "flying_time": 40,
    "zone": [1, 1, 1, 1],
    "nodes": [[1, 1]],
    "initial_data": 100.0,
    "max_slots": 6,
}


def test_a_uav_that_fails_and_is_repaired_at_once() -> None:
    """With probabilities of 1 it flies in slots 0, 2 and 4 and is grounded in 1, 3 and 5."""
    scenario = Scenario.of(**ALONE, failures={"uav_rate": 1, "uav_repair": 1})
    record, log = flown(scenario, "EEW...")
    assert rows_of(log, "move", "time", "x", "value") == [
        *((0, 2, 39), (1, 2, 39), (2, 1, 38)),
        *((3, 1, 38), (4, 1, 37), (5, 1, 37)),
    ]
    assert rows_of(log, "communication", "time") == [1, 3, 5]
    assert rows_of(log, "uav_failure", "time", "value") == [(1, 39), (3, 38), (5, 37)]
    assert rows_of(log, "uav_repair", "time", "value") == [(2, 39), (4, 38)]
    assert (record.failures, record.slots_grounded, record.lost) == (3, 3, 0)
    assert (record.slots, record.uav_slots) == (6, 3)
    assert record.uav_rows()[0]["end"] == "truncated"


@pytest.mark.parametrize(("data", "collected", "lost"), [("kept", 8, 0), ("lost", 0, 8)])
def test_a_lost_uav_and_its_data(data: str, collected: float, lost: float) -> None:
    scenario = Scenario.of(**ALONE, failures={"uav_rate": 1, "uav_data": data})
    record, log = flown(scenario, "......")
    assert record.uav_rows() == [{"quota": 1, "battery": 39, "slots_charging": 0, "end": "lost"}]
    assert (record.slots, record.success, record.failures) == (1, 0, 1)
    assert record.collected == pytest.approx(collected, abs=1e-9)
    assert record.uavs["collected"][0] == pytest.approx(collected, abs=1e-9)
    assert record.lost == pytest.approx(lost, abs=1e-9)
    assert record.residual == pytest.approx(92, abs=1e-9)
    assert record.collection_ratio == pytest.approx(collected / 100, abs=1e-9)
    assert len(rows_of(log, "data_lost", "value")) == (data == "lost")


def test_a_quota_filled_or_a_battery_empty_comes_before_a_failure() -> None:
    for values, end in (({"quota": 1}, "quota"), ({"flying_time": 1}, "battery")):
        scenario = Scenario.of(**ALONE | values, failures={"uav_rate": 1})
        record, _ = flown(scenario, "E.....")
        assert (record.uav_rows()[0]["end"], record.failures) == (end, 0)


@pytest.mark.parametrize(
    ("data", "served", "residual", "lost"), [("kept", [1, 3, 5], 76, 0), ("lost", [1], 0, 92)]
)
def test_a_silent_node(data: str, served: list[int], residual: float, lost: float) -> None:
    """It is silent in slots 1, 3 and 5; what it holds then is kept or lost."""
    values = {"node_rate": 1, "node_repair": 1, "node_data": data}
    record, log = flown(Scenario.of(**ALONE, failures=values), "......")
    assert rows_of(log, "communication", "time") == served
    assert rows_of(log, "node_failure", "time") == [1, 3, 5]
    assert rows_of(log, "node_repair", "time") == [2, 4, 6]
    assert record.residual == pytest.approx(residual, abs=1e-9)
    assert record.lost == pytest.approx(lost, abs=1e-9)
    assert record.uavs["quota"].tolist() == [len(served)]


def test_a_pad_that_fails_and_is_repaired_at_once() -> None:
    """It works in slots 0, 2, 4 and 6. The UAV asks again each time and waits in 1, 3 and 5."""
    values = {"flying_time": 11, "charge_start": 11, "charge_complete": 25, "charge_rate": 5}
    scenario = Scenario.of(
        **ALONE | values | {"max_slots": 7},
        failures={"pad_rate": 1, "pad_repair": 1},
        charging={"measured": True},
    )
    record, log = flown(scenario, "")
    assert rows_of(log, "move", "value") == [16, 15, 20, 19, 24, 23, 25]
    assert rows_of(log, "charge_request", "time") == [0, 1, 3, 5]
    assert rows_of(log, "charge_start", "time") == [0, 2, 4, 6]
    assert rows_of(log, "charge_end", "time") == [1, 3, 5, 7]
    assert rows_of(log, "pad_failure", "time") == [1, 3, 5, 7]
    assert (record.pad_requests, record.waiting, record.queue) == (4, 3 / 4, 3 / 7)
    assert record.utilisation == 4 / 7


class Informed(Commuter):
    """Commutes, and checks who is asked for an action, and what the view tells of failures."""

    name = "informed"

    def act(self, view: View) -> np.ndarray:
        assert not view.own["grounded"].any()
        assert (view.residual[view.silent] == 0).all()
        holding = (view.team["charging"] & view.team["active"]).sum(1)
        assert (holding <= view.pads_working).all()
        assert (view.pads_working <= view.constants["pads"]).all()
        return super().act(view)


@given(st.data(), seeds, replications)
def test_no_data_disappear(data: st.DataObject, seed: int, replication: int) -> None:
    """Of each node, and in total: initial + arrived = collected + residual + lost."""
    space = data.draw(extended_spaces(failures=data.draw(failures()), age={"measured": True}))
    record = simulate(space, Informed(), seed, replication, events=True)
    total = record.initial + record.arrived
    assert record.operations is not None
    lost = 0.0 if math.isnan(record.lost) else record.lost
    assert record.collected + record.residual + lost == pytest.approx(total, abs=1e-6)
    assert record.uavs["collected"].sum() == pytest.approx(record.collected, abs=1e-6)
    assert record.events is not None
    log = record.events.columns()
    assert sum(rows_of(log, "data_lost", "value")) == pytest.approx(lost)
    gone = {*rows_of(log, "data_lost", "uav")}
    balance = np.zeros(len(space.nodes))
    signs = {"mission_start": 1, "arrival": 1, "communication": -1, "data_lost": -1}
    for name, node, value in zip(log["event"], log["node"], log["value"], strict=True):
        if node >= 0:
            balance[node] += signs.get(name, 0) * value
    left = log["event"] == "mission_end"
    for node, value in zip(log["node"][left], log["value"][left], strict=True):
        if node >= 0:
            balance[node] -= value
    assert balance == pytest.approx(np.zeros(len(balance)), abs=1e-6)
    for end, what in ((record.failures > 0, "failures"), (lost > 0, "lost"), (gone, "gone")):
        if end:
            event(what)


def test_the_times_to_failure_and_to_repair_are_geometric() -> None:
    """Of 1000 nodes: chi-square of the first failure and of the first repair; fixed seed."""
    nodes = [[x, y] for x in range(40) for y in range(25)]
    values = {"node_rate": 0.1, "node_repair": 5.0}
    scenario = Scenario.of(grid=40, nodes=nodes, failures=values)
    state = empty_state(1, scenario.uavs, len(nodes), 0)
    state.missions[:] = constants_of(ScenarioSpace.of(scenario))
    state.missions["seed"], state.missions["active"] = 5, 1
    failed, repaired = np.zeros(1000, int), np.zeros(1000, int)
    for slot in range(1, 400):
        state.missions["slot"] = slot
        strike(state.missions[0], state.uavs[0], state.residual[0], state.sensors[0], LOST)
        silent = state.sensors[0]["silent"]
        failed[silent & (failed == 0)] = slot
        repaired[~silent & (failed > 0) & (repaired == 0)] = slot
    assert (repaired > failed).all()
    for times, probability in ((failed, 0.1), (repaired - failed, 1 / 5.0)):
        edges = np.array([1, 2, 3, 5, 7, 10, 14, 20])
        seen = np.histogram(times, [*edges, 400])[0]
        expected = -1000 * np.diff([*stats.geom.sf(edges - 1, probability), 0.0])
        assert stats.chisquare(seen, expected).pvalue > 0.01
