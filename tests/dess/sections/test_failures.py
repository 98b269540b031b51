"""Failures: missions worked by hand, conservation of data, times to failure and repair."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st
from scipy import stats

from dess import InputError
from dess.batch import simulate_batch
from dess.mission import simulate
from dess.record import MissionRecord
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from dess.sections.failures import strike
from dess.state import HOVER, LOST, State, constants_of, empty_state
from dess.view import View
from tests import compiled
from tests.drawn import Commuter, Script, Wanderer, extended_spaces, failures, replications, seeds

# A UAV over the only node, of which it takes 8 units in each slot; all batteries last.
ALONE: dict[str, Any] = {
    "grid": 4,
    "cell_size": 40.0,
    "altitude": 10.0,
    "path_loss_exponent": 2.0,
    "edge_snr": 10 * math.log10(1.9921875),
    "shadowing_variance": 0.0,
    "arrival_rate": 0.0,
    "communication_slots": 1,
    "uavs": 1,
    "flying_time": 40,
    "zone": [1, 1, 1, 1],
    "nodes": [[1, 1]],
    "initial_data": 100.0,
    "max_slots": 6,
}


def _simulate(scenario: Scenario, *routes: str) -> tuple[MissionRecord, dict[str, np.ndarray]]:
    """The mission and its log; both engines must agree on it."""
    record = simulate(scenario, Script(*routes), 0, 0, events=True)
    batch = simulate_batch(scenario, Script(*routes), 0, 1)
    assert batch.missions[0].tobytes() == record.metrics.tobytes()
    assert batch.uavs[0].tobytes() == record.uavs.tobytes()
    assert record.operations is not None
    assert record.events is not None
    assert batch.operations[0].tobytes() == record.operations.tobytes()
    return record, record.events.columns()


def _rows(log: dict[str, np.ndarray], event: str, *names: str) -> list[tuple]:
    chosen = log["event"] == event
    return list(zip(*(log[name][chosen].tolist() for name in names), strict=True))


def test_a_uav_that_fails_and_is_repaired_at_once() -> None:
    """With probabilities of 1 it flies in slots 0, 2 and 4 and is grounded in 1, 3 and 5."""
    scenario = Scenario.of(**ALONE, failures={"uav_rate": 1, "uav_repair": 1})
    record, log = _simulate(scenario, "EEW...")
    assert _rows(log, "move", "time", "x", "value") == [
        *((0, 2, 39), (1, 2, 39), (2, 1, 38)),
        *((3, 1, 38), (4, 1, 37), (5, 1, 37)),
    ]
    assert [t for (t,) in _rows(log, "communication", "time")] == [1, 3, 5]
    assert _rows(log, "uav_failure", "time", "value") == [(1, 39), (3, 38), (5, 37)]
    assert _rows(log, "uav_repair", "time", "value") == [(2, 39), (4, 38)]
    assert (record.failures, record.slots_grounded, record.lost) == (3, 3, 0)
    assert (record.slots, record.uav_slots) == (6, 3)
    assert record.uav_rows()[0]["end"] == "truncated"


@pytest.mark.parametrize(("data", "collected", "lost"), [("kept", 8, 0), ("lost", 0, 8)])
def test_a_lost_uav_and_its_data(data: str, collected: float, lost: float) -> None:
    scenario = Scenario.of(**ALONE, failures={"uav_rate": 1, "uav_data": data})
    record, log = _simulate(scenario, "......")
    assert record.uav_rows() == [{"quota": 1, "battery": 39, "slots_charging": 0, "end": "lost"}]
    assert (record.slots, record.success, record.failures) == (1, 0, 1)
    assert record.collected == pytest.approx(collected, abs=1e-9)
    assert record.uavs["collected"][0] == pytest.approx(collected, abs=1e-9)
    assert record.lost == pytest.approx(lost, abs=1e-9)
    assert record.residual == pytest.approx(92, abs=1e-9)
    assert record.collection_ratio == pytest.approx(collected / 100, abs=1e-9)
    assert len(_rows(log, "data_lost", "value")) == (data == "lost")


def test_a_quota_filled_or_a_battery_empty_comes_before_a_failure() -> None:
    for values, end in (({"quota": 1}, "quota"), ({"flying_time": 1}, "battery")):
        scenario = Scenario.of(**ALONE | values, failures={"uav_rate": 1})
        record, _ = _simulate(scenario, "E.....")
        assert (record.uav_rows()[0]["end"], record.failures) == (end, 0)


@pytest.mark.parametrize(
    ("data", "served", "residual", "lost"), [("kept", [1, 3, 5], 76, 0), ("lost", [1], 0, 92)]
)
def test_a_silent_node(data: str, served: list[int], residual: float, lost: float) -> None:
    """It is silent in slots 1, 3 and 5; what it holds then is kept or lost."""
    values = {"node_rate": 1, "node_repair": 1, "node_data": data}
    record, log = _simulate(Scenario.of(**ALONE, failures=values), "......")
    assert [t for (t,) in _rows(log, "communication", "time")] == served
    assert [t for (t,) in _rows(log, "node_failure", "time")] == [1, 3, 5]
    assert [t for (t,) in _rows(log, "node_repair", "time")] == [2, 4, 6]
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
    record, log = _simulate(scenario, "")
    assert [b for (b,) in _rows(log, "move", "value")] == [16, 15, 20, 19, 24, 23, 25]
    assert [t for (t,) in _rows(log, "charge_request", "time")] == [0, 1, 3, 5]
    assert [t for (t,) in _rows(log, "charge_start", "time")] == [0, 2, 4, 6]
    assert [t for (t,) in _rows(log, "charge_end", "time")] == [1, 3, 5, 7]
    assert [t for (t,) in _rows(log, "pad_failure", "time")] == [1, 3, 5, 7]
    assert (record.pad_requests, record.waiting, record.queue) == (4, 3 / 4, 3 / 7)
    assert record.utilisation == 4 / 7


def test_a_uav_whose_pad_fails_keeps_its_place() -> None:
    """UAV 1 asks in slot 0, UAV 0 in slot 1, when the only pad is out of order."""
    values = {"zone": [1, 1, 3, 1], "uavs": 2, "pads": 1, "max_slots": 4, "charge_rate": 5}
    values |= {"flying_time": 11, "charge_start": 11, "charge_complete": 25}
    scenario = Scenario.of(**ALONE | values, failures={"pad_rate": 1, "pad_repair": 1})
    _, log = _simulate(scenario, "E", "")
    assert (1, 0) in _rows(log, "charge_request", "time", "uav")
    assert _rows(log, "charge_start", "time", "uav") == [(0, 1), (2, 1)]


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
    assert sum(value for (value,) in _rows(log, "data_lost", "value")) == pytest.approx(lost)
    gone = {uav for (uav,) in _rows(log, "data_lost", "uav")}
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


@given(st.data(), seeds, replications)
def test_nodes_and_pads_fail_alike_under_all_policies(
    data: st.DataObject, seed: int, replication: int
) -> None:
    values = {"uavs": 2, "zone": [0, 0, 2, 1], "pads": None, "quota": 10**6, "flight_cost": 0}
    values |= {"max_slots": 20, "failures": data.draw(failures()) | {"uav_rate": 0.0}}
    space = data.draw(extended_spaces(**values))
    kept = [
        [row for row in zip(log["time"], log["event"], log["node"], strict=True) if row[1] in NAMES]
        for log in (
            simulate(space, policy, seed, replication, events=True).events.columns()  # type: ignore[union-attr]
            for policy in (Commuter(), Wanderer())
        )
    ]
    assert kept[0] == kept[1]


NAMES = ("pad_failure", "pad_repair", "node_failure", "node_repair")


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


def _grounded(x: int) -> tuple[State, Any]:
    """A grounded UAV at x, 0 and a teammate at 0, 0."""
    scenario = ScenarioSpace.of(
        grid=4, nodes=[[3, 3]], zone=[0, 0, 2, 1], uavs=2, failures={"uav_rate": 0.5}
    )
    state = empty_state(1, 2, len(scenario.nodes), 0)
    state.missions[:] = constants_of(scenario)
    team = state.uavs[0]
    team["active"], team["slots_per_cell"], team["battery"] = True, 1, 50
    team["x"], team["grounded"], team["action"] = [0, x], [False, True], HOVER
    return state, team


def test_a_grounded_uav_stays_where_it_is_and_blocks_its_cell() -> None:
    state, team = _grounded(1)
    team["action"] = [1, 1]  # both east
    compiled.resolve(state.missions[0], team)
    assert team["x"].tolist() == [0, 1]
    assert team["overruled"].tolist() == [True, False]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ({"uav_rate": 1.5}, "1.5 is out of range; allowed: a number 0..1"),
        ({"node_rate": -0.1}, "-0.1 is out of range"),
        ({"pad_repair": 0.5}, "pad_repair: 0.5 is less than a slot; allowed: 0, or 1 and more"),
        ({"uav_data": "sold"}, "'sold' is unknown"),
        ({"rate": 0.1}, "unknown key"),
    ],
)
def test_what_a_scenario_may_not_say(values: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        load_scenario("paper", failures=values)


def test_only_so_many_pads_can_fail() -> None:
    values = {"zone": [0, 0, 13, 5], "failures": {"pad_rate": 0.1}}
    with pytest.raises(InputError, match="pads: 65 are too many to fail; allowed: 64 at most"):
        load_scenario("paper", **values)
    load_scenario("paper", **values, pads=64)
