"""The main effects of scenario parameters: how metrics change with each parameter.

The functions are for designs that vary one parameter at a time, like the paper's Fig. 5. All values
of a parameter are simulated in the same replications, so they are compared mission by mission:

    table = effects(results)
    pairs = changes(results, table, "greedy", "uavs", PRODUCT)
    shape(pairs).words  # "rises"
"""

from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.names import PRODUCT, parameter, value_text
from analysis.questions import summary
from analysis.results.tables import Results
from analysis.stats.correction import adjust
from analysis.stats.intervals import LEVEL
from analysis.stats.paired import paired
from dess import InputError

_ENDS = ["difference", "low", "high"]
LEVELS, RISES, FALLS = "stays level", "rises", "falls"
PEAK, VALLEY, IRREGULAR = "rises, then falls", "falls, then rises", "goes up and down"


ByField = Mapping[str, Mapping[str, pd.DataFrame]]  # ``changes`` by parameter and policy


@dataclass(frozen=True)
class Shape:
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
    points: list[tuple[int, str, str, int]] = []
    positions: dict[str, int] = {}
    for number, point in enumerate(results.store.manifest.points):
        if len(point.values) != 1:
            fields = ", ".join(point.values) or "no field"
            raise InputError(f"point {number}: sets {fields}; allowed: one field at a time")
        ((field, value),) = point.values.items()
        positions[field] = positions.get(field, -1) + 1
        points.append((number, field, value_text(value), positions[field]))
    table = pd.DataFrame(points, columns=["point", "field", "value", "position"])
    return table.merge(summary.means(results), on="point")


def changes(
    results: Results, table: pd.DataFrame, policy: str, field: str, metric: str
) -> pd.DataFrame:
    """Compare every two values of a parameter on the same missions.

    Args:
        results: The study.
        table: Its ``effects``.
        policy: The policy.
        field: The parameter.
        metric: The metric.

    Returns:
        A row per pair: ``first`` and ``second`` (positions), ``difference`` (second - first) with
        ``low`` and ``high`` (95 % each), ``wide_low`` and ``wide_high`` (95 % for all pairs at
        once, by Bonferroni), ``p``, ``p_adjusted`` (Holm, over the pairs) and ``n``, the number of
        replications.
    """
    points = table[table["field"] == field].drop_duplicates("position")
    positions = dict(zip(points["point"], points["position"], strict=True))
    missions = results.missions[results.missions["point"].isin(positions)]
    missions = missions[missions["policy"] == policy]
    values = missions.pivot(index="replication", columns="point", values=metric).dropna()
    values = values.rename(columns=positions).astype(float)
    couples = [*combinations(sorted(values), 2)]
    at_once = 1 - (1 - LEVEL) / max(len(couples), 1)
    rows = []
    for first, second in couples:
        samples = values[second].to_numpy(), values[first].to_numpy()
        pair, wide = (paired(*samples, level, metric) for level in (LEVEL, at_once))
        ends = pair.low, pair.high, wide.low, wide.high
        rows.append((first, second, pair.difference, *ends, pair.p, pair.n))
    columns = ["first", "second", "difference", "low", "high", "wide_low", "wide_high", "p", "n"]
    pairs = pd.DataFrame(rows, columns=columns)
    return pairs.assign(p_adjusted=adjust(pairs["p"].to_numpy(float), "holm"))


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
    ups, downs = _differing(pairs, 1), _differing(pairs, -1)
    places = range(int(pairs["second"].max()) + 1)
    peaks = tuple(p for p in places if _passes(p, ups, downs))
    valleys = tuple(p for p in places if _passes(p, downs, ups))
    if not ups and not downs:
        words = LEVELS
    elif not downs:
        words = RISES
    elif not ups:
        words = FALLS
    else:
        words = PEAK if peaks else VALLEY if valleys else IRREGULAR
    return Shape(words, peaks)


def _differing(pairs: pd.DataFrame, sign: int) -> set[tuple[int, int]]:
    """The pairs of positions with a significant rise (sign 1) or fall (sign -1)."""
    rows = pairs[(pairs["p_adjusted"] <= 1 - LEVEL) & (np.sign(pairs["difference"]) == sign)]
    return set(zip(rows["first"], rows["second"], strict=True))


def _passes(peak: int, ups: set[tuple[int, int]], downs: set[tuple[int, int]]) -> bool:
    """Whether there is no fall before the peak, and no rise after it."""
    return all(b > peak for _, b in downs) and all(a < peak for a, _ in ups)


def leading_policies(
    results: Results, learned: str | None = None, heuristic: str | None = None
) -> list[str]:
    """The best learned policy of a study, if it has one, and its best heuristic.

    Args:
        results: The study.
        learned: The learned policy to take instead of the best one.
        heuristic: The heuristic to take instead of the best one.
    """
    trained = {policy for names in summary.learners(results).values() for policy in names}
    ranked = summary.ranked_policies(results.missions)
    best = [next((p for p in ranked if (p in trained) is kind), None) for kind in (True, False)]
    return [policy for policy in (learned or best[0], heuristic or best[1]) if policy]


def listed(table: pd.DataFrame, changes: ByField, ratios: ByField) -> pd.DataFrame:
    """How collection ratio and communication goes along every parameter, as a table to print.

    Beside the change of the product from the first to the last value stands that of the collection
    ratio alone, which no failed mission moves: a few failures can make most of a small change.

    Args:
        table: The ``effects``.
        changes: ``changes_by_field``.
        ratios: The same of the collection ratio.
    """
    rows = table[table["metric"] == PRODUCT]
    rows = rows.set_index(["policy", "field", "position"]).sort_index()
    lines = []
    for field, pairs_of_field in changes.items():
        for policy, pairs in pairs_of_field.items():
            values = rows.loc[(policy, field)]
            first, last = values.iloc[0], values.iloc[-1]
            change, of_ratio = (
                of.set_index(["first", "second"]).loc[(0, len(values) - 1), _ENDS]
                for of in (pairs, ratios[field][policy])
            )
            along = shape(pairs)
            peaks = values.loc[[*along.peaks], "value"] if along.words == PEAK else []
            lines.append(
                {
                    "Parameter": parameter(field).name,
                    "Policy": policy,
                    "Along the values": along.words,
                    "First": f"{numbers.percent(first['mean'])} at {first['value']}",
                    "Last": f"{numbers.percent(last['mean'])} at {last['value']}",
                    "Last − first": numbers.points(*change),
                    "Of the ratio alone": numbers.points(*of_ratio),
                    "Highest at": " or ".join(peaks),
                }
            )
    return pd.DataFrame(lines)
