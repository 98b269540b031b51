"""P-values corrected for the number of tests."""

from typing import Any, Literal, get_args

import numpy as np
import pandas as pd
import scipy

from dess import InputError

# Of a comparison: with what is added for rare failures, and of Student's t without it.
P_VALUES = ("p", "p_student")

Correction = Literal["holm", "fdr"]


def adjust_p_values(p: np.ndarray, correction: Correction | None) -> np.ndarray:
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
        raise InputError("correction", repr(correction), f"{allowed}, or none")
    p = np.asarray(p, float)
    if correction is None:
        return p
    if correction == "fdr":
        return np.asarray(scipy.stats.false_discovery_control(p))
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    steps = p[order] * np.arange(len(p), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1)
    return adjusted


def add_adjusted(table: pd.DataFrame, correction: Correction | None) -> pd.DataFrame:
    """Add ``p_adjusted`` after ``p`` to a table of comparisons, adjusted over all its rows.

    If there is a ``p_student``, so is ``p_student_adjusted`` after it. Rows without a p-value have
    none that is adjusted. Without a correction, the table is returned as it is.
    """
    if correction is None:
        return table
    for name in P_VALUES:
        if name in table:
            p = table[name].to_numpy(float)
            is_known = ~np.isnan(p)
            adjusted = p.copy()
            adjusted[is_known] = adjust_p_values(p[is_known], correction)
            insert_adjusted(table, adjusted, name)
    return table


def insert_adjusted(table: pd.DataFrame, adjusted: Any, name: str = "p") -> pd.DataFrame:
    """Put adjusted p-values behind their column in a table of comparisons."""
    table.insert(table.columns.get_loc(name) + 1, f"{name}_adjusted", adjusted)
    return table


def for_choice(table: pd.DataFrame, candidates: int) -> pd.DataFrame:
    """Correct a table of comparisons whose baseline, or pair, was chosen by the same data.

    By Bonferroni, adjusted p-values are multiplied by the number of candidates.
    """
    names = [f"{name}_adjusted" for name in P_VALUES]
    return table.assign(**{name: (table[name] * candidates).clip(upper=1) for name in names})
