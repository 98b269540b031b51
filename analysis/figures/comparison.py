"""Figures that compare policies: wins, regions, gaps to the bound, families of seas."""

from collections.abc import Mapping, Sequence
from textwrap import fill

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from analysis.answers.comparison import AHEAD, BEHIND, Pair
from analysis.answers.optimality import ALL
from analysis.figures import style
from analysis.names import BOUND, METRICS, PRODUCT, metric_label, parameter
from analysis.numbers import counted
from analysis.stats.intervals import LEVEL
from analysis.stats.verdict import INCONCLUSIVE

COLOURS = {AHEAD: style.BETTER, BEHIND: style.WORSE, INCONCLUSIVE: style.MUTED}
EDGE = 0.005  # share of the missions that is beyond each end of the distribution's axis
TAIL = 0.05  # the same of the second panel of ``spread``


def lead(table: pd.DataFrame, field: str, overall: float) -> Figure:
    """The mean difference along a parameter: for each bin a dot with its interval.

    Args:
        table: All rows of ``answers.comparison.along``, so that all figures have the same axis.
        field: The parameter.
        overall: The mean difference over all missions, drawn as a dashed line.
    """
    rows = table[table["field"] == field]
    with style.panels(3.5, values="y") as (figure, ax):
        ax.axhline(0, **style.ZERO)
        ax.axhline(overall, color=style.MUTED, linestyle="--", zorder=1, gid="overall")
        for verdict, part in rows.groupby("verdict"):
            fillstyle = "none" if verdict == INCONCLUSIVE else "full"
            ax.errorbar(part["position"], part["mean"], yerr=style.arms(part), linestyle="",
                        **style.dot((COLOURS[verdict], "o")), fillstyle=fillstyle)  # fmt: skip
        ax.set_title(parameter(field).label, parse_math=True)
        ax.set(ylabel="mean difference [points]", ylim=style.ends(table, zero=True))
        ax.set_xticks(rows["position"], rows["value"])
        style.in_units(ax.yaxis, "points")
    return figure


def claims(table: pd.DataFrame, width: int = 60) -> Figure:
    """Results minus the numbers that the paper prints: a row per number, a colour per policy.

    Args:
        table: Rows with ``claim``, ``policy``, and the difference ``mean``, ``low`` and ``high``.
        width: The characters in a line of a name.
    """
    names = [*table["claim"].unique()]
    looks = style.policy_colours(table["policy"])
    lines = [fill(name, width) for name in names]
    height = 0.3 * len(names) if width > max(map(len, names)) else 0.52 * len(names)
    with style.panels(height, values="x", legend=5) as (figure, ax):
        for shift, (policy, rows) in zip(
            style.shifts(len(looks), 0.3), table.groupby("policy", sort=False), strict=True
        ):
            places = rows["claim"].map(names.index) + shift
            ax.errorbar(rows["mean"], places, xerr=style.arms(rows), linestyle="", label=policy,
                        **style.dot(looks[str(policy)]))  # fmt: skip
        ax.axvline(0, **style.ZERO)
        ax.set_yticks(range(len(names)), lines)
        ax.set(ylim=(len(names) - 0.5, -0.5), xlabel="ours minus the paper's [points]")
        style.in_units(ax.xaxis, "points")
    return figure


def distribution(missions: pd.DataFrame, pair: Pair) -> Figure:
    """The distribution function of the difference: the share of the missions up to each value.

    The 95 % band is for the complete curve (Dvoretzky, Kiefer and Wolfowitz). A share of ``EDGE``
    of the missions is beyond each end of the axis.

    Args:
        missions: Rows of ``answers.comparison.duels``.
        pair: The policies.
    """
    values = np.sort(missions["difference"].to_numpy(float))
    half = float(np.sqrt(np.log(2 / (1 - LEVEL)) / (2 * len(values))))
    low, high = _middle([missions["difference"]], EDGE)
    x = np.array([min(values[0], low) - 1, *values, max(values[-1], high) + 1])
    y = np.array([0, *np.arange(1, len(values) + 1) / len(values), 1])
    with style.panels(3.9) as (figure, ax):
        for start, end, outcome in ((x[0], 0, BEHIND), (0, x[-1], AHEAD)):
            ax.axvspan(start, end, color=COLOURS[outcome], alpha=0.11, linewidth=0, zorder=0)
        band = np.clip([y - half, y + half], 0, 1)
        ax.fill_between(x, *band, step="post", color=style.INK, alpha=0.2, linewidth=0, gid="band")
        ax.step(x, y, where="post", color=style.INK, linewidth=1.8, gid="shares")
        shares = {BEHIND: (values < 0).mean(), AHEAD: (values > 0).mean()}
        for place, (outcome, share) in enumerate(shares.items()):
            ax.annotate(f"{pair.policy} {outcome}: {share:.1%}", (place, 1.03),
                        ha=("left", "right")[place], xycoords="axes fraction",
                        color=COLOURS[outcome], gid=outcome)  # fmt: skip
        ax.set_title("Difference in every mission", pad=22)
        ax.set(xlim=(low, high), ylim=(0, 1), ylabel="share of the missions")
        ax.set_xlabel(f"{pair.policy} − {pair.baseline}, at most [points]")
        style.in_units(ax.xaxis, "points", 7)
        style.in_units(ax.yaxis, "%")
    return figure


