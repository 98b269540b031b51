"""What each scenario parameter does: the metrics along its values, and the shape of the way.

For designs that vary one parameter at a time (the paper's Fig. 5). All values of a parameter meet
the same replications, so they are compared mission by mission.
"""

from dataclasses import dataclass
from itertools import combinations

import numpy as np
import pandas as pd

from analysis.names import SHARES, value_text
from analysis.questions import summary
from analysis.results.tables import Results
from analysis.stats.correction import adjust
from analysis.stats.intervals import LEVEL
from analysis.stats.paired import paired
from dess.errors import InputError

LEVELS, RISES, FALLS = "stays level", "rises", "falls"
PEAK, VALLEY, IRREGULAR = "rises, then falls", "falls, then rises", "goes up and down"


@dataclass(frozen=True)
class Shape:
    """How a metric goes along the values of a parameter.

    Two values differ if their Holm-adjusted p-value is at most 1 - ``LEVEL``. Without any that do
    it stays level; if all differences have one sign it rises or falls; if no two before a value
    fall and no two behind it rise, it rises to there, then falls; and the other way round.

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
            found = ", ".join(point.values) or "no field"
            raise InputError(f"point {number}: sets {found}; allowed: one field at a time")
        ((field, value),) = point.values.items()
        position = positions.setdefault(field, 0)
        positions[field] = position + 1
        points.append((number, field, value_text(value), position))
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
    places = dict(zip(points["point"], points["position"], strict=True))
    ours = results.missions[
        (results.missions["policy"] == policy) & results.missions["point"].isin(places)
    ]
    values = ours.pivot(index="replication", columns="point", values=metric).dropna()
    values = values.rename(columns=places).astype(float)
    couples = [*combinations(sorted(values), 2)]
    at_once = 1 - (1 - LEVEL) / max(len(couples), 1)
    rows = []
    for first, second in couples:
        of = values[second].to_numpy(), values[first].to_numpy()
        pair, wide = (paired(*of, level, share=metric in SHARES) for level in (LEVEL, at_once))
        ends = pair.low, pair.high, wide.low, wide.high
        rows.append((first, second, pair.difference, *ends, pair.p, pair.n))
    columns = ["first", "second", "difference", "low", "high", "wide_low", "wide_high", "p", "n"]
    pairs = pd.DataFrame(rows, columns=columns)
    return pairs.assign(p_adjusted=adjust(pairs["p"].to_numpy(float), "holm"))


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
