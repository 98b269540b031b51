"""Figures of missions and of studies, one function each.

Functions of a mission take its event log (a data frame, or the columns, of
``dess.record.EventLog``), its ``dess.Scenario`` and the axes to draw on; those that end in
``_figure`` and those of a study return a figure of their own. Nothing touches pyplot's state.
"""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

import matplotlib as mpl
import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.axes import Axes
from matplotlib.colors import to_hex, to_rgb
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.ticker import MaxNLocator, PercentFormatter

from analysis.names import METRICS
from analysis.results.event_log import Events, battery_levels, duration, residual_data, uav_slots
from dess.scenario import Scenario
from policies.registry import SHIPPED

INK, MUTED, SEA, ZONE = "#22303c", "#7a8791", "#f3f8fb", "#ffe08a"
UAVS = ("#1b1b1b", "#b3123f", "#1f5fbf", "#00734d", "#8a4b00", "#7b2fa0", "#007a8a", "#66707a")
# Policies that look the same in all figures, whichever others are there.
EVERYWHERE = (*SHIPPED, "ddqn", "ddqn-paper")
LINES = ("-", "--", ":", "-.")
# Width of the band [cells] over which the UAVs of a mission are spread where they share a path.
SPREAD = 0.4
DPI = 150
_PRINTED: dict = {"color": INK, "linestyle": "--", "linewidth": 1.3}


def node_colours(count: int) -> list[str]:
    """A colour per node: nine colour-blind safe hues in three shades; neighbours differ in hue."""
    hues = [c for c in sns.color_palette("colorblind") if np.ptp(c) > 0.05]  # all but the grey
    hues = [min(c, sns.set_hls_values(c, l=0.5), key=sum) for c in hues]  # readable on white
    mixes = (("white", 0.0), ("black", 0.45), ("white", 0.33))
    shades = [(1 - share) * np.array(hues) + share * np.array(to_rgb(c)) for c, share in mixes]
    palette = np.concatenate(shades)
    return [to_hex(palette[k % len(palette)]) for k in range(count)]


def uav_colours(count: int) -> list[str]:
    """A dark colour per UAV, the same in a fleet of any size; they come again after eight."""
    return [UAVS[uav % len(UAVS)] for uav in range(count)]


@contextmanager
def style() -> Iterator[None]:
    """The look of all figures, for the figures and axes that are made inside."""
    look = {
        "font.size": 10,
        "axes.titlesize": 11,
        "axes.titleweight": "bold",
        "axes.titlelocation": "left",
        "axes.edgecolor": MUTED,
        "axes.labelcolor": INK,
        "text.color": INK,
        "xtick.color": INK,
        "ytick.color": INK,
        "legend.frameon": False,
        "legend.fontsize": 9,
        "grid.color": "#dde4e9",
    }
    with mpl.rc_context():
        mpl.rcdefaults()  # whatever the user's matplotlibrc says
        sns.set_style("whitegrid")
        mpl.rcParams.update(look)
        yield


def trajectories(events: Events, scenario: Scenario, ax: Axes) -> None:
    """The map of a mission, with the legend of the paper's Table I.

    Arrows are moves, crosses hovering slots, both in the colour of the node that is served in most
    of the slot's communication slots; grey where none is. Stars are charging slots. UAVs are
    numbered at their start (diamond) and end (dot) and, where they share a path, shifted apart.
    """
    slots, colours = uav_slots(events), np.array([*node_colours(len(scenario.nodes)), MUTED])
    _sea(scenario, ax)
    for uav, own in slots.groupby("uav"):
        shift = _shifts(scenario.uavs)[uav]
        _trail(own, shift, uav_colours(scenario.uavs)[uav], ax)
        moves = own[own["moved"]]
        ax.quiver(
            moves["from_x"] + shift,
            moves["from_y"] + shift,
            moves["x"] - moves["from_x"],
            moves["y"] - moves["from_y"],
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
            gid=f"moves-{uav}",
        )
        hovers = own[~own["moved"] & ~own["charging"]]
        ax.scatter(
            hovers["x"] + shift,
            hovers["y"] + shift,
            c=colours[hovers["node"]],
            marker="x",
            s=34,
            linewidths=1.7,
            zorder=5,
            gid=f"hovers-{uav}",
        )
        charges = own[own["charging"]]
        ax.scatter(
            charges["x"] + shift,
            charges["y"] + shift,
            color=INK,
            marker=(8, 2, 0),
            s=70,
            linewidths=1.1,
            zorder=6,
            gid=f"charges-{uav}",
        )
    _ends(slots, scenario, ax)


