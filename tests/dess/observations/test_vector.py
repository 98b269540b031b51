"""The vector observation: entries by hand, and what must not matter to it."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess.env.vector import vector_env
from dess.observations.states import (
    ACTIVE,
    BATTERY,
    CHARGE_COMPLETE,
    CHARGE_START,
    CHARGING,
    HOME,
    LATCH,
    MASK,
    MUST_CHARGE,
    NEEDED,
    CompactStates,
    Layout,
    X,
    Y,
    compact_states,
    empty_states,
    layout_of,
)
from dess.observations.vector import Vector
from dess.scenario import load_scenario
from tests.dess.observations.plain_vector import line_of

GRID = 32
OWN, ACTION, MATE = 16, 8, 11  # entries of a UAV itself, of an action, of a teammate
NEAR, MIDDLE, FAR = 1.2, 4.0, 12.0  # scales of nearness [slots]


# --- by hand ---


# --- what matters, and what does not ---


@st.composite
def _worlds(draw: st.DrawFn) -> tuple[Vector, CompactStates, int]:
    """A layout, a mission of a team of up to six in any state, and one that is active."""
    grid = draw(st.integers(2, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    nodes = rng.integers(0, grid, (draw(st.integers(1, 5)), 2))
    uavs = draw(st.integers(1, 6))
    states = empty_states(1, uavs, len(nodes))
    states.missions[0, [CHARGE_START, CHARGE_COMPLETE]] = rng.integers((10, 60), (51, 101))
    team = states.uavs[0]
    team[:, [X, Y]] = rng.integers(0, grid, (uavs, 2))
    team[:, BATTERY] = rng.integers(0, 101, uavs)
    team[:, NEEDED] = rng.integers(0, 111, uavs)
    team[:, [ACTIVE, LATCH, CHARGING, MUST_CHARGE]] = rng.integers(0, 2, (uavs, 4))
    team[:, HOME] = rng.integers(0, 2 * grid, uavs)
    team[:, MASK] = rng.integers(1, 32, uavs)
    states.residual[0] = rng.uniform(0, 20, len(nodes))
    uav = draw(st.integers(0, uavs - 1))
    team[uav, ACTIVE] = 1
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
