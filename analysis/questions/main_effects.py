"""The main effects of scenario parameters: metrics along the values of each, and their shape.

For designs that vary one parameter at a time (the paper's Fig. 5). All values of a parameter meet
the same replications, so they are compared mission by mission:

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
from analysis.names import PRODUCT, SHARES, parameter, value_text
from analysis.questions import summary
from analysis.results.tables import Results
from analysis.stats.correction import adjust
from analysis.stats.intervals import LEVEL
from analysis.stats.paired import paired
from dess import InputError

LEVELS, RISES, FALLS = "stays level", "rises", "falls"
PEAK, VALLEY, IRREGULAR = "rises, then falls", "falls, then rises", "goes up and down"


@dataclass(frozen=True)
class Shape:
    """How a metric goes along the values of a parameter.

    Two values differ if their Holm-adjusted p-value is at most 1 - ``LEVEL``. Without any that do
    it stays level; if all differences have one sign it rises or falls; if no two before a value
    fall and no two behind it rise, it rises to that value, then falls; and the other way round.

    Attributes:
        words: One of ``LEVELS``, ``RISES``, ``FALLS``, ``PEAK``, ``VALLEY``, ``IRREGULAR``.
        peaks: Positions of the values that the highest point may be at.
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
    """Every two values of a parameter, compared on the same missions.

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
        pair, wide = (paired(*samples, level, metric in SHARES) for level in (LEVEL, at_once))
        ends = pair.low, pair.high, wide.low, wide.high
        rows.append((first, second, pair.difference, *ends, pair.p, pair.n))
    columns = ["first", "second", "difference", "low", "high", "wide_low", "wide_high", "p", "n"]
    pairs = pd.DataFrame(rows, columns=columns)
    return pairs.assign(p_adjusted=adjust(pairs["p"].to_numpy(float), "holm"))


def changes_by_field(results: Results, table: pd.DataFrame) -> dict[str, dict[str, pd.DataFrame]]:
    """The changes of collection ratio and communication, by parameter and policy.

    Args:
        results: The study.
        table: Its ``effects``, of some policies. A parameter with one value has no changes.
    """
    policies = table["policy"].unique()
    fields = table.groupby("field", sort=False)["position"].nunique()
    return {
        str(field): {p: changes(results, table, p, str(field), PRODUCT) for p in policies}
        for field in fields.index[fields > 1]
    }


def shape(pairs: pd.DataFrame) -> Shape:
    """The shape that the differences of ``changes`` leave."""
    ups, downs = differing(pairs, 1), differing(pairs, -1)
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


def differing(pairs: pd.DataFrame, sign: int) -> set[tuple[int, int]]:
    """The pairs of positions whose values differ, upwards (sign 1) or downwards (sign -1)."""
    rows = pairs[(pairs["p_adjusted"] <= 1 - LEVEL) & (np.sign(pairs["difference"]) == sign)]
    return set(zip(rows["first"], rows["second"], strict=True))


def _passes(peak: int, ups: set[tuple[int, int]], downs: set[tuple[int, int]]) -> bool:
    """Whether nothing falls on the way to the peak, and nothing rises behind it."""
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


def caption(table: pd.DataFrame, field: str, pairs: Mapping[str, pd.DataFrame]) -> str:
    """What a figure of a parameter shows: the shapes of its curves, and their missions.

    Args:
        table: The ``effects`` of the policies that are drawn.
        field: The parameter.
        pairs: Per policy, its ``changes`` in collection ratio and communication.
    """
    shapes = "; ".join(f"{policy} {shape(rows).words}" for policy, rows in pairs.items())
    n = table.loc[table["field"] == field, "n"].min()
    return (
        f"Collection ratio and communication: {shapes}. n = {n:,} missions per point, bars are "
        f"{numbers.level(LEVEL)} intervals."
    )


def in_words(table: pd.DataFrame, pairs: pd.DataFrame, policy: str, field: str) -> str:
    """How collection ratio and communication changes from a parameter's first value to its last.

    Args:
        table: The ``effects``.
        pairs: The ``changes`` of the policy along the parameter.
        policy: The policy.
        field: The parameter.
    """
    rows = table[(table["field"] == field) & (table["policy"] == policy)]
    rows = rows[rows["metric"] == PRODUCT].set_index("position")
    values, last = rows["value"], rows.index.max()
    change = pairs[(pairs["first"] == 0) & (pairs["second"] == last)]
    (points,) = change[["difference", "low", "high"]].itertuples(index=False)
    first_mean, last_mean = (numbers.percent(rows.loc[n, "mean"]) for n in (0, last))
    along = shape(pairs)
    text = (
        f"{policy} **{along.words}**: {first_mean} at {values[0]}, {last_mean} at {values[last]}, "
        f"{numbers.points(*points)} points"
    )
    if along.words != PEAK:
        return text
    about = " or so" if len(along.peaks) > 1 else ""
    return f"{text}, highest at {numbers.words([values[n] for n in along.peaks])}{about}"


def listed(table: pd.DataFrame, changes: Mapping[str, Mapping[str, pd.DataFrame]]) -> str:
    """Every parameter and, below it, every policy ``in_words``: a list in Markdown.

    Args:
        table: The ``effects``.
        changes: ``changes_by_field``.
    """
    lines = []
    for field, pairs in changes.items():
        lines.append(f"- **{parameter(field).name}**")
        lines += [f"    - {in_words(table, rows, p, field)}" for p, rows in pairs.items()]
    return "\n".join(lines)


def by_size(changes: Mapping[str, Mapping[str, pd.DataFrame]], policy: str) -> list[str]:
    """The parameters by their largest change, ``initial data per node (43.0 points)``.

    Args:
        changes: ``changes_by_field``.
        policy: The policy.
    """
    sizes = {field: pairs[policy]["difference"].abs().max() for field, pairs in changes.items()}
    ranked = sorted(sizes.items(), key=lambda item: -item[1])
    return [f"{parameter(field).within} ({100 * size:.1f} points)" for field, size in ranked]
