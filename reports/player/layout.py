"""What stands around the traces of a player: axes, notes, and where all of it is."""

import json
from collections.abc import Mapping
from typing import Any

from analysis.figures.style import INK, MUTED, SEA, ZONE
from dess.scenario import Scenario
from reports.player.chart import EDGE, STATUS, counted
from reports.player.controls import GRID, buttons, slider
from reports.player.mission import Mission
from reports.player.panels import PANELS, ranges
from reports.player.trace import Json

WIDE = 720  # width [px] from which on the curves stand beside the map, not below it
MARGINS = {"l": 44, "r": 38, "t": 6, "b": 40}
FONT = 'system-ui, -apple-system, "Segoe UI", Roboto, "Liberation Sans", Arial, sans-serif'


def layout(mission: Mission) -> Json:
    """All but the traces and the frames."""
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
        "updatemenus": [buttons()],
        "sliders": [slider(mission)],
    }


def _axes(mission: Mission) -> Json:
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
    for panel, span in ranges(mission).items():
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


def _annotations(mission: Mission) -> list[Json]:
    """The titles of the panels, the thresholds of charging, and how each UAV ended."""
    scenario, queue = (
        mission.scenario,
        "; hollow: waiting" if mission.fleet["waiting"].any() else "",
    )
    titles = (
        "Battery [%]",
        "Residual data [data units], a band per node",
        f"Charging, {counted(mission.pads, 'pad')}{queue}",
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


def arranging() -> str:
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
