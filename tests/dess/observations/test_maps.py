"""The maps hold what eq. 19-22 put in them: compared with maps that are built in full."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess.observations import states as column
from dess.observations.maps import CROP, DATA, FLYING_TIME, POOL, STATUS, ZONE, Maps
from dess.observations.states import CompactStates, Layout, empty_states


@st.composite
def _worlds(draw: st.DrawFn) -> tuple[Maps, CompactStates, np.ndarray, np.ndarray]:
    """Any layout, three missions of a team, and rows of them."""
    grid = draw(st.integers(2, 14))
    width, height = draw(st.integers(1, grid)), draw(st.integers(1, grid))
    x, y = draw(st.integers(0, grid - width)), draw(st.integers(0, grid - height))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    nodes = rng.integers(0, grid, (draw(st.integers(1, 5)), 2))
    layout = Layout(grid, np.array([x, y, width, height]), nodes)

    states = empty_states(3, draw(st.integers(1, 4)), len(nodes))
    fleet = states.uavs.shape[:2]
    states.uavs[..., [column.X, column.Y]] = rng.integers(0, grid, (*fleet, 2))
    states.uavs[..., column.BATTERY] = rng.integers(0, 101, fleet)
    states.uavs[..., column.ACTIVE] = rng.integers(0, 2, fleet)
    states.residual[:] = rng.uniform(0, 20, states.residual.shape)
    missions, uavs = (rng.integers(0, most, 7) for most in fleet)
    return Maps(layout), states, missions, uavs


def _layers(layout: Layout, team: np.ndarray, residual: np.ndarray) -> np.ndarray:
    """The map (4, M, M) of a mission, before any centring."""
    layers = np.zeros((4, layout.grid, layout.grid))
    x, y, width, height = layout.zone
    layers[ZONE, y : y + height, x : x + width] = 1
    np.add.at(layers[DATA], (layout.nodes[:, 1], layout.nodes[:, 0]), residual / 20)
    active = team[team[:, column.ACTIVE] != 0]
    cells = active[:, column.Y], active[:, column.X]
    np.add.at(layers[FLYING_TIME], cells, active[:, column.BATTERY] / 100)
    np.add.at(layers[STATUS], cells, 1)
    return layers


@given(_worlds())
def test_the_maps_are_those_cut_from_the_whole_centred_map(
    world: tuple[Maps, CompactStates, np.ndarray, np.ndarray],
) -> None:
    maps, states, missions, uavs = world
    centred = 2 * maps.layout.grid - 1
    wide, width = max(centred, CROP), centred // POOL
    encoded = maps.encode(states, missions, uavs)
    assert [a.shape[1:] for a in encoded] == list(maps.shapes)
    for near, far, own, mission, uav in zip(*encoded, missions, uavs, strict=True):
        team = states.uavs[mission]
        x, y = team[uav, column.X], team[uav, column.Y]
        whole = np.zeros((4, 3 * wide, 3 * wide))
        inner = slice(wide, wide + maps.layout.grid)
        whole[:, inner, inner] = _layers(maps.layout, team, states.residual[mission])
        # Centred on the UAV, a map from ``edge`` cells before it to as many behind it.
        for found, edge, pool in ((near, CROP // 2, 1), (far, maps.layout.grid - 1, POOL)):
            top, left = wide + y - edge, wide + x - edge
            side = found.shape[1] * pool
            cut = whole[:, top : top + side, left : left + side]
            pooled = cut.reshape(4, side // pool, pool, side // pool, pool).mean((2, 4))
            np.testing.assert_allclose(found, pooled, rtol=1e-5)
        assert far.shape[1] == width
        np.testing.assert_allclose(own, team[uav, column.BATTERY] / 100, rtol=1e-6)
