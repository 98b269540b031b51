"""Learning curves: smoothed, with bands over trainings, and what a means of learning is worth.

A training is the unit: trainings of one variant differ in their seed alone, and intervals hold for
trainings to come. One training says nothing of the spread.

Curves are tables with a row per evaluation while training: ``variant``, ``seed`` (of the training),
``updates`` (the training step), ``phase`` (of the paper's Algorithm 1; the last is the mission
itself), the evaluated metrics, and the ``final_...`` metrics of the weights that were kept.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import pandas as pd
from scipy import stats

from analysis.replication.paper import CROSSING
from analysis.stats.correction import adjust
from analysis.stats.intervals import LEVEL, Interval, mean_interval
from analysis.stats.verdict import INCONCLUSIVE, above, judged

# Weight of the newest evaluation in the exponential moving average.
ALPHA = 0.5
# Level of the band of the paper's Fig. 3.
BAND = 0.99
# Trainings that a band takes: Student's t for two is 64 standard errors wide at 99 %.
FEWEST = 3


@dataclass(frozen=True)
class Transfer:
    """How trainings with transfer learning compare to those without it.

    Attributes:
        verdict: Of ``verdicts``, whether the mean curve with transfer ends above, by the interval
            of the last difference; ``INCONCLUSIVE`` if the trainings are too short to tell.
        since: The first training step from which the mean curve stays above; none if it ends below.
        throughout: Whether that is the first step that both can be compared at.
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


def smoothed(curves: pd.DataFrame, metric: str) -> pd.DataFrame:
    """The exponential moving average of every training, begun anew in every phase.

    With x(t) an evaluation, e(t) = (1 - ALPHA) e(t - 1) + ALPHA x(t), and e = x at the first of a
    phase: what is flown in one phase is no measure of the next.

    Returns:
        A row per evaluation: ``variant``, ``seed``, ``phase``, ``updates``, ``value``.
    """
    keys = ["variant", "seed", "phase"]
    averages = curves.groupby(keys, sort=False)[metric].transform(
        lambda values: values.ewm(alpha=ALPHA, adjust=False).mean()
    )
    return curves[[*keys, "updates"]].assign(value=averages)


def bands(averages: pd.DataFrame, level: float = BAND) -> pd.DataFrame:
    """Means with intervals over the trainings of a variant, at every training step.

    Args:
        averages: Rows of ``smoothed``.
        level: Confidence level.

    Returns:
        A row per variant, phase and step: ``variant``, ``phase``, ``updates``, ``mean``, ``low``,
        ``high`` (nan with fewer than ``FEWEST`` trainings) and ``n``, the number of trainings.
    """
    keys = ["variant", "phase", "updates"]
    rows = []
    for key, part in averages.groupby(keys, sort=False):
        mean, *ends = mean_interval(part["value"].to_numpy(), level)
        if len(part) < FEWEST:
            ends = [np.nan, np.nan]
        rows.append((*key, mean, *ends, len(part)))
    return pd.DataFrame(rows, columns=[*keys, "mean", "low", "high", "n"])


def transfer(
    averages: pd.DataFrame,
    using: str,
    without: str,
    level: float = BAND,
    shortest: int = CROSSING,
) -> Transfer:
    """Whether a variant with transfer learning passes the one without it and ends higher.

    They are compared where both fly the mission itself: in the last phase of both.

    Args:
        averages: Rows of ``smoothed``.
        using: The variant with transfer learning.
        without: The variant without it.
        level: Confidence level of the last difference.
        shortest: Steps below which trainings cannot tell; the paper's crossing.
    """
    a, b = (_last_phase(averages, variant) for variant in (using, without))
    steps = a.index.intersection(b.index)
    lead = a.loc[steps].mean(axis=1) - b.loc[steps].mean(axis=1)
    behind = np.flatnonzero(lead <= 0)
    first = behind[-1] + 1 if len(behind) else 0
    since = int(steps[first]) if first < len(steps) else None
    last = difference(a.loc[steps[-1]].to_numpy(), b.loc[steps[-1]].to_numpy(), level)[0]
    length = int(steps[-1])
    verdict = judged(above(last)) if length >= shortest else INCONCLUSIVE
    return Transfer(verdict, since, not len(behind), last, length, (a.shape[1], b.shape[1]))


