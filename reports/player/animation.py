"""A mission as an animation in a file: a GIF, or a video in MP4, which needs the program ffmpeg.

write_animation(log, scenario, "mission.gif", GIF)
"""

from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from analysis.figures import style
from analysis.results.event_log import Events
from dess import InputError
from dess.scenario import Scenario
from reports.player.film import Film

GIF, MP4 = "gif", "mp4"
SLOTS_PER_SECOND = 10
LAST_SECONDS = 2  # for which the end of the mission is shown


def write_animation(
    events: Events, scenario: Scenario, file: str | Path, kind: str, title: str = ""
) -> None:
    """Write a mission as an animation; the same mission gives the same bytes of a GIF.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The mission's scenario.
        file: The file to write, whatever its suffix.
        kind: ``GIF`` or ``MP4``.
        title: The text above the map.

    Raises:
        InputError: If the log is not that of a whole mission of this scenario, or if ffmpeg is
            missing for a video.
        OSError: If the file cannot be written.
    """
    if kind == MP4:
        check_ffmpeg()
    writer = _GifWriter(SLOTS_PER_SECOND) if kind == GIF else _video_writer()
    with style.look():
        film = Film(events, scenario, title)
        try:
            with writer.saving(film.figure, str(file), film.figure.dpi):
                for slot in range(film.end + 1):
                    film.show(slot)
                    writer.grab_frame()
                for _ in range(LAST_SECONDS * SLOTS_PER_SECOND):
                    writer.grab_frame()
        except CalledProcessError as error:
            raise OSError(f"ffmpeg failed with exit code {error.returncode}") from error


def check_ffmpeg() -> None:
    """Refuse to write a video where the program ffmpeg is missing.

    Raises:
        InputError: If it is missing.
    """
    with style.look():  # whatever program a matplotlibrc in the working directory names
        is_available = FFMpegWriter.isAvailable()
    if not is_available:
        raise InputError(
            "animation: .mp4 needs the program ffmpeg, which is not installed; allowed: install "
            "it, or write .gif or .html, which need no other program"
        )


def _video_writer() -> FFMpegWriter:
    exact = ["-f", "mp4", "-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-flags:v", "+bitexact"]
    return FFMpegWriter(SLOTS_PER_SECOND, codec="h264", extra_args=exact)


class _GifWriter(AbstractMovieWriter):
    """Writes a GIF whose frames share the colours of the first one, so that it stays small."""

    def setup(self, fig: Figure, outfile: Any, dpi: float | None = None) -> None:
        super().setup(fig, outfile, dpi)
        self.canvas = FigureCanvasAgg(fig)
        self.frames: list[Image.Image] = []

    def grab_frame(self, **_: Any) -> None:
        self.canvas.draw()
        image = Image.fromarray(np.asarray(self.canvas.buffer_rgba())).convert("RGB")
        palette = self.frames[0] if self.frames else None
        self.frames.append(image.quantize(palette=palette, dither=Image.Dither.NONE))

    def finish(self) -> None:
        first, *others = self.frames
        time = 1000 // self.fps  # [ms]
        first.save(self.outfile, GIF, save_all=True, append_images=others, duration=time, loop=0)
