"""The maps hold what eq. 19-22 put in them, by hand."""

from typing import NamedTuple

import numpy as np
import pytest

from dess.observations.maps import (
    FLYING_TIME,
    STATUS,
    Maps,
)
from dess.observations.states import (
    ACTIVE,
    BATTERY,
    CompactStates,
    Layout,
    X,
    Y,
    empty_states,
)

GRID = 32  # centred: 63 cells a side with the UAV at 31; global: 21 cells with the UAV's at 10
ZONE_CELLS = (26, 2, 4, 4)


class Observed(NamedTuple):
    """The observation of one UAV."""

    near: np.ndarray
    far: np.ndarray
    own: np.ndarray


def _team(*uavs: tuple[int, int, int, int], residual: tuple[float, ...] = ()) -> CompactStates:
    """The state of one mission with UAVs (x, y, battery, active)."""
    states = empty_states(1, len(uavs), len(residual))
    states.uavs[0][:, [X, Y, BATTERY, ACTIVE]] = uavs
    states.residual[0] = residual
    return states


def _layout(*nodes: tuple[int, int]) -> Layout:
    return Layout(GRID, np.array(ZONE_CELLS), np.array(nodes, np.int64).reshape(-1, 2))


def _observe(layout: Layout, states: CompactStates, uav: int = 0) -> Observed:
    near, far, own = Maps(layout).encode(states, np.array([0]), np.array([uav]))
    return Observed(near[0], far[0], own[0])


def _filled(layer: np.ndarray) -> dict[tuple[int, int], float]:
    """The cells (x, y) of a layer that are not zero."""
    return {(int(x), int(y)): float(layer[y, x]) for y, x in np.argwhere(layer)}


def test_the_team_is_on_the_map_and_who_is_done_is_not() -> None:
    states = _team((10, 10, 60, 1), (12, 7, 35, 1), (11, 10, 50, 0), (0, 0, 0, 0))
    seen = _observe(_layout(), states)
    assert _filled(seen.near[FLYING_TIME]) == pytest.approx({(8, 8): 0.6, (10, 5): 0.35})
    assert _filled(seen.near[STATUS]) == {(8, 8): 1.0, (10, 5): 1.0}
    assert _filled(seen.far[STATUS]) == pytest.approx({(10, 10): 1 / 9, (11, 9): 1 / 9})
    # The other one sees the first from its own place, and its own battery.
    seen = _observe(_layout(), states, uav=1)
    assert _filled(seen.near[STATUS]) == {(8, 8): 1.0, (6, 11): 1.0}
    assert seen.own == pytest.approx(0.35)
    # Who is done is not even on its own map.
    seen = _observe(_layout(), states, uav=2)
    assert _filled(seen.near[STATUS]) == {(7, 8): 1.0, (9, 5): 1.0}
    assert seen.own == pytest.approx(0.5)
