"""The map of a player: the nodes, the UAVs, and the nodes that they serve."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from analysis.figures.style import INK, MUTED, ZONE_EDGE
from reports.player.playback import Playback
from reports.player.trace import Json, Moving, lines, markers, rounded

TRAIL = 12  # number of last moves that are drawn behind a UAV
NODE_SIZE, UAV_SIZE, PAD_SIZE = 25, 16, 21  # diameters, and the side of a square [px]
STATUS = 5  # panel of the status line


def rings(playback: Playback) -> Json:
    """Rings as large as the most data that the nodes ever held."""
    line = {"width": 1.5, "color": playback.node_colours}
    discs = _discs("rings", playback, color="white", line=line)
    discs["marker"]["size"] = rounded(playback.residual.max())
    return discs


def moving(playback: Playback) -> list[Moving]:
    """All changing parts of the map, from the bottom layer to the top layer."""
    return [
        *_trails(playback),
        *_links(playback),
        _nodes(playback),
        *_squares(playback),
        _uavs(playback),
        _status(playback),
    ]


def _discs(name: str, playback: Playback, **marker: Any) -> Json:
    """A disc per node, whose area is proportional to ``size`` [data units]."""
    most = max(float(playback.residual.max(axis=None)), 1e-9)
    area: Json = {"sizemode": "area", "sizeref": 2 * most / NODE_SIZE**2, "opacity": 1}
    x, y = zip(*playback.scenario.nodes, strict=True)
    return {**markers(name, **area, **marker), "x": x, "y": y, "cliponaxis": True}


def _nodes(playback: Playback) -> Moving:
    """The discs of the nodes' residual data."""
    style = _discs("nodes", playback, color=playback.node_colours, line={"width": 0})
    text = "node %{pointNumber}: %{marker.size:.1f} data units<extra></extra>"
    style |= {"hovertemplate": text, "hoverinfo": "all"}
    residual = playback.residual.to_numpy()
    return Moving(style, [{"marker": {"size": rounded(row)}} for row in residual])


def _trails(playback: Playback) -> Iterator[Moving]:
    """The last moves, always with the same number of points, so that plotly animates smoothly."""
    times = np.arange(playback.end + 1)
    past = np.maximum(times[:, None] - np.arange(TRAIL + 1), 0)
    for uav, colour in enumerate(playback.uav_colours):
        x, y = (playback.fleet[axis][past, uav].tolist() for axis in ("x", "y"))
        style = {**lines(f"trail {uav + 1}", colour, 4), "opacity": 0.35}
        yield Moving(style, [{"x": x[t], "y": y[t]} for t in times])


def _links(playback: Playback) -> Iterator[Moving]:
    """A line from each UAV to the node that it serves; its length is 0 if it serves none."""
    nodes, colours = np.array(playback.scenario.nodes), [*playback.node_colours, MUTED]
    cells = np.stack([playback.fleet["x"], playback.fleet["y"]], 2)
    served = playback.fleet["node"]
    ends = np.where(served[..., None] >= 0, nodes[served], cells)
    for uav in range(playback.scenario.uavs):
        points = np.stack([cells[:, uav], ends[:, uav]], 2).tolist()
        frames = [
            {"x": x, "y": y, "line": {"color": colours[node]}}
            for (x, y), node in zip(points, served[:, uav], strict=True)
        ]
        yield Moving(lines(f"link {uav + 1}", width=2.5), frames)


def _squares(playback: Playback) -> Iterator[Moving]:
    """A square under every UAV that waits, and one under every UAV that charges."""
    for state, fill, width in (("waiting", "rgba(0, 0, 0, 0)", 1.8), ("charging", ZONE_EDGE, 1.2)):
        line = {"color": INK, "width": width}
        style = markers(state, symbol="square", size=PAD_SIZE, color=fill, line=line)
        frames = [
            {"x": x, "y": y, "marker": {"opacity": [int(seen) for seen in now]}}
            for x, y, now in playback.rows("x", "y", state)
        ]
        yield Moving(style, frames)


def _uavs(playback: Playback) -> Moving:
    """The UAVs as numbered dots."""
    line = {"width": 1.5, "color": "white"}
    style = {
        **markers(
            "UAVs", mode="markers+text", size=UAV_SIZE, color=playback.uav_colours, line=line
        ),
        "text": [str(uav + 1) for uav in range(playback.scenario.uavs)],
        "textfont": {"color": "white", "size": 11, "weight": "bold"},
        "hovertemplate": "UAV %{text}: battery %{customdata} %<extra></extra>",
        "hoverinfo": "all",
    }
    frames = [
        {"x": x, "y": y, "customdata": battery, "marker": {"opacity": [1 - 0.6 * o for o in over]}}
        for x, y, battery, over in playback.rows("x", "y", "battery", "over")
    ]
    return Moving(style, frames)


def _status(playback: Playback) -> Moving:
    """A line of text above the map."""
    style = {
        **markers("status", STATUS, mode="text"),
        "x": [0],
        "y": [0],
        "textposition": "middle right",
        "textfont": {"size": 13},
    }
    return Moving(style, [{"text": [text]} for text in statuses(playback)])


def statuses(playback: Playback) -> list[str]:
    """Residual data and the pads in use after every slot, in words."""
    left, texts = playback.residual.sum(axis=1), []
    for data, (charging, waiting) in zip(left, playback.rows("charging", "waiting"), strict=True):
        queue = f", {sum(waiting)} waiting" if any(waiting) else ""
        pads = f"{sum(charging)} of {counted(playback.pads, 'pad')} in use{queue}"
        texts.append(f"{data:.1f} data units left · {pads}")
    return texts


def counted(count: int, what: str) -> str:
    """A number and its noun, as ``1 pad`` or ``16 pads``."""
    return f"{count} {what}{'s' * (count != 1)}"
