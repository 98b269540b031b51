"""Learners compared with a baseline: training and mission as crossed random factors.

The result of a training is random, so a claim about a learner needs several trainings:

    compare_learners(results.missions, {"ddqn": ["ddqn", "ddqn-2", "ddqn-3"]}, "greedy")
"""

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd
import scipy

from dess import InputError
from dess.analysis.metrics import Metric, metric_group
from dess.analysis.stats.corrections import Correction, add_adjusted
from dess.analysis.stats.differences import (
    add_rare_pairs,
    difference_test,
    differences_of,
    range_of_difference,
    rare_differences,
    sign_test,
    t_test,
)
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.matching import (
    check_same_missions,
    group_key,
    match_groups,
    metrics_by_group,
    metrics_by_treatment,
    select_table,
)
from dess.analysis.stats.rows import check_share

# What a comparison is about: all trainings of the learner, or the only one that there is.
LEARNER, CHECKPOINT = "the learner", "this checkpoint"

_ENDS = ("low", "high", "new_low", "new_high")


class Crossed(NamedTuple):
    """A learner with S trainings on R missions: the mean difference, intervals, and variances.

    ``low`` and ``high`` bound the expected difference of the learner's trainings, ``new_low`` and
    ``new_high`` that of one new training. The standard deviations are those of the trainings, of
    the missions, and of the rest. ``p_student`` is the p-value without what is added for rare
    failures.
    """

    difference: float
    low: float
    high: float
    new_low: float
    new_high: float
    p: float
    p_student: float
    training_sd: float
    mission_sd: float
    rest_sd: float


def compare_crossed(differences: np.ndarray, level: float = LEVEL) -> Crossed:
    """The mean difference of a learner, with training and mission as crossed random factors.

    The model d = mu + training + mission + rest has one observation per cell. The mean squares give
    the variance components, with negative ones set to 0. The half-width is the root of the sum of
    squares of two parts (Graybill and Wang 1980): Student's t on the means of the S trainings,
    which includes the rest, and the part of the missions, which all trainings share. It is at least
    the half-width for these S trainings alone. Simulations show that the coverage is at the level
    or above for two or more trainings, whichever part dominates.

    Args:
        differences: (S, R) differences of training s on mission r from the same baseline.
        level: Confidence level.

    Returns:
        The intervals, the p-value of "no expected difference", and the components as standard
        deviations. If all differences are equal, the intervals are degenerate and p is that of the
        sign test over the trainings, 2^(1 - S). With a single training, the interval is about this
        training only (Student's t over the missions); the interval for a new training and the
        deviations of training and rest are nan (unknown). With a single mission, all is nan but the
        difference and p, which is 1.
    """
    d = np.asarray(differences, float)
    trainings, missions = d.shape
    of_missions, p = t_test(d.mean(axis=0), level)  # for these trainings alone
    mean = of_missions.mean
    if trainings == 1 or missions == 1:
        spread = np.nan
        if missions > 1:
            spread = float(d.std(ddof=1))
        return Crossed(*of_missions, np.nan, np.nan, p, p, np.nan, spread, np.nan)
    if np.ptp(d) == 0:
        sign = sign_test(d[:, 0])
        return Crossed(*of_missions, mean, mean, sign, sign, 0.0, 0.0, 0.0)
    row = d.mean(axis=1, keepdims=True)
    column = d.mean(axis=0, keepdims=True)
    rest = float(np.sum((d - row - column + mean) ** 2)) / (trainings - 1) / (missions - 1)
    between = float(row.var(ddof=1))  # Var(training) + Var(rest) / R
    shared = max(float(column.var(ddof=1)) - rest / trainings, 0.0)  # Var(mission)
    sems = np.sqrt([between / trainings, shared / missions])
    new_sems = np.sqrt([between / trainings + between, shared / missions])

    def half(sems: np.ndarray, alpha: float) -> float:
        return float(np.hypot(*sems * scipy.stats.t.isf(alpha / 2, [trainings - 1, missions - 1])))

    ends = max(half(sems, 1 - level), of_missions.high - mean)
    new = max(half(new_sems, 1 - level), ends)
    if sems.any():
        p = max(p, _alpha_of(lambda alpha: half(sems, alpha), abs(mean)))
    deviations = np.sqrt([max(between - rest / missions, 0.0), shared, rest])
    around = mean - ends, mean + ends, mean - new, mean + new
    return Crossed(mean, *around, p, p, *deviations.tolist())


