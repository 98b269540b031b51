"""Compact states have the same information on the UAVs as the view, and the guard's mask."""

from typing import Any

import numpy as np
from hypothesis import event, given

from dess.env.stepper import MissionStepper
from dess.mission import simulate
from dess.observations import states as columns
from dess.observations.guard import guard
from dess.observations.states import (
    ACTIVE,
    BATTERY,
    CHARGING,
    HOME,
    LATCH,
    NEEDED,
    CompactStates,
    X,
    Y,
    compact_states,
    masks,
)
from dess.scenario import ScenarioSpace
from dess.state import HOVER, State
from dess.view import View
from tests.drawn import replications, seeds, spaces, teams

FIELDS = {
    X: "x",
    Y: "y",
    BATTERY: "battery",
    ACTIVE: "active",
    LATCH: "latch",
    CHARGING: "charging",
}


class _Compared:
    """Another policy; on the way it compares its view with the compact states."""

    def __init__(self, policy: Any):
        self.policy, self.name = policy, policy.name
        self.charging = 0

    def act(self, view: View) -> np.ndarray:
        guarded, free = compact_states(view.state, True), compact_states(view.state, False)
        assert (masks(guarded, view.mission, view.uav) == guard(view)).all()
        assert (masks(free, view.mission, view.uav) == view.legal).all()
        for states in (guarded, free):
            self._compare(view.state, states)
        return self.policy.act(view)

    def _compare(self, state: State, states: CompactStates) -> None:
        present = np.arange(state.uavs.shape[1]) < state.missions["uavs"][:, None]
        assert not states.uavs[~present].any()
        for column, field in FIELDS.items():
            assert (states.uavs[..., column][present] == state.uavs[field][present]).all()
        assert (states.residual == state.residual.astype(np.float32)).all()
        assert (states.missions[:, columns.CHARGE_START] == state.missions["charge_start"]).all()
        finish = states.missions[:, columns.CHARGE_COMPLETE]
        assert (finish == state.missions["charge_complete"]).all()
        # Who charges, and who is done, can only hover.
        idle = np.nonzero(present & (state.uavs["charging"] | ~state.uavs["active"]))
        only_hover = np.arange(5) == HOVER
        assert (masks(states, *idle) == only_hover).all()
        self.charging += int(state.uavs["charging"].sum())


@given(spaces(), teams, seeds, replications)
def test_snapshots_tell_what_the_view_tells(
    space: ScenarioSpace, team: list[Any], seed: int, replication: int
) -> None:
    compared = [_Compared(policy) for policy in team[: space.uavs[1]]]
    simulate(space, compared, seed, replication)
    event(f"somebody charged {any(policy.charging for policy in compared)}")


def _state(uavs: list[dict[str, Any]], **scenario: Any) -> State:
    """One mission with UAVs in given states, 400 communications short of the quota."""
    space = ScenarioSpace.of(**({"uavs": len(uavs), "charge_start": 30} | scenario))
    stepper = MissionStepper(space, 1, 1)
    stepper.launch(stepper.indices)
    for u, values in zip(stepper.state.uavs[0], uavs, strict=True):
        for name, value in ({"battery": 60, "communications": 40} | values).items():
            u[name] = value
    return stepper.state


def test_each_has_its_own_parking_cell() -> None:
    # Both are nearest to (26, 5); the one with less battery chooses first.
    first, second = {"x": 23, "y": 5, "battery": 20}, {"x": 26, "y": 8, "battery": 19}
    states = compact_states(_state([first, second]), True)
    assert states.uavs[0, :, HOME].tolist() == [3 + 1, 3]


def test_a_quota_beyond_all_bounds_is_just_far_away() -> None:
    states = compact_states(_state([{}], quota=1_000_000, communication_slots=1), True)
    assert states.uavs[0, 0, NEEDED] == np.iinfo(np.int16).max
