"""Learning curves: smoothed, with and without transfer learning.

A training is the unit: trainings of one variant differ in their seed alone. Intervals are about the
expected curve, the mean over all trainings that the variant might have; a single new training may
lie outside. One training says nothing of the spread.

Curves are tables with a row per evaluation while training: ``variant``, ``seed`` (of the training),
``updates`` (the training step), ``phase`` (of the paper's Algorithm 1; the last is the mission
itself), the evaluated metrics, and the ``final_...`` metrics of the weights that were kept:

    averages = smoothed(pd.read_parquet("curves.parquet"), "evaluation_reward")
    transfer(averages, "quick", "no transfer", shortest=800_000)
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.questions.learning.ablation import difference
from analysis.stats.intervals import Interval
from analysis.stats.verdict import INCONCLUSIVE, above, judged

# The metric that is evaluated while training.
REWARD, PRODUCT = "evaluation_reward", "evaluation_collection_ratio_and_communication"
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
# Level of the intervals of the paper's Fig. 3.
BAND = 0.99


@dataclass(frozen=True)
class Transfer:
    """How trainings with transfer learning compare with those without it.

    Attributes:
        verdict: Of ``verdicts``, whether the mean curve with transfer ends above, by the interval
            of the last difference; ``INCONCLUSIVE`` if the trainings are too short.
        since: The training step from which on the mean curve stays above; None if it ends below.
        throughout: Whether that is the first step that both have.
        last: Difference of the curves at the last step, with its interval.
        length: The last step that both reach.
        trainings: Numbers of trainings with and without transfer.
    """

    verdict: str
    since: int | None
    throughout: bool
    last: Interval
    length: int
    trainings: tuple[int, int]

    @property
    def course(self) -> str:
        """Where the mean curve with transfer is above, in words."""
        if self.since is None:
            return "ends below, or level"
        where = "in all of phase II" if self.throughout else f"from step {self.since:,} on"
        return f"is above {where}"


def smoothed(curves: pd.DataFrame, metric: str) -> pd.DataFrame:
    """The exponential moving average of every training, started again in every phase.

    For evaluations x(t) it is e(t) = (1 - ALPHA) e(t - 1) + ALPHA x(t). At the first evaluation of
    a phase e = x, because the missions of different phases cannot be compared.

    Returns:
        A row per evaluation: ``variant``, ``seed``, ``phase``, ``updates``, ``value``.
    """
    keys = ["variant", "seed", "phase"]
    averages = curves.groupby(keys, sort=False)[metric].transform(_average)
    return curves[[*keys, "updates"]].assign(value=averages)


def pairs_in(curves: pd.DataFrame) -> dict[str, tuple[str, str]]:
    """Those of ``PAIRS`` that have trainings of both variants."""
    variants = {*curves["variant"]}
    return {name: pair for name, pair in PAIRS.items() if {*pair} <= variants}


def last_phase(averages: pd.DataFrame, variant: str) -> pd.DataFrame:
    """The (steps, trainings) averages of a variant in its last phase, at their common steps."""
    curves = averages[averages["variant"] == variant]
    curves = curves[curves["phase"] == curves["phase"].iloc[-1]]
    return curves.pivot(index="updates", columns="seed", values="value").dropna()


def transfer(
    averages: pd.DataFrame, using: str, without: str, shortest: int, level: float = BAND
) -> Transfer:
    """Whether a variant with transfer learning overtakes the one without it and ends higher.

    They are compared in the last phase of both, in which both train in missions with battery
    decrease.

    Args:
        averages: Rows of ``smoothed``.
        using: The variant with transfer learning.
        without: The variant without it.
        shortest: Trainings of fewer steps are inconclusive.
        level: Confidence level of the last difference.
    """
    a, b = (last_phase(averages, variant) for variant in (using, without))
    steps = a.index.intersection(b.index)
    lead = a.loc[steps].mean(axis=1) - b.loc[steps].mean(axis=1)
    behind = np.flatnonzero(lead <= 0)
    first = behind[-1] + 1 if len(behind) else 0
    since = int(steps[first]) if first < len(steps) else None
    last = difference(a.loc[steps[-1]].to_numpy(), b.loc[steps[-1]].to_numpy(), level)[0]
    length = int(steps[-1])
    verdict = judged(above(last)) if length >= shortest else INCONCLUSIVE
    return Transfer(verdict, since, not len(behind), last, length, (a.shape[1], b.shape[1]))


def transfers(
    curves: pd.DataFrame, metrics: Iterable[str], shortest: int
) -> dict[tuple[str, str], Transfer]:
    """``transfer`` of all pairs of variants, by the name of the pair and the metric."""
    averages = {metric: smoothed(curves, metric) for metric in metrics}
    return {
        (name, metric): transfer(averages[metric], *pair, shortest)
        for name, pair in pairs_in(curves).items()
        for metric in averages
    }


def settled(averages: pd.Series, margin: float) -> int:
    """The position from which on the averages stay within a margin of the last one."""
    far = np.flatnonzero((averages - averages.iloc[-1]).abs() > margin)
    return int(far[-1]) + 1 if len(far) else 0


def transfer_table(
    transfers: Mapping[tuple[str, str], Transfer], verdicts: Mapping[tuple[str, str], str]
) -> pd.DataFrame:
    """Trainings with transfer learning compared with those without, as a table of text.

    Args:
        transfers: The result of ``transfers``, by the name of the pair and the metric.
        verdicts: The verdict on each.
    """
    rows = []
    for (name, metric), compared in transfers.items():
        last, named = compared.last, "Reward" if metric == REWARD else "Product"
        write = numbers.points if metric == PRODUCT else _rewards
        difference_at_end = write(*last)
        if last.low == last.high:
            difference_at_end = f"{difference_at_end.split()[0]}, the same in all trainings"
        n = "{} and {}".format(*compared.trainings)
        found = named, verdicts[name, metric], compared.course, difference_at_end
        rows.append((name[0].upper() + name[1:], n, *found))
    head = ["Trainings with", "n", "Metric", "Verdict", "With transfer, the mean curve"]
    return pd.DataFrame(rows, columns=[*head, "Difference at the end"])


def _rewards(*ends: float) -> str:
    return numbers.with_ends(lambda value: numbers.minus(f"{value:+.0f}"), *ends)


def _average(values: pd.Series) -> pd.Series:
    return values.ewm(alpha=ALPHA, adjust=False).mean()
