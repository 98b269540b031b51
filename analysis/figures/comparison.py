"""Figures that compare two policies in the same missions, and figures of decision times."""

from collections.abc import Sequence

import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.figure import Figure
from matplotlib.patheffects import withStroke
from matplotlib.ticker import PercentFormatter

from analysis import numbers
from analysis.figures import style
from analysis.figures.missions import mission_figure
from analysis.names import parameter
from analysis.questions.head_to_head import AHEAD, BEHIND, Pair
from analysis.questions.missions import LoggedMission
from analysis.stats.intervals import LEVEL
from analysis.stats.verdict import INCONCLUSIVE

# In all figures, blue means better, orange worse, and a hollow mark inconclusive.
COLOURS = {AHEAD: "#0173b2", BEHIND: "#c05000", INCONCLUSIVE: style.MUTED}
EDGE = 0.005  # share of the missions that is beyond each end of the distribution's axis


def maps(missions: Sequence[LoggedMission]) -> list[list[tuple[Figure, str, str]]]:
    """Maps of missions, those of one replication together, with alternative texts and captions."""
    replications = dict.fromkeys(mission.row["replication"] for mission in missions)
    return [
        [_map(mission) for mission in missions if mission.row["replication"] == replication]
        for replication in replications
    ]


def _map(mission: LoggedMission) -> tuple[Figure, str, str]:
    name, number = mission.row["policy"], mission.row["replication"]
    alt = f"Map of mission {number} by {name}; battery, residual data and charging"
    return mission_figure(mission.log, mission.scenario), alt, mission.caption


def lead(table: pd.DataFrame, field: str, overall: float) -> Figure:
    """The mean difference along a parameter: for each bin a dot with its interval.

    Args:
        table: All rows of ``questions.regions.along``, so that all figures have the same axis.
        field: The parameter.
        overall: The mean difference over all missions, drawn as a dashed line.
    """
    rows = table[table["field"] == field].sort_values("position")
    with style.panels(3.5, values="y") as (figure, ax):
        ax.axhline(0, color=style.INK, linewidth=1.2, zorder=1)
        ax.axhline(
            overall, color=style.MUTED, linewidth=1.1, linestyle="--", zorder=1, gid="overall"
        )
        for row in rows.itertuples():
            colour = COLOURS[row.verdict]
            ax.errorbar(row.position, row.mean, yerr=[[row.mean - row.low], [row.high - row.mean]],
                        markerfacecolor="white" if row.verdict == INCONCLUSIVE else colour,
                        fmt="o", markersize=6, color=colour, capsize=4, elinewidth=1.8,
                        gid=row.verdict)  # fmt: skip
        ax.set_title(parameter(field).label, parse_math=True)
        ax.set(ylabel="mean difference [points]")
        ax.set(xlim=(-0.6, len(rows) - 0.4), ylim=style.ends(table, zero=True))
        ax.set_xticks(rows["position"], rows["value"])
        style.points_axis(ax.yaxis, 6)
    return figure


def heat(table: pd.DataFrame, first: str, second: str) -> Figure:
    """The mean difference over two parameters: blue where it is positive, orange where negative.

    Args:
        table: Rows of ``questions.regions.across``. Inconclusive means are in brackets.
        first: The parameter of the rows.
        second: The parameter of the columns.
    """
    names = table.drop_duplicates("position").sort_values("position")["value"].tolist()
    names_2 = table.drop_duplicates("position_2").sort_values("position_2")["value_2"].tolist()
    grid = np.full((len(names), len(names_2)), np.nan)
    grid[table["position"], table["position_2"]] = table["mean"]
    widest = max(float(np.nanmax(np.abs(grid))), 0.01)
    with style.panels(1.5 + 0.55 * len(names)) as (figure, ax):
        ax.grid(False)
        colours = sns.blend_palette([COLOURS[BEHIND], "white", COLOURS[AHEAD]], as_cmap=True)
        ax.pcolormesh(grid, cmap=colours, vmin=-1.4 * widest, vmax=1.4 * widest,
                      edgecolors="white", linewidth=2)  # fmt: skip
        for row in table.itertuples():
            text = numbers.difference(row.mean, 0)
            ax.annotate(f"({text})" if row.verdict == INCONCLUSIVE else text,
                        (row.position_2 + 0.5, row.position + 0.5), ha="center", va="center",
                        fontsize=10, gid=row.verdict,
                        path_effects=[withStroke(linewidth=2.5, foreground="white")])  # fmt: skip
        ax.set_xticks(np.arange(len(names_2)) + 0.5, names_2)
        ax.set_yticks(np.arange(len(names)) + 0.5, names)
        ax.invert_yaxis()
        ax.tick_params(length=0)
        ax.set_xlabel(parameter(second).label, parse_math=True)
        ax.set_ylabel(parameter(first).label, parse_math=True)
        ax.set_title("Mean difference [points]")
        sns.despine(ax=ax, left=True, bottom=True)
    return figure


def distribution(missions: pd.DataFrame, pair: Pair) -> Figure:
    """The distribution function of the difference: the share of the missions up to each value.

    The 95 % band is for the complete curve (Dvoretzky, Kiefer and Wolfowitz). A share of ``EDGE``
    of the missions is beyond each end of the axis.

    Args:
        missions: Rows of ``questions.head_to_head.duels``.
        pair: The policies.
    """
    values = np.sort(missions["difference"].to_numpy(float))
    shares = np.arange(1, len(values) + 1) / len(values)
    half = float(np.sqrt(np.log(2 / (1 - LEVEL)) / (2 * len(values))))
    low, high = np.quantile(values, [EDGE, 1 - EDGE])
    low, high = min(low, -0.01), max(high, 0.01)
    room = 0.04 * (high - low)
    x = np.concatenate([[min(values[0], low) - 1], values, [max(values[-1], high) + 1]])
    y = np.concatenate([[0], shares, [1]])
    with style.panels(3.9) as (figure, ax):
        ax.axvspan(x[0], 0, color=COLOURS[BEHIND], alpha=0.12, linewidth=0, zorder=0)
        ax.axvspan(0, x[-1], color=COLOURS[AHEAD], alpha=0.10, linewidth=0, zorder=0)
        band = np.clip([y - half, y + half], 0, 1)
        ax.fill_between(
            x, band[0], band[1], step="post", color=style.INK, alpha=0.2, linewidth=0, gid="band"
        )
        ax.step(x, y, where="post", color=style.INK, linewidth=1.8, gid="shares")
        for x_text, side, outcome in ((0, "left", BEHIND), (1, "right", AHEAD)):
            share = (values < 0 if outcome == BEHIND else values > 0).mean()
            ax.annotate(f"{pair.policy} {outcome}: {share:.1%}", (x_text, 1.03), ha=side,
                        xycoords="axes fraction", color=COLOURS[outcome], gid=outcome)  # fmt: skip
        ax.set_title("Difference in every mission", pad=22)
        ax.set(xlim=(low - room, high + room), ylim=(0, 1), ylabel="share of the missions")
        ax.set_xlabel(f"{pair.policy} − {pair.baseline}, at most [points]")
        style.points_axis(ax.xaxis, 7)
        ax.yaxis.set_major_formatter(PercentFormatter(1))
    return figure
