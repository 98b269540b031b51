"""A mission as a figure of matplotlib that shows any mission slot: the frames of an animation.

    film = Film(log, scenario, "greedy")
    film.show(20)
    film.figure.savefig("slot-20.png")

It shows what the player shows: the map beside the batteries, the residual data, the mean age if it
is measured, and the charging zone over time.
"""

from collections.abc import Callable, Iterator

import numpy as np
import pandas as pd
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backend_bases import RendererBase
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.text import Text

from analysis.figures import missions, style
from analysis.results.event_log import Events
from dess.scenario import Scenario
from reports.player.mission_map import TRAIL, statuses
from reports.player.playback import Playback

# The width, and the height for each of the curves [px], even as videos need; dots per inch.
WIDTH, HEIGHT, DPI = 810, 144, 90
NODE, UAV, PAD, DOT = 140, 85, 170, 22  # areas of the fullest node and of other marks [points^2]

Mover = Callable[[int], object]  # makes marks show the mission after a number of slots


class Film:
    """The figure of a mission; made inside ``style.look``.

    All that stays is drawn once, as an image, and what moves is drawn on it for every slot: that
    takes a fraction of the time.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The mission's scenario.
        title: The text above all.

    Attributes:
        figure: The figure.
        end: The number of mission slots.

    Raises:
        InputError: If the log is not that of a whole mission of this scenario.
    """

    def __init__(self, events: Events, scenario: Scenario, title: str = ""):
        playback = Playback(pd.DataFrame(events), scenario)
        self.end = playback.end
        curves = [*missions.curves(scenario)]
        self.figure = Figure(figsize=(WIDTH / DPI, HEIGHT * len(curves) / DPI), dpi=DPI)
        self.figure.set_layout_engine("constrained", rect=(0, 0, 0.95, 1))  # notes at the right
        self.figure.suptitle(title, x=0.012, ha="left", fontsize=11)
        heights = [1.3] * (len(curves) - 1) + [1]
        grid = self.figure.add_gridspec(
            len(curves), 2, width_ratios=(1.05, 1), height_ratios=heights
        )
        sea = self.figure.add_subplot(grid[:, 0], anchor="N" if playback.measures_age else "C")
        panels = [self.figure.add_subplot(grid[row, 1]) for row in range(len(curves))]
        _draw_map(playback, sea)
        for draw, ax in zip(curves, panels, strict=True):
            draw(events, scenario, ax)
            if ax is not panels[-1]:
                ax.set_xlabel("")
        self._keep_as_image()
        self._movers = [*_on_map(playback, sea), *_on_panels(playback, panels)]

    def show(self, slot: int) -> None:
        """Show the mission after a number of slots."""
        for move in self._movers:
            move(slot)

    def _keep_as_image(self) -> None:
        """Put an image in the place of all that has been drawn."""
        canvas = FigureCanvasAgg(self.figure)
        canvas.draw()
        self.figure.set_layout_engine("none")
        for ax in self.figure.axes:
            ax.set_title("", y=1)  # with another y, every drawing looks for the place of the title
            for artist in ax.get_children():
                artist.set_visible(False)
        self.figure.texts.clear()
        self.figure.add_artist(_Picture(np.array(canvas.buffer_rgba())))


class _Picture(Artist):
    """The pixels of a whole figure, (height, width, 4), below all else that is drawn on it."""

    zorder = -1

    def __init__(self, pixels: np.ndarray):
        super().__init__()
        self.pixels = pixels[::-1]

    def draw(self, renderer: RendererBase) -> None:
        renderer.draw_image(renderer.new_gc(), 0, 0, self.pixels)


def _draw_map(playback: Playback, ax: Axes) -> None:
    """The map, and rings as large as the most data that the nodes ever held."""
    missions.chart(playback.scenario, ax)
    x, y = np.transpose(playback.scenario.nodes)
    most = _areas(playback).max(axis=0)
    ax.scatter(x, y, s=most, facecolor="white", edgecolor=playback.node_colours, zorder=2)
    ax.set_title(" ")  # the place of the status


def _areas(playback: Playback) -> np.ndarray:
    """(T + 1, K) areas of the nodes [points^2], in proportion to their residual data."""
    residual = np.maximum(playback.residual.to_numpy(), 0)
    return NODE * residual / max(residual.max(), 1e-9)


