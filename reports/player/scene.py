"""All that a player and an animation draw, as traces of plotly: what stays, and what moves.

The panels are numbered as plotly's axes: the map is 1, and each has its numbers in a constant.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from analysis.figures.style import INK, MUTED, ZONE_EDGE
from reports.player.playback import Playback

Json: TypeAlias = dict[str, Any]

BATTERY, RESIDUAL, CHARGING, STATUS, AGE, NODE_AGES = 2, 3, 4, 5, 6, 7  # panels
TRAIL = 12  # number of last moves that are drawn behind a UAV
NODE_SIZE, UAV_SIZE, PAD_SIZE = 25, 16, 21  # diameters, and the side of a square [px]


@dataclass
class Moving:
    """A trace that changes: its style, and what the frame of every slot sets."""

    style: Json
    frames: list[Json]

    def at(self, slot: int) -> Json:
        """The trace as it is shown after a number of slots."""
        return _merged(self.style, self.frames[slot])


def still(playback: Playback) -> list[Json]:
    """All that does not change: the most data of the nodes, and the curves."""
    line = {"width": 1.5, "color": playback.node_colours}
    rings = _discs("rings", playback, color="white", line=line)
    rings["marker"]["size"] = rounded(playback.residual.max())
    return [rings, *_batteries(playback), *_residual(playback), *_charging(playback)]


def moving(playback: Playback) -> list[Moving]:
    """All that changes, from the bottom layer to the top layer."""
    fleet, uavs = playback.fleet, range(playback.scenario.uavs)
    cells = np.stack([fleet["x"], fleet["y"]], 2)
    return [
        *_trails(playback, cells),
        *_links(playback, cells),
        _nodes(playback),
        *_squares(playback, cells),
        Moving(
            {
                **_markers("UAVs", UAV_SIZE, playback.uav_colours, "white", 1.5),
                "mode": "markers+text",
                "text": [str(uav + 1) for uav in uavs],
                "textfont": {"color": "white", "size": 11, "weight": "bold"},
                "hovertemplate": "UAV %{text}: battery %{customdata} %<extra></extra>",
                "hoverinfo": "all",
            },
            [
                _xy(now) | {"customdata": level, "marker": {"opacity": [1 - 0.6 * o for o in over]}}
                for now, level, over in zip(
                    cells, fleet["battery"].tolist(), fleet["over"].tolist(), strict=True
                )
            ],
        ),
        Moving(
            {
                **_on("status", STATUS),
                **{"mode": "text", "x": [0], "y": [0], "textposition": "middle right"},
                "textfont": {"size": 13},
            },
            [{"text": [text]} for text in _statuses(playback)],
        ),
        *(
            Moving({**_lines(f"cursor {panel}", INK, 1.2, panel), "y": ends},
                   [{"x": [t, t]} for t in range(playback.end + 1)])
            for panel, ends in ranges(playback).items()
        ),
        Moving(_markers("batteries", 9, playback.uav_colours, "white", 1.5, BATTERY),
               [{"x": [t] * len(uavs), "y": y} for t, y in enumerate(fleet["battery"].tolist())]),
        *(_ages(playback) if playback.measures_age else ()),
    ]  # fmt: skip


def ranges(playback: Playback) -> dict[int, list[float]]:
    """The panels over time from top to bottom, with the ends of their y axes, from the bottom."""
    most = max(float(playback.residual.sum(axis=1).max()), 1.0)
    uavs = playback.scenario.uavs
    room = 0.6 + max(0, 3 - uavs) / 2  # so that a single row does not fill the panel
    ages = playback.mean_age["age"].max() if playback.measures_age else 0.0
    return {
        BATTERY: [0, 103],
        RESIDUAL: [0, round(1.05 * most, 2)],
        **({AGE: [0, round(1.05 * ages, 2)]} if playback.measures_age else {}),
        CHARGING: [uavs + room, 1 - room],
    }


def rounded(values: pd.Series | np.ndarray) -> list[float]:
    """Amounts of data with two digits."""
    return np.round(np.maximum(values, 0.0), 2).tolist()  # residual data may be -1e-16


def counted(count: int, what: str) -> str:
    """A number and its noun, as ``1 pad`` or ``16 pads``."""
    return f"{count} {what}{'s' * (count != 1)}"


def _batteries(playback: Playback) -> Iterator[Json]:
    """The battery of every UAV; and the mean age, if it is measured."""
    for uav, levels in playback.levels.groupby("uav"):
        style = _lines(f"battery {uav + 1}", playback.uav_colours[uav], panel=BATTERY)
        yield {**style, "x": levels["time"].tolist(), "y": levels["battery"].tolist()}
    if playback.measures_age:
        times, ages = (rounded(playback.mean_age[name]) for name in ("time", "age"))
        yield {**_lines("mean age", INK, panel=AGE), "x": times, "y": ages}


def _residual(playback: Playback) -> Iterator[Json]:
    """A band per node, in its colour."""
    times = playback.residual.index.tolist()
    for node, colour in zip(playback.residual, playback.node_colours, strict=True):
        band = {"mode": "none", "stackgroup": "nodes", "fillcolor": colour, "opacity": 0.75}
        style = _lines(f"residual {node}", panel=RESIDUAL)
        yield {**style, "x": times, "y": rounded(playback.residual[node]), **band}


def _charging(playback: Playback) -> Iterator[Json]:
    """A row per UAV: a line while it is active, bars while it charges or waits."""
    for uav, slots in playback.slots.groupby("uav"):
        colour, row = playback.uav_colours[uav], uav + 1
        active = _lines(f"active {row}", colour, panel=CHARGING)
        yield {**active, "x": [0, len(slots)], "y": [row, row]}
        for state, fill in (("charging", colour), ("waiting", "white")):
            busy = slots.loc[slots[state], "slot"]
            runs = busy.groupby((busy.diff() != 1).cumsum()).agg(["min", "max"]).to_numpy()
            # The outline of a bar per run of slots; plotly cannot animate its own bars.
            x = [x for a, b in runs.tolist() for x in (a, b + 1, b + 1, a, a, None)]
            y = [row - 0.3, row - 0.3, row + 0.3, row + 0.3, row - 0.3, None] * len(runs)
            style = _lines(f"{state} {row}", colour, 1, CHARGING)
            yield {**style, "x": x, "y": y, "fill": "toself", "fillcolor": fill}


def _ages(playback: Playback) -> list[Moving]:
    """For each node a stem as high as its age, with a dot in its colour."""
    nodes = list(range(len(playback.scenario.nodes)))
    stems = _lines("stems", INK, 1, NODE_AGES) | {"x": [x for k in nodes for x in (k, k, None)]}
    dots = _markers("ages", 8, playback.node_colours, "white", 0, NODE_AGES) | {"x": nodes}
    text = "node %{x}: age %{y:.1f} slots<extra></extra>"
    rows = [rounded(row) for row in playback.ages.to_numpy()]
    return [
        Moving(stems, [{"y": [y for age in row for y in (0, age, None)]} for row in rows]),
        Moving(dots | {"hovertemplate": text, "hoverinfo": "all"}, [{"y": row} for row in rows]),
    ]


def _trails(playback: Playback, cells: np.ndarray) -> Iterator[Moving]:
    """The last moves, always with the same number of points, so that plotly animates smoothly."""
    past = np.maximum(np.arange(len(cells))[:, None] - np.arange(TRAIL + 1), 0)
    for uav, colour in enumerate(playback.uav_colours):
        style = {**_lines(f"trail {uav + 1}", colour, 4), "opacity": 0.35}
        yield Moving(style, [_xy(way) for way in cells[past, uav]])


def _links(playback: Playback, cells: np.ndarray) -> Iterator[Moving]:
    """A line from each UAV to the node that it serves; its length is 0 if it serves none."""
    nodes, colours = np.array(playback.scenario.nodes), [*playback.node_colours, MUTED]
    served = playback.fleet["node"]
    ends = np.stack([cells, np.where(served[..., None] >= 0, nodes[served], cells)], 2)
    for uav in range(playback.scenario.uavs):
        frames = [
            _xy(line) | {"line": {"color": colours[node]}}
            for line, node in zip(ends[:, uav], served[:, uav], strict=True)
        ]
        yield Moving(_lines(f"link {uav + 1}", width=2.5), frames)


def _nodes(playback: Playback) -> Moving:
    """The discs of the nodes' residual data."""
    style = _discs("nodes", playback, color=playback.node_colours, line={"width": 0})
    text = "node %{pointNumber}: %{marker.size:.1f} data units<extra></extra>"
    frames = [{"marker": {"size": rounded(row)}} for row in playback.residual.to_numpy()]
    return Moving(style | {"hovertemplate": text, "hoverinfo": "all"}, frames)


