"""Which of several alternatives may be the best, on common replications.

With probability ``LEVEL``, the truly best is among those that are not ``WORSE``. Of these, some are
worse in what was seen: Student's t rules them out, and only a rare failure, which no mission has
shown, may make them the best.
"""

from typing import Any

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from dess.analysis.metrics import Metric, metric_of
from dess.analysis.stats.differences import rare_differences
from dess.analysis.stats.kinds import LEVEL, level_after
from dess.analysis.stats.verdict import SEEN_WORSE, WORSE

# How an alternative compares with all others by a metric, beside ``SEEN_WORSE`` and ``WORSE``.
BEST, SEEN_BEST, TIED, ONLY = "best", "best in what was seen", "tied", "only"


def within_reach(low: pd.Series, high: pd.Series, metric: Metric) -> pd.Series:
    """The settings whose interval does not lie wholly on the worse side of another one.

    Paired tests alone cannot tell a setting of few missions from one of many: they see only the
    replications of both.

    Args:
        low: (K,) lower ends of the intervals; nan if unknown.
        high: (K,) upper ends.
        metric: The metric.
    """
    if metric.less_is_better:
        return ~(low > high.min())
    return ~(high < low.max())


_BLOCK = 512  # settings that are compared with all others at once, which limits the memory
_ROUNDING = 1e-12  # variances and differences below this, relative to the values, count as 0


def judge_alternatives(
    values: np.ndarray,
    low: pd.Series,
    high: pd.Series,
    metric: Metric,
    analyses: np.ndarray,
    left: np.ndarray | None = None,
) -> np.ndarray:
    """How each of several alternatives compares with all others, on common replications.

    With probability ``LEVEL``, the truly best is among those that are not ``WORSE``. Those of them
    that Student's t alone rules out are worse in what was seen: a rare failure is not ruled out.

    Args:
        values: (R, K) values of K alternatives, as ``may_be_best`` takes them.
        low: (K,) lower ends of the intervals of their means.
        high: (K,) upper ends.
        metric: The metric; the ends of its range may be (K,) arrays.
        analyses: (K,) how often a search could have ended the missions of each.
        left: (K,) those that a selection has not ruled out; the others are ``WORSE``. By default
            all.

    Returns:
        (K,) of ``BEST``, ``SEEN_BEST``, ``TIED``, ``SEEN_WORSE``, ``WORSE``; ``ONLY`` if there is
        no other one.
    """
    if values.shape[1] == 1:
        return np.array([ONLY], object)
    if left is not None and not left.all():
        verdicts = np.full(values.shape[1], WORSE, object)
        those = values[:, left], low[left], high[left], metric.at(left), analyses[left]
        verdicts[left] = judge_alternatives(*those)
        verdicts[verdicts == ONLY] = BEST
        return verdicts
    may_be = may_be_best(values, metric, analyses) & within_reach(low, high, metric).to_numpy()
    leads = may_be & may_be_best(values, metric, analyses, allowance=False)
    if not leads.any():
        leads = may_be
    first = TIED
    if may_be.sum() == 1:
        first = BEST
    elif leads.sum() == 1:
        first = SEEN_BEST
    return np.select([leads, may_be], [first, SEEN_WORSE], WORSE).astype(object)


def may_lead(verdicts: np.ndarray) -> np.ndarray:
    """Which of the verdicts of ``judge_alternatives`` are on what may be the best, as was seen."""
    return ~np.isin(verdicts.astype(str), (SEEN_WORSE, WORSE))


