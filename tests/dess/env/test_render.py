"""The picture of a mission shows where its UAVs are, in an array or in a window."""

import numpy as np
import pytest
from matplotlib import pyplot
from pettingzoo.test import render_test
from pettingzoo.utils import parallel_to_aec

import dess
from tests.dess.env.episodes import PAPER, small


@pytest.fixture(autouse=True)
def agg() -> None:
    """No window is opened on the screen of who runs the tests."""
    pyplot.switch_backend("agg")


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


@pytest.mark.parametrize("ended", ["leave", "stay"])
def test_pettingzoos_render_test_passes(ended: str) -> None:
    render_test(
        lambda render_mode: parallel_to_aec(dess.parallel_env(PAPER, 0, render_mode, ended=ended))
    )
    pyplot.close("all")  # the test leaves a window open


def test_close_closes_the_window_and_may_be_called_twice() -> None:
    dess.parallel_env(small()).close()
    dess.parallel_env(small(), render_mode="rgb_array").close()
    open_before = pyplot.get_fignums()
    env = dess.parallel_env(small(), render_mode="human")
    assert len(pyplot.get_fignums()) == len(open_before) + 1
    env.close()
    env.close()
    assert pyplot.get_fignums() == open_before
