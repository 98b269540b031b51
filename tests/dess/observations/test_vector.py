"""The vector observation: entries by hand, and what must not matter to it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess.env.vector import vector_env
from dess.observations.states import (
    CompactStates,
    Layout,
    compact_states,
    layout_of,
)
from dess.observations.vector import Vector
from dess.scenario import load_scenario
from tests.dess.observations.any_teams import any_teams
from tests.dess.observations.plain_vector import line_of

GRID = 32
OWN, ACTION, MATE = 16, 8, 11  # entries of a UAV itself, of an action, of a teammate
NEAR, MIDDLE, FAR = 1.2, 4.0, 12.0  # scales of nearness [slots]


# --- by hand ---


# --- what matters, and what does not ---


@st.composite
def _worlds(draw: st.DrawFn) -> tuple[Vector, CompactStates, int]:
    """A layout, a mission of a team in any state, and a UAV of it that is active."""
    grid = draw(st.integers(2, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    nodes = rng.integers(0, grid, (draw(st.integers(1, 5)), 2))
    states, uav = draw(any_teams([*np.ndindex(grid, grid)], len(nodes)))
    return Vector(Layout(grid, np.array([0, 0, 1, 1]), nodes)), states, uav


def _line(vector: Vector, states: CompactStates, uav: int) -> np.ndarray:
    (lines,) = vector.encode(states, np.array([0]), np.array([uav]))
    return lines[0]


@given(_worlds())
def test_it_is_the_plain_one_bit_for_bit(world: tuple[Vector, CompactStates, int]) -> None:
    vector, states, uav = world
    plain = line_of(states, vector.layout, 0, uav)
    assert _line(vector, states, uav).tobytes() == plain.tobytes()


def test_all_of_a_fleet_are_the_plain_ones_bit_for_bit() -> None:
    space = load_scenario("paper")
    env = vector_env(space, 20, observation="vector")
    generator = np.random.default_rng(0)
    rows, _ = env.reset(seed=2)
    for slot in range(60):
        states = compact_states(env.state, space.chart, False)
        for row in np.flatnonzero(env.state.uavs["active"])[slot % 5 :: 5]:
            plain = line_of(states, layout_of(space), *divmod(row, space.uavs[1]))
            assert rows[row].tobytes() == plain.tobytes()
        rows, *_ = env.step(generator.integers(0, 5, env.num_envs))
