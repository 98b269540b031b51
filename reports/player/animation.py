"""A mission as an animation in a file: a GIF, or a video in MP4, which needs the program ffmpeg.

write_animation(log, scenario, "mission.gif", GIF)

Its frames show what the player shows: what moves is the same traces, drawn by matplotlib.
"""

from collections.abc import Iterator
from pathlib import Path
from subprocess import CalledProcessError

import numpy as np
import pandas as pd
from matplotlib.animation import FFMpegWriter
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from analysis.figures import missions, style
from analysis.results.event_log import Events
from dess import InputError
from dess.scenario import Scenario
from reports.player.playback import Playback
from reports.player.scene import STATUS, Json, moving, ranges, still

GIF, MP4 = "gif", "mp4"
SLOTS_PER_SECOND = 10
LAST_SECONDS = 2  # for which the end of the mission is shown
# The width, and the height for each of the curves [px], even as videos need; dots per inch.
WIDTH, HEIGHT, DPI = 810, 144, 90
_POINT = 72 / DPI  # the size of a pixel [points]


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
    with style.look():
        film = Film(events, scenario, title)
        (_write_gif if kind == GIF else _write_video)(film, file)


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


def _write_gif(film: "Film", file: str | Path) -> None:
    """Frames share the colours of the first one, so that the file stays small."""
    pictures: list[Image.Image] = []
    for pixels in film.frames():
        palette = pictures[0] if pictures else None
        picture = Image.fromarray(pixels).convert("RGB")
        pictures.append(picture.quantize(palette=palette, dither=Image.Dither.NONE))
    first, *others = pictures
    time = 1000 // SLOTS_PER_SECOND  # [ms]
    first.save(file, GIF, save_all=True, append_images=others, duration=time, loop=0)


def _write_video(film: "Film", file: str | Path) -> None:
    exact = ["-f", "mp4", "-pix_fmt", "yuv420p", "-fflags", "+bitexact", "-flags:v", "+bitexact"]
    writer = FFMpegWriter(SLOTS_PER_SECOND, codec="h264", extra_args=exact)
    width, height = film.figure.get_size_inches()
    screen = Figure(figsize=(width, height), dpi=DPI)
    picture = screen.figimage(film.frame(0))
    try:
        with writer.saving(screen, str(file), DPI):
            for pixels in film.frames():
                picture.set_data(pixels)
                writer.grab_frame()
    except CalledProcessError as error:
        raise OSError(f"ffmpeg failed with exit code {error.returncode}") from error


class Film:
    """A mission as a figure; made inside ``style.look``.

    All that stays is drawn once, and what moves is drawn on it for every slot.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The mission's scenario.
        title: The text above all.

    Attributes:
        figure: The figure, without what moves.
        end: The number of mission slots.

    Raises:
        InputError: If the log is not that of a whole mission of this scenario.
    """

    def __init__(self, events: Events, scenario: Scenario, title: str = ""):
        playback = Playback(pd.DataFrame(events), scenario)
        self.end, self._moving = playback.end, moving(playback)
        curves = missions.curves(scenario)
        self.figure = Figure(figsize=(WIDTH / DPI, HEIGHT * len(curves) / DPI), dpi=DPI)
        self.figure.set_layout_engine("constrained", rect=(0, 0, 0.95, 1))  # notes at the right
        self.figure.suptitle(title, x=0.012, ha="left", fontsize=11)
        widths, heights = (1.05, 1), [*curves.values()]
        grid = self.figure.add_gridspec(len(curves), 2, width_ratios=widths, height_ratios=heights)
        sea = self.figure.add_subplot(grid[:, 0], anchor="N" if playback.measures_age else "C")
        missions.chart(scenario, sea)
        sea.set_title(" ")  # the place of the status
        self.axes = {"1": sea, str(STATUS): sea}
        for row, (panel, draw) in enumerate(zip(ranges(playback), curves, strict=True)):
            ax = self.axes[str(panel)] = self.figure.add_subplot(grid[row, 1])
            draw(events, scenario, ax)
            if row < len(curves) - 1:
                ax.set_xlabel("")
        rings, *_ = still(playback)
        self.draw(rings)
        self.canvas = FigureCanvasAgg(self.figure)
        self.canvas.draw()
        self._background = self.canvas.copy_from_bbox(self.figure.bbox)

    def frames(self) -> Iterator[np.ndarray]:
        """The pixels of every slot, (height, width, 4), and the last ones for a while."""
        for slot in range(self.end + 1):
            pixels = self.frame(slot)
            yield pixels
        for _ in range(LAST_SECONDS * SLOTS_PER_SECOND):
            yield pixels

    def frame(self, slot: int) -> np.ndarray:
        """The pixels of the mission after a number of slots, (height, width, 4)."""
        self.canvas.restore_region(self._background)
        for trace in (part.at(slot) for part in self._moving):
            if trace["mode"] == "text":
                trace["text"] = [f"slot {slot} of {self.end} · {trace['text'][0]}"]
            for artist in self.draw(trace):
                self.figure.draw_artist(artist)
                artist.remove()
        return np.array(self.canvas.buffer_rgba())

    def draw(self, trace: Json) -> list[Artist]:
        """Draw a trace on the axes of its panel, if the film has this panel."""
        ax = self.axes.get(trace.get("xaxis", "x1")[1:])
        if ax is None:
            return []
        if trace["mode"] == "text":
            return [ax.text(0, 1.02, trace["text"][0], transform=ax.transAxes)]
        if trace["name"].startswith("cursor"):
            return [ax.axvline(trace["x"][0], color=style.INK, linewidth=1.2)]
        if trace["mode"] == "lines":
            width, alpha = trace["line"]["width"], trace.get("opacity", 1)
            return [*ax.plot(trace["x"], trace["y"], color=trace["line"]["color"], alpha=alpha,
                             linewidth=width * _POINT)]  # fmt: skip
        return [*_dots(trace, ax)]


def _dots(trace: Json, ax: Axes) -> Iterator[Artist]:
    """Discs or squares, and the texts in them."""
    marker, edge = trace["marker"], trace["marker"]["line"]
    alpha = np.broadcast_to(marker["opacity"], len(trace["x"]))
    if not alpha.any():
        return
    x, y = (np.array(trace[axis])[alpha > 0] for axis in "xy")
    sizes = np.array(marker["size"], float)
    areas = 2 * sizes / marker["sizeref"] if "sizeref" in marker else sizes**2
    look: Json = {"c": marker["color"], "alpha": alpha[alpha > 0]}
    if str(marker["color"]).startswith("rgba"):
        look = {"facecolors": "none"}
    yield ax.scatter(x, y, areas * _POINT**2, marker="s" if "symbol" in marker else "o",
                     linewidths=edge["width"] * _POINT, edgecolors=edge.get("color", "none"),
                     clip_on=False, **look)  # fmt: skip
    for text in zip(x, y, trace.get("text", ()), strict=False):
        yield ax.text(*text, size=7, color="white", weight="bold", ha="center",
                      va="center_baseline")  # fmt: skip
