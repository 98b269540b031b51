"""The map of a player: the nodes, the UAVs, and whom they serve."""

from collections.abc import Iterator
from typing import Any

import numpy as np

from analysis.figures.style import INK, MUTED
from reports.player.mission import Mission
from reports.player.trace import Json, Moving, on_axes, rounded

TRAIL = 12  # moves that a UAV draws behind it
NODE_SIZE, UAV_SIZE, PAD_SIZE = 25, 16, 21  # diameters, and the side of a square [px]
EDGE, STATUS = "#d9a400", 5


def _discs(mission: Mission, sizes: list[float], **marker: Any) -> Json:
    """A disc per node; its area is its size [data units]."""
    nodes, most = mission.scenario.nodes, max(float(mission.residual.max(axis=None)), 1e-9)
    area = {"sizemode": "area", "sizeref": 2 * most / NODE_SIZE**2, "opacity": 1}
    return {
        "x": [x for x, _ in nodes],
        "y": [y for _, y in nodes],
        "mode": "markers",
        "marker": {"size": sizes, **area, **marker},
    }


def rings(mission: Mission) -> Json:
    """Rings as large as the most data that the nodes ever held."""
    ring = {"width": 1.5, "color": mission.node_colours}
    discs = _discs(mission, rounded(mission.residual.max()), color="white", line=ring)
    return {**discs, "name": "rings", "hoverinfo": "skip"}


def nodes(mission: Mission) -> Moving:
    """Discs as large as the residual data."""
    style = {
        **_discs(mission, [], color=mission.node_colours, line={"width": 0}),
        "name": "nodes",
        "hovertemplate": "node %{pointNumber}: %{marker.size:.1f} data units<extra></extra>",
    }
    residual = mission.residual.to_numpy()
    return Moving(style, [{"marker": {"size": rounded(row)}} for row in residual])


def trails(mission: Mission) -> Iterator[Moving]:
    """The last moves: always equally many points, so that they glide from frame to frame."""
    times = np.arange(mission.end + 1)
    past = np.maximum(times[:, None] - np.arange(TRAIL + 1), 0)
    for uav, colour in enumerate(mission.uav_colours):
        style = {
            "name": f"trail {uav + 1}",
            "mode": "lines",
            "hoverinfo": "skip",
            "opacity": 0.35,
            "line": {"color": colour, "width": 4, "simplify": False},
        }
        x, y = (mission.fleet[axis][past, uav].tolist() for axis in ("x", "y"))
        yield Moving(style, [{"x": x[t], "y": y[t]} for t in times])


def links(mission: Mission) -> Iterator[Moving]:
    """A line from each UAV to the node that it serves, of no length where it serves none."""
    nodes, colours = np.array(mission.scenario.nodes), [*mission.node_colours, MUTED]
    fleet = mission.fleet
    for uav in range(mission.scenario.uavs):
        style = {
            "name": f"link {uav + 1}",
            "mode": "lines",
            "hoverinfo": "skip",
            "line": {"width": 2.5, "simplify": False},
        }
        own, served = np.stack([fleet["x"], fleet["y"]], 2)[:, uav], fleet["node"][:, uav]
        ends = np.where(served[:, None] >= 0, nodes[served], own)
        lines = np.stack([own, ends], 2).tolist()
        frames = [
            {"x": x, "y": y, "line": {"color": colours[node]}}
            for (x, y), node in zip(lines, served, strict=True)
        ]
        yield Moving(style, frames)


def squares(mission: Mission) -> Iterator[Moving]:
    """A square under every UAV, to be seen while it charges, and one for while it waits."""
    looks = {
        "waiting": {"color": "rgba(0, 0, 0, 0)", "line": {"color": INK, "width": 1.8}},
        "charging": {"color": EDGE, "line": {"color": INK, "width": 1.2}},
    }
    for state, look in looks.items():
        style = {
            "name": state,
            "mode": "markers",
            "hoverinfo": "skip",
            "cliponaxis": False,
            "marker": {"symbol": "square", "size": PAD_SIZE, **look},
        }
        frames = [
            {"x": x, "y": y, "marker": {"opacity": [int(seen) for seen in now]}}
            for x, y, now in mission.rows("x", "y", state)
        ]
        yield Moving(style, frames)


def uavs(mission: Mission) -> Moving:
    """Numbered dots."""
    style = {
        "name": "UAVs",
        "mode": "markers+text",
        "text": [str(uav + 1) for uav in range(mission.scenario.uavs)],
        "textfont": {"color": "white", "size": 11, "weight": "bold"},
        "marker": {
            "size": UAV_SIZE,
            "color": mission.uav_colours,
            "line": {"width": 1.5, "color": "white"},
        },
        "hovertemplate": "UAV %{text}: battery %{customdata} %<extra></extra>",
        "cliponaxis": False,
    }
    frames = [
        {"x": x, "y": y, "customdata": battery, "marker": {"opacity": [1 - 0.6 * o for o in over]}}
        for x, y, battery, over in mission.rows("x", "y", "battery", "over")
    ]
    return Moving(style, frames)


def status(mission: Mission) -> Moving:
    """A line above the map: what is left, and the pads in use."""
    style = {
        **on_axes(STATUS, "status"),
        "x": [0],
        "y": [0],
        "mode": "text",
        "textposition": "middle right",
        "textfont": {"size": 13},
        "cliponaxis": False,
    }
    left = mission.residual.sum(axis=1)
    frames = []
    for data, (charging, waiting) in zip(left, mission.rows("charging", "waiting"), strict=True):
        queue = f", {sum(waiting)} waiting" if any(waiting) else ""
        pads = f"{sum(charging)} of {counted(mission.pads, 'pad')} in use{queue}"
        frames.append({"text": [f"{data:.0f} data units left · {pads}"]})
    return Moving(style, frames)


def counted(count: int, what: str) -> str:
    """``1 pad``, ``16 pads``."""
    return f"{count} {what}{'s' * (count != 1)}"