def battery(events: Events, scenario: Scenario, ax: Axes) -> None:
    """Battery [%] of every UAV over time, with the thresholds C_S and C_C of charging."""
    levels = battery_levels(events)
    for uav, own in levels.groupby("uav"):
        name = f"UAV {uav + 1}" if scenario.uavs <= 3 else f"{uav + 1}"
        ax.plot(own["time"], own["battery"], label=name, **_uav_line(uav, scenario))
    for level, name in ((scenario.charge_start, "$C_S$"), (scenario.charge_complete, "$C_C$")):
        ax.axhline(level, color=MUTED, linewidth=0.9, zorder=1)
        _margin_note(f"{name} {level}", level, ax)
    ax.set(title="Battery", ylabel="battery [%]", ylim=(0, 103))
    if scenario.uavs <= 6:  # more do not fit beside the title
        ax.legend(loc="lower right", bbox_to_anchor=(1.02, 0.97), ncols=6, handlelength=2.2,
                  handletextpad=0.5, columnspacing=1.1)  # fmt: skip
    _time_axis(events, ax)


def residual(events: Events, scenario: Scenario, ax: Axes) -> None:
    """Residual data [data units] over time: one band per node, in its colour, and their sum."""
    data = residual_data(events)
    colours = node_colours(len(scenario.nodes))
    ax.stackplot(data.index, data.to_numpy().T, colors=colours, alpha=0.75, linewidth=0)
    total = data.sum(axis=1)
    ax.plot(total.index, total, color=INK, linewidth=1.6, label="all nodes")
    _margin_note(f"{total.iloc[-1]:.0f} left", total.iloc[-1], ax)
    ax.set(title="Residual data, a band per node", ylabel="data units", ylim=(0, None))
    _time_axis(events, ax)


def occupancy(events: Events, scenario: Scenario, ax: Axes) -> None:
    """UAVs that charge, stacked in their colours, and those that wait for a pad, over time."""
    slots, edges = uav_slots(events), np.arange(duration(events) + 1)
    base = np.zeros(len(edges))
    for state in ("charging", "waiting"):
        for uav, own in slots[slots[state]].groupby("uav"):
            top = base + np.isin(edges, own["slot"])
            colour = uav_colours(scenario.uavs)[uav]
            face, hatch = (colour, None) if state == "charging" else ("none", "/////")
            ax.fill_between(
                edges, base, top, step="post", facecolor=face, edgecolor=colour, hatch=hatch,
                linewidth=0, alpha=0.85,
            )  # fmt: skip
            base = top
    ax.step(edges, base, where="post", color=INK, linewidth=1, gid="occupancy")
    pads = scenario.zone_cells if scenario.pads is None else scenario.pads
    if pads <= scenario.uavs:
        ax.axhline(pads, color=MUTED, linewidth=0.9)
    hatched = "; hatched: waiting" if slots["waiting"].any() else ""
    ax.set(
        title=f"Charging zone, {pads} pad{'s' if pads > 1 else ''}{hatched}",
        ylabel="UAVs",
        ylim=(0, scenario.uavs + 0.3),
    )
    ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=4))
    _time_axis(events, ax)


def mission_figure(events: Events, scenario: Scenario) -> Figure:
    """A mission: its map, and under it battery, residual data and charging zone over time."""
    with style():
        figure = Figure(figsize=(5.6, 11), dpi=DPI)
        figure.set_layout_engine("constrained", rect=(0, 0, 0.94, 1))
        axes = figure.subplots(4, height_ratios=(5.6, 1.6, 1.6, 1.1))
        trajectories(events, scenario, axes[0])
        axes[0].set_title(_outcome(events, scenario))
        _map_legend(axes[0])
        for panel, ax in zip((battery, residual, occupancy), axes[1:], strict=True):
            panel(events, scenario, ax)
            ax.set_xlabel("")
        axes[-1].set_xlabel("time [mission slots]")
    return figure


