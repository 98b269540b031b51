"""A mission replayed in its page: play, pause, and a slider over the mission slots.

A page shows ``library()`` once, before its first ``player``; together they are all that it needs,
nothing is loaded. A player is a plotly figure with a frame per mission slot: frame t shows the
mission after t slots, frame 0 its start, the last one its end.
"""

import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from html import escape
from typing import Any, TypeAlias

import numpy as np
import pandas as pd
from IPython.display import HTML
from plotly.io import to_html
from plotly.offline import get_plotlyjs

from analysis.figures import INK, MUTED, SEA, ZONE, node_colours, uav_colours
from analysis.slots import Events, battery_levels, residual_data, uav_slots
from dess.errors import InputError
from dess.scenario import Scenario

READING = (
    "A disc is the data that is left at a node, the ring around it the most that the node ever "
    "held. A numbered dot is a UAV with its last moves, and with a line to the node that it "
    "served in most of the slot's communication slots; it turns pale when its mission is over. A "
    "yellow square is a UAV that charges, an empty one a UAV that waits for a pad. The upright "
    "lines in the curves stand at the slot that is shown; a tick ends the row of a UAV that "
    "filled its quota, a cross that of one that did not."
)

SECONDS_PER_SLOT = {"Play": 0.3, "Fast": 0.1}
TRAIL = 12  # moves that a UAV draws behind it
NODE_SIZE, UAV_SIZE, PAD_SIZE = 25, 16, 21  # diameters, and the side of a square [px]
WIDE = 720  # width [px] from which on the curves stand beside the map, not below it
EDGE, GRID, PANELS, STATUS = "#d9a400", "#dde4e9", (2, 3, 4), 5
MARGINS = {"l": 44, "r": 38, "t": 6, "b": 40}
FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", Arial, sans-serif'

Json: TypeAlias = dict[str, Any]


def library() -> HTML:
    """The drawing library, plotly.js: once in a page, before its players."""
    # plotly rejects, for no reason and unheard, the promise of a replay that is paused.
    quiet = """window.addEventListener("unhandledrejection", (event) => {
        if (event.reason === undefined) event.preventDefault();
    });"""
    return HTML(f"<script>{get_plotlyjs()}</script><script>{quiet}</script>")


def player(
    events: Events, scenario: Scenario, name: str, title: str = "", caption: str = ""
) -> HTML:
    """A mission to play, to pause and to leaf through, slot by slot.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The mission's scenario.
        name: The player's id, unique in its page: letters, digits and hyphens.
        title: What stands above the map.
        caption: What stands below the figure; ``READING`` tells how to read it.

    Raises:
        InputError: If the log is not that of a whole mission of this scenario.
    """
    html = to_html(
        _figure(_Mission(pd.DataFrame(events), scenario)),
        config={"displayModeBar": False},
        auto_play=False,
        include_plotlyjs=False,
        post_script=_arranging(),
        full_html=False,
        default_height="auto",
        validate=False,  # a test does
        div_id=name,
    )
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    above = f"<h3>{escape(title)}</h3>" if title else ""
    return HTML(f'<figure class="player">{above}{html}{below}</figure>')


