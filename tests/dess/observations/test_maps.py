"""The maps hold what eq. 19-22 put in them: by hand, and against maps that are built in full."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from dess.observations.maps import (
    BATTERY_SCALE,
    CROP,
    DATA,
    DATA_SCALE,
    FLYING_TIME,
    POOL,
    STATUS,
    ZONE,
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


@st.composite
def _worlds(draw: st.DrawFn) -> tuple[Maps, CompactStates, np.ndarray, np.ndarray]:
    """Any layout, three missions of a team, and rows of them."""
    grid = draw(st.integers(2, 24))
    width, height = draw(st.integers(1, grid)), draw(st.integers(1, grid))
    x, y = draw(st.integers(0, grid - width)), draw(st.integers(0, grid - height))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    nodes = rng.integers(0, grid, (draw(st.integers(1, 5)), 2))
    layout = Layout(grid, np.array([x, y, width, height]), nodes)
    maps = Maps(layout)

    states = empty_states(3, draw(st.integers(1, 4)), len(nodes))
    fleet = states.uavs.shape[:2]
    states.uavs[..., [X, Y]] = rng.integers(0, grid, (*fleet, 2))
    states.uavs[..., BATTERY] = rng.integers(0, 101, fleet)
    states.uavs[..., ACTIVE] = rng.integers(0, 2, fleet)
    states.residual[:] = rng.uniform(0, 20, states.residual.shape)
    missions, uavs = (rng.integers(0, most, 7) for most in fleet)
    return maps, states, missions, uavs


def _layers(layout: Layout, team: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """The map (4, M, M) of a mission, before any centring."""
    layers = np.zeros((4, layout.grid, layout.grid))
    x, y, width, height = layout.zone
    layers[ZONE, y : y + height, x : x + width] = 1
    np.add.at(layers[DATA], (layout.nodes[:, 1], layout.nodes[:, 0]), residual / DATA_SCALE)
    active = team[team[:, ACTIVE] != 0]
    cells = active[:, Y], active[:, X]
    np.add.at(layers[FLYING_TIME], cells, active[:, BATTERY] / BATTERY_SCALE)
    np.add.at(layers[STATUS], cells, 1)
    return layers


@given(_worlds())
def test_the_maps_are_those_cut_from_the_whole_centred_map(
    world: tuple[Maps, CompactStates, np.ndarray, np.ndarray],
) -> None:
    maps, states, missions, uavs = world
    grid, width = maps.layout.grid, maps.shapes[1][-1]
    encoded = maps.encode(states, missions, uavs)
    assert [a.shape[1:] for a in encoded] == list(maps.shapes)
    assert all(a.dtype == np.float32 for a in encoded)
    event(f"cells left out {(2 * grid - 1) % POOL > 0}")

    around = max(grid - 1, CROP // 2)
    for near, far, own, mission, uav in zip(*encoded, missions, uavs, strict=True):
        team = states.uavs[mission]
        layers = _layers(maps.layout, team, states.residual[mission])
        x, y = team[uav, X] + around, team[uav, Y] + around
        padded = np.pad(layers, ((0, 0), (around, around), (around, around)))
        cut, centred = (
            padded[:, y - reach : y + reach + 1, x - reach : x + reach + 1]
            for reach in (CROP // 2, grid - 1)
        )
        blocks = centred[:, : width * POOL, : width * POOL]
        pooled = blocks.reshape(4, width, POOL, width, POOL).mean((2, 4))
        np.testing.assert_allclose(near, cut, rtol=1e-6)
        np.testing.assert_allclose(far, pooled, rtol=1e-5)
        np.testing.assert_allclose(own, team[uav, BATTERY] / BATTERY_SCALE, rtol=1e-6)
