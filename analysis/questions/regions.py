"""In which regions of the parameter space one policy is better than another, and where worse.

The missions of a design point that draws its parameters are a sample of the parameter space:

    missions = duels(results, pair)           # of questions.head_to_head
    lead = along(missions, pair.candidates)   # mean differences along every parameter
    tally(lead)    # 'ahead in 15, behind in 0 and inconclusive in 3 of 18'
    rules(missions, pair.candidates)          # regions of a regression tree
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from scipy import stats
from sklearn.tree import DecisionTreeRegressor

from analysis import numbers
from analysis.names import PARAMETERS, PRODUCT, parameter, value_text
from analysis.questions.head_to_head import AHEAD, BEHIND, OF_BASELINE, verdict
from analysis.stats.correction import for_choice, with_adjusted
from analysis.stats.intervals import wilson
from analysis.stats.paired import paired
from analysis.stats.verdict import INCONCLUSIVE

BINS = 5  # largest number of bins of a parameter
# Of the regression tree: largest depth, and smallest number and share of missions in a leaf.
DEPTH, LEAST, SHARE = 3, 20, 0.05

Range = tuple[float, float]


def varied(missions: pd.DataFrame) -> list[str]:
    """The parameters that differ between the missions of ``duels``."""
    return [field for field in PARAMETERS if missions[field].nunique() > 1]


def halves(missions: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The missions of even replications, for choosing regions, and of odd ones, for estimates."""
    even = missions["replication"] % 2 == 0
    return missions[even], missions[~even]


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
    parts = []
    for field in varied(missions):
        codes, names = bins(missions[field])
        parts += [((field, code, name), missions[codes == code]) for code, name in enumerate(names)]
    return _compared(parts, ["field", "position", "value"], candidates)


def across(missions: pd.DataFrame, first: str, second: str, candidates: int = 1) -> pd.DataFrame:
    """The mean difference over two parameters at once.

    Returns:
        A row per pair of bins with missions: ``position``, ``value`` (of the first), ``position_2``
        and ``value_2`` (of the second), and the columns of a comparison, as in ``along``.
    """
    (codes, names), (codes_2, names_2) = bins(missions[first]), bins(missions[second])
    parts = [
        ((code, name, code_2, name_2), missions[(codes == code) & (codes_2 == code_2)])
        for code, name in enumerate(names)
        for code_2, name_2 in enumerate(names_2)
    ]
    columns = ["position", "value", "position_2", "value_2"]
    return _compared(parts, columns, candidates)


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
    chosen_on, judged_on = halves(missions)
    chosen = dependence(chosen_on).head(2)
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
    fields = varied(missions) or [*PARAMETERS][:1]
    grown_on, judged_on = halves(missions)
    if grown_on.empty or judged_on.empty:
        return _compared([], ["rule"], candidates)
    least = max(LEAST, int(np.ceil(SHARE * len(grown_on))))
    tree = DecisionTreeRegressor(max_depth=DEPTH, min_samples_leaf=least, random_state=0)
    tree.fit(grown_on[fields].to_numpy(float), grown_on["difference"])
    leaves = tree.apply(judged_on[fields].to_numpy(float))
    parts = [
        ((_rule(missions, box),), judged_on[leaves == leaf])
        for leaf, box in _leaves(tree.tree_, fields)
    ]
    table = _compared(parts, ["rule"], candidates)
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
        lowest, *_ = rows.itertuples()
        *_, highest = rows.itertuples()
        lines.append(
            {
                "Parameter": parameter(row.field).name,
                "Lowest difference": f"{_points(lowest)} at {lowest.value}",
                "Highest difference": f"{_points(highest)} at {highest.value}",
                "Variance explained": numbers.percent(row.explained),
                "p, adjusted": numbers.p_value(row.p_adjusted),
            }
        )
    return pd.DataFrame(lines)


def listed(regions: pd.DataFrame, policy: str) -> pd.DataFrame:
    """Rows of ``rules`` as a table to print, about a policy."""
    lines = [
        [
            row.rule,
            _points(row),
            numbers.p_value(row.p_adjusted),
            row.verdict,
            numbers.interval(row.behind, row.behind_low, row.behind_high),
            f"{row.n:,}",
        ]
        for row in regions.itertuples()
    ]
    columns = ["Region", "Points", "p, adjusted", f"{policy} is", "Missions lost", "n"]
    return pd.DataFrame(lines, columns=columns)


def _compared(
    parts: Sequence[tuple[tuple[Hashable, ...], pd.DataFrame]],
    columns: list[str],
    candidates: int,
) -> pd.DataFrame:
    """A row for every part of the missions that is not empty: its labels and its comparison."""
    rows = []
    for labels, missions in parts:
        if missions.empty:
            continue
        of_policy, of_baseline = missions[PRODUCT], missions[PRODUCT + OF_BASELINE]
        pair = paired(of_policy.to_numpy(), of_baseline.to_numpy(), metric=PRODUCT)
        behind = wilson(int((missions["difference"] < 0).sum()), len(missions))
        rows.append((*labels, pair.difference, pair.low, pair.high, pair.p, len(missions), *behind))
    names = ["mean", "low", "high", "p", "n", "behind", "behind_low", "behind_high"]
    table = pd.DataFrame(rows, columns=[*columns, *names])
    table = for_choice(with_adjusted(table, "holm"), candidates)
    return table.assign(verdict=[*map(verdict, table["mean"], table["p_adjusted"])])


def _equal_means(groups: Any) -> float:
    """The p-value of equal means; 1 if fewer than two groups have different values."""
    samples = [group.to_numpy() for _, group in groups if np.ptp(group) > 0]
    return float(stats.alexandergovern(*samples).pvalue) if len(samples) > 1 else 1.0


def _leaves(
    tree: Any, fields: list[str], node: int = 0, box: Mapping[str, Range] | None = None
) -> Iterator[tuple[int, Mapping[str, Range]]]:
    """The leaves below a node of the tree, each with the range (low, high] of every split field."""
    box = box or {}
    left, right = tree.children_left[node], tree.children_right[node]
    if left == right:  # a leaf
        yield node, box
        return
    field, split = fields[tree.feature[node]], float(tree.threshold[node])
    low, high = box.get(field, (-np.inf, np.inf))
    yield from _leaves(tree, fields, left, {**box, field: (low, split)})
    yield from _leaves(tree, fields, right, {**box, field: (split, high)})


def _rule(missions: pd.DataFrame, box: Mapping[str, Range]) -> str:
    """A box of parameter ranges in words, by the values of the missions in it."""
    sides = []
    for field in (field for field in PARAMETERS if field in box):
        low, high = box[field]
        values = missions[field].to_numpy()
        inside = values[(values > low) & (values <= high)]
        sides.append(f"{parameter(field).short} {_range_text(inside)}")
    return ", ".join(sides) or "all missions"


def _range_text(values: np.ndarray) -> str:
    """The range of values: ``3``, ``70–72``, or ``11.7–12.1``, rounded."""
    ends = [float(f"{end:.3g}") for end in (values.min(), values.max())]
    return value_text(ends if ends[0] < ends[1] else ends[0])


def _points(row: Any) -> str:
    return numbers.points(row.mean, row.low, row.high)