class _Mission:
    """What is known of a mission of T slots, I UAVs and K nodes.

    Attributes:
        slots: ``uav_slots`` of the log.
        levels: ``battery_levels`` of the log.
        residual: (T + 1, K) ``residual_data`` of the log.
        filled: (I,) whether the UAV filled its quota.
        fleet: (T + 1, I) arrays of what the UAVs are after every slot: ``x``, ``y``, ``battery``,
            ``node``, ``charging``, ``waiting``, and ``over`` if the UAV's mission has ended.
    """

    def __init__(self, log: pd.DataFrame, scenario: Scenario):
        _check(log, scenario)
        self.scenario = scenario
        self.slots, self.levels, self.residual = (
            uav_slots(log),
            battery_levels(log),
            residual_data(log),
        )
        self.end = len(self.residual) - 1
        self.filled = np.isin(range(scenario.uavs), log.loc[log["event"] == "quota_filled", "uav"])
        self.fleet = self._after_slots()
        self.pads = scenario.zone_cells if scenario.pads is None else scenario.pads
        self.uav_colours = uav_colours(scenario.uavs)
        self.node_colours = node_colours(len(scenario.nodes))

    def _after_slots(self) -> dict[str, np.ndarray]:
        table = self.slots.assign(time=self.slots["slot"] + 1).pivot(index="time", columns="uav")
        table = table.reindex(range(self.end + 1))
        first = self.slots.drop_duplicates("uav")
        levels = self.levels.pivot(index="time", columns="uav", values="battery")
        last = self.slots.groupby("uav")["slot"].max().to_numpy() + 1
        fleet = {
            "battery": levels.reindex(table.index).ffill().to_numpy(int),
            "node": table["node"].fillna(-1).to_numpy(int),
            "over": np.arange(self.end + 1)[:, None] >= last,
        }
        for axis in ("x", "y"):
            table.loc[0, axis] = first[f"from_{axis}"].to_numpy()
            fleet[axis] = table[axis].ffill().to_numpy(int)
        for state in ("charging", "waiting"):
            fleet[state] = table[state].eq(True).to_numpy()
        return fleet

    def rows(self, *names: str) -> Iterator[tuple[list, ...]]:
        """The named arrays of the fleet as lists, slot by slot."""
        return zip(*(self.fleet[name].tolist() for name in names), strict=True)


def _check(log: pd.DataFrame, scenario: Scenario) -> None:
    for edge in ("mission_start", "mission_end"):
        rows = log[log["event"] == edge]
        for what, count in (("uav", scenario.uavs), ("node", len(scenario.nodes))):
            found = sorted(rows.loc[rows[what] >= 0, what])
            if found != list(range(count)):
                raise InputError(
                    f"events: {edge} has {len(found)} rows of a {what}; "
                    f"allowed: one for each of the scenario's {count}"
                )


@dataclass
class _Moving:
    """A trace that changes: what stays, and what the frame of each slot sets."""

    style: Json
    frames: list[Json]


def _figure(mission: _Mission) -> Json:
    """The figure as plotly's JSON."""
    still = [_rings(mission), *_battery(mission), *_residual(mission), *_charging(mission)]
    moving = [
        *_trails(mission),
        *_links(mission),
        _nodes(mission),
        *_squares(mission),
        _uavs(mission),
        _status(mission),
        *_cursors(mission),
        _levels(mission),
    ]
    numbers = list(range(len(still), len(still) + len(moving)))
    return {
        "data": still + [_merged(trace.style, trace.frames[0]) for trace in moving],
        "frames": [
            {"name": str(t), "data": [trace.frames[t] for trace in moving], "traces": numbers}
            for t in range(mission.end + 1)
        ],
        "layout": _layout(mission),
    }


def _merged(style: Json, change: Json) -> Json:
    nested = {k: _merged(style.get(k, {}), v) for k, v in change.items() if isinstance(v, dict)}
    return {**style, **change, **nested}


def _rounded(values: pd.Series | np.ndarray) -> list[float]:
    return np.round(np.maximum(values, 0.0), 2).tolist()  # what is left may be -1e-16


# The map


def _discs(mission: _Mission, sizes: list[float], **marker: Any) -> Json:
    """A disc per node; its area is its size [data units]."""
    nodes, most = mission.scenario.nodes, max(float(mission.residual.max(axis=None)), 1e-9)
    area = {"sizemode": "area", "sizeref": 2 * most / NODE_SIZE**2, "opacity": 1}
    return {
        "x": [x for x, _ in nodes],
        "y": [y for _, y in nodes],
        "mode": "markers",
        "marker": {"size": sizes, **area, **marker},
    }


def _rings(mission: _Mission) -> Json:
    ring = {"width": 1.5, "color": mission.node_colours}
    discs = _discs(mission, _rounded(mission.residual.max()), color="white", line=ring)
    return {**discs, "name": "rings", "hoverinfo": "skip"}


def _nodes(mission: _Mission) -> _Moving:
    """Discs as large as the residual data."""
    style = {
        **_discs(mission, [], color=mission.node_colours, line={"width": 0}),
        "name": "nodes",
        "hovertemplate": "node %{pointNumber}: %{marker.size:.1f} data units<extra></extra>",
    }
    residual = mission.residual.to_numpy()
    return _Moving(style, [{"marker": {"size": _rounded(row)}} for row in residual])


