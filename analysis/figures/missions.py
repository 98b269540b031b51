"""Figures of one mission: its map, batteries, residual data, age and charging zone.

Each function takes the event log of the mission (a data frame, or the columns, of
``dess.record.EventLog``), its ``dess.Scenario`` and the axes to draw on; ``mission_figure`` puts
them together. Nothing touches pyplot's state.
"""

from collections.abc import Callable

import matplotlib as mpl
import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator

from analysis.figures import style
from analysis.results.event_log import (
    Events,
    battery_levels,
    duration,
    mean_age,
    residual_data,
    uav_slots,
)
from dess.scenario import Scenario, ScenarioSpace

# Width [cells] over which UAVs on the same path are drawn side by side.
SPREAD = 0.4


def trajectories(events: Events, scenario: Scenario, ax: Axes) -> None:
    """The map of a mission, with the legend of the paper's Table I.

    An arrow is a move and a cross a slot in which the UAV hovers; both have the colour of the node
    that is served in most of the slot's communication slots, or grey if none is served. A star is
    a slot in which the UAV charges. UAVs are numbered at their start (diamond) and end (dot), and
    drawn side by side where they share a path.
    """
    slots = uav_slots(events)
    # The last is that of node -1, which is none.
    colours = np.array([*style.node_colours(len(scenario.nodes)), style.MUTED])
    offsets = style.shifts(scenario.uavs, SPREAD / 2)
    _grid(scenario, ax)
    for uav, of_uav in slots.groupby("uav"):
        shifted = of_uav.assign(
            **{column: of_uav[column] + offsets[uav] for column in ("from_x", "from_y", "x", "y")}
        )
        colour = style.uav_colours(scenario.uavs)[uav]
        _trail(shifted, colour, ax)
        _moves(shifted[shifted["moved"]], colours, f"moves-{uav}", ax)
        hovers = shifted[~shifted["moved"] & ~shifted["charging"]]
        ax.scatter(hovers["x"], hovers["y"], c=colours[hovers["node"]], marker="x", s=34,
                   linewidths=1.7, zorder=5, gid=f"hovers-{uav}")  # fmt: skip
        charges = shifted[shifted["charging"]]
        ax.scatter(charges["x"], charges["y"], color=style.INK, marker=(8, 2, 0), s=70,
                   linewidths=1.1, zorder=6, gid=f"charges-{uav}")  # fmt: skip
        _ends(shifted, uav, colour, ax)


def chart(scenario: Scenario | ScenarioSpace, ax: Axes) -> None:
    """The grid and its zone, without nodes; y grows south."""
    x, y, width, height = scenario.zone
    zone = Rectangle(
        (x - 0.5, y - 0.5), width, height, facecolor=style.ZONE, edgecolor=style.ZONE_EDGE, zorder=1
    )
    ax.set_facecolor(style.SEA)
    ax.grid(False)
    ax.add_patch(zone)
    ax.set(
        aspect="equal",
        xlim=(-0.5, scenario.grid - 0.5),
        ylim=(scenario.grid - 0.5, -0.5),
        xlabel=f"x, east [cells of {scenario.cell_size:g} m]",
        ylabel="y, south [cells]",
    )
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(integer=True, nbins=8))


def battery(events: Events, scenario: Scenario, ax: Axes) -> None:
    """Battery [%] of every UAV over time, with the thresholds C_S and C_C of charging."""
    levels = battery_levels(events)
    for uav, curve in levels.groupby("uav"):
        name = f"UAV {uav + 1}" if scenario.uavs <= 3 else f"{uav + 1}"
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
    _time_axis(events, ax)


def residual(events: Events, scenario: Scenario, ax: Axes) -> None:
    """Residual data [data units] over time: one band per node, in its colour, and their sum."""
    data = residual_data(events)
    colours = style.node_colours(len(scenario.nodes))
    ax.stackplot(data.index, data.to_numpy().T, colors=colours, alpha=0.75, linewidth=0)
    total = data.sum(axis=1)
    ax.plot(total.index, total, color=style.INK, linewidth=1.6, label="all nodes")
    _margin_note(f"{total.iloc[-1]:.0f} left", total.iloc[-1], ax)
    ax.set(title="Residual data, a band per node", ylabel="data units", ylim=(0, None))
    _time_axis(events, ax)


