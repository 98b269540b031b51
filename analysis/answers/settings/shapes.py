"""How a metric goes along the values of a field: its changes, and their shape.

All values of a field are simulated in the same replications, so they are compared mission by
mission:

    pairs = compare_values(results, "greedy", "uavs", PRODUCT)
    shape_of_changes(pairs).words  # "rises"
"""

from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import NamedTuple

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.settings.effects import labels_of_field
from dess.analysis.answers.settings.points import ordered_values
from dess.analysis.metrics import PRODUCT
from dess.analysis.names import field_named
from dess.analysis.results.tables import Results
from dess.analysis.stats.corrections import add_adjusted
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.weights import by_replication

_ENDS = ["difference", "low", "high"]
LEVELS, RISES, FALLS = "stays level", "rises", "falls"
PEAK, VALLEY, IRREGULAR = "rises, then falls", "falls, then rises", "goes up and down"


ByField = Mapping[str, Mapping[str, pd.DataFrame]]  # ``compare_values`` by field and policy


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


def compare_values(
    results: Results, policy: str, field: str, metric: str, fewest_uavs: int = 1
) -> pd.DataFrame:
    """Compare every two values of a parameter on the same missions.

    Args:
        results: The study.
        policy: The policy.
        field: The parameter.
        metric: The metric.
        fewest_uavs: Missions with fewer UAVs are left out.

    Returns:
        A row per pair: ``first`` and ``second`` (positions), ``difference`` (second - first) with
        ``low`` and ``high`` (95 % each), ``wide_low`` and ``wide_high`` (95 % for all pairs at
        once, by Bonferroni), ``p``, ``p_adjusted`` (Holm, over the pairs), ``n``, the number of
        replications, and ``student``, as in ``stats.differences.Paired``.
    """
    labels = labels_of_field(results, field)
    positions = labels.map(ordered_values(labels).index).astype(int)
    missions = results.missions_of(policy)
    missions = missions[missions["point"].isin(positions.index)]
    missions = missions[missions["uavs"] >= fewest_uavs]
    values = by_replication(missions, metric, "point").dropna().rename(columns=positions)
    couples = [*combinations(sorted(values), 2)]
    at_once = 1 - (1 - LEVEL) / max(len(couples), 1)
    rows = []
    for first, second in couples:
        samples = values[second].to_numpy(), values[first].to_numpy()
        pair, wide = (compare_pairs(*samples, level, metric) for level in (LEVEL, at_once))
        ends = pair.difference, pair.low, pair.high, wide.low, wide.high
        rows.append((first, second, *ends, pair.p, pair.n, pair.student))
    columns = ["first", "second", *_ENDS, "wide_low", "wide_high", "p", "n", "student"]
    return add_adjusted(pd.DataFrame(rows, columns=columns), "holm")


def compare_values_by_field(
    results: Results, table: pd.DataFrame, metric: str = PRODUCT
) -> ByField:
    """The changes of a metric, by parameter and policy.

    Args:
        results: The study.
        table: Its ``means_by_field``, of some policies. A parameter with one value has no changes.
    """
    policies = table["policy"].unique()
    fields = table.groupby("field", sort=False)["position"].nunique()
    return {
        str(field): {p: compare_values(results, p, str(field), metric) for p in policies}
        for field in fields.index[fields > 1]
    }


def shape_of_changes(pairs: pd.DataFrame) -> Shape:
    """The shape of a metric that follows from the differences of ``compare_values``."""
    sure = pairs[pairs["p_adjusted"] <= 1 - LEVEL]
    ups, downs = sure[sure["difference"] > 0], sure[sure["difference"] < 0]
    places = range(int(pairs["second"].max()) + 1)
    peaks = tuple(place for place in places if _rises_then_falls(place, ups, downs))
    if ups.empty or downs.empty:
        if sure.empty:
            words = LEVELS
        elif downs.empty:
            words = RISES
        else:
            words = FALLS
    elif peaks:
        words = PEAK
    else:
        if any(_rises_then_falls(place, downs, ups) for place in places):
            words = VALLEY
        else:
            words = IRREGULAR
    return Shape(words, peaks)


