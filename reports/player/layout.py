"""The layout of a player: axes, notes, controls, and where each of them is on the page."""

import json
from typing import Any, TypeAlias

from analysis.figures.style import GRID, INK, MUTED, SEA, ZONE, ZONE_EDGE
from dess.scenario import Scenario
from reports.player import ages
from reports.player.mission_map import STATUS, counted
from reports.player.panels import BATTERY, CHARGING, RESIDUAL, ranges
from reports.player.playback import Playback
from reports.player.trace import Json

WIDE = 720  # width [px] from which the curves are beside the map, and not below it
MARGINS = {"l": 44, "r": 38, "t": 6, "b": 40}
FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", Arial, sans-serif'
SECONDS_PER_SLOT = {"Play": 0.3, "Fast": 0.1}

# Defaults of all axes, notes, controls and traces.
_AXIS = {
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
    "title": {"standoff": 4, "font": {"size": 12}},
}
_NOTE = {"xanchor": "left", "yanchor": "middle", "showarrow": False, "font": {"size": 11.5}}
_CONTROL = {"xanchor": "left", "yanchor": "top", "bgcolor": "white", "bordercolor": MUTED}
_TEMPLATE = {
    "data": {"scatter": [{"hoverinfo": "skip"}]},
    "layout": {
        "font": {"family": FONT, "size": 12, "color": INK},
        "margin": {**MARGINS, "autoexpand": False},
        "plot_bgcolor": "white",
        "paper_bgcolor": "white",
        "xaxis": _AXIS,
        "yaxis": _AXIS,
        "annotationdefaults": _NOTE,
    },
}

# Left and right end [share of the width], top and bottom end [px] of the axes of each panel and of
# the controls, in a plot of that height [px] without its margins.
_Boxes: TypeAlias = dict[str, tuple[float, float, int, int]]
_NARROW: tuple[int, _Boxes] = 824, {
    "5": (0, 1, 0, 18), "": (0, 1, 24, 312), "controls": (0, 1, 354, 440),
    "2": (0, 1, 470, 574), "3": (0, 1, 608, 712), "4": (0, 1, 746, 824),
}  # fmt: skip
_WIDE: tuple[int, _Boxes] = 584, {
    "5": (0, 0.52, 0, 18), "": (0, 0.52, 24, 584), "controls": (0.58, 1, 492, 584),
    "2": (0.58, 1, 24, 154), "3": (0.58, 1, 190, 320), "4": (0.58, 1, 356, 434),
}  # fmt: skip
# The same for a player that shows ages.
_NARROW_AGES: tuple[int, _Boxes] = 1092, {
    "5": (0, 1, 0, 18), "": (0, 1, 24, 312), "controls": (0, 1, 354, 440), "7": (0, 1, 470, 540),
    "2": (0, 1, 608, 698), "3": (0, 1, 736, 840), "6": (0, 1, 874, 978), "4": (0, 1, 1014, 1092),
}  # fmt: skip
_WIDE_AGES: tuple[int, _Boxes] = 720, {
    "5": (0, 0.52, 0, 18), "": (0, 0.52, 24, 584), "7": (0, 0.52, 640, 720),
    "2": (0.58, 1, 24, 144), "3": (0.58, 1, 180, 300), "6": (0.58, 1, 336, 456),
    "4": (0.58, 1, 492, 570), "controls": (0.58, 1, 628, 720),
}  # fmt: skip


def layout(playback: Playback) -> Json:
    """The plotly layout: everything except the traces and the frames."""
    return {
        "template": _TEMPLATE,
        "showlegend": False,
        "hovermode": "closest",
        "dragmode": False,
        **_axes(playback),
        "shapes": _shapes(playback.scenario),
        "annotations": _annotations(playback),
        "updatemenus": [_buttons()],
        "sliders": [_slider(playback.end)],
    }


def arranging(playback: Playback) -> str:
    """The script that puts the curves beside the map if there is room, and otherwise below."""
    narrow, wide = (_NARROW_AGES, _WIDE_AGES) if playback.measures_age else (_NARROW, _WIDE)
    layouts = {"narrow": _arrangement(*narrow), "wide": _arrangement(*wide)}
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


def _arrangement(height: int, boxes: _Boxes) -> Json:
    """The height of the whole plot [px] and the arguments of ``Plotly.relayout``."""
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


