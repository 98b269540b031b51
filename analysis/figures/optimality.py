"""Figures of the optimality gap, and of planners beside learners.

Each returns a figure of its own; nothing touches pyplot's state.
"""

from collections.abc import Mapping, Sequence

import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.colors import Colormap
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import FuncFormatter, NullFormatter, PercentFormatter

from analysis import numbers
from analysis.figures import style
from analysis.figures.comparison import COLOURS
from analysis.figures.missions import chart, trajectories
from analysis.names import BOUND, METRICS, PRODUCT
from analysis.questions.head_to_head import AHEAD, BEHIND
from analysis.questions.missions import LoggedMission
from analysis.questions.optimality.gap import ALL, fleet
from dess.scenario import ScenarioSpace
from policies.planner import Course

_BLUES = sns.light_palette(COLOURS[AHEAD], as_cmap=True)
_BOTH = sns.blend_palette([COLOURS[BEHIND], "white", COLOURS[AHEAD]], as_cmap=True)


def gaps(table: pd.DataFrame) -> Figure:
    """The product of every policy and the upper bound, in a panel per number of UAVs.

    Args:
        table: Rows of ``optimality.gap.by_fleet``.
    """
    fleets = [*table[table["uavs"] != ALL].groupby("uavs", sort=False)]
    policies = [*dict.fromkeys(table["policy"])]
    colours = style.policy_colours(policies)
    with style.panels(
        (0.75 + 0.22 * len(policies)) * len(fleets) + 0.6,
        len(fleets),
        "x",
        sharex=True,
        squeeze=False,
    ) as (figure, axes):
        for ax, (uavs, rows) in zip(axes.flat, fleets, strict=True):
            bound = rows.iloc[0]
            ax.axvspan(bound[f"{BOUND}_low"], bound[f"{BOUND}_high"], color=style.MUTED, alpha=0.3,
                       linewidth=0)  # fmt: skip
            ax.axvline(bound[BOUND], color=style.INK, linewidth=1.3, label="upper bound")
            style.policy_rows(rows, colours, ax, PRODUCT, f"{PRODUCT}_low", f"{PRODUCT}_high")
            ax.set(title=f"{fleet(uavs)}: bound {bound[BOUND]:.1%}")
        ax.set(xlim=(-0.02, 1.02), xlabel=METRICS[PRODUCT])
        ax.xaxis.set_major_formatter(PercentFormatter(1))
        style.legend_below(figure, ax)
    return figure


def differences(table: pd.DataFrame) -> Figure:
    """Paired differences from a baseline, by number of UAVs.

    Args:
        table: Rows of ``optimality.planner.differences``.
    """
    colours = style.policy_colours(table["policy"])
    places = {uavs: place for place, uavs in enumerate(dict.fromkeys(table["uavs"]))}
    rows = table.assign(place=table["uavs"].map(places), mean=table["difference"])
    with style.panels(3.4, values="y") as (figure, ax):
        ax.axhline(0, color=style.INK, linewidth=1.2, zorder=1)
        style.policy_means(rows, "place", colours, 0.1, ax, linestyle="")
        names = [uavs if uavs == ALL else fleet(uavs) for uavs in places]
        ax.set_xticks(range(len(places)), names)
        ax.set(title=f"Difference from {table['baseline'].iloc[0]}", xlim=(-0.5, len(places) - 0.5),
               ylabel="mean difference [points]")  # fmt: skip
        style.points_axis(ax.yaxis, 6)
        style.legend_below(figure, ax)
    return figure


def front(table: pd.DataFrame, bound: float) -> Figure:
    """Decision time against the product of all policies, and their Pareto front.

    Args:
        table: Rows of ``optimality.planner.front``.
        bound: The mean upper bound of the product.
    """
    colours = style.policy_colours(table["policy"])
    best = table[table["on_front"]].sort_values("seconds")
    with style.panels(4.2) as (figure, ax):
        ax.axhline(bound, color=style.INK, linewidth=1.3, linestyle="--", label="upper bound")
        ax.step(best["seconds"], best["mean"], where="post", color=style.MUTED, linewidth=1.2,
                label="Pareto front", zorder=1)  # fmt: skip
        for row in table.to_dict("records"):
            ax.errorbar(row["seconds"], row["mean"], yerr=style.arms(pd.Series(row)),
                        label=row["policy"], linestyle="",
                        **style.dot(row["policy"], colours))  # fmt: skip
        ax.set(xscale="log", title="Decision time against quality", ylabel=METRICS[PRODUCT])
        ax.set_xlabel("time of a decision for one mission, median")
        ax.set_xlim(table["seconds"].min() / 2, table["seconds"].max() * 2)
        ax.xaxis.set_major_formatter(FuncFormatter(lambda time, _: numbers.seconds(time)))
        ax.xaxis.set_minor_formatter(NullFormatter())
        ax.yaxis.set_major_formatter(PercentFormatter(1))
        style.legend_below(figure, ax)
    return figure


