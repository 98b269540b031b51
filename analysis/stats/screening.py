"""Which of many settings may be the best: those that no other is significantly better than."""

import numpy as np
from scipy import stats

from analysis.stats.intervals import LEVEL, check_share

_BLOCK = 512  # settings that are compared with all others at once: bounds the memory
_ROUNDING = 1e-12  # variances and differences below, relative to the values, are none


def may_be_best(values: np.ndarray, share: bool = False, level: float = LEVEL) -> np.ndarray:
    """The settings that no other setting is significantly better than.

    With the probability ``level``, the setting of the highest true mean is among them, whatever the
    variances and correlations are: a setting falls out if any other is ahead of it by a one-sided
    paired t test at (1 - level) / (K - 1). This is the subset selection of Gupta (1965,
    Technometrics), which multiple comparisons with the best contain (Hsu 1984, Annals of
    Statistics), with Bonferroni's bound for settings that share their random numbers (Nelson,
    Swann, Goldsman and Song 2001, Operations Research). It assumes that the number of missions does
    not depend on their outcome.

    Args:
        values: (R, K) values of K settings in R replications, more is better; nan where a setting
            lacks a replication. Two settings are compared on the replications of both.
        share: Whether the values are outcomes 0 or 1, or means of such: then one gain and one loss
            are added to the differences, as in ``analysis.compare``.
        level: The probability.

    Returns:
        (K,) of bool. A setting that shares no two replications with another one stays.

    Raises:
        InputError: If the level is not between 0 and 1.
    """
    check_share("level", level)
    present = np.isfinite(values)
    # What a replication adds to all settings drops out of their differences.
    centre = np.nanmean(np.where(present.any(1, keepdims=True), values, 0.0), axis=1, keepdims=True)
    centred, mask = np.where(present, values - centre, 0.0), present.astype(float)
    alpha = (1 - level) / max(values.shape[1] - 1, 1)
    blocks = range(0, values.shape[1], _BLOCK)
    parts = [_unbeaten(slice(b, b + _BLOCK), centred, mask, share, alpha) for b in blocks]
    return np.concatenate(parts) if parts else np.zeros(0, bool)


def _unbeaten(
    block: slice, values: np.ndarray, mask: np.ndarray, share: bool, alpha: float
) -> np.ndarray:
    """Which settings of a block no other setting beats."""
    own, here = values[:, block], mask[:, block]
    n = here.T @ mask
    lead = here.T @ values - own.T @ mask  # of the others, summed over common replications
    squares = here.T @ values**2 + (own**2).T @ mask
    spread = np.maximum(squares - 2 * own.T @ values, 0.0)
    if share:
        n, spread, squares = n + 2 * (n > 0), spread + 2.0, squares + 2.0
    with np.errstate(divide="ignore", invalid="ignore"):
        deviations = spread - lead**2 / n
        constant = deviations <= _ROUNDING * squares
        t = lead / np.sqrt(n * deviations / (n - 1))
        ahead = lead > np.sqrt(_ROUNDING * squares * n)
    counts, places = np.unique(n, return_inverse=True)
    critical = stats.t.isf(alpha, np.maximum(counts - 1, 1))[places].reshape(n.shape)
    # The sign test, where all differences are the same.
    beaten = np.where(constant, ahead & (0.5**n <= alpha), t > critical)
    return ~(beaten & (n > 1)).any(axis=1)