def compare_learners(
    missions: pd.DataFrame,
    learners: Mapping[str, Sequence[str]],
    baseline: str,
    metrics: Sequence[str] = (*metric_group("paper", "reward"),),
    by: Sequence[str] = (),
    level: float = LEVEL,
    correction: Correction | None = "holm",
) -> pd.DataFrame:
    """Compare learners, each with checkpoints of several trainings, with a baseline policy.

    The result of a training is random. So a claim about a learner needs checkpoints of several
    training seeds; one checkpoint supports only claims about this checkpoint.

    Args:
        missions: A row per mission; the checkpoints and the baseline have the same missions.
        learners: For each learner the policies that are its checkpoints. All of them are needed,
            because choosing the best of several trainings would bias the comparison.
        baseline: The policy to compare with; it is not treated as random.
        metrics: Columns of numbers.
        by: Columns whose values form groups of missions, compared one by one.
        level: Confidence level of each interval.
        correction: Correction of the p-values over all rows, as for
            ``corrections.adjust_p_values``.

    Returns:
        A row per learner, group and metric: ``learner``, ``baseline``, the columns ``by``,
        ``metric``, ``about``, the fields of ``Crossed``, after ``p`` ``p_adjusted``, ``trainings``
        and ``n``, the number of missions (of replications, where ``compare`` would take means).
        ``about`` says what ``low``, ``high`` and ``p`` are about: the expected difference over all
        trainings of ``the learner``, or ``this checkpoint``, the only one there is. ``new_low`` and
        ``new_high`` bound the difference of one new training. Rare differences are added as in
        ``compare_pairs``.

    Raises:
        InputError: If a policy or a metric is unknown, a mission is there twice, or a learner has
            no checkpoint, or one twice.
    """
    check_share("level", level)
    tables = metrics_by_treatment(missions, "policy", metrics, by)
    reference = select_table(tables, "policy", baseline)
    rows = []
    measures = metrics_by_group(missions, metrics, by)
    for learner, checkpoints in learners.items():
        if not checkpoints or len(set(checkpoints)) < len(checkpoints) or baseline in checkpoints:
            raise InputError(
                f"learner {learner}",
                f"checkpoints {', '.join(checkpoints) or 'none'}",
                f"one or more, all distinct, without the baseline {baseline}",
            )
        trained = [select_table(tables, "policy", checkpoint) for checkpoint in checkpoints]
        for checkpoint in checkpoints:
            check_same_missions(tables, checkpoint, baseline)
        for group, (b, *parts) in match_groups([reference, *trained], by):
            for metric in metrics:
                of_learner = np.stack([a[metric] for a in parts])
                result, differences = _compare_learner(
                    of_learner, b[metric], measures[metric, *group_key(group)], level
                )
                if len(parts) > 1:
                    about = LEARNER
                else:
                    about = CHECKPOINT
                labels = (learner, baseline, *group, metric, about)
                rows.append((*labels, *result, *differences.shape))
    columns = ["learner", "baseline", *by, "metric", "about", *Crossed._fields, "trainings", "n"]
    return add_adjusted(pd.DataFrame(rows, columns=columns), correction)


def _compare_learner(
    a: np.ndarray, b: np.ndarray, metric: Metric, level: float
) -> tuple[Crossed, np.ndarray]:
    """A learner (S, R) compared with a baseline (R,) by a metric, and the differences."""
    differences = differences_of(a, b)
    result = compare_crossed(differences, level)
    if len(a) == 1:
        mean, p = difference_test(a[0], b, metric, level)
        if metric.is_outcome:
            result = result._replace(p_student=p)
        return result._replace(low=mean.low, high=mean.high, p=p), differences
    rare = rare_differences(metric, a.mean(), b.mean())
    if rare is None or (b.size == 1 and not metric.is_bounded):
        return result, differences
    smooth = compare_crossed(add_rare_pairs(differences, rare), level)
    limits = range_of_difference(metric)
    ends = {name: float(np.clip(getattr(smooth, name), *limits)) for name in _ENDS}
    return result._replace(**ends, p=smooth.p), differences


def _alpha_of(half: Callable[[float], float], distance: float) -> float:
    """The p-value of an interval: the alpha at which its half-width equals a distance."""

    def excess(exponent: float) -> float:
        return half(10**exponent) - distance

    lowest = -100.0  # quantiles of Student's t are still exact here
    if excess(lowest) <= 0:
        return 0.0
    if distance:
        return float(10 ** scipy.optimize.brentq(excess, lowest, 0.0))
    return 1.0
