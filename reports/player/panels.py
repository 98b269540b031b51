"""The panels of a player, over the time of the mission: batteries, residual data, charging."""

from collections.abc import Iterator

import pandas as pd

from analysis.figures.style import INK
from reports.player.mission import Mission
from reports.player.trace import Json, Moving, on_axes, rounded

PANELS = (2, 3, 4)


def ranges(mission: Mission) -> dict[int, list[float]]:
    """What each panel spans, from its bottom to its top."""
    most = max(float(mission.residual.sum(axis=1).max()), 1.0)
    uavs = mission.scenario.uavs
    room = 0.6 + max(0, 3 - uavs) / 2  # a single row is not blown up
    spans: tuple[list[float], ...] = (
        [0, 103],
        [0, round(1.05 * most, 2)],
        [uavs + room, 1 - room],
    )
    return dict(zip(PANELS, spans, strict=True))


def battery(mission: Mission) -> Iterator[Json]:
    """A curve per UAV."""
    for uav, own in mission.levels.groupby("uav"):
        yield {
            **on_axes(2, f"battery {uav + 1}"),
            "x": own["time"].tolist(),
            "y": own["battery"].tolist(),
            "mode": "lines",
            "line": {"color": mission.uav_colours[uav], "width": 1.5},
        }


def residual(mission: Mission) -> Iterator[Json]:
    """A band per node, in its colour."""
    for node, colour in zip(mission.residual, mission.node_colours, strict=True):
        yield {
            **on_axes(3, f"residual {node}"),
            "x": mission.residual.index.tolist(),
            "y": rounded(mission.residual[node]),
            "mode": "none",
            "stackgroup": "nodes",
            "fillcolor": colour,
            "opacity": 0.75,
        }


def charging(mission: Mission) -> Iterator[Json]:
    """A row per UAV: a line while it is active, bars while it charges or waits."""
    for uav, own in mission.slots.groupby("uav"):
        colour = mission.uav_colours[uav]
        yield {
            **on_axes(4, f"active {uav + 1}"),
            "x": [0, len(own)],
            "y": [uav + 1, uav + 1],
            "mode": "lines",
            "line": {"color": colour, "width": 1.5},
        }
        for state, fill in (("charging", colour), ("waiting", "white")):
            x, y = _bars(own.loc[own[state], "slot"], uav + 1)
            yield {
                **on_axes(4, f"{state} {uav + 1}"),
                "x": x,
                "y": y,
                "mode": "lines",
                "line": {"color": colour, "width": 1},
                "fill": "toself",
                "fillcolor": fill,
            }


def _bars(slots: pd.Series, row: int) -> tuple[list[int | None], list[float | None]]:
    """The outlines of a bar per run of consecutive slots; plotly's own bars do not animate."""
    x: list[int | None] = []
    y: list[float | None] = []
    for _, run in slots.groupby((slots.diff() != 1).cumsum()):
        left, right, bottom, top = int(run.min()), int(run.max()) + 1, row - 0.3, row + 0.3
        x += [left, right, right, left, left, None]
        y += [bottom, bottom, top, top, bottom, None]
    return x, y


def cursors(mission: Mission) -> Iterator[Moving]:
    """An upright line through each panel at the time that is shown."""
    for panel, ends in ranges(mission).items():
        style = {
            **on_axes(panel, f"cursor {panel}"),
            "y": ends,
            "mode": "lines",
            "line": {"color": INK, "width": 1.2, "simplify": False},
        }
        yield Moving(style, [{"x": [t, t]} for t in range(mission.end + 1)])


def levels(mission: Mission) -> Moving:
    """Dots on the battery curves at the time that is shown."""
    style = {
        **on_axes(2, "batteries"),
        "mode": "markers",
        "cliponaxis": False,
        "marker": {
            "size": 9,
            "opacity": 1,
            "color": mission.uav_colours,
            "line": {"width": 1.5, "color": "white"},
        },
    }
    rows = enumerate(mission.fleet["battery"].tolist())
    return Moving(style, [{"x": [t] * len(levels), "y": levels} for t, levels in rows])