def age(events: Events, scenario: Scenario, ax: Axes) -> None:
    """The mean age of information of all nodes [slots] over time."""
    curve = mean_age(events)
    ax.plot(curve["time"], curve["age"], color=style.INK, linewidth=1.2, gid="age")
    ax.set(title="Mean age of the nodes", ylabel="slots", ylim=(0, None))
    _time_axis(events, ax)


def occupancy(events: Events, scenario: Scenario, ax: Axes) -> None:
    """The UAVs that charge (stacked, in their colours) and that wait for a pad, over time."""
    slots, edges = uav_slots(events), np.arange(duration(events) + 1)
    base = np.zeros(len(edges))
    for state in ("charging", "waiting"):
        for uav, busy in slots[slots[state]].groupby("uav"):
            top = base + np.isin(edges, busy["slot"])
            colour = style.uav_colours(scenario.uavs)[uav]
            face, hatch = (colour, None) if state == "charging" else ("none", "/////")
            ax.fill_between(
                edges, base, top, step="post", facecolor=face, edgecolor=colour, hatch=hatch,
                linewidth=0, alpha=0.85,
            )  # fmt: skip
            base = top
    ax.step(edges, base, where="post", color=style.INK, linewidth=1, gid="occupancy")
    pads = scenario.charging_pads
    if pads <= scenario.uavs:
        ax.axhline(pads, color=style.MUTED, linewidth=0.9)
    hatched = "; hatched: waiting" if slots["waiting"].any() else ""
    ax.set(
        title=f"Charging zone, {pads} pad{'s' if pads > 1 else ''}{hatched}",
        ylabel="UAVs",
        ylim=(0, scenario.uavs + 0.3),
    )
    ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=4))
    _time_axis(events, ax)


def curves(scenario: Scenario) -> dict[Callable[[Events, Scenario, Axes], None], float]:
    """The figures over the time of a mission, from top to bottom, and their heights [inches]."""
    ages = {age: 1.6} if scenario.age.measured else {}
    return {battery: 1.6, residual: 1.6, **ages, occupancy: 1.1}


def mission_figure(events: Events, scenario: Scenario) -> Figure:
    """A mission: its map, and below it its curves over time."""
    panels = curves(scenario)
    with style.look():
        figure = Figure(figsize=(5.6, 6.7 + sum(panels.values())), dpi=style.DPI)
        figure.set_layout_engine("constrained", rect=(0, 0, 0.94, 1))
        axes = figure.subplots(1 + len(panels), height_ratios=(5.6, *panels.values()))
        trajectories(events, scenario, axes[0])
        axes[0].set_title(_outcome(events, scenario))
        _map_legend(axes[0])
        for panel, ax in zip(panels, axes[1:], strict=True):
            panel(events, scenario, ax)
            ax.set_xlabel("")
        axes[-1].set_xlabel("time [mission slots]")
    return figure


def sea_figure(space: ScenarioSpace) -> Figure:
    """The map of a scenario: its sensor nodes, each in its colour, and its zone."""
    with style.look():
        figure = Figure(figsize=(5.6, 5.6), dpi=style.DPI, layout="constrained")
        _grid(space, figure.subplots())
    return figure


def _outcome(events: Events, scenario: Scenario) -> str:
    log = pd.DataFrame(events)
    data = log[log["node"] >= 0].groupby("event")["value"].sum()
    total = data["mission_start"] + data.get("arrival", 0.0)
    share = data.get("communication", 0.0) / total if total else 1.0
    filled = (log["event"] == "quota_filled").sum()
    return f"I = {scenario.uavs}: {share:.1%} collected, {filled} of {scenario.uavs} quotas filled"