def coverage(space: ScenarioSpace, shares: Mapping[str, np.ndarray]) -> dict[str, Figure]:
    """Maps of the share of each node's data that two policies collect, and of the difference.

    Args:
        space: The scenario.
        shares: For two policies the (K,) shares of ``optimality.planner.coverage``.

    Returns:
        The three maps by their titles.
    """
    (first, one), (second, other) = shares.items()
    maps = {}
    for policy, values in shares.items():
        title = f"Collected by {policy}"
        maps[title] = _map(space, title, values, [f"{100 * v:.0f}" for v in values])
    title, most = f"{first} − {second}", max(float(np.abs(one - other).max()), 0.01)
    points = np.round(100 * (one - other)).astype(int)
    texts = [numbers.minus(f"{lead:+}") if lead else "0" for lead in points]
    maps[title] = _map(space, title, (one - other) / most, texts, _BOTH, -1.0)
    return maps


def at_home(table: pd.DataFrame) -> Figure:
    """The share of the UAVs in the charging zone over the slots of the mission, by policy.

    Args:
        table: Rows of ``optimality.planner.at_home``.
    """
    colours = style.policy_colours(table["policy"])
    with style.panels(3.4, values="y") as (figure, ax):
        for policy, rows in table.groupby("policy", sort=False):
            ax.plot(rows["slot"], rows["share"], color=colours[str(policy)][0], label=policy)
        ax.set(title="UAVs in the charging zone", xlabel="mission slot", ylabel="share of the UAVs",
               xlim=(0, table["slot"].max()), ylim=(0, 1.02))  # fmt: skip
        ax.yaxis.set_major_formatter(PercentFormatter(1))
        style.legend_below(figure, ax)
    return figure


def plan(mission: LoggedMission, courses: Sequence[Course]) -> Figure:
    """The plan of the first slot, as dashed lines over the mission as simulated.

    Args:
        mission: The mission.
        courses: What the plan has each UAV do.
    """
    with style.panels(6.0) as (figure, ax):
        trajectories(mission.log, mission.scenario, ax)
        for uav, course in enumerate(courses):
            colour = style.uav_colours(len(courses))[uav]
            ax.plot(*course.path.T, color=colour, linestyle=(0, (3, 1.5)), linewidth=1.6, zorder=7,
                    gid=f"plan-{uav}", label=f"plan of UAV {uav + 1}")  # fmt: skip
            for number, cell in enumerate(course.waypoints, 1):
                ax.annotate(str(number), cell, xytext=(6, 6), textcoords="offset points",
                            color=colour, fontsize=8, fontweight="bold", zorder=10,
                            path_effects=[withStroke(linewidth=2, foreground="white")])  # fmt: skip
        ax.set_title("The first plan (dashed), and the mission as simulated")
        style.legend_below(figure, ax)
    return figure


def prices(space: ScenarioSpace, values: np.ndarray) -> Figure:
    """What one more data unit at each node would add to the bound, on a map.

    Args:
        space: The scenario.
        values: (K,) the sums of a node's prices, from 0 to 1.
    """
    return _map(space, "Price of a node's data", values, [f"{value:.2f}" for value in values])


def _map(
    space: ScenarioSpace,
    title: str,
    values: np.ndarray,
    texts: Sequence[str],
    colours: Colormap = _BLUES,
    low: float = 0.0,
) -> Figure:
    """The nodes of a scenario in the colours of their values, from ``low`` to 1, with texts."""
    with style.panels(5.4) as (figure, ax):
        chart(space, ax)
        x, y = np.array(space.nodes).T
        ax.scatter(x, y, c=values, s=420, cmap=colours, vmin=low, vmax=1.0, zorder=3,
                   edgecolors=style.MUTED, linewidths=0.8)  # fmt: skip
        for cell, text in zip(space.nodes, texts, strict=True):
            ax.annotate(text, cell, ha="center", va="center", fontsize=8.5, zorder=4,
                        path_effects=[withStroke(linewidth=2.2, foreground="white")])  # fmt: skip
        ax.set_title(title)
    return figure
