"""Corrections of p-values: for multiple tests, and for a baseline chosen by the same data."""

from typing import Literal, get_args

import numpy as np
import pandas as pd
from scipy import stats

from dess import InputError

Correction = Literal["holm", "fdr"]


def adjust(p: np.ndarray, correction: Correction | None) -> np.ndarray:
    """Adjust p-values for multiple tests; adjusted values up to alpha are significant at alpha.

    Args:
        p: (m,) p-values.
        correction: ``holm`` (Holm 1979) limits the probability of any false claim to alpha, ``fdr``
            (Benjamini and Hochberg 1995) the expected share of false claims. None: no adjustment.

    Returns:
        (m,) adjusted p-values, at most 1.

    Raises:
        InputError: If there is no such correction.
    """
    if correction not in (*get_args(Correction), None):
        allowed = ", ".join(get_args(Correction))
        raise InputError(f"correction: {correction!r}; allowed: {allowed}, or none")
    p = np.asarray(p, float)
    if correction is None:
        return p
    if correction == "fdr":
        return np.asarray(stats.false_discovery_control(p))
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    steps = p[order] * np.arange(len(p), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1)
    return adjusted


def with_adjusted(table: pd.DataFrame, correction: Correction | None) -> pd.DataFrame:
    """Add ``p_adjusted`` after ``p`` to a table of comparisons, adjusted over all its rows."""
    adjusted = adjust(table["p"].to_numpy(float), correction)
    table.insert(table.columns.get_loc("p") + 1, "p_adjusted", adjusted)
    return table


def for_choice(table: pd.DataFrame, candidates: int) -> pd.DataFrame:
    """Correct a table of comparisons whose baseline, or pair, was chosen by the same data.

    By Bonferroni, ``p_adjusted`` is multiplied by the number of candidates.
    """
    return table.assign(p_adjusted=(table["p_adjusted"] * candidates).clip(upper=1))
