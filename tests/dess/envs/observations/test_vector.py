"""The vector observation: the plain one, bit for bit."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess.envs.observations.states import CompactStates, Layout
from dess.envs.observations.vector import Vector
from tests.dess.envs.observations.any_teams import any_teams
from tests.dess.envs.observations.plain_vector import line_of


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
def test_it_is_the_plain_one_bit_for_bit(world):
    vector, states, uav = world
    plain = line_of(states, vector.layout, 0, uav)
    assert _line(vector, states, uav).tobytes() == plain.tobytes()
