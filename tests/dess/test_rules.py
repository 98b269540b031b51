"""The safety controller, which every mission asks once a slot, and the start of a mission."""

from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from dess import rules
from dess.scenario import Scenario, ScenarioSpace
from dess.state import HOVER, STEP_X, STEP_Y, State, starts_of, state_of
from tests import compiled
from tests.drawn import EAST, NORTH, SOUTH, WEST, cells, replications, seeds, spaces

STEPS = list(zip(STEP_X.tolist(), STEP_Y.tolist(), strict=True))


def _launched(space: ScenarioSpace, seed: int = 1, replication: int = 2) -> State:
    """A mission at the start of slot 0."""
    state = state_of([space], 1)
    rules.launch(state, 0, starts_of([space], seed), 0, replication)
    return state


# --- launch ---


@given(spaces(), seeds, replications)
def test_uavs_start_on_distinct_cells_of_the_zone(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    state = _launched(space, seed, replication)
    mission, uavs = state.missions[0], state.uavs[0]
    fleet = uavs[: mission["uavs"]]
    x, y, width, height = space.zone
    starts = {(int(u["x"]), int(u["y"])) for u in fleet}
    assert len(starts) == len(fleet) == mission["active"]
    assert all(x <= a < x + width and y <= b < y + height for a, b in starts)
    assert fleet["active"].all()
    assert not uavs[mission["uavs"] :]["active"].any()
    assert (fleet["battery"] == mission["flying_time"]).all()
    low, high = space.initial_data
    assert ((low <= state.residual) & (state.residual <= high)).all()
    assert mission["initial"] == pytest.approx(state.residual.sum(), abs=1e-9)


def test_start_cells_are_uniform() -> None:
    space = ScenarioSpace.of(zone=[3, 4, 3, 2], uavs=2, nodes=[[0, 0]])
    counts, pairs = np.zeros((32, 32)), set()
    for replication in range(1500):
        uavs = _launched(space, 3, replication).uavs[0]
        pairs.add(tuple(zip(uavs["x"].tolist(), uavs["y"].tolist(), strict=True)))
        np.add.at(counts, (uavs["x"], uavs["y"]), 1)
    assert len(pairs) == 6 * 5
    inside = counts[3:6, 4:6]
    assert inside.sum() == 3000
    assert abs(inside - 500).max() < 5 * np.sqrt(500)  # 5 standard deviations


# --- safety controller ---


def _resolve(
    grid: int, uavs: list[tuple[tuple[int, int], int]], forbid_swaps: bool = False, idle: Any = ()
) -> tuple[list[tuple[int, int]], list[bool]]:
    """The cells and the overruled flags after UAVs ``(cell, action)`` acted."""
    scenario = Scenario.of(
        **{"grid": grid, "zone": [0, 0, grid, grid], "nodes": [[0, 0]]},
        uavs=len(uavs),
        forbid_swaps=forbid_swaps,
    )
    state = _launched(ScenarioSpace.of(scenario))
    team = state.uavs[0]
    for i, ((x, y), action) in enumerate(uavs):
        team[i]["x"], team[i]["y"], team[i]["action"] = x, y, action
        team[i]["active"] = i not in idle
    compiled.resolve(state.missions[0], team)
    after = list(zip(team["x"].tolist(), team["y"].tolist(), strict=True))
    for u in team[team["active"]]:
        dx, dy = STEPS[u["executed"]]
        assert (u["from_x"] + dx, u["from_y"] + dy) == (u["x"], u["y"])
        assert u["overruled"] == (u["action"] != u["executed"])
    return after, team["overruled"].tolist()


COLUMN = [((x, 0), EAST) for x in range(4)]
SWAP = [((0, 0), EAST), ((1, 0), WEST)]
RING = [((0, 0), EAST), ((1, 0), SOUTH), ((1, 1), WEST), ((0, 1), NORTH)]
TRAIN = [((0, 0), EAST), ((1, 0), EAST), ((2, 0), WEST)]


@pytest.mark.parametrize(
    ("uavs", "forbid_swaps", "after"),  # the cells after it; who has not moved was overruled
    [
        # y grows to the south, x to the east.
        ([((1, 1), NORTH)], False, [(1, 0)]),
        ([((1, 1), EAST)], False, [(2, 1)]),
        ([((1, 1), SOUTH)], False, [(1, 2)]),
        ([((1, 1), WEST)], False, [(0, 1)]),
        # Off the grid.
        ([((1, 0), NORTH)], False, None),
        ([((3, 1), EAST)], False, None),
        ([((1, 3), SOUTH)], False, None),
        ([((0, 1), WEST)], False, None),
        # Three UAVs around (1, 1), all moving in: none gets it. A cell that is being left is free.
        ([((0, 1), EAST), ((2, 1), WEST), ((1, 0), SOUTH)], False, None),
        ([((0, 1), EAST), ((1, 1), EAST)], False, [(1, 1), (2, 1)]),
        # The first of a column runs into the edge, or into a claim, so all stay; or all move.
        (COLUMN, False, None),
        ([*COLUMN[:3], ((3, 1), NORTH)], False, None),
        (COLUMN[:3], False, [(1, 0), (2, 0), (3, 0)]),
        # Swaps; a ring of four is none, and a forbidden one stops those behind it.
        (SWAP, False, [(1, 0), (0, 0)]),
        (SWAP, True, None),
        (RING, True, [(1, 0), (1, 1), (0, 1), (0, 0)]),
        (TRAIN, True, None),
    ],
)
def test_the_safety_controller_by_hand(
    uavs: list, forbid_swaps: bool, after: list[tuple[int, int]] | None
) -> None:
    overruled = [after is None] * len(uavs)
    expected = [cell for cell, _ in uavs] if after is None else after
    assert _resolve(4, uavs, forbid_swaps) == (expected, overruled)


def test_who_hovers_blocks_and_who_is_inactive_does_not() -> None:
    assert _resolve(3, [((0, 1), EAST), ((1, 1), HOVER)]) == ([(0, 1), (1, 1)], [True, False])
    uavs = [((0, 0), EAST), ((1, 0), EAST)]
    assert _resolve(3, uavs, idle={1}) == ([(1, 0), (1, 0)], [False, False])


@st.composite
def _encounters(draw: st.DrawFn) -> tuple:
    grid = draw(st.integers(2, 5))
    count = draw(st.integers(1, min(8, grid * grid)))
    spots = draw(st.lists(cells(grid), min_size=count, max_size=count, unique=True))
    actions = draw(st.lists(st.integers(0, 4), min_size=count, max_size=count))
    idle = draw(st.sets(st.integers(0, count - 1), max_size=2))
    order = draw(st.permutations(range(count)))
    return grid, list(zip(spots, actions, strict=True)), draw(st.booleans()), idle, order


@given(_encounters())
def test_the_safety_controller_knows_no_numbering_and_no_shared_cells(encounter: tuple) -> None:
    grid, uavs, forbid_swaps, idle, order = encounter
    after, overruled = _resolve(grid, uavs, forbid_swaps, idle)
    active = [i for i in range(len(uavs)) if i not in idle]
    assert len({after[i] for i in active}) == len(active)
    assert all(after[i] == uavs[i][0] for i in idle)
    assert all(0 <= coordinate < grid for cell in after for coordinate in cell)

    renumbered = [uavs[i] for i in order]
    idle_renumbered = {order.index(i) for i in idle}
    again, overruled_again = _resolve(grid, renumbered, forbid_swaps, idle_renumbered)
    assert again == [after[i] for i in order]
    assert overruled_again == [overruled[i] for i in order]

    # Nobody is overruled without need: the cell asked for is off the grid or another's, or a
    # forbidden swap, given what all others did.
    for i in active:
        cell, action = uavs[i]
        wanted = (cell[0] + STEPS[action][0], cell[1] + STEPS[action][1])
        if overruled[i]:
            event("overruled")
            others = [j for j in active if j != i]
            claimed = {after[j] for j in others}
            for j in others:
                (x, y), asked = uavs[j]
                claimed.add((x + STEPS[asked][0], y + STEPS[asked][1]))
            assert not all(0 <= c < grid for c in wanted) or wanted in claimed or forbid_swaps
        else:
            assert after[i] == wanted