def _axes(playback: Playback) -> Json:
    grid = [-0.5, playback.scenario.grid - 0.5]
    hidden = {"range": [-1, 1], "visible": False}
    axes: Json = {
        "xaxis": {"range": grid, "title": {"text": "x, east [cells]"}, "constraintoward": "left"},
        "yaxis": {"range": grid[::-1], "title": {"text": "y, south [cells]"},
                  "scaleanchor": "x", "constraintoward": "top"},
        f"xaxis{STATUS}": {**hidden, "range": [0, 1], "anchor": f"y{STATUS}"},
        f"yaxis{STATUS}": {**hidden, "anchor": f"x{STATUS}"},
    }  # fmt: skip
    for panel, ends in ranges(playback).items():
        x = {"range": [0, playback.end], "anchor": f"y{panel}", "showticklabels": panel == CHARGING}
        y = {"range": ends, "anchor": f"x{panel}", "showgrid": panel != CHARGING, "nticks": 5}
        axes |= {f"xaxis{panel}": x, f"yaxis{panel}": y}
    if playback.measures_age:
        axes |= ages.axes(playback)
    uavs = playback.scenario.uavs
    axes[f"xaxis{CHARGING}"]["title"] = {"text": "time [mission slots]"}
    axes[f"yaxis{CHARGING}"]["tickvals"] = list(range(1, uavs + 1, -(-uavs // 6)))
    return axes


def _shapes(scenario: Scenario) -> list[Json]:
    """The map and its charging zone; the thresholds of charging."""
    shapes: list[Json] = [
        {"type": "rect", "layer": "below", "fillcolor": fill, "line": {"color": edge, "width": 1},
         "x0": x - 0.5, "x1": x + width - 0.5, "y0": y - 0.5, "y1": y + height - 0.5}
        for (x, y, width, height), fill, edge in (
            ((0, 0, scenario.grid, scenario.grid), SEA, MUTED),
            (scenario.zone, ZONE, ZONE_EDGE),
        )
    ]  # fmt: skip
    for level in (scenario.charge_start, scenario.charge_complete):
        ends = {"x0": 0, "x1": 1, "xref": "x2 domain", "y0": level, "y1": level, "yref": "y2"}
        shapes.append({"type": "line", "line": {"color": MUTED, "width": 1}, **ends})
    return shapes


def _annotations(playback: Playback) -> list[Json]:
    """The titles of the panels, the thresholds of charging, and how each UAV ended."""
    scenario = playback.scenario
    queue = "; hollow: waiting" if playback.fleet["waiting"].any() else ""
    titles = {
        BATTERY: "Battery [%]",
        RESIDUAL: "Residual data [data units], a band per node",
        CHARGING: f"Charging, {counted(playback.pads, 'pad')}{queue}",
    }
    if playback.measures_age:
        titles |= ages.TITLES
    heading = {"yanchor": "bottom", "font": {"size": 12.5}}
    notes = [
        _note(f"<b>{title}</b>", (0, f"x{n} domain"), (1, f"y{n} domain"), **heading)
        for n, title in titles.items()
    ]
    levels = {"S": scenario.charge_start, "C": scenario.charge_complete}
    for index, level in levels.items():
        text = f"C<sub>{index}</sub> {level}"
        notes.append(_note(text, (1, f"x{BATTERY} domain"), (level, f"y{BATTERY}")))
    ends = playback.slots.groupby("uav")["slot"].max() + 1
    for (uav, end), filled in zip(ends.items(), playback.filled, strict=True):
        mark = "✓" if filled else "✕"
        notes.append(_note(mark, (int(end), f"x{CHARGING}"), (uav + 1, f"y{CHARGING}")))
    return notes


def _note(text: str, x: tuple[float, str], y: tuple[float, str], **style: Any) -> Json:
    """A text to the right of a point, which is given by coordinates and their axes."""
    return {"text": text, "x": x[0], "xref": x[1], "y": y[0], "yref": y[1], **style}


def _animate(seconds: float) -> Json:
    """The options of ``Plotly.animate`` for a duration of a slot [s]."""
    duration = round(1000 * seconds)
    return {
        "mode": "immediate",
        "fromcurrent": True,
        "frame": {"duration": duration, "redraw": False},
        "transition": {"duration": duration, "easing": "linear"},
    }


def _buttons() -> Json:
    """The buttons: play slowly, play fast, and pause."""
    calls: Json = {label: [None, _animate(seconds)] for label, seconds in SECONDS_PER_SLOT.items()}
    calls["Pause"] = [[None], _animate(0)]
    return {
        **_CONTROL,
        "type": "buttons",
        "direction": "right",
        "showactive": False,
        "pad": {"t": 0, "l": 0, "r": 0, "b": 0},
        "font": {"size": 14},
        "buttons": [{"label": k, "method": "animate", "args": args} for k, args in calls.items()],
    }


def _slider(end: int) -> Json:
    """The slider, with a step per mission slot."""
    shown = {"size": 15, "color": INK}
    return {
        **_CONTROL,
        "steps": [
            {"label": str(t), "method": "animate", "args": [[str(t)], _animate(0)]}
            for t in range(end + 1)
        ],
        "currentvalue": {"xanchor": "right", "prefix": "slot ", "offset": 16, "font": shown},
        "pad": {"t": 4, "l": 0, "r": 0, "b": 0},
        "font": {"size": 11},
        "activebgcolor": GRID,
        "ticklen": 0,
        "minorticklen": 0,
        "transition": {"duration": 0},
    }
