"""Figures of one mission: its map, batteries, residual data, age, charging zone; mean courses.

Each function of a panel takes the event log of the mission (a data frame, or the columns, of
``dess.model.events.EventLog``), its ``dess.Scenario`` and the axes to draw on; ``mission_figure``
puts them together. Nothing touches pyplot's state.
"""

from collections.abc import Callable, Mapping, Sequence
from textwrap import fill

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.collections import PolyCollection
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle
from matplotlib.ticker import MaxNLocator

from dess.analysis.figures import style
from dess.analysis.metrics import DRAWN_UNITS, size_of
from dess.analysis.names import value_text
from dess.analysis.numbers import format_quantity
from dess.analysis.results import event_log
from dess.scenario.scenario import Scenario, ScenarioSpace

# Width [cells] over which UAVs on the same path are drawn side by side.
SPREAD = 0.4
# The size of the names of nodes, the radius of nodes, and about the width of a map [points].
NAME_SIZE, NODE_RADIUS, MAP_WIDTH = 10.0, 5.5, 340.0
_ARROW: dict = {
    "angles": "xy",
    "scale_units": "xy",
    "units": "xy",
    "scale": 1,
    "width": 0.15,
    "headwidth": 3.8,
    "headlength": 3.4,
    "headaxislength": 3.2,
}


def plot_trajectories(events: event_log.Events, scenario: Scenario, ax: Axes) -> None:
    """The map of a mission, with the legend of the paper's Table I.

    An arrow is a move and a cross a slot in which the UAV hovers; both have the colour of the node
    that is served in most of the slot's communication slots, or grey if none is served. A star is
    a slot in which the UAV charges. UAVs are numbered at their start (diamond) and end (dot), and
    drawn side by side where they share a path.
    """
    # The last is that of node -1, which is none.
    colours = np.array([*style.node_colours(len(scenario.nodes)), style.MUTED])
    offsets = style.side_by_side_shifts(scenario.uavs, SPREAD / 2)
    _plot_grid(scenario, ax)
    for uav, slots in event_log.uav_slots(events).groupby("uav"):
        colour = style.uav_colours(scenario.uavs)[uav]
        ways = slots[["from_x", "from_y", "x", "y"]] + offsets[uav]
        start, end = ways.iloc[0, :2], ways.iloc[-1, 2:]
        ax.plot([start["from_x"], *ways["x"]], [start["from_y"], *ways["y"]], color=colour,
                alpha=0.16, linewidth=4.5, solid_joinstyle="round", zorder=2)  # fmt: skip
        x, y, to_x, to_y = ways[slots["moved"]].to_numpy().T
        steps = np.round([to_x - x, to_y - y])  # one cell, without the shift of paths
        ax.quiver(x, y, *steps, color=colours[slots.loc[slots["moved"], "node"]], zorder=4,
                  gid=f"moves-{uav}", **_ARROW)  # fmt: skip
        hovers = ~slots["moved"] & ~slots["charging"]
        charges = ways[slots["charging"]]
        ax.scatter(ways["x"][hovers], ways["y"][hovers], c=colours[slots["node"][hovers]],
                   marker="x", s=34, linewidths=1.7, zorder=5, gid=f"hovers-{uav}")  # fmt: skip
        ax.scatter(charges["x"], charges["y"], color=style.INK, marker=(8, 2, 0), s=70,
                   linewidths=1.1, zorder=6, gid=f"charges-{uav}")  # fmt: skip
        for spot, marker, face, text, name in (
            (start, "D", "white", colour, "start"),
            (end, "o", colour, "white", "end"),
        ):
            x, y = spot
            ax.scatter(x, y, marker=marker, s=130, facecolor=face, edgecolor=colour, linewidth=1.6,
                        zorder=8, gid=f"{name}-{uav}")  # fmt: skip
            ax.annotate(str(uav + 1), (x, y), ha="center", va="center", fontsize=9,
                        color=text, fontweight="bold", zorder=9)  # fmt: skip


_CORNERS = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])  # of a cell


def plot_chart(scenario: Scenario | ScenarioSpace, ax: Axes) -> None:
    """The grid with its zones and no-fly cells, without nodes; y grows south."""
    columns, rows = scenario.size
    ax.set_facecolor(style.SEA)
    ax.grid(False)
    if scenario.no_fly:  # as one artist: a patch for each cell would take seconds
        squares = np.array(scenario.no_fly)[:, None] + _CORNERS
        land = PolyCollection(squares, facecolor=style.LAND, edgecolor=style.LAND, zorder=1)
        ax.add_collection(land, autolim=False)
    for x, y, width, height in scenario.rectangles:
        ax.add_patch(Rectangle((x - 0.5, y - 0.5), width, height, facecolor=style.ZONE,
                               edgecolor=style.ZONE_EDGE, zorder=1))  # fmt: skip
    ax.set(aspect="equal", xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5))
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    ax.set_ylabel(f"y, south [{_unit_of_axis(ax.yaxis, 'length', 'cells', scenario)}]")
    cells = f"cells of {scenario.cell_size:g} m"
    ax.set_xlabel(f"x, east [{_unit_of_axis(ax.xaxis, 'length', cells, scenario)}]")


