"""The settings of a study (policies at design points): ranked, compared and averaged.

    results = load_results("results/fleets")
    ranked(results)  # the best setting first, and those that may be as good
    averaged(results, ["uavs"])  # by number of UAVs, averaged over all other varied fields

All functions compare settings on common replications: every setting meets the same random draws.
``metric`` is a column of ``results.missions``.
"""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from analysis import numbers
from analysis.names import COST, LESS_IS_BETTER, METRICS, PRODUCT, metrics_in, parameter, value_text
from analysis.results.tables import Results, once
from analysis.stats.choices import may_be_best
from analysis.stats.differences import column_tests, with_adjusted
from analysis.stats.intervals import by_replication, column_intervals, stratified
from dess import InputError
from dess.errors import one_of
from dess.scenario import ZONE_PADS

AS_IT_IS = "the scenario"  # a design point in words, if the design varies nothing
_UNITS = {"uavs": "UAV", "pads": "pad"}  # fields that are counts
MOST_VALUES, BINS = 12, 5  # a field with more than MOST_VALUES numbers is divided into BINS bins


def varied(results: Results) -> dict[str, list[Any]]:
    """The fields that have more than one value over the design, in the order of the study.

    Returns:
        For each field its values: numbers in ascending order, others as text in the order of the
        study.
    """
    table = points(results)
    return {str(field): _ordered(table[field]) for field in table}


@once
def points(results: Results) -> pd.DataFrame:
    """The values of the varied fields at every design point.

    Returns:
        A row per design point and a column per field. If a point does not set a field, the value is
        that of the scenario. Values that are not numbers are text, such as ``5–7.5`` for a range.
    """
    manifest = results.store.manifest
    columns = {}
    for field in manifest.values[0]:
        values = [of_point[field] for of_point in manifest.values]
        if field == "pads":  # without a number, it depends on the zone
            values = [results.scenario(number).zone_pads[0] for number in range(len(values))]
        texts = _texts(field, values)
        if len({*texts}) > 1:
            columns[field] = texts
    return pd.DataFrame(columns, index=range(len(manifest.points)))


def in_words(results: Results) -> list[str]:
    """Every design point in words, as ``3 UAVs, arrival rate 0.02``."""
    rows = points(results).to_dict("records")
    return [
        ", ".join(value_in_words(str(f), v) for f, v in row.items()) or AS_IT_IS for row in rows
    ]


def dependence(results: Results, ranked: pd.DataFrame, metric: str) -> list[str]:
    """A sentence for each policy but the best: which setting it would have found, and its mean.

    Args:
        results: The study.
        ranked: The result of ``ranked`` for the metric.
        metric: The metric.
    """
    words, best = in_words(results), ranked.iloc[0]
    others = ranked[ranked["policy"] != best["policy"]].drop_duplicates("policy")
    ends = others[[metric, f"{metric}_low", f"{metric}_high"]].to_numpy()
    named = zip(others["policy"], others["point"], ends, strict=True)
    return [
        f"With {policy}, it would be {words[point]}: {numbers.written(metric)(*of_metric)}."
        for policy, point, of_metric in named
        if len(words) > 1
    ]


def ends(results: Results, point: int) -> dict[str, str]:
    """The fields that have the least or the largest of their values at a design point.

    Beyond such an end there may be a better setting. An end that is a limit of the scenario itself,
    such as one UAV, or as many pads as the zone has cells, does not count.

    Args:
        results: The study.
        point: The design point.

    Returns:
        For each of these fields ``least`` or ``largest``.
    """
    space, found = results.scenario(point), {}
    for field, values in points(results).items():
        if is_numeric_dtype(values) and field in space.numeric:
            low, high = space.limits(field)
            if values[point] == values.min() != low:
                found[str(field)] = "least"
            elif values[point] == values.max() != high:
                found[str(field)] = "largest"
    return found


