"""The safety controller, which every mission asks once a slot."""

from typing import Any

import pytest

from dess.model.state import HOVER, STEP_X, STEP_Y
from tests import compiled
from tests.dess.envs.episodes import placed
from tests.drawn import EAST, NORTH, SOUTH, WEST

STEPS = list(zip(STEP_X.tolist(), STEP_Y.tolist(), strict=True))


def _resolve(uavs: list[tuple[tuple[int, int], int]], **fields: Any) -> tuple[list, list[bool]]:
    """The cells and the overruled flags after UAVs ``(cell, action)`` acted on 4 x 4 cells."""
    state, chart = placed(
        [{"x": x, "y": y, "action": action} for (x, y), action in uavs],
        **{"grid": 4, "zone": [0, 0, 4, 4], "nodes": [[0, 0]]} | fields,
    )
    team = state.uavs[0]
    compiled.resolve(state.missions[0], team, chart)
    for u in team:
        dx, dy = STEPS[u["executed"]]
        assert (u["from_x"] + dx, u["from_y"] + dy) == (u["x"], u["y"])
        assert u["overruled"] == (u["action"] != u["executed"])
    cells = list(zip(team["x"].tolist(), team["y"].tolist(), strict=True))
    return cells, team["overruled"].tolist()


COLUMN = [((x, 0), EAST) for x in range(4)]
SWAP = [((0, 0), EAST), ((1, 0), WEST)]
RING = [((0, 0), EAST), ((1, 0), SOUTH), ((1, 1), WEST), ((0, 1), NORTH)]
TRAIN = [((0, 0), EAST), ((1, 0), EAST), ((2, 0), WEST)]


# The cells after the actions; who does not hover and stays was overruled.
@pytest.mark.parametrize(
    ("uavs", "forbid_swaps", "after"),
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
        # Who hovers blocks.
        ([((0, 1), EAST), ((1, 1), HOVER)], False, [(0, 1), (1, 1)]),
    ],
)
def test_the_safety_controller_by_hand(uavs, forbid_swaps, after):
    expected = after or [cell for cell, _ in uavs]
    overruled = [
        cell == to and action != HOVER for (cell, action), to in zip(uavs, expected, strict=True)
    ]
    assert _resolve(uavs, forbid_swaps=forbid_swaps) == (expected, overruled)
