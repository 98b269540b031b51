"""What policies are asked, and what they see."""

from typing import Any

import numpy as np
from hypothesis import given

from dess.mission import simulate
from dess.scenario import ScenarioSpace
from dess.state import STEP_X, STEP_Y
from dess.view import View
from tests.drawn import Fidget, replications, seeds, spaces


class _Inspector:
    """Follows another policy and checks each view on the way."""

    name = "inspector"

    def __init__(self, policy: Any, space: ScenarioSpace):
        self.policy, self.space, self.calls = policy, space, 0

    def act(self, view: View) -> np.ndarray:
        self.calls += 1
        state, rows = view.state, range(len(view))
        fleet = int(state.missions[0]["uavs"])
        uavs = state.uavs[0]
        acting = [i for i in range(fleet) if uavs[i]["active"] and not uavs[i]["charging"]]
        assert view.uav.tolist() == acting
        assert view.mission.tolist() == [0] * len(acting)
        assert (view.own == uavs[acting]).all()
        assert view.constants.shape == (len(view),)
        assert view.team.shape == (len(view), self.space.uavs[1])
        assert view.residual.shape == (len(view), len(self.space.nodes))
        assert view.legal.shape == (len(view), 5)
        for row in rows:
            assert (view.team[row] == uavs).all()
            np.testing.assert_array_equal(view.residual[row], state.residual[0])
            for action in range(5):
                x = view.own[row]["x"] + STEP_X[action]
                y = view.own[row]["y"] + STEP_Y[action]
                on_grid = 0 <= x < self.space.grid and 0 <= y < self.space.grid
                assert view.legal[row, action] == on_grid
        return self.policy.act(view)


@given(spaces(max_slots=40), seeds, replications)
def test_a_view_shows_who_must_act_and_all_that_may_be_known(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    inspector = _Inspector(Fidget(), space)
    record = simulate(space, inspector, seed, replication)
    assert 0 < inspector.calls <= record.slots