def edge(
    results: Results, point: int, found: Mapping[str, str], better: str = "a better one"
) -> str:
    """A sentence that says at which ends a design point lies; empty if at none.

    Args:
        results: The study.
        point: The design point.
        found: Its ``ends``.
        better: What may lie beyond.
    """
    values = points(results).loc[point]
    named = [f"{value_in_words(f, values[f])} is the {word}" for f, word in found.items()]
    return f" Of the values asked for, {numbers.words(named)}; {better} may lie beyond." * bool(
        named
    )


def value_in_words(field: str, value: Any) -> str:
    """``3 UAVs``, ``failed UAVs lost for good``, or ``arrival rate 0.02``."""
    text = value_text(value)
    if field == "failures.uav_repair":
        return f"failed UAVs {f'repaired in {text} slots' if value else 'lost for good'}"
    if unit := _UNITS.get(field):
        return f"{text} {unit}{'' if text == '1' else 's'}"
    return f"{parameter(field).within} {text}"


@once
def ranked(results: Results, metric: str = PRODUCT, policy: str | None = None) -> pd.DataFrame:
    """The settings by the mean of a metric, the best first.

    Args:
        results: The study.
        metric: The metric that ranks them.
        policy: The policy whose settings are ranked; by default all policies.

    Returns:
        A row per policy and design point: ``rank``, ``policy``, ``point``, the varied fields, for
        every metric ``METRIC``, ``METRIC_low`` and ``METRIC_high`` (95 % intervals as in
        ``analysis.summary``), ``n`` missions, and ``tied``: whether the setting may be the best, by
        ``may_be_best`` over all rows. Of equal settings, the first in the study has the lower rank.

    Raises:
        InputError: If there is no such metric or policy.
    """
    missions, cell = _missions(results, metric, policy), ["policy", "point"]
    table = missions.groupby(cell, sort=False).size().rename("n").reset_index()
    table = table.join(points(results), on="point")
    others = [name for name in metrics_in(missions) if name != metric]
    for name in (*others, metric):
        wide = by_replication(missions, name, cell)
        wide = wide.reindex(columns=pd.MultiIndex.from_frame(table[cell]))
        ends = column_intervals(wide, name)
        table[[name, f"{name}_low", f"{name}_high"]] = ends[["mean", "low", "high"]].to_numpy()
    # By the ranking metric, which was computed last.
    table["tied"] = may_be_best(wide.to_numpy(float), metric)
    less = metric in LESS_IS_BETTER
    table = table.sort_values(metric, ascending=less, kind="stable", ignore_index=True)
    table.insert(0, "rank", np.arange(1, len(table) + 1))
    return table


@once
def averaged(
    results: Results, by: Sequence[str], metric: str = PRODUCT, policy: str | None = None
) -> pd.DataFrame:
    """Means of every policy at each combination of values of some fields.

    Where several design points have the same values of these fields, the mean is taken over these
    points (partial dependence on the fields). The intervals are conditional on the design: its
    points are strata, see ``stats.intervals.stratified``. Only replications that all these points
    have are counted.

    Args:
        results: The study.
        by: One or more varied fields.
        metric: The metric.
        policy: The policy; by default all policies.

    Returns:
        A row per policy and combination, in the order of the study: ``policy``, the fields,
        ``mean``, ``low``, ``high`` (95 %), ``n`` replications, ``points`` (number of points that
        the mean is taken over), and ``tied``: whether the combination may be the best of this
        policy.

    Raises:
        InputError: If there is no such field, metric or policy.
    """
    table = points(results)
    if unknown := [field for field in by if field not in table]:
        allowed = one_of(unknown[0], map(str, table))
        raise InputError(f"{unknown[0]}: has not several values in the study{allowed}")
    return _averaged(results, table[[*by]], metric, policy)