def plot_battery(events: event_log.Events, scenario: Scenario, ax: Axes) -> None:
    """Battery [%] of every UAV over time, with the thresholds C_S and C_C of charging."""
    levels = event_log.battery_levels(events)
    for uav, curve in levels.groupby("uav"):
        if scenario.uavs <= 3:
            name = f"UAV {uav + 1}"
        else:
            name = f"{uav + 1}"
        ax.plot(curve["time"], curve["battery"], label=name, linewidth=1.6,
                color=style.uav_colours(scenario.uavs)[uav],
                linestyle=style.LINES[uav % len(style.LINES)])  # fmt: skip
    for level, name in ((scenario.charge_start, "$C_S$"), (scenario.charge_complete, "$C_C$")):
        ax.axhline(level, color=style.MUTED, linewidth=0.9, zorder=1)
        _margin_note(f"{name} {level}", level, ax)
    ax.set(title="Battery", ylabel="battery [%]", ylim=(0, 103))
    if scenario.uavs <= 6:  # more do not fit beside the title
        ax.legend(loc="lower right", bbox_to_anchor=(1.02, 0.97), ncols=6, handlelength=2.2,
                  handletextpad=0.5, columnspacing=1.1)  # fmt: skip
    _time_axis(events, scenario, ax)


def plot_residual(events: event_log.Events, scenario: Scenario, ax: Axes) -> None:
    """Residual data [data units] over time: one band per node, in its colour, and their sum."""
    data = event_log.residual_data(events)
    colours = style.node_colours(len(scenario.nodes))
    ax.stackplot(data.index, data.to_numpy().T, colors=colours, alpha=0.75, linewidth=0)
    total = data.sum(axis=1)
    ax.plot(total.index, total, color=style.INK, linewidth=1.6, label="all nodes")
    left = f"{total.iloc[-1]:.0f}"
    if scenario.units:
        left = format_quantity(total.iloc[-1] * size_of(DRAWN_UNITS["data"], scenario.units))
    _margin_note(f"{left} left", total.iloc[-1], ax)
    ax.set(title="Residual data, a band per node", ylim=(0, None))
    ax.set_ylabel(_unit_of_axis(ax.yaxis, "data", "data units", scenario, 5))
    _time_axis(events, scenario, ax)


def plot_age(events: event_log.Events, scenario: Scenario, ax: Axes) -> None:
    """The mean age of information of all nodes [slots] over time."""
    curve = event_log.mean_age(events)
    ax.plot(curve["time"], curve["age"], color=style.INK, linewidth=1.2, gid="age")
    ax.set(title="Mean age of the nodes", ylim=(0, None))
    ax.set_ylabel(_unit_of_axis(ax.yaxis, "time", "slots", scenario, 5))
    _time_axis(events, scenario, ax)


def plot_occupancy(events: event_log.Events, scenario: Scenario, ax: Axes) -> None:
    """The UAVs that charge (stacked, in their colours) and that wait for a pad, over time."""
    slots = event_log.uav_slots(events)
    edges = np.arange(event_log.mission_length(events) + 1)
    base = np.zeros(len(edges))
    colours = style.uav_colours(scenario.uavs)
    for state, hatch in (("charging", None), ("waiting", "/////")):
        for uav, busy in slots[slots[state]].groupby("uav"):
            top = base + np.isin(edges, busy["slot"])
            ax.fill_between(edges, base, top, step="post", edgecolor=colours[uav], hatch=hatch,
                            facecolor="none" if hatch else colours[uav], linewidth=0,
                            alpha=0.85)  # fmt: skip
            base = top
    ax.step(edges, base, where="post", color=style.INK, linewidth=1, gid="occupancy")
    pads = scenario.charging_pads
    if pads <= scenario.uavs:
        ax.axhline(pads, color=style.MUTED, linewidth=0.9)
    hatched = ""
    if slots["waiting"].any():
        hatched = "; hatched: waiting"
    ax.set(title=f"Charging zone, {pads} pad{'s' if pads > 1 else ''}{hatched}", ylabel="UAVs")
    ax.set_ylim(0, scenario.uavs + 0.3)
    ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=4))
    _time_axis(events, scenario, ax)


