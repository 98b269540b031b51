"""Verdicts that follow from intervals and tests, with the words and marks for them.

An estimate is ``ABOVE`` or ``BELOW`` a reference if its whole interval is, else ``INCONCLUSIVE``:

    >>> position_of(Interval(0.2, 0.1, 0.3))
    'above'

The intervals of differences allow for failures that are too rare to be in the missions. Where they
contain 0 only because of this allowance, the difference lies on one side *in what was seen*:

    >>> position_with_allowance(ABOVE, without=ABOVE), position_with_allowance(INCONCLUSIVE, ABOVE)
    ('above', 'above in what was seen')

A part of a claim is shown (True), refuted (False) or open (None), by a complete interval. Of
several alternatives, some may be the best, and some are on the front of two metrics.
"""

from typing import Any

import numpy as np
import pandas as pd
from scipy.special import stdtrit

from dess.analysis.metrics import Metric, metric_of
from dess.analysis.stats.intervals import LEVEL, Interval, level_after, rare_differences

ABOVE, INCONCLUSIVE, BELOW = "above", "inconclusive", "below"
SEEN_ABOVE, SEEN_BELOW = "above in what was seen", "below in what was seen"
# In tables.
MARKS = {ABOVE: "▲", SEEN_ABOVE: "△", INCONCLUSIVE: "≈", SEEN_BELOW: "▽", BELOW: "▼"}
# What is to be said of a difference that is shown in what was seen, and no further.
NOT_RULED_OUT = "a rare failure is not ruled out"
# How an alternative compares with all others by a metric.
BEST, SEEN_BEST, TIED = "best", "best in what was seen", "tied"
SEEN_WORSE, WORSE, ONLY = "worse in what was seen", "worse", "only"
HOLDS, IN_PART, REFUTED = "holds", "holds in part", "does not hold"

Part = bool | None


def position_of(interval: Interval, reference: float = 0.0) -> str:
    """Whether a complete interval is above a reference, below it, or contains it.

    Args:
        interval: The interval, or a row of a table of estimates, with ``low`` and ``high``.
        reference: The reference.

    Returns:
        ``ABOVE``, ``BELOW`` or ``INCONCLUSIVE``; also ``INCONCLUSIVE`` if an end is nan.
    """
    if interval.low > reference:
        return ABOVE
    if interval.high < reference:
        return BELOW
    return INCONCLUSIVE


def position_with_allowance(whole: str, without: str) -> str:
    """The verdict on a difference, from its position with the allowance for failures and without.

    Args:
        whole: The position by the complete interval, or by its p-value.
        without: The position by Student's interval, or by its p-value.

    Returns:
        ``whole``, or where that is ``INCONCLUSIVE`` the side in what was seen, if there is one.
    """
    sides = {ABOVE: SEEN_ABOVE, BELOW: SEEN_BELOW}
    if whole == INCONCLUSIVE:
        return sides.get(without, INCONCLUSIVE)
    return whole


def judge_difference(row: Any) -> str:
    """The verdict on a paired difference by its intervals with the allowance and without.

    An interval without a length tells nothing about the variance, so the test has to show the
    difference as well.

    Args:
        row: A row of ``dess.analysis.compare``: ``difference``, ``low``, ``high``, ``p``,
            ``student`` and ``p_student``.

    Returns:
        One of the keys of ``MARKS``.
    """
    whole = INCONCLUSIVE
    if row.low < row.high or row.p <= 1 - LEVEL:
        whole = position_of(row)
    return position_with_allowance(whole, position_by_test(row.difference, row.p_student))


def judge_by_tests(rows: pd.DataFrame) -> list[str]:
    """The verdicts on paired differences by their adjusted p-values.

    Args:
        rows: Rows of ``dess.analysis.compare``, or of ``compare_learners``.

    Returns:
        For each row one of the keys of ``MARKS``.
    """
    whole = map(position_by_test, rows["difference"], rows["p_adjusted"])
    without = map(position_by_test, rows["difference"], rows["p_student_adjusted"])
    return [*map(position_with_allowance, whole, without)]