@once
def main_effects(
    results: Results, metric: str = PRODUCT, policy: str | None = None
) -> pd.DataFrame:
    """The partial dependence of a metric on every varied field, see ``averaged``.

    A field with more than ``MOST_VALUES`` numbers, as in a sampled design, is divided into bins
    with about equally many design points.

    Returns:
        A row per field, policy and value: ``field``, ``value`` in words, ``position`` (0, 1, ... in
        the order of the values) and the columns of ``averaged`` but the fields.
    """
    tables = []
    for field, values in points(results).items():
        binned = _binned(values)
        means = _averaged(results, binned.to_frame("value"), metric, policy)
        for _, rows in means.groupby("policy", sort=False):
            rows.insert(0, "field", field)
            rows.insert(2, "position", rows["value"].map(_ordered(binned).index).astype(int))
            rows["value"] = rows["value"].map(value_text)
            tables.append(rows.sort_values("position", kind="stable"))
    return pd.concat(tables, ignore_index=True) if tables else pd.DataFrame()


def at_best(results: Results, table: pd.DataFrame) -> pd.DataFrame:
    """The missions of every policy at its best design point.

    Args:
        results: The study.
        table: The result of ``ranked``.
    """
    best = table.drop_duplicates("policy")[["policy", "point"]]
    return results.missions.merge(best, on=["policy", "point"])


def by_influence(effects: pd.DataFrame) -> list[str]:
    """The fields, sorted by the size of their effect on the metric, the largest first.

    Args:
        effects: Rows of ``main_effects``.
    """
    means = effects.groupby(["field", "policy"], sort=False)["mean"]
    spans = (means.max() - means.min()).groupby("field", sort=False).mean()
    return [str(field) for field in spans.sort_values(ascending=False, kind="stable").index]


def against(results: Results, point: int = 0, metrics: Iterable[str] = METRICS) -> pd.DataFrame:
    """Every design point compared with a baseline point, with the same policy and replications.

    Args:
        results: The study.
        point: The number of the baseline point.
        metrics: The metrics.

    Returns:
        A row per metric, policy and other design point: ``metric``, ``policy``, ``point``, the
        varied fields, ``difference`` (positive if more than at the baseline) with ``low`` and
        ``high`` (95 % each), ``p``, ``p_adjusted`` (Holm, over the rows of the metric) and ``n``
        pairs. A point without a replication of the baseline has no row.

    Raises:
        InputError: If there is no such point or metric.
    """
    count = len(results.store.manifest.points)
    if not 0 <= point < count:
        raise InputError(f"baseline: {point} is not a design point; allowed: 0..{count - 1}")
    tables = []
    for metric in metrics:
        parts = []
        for policy, missions in _missions(results, metric, None).groupby("policy", sort=False):
            wide = by_replication(missions, metric, "point")
            tests = column_tests(wide.drop(columns=point), wide[point], metric)
            tests = tests[tests["n"] > 0].join(points(results)).reset_index()
            parts.append(tests.assign(metric=metric, policy=policy))
        tables.append(with_adjusted(pd.concat(parts, ignore_index=True), "holm"))
    measured = ["difference", "low", "high", "p", "p_adjusted", "n"]
    columns = ["metric", "policy", "point", *points(results), *measured]
    return pd.concat(tables, ignore_index=True)[columns]


