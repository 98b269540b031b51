"""The panels of a player, over the time of the mission: batteries, residual data, age, charging."""

from collections.abc import Iterator

import pandas as pd

from analysis.figures.style import INK
from reports.player import ages
from reports.player.ages import AGE
from reports.player.playback import Playback
from reports.player.trace import Json, Moving, lines, markers, rounded

BATTERY, RESIDUAL, CHARGING = (2, 3, 4)


def ranges(playback: Playback) -> dict[int, list[float]]:
    """The panels from top to bottom, and the ends of each one's y axis, from bottom to top."""
    most = max(float(playback.residual.sum(axis=1).max()), 1.0)
    uavs = playback.scenario.uavs
    room = 0.6 + max(0, 3 - uavs) / 2  # so that a single row does not fill the panel
    return {
        BATTERY: [0, 103],
        RESIDUAL: [0, round(1.05 * most, 2)],
        **({AGE: [0, ages.highest(playback)]} if playback.measures_age else {}),
        CHARGING: [uavs + room, 1 - room],
    }


def at_rest(playback: Playback) -> list[Json]:
    """The curves, which do not change while the mission is played."""
    age = [ages.sawtooth(playback)] if playback.measures_age else []
    return [*_battery(playback), *_residual(playback), *age, *_charging(playback)]


def moving(playback: Playback) -> list[Moving]:
    """At the present slot, a vertical line through each panel and dots on the battery curves."""
    times = range(playback.end + 1)
    cursors = [
        Moving(
            {**lines(f"cursor {panel}", INK, 1.2, panel), "y": ends}, [{"x": [t, t]} for t in times]
        )
        for panel, ends in ranges(playback).items()
    ]
    line = {"width": 1.5, "color": "white"}
    look: Json = {"size": 9, "opacity": 1, "color": playback.uav_colours, "line": line}
    rows = enumerate(playback.fleet["battery"].tolist())
    frames = [{"x": [t] * len(levels), "y": levels} for t, levels in rows]
    columns = ages.columns(playback) if playback.measures_age else []
    return [*cursors, Moving(markers("batteries", BATTERY, **look), frames), *columns]


def _battery(playback: Playback) -> Iterator[Json]:
    """A curve per UAV."""
    for uav, levels in playback.levels.groupby("uav"):
        style = lines(f"battery {uav + 1}", playback.uav_colours[uav], panel=BATTERY)
        yield {**style, "x": levels["time"].tolist(), "y": levels["battery"].tolist()}


def _residual(playback: Playback) -> Iterator[Json]:
    """A band per node, in its colour."""
    times = playback.residual.index.tolist()
    for node, colour in zip(playback.residual, playback.node_colours, strict=True):
        yield {
            **lines(f"residual {node}", panel=RESIDUAL),
            "x": times,
            "y": rounded(playback.residual[node]),
            "mode": "none",
            "stackgroup": "nodes",
            "fillcolor": colour,
            "opacity": 0.75,
        }


def _charging(playback: Playback) -> Iterator[Json]:
    """A row per UAV: a line while it is active, bars while it charges or waits."""
    for uav, slots in playback.slots.groupby("uav"):
        colour, row = playback.uav_colours[uav], uav + 1
        active = lines(f"active {row}", colour, panel=CHARGING)
        yield {**active, "x": [0, len(slots)], "y": [row, row]}
        for state, fill in (("charging", colour), ("waiting", "white")):
            style = lines(f"{state} {row}", colour, 1, CHARGING)
            x, y = _bars(slots.loc[slots[state], "slot"], row)
            yield {**style, "x": x, "y": y, "fill": "toself", "fillcolor": fill}


def _bars(slots: pd.Series, row: int) -> tuple[list[int | None], list[float | None]]:
    """The outlines of a bar per series of consecutive slots; plotly cannot animate its own bars."""
    x: list[int | None] = []
    y: list[float | None] = []
    for _, run in slots.groupby((slots.diff() != 1).cumsum()):
        left, right, bottom, top = int(run.min()), int(run.max()) + 1, row - 0.3, row + 0.3
        x += [left, right, right, left, left, None]
        y += [bottom, bottom, top, top, bottom, None]
    return x, y
