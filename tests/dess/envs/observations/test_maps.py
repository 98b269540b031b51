"""The maps hold what eq. 19-22 put in them: those that are cut from maps that are built in full."""

import numpy as np
from hypothesis import event, given
from hypothesis import strategies as st

from dess.envs.observations import maps as module
from dess.envs.observations.maps import CROP, POOL, Maps
from dess.envs.observations.states import ACTIVE, BATTERY, CompactStates, Layout, X, Y, empty_states


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
    layers[module.ZONE, y : y + height, x : x + width] = 1
    np.add.at(
        layers[module.DATA], (layout.nodes[:, 1], layout.nodes[:, 0]), residual / module.DATA_SCALE
    )
    active = team[team[:, ACTIVE] != 0]
    cells = active[:, Y], active[:, X]
    np.add.at(layers[module.FLYING_TIME], cells, active[:, BATTERY] / module.BATTERY_SCALE)
    np.add.at(layers[module.STATUS], cells, 1)
    return layers


@given(_worlds())
def test_the_maps_are_those_cut_from_the_whole_centred_map(world):
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
        np.testing.assert_allclose(own, team[uav, BATTERY] / module.BATTERY_SCALE, rtol=1e-6)
