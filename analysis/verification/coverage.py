"""Coverage: how often the intervals of blocks of missions contain the mean of all missions."""

import numpy as np
import pandas as pd
from scipy import stats

from analysis.numbers import interval
from analysis.stats.intervals import Interval, mean_interval, wilson
from analysis.verification import closed_forms
from analysis.verification.checks import COVERAGE, Check


def blocks(values: np.ndarray, size: int, share: bool) -> pd.DataFrame:
    """Intervals of blocks of missions, and whether each contains the mean of all missions.

    Args:
        values: (n,) a metric of missions; those after the last complete block are left out.
        size: Number of missions in a block.
        share: Whether the metric is 0 or 1 and has Wilson's interval, or Student's t otherwise:
            both have a coverage of independent missions that is known in closed form. Tables print
            wider intervals of the other metrics, as for ``stats.intervals.interval_of``.

    Returns:
        A row per block: ``mean``, ``low``, ``high``, ``reference`` (the mean of all missions) and
        ``holds``.
    """
    whole = values[: len(values) // size * size].reshape(-1, size)
    rows = [wilson(int(b.sum()), size) if share else mean_interval(b) for b in whole]
    table = pd.DataFrame(rows, columns=Interval._fields)
    reference = whole.mean() if whole.size else np.nan
    holds = (table["low"] <= reference) & (reference <= table["high"])
    return table.assign(reference=reference, holds=holds)


def coverage_check(metric: str, values: np.ndarray, size: int, share: bool) -> Check:
    """Compare the observed coverage of the blocks' intervals with the known coverage.

    Args:
        metric: The name of the metric on the page.
        values, size, share: As for ``blocks``.
    """
    table = blocks(values, size, share)
    n = len(table)
    test = f"{metric}: intervals of blocks of {size:,} missions"
    if n < 2 or np.ptp(values) == 0:  # coverage cannot be tested
        return Check(COVERAGE, test, "", "", n)
    missions, hits = n * size, int(table["holds"].sum())
    if share:
        known = closed_forms.wilson_coverage(round(values[:missions].sum()), missions, size)
    else:
        known = closed_forms.t_coverage(missions, size)
    seen = f"{hits:,} of {n:,}: {interval(*wilson(hits, n))}"
    p = float(stats.binomtest(hits, n, min(known, 1.0)).pvalue)
    return Check(COVERAGE, test, f"{100 * known:.1f} %", seen, n, p)