def may_be_best(
    values: np.ndarray,
    metric: str | Metric = "",
    analyses: np.ndarray | None = None,
    allowance: bool = True,
) -> np.ndarray:
    """The settings that no other setting is significantly better than.

    With probability ``LEVEL``, the setting with the highest true mean is among them, for all
    variances and correlations. A setting is ruled out if any other one is better by a one-sided
    paired t test at the level (1 - LEVEL) / (K - 1). This is the subset selection of Gupta (1965,
    Technometrics; see also Hsu 1984, Annals of Statistics) with Bonferroni's bound for settings
    that share their random numbers (Nelson, Swann, Goldsman and Song 2001, Operations Research).
    After a search, whose numbers of missions depend on their results, each pair is tested at the
    error of its interim analysis (``kinds.level_after``).

    Args:
        values: (R, K) values of K settings in R replications; nan means that a setting lacks a
            replication. Two settings are compared on the replications of both.
        metric: The metric, by default one of which more is better. Its rare differences are
            added, as in ``dess.analysis.compare``. The ends of its range may be (K,) arrays.
        analyses: (K,) how often a search could have ended the missions of each setting; by default
            their number is fixed.
        allowance: Whether the rare differences are added. Without them, the settings are those that
            may be the best by what was seen, and the probability above is lower.

    Returns:
        (K,) of bool. A setting that has fewer than two replications in common with every other one
        is not ruled out.
    """
    measure = metric_of(metric)
    present = np.isfinite(values)
    means = np.nansum(values, axis=0) / np.maximum(present.sum(axis=0), 1)
    if measure.less_is_better:
        values = -values
    # What a replication adds to all settings cancels in their differences.
    centre = np.nanmean(np.where(present.any(1, keepdims=True), values, 0.0), axis=1, keepdims=True)
    centred = np.where(present, values - centre, 0.0)
    mask = present.astype(float)
    if analyses is None:
        analyses = np.zeros(values.shape[1], int)
    error_of_policy = (1 - LEVEL) / max(values.shape[1] - 1, 1) / measure.among
    blocks = [slice(b, b + _BLOCK) for b in range(0, values.shape[1], _BLOCK)]
    rare: list[Any] = [None] * len(blocks)
    if allowance:
        rare = [_rare_leads(measure, means, block) for block in blocks]
    # The missions that a pair shares end with those of the setting that has fewer.
    shared = [np.minimum(analyses[block, None], analyses) for block in blocks]
    alphas = [1 - level_after(of_pairs, 1 - error_of_policy) for of_pairs in shared]
    parts = [
        _unbeaten_settings(block, added, centred, mask, alpha)
        for block, added, alpha in zip(blocks, rare, alphas, strict=True)
    ]
    if parts:
        return np.concatenate(parts)
    return np.zeros(0, bool)


def _rare_leads(
    metric: Metric, means: np.ndarray, block: slice
) -> tuple[np.ndarray, np.ndarray] | None:
    """The rare differences by which all others are ahead of the settings of a block, and behind."""
    rows = (block, None)
    rare = rare_differences(metric, means, means[rows], metric.at(rows))
    if rare is None or not metric.less_is_better:
        return rare
    return -rare[1], -rare[0]


def _unbeaten_settings(
    block: slice,
    rare: tuple[np.ndarray, np.ndarray] | None,
    values: np.ndarray,
    mask: np.ndarray,
    alpha: np.ndarray,
) -> np.ndarray:
    """Which settings of a block are not ruled out by any other setting.

    ``rare`` has the differences that are added, of the other settings minus those of the block, and
    ``alpha`` the errors of the tests.
    """
    block_values = values[:, block]
    block_mask = mask[:, block]
    n = block_mask.T @ mask
    lead = (
        block_mask.T @ values - block_values.T @ mask
    )  # of the other settings, summed over common replications
    squares = block_mask.T @ values**2 + (block_values**2).T @ mask
    spread = np.maximum(squares - 2 * block_values.T @ values, 0.0)
    if rare is not None:
        n = n + 2 * (n > 1)
        lead = lead + rare[0] + rare[1]
        more = rare[0] ** 2 + rare[1] ** 2
        spread = spread + more
        squares = squares + more
    with np.errstate(divide="ignore", invalid="ignore"):
        deviations = spread - lead**2 / n
        constant = deviations <= _ROUNDING * squares
        t = lead / np.sqrt(n * deviations / (n - 1))
        ahead = lead > np.sqrt(_ROUNDING * squares * n)
    counts, of_count = np.unique(n, return_inverse=True)
    errors, of_error = np.unique(alpha, return_inverse=True)
    quantiles = -stdtrit(np.maximum(counts - 1, 1)[:, None], errors)
    critical = quantiles[of_count.reshape(n.shape), of_error.reshape(n.shape)]
    # Use the sign test where all differences are equal.
    beaten = np.where(constant, ahead & (0.5**n <= alpha), t > critical)
    return ~(beaten & (n > 1)).any(axis=1)
