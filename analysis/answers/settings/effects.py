"""Means of a metric at the values of some fields, averaged over all other varied fields.

average_over_others(results, ["uavs"])  # by number of UAVs
main_effects(results)  # by each field
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from pandas.api.types import is_numeric_dtype

from dess import InputError
from dess.analysis.answers.settings.points import (
    ordered_values,
    points_left,
    values_of_points,
)
from dess.analysis.measured import check_metric, metrics_in
from dess.analysis.metric_ranges import metric_in_groups
from dess.analysis.metrics import PRODUCT, Metric, metric_of
from dess.analysis.names import field_named, value_text
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.alternatives import judge_alternatives, may_lead
from dess.analysis.stats.intervals import Interval, column_intervals, stratified_interval
from dess.analysis.stats.kinds import level_after
from dess.analysis.stats.weights import by_replication
from dess.analysis.tables import Table
from dess.base.errors import unknown_name

# The columns that say how a mean compares with the others, see ``average_over_others``.
JUDGED = ("standing", "tied", "selected")
MOST_VALUES, BINS = 12, 5  # a field with more than MOST_VALUES numbers is divided into BINS bins


@compute_once
def average_over_others(
    results: Results, by: Sequence[str], metric: str = PRODUCT, policy: str | None = None
) -> pd.DataFrame:
    """Means of every policy at each combination of values of some fields.

    Where several design points have the same values of these fields, the mean is taken over these
    points (partial dependence on the fields). The intervals are conditional on the design: its
    points are strata, see ``stats.intervals.stratified_interval``. Only replications that all these
    points have are counted.

    Args:
        results: The study.
        by: One or more varied fields.
        metric: The metric.
        policy: The policy; by default all policies.

    Returns:
        A row per policy and combination, in the order of the study: ``policy``, the fields,
        ``mean``, ``low``, ``high`` (95 %), ``n`` replications, ``points`` (number of points that
        the mean is taken over), ``standing``: how the combination compares with the others of this
        policy (``stats.alternatives.judge_alternatives``), ``tied``: whether it may be the best by
        what was seen, and ``selected``: whether it is the design point that the study selects.

    Raises:
        InputError: If there is no such field, metric or policy.
    """
    table = values_of_points(results)
    if unknown := [field for field in by if field not in table]:
        problem = "has not several values in the study"
        raise unknown_name(unknown[0], problem, unknown[0], map(str, table))
    return _average_labelled(results, table[[*by]], metric, policy)


@compute_once
def main_effects(
    results: Results, metric: str = PRODUCT, policy: str | None = None
) -> pd.DataFrame:
    """The partial dependence of a metric on every varied field, see ``average_over_others``.

    A field with more than ``MOST_VALUES`` numbers, as in a sampled design, is divided into bins
    with about equally many design points. Of a design that varies one field at a time, a field has
    the values of the points that set it, without bins.

    Returns:
        A row per field, policy and value: ``field``, ``value`` in words, ``position`` (0, 1, ... in
        the order of the values) and the columns of ``average_over_others`` but the fields.
    """
    tables = []
    for field in values_of_points(results):
        binned = labels_of_field(results, str(field))
        means = _average_labelled(results, binned.to_frame("value"), metric, policy)
        for _, rows in means.groupby("policy", sort=False):
            rows.insert(0, "field", field)
            rows.insert(2, "position", rows["value"].map(ordered_values(binned).index).astype(int))
            rows["value"] = rows["value"].map(value_text)
            tables.append(rows.sort_values("position", kind="stable"))
    if tables:
        return pd.concat(tables, ignore_index=True)
    return pd.DataFrame()


def labels_of_field(results: Results, field: str) -> pd.Series:
    """The values of a field, or their bins, at the design points whose means tell its effect."""
    values = values_of_points(results)[field]
    if results.design == "one-at-a-time":
        return values[[field in point.values for point in results.store.manifest.points]]
    return _bin_values(values)


def means_by_field(results: Results) -> pd.DataFrame:
    """The ``main_effects`` on all metrics, of a design that varies one field at a time.

    Returns:
        A row per metric, field, policy and value: ``field``, ``value``, ``position``, ``policy``,
        ``metric``, ``mean``, ``low``, ``high`` (95 %) and ``n``, as ``main_effects`` has them.

    Raises:
        InputError: If a design point sets more or less than one field.
    """
    for number, point in enumerate(results.store.manifest.points):
        if len(point.values) != 1:
            fields = ", ".join(point.values) or "no field"
            raise InputError(f"point {number}", f"sets {fields}", "one field at a time")
    tables = [
        main_effects(results, metric).assign(metric=metric)
        for metric in metrics_in(results.missions)
    ]
    columns = ["field", "value", "position", "policy", "metric", "mean", "low", "high", "n"]
    return pd.concat(tables, ignore_index=True).reindex(columns=columns)


def fields_by_influence(effects: pd.DataFrame) -> list[str]:
    """The fields, sorted by the size of their effect on the metric, the largest first.

    Args:
        effects: Rows of ``main_effects``.
    """
    means = effects.groupby(["field", "policy"], sort=False)["mean"]
    spans = (means.max() - means.min()).groupby("field", sort=False).mean()
    return [str(field) for field in spans.sort_values(ascending=False, kind="stable").index]


def _average_labelled(
    results: Results, labels: pd.DataFrame, metric: str, policy: str | None
) -> pd.DataFrame:
    """``average_over_others`` at each combination of labels of some design points."""
    points = labels.index.to_numpy()
    cell_of_points = labels.groupby([*labels], sort=False).ngroup().to_numpy()
    cell_of = np.full(len(results.store.manifest.points), -1)
    cell_of[points] = cell_of_points
    cells = labels.drop_duplicates(ignore_index=True)
    sizes = np.bincount(cell_of_points)
    check_metric(metric, results.missions)
    missions = results.missions_of(policy)
    design = results.manifest["study"]["design"] or {}
    if sampled := design.get("kind") == "saltelli":  # only its samples A and B are independent
        last = len(design["ranges"]) + 2
        missions = missions[(missions["point"] % (last + 1)).isin((0, last))]
    missions = missions.assign(cell=cell_of[missions["point"].to_numpy()])
    missions = missions[missions["cell"] >= 0]
    tables = []
    for name, part in missions.groupby("policy", sort=False):
        analyses = results.analyses(str(name))
        seen = np.array([analyses[cell_of == cell].min() for cell in range(len(cells))])
        units = part.groupby(["cell", "replication"])[metric].agg(["mean", "size"])
        if not sampled:  # only replications that all points of a cell have
            units = units[units["size"] == sizes[units.index.get_level_values("cell")]]
        wide = units["mean"].unstack("cell").reindex(columns=range(len(cells)))
        of_cells = metric_in_groups(part, metric, ["cell"], wide.columns.to_frame(name="cell"))
        if sampled:
            ends = column_intervals(wide, of_cells)
        else:
            at_points = by_replication(part, metric, "point")
            at_points = at_points.reindex(columns=range(len(cell_of)))
            ends = _intervals_over_points(at_points, cell_of, of_cells, level_after(seen))
        left = np.ones(len(cells), bool)
        if (sizes == 1).all():  # a cell is a design point
            left[cell_of_points] = points_left(results, str(name))[points]
        verdicts = judge_alternatives(
            wide.to_numpy(float), ends["low"], ends["high"], of_cells, seen, left
        )
        table = pd.concat([cells, ends], axis=1)
        selected = np.zeros(len(cells), bool)
        if (choice := results.choice(str(name))) is not None:
            best_cell = cell_of[choice.best]
            selected[best_cell] = best_cell >= 0 and sizes[best_cell] == 1
        judged = verdicts, may_lead(verdicts), selected
        table = table.assign(points=sizes, **dict(zip(JUDGED, judged, strict=True)))
        table.insert(0, "policy", name)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _intervals_over_points(
    values: pd.DataFrame, cell_of: np.ndarray, metric: Metric, levels: np.ndarray
) -> pd.DataFrame:
    """``mean``, ``low``, ``high`` and ``n`` of every cell, with its points as strata, or nan.

    Args:
        values: (R, K) a row per replication and a column per design point.
        cell_of: (K,) the cell of every point.
        metric: The metric; the ends of its range may be arrays, with one for every cell.
        levels: The confidence level of every cell.
    """
    rows = []
    for cell in range(cell_of.max() + 1):
        complete = values.loc[:, cell_of == cell].dropna().to_numpy(float)
        level = float(levels[cell])
        ends = Interval(np.nan, np.nan, np.nan)
        if len(complete):
            ends = stratified_interval(complete, metric.at(cell), level)
        rows.append((*ends, len(complete)))
    return pd.DataFrame(rows, columns=["mean", "low", "high", "n"])


def _bin_values(values: pd.Series) -> pd.Series:
    """The values, or their bins if there are too many different numbers."""
    if not is_numeric_dtype(values) or values.nunique() <= MOST_VALUES:
        return values
    places = pd.qcut(values, BINS, labels=False, duplicates="drop")
    ends = values.groupby(places).agg(["min", "max"])
    names = [f"{low:.3g}–{high:.3g}" for low, high in ends.to_numpy()]
    return places.map(dict(enumerate(names))).astype(pd.CategoricalDtype(names, ordered=True))


def effect_table(results: Results, metric: str) -> Table:
    """The size of the effect of every field on a metric."""
    effects = main_effects(results, metric)
    measure = metric_of(metric)
    rows = []
    for (field, policy), part in effects.groupby(["field", "policy"], sort=False):
        low, high = part.loc[part["mean"].idxmin()], part.loc[part["mean"].idxmax()]
        both = [f"{measure.write(row['mean'])} at {row['value']}" for row in (low, high)]
        span = measure.write(high["mean"] - low["mean"]).replace(" %", " points")
        rows.append((field_named(str(field)).name, policy, *both, span))
    heads = ["Field", "Policy", "Lowest mean", "Highest mean", "Difference"]
    caption = f"The effect of each field on {measure.within}, averaged over the others"
    return Table(pd.DataFrame(rows, columns=heads), caption, effects.drop(columns=list(JUDGED)))
