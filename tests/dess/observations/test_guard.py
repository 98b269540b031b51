"""The return guard: UAVs that follow it reach the charger in time."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given

from dess import streams
from dess.mission import simulate
from dess.observations.guard import guard
from dess.scenario import ScenarioSpace
from dess.state import BATTERY, HOVER
from dess.view import View
from tests import compiled
from tests.dess.env.episodes import placed
from tests.drawn import EAST, NORTH, SOUTH, WEST, replications, seeds, spaces


class Guarded:
    """Any action that the guard allows, at random; on the way it checks the mask."""

    name = "guarded"

    def act(self, view: View) -> np.ndarray:
        mask = guard(view)
        assert mask.shape == (len(view), 5)
        assert mask.any(1).all()
        assert not (mask & ~view.legal).any()
        constants = zip(view.constants, view.uav, mask.sum(1), strict=True)
        picks = []
        for c, i, choices in constants:
            place = (streams.POLICY, 1, c["slot"], i)
            word = streams.block(c["seed"], c["replication"], *place)[0]
            picks.append(streams.integer(word, 0, choices - 1))
        return np.argmax(mask.cumsum(1) > np.array(picks)[:, None], 1)


@given(spaces(uavs=1, initial_data=1e6), seeds, replications)
def test_the_battery_of_a_guarded_lone_uav_is_never_depleted(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    record = simulate(space, Guarded(), seed, replication)
    assert (record.uavs["end"] != BATTERY).all()
    event(f"charged {record.uavs['slots_charging'][0] > 0}")


def _mask(*uavs: dict[str, Any]) -> np.ndarray:
    """The guard's masks for UAVs in given states, 400 communications short of the quota."""
    rows = np.zeros(len(uavs), int), np.arange(len(uavs))
    state, chart = placed([*uavs])
    return guard(View(state, SimpleNamespace(chart=chart), *rows))


def test_at_the_last_moment_only_the_way_home_is_left() -> None:
    # The corner of the zone (26, 5) is 6 + 5 = 11 steps from (20, 10), then one slot to charge in.
    (mask,) = _mask({"x": 20, "y": 10, "battery": 12})
    assert np.nonzero(mask)[0].tolist() == [NORTH, EAST]
    # With plenty of battery all is open.
    (mask,) = _mask({"x": 20, "y": 10, "battery": 60})
    assert mask.all()
    # Somewhere in between the guard closes in; never before it must.
    opened = [_mask({"x": 20, "y": 10, "battery": b})[0].sum() for b in range(12, 30)]
    assert opened == sorted(opened)
    assert opened[3:] == [5] * len(opened[3:])


def test_the_edge_of_the_grid_and_parked_teammates_are_closed() -> None:
    (mask,) = _mask({"x": 0, "y": 0})
    assert np.nonzero(mask)[0].tolist() == [EAST, SOUTH, HOVER]
    parked = {"x": 26, "y": 3, "latch": True, "battery": 20}
    mask = _mask({"x": 25, "y": 3}, parked)[0]
    assert not mask[EAST]
    assert mask[[NORTH, SOUTH, WEST, HOVER]].all()


def test_who_has_been_overruled_leaves_contested_cells_to_the_right_of_way() -> None:
    # Both want the cell between them; the one with less battery goes first.
    first, second = {"x": 10, "y": 10, "battery": 50}, {"x": 10, "y": 12, "battery": 60}
    open_to_both = _mask(first, second)
    assert open_to_both[0, SOUTH] and open_to_both[1, NORTH]
    collided = _mask(first | {"overruled": True}, second | {"overruled": True})
    assert collided[0, SOUTH] and not collided[1, NORTH]
    assert collided[1, [EAST, SOUTH, WEST, HOVER]].all()


# --- pads ---

# One UAV far off, and two in the zone; C_S 30, C_C 80, 10 % per slot.
QUEUE: dict[str, Any] = {"charge_start": 30, "charge_complete": 80, "pads": 1}
OFF: dict[str, Any] = {"charging": {"plan_waits": False}}


@pytest.mark.parametrize(
    ("batteries", "asked", "scenario", "slots"),
    [
        ([60, 30, 60], [1], OFF, 0),
        ([60, 30, 60], [1], OFF | {"failures": {"pad_rate": 0.1}}, 5),
        ([60, 30, 60], [1], {"charging": {"measured": True}}, 5),
        ([60, 30, 60], [1], {}, 5),  # 50 % at 10 % per slot
        ([60, 70, 70], [], {}, 0),  # it comes first
        ([60, 20, 50], [1], {}, 11),  # 60 % and, of the one in the air at C_S, 50 %
        ([60, 20, 60], [1], {}, 6),  # on a tie the lower index, its own, comes first
        ([60, 20, 20], [1, 2], {"pads": 2}, 6),  # 120 % at 20 % per slot
        ([60, 20, 20], [1], {"pads": 3}, 0),
        ([60, 20, 20], [1, 2], {"charging": {"power": 5}}, 24),
        ([60, 20, 20], [1, 2], {"charging": {"power": 1}}, 29),  # C_S - 1 at most
        ([20, 20, 20], [0, 1], {}, 0),  # it has asked
        ([60, 50, 50], [], {"quota": 40}, 0),  # they need not charge
    ],
)
def test_the_time_that_a_uav_expects_to_wait(
    batteries: list[int], asked: list[int], scenario: dict[str, Any], slots: int
) -> None:
    uavs = [{"battery": b, "pad_request": -1, "communications": 0, "x": 0} for b in batteries]
    for i in asked:
        uavs[i]["pad_request"] = 0
    state, chart = placed(uavs, **QUEUE | scenario)
    assert compiled.waiting_time(state.missions[0], state.uavs[0], 0, chart, 26, 2) == slots


def test_where_no_pad_will_ever_work_no_uav_must_charge() -> None:
    state, _ = placed([{"battery": 5}], **QUEUE, failures={"pad_rate": 0.1})
    mission, u = state.missions[0], state.uavs[0, 0]
    assert compiled.must_charge(mission, u, 1e6)
    mission["pads_out"][0] = 1
    assert not compiled.must_charge(mission, u, 1e6)
    mission["pad_repair"] = 0.5
    assert compiled.must_charge(mission, u, 1e6)
