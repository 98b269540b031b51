"""Compact states of teams in any state, more than missions come to."""

from collections.abc import Sequence

import numpy as np
from hypothesis import strategies as st

from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates, empty_states


@st.composite
def any_teams(
    draw: st.DrawFn, cells: Sequence[tuple[int, int]], nodes: int, count: int = 1
) -> tuple[CompactStates, int]:
    """Missions with a team of up to twelve on some cells, and a UAV that is active in each."""
    rng, uavs = np.random.default_rng(draw(st.integers(0, 2**32 - 1))), draw(st.integers(1, 12))
    states, shape = empty_states(count, uavs, nodes), (count, uavs)
    states.missions[:, column.CHARGE_START] = rng.integers(10, 51, count)
    states.missions[:, column.CHARGE_COMPLETE] = rng.integers(60, 101, count)
    team = states.uavs
    # Each mission has its own scales, so that numbers lie on both sides of the bounds on them. Some
    # teams are on three cells, mostly neighbours.
    spots = rng.integers(0, rng.choice([3, len(cells)], (count, 1)), shape)
    spots += rng.integers(0, len(cells), (count, 1))
    team[..., [column.X, column.Y]] = np.array(cells)[spots % len(cells)]
    team[..., column.BATTERY] = rng.integers(0, 101, shape)
    team[..., column.NEEDED] = rng.integers(0, rng.choice([1, 12, 111, 400], (count, 1)), shape)
    team[..., column.HOME] = rng.integers(0, rng.choice([20, 80], (count, 1)), shape)
    flags = [column.ACTIVE, column.LATCH, column.CHARGING, column.MUST_CHARGE]
    team[..., flags] = rng.random((*shape, 4)) < rng.random((count, 1, 4))
    team[..., column.MASK] = rng.integers(1, 32, shape)
    most = rng.choice([0.0, 0.01, 20.0], (count, nodes), p=[0.4, 0.1, 0.5])
    states.residual[:] = rng.uniform(0, most)
    uav = draw(st.integers(0, uavs - 1))
    team[:, uav, column.ACTIVE] = 1
    return states, uav