def performance(summary: pd.DataFrame, metric: str, printed: float | None = None) -> Figure:
    """A metric of every policy: means with intervals, and the paper's figure as a line.

    Args:
        summary: Rows of ``analysis.summary`` by ``policy``.
        metric: One of ``METRICS``.
        printed: The paper's figure.
    """
    rows = summary[summary["metric"] == metric].reset_index(drop=True)
    with style():
        figure = Figure(figsize=(5.2, 1.3 + 0.42 * len(rows)), dpi=DPI, layout="constrained")
        ax = figure.subplots()
        colours = policy_colours(rows["policy"])
        for y, row in rows.iterrows():
            ax.errorbar(row["mean"], y, xerr=arms(row), **dot(row["policy"], colours))
            ax.annotate(
                f"{row['mean']:.1%}",
                (1, y),
                xycoords=("axes fraction", "data"),
                xytext=(4, 0),
                textcoords="offset points",
                va="center",
                fontsize=9,
            )
        if printed is not None:
            ax.axvline(printed, **_PRINTED, label=f"paper {printed:.1%}", zorder=1)
            figure.legend(*ax.get_legend_handles_labels(), loc="outside lower center")
        ax.set_yticks(range(len(rows)), rows["policy"])
        ax.set(title=METRICS[metric], xlim=(-0.02, 1.02), ylim=(len(rows) - 0.4, -0.6))
        ax.set_xticks(np.linspace(0, 1, 6))
        ax.xaxis.set_major_formatter(PercentFormatter(1))
        ax.grid(axis="y", visible=False)
        sns.despine(ax=ax, left=True)
    return figure


def by_fleet(
    summary: pd.DataFrame, metric: str, printed: Mapping[int, float] | None = None
) -> Figure:
    """A metric of every policy against the number of UAVs, with intervals.

    Args:
        summary: Rows of ``analysis.summary`` by ``policy`` and ``uavs``.
        metric: One of ``METRICS``.
        printed: The paper's figures by number of UAVs.
    """
    rows = summary[summary["metric"] == metric]
    with style():
        figure = Figure(figsize=(5.2, 3.9), dpi=DPI, layout="constrained")
        ax = figure.subplots()
        colours = policy_colours(rows["policy"])
        offsets = np.linspace(-0.12, 0.12, len(colours)) if len(colours) > 1 else [0.0]
        for offset, (policy, own) in zip(offsets, rows.groupby("policy", sort=False), strict=True):
            own = own.sort_values("uavs")
            ax.errorbar(
                own["uavs"] + offset,
                own["mean"],
                yerr=arms(own),
                **dot(policy, colours),
                linewidth=1,
                alpha=0.9,
                label=policy,
            )
        if printed:
            ax.plot(*zip(*sorted(printed.items()), strict=True), marker="D", markersize=6,
                    label="paper", **_PRINTED)  # fmt: skip
        ax.set(title=METRICS[metric], xlabel="UAVs", ylim=(-0.03, 1.04))
        ax.set_xticks(sorted(rows["uavs"].unique()))
        ax.set_yticks(np.linspace(0, 1, 6))
        ax.yaxis.set_major_formatter(PercentFormatter(1))
        ax.grid(axis="x", visible=False)
        ax.legend(loc="upper center", bbox_to_anchor=(0.46, -0.16), ncols=5, columnspacing=1.1,
                  handletextpad=0.5)  # fmt: skip
        sns.despine(ax=ax)
    return figure


def policy_colours(policies: pd.Series) -> dict[str, tuple[str, str]]:
    """Colour and marker of every policy; those of ``EVERYWHERE`` always have their own."""
    names = list(dict.fromkeys(policies))
    numbers = {name: EVERYWHERE.index(name) for name in names if name in EVERYWHERE}
    free = [n for n in range(len(names)) if n not in numbers.values()]
    numbers |= dict(zip((name for name in names if name not in numbers), free, strict=False))
    palette = sns.color_palette("colorblind").as_hex()
    return {name: (palette[numbers[name] % 10], "os^vPX*"[numbers[name] % 7]) for name in names}


def dot(policy: str, colours: dict[str, tuple[str, str]]) -> dict:
    """How the means of a policy are drawn."""
    colour, marker = colours[policy]
    return {"color": colour, "marker": marker, "markersize": 4.5, "capsize": 4, "elinewidth": 1.8}


def arms(rows: pd.DataFrame | pd.Series) -> np.ndarray:
    """Lengths of the arms of error bars, (2, N)."""
    return np.array([rows["mean"] - rows["low"], rows["high"] - rows["mean"]]).reshape(2, -1)


def _outcome(events: Events, scenario: Scenario) -> str:
    log = pd.DataFrame(events)
    data = log[log["node"] >= 0].groupby("event")["value"].sum()
    total = data["mission_start"] + data.get("arrival", 0.0)
    share = data.get("communication", 0.0) / total if total else 1.0
    filled = (log["event"] == "quota_filled").sum()
    return f"I = {scenario.uavs}: {share:.1%} collected, {filled} of {scenario.uavs} quotas filled"


