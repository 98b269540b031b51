"""An animation shows the state of a mission after every slot, in few bytes, always the same."""

import subprocess
from typing import Any

import numpy as np
import pandas as pd
import pytest
from matplotlib.animation import FFMpegWriter
from matplotlib.collections import PathCollection
from PIL import Image

import dess
from dess import policies
from dess.analysis.figures import style
from dess.analysis.results.event_log import residual_data, uav_slots
from dess.model.state import sample_scenario
from dess.reports.animation import GIF, LAST_SECONDS, MP4, SLOTS_PER_SECOND, Film, write_animation


def mission(**fields: Any) -> tuple[pd.DataFrame, dess.Scenario]:
    """Three UAVs with one pad, for which they wait unless their quota is filled before."""
    space = dess.load_scenario("fig4", uavs=3, pads=1, zone=[26, 2, 4, 1], **fields)
    record = dess.simulate(space, policies.load("greedy"), 1, 0, events=True)
    assert record.events is not None
    return pd.DataFrame(record.events.columns()), sample_scenario(space, 1, 0)


def test_a_film_draws_what_the_player_shows():
    log, scenario = mission()
    slots, residual = uav_slots(log), residual_data(log)
    assert slots["waiting"].any() and slots["charging"].any()
    with style.figure_look():
        film = Film(log, scenario)
        for slot in range(0, film.end + 1, 3):
            now = slots[slots["slot"] == slot - 1]
            artists: Any = [*film.moving_artists(slot)]
            nodes, waiting, charging, uavs = (a for a in artists if isinstance(a, PathCollection))
            assert np.array_equal(uavs.get_offsets()[now["uav"]], now[["x", "y"]])
            for spots, state in ((waiting, "waiting"), (charging, "charging")):
                assert np.array_equal(spots.get_offsets(), now.loc[now[state], ["x", "y"]])
            areas, data = nodes.get_sizes(), residual.iloc[slot]
            assert np.allclose(areas / areas.max(), data / data.max(), atol=1e-3)
            for artist in artists:
                artist.remove()
    pictures = [film.draw_frame(slot) for slot in (0, film.end, 0)]
    assert np.array_equal(pictures[0], pictures[2])
    assert not np.array_equal(pictures[0], pictures[1])


def test_a_gif_has_a_frame_per_slot_and_holds_the_last(tmp_path):
    short = mission(quota=30)
    for name in "ab":
        write_animation(*short, tmp_path / name, GIF, "greedy")
    content = (tmp_path / "a").read_bytes()
    assert content == (tmp_path / "b").read_bytes()
    assert len(content) < 1e6
    times = []
    with Image.open(tmp_path / "a", formats=["GIF"]) as picture:
        for number in range(picture.n_frames):
            picture.seek(number)
            times.append(picture.info["duration"])
    end = int(short[0]["time"].max())
    assert sum(times) == 1000 * (end + 1) / SLOTS_PER_SECOND + 1000 * LAST_SECONDS
    assert times[-1] > 1000 * LAST_SECONDS


@pytest.mark.skipif(not FFMpegWriter.isAvailable(), reason="no ffmpeg on this machine")
def test_a_video_has_a_frame_per_slot(tmp_path):
    short = mission(quota=30)
    write_animation(*short, tmp_path / "mission", MP4)
    program = [FFMpegWriter.bin_path(), "-i", str(tmp_path / "mission"), "-f", "null", "-"]
    told = subprocess.run(program, capture_output=True, text=True, check=True).stderr
    frames = int(short[0]["time"].max()) + 1 + LAST_SECONDS * SLOTS_PER_SECOND
    assert f"frame={frames:5}" in told