def _squares(playback: Playback, cells: np.ndarray) -> Iterator[Moving]:
    """A square under every UAV that waits, and one under every UAV that charges."""
    for state, fill, width in (("waiting", "rgba(0, 0, 0, 0)", 1.8), ("charging", ZONE_EDGE, 1.2)):
        style = _markers(state, PAD_SIZE, fill, INK, width)
        style["marker"]["symbol"] = "square"
        frames = [
            _xy(now) | {"marker": {"opacity": seen.astype(int).tolist()}}
            for now, seen in zip(cells, playback.fleet[state], strict=True)
        ]
        yield Moving(style, frames)


def _statuses(playback: Playback) -> Iterator[str]:
    """Residual data and the pads in use after every slot, in words."""
    counts = (playback.fleet[state].sum(axis=1) for state in ("charging", "waiting"))
    for data, charging, waiting in zip(playback.residual.sum(axis=1), *counts, strict=True):
        queue = f", {waiting} waiting" if waiting else ""
        pads = f"{charging} of {counted(playback.pads, 'pad')} in use{queue}"
        yield f"{data:.1f} data units left · {pads}"


def _on(name: str, panel: int) -> Json:
    axes = {} if panel == 1 else {"xaxis": f"x{panel}", "yaxis": f"y{panel}"}
    return {**axes, "name": name}