def position_by_test(difference: float, p: float, level: float = LEVEL) -> str:
    """On which side of 0 a difference lies by its (adjusted) p-value.

    Returns:
        ``ABOVE``, ``BELOW`` or ``INCONCLUSIVE``.
    """
    significant = p <= 1 - level
    if significant and difference > 0:
        return ABOVE
    if significant and difference < 0:
        return BELOW
    return INCONCLUSIVE


def verdict_above(interval: Interval, bound: float = 0.0) -> Part:
    """Whether something is above a bound."""
    return {ABOVE: True, BELOW: False}.get(position_of(interval, bound))


def judge_parts(*parts: Part) -> str:
    """The verdict on a claim of several parts.

    The claim holds if all parts are shown, and holds in part if some are. It does not hold if none
    is shown and one is refuted.
    """
    if any(parts):
        return HOLDS if all(parts) else IN_PART
    if False in parts:
        return REFUTED
    return INCONCLUSIVE


_BATCH = 2**21  # weights at a time, which take some megabytes for every n


def on_front(costs: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Which settings are on the front.

    Args:
        costs: (..., k) costs of the settings; lower is better.
        values: (..., k) values of the metric; higher is better.

    Returns:
        (..., k) booleans. Settings that are equal in both are either all on the front, or none is.
    """
    order = np.lexsort((-values, costs), axis=-1)
    cost, value = (np.take_along_axis(table, order, -1) for table in (costs, values))
    best_before = np.full_like(value, -np.inf)
    best_before[..., 1:] = np.maximum.accumulate(value, axis=-1)[..., :-1]
    # Equal settings are neighbours now; the first of them decides for all.
    alike = np.zeros(value.shape, bool)
    alike[..., 1:] = (np.diff(cost) == 0) & (np.diff(value) == 0)
    first = np.maximum.accumulate(np.where(alike, 0, np.arange(value.shape[-1])), axis=-1)
    members = np.zeros(value.shape, bool)
    is_member = np.take_along_axis(value > best_before, first, -1)
    np.put_along_axis(members, order, is_member, -1)
    return members


def front_membership(
    costs: np.ndarray,
    values: np.ndarray,
    share: bool,
    generator: np.random.Generator,
    draws: int = 1000,
) -> np.ndarray:
    """The probability that each setting is on the front, given the missions.

    The method is the Bayesian bootstrap (D. B. Rubin, Annals of Statistics 9 (1981) 130-134). The
    missions get weights from a Dirichlet distribution. The weights are the same for all settings,
    which keeps the correlation by common random numbers. Failures may be so rare that a sample has
    none. Therefore half a success and half a failure with their own weights are added to each
    setting, so that the share of a single setting has its posterior distribution under the prior of
    Jeffreys.

    In 3,000 simulated problems of each of three kinds, whose true means were drawn independently,
    stated and true shares of membership differed by 0.005 on average, and by at most 0.06 in any
    bin of probabilities. The method assumes nothing about how a metric depends on the fleet. If
    every more expensive setting is truly better, but by less than the missions can show, the
    probabilities are too low.

    Args:
        costs: (k, n) costs; entry r of every setting belongs to the same replication, and is nan if
            the setting does not have this replication.
        values: (k, n) values of the metric, nan at the same places.
        share: Whether the metric is an outcome 0 or 1.
        generator: The random generator of the weights.
        draws: Number of fronts that are drawn.

    Returns:
        (k,) the share of the drawn fronts that contain the setting.
    """
    present = ~np.isnan(values)
    count = np.zeros(len(values))
    # Less the first one, equal costs stay equal, without rounding errors.
    base = np.array([row[is_present][0] for row, is_present in zip(costs, present, strict=True)])
    excess = np.where(present, costs - base[:, None], 0.0)
    observed = np.where(present, values, 0.0)
    mask = present.astype(float)
    batch = max(1, _BATCH // values.shape[1])
    for begin in range(0, draws, batch):
        size = min(batch, draws - begin)
        weights = generator.standard_exponential((size, values.shape[1]))
        # Not matrix products: their last bits would depend on the number of threads.
        total, cost, value = (
            np.einsum("bn,kn->bk", weights, table) for table in (mask, excess, observed)
        )
        more = np.zeros((2, 1, 1))
        if share:
            more = generator.standard_gamma(0.5, (2, size, len(values)))
        means = (value + more[0]) / (total + more.sum(axis=0))
        count += on_front(base + cost / total, means).sum(axis=0)
    return count / draws


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
    looks: np.ndarray,
    left: np.ndarray | None = None,
) -> np.ndarray:
    """How each of several alternatives compares with all others, on common replications.

    With probability ``LEVEL``, the truly best is among those that are not ``WORSE``. Those of them
    that Student's t alone rules out are worse in what was seen: a rare failure is not ruled out.

    Args:
        values: (R, K) values of K alternatives, as ``may_be_best`` takes them.
        low: (K,) lower ends of the intervals of their means.
        high: (K,) upper ends.
        metric: The metric.
        looks: (K,) how often a search could have ended the missions of each.
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
        those = values[:, left], low[left], high[left], metric, looks[left]
        verdicts[left] = judge_alternatives(*those)
        verdicts[verdicts == ONLY] = BEST
        return verdicts
    may_be = may_be_best(values, metric, looks) & within_reach(low, high, metric).to_numpy()
    leads = may_be & may_be_best(values, metric, looks, allowance=False)
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
    looks: np.ndarray | None = None,
    allowance: bool = True,
) -> np.ndarray:
    """The settings that no other setting is significantly better than.

    With probability ``LEVEL``, the setting with the highest true mean is among them, for all
    variances and correlations. A setting is ruled out if any other one is better by a one-sided
    paired t test at the level (1 - LEVEL) / (K - 1). This is the subset selection of Gupta (1965,
    Technometrics; see also Hsu 1984, Annals of Statistics) with Bonferroni's bound for settings
    that share their random numbers (Nelson, Swann, Goldsman and Song 2001, Operations Research).
    After a search, whose numbers of missions depend on their results, each pair is tested at the
    error of its look (``intervals.level_after``).

    Args:
        values: (R, K) values of K settings in R replications; nan means that a setting lacks a
            replication. Two settings are compared on the replications of both.
        metric: The metric, by default one of which more is better. Its rare differences are
            added, as in ``dess.analysis.compare``.
        looks: (K,) how often a search could have ended the missions of each setting; by default
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
    if looks is None:
        looks = np.zeros(values.shape[1], int)
    error_of_policy = (1 - LEVEL) / max(values.shape[1] - 1, 1) / measure.among
    blocks = [slice(b, b + _BLOCK) for b in range(0, values.shape[1], _BLOCK)]
    rare: list[Any] = [None] * len(blocks)
    if allowance:
        rare = [_rare_leads(measure, means, means[block, None]) for block in blocks]
    # The missions that a pair shares end with those of the setting that has fewer.
    shared = [np.minimum(looks[block, None], looks) for block in blocks]
    alphas = [1 - level_after(of_pairs, 1 - error_of_policy) for of_pairs in shared]
    parts = [
        _unbeaten_settings(block, added, centred, mask, alpha)
        for block, added, alpha in zip(blocks, rare, alphas, strict=True)
    ]
    if parts:
        return np.concatenate(parts)
    return np.zeros(0, bool)


def _rare_leads(
    metric: Metric, others: np.ndarray, own: np.ndarray
) -> tuple[np.ndarray, np.ndarray] | None:
    """The rare differences by which others are ahead of a setting, and behind it."""
    rare = rare_differences(metric, others, own)
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