def _sea(scenario: Scenario, ax: Axes) -> None:
    """The grid, its zone and its nodes; y grows south."""
    x, y, width, height = scenario.zone
    ax.set_facecolor(SEA)
    ax.grid(False)
    ax.add_patch(
        Rectangle((x - 0.5, y - 0.5), width, height, facecolor=ZONE, edgecolor="#d9a400", zorder=1)
    )
    nodes = np.array(scenario.nodes)
    ax.scatter(
        nodes[:, 0],
        nodes[:, 1],
        c=node_colours(len(nodes)),
        s=95,
        edgecolors="white",
        linewidths=1.2,
        zorder=3,
        gid="nodes",
    )
    ax.set(
        aspect="equal",
        xlim=(-0.5, scenario.grid - 0.5),
        ylim=(scenario.grid - 0.5, -0.5),
        xlabel=f"x, east [cells of {scenario.cell_size:g} m]",
        ylabel="y, south [cells]",
    )
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MaxNLocator(integer=True, nbins=8))


def _shifts(uavs: int) -> np.ndarray:
    """(I,) how far [cells] each UAV is drawn from the middle of its cell."""
    return np.linspace(-SPREAD / 2, SPREAD / 2, uavs) if uavs > 1 else np.zeros(1)


def _trail(own: pd.DataFrame, shift: float, colour: str, ax: Axes) -> None:
    """The whole way of a UAV as a pale band under its arrows."""
    x = [own["from_x"].iloc[0], *own["x"]]
    y = [own["from_y"].iloc[0], *own["y"]]
    ax.plot(
        np.array(x) + shift,
        np.array(y) + shift,
        color=colour,
        alpha=0.16,
        linewidth=4.5,
        solid_joinstyle="round",
        zorder=2,
    )


def _ends(slots: pd.DataFrame, scenario: Scenario, ax: Axes) -> None:
    """A numbered diamond where each UAV starts, a numbered dot where its mission ends."""
    for uav, own in slots.groupby("uav"):
        shift, colour = _shifts(scenario.uavs)[uav], uav_colours(scenario.uavs)[uav]
        first, last = own.iloc[0], own.iloc[-1]
        marks = (
            (first["from_x"], first["from_y"], "D", "white", colour, "start"),
            (last["x"], last["y"], "o", colour, "white", "end"),
        )
        for x, y, marker, face, text, what in marks:
            spot = (x + shift, y + shift)
            ax.scatter(
                *spot,
                marker=marker,
                s=62,
                facecolor=face,
                edgecolor=colour,
                linewidth=1.6,
                zorder=8,
                gid=f"{what}-{uav}",
            )
            ax.annotate(
                str(uav + 1), spot, ha="center", va="center", fontsize=6.5, color=text,
                fontweight="bold", zorder=9,
            )  # fmt: skip


def _map_legend(ax: Axes) -> None:
    """The symbols of the map (Table I)."""

    def mark(marker, label, face=INK, size=7.0):
        return Line2D([], [], linestyle="", marker=marker, label=label, color=INK,
                      markerfacecolor=face, markersize=size)  # fmt: skip

    served = node_colours(2)[1]
    handles = [
        Patch(facecolor=ZONE, edgecolor="#d9a400", label="start and charging zone"),
        mark("o", "sensor node", face=served, size=8),
        mark("D", "start of UAV", face="white"),
        mark("o", "end of UAV"),
        Line2D([], [], linestyle="", marker=r"$\rightarrow$", markersize=13, color=served,
               label="move, serving that node"),
        Line2D([], [], linestyle="", marker="x", markeredgewidth=1.7, color=served,
               label="hover, serving that node"),
        mark((8, 2, 0), "hover, charging", size=8),
        Line2D([], [], linestyle="", marker=r"$\rightarrow$", markersize=13, color=MUTED,
               label="no node served"),
    ]  # fmt: skip
    ax.legend(handles=handles, loc="upper center", bbox_to_anchor=(0.48, -0.1), ncols=3,
              handletextpad=0.4, columnspacing=1.0, fontsize=8.5)  # fmt: skip


def _uav_line(uav: int, scenario: Scenario) -> dict:
    return {
        "color": uav_colours(scenario.uavs)[uav],
        "linestyle": LINES[uav % len(LINES)],
        "linewidth": 1.6,
    }


def _margin_note(text: str, level: float, ax: Axes) -> None:
    """A note in the right margin, at a level of the y axis."""
    note = ax.annotate(text, (1, level), xycoords=("axes fraction", "data"), xytext=(4, 0),
                       textcoords="offset points", va="center", fontsize=8.5)  # fmt: skip
    note.set_in_layout(False)  # maps of one gallery are equally large, whatever the notes say


def _time_axis(events: Events, ax: Axes) -> None:
    ax.set(xlim=(0, duration(events)), xlabel="time [mission slots]")
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=8))
    ax.grid(axis="x", visible=False)
    sns.despine(ax=ax)
