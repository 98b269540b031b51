"""A mission as an animation: a GIF, or a video in MP4, which needs the program ffmpeg.

    write_animation(log, scenario, "mission.gif", GIF)

Frames show what the player of a page shows, drawn by matplotlib.
"""

from collections.abc import Iterator
from pathlib import Path
from subprocess import CalledProcessError
from typing import Any

import numpy as np
from matplotlib.animation import FFMpegWriter
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

from dess import InputError
from dess.analysis.figures import missions, style
from dess.analysis.results import event_log
from dess.reports.player import Playback
from dess.scenario.scenario import Scenario

GIF, MP4 = "gif", "mp4"
SLOTS_PER_SECOND = 10
LAST_SECONDS = 2  # for which the end of the mission is shown
# The width, and the height for each of the curves [px], even as videos need; dots per inch.
WIDTH, HEIGHT, DPI = 810, 144, 90
NODE_SIZE, UAV_SIZE, PAD_SIZE = 20, 12, 17  # diameters, and the side of a square [points]


def write_animation(
    events: event_log.Events, scenario: Scenario, file: str | Path, kind: str, title: str = ""
) -> None:
    """Write a mission as an animation; the same mission gives the same bytes of a GIF.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
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
    with style.figure_look():
        film = Film(events, scenario, title)
        if kind == GIF:
            _write_gif(film, file)
        else:
            _write_video(film, file)


def check_ffmpeg() -> None:
    """Refuse to write a video where the program ffmpeg is missing.

    Raises:
        InputError: If it is missing.
    """
    with style.figure_look():  # whatever program a matplotlibrc in the working directory names
        is_available = FFMpegWriter.isAvailable()
    if not is_available:
        raise InputError(
            "animation",
            ".mp4 needs the program ffmpeg, which is not installed",
            "install it, or write .gif or .html, which need no other program",
        )


def _write_gif(film: "Film", file: str | Path) -> None:
    """Frames share the colours of the first one, so that the file stays small."""
    pictures: list[Image.Image] = []
    for pixels in film.draw_frames():
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
    picture = screen.figimage(film.draw_frame(0))
    try:
        with writer.saving(screen, str(file), DPI):
            for pixels in film.draw_frames():
                picture.set_data(pixels)
                writer.grab_frame()
    except CalledProcessError as error:
        raise OSError(f"ffmpeg failed with exit code {error.returncode}") from error


class Film:
    """A mission as a figure; made inside ``style.figure_look``.

    All that stays is drawn once, and what moves is drawn on it for every slot.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
        scenario: The mission's scenario.
        title: The text above all.

    Attributes:
        figure: The figure, without what moves.
        end: The number of mission slots.

    Raises:
        InputError: If the log is not that of a whole mission of this scenario.
    """

    def __init__(self, events: event_log.Events, scenario: Scenario, title: str = ""):
        self.playback = Playback(events, scenario)
        self.end = self.playback.end
        curves = missions.curves_of_mission(scenario)
        self.figure = Figure(figsize=(WIDTH / DPI, HEIGHT * len(curves) / DPI), dpi=DPI)
        self.figure.set_layout_engine("constrained", rect=(0, 0, 0.95, 1))  # notes at the right
        self.figure.suptitle(title, x=0.012, ha="left", fontsize=11)
        widths = (1.05, 1)
        heights = [*curves.values()]
        grid = self.figure.add_gridspec(len(curves), 2, width_ratios=widths, height_ratios=heights)
        self.sea = self.figure.add_subplot(grid[:, 0])
        missions.plot_chart(scenario, self.sea)
        self.sea.set_title(" ")  # the place of the status
        self.curves = [self.figure.add_subplot(grid[row, 1]) for row in range(len(curves))]
        for ax, draw in zip(self.curves, curves, strict=True):
            draw(events, scenario, ax)
        for ax in self.curves[:-1]:
            ax.set_xlabel("")
        self._draw_discs(self.playback.residual.max(axis=0), facecolors="white",
                    edgecolors=self.playback.node_colours, linewidths=1)  # fmt: skip
        self.canvas = FigureCanvasAgg(self.figure)
        self.canvas.draw()
        self._background = self.canvas.copy_from_bbox(self.figure.bbox)

    def draw_frames(self) -> Iterator[np.ndarray]:
        """The pixels of every slot, (height, width, 4), and the last ones for a while."""
        for slot in range(self.end + 1):
            pixels = self.draw_frame(slot)
            yield pixels
        for _ in range(LAST_SECONDS * SLOTS_PER_SECOND):
            yield pixels

    def draw_frame(self, slot: int) -> np.ndarray:
        """The pixels of the mission after a number of slots, (height, width, 4)."""
        self.canvas.restore_region(self._background)
        for artist in self.moving_artists(slot):
            self.figure.draw_artist(artist)
            artist.remove()
        return np.array(self.canvas.buffer_rgba())

    def moving_artists(self, slot: int) -> Iterator[Artist]:
        """All that moves, as it is after a number of slots, from the bottom to the top."""
        playback = self.playback
        fleet = self.playback.fleet
        cells = np.stack([fleet["x"], fleet["y"]], 2)
        for uav, colour in enumerate(playback.uav_colours):
            way = cells[max(slot - style.TRAIL, 0) : slot + 1, uav].T
            yield from self.sea.plot(way[0], way[1], color=colour, alpha=0.35, linewidth=3)
            if (node := fleet["node"][slot, uav]) >= 0:
                link = np.array([cells[slot, uav], playback.scenario.nodes[node]]).T
                yield from self.sea.plot(
                    link[0], link[1], color=playback.node_colours[node], linewidth=2
                )
        yield self._draw_discs(playback.residual[slot], c=playback.node_colours, linewidths=0)
        for state, fill in (("waiting", "none"), ("charging", style.ZONE_EDGE)):
            spots = cells[slot, fleet[state][slot]].T
            yield self.sea.scatter(spots[0], spots[1], PAD_SIZE**2, marker="s", facecolors=fill,
                                   edgecolors=style.INK, linewidths=1)  # fmt: skip
        x, y = cells[slot].T
        yield self.sea.scatter(x, y, UAV_SIZE**2, c=playback.uav_colours,
                               edgecolors="white", alpha=1 - 0.6 * fleet["over"][slot])  # fmt: skip
        for uav in range(len(x)):
            yield self.sea.text(x[uav], y[uav], str(uav + 1), size=7, color="white", weight="bold",
                                ha="center", va="center_baseline")  # fmt: skip
        yield self.sea.text(0, 1.02, playback.describe_slot(slot), transform=self.sea.transAxes)
        for ax in self.curves:
            yield ax.axvline(slot, color=style.INK, linewidth=1.2)

    def _draw_discs(self, data: np.ndarray, **look: Any) -> Artist:
        """A disc per node, whose area is proportional to its data."""
        areas = NODE_SIZE**2 * data / max(self.playback.residual.max(), 1e-9)
        x, y = zip(*self.playback.scenario.nodes, strict=True)
        return self.sea.scatter(x, y, areas, **look)
