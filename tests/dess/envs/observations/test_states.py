"""Compact states have what the view tells of UAVs; weights see the same bits as ever."""

from hashlib import sha256
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given

import dess
from dess.envs.observations import states as column
from dess.envs.observations.states import compact_states, masks
from dess.model.guard import guard
from dess.model.mission import simulate
from dess.model.state import HOVER
from dess.model.view import View
from dess.policies import load
from dess.scenario.scenario import ScenarioSpace
from tests.dess.envs.episodes import placed
from tests.drawn import PLAIN_SEA, replications, seeds, spaces, teams

FIELDS = ("x", "y", "battery", "active", "latch", "charging")


class _Compared:
    """Another policy; on the way it compares its view with the compact states."""

    def __init__(self, policy: Any):
        self.policy, self.name = policy, policy.name

    def act(self, view: View) -> np.ndarray:
        state = view.state
        present = np.arange(state.uavs.shape[1]) < state.missions["uavs"][:, None]
        # Who charges, is done, or is on its way to a cell, can only hover.
        idle = state.uavs["charging"] | ~state.uavs["active"] | (state.uavs["slots_left"] > 0)
        assert not idle[view.mission, view.uav].any()
        idle = np.nonzero(present & idle)
        for guarded, mask in ((True, guard(view)), (False, view.legal)):
            states = compact_states(state, view.world.chart, guarded)
            assert (masks(states, view.mission, view.uav) == mask).all()
            assert (masks(states, *idle) == (np.arange(5) == HOVER)).all()
            assert not states.uavs[~present].any()
            for name in FIELDS:
                values = states.uavs[..., getattr(column, name.upper())]
                assert (values[present] == state.uavs[name][present]).all()
            assert (states.residual == state.residual.astype(np.float32)).all()
            for name in ("charge_start", "charge_complete"):
                values = states.missions[:, getattr(column, name.upper())]
                assert (values == state.missions[name]).all()
        return self.policy.act(view)


SLOW = spaces(fleet=[{"slots_per_cell": 3}, {}], **PLAIN_SEA)  # with islands, compiled once more


# A zone that all UAVs together fill.
TIGHT = ScenarioSpace.of(
    **{"grid": 4, "zone": [0, 0, 2, 2], "nodes": [[0, 0], [0, 1]], "pads": 1, "uavs": 4},
    **{"flying_time": 8, "charge_start": 10, "charge_complete": 11, "charge_rate": 1},
    **{"quota": 5, "communication_slots": 1, "max_slots": 20, "arrival_rate": 0, "edge_snr": 0},
    **{"initial_data": [0, 24], "path_loss_exponent": 2, "shadowing_variance": 0},
    **{"cell_size": 1, "altitude": 1, "fleet": [{"slots_per_cell": 3}, {}]},
)


@example(TIGHT, [load("random")], 0, 0)
@given(spaces() | SLOW, teams, seeds, replications)
def test_compact_states_tell_what_the_view_tells(space, team, seed, replication):
    simulate(space, [*map(_Compared, team[: space.uavs[1]])], seed, replication)


def test_each_has_its_own_parking_cell():
    # Both are nearest to (26, 5); the one with less battery chooses first.
    first, second = {"x": 23, "y": 5, "battery": 20}, {"x": 26, "y": 8, "battery": 19}
    states = compact_states(*placed([first, second]), True)
    assert states.uavs[0, :, column.HOME].tolist() == [3 + 1, 3]


def test_a_quota_beyond_all_bounds_is_just_far_away():
    states = compact_states(*placed([{}], quota=1_000_000, communication_slots=1), True)
    assert states.uavs[0, 0, column.NEEDED] == np.iinfo(np.int16).max


# Of the encoders with which the shipped weights were trained, and of the guard's masks. The
# encoders have a version, which changes with their part of these.
SEEN = {
    ("vector", "paper"): "8ea5cc2d4283723a3d29f2be17d2e53cd4eaf8042a1efb2c51b26b482059540b",
    ("maps", "paper"): "e038e55a82db0b271508e64f358ac0d1fde405dfcb5dd65dd50bd723e232b96b",
    ("sets", "paper"): "09dbf244ccfcbb3f6ba034025818e4aadb561c93ef00df99b2cba9fb59de113b",
    ("sets", "archipelago:7"): "bf3478ccd0a67a1967f93b8bd8d06e7a6478e0d04c6a12f3a38798757210821f",
    ("sets", "corridor:7"): "0f28db667afe158e55c66fd8ee40d8b49461550bef493e6b0700868886dde6a6",
}


@pytest.mark.parametrize(("kind", "sea"), SEEN)
def test_observations_of_a_fleet_stay_the_same_to_the_bit(kind, sea):
    scenario = dess.load_scenario(sea, flying_time=[12, 40])
    env = dess.vector_env(scenario, 20, 2, kind, guarded=True)
    generator, digest = np.random.default_rng(0), sha256()
    rows, info = env.reset()
    for _ in range(150):
        parts = rows.values() if isinstance(rows, dict) else [rows]
        for part in (*parts, info["action_mask"]):
            digest.update(part.tobytes())
        rows, *_, info = env.step(generator.integers(0, 5, env.num_envs))
    assert digest.hexdigest() == SEEN[kind, sea]