def _averaged(
    results: Results, labels: pd.DataFrame, metric: str, policy: str | None
) -> pd.DataFrame:
    """The means at each combination of labels of design points, as ``averaged`` returns them."""
    groups = labels.groupby([*labels], sort=False)
    cell_of, cells = groups.ngroup().to_numpy(), labels.drop_duplicates(ignore_index=True)
    sizes = np.bincount(cell_of)
    missions = _missions(results, metric, policy)
    design = results.manifest["study"]["design"] or {}
    if sampled := design.get("kind") == "saltelli":  # only its samples A and B are independent
        last = len(design["ranges"]) + 2
        missions = missions[(missions["point"] % (last + 1)).isin((0, last))]
    missions = missions.assign(cell=cell_of[missions["point"].to_numpy()])
    tables = []
    for name, part in missions.groupby("policy", sort=False):
        units = part.groupby(["cell", "replication"])[metric].agg(["mean", "size"])
        if not sampled:  # only replications that all points of a cell have
            units = units[units["size"] == sizes[units.index.get_level_values("cell")]]
        wide = units["mean"].unstack("cell").reindex(columns=range(len(cells)))
        if sampled:
            ends = column_intervals(wide, metric)
        else:
            at_points = by_replication(part, metric, "point")
            ends = _over_points(at_points.reindex(columns=range(len(cell_of))), cell_of, metric)
        table = pd.concat([cells, ends], axis=1)
        table = table.assign(points=sizes, tied=may_be_best(wide.to_numpy(float), metric))
        table.insert(0, "policy", name)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _over_points(values: pd.DataFrame, cell_of: np.ndarray, metric: str) -> pd.DataFrame:
    """``mean``, ``low``, ``high`` and ``n`` of every cell, with its points as strata, or nan.

    Args:
        values: (R, K) a row per replication and a column per design point.
        cell_of: (K,) the cell of every point.
        metric: The metric.
    """
    rows = []
    for cell in range(cell_of.max() + 1):
        complete = values.loc[:, cell_of == cell].dropna().to_numpy(float)
        ends = stratified(complete, metric) if len(complete) else [np.nan] * 3
        rows.append((*ends, len(complete)))
    return pd.DataFrame(rows, columns=["mean", "low", "high", "n"])


def check_metric(results: Results, metric: str) -> None:
    """Raise ``InputError`` if the missions do not have the metric."""
    known = [*metrics_in(results.missions), *([COST] if COST in results.missions else [])]
    if metric not in known:
        raise InputError(f"metric: {metric!r} is unknown{one_of(metric, known)}")


def _missions(results: Results, metric: str, policy: str | None) -> pd.DataFrame:
    """The missions of a policy, or of all, if they have the metric.

    Raises:
        InputError: If there is no such metric or policy.
    """
    check_metric(results, metric)
    if policy is None:
        return results.missions
    results.check_policy(policy)
    return results.missions[results.missions["policy"] == policy]


def _ordered(values: pd.Series) -> list[Any]:
    """The distinct values: numbers and bins in ascending order, others in order of appearance."""
    unique = values.drop_duplicates()
    ascends = is_numeric_dtype(unique) or isinstance(unique.dtype, pd.CategoricalDtype)
    return (unique.sort_values() if ascends else unique).tolist()


def _binned(values: pd.Series) -> pd.Series:
    """The values, or their bins if there are too many different numbers."""
    if not is_numeric_dtype(values) or values.nunique() <= MOST_VALUES:
        return values
    places = pd.qcut(values, BINS, labels=False, duplicates="drop")
    ends = values.groupby(places).agg(["min", "max"])
    names = [f"{low:.3g}–{high:.3g}" for low, high in ends.to_numpy()]
    return places.map(dict(enumerate(names))).astype(pd.CategoricalDtype(names, ordered=True))


def _texts(field: str, values: Sequence[Any]) -> list[Any]:
    """The values unchanged if all are numbers, otherwise as text."""
    if field == "nodes":
        maps, _ = pd.factorize(pd.Series(map(str, values)))
        return [f"{len(nodes)} cells (map {n})" for nodes, n in zip(values, maps + 1, strict=True)]
    if field == ZONE_PADS:
        return [" + ".join(map(str, v)) if isinstance(v, list | tuple) else v for v in values]
    if field == "zone":
        return [f"{width} x {height} at ({x}, {y})" for x, y, width, height in values]
    plain = [
        v[0] if isinstance(v, list | tuple) and v and all(item == v[0] for item in v) else v
        for v in values
    ]
    is_text = any(isinstance(value, bool | list | tuple | dict) for value in plain)
    return [*map(value_text, plain)] if is_text else plain