def _lines(name: str, colour: str | None = None, width: float = 1.5, panel: int = 1) -> Json:
    """The style of a trace of lines in a panel; plotly keeps all points of a changing line."""
    line = {"color": colour, "width": width, "simplify": False}
    return {**_on(name, panel), "mode": "lines", "line": line}


def _markers(
    name: str, size: float, fill: str | list[str], edge: str, width: float, panel: int = 1
) -> Json:
    """The style of a trace of markers in a panel, drawn in full at its edges."""
    marker = {"size": size, "color": fill, "line": {"width": width, "color": edge}, "opacity": 1}
    return {**_on(name, panel), "mode": "markers", "cliponaxis": False, "marker": marker}


def _discs(name: str, playback: Playback, **marker: Any) -> Json:
    """A disc per node, whose area is proportional to ``size`` [data units]."""
    most = max(float(playback.residual.max(axis=None)), 1e-9)
    area = {"sizemode": "area", "sizeref": 2 * most / NODE_SIZE**2, "opacity": 1}
    x, y = zip(*playback.scenario.nodes, strict=True)
    return {**_on(name, 1), "mode": "markers", "marker": area | marker, "x": x, "y": y}


def _xy(points: np.ndarray) -> Json:
    x, y = points.T.tolist()
    return {"x": x, "y": y}


def _merged(style: Json, change: Json) -> Json:
    nested = {k: _merged(style.get(k, {}), v) for k, v in change.items() if isinstance(v, dict)}
    return {**style, **change, **nested}