def _rises_then_falls(peak: int, ups: pd.DataFrame, downs: pd.DataFrame) -> bool:
    """Whether there is no fall before the peak, and no rise after it."""
    return bool((downs["second"] > peak).all() and (ups["first"] < peak).all())


def strongest_fields_sentence(
    table: pd.DataFrame, policies: Sequence[str], changes: ByField
) -> str:
    """Which parameters change the product of every policy most, in a sentence for each.

    A parameter may help one policy and hurt another one, so none of them stands for the others.

    Args:
        table: The ``means_by_field``.
        policies: The policies.
        changes: The changes of the product; where no two values differ significantly, it is said.
    """
    sentences = []
    for policy in policies:
        rows = table[(table["metric"] == PRODUCT) & (table["policy"] == policy)]
        by_field = rows.sort_values("position", kind="stable").groupby("field", sort=False)
        courses = []
        for field in strongest_fields(table, policy):
            values = by_field.get_group(field)
            extremes = [values["mean"].idxmin(), values["mean"].idxmax()]
            ends = values.loc[extremes].sort_values("position", kind="stable")
            first, last = [
                f"{numbers.format_percent(row.mean)} at {row.value}" for row in ends.itertuples()
            ]
            is_open = field in changes and shape_of_changes(changes[field][policy]).words == LEVELS
            doubt = ", inconclusive" if is_open else ""
            courses.append(f"{field_named(str(field)).within} (from {first} to {last}{doubt})")
        sentences.append(
            f"The product of {policy} depends most on the {' and on the '.join(courses)}."
        )
    counts = table.loc[table["policy"].isin(policies), "n"]
    return f"{' '.join(sentences)} n = {numbers.format_span(counts)} missions per value."


def strongest_fields(table: pd.DataFrame, policy: str, count: int = 2) -> list[str]:
    """The parameters along whose values the product of a policy changes most."""
    rows = table[(table["metric"] == PRODUCT) & (table["policy"] == policy)]
    by_field = rows.groupby("field", sort=False)["mean"]
    return [*(by_field.max() - by_field.min()).nlargest(count).index]


def shape_table(table: pd.DataFrame, changes: ByField, ratios: ByField) -> pd.DataFrame:
    """How product goes along every parameter, as a table to print.

    Beside the change of the product from the first to the last value stands that of the collection
    ratio alone, which no failed mission moves: a few failures can make most of a small change.

    Args:
        table: The ``means_by_field``.
        changes: ``compare_values_by_field``.
        ratios: The same of the collection ratio.
    """
    rows = table[table["metric"] == PRODUCT].set_index(["policy", "field", "position"]).sort_index()
    lines = []
    for field, pairs_of_field in changes.items():
        for policy, pairs in pairs_of_field.items():
            values = rows.loc[(policy, field)]
            along = shape_of_changes(pairs)
            ends = values.iloc[[0, -1]]
            first, last = [
                f"{numbers.format_percent(row.mean)} at {row.value}" for row in ends.itertuples()
            ]
            steps = [
                _format_total_change(changes_of_metric)
                for changes_of_metric in (pairs, ratios[field][policy])
            ]
            peaks = []
            if along.words == PEAK:
                peaks = values.loc[[*along.peaks], "value"]
            named = (field_named(field).name, policy, along.words, first, last)
            lines.append((*named, *steps, " or ".join(peaks)))
    heads = ["Parameter", "Policy", "Along the values", "First", "Last", "Last − first"]
    return pd.DataFrame(lines, columns=[*heads, "Of the ratio alone", "Highest at"])


def _format_total_change(pairs: pd.DataFrame) -> str:
    """The change from the first to the last value, in points."""
    ends = pairs[pairs["first"] == 0].sort_values("second").iloc[-1]
    return numbers.format_points(*ends[_ENDS])