def means(table: pd.DataFrame, metric: str, sides: Sequence[str]) -> Figure:
    """A metric of every policy in the baseline and in the variation, with intervals.

    Args:
        table: Rows of ``ask.answer.means``.
        metric: One of their metrics.
        sides: The texts below the baseline and the variation.
    """
    rows = table[table["metric"] == metric].dropna(subset="mean")
    rows = rows.assign(position=rows["point"], value=rows["point"].map(dict(enumerate(sides))))
    with style.panels(4.1, values="y") as (figure, ax):
        style.along(rows, style.policy_colours(rows["policy"]), style.unit_of(metric), ax)
        ax.set(title=metric_label(metric), xlim=(-0.45, 1.45))
        ax.set_xticks((0, 1), sides)
        if metric in METRICS:
            ax.set_ylim(style.ends(rows, 0.05))
    return figure


def gains(answers: pd.DataFrame) -> Figure:
    """The paired differences of the metrics of every policy, with intervals.

    Args:
        answers: Rows of ``ask.answer.answers``.
    """
    names = {metric: name.replace(" and ", "\nand ") for metric, name in METRICS.items()}
    rows = answers[answers["metric"].isin([*names])]
    return _differences(rows, rows["metric"].map(names), "Variation − baseline")


def differences(table: pd.DataFrame) -> Figure:
    """Paired differences from a baseline, by number of UAVs.

    Args:
        table: Rows of ``optimality.planner.differences``.
    """
    names = table["uavs"].map(lambda uavs: uavs if uavs == ALL else counted(uavs, "UAV"))
    return _differences(table, names, f"Difference from {table['baseline'].iloc[0]}")


def spread(differences: Mapping[str, pd.Series]) -> Figure:
    """The distribution of the paired differences of every policy: all, and the central part.

    Args:
        differences: For each policy the result of ``ask.answer.differences``.
    """
    with style.panels(5.6, 2, sharey=True) as (figure, axes):
        titles = ("Share of missions with that difference or less", "The central part of it")
        for ax, title in zip(axes, titles, strict=True):
            style.distributions(differences, ax)
            ax.axvline(0, **style.ZERO)
            ax.axhline(0.5, color=style.MUTED, linewidth=0.9, linestyle=":", zorder=1)
            ax.set_title(title)
            style.in_units(ax.xaxis, "points", 7)
        axes[1].set(xlim=_middle([*differences.values()], TAIL), xlabel="percentage points")
    return figure


def gaps(table: pd.DataFrame) -> Figure:
    """The product of every policy and the upper bound, in a panel per number of UAVs.

    Args:
        table: Rows of ``optimality.gap.by_fleet``.
    """
    fleets = [*table[table["uavs"] != ALL].groupby("uavs", sort=False)]
    height = (0.75 + 0.22 * table["policy"].nunique()) * len(fleets) + 0.6
    with style.panels(height, len(fleets), "x", sharex=True, squeeze=False) as (figure, axes):
        for ax, (uavs, rows) in zip(axes.flat, fleets, strict=True):
            bound, low, high = rows[[BOUND, f"{BOUND}_low", f"{BOUND}_high"]].iloc[0]
            ax.axvspan(low, high, color=style.MUTED, alpha=0.3, linewidth=0)
            ax.axvline(bound, color=style.INK, linewidth=1.3, label="upper bound")
            style.in_rows(rows, ax, PRODUCT, f"{PRODUCT}_low", f"{PRODUCT}_high")
            ax.set(title=f"{counted(uavs, 'UAV')}: bound {bound:.1%}", xlim=(-0.02, 1.02))
            style.in_units(ax.xaxis, "%")
        ax.set_xlabel(METRICS[PRODUCT])
    return figure


def _differences(rows: pd.DataFrame, names: pd.Series, title: str) -> Figure:
    """Paired differences of every policy by what has these names, in their order."""
    rows = style.placed(rows.assign(mean=rows["difference"], name=names), "name")
    with style.panels(3.6, values="y") as (figure, ax):
        ax.axhline(0, **style.ZERO)
        looks = style.policy_colours(rows["policy"])
        style.along(rows, looks, "points", ax, linestyle="")
        ax.set(title=f"{title} (paired)", ylabel="percentage points")
        ax.margins(x=0.2)
    return figure


def _middle(values: Sequence[pd.Series], tail: float) -> tuple[float, float]:
    """The ends of an axis with 0 that leaves out a share of the values at each side."""
    low = min(0.0, *(of.quantile(tail) for of in values))
    high = max(0.0, *(of.quantile(1 - tail) for of in values))
    room = max(0.04 * (high - low), 0.01)
    return low - room, high + room


def groups(table: pd.DataFrame, by: str, title: str) -> Figure:
    """What every policy reaches in groups of seas, with intervals.

    Args:
        table: Rows of ``analysis.answers.seas.quality`` or ``shares``.
        by: The column of the groups.
        title: Of the vertical axis.
    """
    looks = style.policy_colours(table["policy"])
    with style.panels(4.2) as (figure, ax):
        style.along(style.placed(table, by), looks, "%", ax, linestyle="")
        ax.set(ylabel=title)
        ax.legend(loc="lower left", ncols=4)
    return figure