def curves_of_mission(
    scenario: Scenario,
) -> dict[Callable[[event_log.Events, Scenario, Axes], None], float]:
    """The figures over the time of a mission, from top to bottom, and their heights [inches]."""
    ages = {}
    if scenario.age.measured:
        ages = {plot_age: 1.6}
    return {plot_battery: 1.6, plot_residual: 1.6, **ages, plot_occupancy: 1.1}


def mission_figure(events: event_log.Events, scenario: Scenario) -> Figure:
    """A mission: its map, and below it its curves over time."""
    panels = curves_of_mission(scenario)
    with style.figure_look():
        figure = style.Picture(figsize=(5.6, 6.7 + sum(panels.values())), dpi=style.DPI)
        figure.set_layout_engine("constrained", rect=(0, 0, 0.94, 1))
        axes = figure.subplots(1 + len(panels), height_ratios=(5.6, *panels.values()))
        plot_trajectories(events, scenario, axes[0])
        axes[0].set_title(_outcome_in_words(events, scenario))
        _map_legend(axes[0])
        for panel, ax in zip(panels, axes[1:], strict=True):
            panel(events, scenario, ax)
            ax.set_xlabel("")
        _time_axis(events, scenario, axes[-1])
    return figure


def map_figure(events: event_log.Events, scenario: Scenario) -> Figure:
    """The map of a mission alone."""
    with style.figure_look():
        figure = style.Picture(figsize=(5.6, 6.4), dpi=style.DPI)
        figure.set_layout_engine("constrained", rect=(0, 0, 0.94, 1))
        ax = figure.subplots()
        plot_trajectories(events, scenario, ax)
        ax.set_title(_outcome_in_words(events, scenario))
        _map_legend(ax)
    return figure


def sea_figure(space: ScenarioSpace) -> Figure:
    """The map of a scenario: its sensor nodes, each in its colour, and its zone."""
    with style.figure_look():
        figure = style.Picture(figsize=(5.6, 5.6), dpi=style.DPI, layout="constrained")
        _plot_grid(space, figure.subplots())
    return figure


def plot_courses(
    rows: pd.DataFrame, line: str, unit: str, titles: Mapping[object, str], heading: str = ""
) -> Figure:
    """Means over the slots of the mission: a curve for each value of a column, with its band.

    Args:
        rows: Rows with ``panel``, ``slot``, ``mean``, ``low`` and ``high``.
        line: The column.
        unit: The unit of the means: ``%``, ``points``, or empty for plain numbers.
        titles: What the panels show, by ``panel``.
        heading: The title of the legend.
    """
    if line != "policy":
        values = sorted(rows[line].unique())
    else:
        values = rows[line].unique()
    if line == "policy":
        styles = style.policy_colours(values)
    else:
        styles = style.graded_colours(values)
    height = 1.9 * len(titles) + 1.3
    shape = {"sharex": True, "squeeze": False}
    with style.new_panels(height, len(titles), "y", 4, heading, **shape) as (figure, axes):
        for ax, (panel, title) in zip(axes.flat, titles.items(), strict=True):
            for value, course in rows[rows["panel"] == panel].groupby(line, sort=False):
                colour = styles[value_text(value)][0]
                ax.fill_between(course["slot"], course["low"], course["high"], step="post",
                                **style.band(colour))  # fmt: skip
                ax.plot(course["slot"], course["mean"], color=colour, label=value_text(value))
            ax.set(ylabel=fill(title, 24), ylim=(0, None), xlim=(0, rows["slot"].max()))
            style.set_axis_unit(ax.yaxis, unit, 4)
        axes.flat[-1].set_xlabel("mission slot")
    return figure


def _outcome_in_words(events: event_log.Events, scenario: Scenario) -> str:
    log = pd.DataFrame(events)
    data = log[log["node"] >= 0].groupby("event")["value"].sum()
    total = data["mission_start"] + data.get("arrival", 0.0)
    share = 1.0
    if total:
        share = data.get("communication", 0.0) / total
    if scenario.landing:
        event, what = ("landing", "landed")
    else:
        event, what = ("quota_filled", "quotas filled")
    count = (log["event"] == event).sum()
    return f"I = {scenario.uavs}: {share:.1%} collected, {count} of {scenario.uavs} {what}"


def _plot_grid(scenario: Scenario | ScenarioSpace, ax: Axes) -> None:
    """The grid, its zone and its nodes, with their names if they have some."""
    plot_chart(scenario, ax)
    nodes = np.array(scenario.nodes)
    ax.scatter(nodes[:, 0], nodes[:, 1], c=style.node_colours(len(nodes)), s=95,
               edgecolors="white", linewidths=1.2, zorder=3, gid="nodes")  # fmt: skip
    places = name_places(scenario.nodes, scenario.names, scenario.size)
    for node, name, (x, y) in zip(scenario.nodes, scenario.names, places, strict=False):
        ax.annotate(name, node, (x, y), textcoords="offset points", fontsize=NAME_SIZE, zorder=7,
                    color=style.INK, va="center", annotation_clip=True,
                    **style.OUTLINED)  # fmt: skip


