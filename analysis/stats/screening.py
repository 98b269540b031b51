"""Subset selection: the settings that may be the best, as no other is significantly better."""

import numpy as np
from scipy import stats

from analysis.names import LESS_IS_BETTER
from analysis.stats.bounded import rare_differences
from analysis.stats.intervals import LEVEL, check_share

_BLOCK = 512  # settings that are compared with all others at once, which limits the memory
_ROUNDING = 1e-12  # variances and differences below this, relative to the values, count as 0


def may_be_best(values: np.ndarray, metric: str = "", level: float = LEVEL) -> np.ndarray:
    """The settings that no other setting is significantly better than.

    With probability ``level``, the setting with the highest true mean is among them, for all
    variances and correlations. A setting is ruled out if any other one is better by a one-sided
    paired t test at the level (1 - level) / (K - 1). This is the subset selection of Gupta (1965,
    Technometrics; see also Hsu 1984, Annals of Statistics) with Bonferroni's bound for settings
    that share their random numbers (Nelson, Swann, Goldsman and Song 2001, Operations Research). It
    assumes that the number of missions does not depend on their results.

    Args:
        values: (R, K) values of K settings in R replications; nan means that a setting lacks a
            replication. Two settings are compared on the replications of both.
        metric: The metric, of which more is better but for those of ``LESS_IS_BETTER``. Its rare
            differences are added, as in ``analysis.compare``.
        level: The probability.

    Returns:
        (K,) of bool. A setting that has fewer than two replications in common with every other one
        is not ruled out.

    Raises:
        InputError: If the level is not between 0 and 1.
    """
    check_share("level", level)
    present = np.isfinite(values)
    values = -values if metric in LESS_IS_BETTER else values
    means = np.nansum(values, axis=0) / np.maximum(present.sum(axis=0), 1)
    # What a replication adds to all settings cancels in their differences.
    centre = np.nanmean(np.where(present.any(1, keepdims=True), values, 0.0), axis=1, keepdims=True)
    centred, mask = np.where(present, values - centre, 0.0), present.astype(float)
    alpha = (1 - level) / max(values.shape[1] - 1, 1)
    blocks = [slice(b, b + _BLOCK) for b in range(0, values.shape[1], _BLOCK)]
    rare = [rare_differences(metric, means, means[block, None]) for block in blocks]
    parts = [_unbeaten(*of, centred, mask, alpha) for of in zip(blocks, rare, strict=True)]
    return np.concatenate(parts) if parts else np.zeros(0, bool)


def _unbeaten(
    block: slice,
    rare: tuple[np.ndarray, np.ndarray] | None,
    values: np.ndarray,
    mask: np.ndarray,
    alpha: float,
) -> np.ndarray:
    """Which settings of a block are not ruled out by any other setting.

    ``rare`` has the differences that are added, of the other settings minus those of the block.
    """
    own, here = values[:, block], mask[:, block]
    n = here.T @ mask
    lead = here.T @ values - own.T @ mask  # of the other settings, summed over common replications
    squares = here.T @ values**2 + (own**2).T @ mask
    spread = np.maximum(squares - 2 * own.T @ values, 0.0)
    if rare is not None:
        n, lead, more = n + 2 * (n > 1), lead + rare[0] + rare[1], rare[0] ** 2 + rare[1] ** 2
        spread, squares = spread + more, squares + more
    with np.errstate(divide="ignore", invalid="ignore"):
        deviations = spread - lead**2 / n
        constant = deviations <= _ROUNDING * squares
        t = lead / np.sqrt(n * deviations / (n - 1))
        ahead = lead > np.sqrt(_ROUNDING * squares * n)
    counts, places = np.unique(n, return_inverse=True)
    critical = stats.t.isf(alpha, np.maximum(counts - 1, 1))[places].reshape(n.shape)
    # Use the sign test where all differences are equal.
    beaten = np.where(constant, ahead & (0.5**n <= alpha), t > critical)
    return ~(beaten & (n > 1)).any(axis=1)
