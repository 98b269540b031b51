"""In which regions of the parameter space one policy is better than another, and where worse.

The missions of a design point that draws its parameters are a sample of the parameter space:

    missions = duels(results, pair)           # of questions.head_to_head
    lead = along(missions, pair.candidates)   # mean differences along every parameter
    tally(lead)    # 'ahead in 15, behind in 0 and inconclusive in 3 of 18'
    rules(missions, pair.candidates)          # regions of a regression tree
"""

from typing import Any

import numpy as np
import pandas as pd
from scipy import stats
from sklearn.tree import DecisionTreeRegressor

from analysis import numbers
from analysis.names import PARAMETERS, PRODUCT, parameter, value_text
from analysis.questions.head_to_head import OF_BASELINE
from analysis.stats.correction import for_choice, with_adjusted
from analysis.stats.intervals import wilson
from analysis.stats.paired import paired
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE, position_by_test

BINS = 5  # largest number of bins of a parameter
# Of the regression tree: largest depth, and smallest number and share of missions in a leaf.
DEPTH, LEAST, SHARE = 3, 20, 0.05

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
        comparison: ``mean``, ``low``, ``high`` (Student's t, 95 % each), ``p``, ``p_adjusted``
        (Holm over all rows, Bonferroni for the choice of the pair), ``verdict``, ``n``, and
        ``behind``, the share of missions in which the policy is worse, with ``behind_low`` and
        ``behind_high``.
    """
    parts = [missions[:0].assign(field="", position=0, value="")]
    for field in varied(missions):
        part = _binned(missions, field).assign(field=field)
        parts.append(part.sort_values("position", kind="stable"))
    return _compared(pd.concat(parts), ["field", "position", "value"], candidates)


def across(missions: pd.DataFrame, first: str, second: str, candidates: int = 1) -> pd.DataFrame:
    """The mean difference over two parameters at once.

    Returns:
        A row per pair of bins with missions: ``position``, ``value`` (of the first), ``position_2``
        and ``value_2`` (of the second), and the columns of a comparison, as in ``along``.
    """
    table = _binned(_binned(missions, second, "_2"), first)
    columns = ["position", "value", "position_2", "value_2"]
    return _compared(table.sort_values(columns[::2], kind="stable"), columns, candidates)


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


def strongest(missions: pd.DataFrame, candidates: int = 1) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The two parameters that explain most of the difference, and the difference over both.

    The parameters are chosen by the missions of even replications. The differences come from those
    of odd replications, which were not used for the choice.

    Returns:
        Up to two rows of ``dependence``, and rows of ``across``; both are empty if fewer than two
        parameters vary, or there are no missions of odd replications.
    """
    even = missions["replication"] % 2 == 0
    chosen, judged_on = dependence(missions[even]).head(2), missions[~even]
    if len(chosen) < 2 or judged_on.empty:
        return chosen[:0], judged_on[:0]
    first, second = chosen["field"]
    return chosen, across(judged_on, first, second, candidates)


def rules(missions: pd.DataFrame, candidates: int = 1) -> pd.DataFrame:
    """Regions of the parameter space with different mean differences, by a regression tree.

    The tree is fitted to the missions of even replications. The estimates come from the missions of
    odd replications, which were not used for the fit. Otherwise a region would seem to differ only
    because it was chosen for its random deviations.

    Args:
        missions: Rows of ``duels``.
        candidates: As for ``along``.

    Returns:
        A row per region with missions of odd replications, the lowest mean first: ``rule`` in
        words, and the columns of a comparison, as in ``along``.
    """
    even, fields = missions["replication"] % 2 == 0, varied(missions) or [*PARAMETERS][:1]
    if even.all() or not even.any():
        return _compared(missions[:0].assign(rule=""), ["rule"], candidates)
    least = max(LEAST, int(np.ceil(SHARE * even.sum())))
    tree = DecisionTreeRegressor(max_depth=DEPTH, min_samples_leaf=least, random_state=0)
    values = missions[fields].to_numpy(float)
    tree.fit(values[even], missions.loc[even, "difference"])
    leaves = pd.Series(tree.apply(values), missions.index)
    splits = {leaf: tree.decision_path(values[leaves == leaf])[0].indices for leaf in {*leaves}}
    asked = tree.tree_.feature  # of every node; negative for a leaf
    split_by = {leaf: {fields[asked[n]] for n in path[:-1]} for leaf, path in splits.items()}
    rules = {leaf: _rule(missions[leaves == leaf], split_by[leaf]) for leaf in {*leaves}}
    table = _compared(missions.assign(rule=leaves.map(rules))[~even], ["rule"], candidates)
    return table.sort_values("mean", kind="stable", ignore_index=True)


def tally(table: pd.DataFrame) -> str:
    """The verdicts of a table, as ``ahead in 15, behind in 0 and inconclusive in 3 of 18``."""
    verdicts = (AHEAD, BEHIND, INCONCLUSIVE)
    counts = [f"{each} in {(table['verdict'] == each).sum()}" for each in verdicts]
    return f"{numbers.words(counts)} of {len(table)}"


def lowest(cells: pd.DataFrame) -> str:
    """The lowest mean of ``across``, as ``+3.3 [+1.4, +5.2] at 3 and 70–72 (n = 155)``."""
    row, *_ = cells.sort_values("mean", kind="stable").itertuples()
    return f"{_points(row)} at {row.value} and {row.value_2} (n = {row.n:,})"


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


def listed(regions: pd.DataFrame, policy: str) -> pd.DataFrame:
    """Rows of ``rules`` as a table to print, about a policy."""
    columns = {
        "Region": regions["rule"],
        "Points": [_points(row) for row in regions.itertuples()],
        "p, adjusted": regions["p_adjusted"].map(numbers.p_value),
        f"{policy} is": regions["verdict"],
        "Missions lost": numbers.estimates(regions, "behind"),
        "n": regions["n"].map("{:,}".format),
    }
    return pd.DataFrame(columns)


def _compared(missions: pd.DataFrame, columns: list[str], candidates: int) -> pd.DataFrame:
    """A row for every group of missions with the same labels: the labels and the comparison."""
    rows = []
    for labels, part in missions.groupby(columns, sort=False):
        of_policy, of_baseline = (part[PRODUCT + end].to_numpy() for end in ("", OF_BASELINE))
        pair = paired(of_policy, of_baseline, metric=PRODUCT)
        behind = wilson(int((part["difference"] < 0).sum()), len(part))
        rows.append((*labels, pair.difference, pair.low, pair.high, pair.p, len(part), *behind))
    names = ["mean", "low", "high", "p", "n", "behind", "behind_low", "behind_high"]
    table = pd.DataFrame(rows, columns=[*columns, *names])
    table = for_choice(with_adjusted(table, "holm"), candidates)
    sides = zip(table["mean"], table["p_adjusted"], strict=True)
    return table.assign(verdict=[VERDICTS[position_by_test(*side)] for side in sides])


def _binned(missions: pd.DataFrame, field: str, end: str = "") -> pd.DataFrame:
    """The missions with ``position`` and ``value``, the number and the name of a field's bin."""
    codes, names = bins(missions[field])
    return missions.assign(**{f"position{end}": codes, f"value{end}": np.array(names)[codes]})


def _equal_means(groups: Any) -> float:
    """The p-value of equal means; 1 if fewer than two groups have different values."""
    samples = [group.to_numpy() for _, group in groups if np.ptp(group) > 0]
    return float(stats.alexandergovern(*samples).pvalue) if len(samples) > 1 else 1.0


def _rule(inside: pd.DataFrame, fields: set[str]) -> str:
    """A region in words: the ranges of the fields that divide it from others."""
    named = [field for field in PARAMETERS if field in fields]
    sides = [f"{parameter(f).short} {_range_text(inside[f].to_numpy())}" for f in named]
    return ", ".join(sides) or "all missions"


def _range_text(values: np.ndarray) -> str:
    """The range of values: ``3``, ``70–72``, or ``11.7–12.1``, rounded."""
    ends = [float(f"{end:.3g}") for end in (values.min(), values.max())]
    return value_text(ends if ends[0] < ends[1] else ends[0])


def _points(row: Any) -> str:
    return numbers.points(row.mean, row.low, row.high)