def _trails(mission: _Mission) -> Iterator[_Moving]:
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
        yield _Moving(style, [{"x": x[t], "y": y[t]} for t in times])


def _links(mission: _Mission) -> Iterator[_Moving]:
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
        yield _Moving(style, frames)


def _squares(mission: _Mission) -> Iterator[_Moving]:
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
        yield _Moving(style, frames)


def _uavs(mission: _Mission) -> _Moving:
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
    return _Moving(style, frames)


def _status(mission: _Mission) -> _Moving:
    """A line above the map: what is left, and the pads in use."""
    style = {
        **_panel(STATUS, "status"),
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
        pads = f"{sum(charging)} of {_counted(mission.pads, 'pad')} in use{queue}"
        frames.append({"text": [f"{data:.0f} data units left · {pads}"]})
    return _Moving(style, frames)


def _counted(count: int, what: str) -> str:
    return f"{count} {what}{'s' * (count != 1)}"


# The panels over time


def _panel(number: int, name: str) -> Json:
    return {"name": name, "xaxis": f"x{number}", "yaxis": f"y{number}", "hoverinfo": "skip"}


def _ranges(mission: _Mission) -> dict[int, list[float]]:
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


def _battery(mission: _Mission) -> Iterator[Json]:
    for uav, own in mission.levels.groupby("uav"):
        yield {
            **_panel(2, f"battery {uav + 1}"),
            "x": own["time"].tolist(),
            "y": own["battery"].tolist(),
            "mode": "lines",
            "line": {"color": mission.uav_colours[uav], "width": 1.5},
        }


def _residual(mission: _Mission) -> Iterator[Json]:
    """A band per node, in its colour."""
    for node, colour in zip(mission.residual, mission.node_colours, strict=True):
        yield {
            **_panel(3, f"residual {node}"),
            "x": mission.residual.index.tolist(),
            "y": _rounded(mission.residual[node]),
            "mode": "none",
            "stackgroup": "nodes",
            "fillcolor": colour,
            "opacity": 0.75,
        }


def _charging(mission: _Mission) -> Iterator[Json]:
    """A row per UAV: a line while it is active, bars while it charges or waits."""
    for uav, own in mission.slots.groupby("uav"):
        colour = mission.uav_colours[uav]
        yield {
            **_panel(4, f"active {uav + 1}"),
            "x": [0, len(own)],
            "y": [uav + 1, uav + 1],
            "mode": "lines",
            "line": {"color": colour, "width": 1.5},
        }
        for state, fill in (("charging", colour), ("waiting", "white")):
            x, y = _bars(own.loc[own[state], "slot"], uav + 1)
            yield {
                **_panel(4, f"{state} {uav + 1}"),
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


def _cursors(mission: _Mission) -> Iterator[_Moving]:
    """An upright line through each panel at the time that is shown."""
    for panel, ends in _ranges(mission).items():
        style = {
            **_panel(panel, f"cursor {panel}"),
            "y": ends,
            "mode": "lines",
            "line": {"color": INK, "width": 1.2, "simplify": False},
        }
        yield _Moving(style, [{"x": [t, t]} for t in range(mission.end + 1)])


def _levels(mission: _Mission) -> _Moving:
    """Dots on the battery curves at the time that is shown."""
    style = {
        **_panel(2, "batteries"),
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
    return _Moving(style, [{"x": [t] * len(levels), "y": levels} for t, levels in rows])


# Around the traces


def _layout(mission: _Mission) -> Json:
    return {
        "font": {"family": FONT, "size": 12, "color": INK},
        "margin": {**MARGINS, "autoexpand": False},
        "plot_bgcolor": "white",
        "paper_bgcolor": "white",
        "showlegend": False,
        "hovermode": "closest",
        "dragmode": False,
        **_axes(mission),
        "shapes": _shapes(mission.scenario),
        "annotations": _annotations(mission),
        "updatemenus": [_buttons()],
        "sliders": [_slider(mission)],
    }


def _axes(mission: _Mission) -> Json:
    grid = [-0.5, mission.scenario.grid - 0.5]
    axes = {
        "xaxis": {
            **_axis(grid),
            "title": _title("x, east [cells]"),
            "constraintoward": "left",
        },
        "yaxis": {
            **_axis(grid[::-1]),
            "title": _title("y, south [cells]"),
            "scaleanchor": "x",
            "constraintoward": "top",
        },
    }
    for panel, span in _ranges(mission).items():
        axes[f"xaxis{panel}"] = {
            **_axis([0, mission.end]),
            "anchor": f"y{panel}",
            "showticklabels": panel == PANELS[-1],
        }
        axes[f"yaxis{panel}"] = {
            **_axis(span),
            "anchor": f"x{panel}",
            "showgrid": panel != PANELS[-1],
            "nticks": 5,
        }
    axes[f"xaxis{PANELS[-1]}"]["title"] = _title("time [mission slots]")
    rows = range(1, mission.scenario.uavs + 1)
    axes[f"yaxis{PANELS[-1]}"]["tickvals"] = list(rows[:: -(-len(rows) // 6)])
    hidden = {"range": [0, 1], "fixedrange": True, "visible": False}
    axes[f"xaxis{STATUS}"] = {**hidden, "anchor": f"y{STATUS}"}
    axes[f"yaxis{STATUS}"] = {**hidden, "range": [-1, 1], "anchor": f"x{STATUS}"}
    return axes


def _axis(span: list[float]) -> Json:
    return {
        "range": span,
        "fixedrange": True,
        "constrain": "domain",
        "showgrid": False,
        "gridcolor": GRID,
        "zeroline": False,
        "showline": True,
        "linecolor": MUTED,
        "ticks": "outside",
        "ticklen": 3,
        "tickcolor": MUTED,
        "tickfont": {"size": 11},
    }


def _title(text: str) -> Json:
    return {"text": text, "standoff": 4, "font": {"size": 12}}


def _shapes(scenario: Scenario) -> list[Json]:
    """The sea and its charging zone; the thresholds of charging."""
    x, y, width, height = scenario.zone
    boxes = (
        (0, 0, scenario.grid, scenario.grid, SEA, MUTED),
        (x, y, width, height, ZONE, EDGE),
    )
    shapes = [
        {"type": "rect", "layer": "below", "fillcolor": fill, "line": {"color": edge, "width": 1},
         "x0": x - 0.5, "x1": x + width - 0.5, "y0": y - 0.5, "y1": y + height - 0.5}
        for x, y, width, height, fill, edge in boxes
    ]  # fmt: skip
    for level in (scenario.charge_start, scenario.charge_complete):
        ends = {"x0": 0, "x1": 1, "xref": "x2 domain", "y0": level, "y1": level, "yref": "y2"}
        shapes.append({"type": "line", "line": {"color": MUTED, "width": 1}, **ends})
    return shapes


def _annotations(mission: _Mission) -> list[Json]:
    """The titles of the panels, the thresholds of charging, and how each UAV ended."""
    scenario, queue = (
        mission.scenario,
        "; hollow: waiting" if mission.fleet["waiting"].any() else "",
    )
    titles = (
        "Battery [%]",
        "Residual data [data units], a band per node",
        f"Charging, {_counted(mission.pads, 'pad')}{queue}",
    )
    notes = (
        (f"C<sub>S</sub> {scenario.charge_start}", scenario.charge_start),
        (f"C<sub>C</sub> {scenario.charge_complete}", scenario.charge_complete),
    )
    ends = mission.slots.groupby("uav")["slot"].max() + 1
    return [
        *[
            _note(
                f"<b>{text}</b>",
                0,
                f"x{n} domain",
                1,
                f"y{n} domain",
                yanchor="bottom",
                font={"size": 12.5},
            )
            for n, text in zip(PANELS, titles, strict=True)
        ],
        *[_note(text, 1, "x2 domain", level, "y2") for text, level in notes],
        *[
            _note("✓" if filled else "✕", int(end), "x4", uav + 1, "y4")
            for (uav, end), filled in zip(ends.items(), mission.filled, strict=True)
        ],
    ]


def _note(text: str, x: float, xref: str, y: float, yref: str, **other: Any) -> Json:
    """A text right of a point."""
    place = {"x": x, "xref": xref, "y": y, "yref": yref, "xanchor": "left", "yanchor": "middle"}
    return {**place, "text": text, "showarrow": False, "font": {"size": 11.5}, **other}


# The controls, and where everything stands


def _animate(seconds: float) -> Json:
    """Options of ``Plotly.animate``: how long a slot lasts."""
    duration = round(1000 * seconds)
    return {
        "mode": "immediate",
        "fromcurrent": True,
        "frame": {"duration": duration, "redraw": False},
        "transition": {"duration": duration, "easing": "linear"},
    }


def _buttons() -> Json:
    plays = [
        {"label": label, "method": "animate", "args": [None, _animate(seconds)]}
        for label, seconds in SECONDS_PER_SLOT.items()
    ]
    pause = {"label": "Pause", "method": "animate", "args": [[None], _animate(0)]}
    return {
        "type": "buttons",
        "direction": "right",
        "showactive": False,
        "xanchor": "left",
        "yanchor": "top",
        "pad": {"t": 0, "l": 0, "r": 0, "b": 0},
        "bgcolor": "white",
        "bordercolor": MUTED,
        "font": {"size": 14},
        "buttons": [*plays, pause],
    }


def _slider(mission: _Mission) -> Json:
    steps = [
        {"label": str(t), "method": "animate", "args": [[str(t)], _animate(0)]}
        for t in range(mission.end + 1)
    ]
    font = {"size": 15, "color": INK}
    shown = {"xanchor": "right", "prefix": "slot ", "offset": 16, "font": font}
    return {
        "steps": steps,
        "currentvalue": shown,
        "xanchor": "left",
        "yanchor": "top",
        "pad": {"t": 4, "l": 0, "r": 0, "b": 0},
        "font": {"size": 11},
        "bgcolor": "white",
        "activebgcolor": GRID,
        "bordercolor": MUTED,
        "ticklen": 0,
        "minorticklen": 0,
        "transition": {"duration": 0},
    }


def _arrangement(height: int, boxes: Mapping[str, tuple[float, float, int, int]]) -> Json:
    """The height of the whole plot [px] and what to hand to ``Plotly.relayout``.

    Args:
        height: Of the plot without its margins [px].
        boxes: Of each axis, and of the controls: left and right end [share of the width], top and
            bottom end [px from the top].
    """
    change: Json = {"autosize": True}
    for name, (left, right, top, bottom) in boxes.items():
        if name == "controls":
            for control in ("updatemenus[0]", "sliders[0]"):
                change |= {f"{control}.x": left, f"{control}.y": 1 - top / height}
            change["sliders[0].len"] = right - left
        else:
            change[f"xaxis{name}.domain"] = [left, right]
            change[f"yaxis{name}.domain"] = [1 - bottom / height, 1 - top / height]
    return {"height": height + MARGINS["t"] + MARGINS["b"], "change": change}


def _arranging() -> str:
    """The script that puts the curves beside the map where there is room, else below."""
    narrow = {"5": (0, 1, 0, 18), "": (0, 1, 24, 312), "controls": (0, 1, 354, 440),
              "2": (0, 1, 470, 574), "3": (0, 1, 608, 712), "4": (0, 1, 746, 824)}  # fmt: skip
    wide = {"5": (0, 0.52, 0, 18), "": (0, 0.52, 24, 584), "controls": (0.58, 1, 492, 584),
            "2": (0.58, 1, 24, 154), "3": (0.58, 1, 190, 320),
            "4": (0.58, 1, 356, 434)}  # fmt: skip
    layouts = {"narrow": _arrangement(824, narrow), "wide": _arrangement(584, wide)}
    return f"""
        const plot = document.getElementById("{{plot_id}}"), layouts = {json.dumps(layouts)};
        let shown;
        function arrange() {{
            const fits = layouts[plot.clientWidth < {WIDE} ? "narrow" : "wide"];
            if (fits === shown) return;
            shown = fits;
            plot.style.height = fits.height + "px";
            Plotly.relayout(plot, fits.change);
        }}
        arrange();
        window.addEventListener("resize", arrange);
    """