def _cells(playback: Playback) -> np.ndarray:
    """(T + 1, I, 2) where the UAVs are."""
    return np.stack([playback.fleet["x"], playback.fleet["y"]], axis=2)


def _on_map(playback: Playback, ax: Axes) -> Iterator[Mover]:
    """All that changes on the map, from bottom to top."""
    for uav in range(playback.scenario.uavs):
        yield _trail(playback, uav, ax)
    for uav in range(playback.scenario.uavs):
        yield _link(playback, uav, ax)
    areas = _areas(playback)
    x, y = np.transpose(playback.scenario.nodes)
    nodes = ax.scatter(x, y, c=playback.node_colours, linewidths=0, zorder=2, gid="nodes")
    yield lambda slot: nodes.set_sizes(areas[slot])
    for state, fill in (("waiting", "none"), ("charging", style.ZONE_EDGE)):
        yield _squares(playback, state, fill, ax)
    yield from _uavs(playback, ax)
    status, texts = ax.text(0, 1.02, "", transform=ax.transAxes, gid="status"), statuses(playback)
    yield lambda slot: status.set_text(f"slot {slot} of {playback.end} · {texts[slot]}")


def _trail(playback: Playback, uav: int, ax: Axes) -> Mover:
    """The last moves of a UAV."""
    way = _cells(playback)[:, uav]
    (line,) = ax.plot([], [], color=playback.uav_colours[uav], alpha=0.35, linewidth=3.5)
    return lambda slot: line.set_data(way[max(slot - TRAIL, 0) : slot + 1].T)


def _link(playback: Playback, uav: int, ax: Axes) -> Mover:
    """A line from a UAV to the node that it serves."""
    nodes, colours = np.array(playback.scenario.nodes), playback.node_colours
    cells, served = _cells(playback)[:, uav], playback.fleet["node"][:, uav]
    (line,) = ax.plot([], [], linewidth=2)

    def move(slot: int) -> None:
        node = served[slot]
        line.set_visible(node >= 0)
        line.set(data=np.transpose([cells[slot], nodes[node]]), color=colours[node])

    return move


def _squares(playback: Playback, state: str, fill: str, ax: Axes) -> Mover:
    """A square under every UAV that waits, or charges."""
    cells, seen = _cells(playback), playback.fleet[state]
    marks = ax.scatter(
        [], [], s=PAD, marker="s", facecolor=fill, edgecolor=style.INK, zorder=2, gid=state
    )
    return lambda slot: marks.set_offsets(cells[slot][seen[slot]])


def _uavs(playback: Playback, ax: Axes) -> Iterator[Mover]:
    """Numbered dots, pale where the mission of the UAV is over."""
    cells, alpha = _cells(playback), 1 - 0.6 * playback.fleet["over"]
    x, y = cells[0].T
    dots = ax.scatter(x, y, s=UAV, c=playback.uav_colours, edgecolor="white", zorder=2, gid="UAVs")
    yield lambda slot: dots.set(offsets=cells[slot], alpha=alpha[slot])
    for uav in range(playback.scenario.uavs):
        number = ax.text(0, 0, f"{uav + 1}", size=7, color="white", weight="bold", zorder=2)
        number.set(ha="center", va="center_baseline")
        yield _at(cells[:, uav], number)


def _at(way: np.ndarray, text: Text) -> Mover:
    return lambda slot: text.set_position(way[slot])


def _on_panels(playback: Playback, axes: list[Axes]) -> Iterator[Mover]:
    """An upright line through every panel, and dots on the curves of the batteries."""
    for ax in axes:
        yield _cursor(ax)
    levels = playback.fleet["battery"]
    dots = axes[0].scatter(0 * levels[0], levels[0], s=DOT, c=playback.uav_colours,
                           edgecolor="white", linewidths=0.8, zorder=3)  # fmt: skip
    yield lambda slot: dots.set_offsets([(slot, level) for level in levels[slot]])


def _cursor(ax: Axes) -> Mover:
    line = ax.axvline(0, color=style.INK, linewidth=1.2)
    return lambda slot: line.set_xdata([slot, slot])
