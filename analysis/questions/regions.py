"""For which parameters one policy is better than another, and for which worse.

The missions of a design point that draws its parameters are a sample of the parameter space:

    missions = duels(results, pair)           # of questions.head_to_head
    lead = along(missions, pair.candidates)   # mean differences along every parameter
    dependence(missions)                      # the share of the variance that each explains
"""

from typing import Any

import numpy as np
import pandas as pd
from scipy import stats

from analysis import numbers
from analysis.names import PARAMETERS, PRODUCT, parameter, value_text
from analysis.questions.head_to_head import OF_BASELINE
from analysis.stats.correction import for_choice, with_adjusted
from analysis.stats.intervals import values_within, wilson
from analysis.stats.paired import paired
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE, position_by_test

BINS = 5  # largest number of bins of a parameter

AHEAD, BEHIND = "ahead", "behind"
VERDICTS = {ABOVE: AHEAD, BELOW: BEHIND, INCONCLUSIVE: INCONCLUSIVE}


def varied(missions: pd.DataFrame) -> list[str]:
    """The parameters that differ between the missions of ``duels``."""
    return [field for field in PARAMETERS if missions[field].nunique() > 1]


def bins(values: pd.Series, most: int = BINS) -> tuple[np.ndarray, list[str]]:
    """Divide values into at most ``most`` bins: one per value if possible, else by quantiles.

    Returns:
        (n,) the bin of each value, and the names of the bins, from the lowest on.
    """
    array = values.to_numpy()
    distinct = np.unique(array)
    edges = distinct[:-1]
    if len(distinct) > most:
        edges = np.quantile(array, np.arange(1, most) / most)
    _, codes = np.unique(np.searchsorted(edges, array), return_inverse=True)
    return codes, [_range_text(array[codes == code]) for code in range(codes.max() + 1)]


def along(missions: pd.DataFrame, candidates: int = 1) -> pd.DataFrame:
    """The mean difference along every parameter that varies.

    Args:
        missions: Rows of ``duels``.
        candidates: Number of pairs among which the two policies were chosen.

    Returns:
        A row per parameter and bin; a parameter has at most ``BINS`` bins of about equally many
        missions. The columns are ``field``, ``position``, ``value`` in words, and those of a
        comparison: ``mean``, ``low``, ``high`` (by ``paired``, 95 %), ``p``, ``p_adjusted``
        (Holm over all rows, Bonferroni for the choice of the pair), ``verdict``, ``n``, and
        ``behind``, the share of missions in which the policy is worse, with ``behind_low`` and
        ``behind_high``.
    """
    parts = [missions[:0].assign(field="", position=0, value="")]
    for field in varied(missions):
        part = _binned(missions, field).assign(field=field)
        parts.append(part.sort_values("position", kind="stable"))
    return _compared(pd.concat(parts), ["field", "position", "value"], candidates)


def dependence(missions: pd.DataFrame) -> pd.DataFrame:
    """Whether the difference depends on each parameter.

    Returns:
        A row per parameter that varies, the one that explains most first: ``field``, ``explained``
        (share of the variance between the bins of ``along``), ``p`` (Alexander and Govern's test
        of equal means, which lets the variances differ; 1 where the data are too few) and
        ``p_adjusted`` (Holm).
    """
    rows = []
    difference = missions["difference"]
    total = float(difference.var(ddof=0))
    for field in varied(missions):
        groups = difference.groupby(bins(missions[field])[0])
        between = float(groups.transform("mean").var(ddof=0))
        rows.append((field, between / total if total else 0.0, _equal_means(groups)))
    table = pd.DataFrame(rows, columns=["field", "explained", "p"])
    return with_adjusted(table, "holm").sort_values(
        "explained", ascending=False, kind="stable", ignore_index=True
    )


def spread(lead: pd.DataFrame, dependences: pd.DataFrame) -> pd.DataFrame:
    """How the difference depends on every parameter, as a table to print.

    Args:
        lead: Rows of ``along``.
        dependences: Rows of ``dependence``.
    """
    lines = []
    for row in dependences.itertuples():
        rows = lead[lead["field"] == row.field].sort_values("mean", kind="stable")
        bins_ = [f"{_points(one)} at {one.value}" for one in rows.itertuples()]
        shown = numbers.percent(row.explained), numbers.p_value(row.p_adjusted)
        lines.append((parameter(row.field).name, bins_[0], bins_[-1], *shown))
    heads = ["Parameter", "Lowest difference", "Highest difference", "Variance explained"]
    return pd.DataFrame(lines, columns=[*heads, "p, adjusted"])


def _compared(missions: pd.DataFrame, columns: list[str], candidates: int) -> pd.DataFrame:
    """A row for every group of missions with the same labels: the labels and the comparison."""
    rows = []
    for labels, part in missions.groupby(columns, sort=False):
        of_policy, of_baseline = (
            values_within(part, PRODUCT + end, ()) for end in ("", OF_BASELINE)
        )
        pair = paired(of_policy, of_baseline, metric=PRODUCT)
        behind = wilson(int((part["difference"] < 0).sum()), len(part))
        rows.append((*labels, pair.difference, pair.low, pair.high, pair.p, len(part), *behind))
    names = ["mean", "low", "high", "p", "n", "behind", "behind_low", "behind_high"]
    table = pd.DataFrame(rows, columns=[*columns, *names])
    table = for_choice(with_adjusted(table, "holm"), candidates)
    sides = zip(table["mean"], table["p_adjusted"], strict=True)
    return table.assign(verdict=[VERDICTS[position_by_test(*side)] for side in sides])


def _binned(missions: pd.DataFrame, field: str) -> pd.DataFrame:
    """The missions with ``position`` and ``value``, the number and the name of a field's bin."""
    codes, names = bins(missions[field])
    return missions.assign(position=codes, value=np.array(names)[codes])


def _equal_means(groups: Any) -> float:
    """The p-value of equal means; 1 if fewer than two groups have different values."""
    samples = [group.to_numpy() for _, group in groups if np.ptp(group) > 0]
    return float(stats.alexandergovern(*samples).pvalue) if len(samples) > 1 else 1.0


def _range_text(values: np.ndarray) -> str:
    """The range of values: ``3``, ``70–72``, or ``11.7–12.1``, rounded."""
    ends = [float(f"{end:.3g}") for end in (values.min(), values.max())]
    return value_text(ends if ends[0] < ends[1] else ends[0])


def _points(row: Any) -> str:
    return numbers.points(row.mean, row.low, row.high)
