"""The layout of a player: its panels and their notes; the rest is ``templates/player.json``."""

import json
from typing import Any, TypeAlias

from jinja2 import Environment, PackageLoader, StrictUndefined

from analysis.figures import style
from analysis.figures.style import MUTED, SEA, ZONE, ZONE_EDGE
from dess.scenario import Scenario
from reports.player.playback import Playback
from reports.player.scene import (
    AGE,
    BATTERY,
    CHARGING,
    NODE_AGES,
    RESIDUAL,
    STATUS,
    Json,
    counted,
    ranges,
)

WIDE = 720  # width [px] from which the curves are beside the map, and not below it
MARGINS = 6, 40  # above and below [px]
# Of each panel and of the controls: the gap above it and its height [px].
_SIZES = {
    str(STATUS): (0, 18),
    "": (6, 288),
    "controls": (50, 90),
    str(NODE_AGES): (56, 76),
    str(BATTERY): (24, 118),
    str(RESIDUAL): (36, 118),
    str(AGE): (36, 118),
    str(CHARGING): (36, 78),
}
_TEMPLATES = Environment(
    loader=PackageLoader("reports", "templates"), undefined=StrictUndefined, trim_blocks=True
)
Boxes: TypeAlias = dict[str, tuple[float, float, int, int]]


def layout(playback: Playback) -> Json:
    """The plotly layout: everything except the traces and the frames."""
    fixed = _TEMPLATES.get_template("player.json").render(
        style=style, margins=MARGINS, end=playback.end
    )
    return {
        **json.loads(fixed),
        **_axes(playback),
        "shapes": _shapes(playback.scenario),
        "annotations": _annotations(playback),
    }


def _boxes(playback: Playback, wide: bool) -> tuple[int, Boxes]:
    """Where the panels are: beside the map if there is room, and otherwise below it.

    Returns:
        The height of all [px], and for each panel its left and right end [share of the width] and
        its top and bottom end [px].
    """
    of_nodes = [str(NODE_AGES)] if playback.measures_age else []
    over_time = [str(panel) for panel in ranges(playback)]
    narrow = [((0.0, 1.0), [str(STATUS), "", "controls", *of_nodes, *over_time])]
    columns = [
        ((0.0, 0.52), [str(STATUS), "", *of_nodes]),
        ((0.58, 1.0), [*over_time, "controls"]),
    ]
    places: Boxes = {}
    for (left, right), names in columns if wide else narrow:
        bottom = 0
        for name in names:
            gap, height = _SIZES[name]
            top, bottom = bottom + gap, bottom + gap + height * (1 + (wide and not name))
            places[name] = (left, right, top, bottom)
    return max(bottom for *_, bottom in places.values()), places


def arranging(playback: Playback) -> str:
    """The script that puts the curves beside the map if there is room, and otherwise below."""
    layouts = {
        "narrow": _arrangement(*_boxes(playback, wide=False)),
        "wide": _arrangement(*_boxes(playback, wide=True)),
    }
    return _TEMPLATES.get_template("player.js").render(layouts=layouts, wide=WIDE)


def _arrangement(height: int, places: Boxes) -> Json:
    """The height of the whole plot [px] and the arguments of ``Plotly.relayout``."""
    left, right, top, _ = places.pop("controls")
    change: Json = {"autosize": True, "sliders[0].len": right - left}
    for control in ("updatemenus[0]", "sliders[0]"):
        change |= {f"{control}.x": left, f"{control}.y": 1 - top / height}
    for name, (left, right, top, bottom) in places.items():
        change[f"xaxis{name}.domain"] = [left, right]
        change[f"yaxis{name}.domain"] = [1 - bottom / height, 1 - top / height]
    return {"height": height + sum(MARGINS), "change": change}


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
        most, nodes = round(1.05 * float(playback.ages.max(axis=None)), 2), len(playback.ages.T)
        x = {"range": [-0.7, nodes - 0.3], "anchor": f"y{NODE_AGES}", "title": {"text": "node"}}
        y = {"range": [0, most], "anchor": f"x{NODE_AGES}", "showgrid": True, "nticks": 4}
        axes |= {f"xaxis{NODE_AGES}": x, f"yaxis{NODE_AGES}": y}
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
        titles |= {AGE: "Mean age of the nodes [slots]", NODE_AGES: "Age of each node [slots]"}
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


def _note(text: str, x: tuple[float, str], y: tuple[float, str], **look: Any) -> Json:
    """A text to the right of a point, which is given by coordinates and their axes."""
    return {"text": text, "x": x[0], "xref": x[1], "y": y[0], "yref": y[1], **look}
