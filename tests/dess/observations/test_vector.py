"""The vector observation: entries by hand, and what must not matter to it."""

from math import exp
from random import Random

import numpy as np
import pytest
from hypothesis import event, given
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
    UAV_COLUMNS,
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
from dess.state import HOVER, STEP_X, STEP_Y
from tests.dess.observations.plain_vector import line_of
from tests.drawn import EAST, NORTH, WEST

GRID = 32
OWN, ACTION, MATE = 16, 8, 11  # entries of a UAV itself, of an action, of a teammate
NEAR, MIDDLE, FAR = 1.2, 4.0, 12.0  # scales of nearness [slots]


class Parts:
    """The observation of one UAV, cut into its parts."""

    def __init__(self, line: np.ndarray, nodes: int, grid: int = GRID):
        sizes = [OWN, grid, grid, *[nodes] * 4, 5 * ACTION, 2 * MATE]
        assert len(line) == sum(sizes)
        cut = np.split(line.astype(float), np.cumsum(sizes)[:-1])
        self.own, self.column, self.row, self.data, self.near, self.lead, self.spare, *_ = cut
        self.actions, self.mates = cut[7].reshape(5, ACTION), cut[8].reshape(2, MATE)


def _team(*uavs: dict[int, int], residual: tuple[float, ...] = (0.0,)) -> CompactStates:
    """One mission, C_S 30 and C_C 80: active UAVs with the given columns, all actions open."""
    states = empty_states(1, len(uavs), len(residual))
    states.missions[0, [CHARGE_START, CHARGE_COMPLETE]] = 30, 80
    for row, values in zip(states.uavs[0], uavs, strict=True):
        for column, value in ({BATTERY: 60, ACTIVE: 1, MASK: 31} | values).items():
            row[column] = value
    states.residual[0] = residual
    return states


def _layout(*nodes: tuple[int, int]) -> Layout:
    return Layout(GRID, np.array([26, 2, 4, 4]), np.array(nodes))


def _observe(layout: Layout, states: CompactStates, uav: int = 0) -> Parts:
    (lines,) = Vector(layout).encode(states, np.array([0]), np.array([uav]))
    return Parts(lines[0], len(layout.nodes), layout.grid)


# --- by hand ---


def test_a_uav_knows_itself() -> None:
    me = {X: 20, Y: 10, BATTERY: 33, NEEDED: 70, LATCH: 1, MUST_CHARGE: 1, HOME: 11}
    seen = _observe(_layout((3, 6), (8, 6)), _team(me, residual=(8.0, 4.0)))
    assert seen.own == pytest.approx(
        [
            0.33,  # battery
            0.7,  # slots to the quota
            1,  # latched
            1,  # must charge
            0.3,  # C_S
            0.8,  # C_C
            11 / 30,  # slots to its parking cell
            (33 - 1 - 11) / 50,  # slots in hand, far
            1,  # and near: eight or more
            3 / 50,  # battery above C_S, far
            3 / 10,  # and near
            (70 - 80) / 40,  # what one charge will not do
            1,  # ten slots or more to the quota
            0,  # teammates
            1,  # alone
            12 / 20,  # data per node
        ]
    )
    assert np.nonzero(seen.column)[0].tolist() == [20]
    assert np.nonzero(seen.row)[0].tolist() == [10]
    assert seen.column.max() == seen.row.max() == 1


def test_a_node_under_the_uav_and_one_four_slots_east() -> None:
    seen = _observe(_layout((5, 20), (9, 20)), _team({X: 5, Y: 20}, residual=(10.0, 5.0)))
    assert seen.data == pytest.approx([1, 0.5])
    assert seen.near == pytest.approx([1, 0.5 * exp(-1)])
    assert seen.lead.tolist() == [1, 1]  # nobody else is there
    for action, slots in ((HOVER, (0, 4)), (EAST, (1, 3)), (WEST, (1, 5)), (NORTH, (1, 5))):
        sums = [
            (10 * exp(-slots[0] / scale) + 5 * exp(-slots[1] / scale)) / norm
            for scale, norm in ((NEAR, 10), (MIDDLE, 25), (FAR, 80))
        ]
        # Allowed, nobody there, the data nearby, and all of it is free.
        assert seen.actions[action] == pytest.approx([1, 0, *sums, *sums])


def test_which_nodes_it_has_slots_for() -> None:
    # 3, 8 and 21 slots away, and 7, 12 and 22 from the zone's nearest cell.
    layout = _layout((19, 5), (18, 9), (4, 5))
    me = {X: 22, Y: 5, BATTERY: 12, NEEDED: 9}
    # Without need to charge there are nine slots to fly.
    seen = _observe(layout, _team(me, residual=(1.0, 1.0, 1.0)))
    assert seen.spare == pytest.approx([(9 - 3) / 20, (9 - 8) / 20, (9 - 18) / 20])
    # With it there are eleven, and the way back to the zone.
    seen = _observe(layout, _team(me | {MUST_CHARGE: 1}, residual=(1.0, 1.0, 1.0)))
    assert seen.spare == pytest.approx([(11 - 3 - 7) / 20, (11 - 8 - 12) / 20, -1])


def test_what_is_not_allowed_is_marked() -> None:
    seen = _observe(_layout((5, 20)), _team({X: 5, Y: 20, MASK: 1 << EAST | 1 << HOVER}))
    assert seen.actions[:, 0].tolist() == [0, 1, 0, 0, 1]