def finals(curves: pd.DataFrame) -> pd.DataFrame:
    """The last row of every training: it has the metrics of the weights that were kept."""
    return curves.groupby(["variant", "seed"], sort=False, as_index=False).last()


def ablation(last: pd.DataFrame, metric: str, baseline: str, level: float = LEVEL) -> pd.DataFrame:
    """What every variant reaches in the end, and its difference to the baseline.

    Args:
        last: Rows of ``finals``.
        metric: The column of the final metric.
        baseline: The variant that the others are compared with.
        level: Confidence level.

    Returns:
        A row per variant, in order of appearance: ``variant``, ``n`` trainings, ``mean``, ``low``,
        ``high`` (nan with one training), ``difference``, ``difference_low``, ``difference_high``,
        ``p`` and ``p_adjusted`` (Holm), of ``difference``; nan for the baseline.
    """
    values = {variant: part[metric].to_numpy() for variant, part in _variants(last)}
    rows = []
    for variant, own in values.items():
        mean, *ends = mean_interval(own, level) if len(own) > 1 else (own[0], np.nan, np.nan)
        beside = (Interval(*3 * [np.nan]), np.nan)
        if variant != baseline:
            beside = difference(own, values[baseline], level)
        rows.append((variant, len(own), mean, *ends, *beside[0], beside[1]))
    columns = ["variant", "n", "mean", "low", "high"]
    columns += ["difference", "difference_low", "difference_high", "p"]
    table = pd.DataFrame(rows, columns=columns)
    known = table["p"].notna()
    table.loc[known, "p_adjusted"] = adjust(table.loc[known, "p"].to_numpy(), "holm")
    return table


def difference(
    a: Sequence[float] | np.ndarray, b: Sequence[float] | np.ndarray, level: float = LEVEL
) -> tuple[Interval, float]:
    """Difference of two means of independent trainings, with its interval and p-value.

    Welch's t. Where one of the two is a single training, Student's t with the spread of the other:
    the interval then holds 0 if one more training of the other might have come out like that.

    Returns:
        The interval (nan ends where both are single trainings; degenerate where neither has any
        spread) and the p-value (1 where there is none).
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    gap = float(a.mean() - b.mean())
    if a.size + b.size < 3:
        return Interval(gap, np.nan, np.nan), 1.0
    if np.ptp(a) == np.ptp(b) == 0:
        return Interval(gap, gap, gap), 1.0
    test = stats.ttest_ind(a, b, equal_var=min(a.size, b.size) == 1)
    ends = test.confidence_interval(level)
    return Interval(gap, float(ends.low), float(ends.high)), float(test.pvalue)


def settled(curve: pd.DataFrame, metric: str, margin: float) -> pd.Series:
    """The first evaluation of the last phase from which on the average stays near its last value.

    Args:
        curve: The curve of one training.
        metric: What is averaged, as by ``smoothed``.
        margin: How near.

    Returns:
        The row of the curve.
    """
    own = curve[curve["phase"] == curve["phase"].iloc[-1]]
    averages = own[metric].ewm(alpha=ALPHA, adjust=False).mean()
    far = np.flatnonzero((averages - averages.iloc[-1]).abs() > margin)
    return own.iloc[far[-1] + 1 if len(far) else 0]


def _variants(last: pd.DataFrame) -> Iterator[tuple[str, pd.DataFrame]]:
    yield from last.groupby("variant", sort=False)


def _last_phase(averages: pd.DataFrame, variant: str) -> pd.DataFrame:
    """(steps, trainings) averages of a variant in its last phase."""
    own = averages[averages["variant"] == variant]
    own = own[own["phase"] == own["phase"].iloc[-1]]
    return own.pivot(index="updates", columns="seed", values="value").dropna()
