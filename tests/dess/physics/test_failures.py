"""Failures: missions worked by hand, what policies see, times to failure and repair."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from dess import InputError
from dess.model.mission import simulate
from dess.model.state import BATTERY, QUOTA, TRUNCATED, constants_of, state_of
from dess.model.view import View
from dess.physics.failures import strike_nodes
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import CHANNEL, Case, check
from tests.drawn import Commuter, extended_spaces, failures, replications, seeds

# A UAV over the only node, of which it takes 8 units in each slot; all batteries last.
ALONE: dict[str, Any] = {
    **CHANNEL,
    **{"uavs": 1, "flying_time": 40, "zone": [1, 1, 1, 1], "nodes": [[1, 1]]},
    **{"initial_data": 100.0, "max_slots": 6},
}


def _failing(route: str, expected: dict[str, Any], fields: Any = (), **values: Any) -> Case:
    return Case(ALONE | dict(fields) | {"failures": values}, (route,), expected)


FLOWN = {
    "move time x value": [(0, 2, 39), (1, 2, 39), (2, 1, 38), (3, 1, 38), (4, 1, 37), (5, 1, 37)],
    "communication time": [1, 3, 5],
    "uav_failure time value": [(1, 39), (3, 38), (5, 37)],
    "uav_repair time value": [(2, 39), (4, 38)],
    "record failures slots_grounded lost slots uav_slots": [3, 3, 0, 6, 3],
    "uavs end": [TRUNCATED],
}
# The UAV asks again each time.
CHARGED = {
    "move value": [16, 15, 20, 19, 24, 23, 25],
    "charge_request time": [0, 1, 3, 5],
    "charge_start time": [0, 2, 4, 6],
    "charge_end time": [1, 3, 5, 7],
    "pad_failure time": [1, 3, 5, 7],
    "record pad_requests waiting queue utilisation": [4, 3 / 4, 3 / 7, 4 / 7],
}
CHARGING = {"flying_time": 11, "charge_start": 11, "charge_complete": 25, "charge_rate": 5}
CHARGING |= {"max_slots": 7, "charging": {"measured": True}}
CASES = {
    "a UAV is grounded in slots 1, 3 and 5": _failing("EEW...", FLOWN, uav_rate=1, uav_repair=1),
    "a pad is out of order in 1, 3, 5": _failing("", CHARGED, CHARGING, pad_rate=1, pad_repair=1),
    "a quota filled comes before a failure": _failing(
        "", {"uavs end": [QUOTA], "record failures": [0]}, {"quota": 1}, uav_rate=1
    ),
    "and so does an empty battery": _failing(
        "E", {"uavs end": [BATTERY], "record failures": [0]}, {"flying_time": 1}, uav_rate=1
    ),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_failures_worked_by_hand(case):
    check(case)


def test_the_pads_of_each_zone_have_their_own_times():
    """Two pads of the first zone fail in each slot and are repaired in the next, those of the
    second fail once and for all, and that of the third never does."""
    zones = [{"cells": [0, 4, 2, 1], "pads": 2}, {"cells": [4, 4, 1, 1]}]
    of_zones = {"pad_rates": [1.0, 1.0, 0.0], "pad_repairs": [1.0, 0.0, 0.0]}
    sea = {"grid": 5, "zone": [0, 0, 2, 1], "nodes": [[2, 2]], "uavs": 1, "zones": zones}
    space = ScenarioSpace.of(**sea, failures=of_zones, max_slots=4)
    record = simulate(space, Commuter(), 1, 0, events=True)
    log = record.events.columns()
    pads = {
        event: [(t, int(pad)) for e, t, pad in _rows(log) if e == event]
        for event in ("pad_failure", "pad_repair")
    }
    assert pads == {
        "pad_failure": [(1, 0), (1, 1), (1, 2), (1, 3), (3, 0), (3, 1)],
        "pad_repair": [(2, 0), (2, 1), (4, 0), (4, 1)],
    }
    # One value is that of all zones, and whoever sets it means all.
    both = ScenarioSpace.of(space, **{"failures.pad_rate": 0.25})
    assert both.failures.pad_rates == () and constants_of(both)["zone_pad_rate"][0, 2] == 0.25
    assert "pad_rates" not in ScenarioSpace.of(failures={"pad_rate": 0.1}).model_dump()["failures"]


def _rows(log: Any) -> Any:
    return zip(log["event"], log["time"], log["value"], strict=True)


@pytest.mark.parametrize(
    ("failures", "message"),
    [
        ({"pad_rates": [0.1, 0.2]}, "failures.pad_rates: there are 2; allowed: 1, one for each"),
        ({"pad_repairs": [9.0] * 3}, "failures.pad_repairs: there are 3; allowed: 1, one for"),
        ({"pad_rate": 0.1, "pad_rates": [0.2]}, "pad_rates: is given beside pad_rate; allowed"),
    ],
)
def test_failures_of_zones_fit_to_the_zones(failures, message):
    with pytest.raises(InputError) as raised:
        ScenarioSpace.of(failures=failures)
    assert message in str(raised.value)


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
def test_policies_see_what_has_failed(data, seed, replication):
    space = data.draw(extended_spaces(failures=data.draw(failures())))
    record = simulate(space, Informed(), seed, replication)
    kept = record.collected + record.residual + record.measured.get("lost", 0.0)
    assert kept == pytest.approx(record.initial + record.arrived, abs=1e-6)


def test_the_times_to_failure_and_to_repair_are_geometric():
    """Of 1000 nodes: chi-square of the first failure and of the first repair; fixed seed."""
    nodes = [[x, y] for x in range(40) for y in range(25)]
    space = ScenarioSpace.of(grid=40, nodes=nodes, failures={"node_rate": 0.1, "node_repair": 5.0})
    state = state_of([space], 1)
    state.missions[:] = constants_of(space)
    state.missions["seed"], state.missions["active"] = 5, 1
    failed, repaired = np.zeros(1000, int), np.zeros(1000, int)
    for slot in range(1, 400):
        state.missions["slot"] = slot
        strike_nodes(state.missions[0], state.residual[0], state.sensors[0])
        silent = state.sensors[0]["silent"]
        failed[silent & (failed == 0)] = slot
        repaired[~silent & (failed > 0) & (repaired == 0)] = slot
    for times, probability in ((failed, 0.1), (repaired - failed, 1 / 5.0)):
        edges = np.array([1, 2, 3, 5, 7, 10, 14, 20])
        seen = np.histogram(times, [*edges, 400])[0]
        expected = -1000 * np.diff([*stats.geom.sf(edges - 1, probability), 0.0])
        assert stats.chisquare(seen, expected).pvalue > 0.01
