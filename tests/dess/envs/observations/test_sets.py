"""Sets: the plain ones, values by hand, and what a mirrored, rotated or renamed sea changes."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess.envs.observations import states as column
from dess.envs.observations.sets import SEA_PART, Sets, sea_of
from dess.envs.observations.states import CompactStates, empty_states
from dess.model.channel import world_of
from dess.model.state import HOVER, constants_of, part_of, starts_of, state_of
from dess.physics.chart import NO_FLY
from dess.scenario.scenario import ScenarioSpace
from tests.dess.envs.observations.any_teams import any_teams
from tests.dess.envs.observations.plain_sets import arrays_of
from tests.dess.model.turns import Turn
from tests.drawn import seas, spaces

_OWN, ACTIONS, NODES, NODE_MOVES, MATES, MATE_MOVES, _ZONES, ZONE_MOVES = range(8)
# Walls with a gap in the north or south, so that some ways are longer than the longest that counts.
MAZE: dict[str, Any] = {
    **{"grid": 81, "rows": 12, "nodes": ((0, 11), (40, 5), (78, 3), (80, 0)), "zone": (0, 4, 1, 2)},
    "zones": [{"cells": (x, 2, 1, height)} for x, height in ((2, 1), (4, 1), (6, 1), (78, 10))],
    "no_fly": [(x, y) for x in range(1, 80, 2) for y in range(12) if y != x % 4 // 2 * 11],
}


def _sets(space: ScenarioSpace) -> Sets:
    return Sets(sea_of(constants_of(space)[0], world_of(space)), space.uavs[1])


def _encode(space: ScenarioSpace, states: CompactStates, uav: int) -> tuple[np.ndarray, ...]:
    return tuple(a[0] for a in _sets(space).encode(states, np.array([0]), np.array([uav])))


@st.composite
def _cases(draw: st.DrawFn) -> tuple[ScenarioSpace, CompactStates, int]:
    """A sea, a team in any state on it, and a UAV that is active."""
    space = ScenarioSpace.of(uavs=1, edge_snr=-14.0, **draw(seas()))
    return space, *draw(_teams(space))


@st.composite
def _worlds(draw: st.DrawFn, **sea: Any) -> tuple[ScenarioSpace, CompactStates, int]:
    """A space, some missions with teams in any state on it, and a UAV that is active in each."""
    data = draw(st.sampled_from([(0.0, 0.0), (0.0, 40.0), (8.0, 12.0)]))
    space = draw(spaces(**sea, initial_data=data))
    return space, *draw(_teams(space, 10))


def _teams(space: ScenarioSpace, count: int = 1) -> st.SearchStrategy[tuple[CompactStates, int]]:
    open_cells = np.argwhere(space.chart.zones.T != NO_FLY).tolist()
    return any_teams(open_cells, len(space.nodes), count)


def _turned(states: CompactStates, turn: Turn) -> CompactStates:
    """The states on a sea that is turned."""
    team, mask = states.uavs.copy(), states.uavs[..., column.MASK, None]
    x, y = states.uavs[..., column.X], states.uavs[..., column.Y]
    team[..., column.X], team[..., column.Y] = turn.cell(x, y)
    team[..., column.MASK] = ((mask >> np.arange(5) & 1) << turn.actions).sum(-1)
    return states._replace(uavs=team)


@pytest.mark.parametrize("sea", [{}, MAZE], ids=["drawn", "maze"])
@given(st.data())
def test_its_numbers_are_the_plain_ones(sea, data):
    """Without a tolerance: both round at the same places."""
    space, states, uav = data.draw(_worlds(**sea))
    missions = np.arange(len(states.missions))
    parts = _sets(space).encode(states, missions, np.full_like(missions, uav))
    for b in missions:
        for part, plain in zip(parts, arrays_of(space, states, b, uav), strict=True):
            np.testing.assert_array_equal(part[b], plain)


@given(_cases(), st.integers(1, 7))
def test_a_mirrored_or_rotated_sea_has_its_moves_in_another_order(case, which):
    space, states, uav = case
    turn = Turn.all_of(space)[which]
    plain = _encode(space, states, uav)
    turned = _encode(turn.sea(space), _turned(states, turn), uav)
    moves = [*turn.actions[:HOVER], *(4 + turn.actions[:HOVER]), 8]
    orders = {ACTIONS: turn.actions, NODE_MOVES: moves, MATE_MOVES: moves, ZONE_MOVES: moves}
    for part, values in enumerate(plain):
        order = orders.get(part, slice(None))
        np.testing.assert_allclose(turned[part][order], values, atol=1e-6)


@given(_cases(), st.randoms(use_true_random=False))
def test_renamed_nodes_and_uavs_are_the_same_sets(case, random):
    space, states, uav = case
    nodes, team = [*range(len(space.nodes))], [*range(states.uavs.shape[1])]
    random.shuffle(nodes)
    random.shuffle(team)
    residual = np.ascontiguousarray(states.residual[:, nodes])
    renamed = states._replace(uavs=states.uavs[:, team], residual=residual)
    others = ScenarioSpace.of(space, nodes=[space.nodes[k] for k in nodes])
    expected, mates = [*_encode(space, states, uav)], [j - (j > uav) for j in team if j != uav]
    for part, order in ((NODES, nodes), (MATES, mates)):
        expected[part], expected[part + 1] = expected[part][order], expected[part + 1][:, order]
    for part, values in zip(_encode(others, renamed, team.index(uav)), expected, strict=True):
        np.testing.assert_allclose(part, values, atol=1e-5)


def test_a_small_sea_by_hand():
    """Two nodes, a teammate and two zones, with an island between the UAV and a node.

    . . . . . . .    Z zones, U the UAV, T the teammate
    Z . U # n . Z    n a node with data, and one without at (2, 4)
    . . . # . . .
    . T . . . . .
    . . n . . . .
    """
    space = ScenarioSpace.of(
        grid=7, rows=5, zone=(0, 1, 1, 1), zones=[{"cells": (6, 1, 1, 1)}], uavs=1,
        nodes=[(4, 1), (2, 4)], no_fly=[(3, 1), (3, 2)], initial_data=(8.0, 8.0),
    )  # fmt: skip
    states = empty_states(1, 2, 2)
    states.missions[0] = 30, 80
    states.uavs[0, :, : column.UAV_COLUMNS] = [
        # x, y, battery, needed, active, latch, charging, must charge, home, mask
        [2, 1, 40, 50, 1, 0, 0, 1, 2, 0b11101],
        [1, 3, 60, 50, 1, 0, 0, 0, 3, 0b11111],
    ]
    states.residual[0] = 4.0, 0.0
    own, actions, nodes, node_moves, mates, mate_moves, zones, zone_moves = _encode(
        space, states, 0
    )
    assert own[:5] == pytest.approx([0.4, 0.5, 0, 1, 0.3])
    assert own[7:9] == pytest.approx([37 / 50, 1])  # 40 - 1 slot to charge - 2 home
    # The unit is 8; the way around the island is 4 cells to the north.
    assert nodes[:, 1] == pytest.approx([0.5, 0.0])
    assert nodes[:, 4] == pytest.approx([4 / 30, 3 / 30])
    assert nodes[:, 8] == pytest.approx([(5 - 4) / 10, (2 - 3) / 10])
    assert nodes[:, 12] == pytest.approx([1, 1])  # more than 20 slots to spare
    assert node_moves.T[0] == pytest.approx([1, 0, 0, 0, 0, 1, 0, -1, 1])
    assert node_moves.T[1] == pytest.approx([0, 0, 1, 0, -1, 0, 1, 0, 1])
    assert mates[0, [0, 1, 6, 9]] == pytest.approx([1, 3 / 30, 0.6, 0])
    assert mate_moves[:, 0] == pytest.approx([0, 0, 1, 1, -2 / 3, -1 / 3, 2 / 3, 1 / 3, 1])
    assert zones[:, 1] == pytest.approx([2 / 30, 6 / 30])
    assert zones[:, 4].tolist() == [1, 0]
    assert zone_moves[:4].T.tolist() == [[0, 0, 0, 1], [1, 0, 0, 0]]
    assert actions[:, 0].tolist() == [0, 0, 0, 0, 1]
    assert actions[:, 1].tolist() == [1, 0, 1, 1, 1]
    assert actions[:, 2].tolist() == [1, 0, 1, 1, 1]  # the island is to the east
    near = 0.5 * np.exp(-np.array([3, 4, 5, 5, 4]) / 4.0) / 2.5
    assert actions[:, 6] == pytest.approx(near, rel=1e-5)


def test_missions_of_a_batch_may_have_different_seas():
    """The pads and the data may differ from mission to mission, the geometry may not."""
    same = [ScenarioSpace.of(uavs=1, charge_start=n) for n in (20, 30)]
    other = [ScenarioSpace.of(uavs=1, **field) for field in ({"pads": 3}, {"arrival_rate": 0.1})]
    for kinds, expected in ((same, 1), (same + other, 3)):
        state = state_of(kinds, len(kinds))
        state.missions[:] = starts_of(kinds).constants
        assert len({part.tobytes() for part in part_of(state.missions, SEA_PART)}) == expected
