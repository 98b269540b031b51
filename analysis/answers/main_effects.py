"""The main effects of scenario parameters: how metrics change with each parameter.

The functions are for designs that vary one parameter at a time, like the paper's Fig. 5. All values
of a parameter are simulated in the same replications, so they are compared mission by mission:

    table = effects(results)
    pairs = changes(results, table, "greedy", "uavs", PRODUCT)
    shape(pairs).words  # "rises"
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers import summary
from dess.analysis.metrics import PRODUCT
from dess.analysis.names import parameter, value_text
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import paired, with_adjusted
from dess.analysis.stats.intervals import LEVEL, by_replication

_ENDS = ["difference", "low", "high"]
LEVELS, RISES, FALLS = "stays level", "rises", "falls"
PEAK, VALLEY, IRREGULAR = "rises, then falls", "falls, then rises", "goes up and down"


ByField = Mapping[str, Mapping[str, pd.DataFrame]]  # ``changes`` by parameter and policy


class Shape(NamedTuple):
    """How a metric changes along the values of a parameter.

    Two values differ significantly if their Holm-adjusted p-value is at most 1 - ``LEVEL``. If no
    two values differ, the metric stays level. If all significant differences have the same sign, it
    rises or falls. If there is a value such that no significant difference before it is a fall and
    none after it is a rise, the metric rises, then falls; and correspondingly for a valley.

    Attributes:
        words: One of ``LEVELS``, ``RISES``, ``FALLS``, ``PEAK``, ``VALLEY``, ``IRREGULAR``.
        peaks: Positions of the values at which the maximum may lie.
    """

    words: str
    peaks: tuple[int, ...]


def effects(results: Results) -> pd.DataFrame:
    """Means with intervals of every policy at every value of every parameter.

    Returns:
        A row per parameter, value, policy and metric: ``field``, ``value`` in words, ``position``
        (0, 1, ... in the order of the study), and the columns of ``summary.means``.

    Raises:
        InputError: If a design point sets more or less than one field.
    """
    design = [point.values for point in results.store.manifest.points]
    for number, values in enumerate(design):
        if len(values) != 1:
            fields = ", ".join(values) or "no field"
            raise InputError(f"point {number}: sets {fields}; allowed: one field at a time")
    rows = [(field, value_text(value)) for values in design for field, value in values.items()]
    table = pd.DataFrame(rows, columns=["field", "value"]).rename_axis("point").reset_index()
    table["position"] = table.groupby("field").cumcount()
    return table.merge(summary.means(results), on="point")


def changes(
    results: Results,
    table: pd.DataFrame,
    policy: str,
    field: str,
    metric: str,
    fewest_uavs: int = 1,
) -> pd.DataFrame:
    """Compare every two values of a parameter on the same missions.

    Args:
        results: The study.
        table: Its ``effects``.
        policy: The policy.
        field: The parameter.
        metric: The metric.
        fewest_uavs: Missions with fewer UAVs are left out.

    Returns:
        A row per pair: ``first`` and ``second`` (positions), ``difference`` (second - first) with
        ``low`` and ``high`` (95 % each), ``wide_low`` and ``wide_high`` (95 % for all pairs at
        once, by Bonferroni), ``p``, ``p_adjusted`` (Holm, over the pairs) and ``n``, the number of
        replications.
    """
    positions = table[table["field"] == field].groupby("point")["position"].first()
    missions = results.missions[results.missions["policy"] == policy]
    missions = missions[missions["point"].isin(positions.index)]
    missions = missions[missions["uavs"] >= fewest_uavs]
    values = by_replication(missions, metric, "point").dropna().rename(columns=positions)
    couples = [*combinations(sorted(values), 2)]
    at_once = 1 - (1 - LEVEL) / max(len(couples), 1)
    rows = []
    for first, second in couples:
        samples = values[second].to_numpy(), values[first].to_numpy()
        pair, wide = (paired(*samples, level, metric) for level in (LEVEL, at_once))
        ends = pair.difference, pair.low, pair.high, wide.low, wide.high
        rows.append((first, second, *ends, pair.p, pair.n))
    columns = ["first", "second", *_ENDS, "wide_low", "wide_high", "p", "n"]
    return with_adjusted(pd.DataFrame(rows, columns=columns), "holm")


def changes_by_field(results: Results, table: pd.DataFrame, metric: str = PRODUCT) -> ByField:
    """The changes of a metric, by parameter and policy.

    Args:
        results: The study.
        table: Its ``effects``, of some policies. A parameter with one value has no changes.
    """
    policies = table["policy"].unique()
    fields = table.groupby("field", sort=False)["position"].nunique()
    return {
        str(field): {p: changes(results, table, p, str(field), metric) for p in policies}
        for field in fields.index[fields > 1]
    }


def shape(pairs: pd.DataFrame) -> Shape:
    """The shape of a metric that follows from the differences of ``changes``."""
    sure = pairs[pairs["p_adjusted"] <= 1 - LEVEL]
    ups, downs = sure[sure["difference"] > 0], sure[sure["difference"] < 0]
    places = range(int(pairs["second"].max()) + 1)
    peaks = tuple(place for place in places if _passes(place, ups, downs))
    if ups.empty or downs.empty:
        words = LEVELS if sure.empty else RISES if downs.empty else FALLS
    elif peaks:
        words = PEAK
    else:
        words = VALLEY if any(_passes(place, downs, ups) for place in places) else IRREGULAR
    return Shape(words, peaks)


def _passes(peak: int, ups: pd.DataFrame, downs: pd.DataFrame) -> bool:
    """Whether there is no fall before the peak, and no rise after it."""
    return bool((downs["second"] > peak).all() and (ups["first"] < peak).all())


def leading_policies(
    results: Results, learned: str | None = None, heuristic: str | None = None
) -> list[str]:
    """The best learned policy of a study, if it has one, and its best heuristic.

    Args:
        results: The study.
        learned: The learned policy to take instead of the best one.
        heuristic: The heuristic to take instead of the best one.

    Raises:
        InputError: If the study lacks a policy that is named.
    """
    for name in (learned, heuristic):
        if name is not None:
            results.check_policy(name)
    trained = {policy for names in summary.learners(results).values() for policy in names}
    ranked = summary.ranked_policies(results.missions)
    learned = learned or next((policy for policy in ranked if policy in trained), None)
    heuristic = heuristic or next((policy for policy in ranked if policy not in trained), None)
    return [policy for policy in (learned, heuristic) if policy]


def answer(table: pd.DataFrame, policies: Sequence[str]) -> str:
    """Which parameters change the product of every policy most, in a sentence for each.

    A parameter may help one policy and hurt another one, so none of them stands for the others.

    Args:
        table: The ``effects``.
        policies: The policies.
    """
    sentences = []
    for policy in policies:
        rows = table[(table["metric"] == PRODUCT) & (table["policy"] == policy)]
        by_field = rows.sort_values("position", kind="stable").groupby("field", sort=False)
        courses = []
        for field in strongest(table, policy):
            values = by_field.get_group(field)
            extremes = [values["mean"].idxmin(), values["mean"].idxmax()]
            ends = values.loc[extremes].sort_values("position", kind="stable")
            first, last = [
                f"{numbers.percent(row.mean)} at {row.value}" for row in ends.itertuples()
            ]
            courses.append(f"{parameter(str(field)).within} (from {first} to {last})")
        sentences.append(
            f"The product of {policy} depends most on the {' and on the '.join(courses)}."
        )
    counts = table.loc[table["policy"].isin(policies), "n"]
    return f"{' '.join(sentences)} n = {numbers.span(counts)} missions per value."


def strongest(table: pd.DataFrame, policy: str, count: int = 2) -> list[str]:
    """The parameters along whose values the product of a policy changes most; as ``answer``."""
    rows = table[(table["metric"] == PRODUCT) & (table["policy"] == policy)]
    by_field = rows.groupby("field", sort=False)["mean"]
    return [*(by_field.max() - by_field.min()).nlargest(count).index]


def listed(table: pd.DataFrame, changes: ByField, ratios: ByField) -> pd.DataFrame:
    """How product goes along every parameter, as a table to print.

    Beside the change of the product from the first to the last value stands that of the collection
    ratio alone, which no failed mission moves: a few failures can make most of a small change.

    Args:
        table: The ``effects``.
        changes: ``changes_by_field``.
        ratios: The same of the collection ratio.
    """
    rows = table[table["metric"] == PRODUCT].set_index(["policy", "field", "position"]).sort_index()
    lines = []
    for field, pairs_of_field in changes.items():
        for policy, pairs in pairs_of_field.items():
            values, along = rows.loc[(policy, field)], shape(pairs)
            ends = values.iloc[[0, -1]]
            first, last = [
                f"{numbers.percent(row.mean)} at {row.value}" for row in ends.itertuples()
            ]
            steps = [_points(of) for of in (pairs, ratios[field][policy])]
            peaks = values.loc[[*along.peaks], "value"] if along.words == PEAK else []
            named = (parameter(field).name, policy, along.words, first, last)
            lines.append((*named, *steps, " or ".join(peaks)))
    heads = ["Parameter", "Policy", "Along the values", "First", "Last", "Last − first"]
    return pd.DataFrame(lines, columns=[*heads, "Of the ratio alone", "Highest at"])


def _points(pairs: pd.DataFrame) -> str:
    """The change from the first to the last value, in points."""
    ends = pairs[pairs["first"] == 0].sort_values("second").iloc[-1]
    return numbers.points(*ends[_ENDS])