def test_a_teammate_in_the_neighbouring_cell() -> None:
    mate = {X: 6, Y: 20, BATTERY: 40, NEEDED: 50, MUST_CHARGE: 1}
    team = _team({X: 5, Y: 20}, mate, residual=(10.0, 20.0))
    seen = _observe(_layout((5, 20), (9, 20)), team)
    assert seen.own[13:15].tolist() == [1, 0]
    # On the cell in the east, and one slot from here.
    assert seen.actions[:, 1] == pytest.approx([0, 1, 0, 0, 0.3])
    # It is a slot farther from the one node and a slot nearer to the other: that is less free.
    assert seen.lead == pytest.approx([0.1, -0.1])
    free = (10 + 0.3 * 20 * exp(-4 / MIDDLE)) / 25
    assert seen.actions[HOVER, 2 + 3 + 1] == pytest.approx(free)
    first = [1, 1 / 30, 0, 1 / 3, 0, 0.4, 0.5, 0, 1, 6 / 30, 20 / 30]
    assert seen.mates[0] == pytest.approx(first)
    assert not seen.mates[1].any()
    # Who charges competes for no node.
    team.uavs[0, 1, CHARGING] = 1
    seen = _observe(_layout((5, 20), (9, 20)), team)
    assert seen.lead.tolist() == [1, 1]
    assert seen.mates[0, 7] == 1


def test_the_two_nearest_teammates_come_first() -> None:
    cells = [(5, 20), (15, 20), (5, 24), (8, 18), (5, 31)]
    seen = _observe(_layout((0, 0)), _team(*({X: x, Y: y} for x, y in cells)))
    assert seen.own[13] == 4
    assert seen.mates[:, 1:3] * 30 == pytest.approx(np.array([(0, 4), (3, -2)]))
    assert seen.mates[:, 3:5] == pytest.approx(np.array([(0, 1), (1, -2 / 3)]))


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
def test_it_has_one_form_for_every_fleet(world: tuple[Vector, CompactStates, int]) -> None:
    vector, states, uav = world
    (lines,) = vector.encode(states, np.zeros(3, np.int64), np.full(3, uav))
    assert lines.dtype == np.float32
    assert lines.shape == (3, *vector.shapes[0])
    assert np.isfinite(lines).all()
    assert (lines == lines[0]).all()


@given(_worlds())
def test_the_data_near_a_cell_is_that_of_all_nodes(
    world: tuple[Vector, CompactStates, int],
) -> None:
    vector, states, uav = world
    grid, _, nodes = vector.layout
    seen = Parts(_line(vector, states, uav), len(nodes), grid)
    me = states.uavs[0, uav]
    for action in range(5):  # cells off the grid included
        cell = me[X] + STEP_X[action], me[Y] + STEP_Y[action]
        slots = abs(nodes - cell).sum(1)
        for scale, norm, entry in zip(
            (NEAR, MIDDLE, FAR), (10, 25, 80), seen.actions[action, 2:], strict=False
        ):
            expected = (states.residual[0] * np.exp(-slots / scale)).sum() / norm
            assert entry == pytest.approx(expected, rel=1e-4)


@given(_worlds(), st.integers(0, 2**32 - 1))
def test_who_is_done_does_not_matter(world: tuple[Vector, CompactStates, int], seed: int) -> None:
    vector, states, uav = world
    line = _line(vector, states, uav)
    done = states.uavs[0, :, ACTIVE] == 0
    event(f"done {done.sum()}")
    # Whatever their state is.
    rng = np.random.default_rng(seed)
    other = states._replace(uavs=states.uavs.copy())
    other.uavs[0, done] = rng.integers(0, 2, (done.sum(), UAV_COLUMNS))
    other.uavs[0, done, ACTIVE] = 0
    assert (_line(vector, other, uav) == line).all()
    # And if they have never been there.
    fewer = states._replace(uavs=states.uavs[:, ~done].copy())
    assert (_line(vector, fewer, uav - done[:uav].sum()) == line).all()


@given(_worlds(), st.randoms(use_true_random=False))
def test_the_order_of_the_teammates_does_not_matter(
    world: tuple[Vector, CompactStates, int], random: Random
) -> None:
    vector, states, uav = world
    team = states.uavs[0]
    order = list(range(len(team)))
    random.shuffle(order)
    turned = states._replace(uavs=states.uavs[:, order].copy())
    line, other = _line(vector, states, uav), _line(vector, turned, order.index(uav))
    # Of two that are equally near either may be described first.
    mates = [j for j in range(len(team)) if j != uav and team[j, ACTIVE]]
    slots = [abs(team[j, [X, Y]] - team[uav, [X, Y]]).sum() for j in mates]
    tied = len(set(slots)) < len(slots)
    event(f"tied {tied}")
    end = -2 * MATE if tied else None
    assert line[:end] == pytest.approx(other[:end], rel=1e-5, abs=1e-6)


@pytest.mark.parametrize("change", [BATTERY, NEEDED, LATCH, MUST_CHARGE, HOME, MASK, X, Y])
def test_what_it_should_tell_apart_it_does(change: int) -> None:
    layout = layout_of(load_scenario("paper"))
    me = {X: 20, Y: 10, NEEDED: 50, HOME: 11}
    team = _team(me, {X: 25, Y: 10}, residual=(10.0,) * 25)
    line = _line(Vector(layout), team, 0)
    team.uavs[0, 0, change] ^= 1
    assert (_line(Vector(layout), team, 0) != line).any()


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
        states = compact_states(env.state, False)
        for row in np.flatnonzero(env.state.uavs["active"])[slot % 5 :: 5]:
            plain = line_of(states, layout_of(space), *divmod(row, space.uavs[1]))
            assert rows[row].tobytes() == plain.tobytes()
        rows, *_ = env.step(generator.integers(0, 5, env.num_envs))
