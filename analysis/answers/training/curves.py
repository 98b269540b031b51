"""Learning curves: their files, their averages and their figure."""

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pyarrow as pa

from dess import InputError
from dess.analysis.metrics import METRICS, PRODUCT
from dess.base.files.tables import read_table

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BASELINE = "quick"  # the variant with which the others of the shipped curves are compared
SHIPPED = "ddqn"  # the variant of the shipped policy, which is trained longer
# The metrics that are evaluated while training, and their names.
LEARNED_REWARD = "evaluation_reward"
LEARNED_PRODUCT = f"evaluation_{PRODUCT}"
SHOWN = {LEARNED_REWARD: "Cumulative reward", LEARNED_PRODUCT: METRICS[PRODUCT]}
# Pairs of variants of the shipped curves, with and without transfer learning, by what both have in
# common otherwise.
PAIRS = {
    "all methods of this project": ("quick", "no transfer"),
    "no return guard": ("no guard", "no guard, no transfer"),
    "the paper's methods alone": ("none of the three", "none of the three, no transfer"),
    "the paper's methods alone, long": (
        "none of the three, long",
        "none of the three, no transfer, long",
    ),
}
# Weight of the newest evaluation in the exponential moving average.
ALPHA = 0.5
# What holds for all figures of trainings.
TRAININGS = (
    "A line is the exponential moving average of a training, n = 1 (weight of the newest "
    f"evaluation {ALPHA:g}); dotted: phase I."
)
_COURSE = {"phase": pa.string(), "updates": pa.int64(), "uav_slots": pa.float64()}
_COURSE |= dict.fromkeys((LEARNED_REWARD, LEARNED_PRODUCT), pa.float64())
_EVALUATED = {f"evaluation_{metric}": pa.float64() for metric in METRICS}
_FINAL = {f"final_{metric}": pa.float64() for metric in METRICS}
_OF_TRAINING = {"tick": pa.int64(), "seconds": pa.float64(), "is_best": pa.bool_()}
CURVE = pa.schema(_COURSE | _OF_TRAINING | _EVALUATED)
CURVES = pa.schema(_COURSE | {"variant": pa.string(), "seed": pa.int64()} | _FINAL)


def smooth_curves(curves: pd.DataFrame, metric: str) -> pd.DataFrame:
    """The exponential moving average of every training, started again in every phase.

    For evaluations x(t) it is e(t) = (1 - ALPHA) e(t - 1) + ALPHA x(t). At the first evaluation of
    a phase e = x, because the missions of different phases cannot be compared.

    Returns:
        A row per evaluation: ``variant``, ``seed``, ``phase``, ``updates``, ``value``.
    """
    keys = ["variant", "seed", "phase"]
    averages = curves.groupby(keys, sort=False)[metric].transform(_moving_average)
    return curves[[*keys, "updates"]].assign(value=averages)


def pairs_in(curves: pd.DataFrame) -> dict[str, tuple[str, str]]:
    """Those of ``PAIRS`` that have trainings of both variants."""
    variants = {*curves["variant"]}
    return {name: pair for name, pair in PAIRS.items() if {*pair} <= variants}


def plot_trainings(curves: pd.DataFrame, metric: str, labels: Mapping[str, str]) -> "Figure":
    """A metric against the training step, a line for each training: Fig. 3.

    Phases before the last one are dotted, and a vertical line marks the beginning of the last
    phase. The axis at the top shows the UAV-slots that have been simulated.

    Args:
        curves: Rows of ``read_curves``, or of ``curves_by_learner``.
        metric: One of ``SHOWN``.
        labels: The variants to draw, with their names in the legend.
    """
    from dess.analysis.figures import style

    drawn = curves[curves["variant"].isin(labels)]
    averages = smooth_curves(drawn, metric)
    styles = zip(labels.items(), style.readable_palette(), style.LINES, strict=False)
    with style.new_panels(3.9, values="y", legend=2) as (figure, ax):
        for (variant, label), colour, line in styles:
            of_variant = averages[averages["variant"] == variant]
            last = of_variant["phase"].iloc[-1]
            n = of_variant["seed"].nunique()
            names = {last: f"{label}, n = {n}"}
            for (_, phase), curve in of_variant.groupby(["seed", "phase"], sort=False):
                ax.plot(curve["updates"], curve["value"], line if phase == last else ":",
                        color=colour, linewidth=1.6, label=names.pop(phase, ""))  # fmt: skip
            start = of_variant.loc[of_variant["phase"] != last, "updates"].max()
            if start > 0:  # not if it is nan
                ax.axvline(start, color=style.MUTED, linewidth=1, zorder=1, gid="last phase")
                ax.annotate("phase II", (start, 0), xycoords=("data", "axes fraction"),
                            xytext=(4, 12), textcoords="offset points", fontsize=8.5,
                            **style.OUTLINED)  # fmt: skip
        low = averages["value"].min()
        high = averages["value"].max()
        room = 0.12 * (high - low) or 0.1
        style.set_axis_unit(ax.yaxis, "%" if metric == LEARNED_PRODUCT else "")
        ax.set(ylabel=SHOWN[metric], ylim=(low - room, high + room))
        _steps_axis(drawn, ax)
    return figure


def _steps_axis(curves: pd.DataFrame, ax: "Axes") -> None:
    """The training step below the axes, and the UAV-slots simulated until then above them."""
    longest = curves.sort_values("updates").iloc[-1]
    ax.set(xlim=(0, longest["updates"] * 1.02), xlabel="training step [1000 updates]")
    ax.xaxis.set_major_formatter(lambda x, _: f"{x / 1000:g}")
    slots = longest["uav_slots"] / longest["updates"] / 1e6
    top = ax.secondary_xaxis("top", functions=(lambda x: x * slots, lambda x: x / slots))
    top.set_xlabel("UAV-slots [millions]")


def last_phase(averages: pd.DataFrame, variant: str) -> pd.DataFrame:
    """The (steps, trainings) averages of a variant in its last phase, at their common steps."""
    curves = averages[averages["variant"] == variant]
    curves = curves[curves["phase"] == curves["phase"].iloc[-1]]
    return curves.pivot(index="updates", columns="seed", values="value").dropna()


def settling_position(averages: pd.Series, margin: float) -> int:
    """The position from which on the averages stay within a margin of the last one."""
    far = np.flatnonzero((averages - averages.iloc[-1]).abs() > margin)
    return int(far[-1]) + 1 if len(far) else 0


def _moving_average(values: pd.Series) -> pd.Series:
    return values.ewm(alpha=ALPHA, adjust=False).mean()


def read_curve(path: Path) -> pd.DataFrame:
    """The curve of a training, a row per evaluation.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curve.
    """
    return read_table(path, CURVE).to_pandas()


def read_curves(path: Path) -> pd.DataFrame:
    """The curves of trainings of several variants, with the metrics of the weights they selected.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curves.
    """
    curves = read_table(path, CURVES).to_pandas()
    averages = curves.assign(value=0.0)
    pairs = pairs_in(curves).values()
    ends = [{*last_phase(averages, a).index} & {*last_phase(averages, b).index} for a, b in pairs]
    if BASELINE not in {*curves["variant"]} or not ends or not all(ends):
        pair = " and ".join(next(iter(PAIRS.values())))
        raise InputError(f"{path}: variant", "has no pair of trainings", pair)
    return curves