def _grid(scenario: Scenario | ScenarioSpace, ax: Axes) -> None:
    """The grid, its zone and its nodes."""
    chart(scenario, ax)
    nodes = np.array(scenario.nodes)
    ax.scatter(nodes[:, 0], nodes[:, 1], c=style.node_colours(len(nodes)), s=95,
               edgecolors="white", linewidths=1.2, zorder=3, gid="nodes")  # fmt: skip


def _trail(slots: pd.DataFrame, colour: str, ax: Axes) -> None:
    """The path of a UAV as a pale band below its arrows."""
    x, y = ([slots[f"from_{axis}"].iloc[0], *slots[axis]] for axis in ("x", "y"))
    ax.plot(x, y, color=colour, alpha=0.16, linewidth=4.5, solid_joinstyle="round", zorder=2)


def _moves(moves: pd.DataFrame, colours: np.ndarray, name: str, ax: Axes) -> None:
    """An arrow per move, in the colour of the node served."""
    ax.quiver(
        moves["from_x"],
        moves["from_y"],
        (moves["x"] - moves["from_x"]).round(),  # one cell, without the shift of paths
        (moves["y"] - moves["from_y"]).round(),
        color=colours[moves["node"]],
        angles="xy",
        scale_units="xy",
        scale=1,
        width=0.15,
        units="xy",
        headwidth=3.8,
        headlength=3.4,
        headaxislength=3.2,
        zorder=4,
        gid=name,
    )


def _ends(slots: pd.DataFrame, uav: int, colour: str, ax: Axes) -> None:
    """A numbered diamond where a UAV starts, a numbered dot where its mission ends."""
    first, last = slots.iloc[0], slots.iloc[-1]
    marks = (
        (first["from_x"], first["from_y"], "D", "white", colour, "start"),
        (last["x"], last["y"], "o", colour, "white", "end"),
    )
    for x, y, marker, face, text, name in marks:
        ax.scatter(x, y, marker=marker, s=62, facecolor=face, edgecolor=colour, linewidth=1.6,
                   zorder=8, gid=f"{name}-{uav}")  # fmt: skip
        ax.annotate(str(uav + 1), (x, y), ha="center", va="center", fontsize=6.5, color=text,
                    fontweight="bold", zorder=9)  # fmt: skip


@mpl.rc_context({"text.parse_math": True})  # an arrow is a symbol in TeX
def _map_legend(ax: Axes) -> None:
    """The symbols of the map (Table I)."""

    def mark(marker, label, face=style.INK, size=7.0):
        return Line2D([], [], linestyle="", marker=marker, label=label, color=style.INK,
                      markerfacecolor=face, markersize=size)  # fmt: skip

    served = style.node_colours(2)[1]
    handles = [
        Patch(facecolor=style.ZONE, edgecolor=style.ZONE_EDGE, label="start and charging zone"),
        mark("o", "sensor node", face=served, size=8),
        mark("D", "start of UAV", face="white"),
        mark("o", "end of UAV"),
        Line2D([], [], linestyle="", marker=r"$\rightarrow$", markersize=13, color=served,
               label="move, serving that node"),
        Line2D([], [], linestyle="", marker="x", markeredgewidth=1.7, color=served,
               label="hover, serving that node"),
        mark((8, 2, 0), "hover, charging", size=8),
        Line2D([], [], linestyle="", marker=r"$\rightarrow$", markersize=13, color=style.MUTED,
               label="no node served"),
    ]  # fmt: skip
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.48, -0.1), ncols=3,
              handletextpad=0.4, columnspacing=1.0, fontsize=8.5)  # fmt: skip


def _margin_note(text: str, level: float, ax: Axes) -> None:
    """A note in the right margin, at a level of the y axis."""
    note = style.note_at_right(text, level, ax, 8.5)
    note.set_parse_math(True)
    note.set_in_layout(False)  # so that all maps of a gallery have the same size


def _time_axis(events: Events, ax: Axes) -> None:
    ax.set(xlim=(0, duration(events)), xlabel="time [mission slots]")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    style.grid_of("y", ax)
