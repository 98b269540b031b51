"""The picture of a mission shows where its UAVs are."""

import numpy as np

import dess
from tests.dess.env.episodes import PAPER, small


def test_a_picture_shows_the_mission() -> None:
    assert dess.parallel_env(PAPER).render() is None
    env = dess.parallel_env(small(), render_mode="rgb_array")
    env.reset(seed=0)
    before = env.render()
    assert before is not None and before.dtype == np.uint8
    assert before.shape[0] == before.shape[1] and before.shape[2] == 3
    cell = before.shape[0] // 5
    env.step({"uav_0": 3})
    changed = np.nonzero((env.render() != before).any(2))
    cells = {(int(x // cell), int(y // cell)) for y, x in zip(*changed, strict=True)}
    # The node that was served, and two neighbours: the UAV left one for the other.
    (west_x, west_y), (east_x, east_y) = sorted(cells - {(0, 0), (4, 4)})
    assert (east_x - west_x, east_y - west_y) == (1, 0)