def name_places(
    nodes: Sequence[tuple[int, int]], names: Sequence[str], size: tuple[int, int]
) -> list[tuple[float, float]]:
    """Where the names of nodes begin, so that they cover little of each other, nodes and edges.

    Args:
        nodes: The cells x, y of the nodes; y grows south.
        names: Their names.
        size: The columns and rows of the grid.

    Returns:
        For each name the place of the middle of its left end relative to its node [points, y up].
    """
    scale = MAP_WIDTH / max(size)
    centres = np.array(nodes) * (scale, -scale)
    discs = [_box_ends(x - NODE_RADIUS, y, 2 * NODE_RADIUS, 2 * NODE_RADIUS) for x, y in centres]
    map_box = np.array([-scale / 2, (0.5 - size[1]) * scale, (size[0] - 0.5) * scale, scale / 2])
    taken = [*discs]
    places = []
    for (x, y), name in zip(centres, names, strict=False):
        width = 0.62 * NAME_SIZE * len(name)
        beside = NODE_RADIUS + 1
        above = NODE_RADIUS + 0.55 * NAME_SIZE
        choices = [
            (beside, 0.0),
            (beside, above - 4),
            (-beside - width, 0.0),
            (-width / 2, above),
            (-width / 2, -above),
            (beside, 4 - above),
            (-beside - width, above - 4),
            (-beside - width, 4 - above),
        ]
        boxes = [_box_ends(x + dx, y + dy, width, 1.1 * NAME_SIZE) for dx, dy in choices]
        covered = [sum(_overlapping_area(box, other) for other in taken) for box in boxes]
        outside = [_area_of_box(box) - _overlapping_area(box, map_box) for box in boxes]
        best = int(np.argmin(np.add(covered, outside).round(6)))
        taken.append(boxes[best])
        places.append(choices[best])
    return places


def _box_ends(left: float, middle: float, width: float, height: float) -> np.ndarray:
    """The ends of a box: left, lower, right, upper."""
    return np.array([left, middle - height / 2, left + width, middle + height / 2])


def _area_of_box(box: np.ndarray) -> float:
    return float(np.prod(np.clip(box[2:] - box[:2], 0, None)))


def _overlapping_area(box: np.ndarray, other: np.ndarray) -> float:
    """The area that two boxes have in common."""
    return _area_of_box(np.r_[np.maximum(box[:2], other[:2]), np.minimum(box[2:], other[2:])])


@mpl.rc_context({"text.parse_math": True})  # an arrow is a symbol in TeX
def _map_legend(ax: Axes) -> None:
    """The symbols of the map (Table I)."""
    served = style.node_colours(2)[1]
    arrow = r"$\rightarrow$"
    marks = (
        ("s", "start and charging zone", style.ZONE_EDGE, style.ZONE, 9),
        ("o", "sensor node", style.INK, served, 8),
        ("D", "start of UAV", style.INK, "white", 7),
        ("o", "end of UAV", style.INK, style.INK, 7),
        (arrow, "move, serving that node", served, served, 13),
        ("x", "hover, serving that node", served, served, 7),
        ((8, 2, 0), "hover, charging", style.INK, style.INK, 8),
        (arrow, "no node served", style.MUTED, style.MUTED, 13),
    )
    handles = [
        Line2D([], [], linestyle="", marker=marker, label=label, color=edge, markerfacecolor=face,
               markersize=size)
        for marker, label, edge, face, size in marks
    ]  # fmt: skip
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.48, -0.1), ncols=3,
              handletextpad=0.4, columnspacing=1.0, fontsize=8.5)  # fmt: skip


def _margin_note(text: str, level: float, ax: Axes) -> None:
    """A note in the right margin, at a level of the y axis."""
    note = style.note_at_right(text, level, ax, 8.5)
    note.set_parse_math(True)
    note.set_in_layout(False)  # so that all maps of a gallery have the same size


def _time_axis(events: event_log.Events, scenario: Scenario, ax: Axes) -> None:
    ax.set(xlim=(0, event_log.mission_length(events)))
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    ax.set_xlabel(f"time [{_unit_of_axis(ax.xaxis, 'time', 'mission slots', scenario)}]")
    style.grid_of("y", ax)


def _unit_of_axis(
    axis: Axis, quantity: str, of_model: str, scenario: Scenario | ScenarioSpace, nbins: int = 8
) -> str:
    """The unit of an axis of lengths, times or data; with a data sheet, its ticks are in it."""
    if not scenario.units:
        return of_model
    unit = DRAWN_UNITS[quantity]
    style.set_axis_size(axis, size_of(unit, scenario.units), nbins)
    return unit
