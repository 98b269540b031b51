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

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.fleet import home
from dess.analysis.metrics import (
    AGE,
    COST,
    METRICS,
    PRODUCT,
    Metric,
    in_either,
    known_in,
    lasting,
    metric_of,
    metrics_in,
    told,
)
from dess.analysis.names import parameter, value_text
from dess.analysis.results.tables import Results, once
from dess.analysis.stats.differences import column_tests, with_adjusted
from dess.analysis.stats.intervals import (
    by_replication,
    column_intervals,
    level_after,
    mean_interval,
    stratified,
)
from dess.analysis.stats.verdict import may_be_best, within_reach
from dess.analysis.tables import INTERVALS, MOST_ROWS, WIDER, YES, Table, allowed_for, counts
from dess.base.errors import one_of

MOST_NAMES = 3  # the largest number of settings that are named because they may be as good
# What grows with the length of a mission, so that missions of the same length are to be compared.
_OF_LENGTH = {*in_either(AGE, "peak_age", "age_p99"), COST}
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
        texts = parameter(field).comparable(values)
        if len({*texts}) > 1:
            columns[field] = texts
    return pd.DataFrame(columns, index=range(len(manifest.points)))


def in_words(results: Results) -> list[str]:
    """Every design point in words, as ``3 UAVs, arrival rate 0.02``; empty if nothing varies."""
    return [", ".join(words) for words in words_of(points(results))]


def words_of(table: pd.DataFrame) -> list[list[str]]:
    """The values of every row of some columns of ``points`` in words, each with its field."""
    rows = table.to_dict("records")
    return [[parameter(str(f)).words(v) for f, v in row.items()] for row in rows]


def setting_of(results: Results, policy: str, point: int) -> str:
    """A setting in words: ``greedy with 3 UAVs``; the policy alone if nothing varies."""
    words = in_words(results)[point]
    return f"{policy} with {words}" if words else policy


def baseline(results: Results, point: int) -> str:
    """The design point with which all others are compared, in words.

    Raises:
        InputError: If there is no such design point.
    """
    words = in_words(results)
    if point not in range(len(words)):
        raise InputError(f"baseline: {point!r} is not a design point; allowed: 0..{len(words) - 1}")
    return words[point]


def ranking_metric(results: Results, metric: str | None = None) -> str:
    """The metric that ranks the settings: the given one, the one of the selection, or the product.

    Raises:
        InputError: If there is no such metric.
    """
    if metric is None:
        metric = getattr(results.study.selection, "metric", PRODUCT)
    metric = told(metric, results.missions)
    check_metric(results, metric)
    return metric


def answer(results: Results, table: pd.DataFrame, metric: str) -> str:
    """The best setting, and how many settings may be as good.

    Args:
        results: The study.
        table: The result of ``ranked`` for the metric.
        metric: The metric.
    """
    policies = dependence(results, table, metric) if len(results.policies) == 2 else []
    return " ".join([best_sentence(results, table, metric), *policies])


def best_sentence(results: Results, table: pd.DataFrame, metric: str) -> str:
    """The best setting, how many may be as good, and what else is to be said of it.

    Args:
        results: The study.
        table: The result of ``ranked`` for the metric.
        metric: The metric.
    """
    of, best, others, tied = metric_of(metric), table.iloc[0], len(table) - 1, table[table["tied"]]
    value = of.written(*best[[metric, f"{metric}_low", f"{metric}_high"]])
    names = [setting_of(results, row.policy, row.point) for row in tied.itertuples()]
    what, many = "setting" if varied(results) else "policy", len(names) - 1
    named = f" ({'; '.join(names[1:])})" * (many <= MOST_NAMES)
    if others == 1:
        rest = f"The other {what} {'may be as good' if many else 'is significantly worse'}."
    elif not many:
        rest = f"All {others:,} others are significantly worse." if others else ""
    elif many == others:
        rest = f"All {others:,} others may be as good{named}."
    else:
        rest = (
            f"Of the {others:,} others, {many:,} may be as good{named}; the rest are "
            "significantly worse."
        )
    parts = [
        f"The best {what} is {names[0]}: {of.within} {value}, n = {best['n']:,}.",
        rest,
        edge(results, best["point"], ends(results, best["point"])).strip(),
        home.share_sentence(results, best, metric),
        unequal_lengths(results, [metric]),
    ]
    return " ".join(filter(None, parts))


def unequal_lengths(results: Results, metrics: Iterable[str]) -> str:
    """That missions of different lengths are compared by what depends on it; empty if not so.

    Ages grow while a mission lasts, and hours are paid for. A cost is only to be among the metrics
    where it depends on them.

    Args:
        results: The study.
        metrics: The metrics that are compared.
    """
    compared = [metric_of(metric).within for metric in metrics if metric in _OF_LENGTH]
    missions = results.missions
    has_quota = any(space.quota for space in results.store.manifest.scenarios)
    if not compared or not has_quota or missions["slots"].nunique() == 1:
        return ""
    means = missions.groupby(["policy", "point"])["slots"].mean()
    units = results.scenario().units
    lengths = [lasting(round(slots), units) for slots in (means.min(), means.max())]
    return (
        f"Missions end with their last UAV, after {' to '.join(dict.fromkeys(lengths))} on "
        f"average, so settings are compared by {numbers.words(compared)} over missions of "
        "different lengths; with quota = 0, all missions last until max_slots."
    )


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
        f"With the policy {policy}, it would be {words[point]}: {metric_of(metric).within} "
        f"{metric_of(metric).written(*of_metric)}."
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
    named = [f"{parameter(f).words(values[f])} is the {word}" for f, word in found.items()]
    return f" Of the values asked for, {numbers.words(named)}; {better} may lie beyond." * bool(
        named
    )


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
        ``dess.analysis.summary``, which allow for a search), ``n`` missions, and ``tied``: whether
        the setting may be the best, by ``may_be_best`` and ``within_reach`` over all rows. Of equal
        settings, the first in the study has the lower rank.

    Raises:
        InputError: If there is no such metric or policy.
    """
    missions, cell = _missions(results, metric, policy), ["policy", "point"]
    table = missions.groupby(cell, sort=False).size().rename("n").reset_index()
    table = table.join(points(results), on="point")
    looks = {policy: results.looks(policy) for policy in missions["policy"].unique()}
    seen = np.array([looks[row.policy][row.point] for row in table.itertuples()])
    others = [name for name in metrics_in(missions) if name != metric]
    for name in (*others, metric):
        wide = by_replication(missions, name, cell)
        wide = wide.reindex(columns=pd.MultiIndex.from_frame(table[cell]))
        ends = column_intervals(wide, known_in(missions, name), level_after(seen))
        table[[name, f"{name}_low", f"{name}_high"]] = ends[["mean", "low", "high"]].to_numpy()
    # By the ranking metric, which was computed last.
    table["tied"] = may_be_best(wide.to_numpy(float), known_in(missions, metric), seen)
    table["tied"] &= within_reach(table[f"{metric}_low"], table[f"{metric}_high"], metric)
    less = metric_of(metric).less_is_better
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
        pairs. Intervals and p-values allow for a search. A point without a replication of the
        baseline has no row.

    Raises:
        InputError: If there is no such point or metric.
    """
    baseline(results, point)
    tables = []
    for metric in metrics:
        parts = []
        for policy, missions in _missions(results, metric, None).groupby("policy", sort=False):
            wide = by_replication(missions, metric, "point")
            of, others = known_in(results.missions, metric), wide.drop(columns=point)
            looks = results.looks(str(policy))
            # The pairs end with the missions of the one that has fewer.
            seen = np.minimum(looks[others.columns.to_numpy()], looks[point])
            tests = column_tests(others, wide[point], of, level_after(seen))
            tests["p"] = (tests["p"] * np.maximum(seen * (seen + 1), 1)).clip(upper=1)
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
    missions, of = _missions(results, metric, policy), known_in(results.missions, metric)
    design = results.manifest["study"]["design"] or {}
    if sampled := design.get("kind") == "saltelli":  # only its samples A and B are independent
        last = len(design["ranges"]) + 2
        missions = missions[(missions["point"] % (last + 1)).isin((0, last))]
    missions = missions.assign(cell=cell_of[missions["point"].to_numpy()])
    tables = []
    for name, part in missions.groupby("policy", sort=False):
        looks = results.looks(str(name))
        seen = np.array([looks[cell_of == cell].min() for cell in range(len(cells))])
        units = part.groupby(["cell", "replication"])[metric].agg(["mean", "size"])
        if not sampled:  # only replications that all points of a cell have
            units = units[units["size"] == sizes[units.index.get_level_values("cell")]]
        wide = units["mean"].unstack("cell").reindex(columns=range(len(cells)))
        if sampled:
            ends = column_intervals(wide, of)
        else:
            at_points = by_replication(part, metric, "point")
            at_points = at_points.reindex(columns=range(len(cell_of)))
            ends = _over_points(at_points, cell_of, of, level_after(seen))
        table = pd.concat([cells, ends], axis=1)
        table = table.assign(points=sizes, tied=may_be_best(wide.to_numpy(float), of, seen))
        table.insert(0, "policy", name)
        tables.append(table)
    return pd.concat(tables, ignore_index=True)


def _over_points(
    values: pd.DataFrame, cell_of: np.ndarray, metric: Metric, levels: np.ndarray
) -> pd.DataFrame:
    """``mean``, ``low``, ``high`` and ``n`` of every cell, with its points as strata, or nan.

    Args:
        values: (R, K) a row per replication and a column per design point.
        cell_of: (K,) the cell of every point.
        metric: The metric.
        levels: The confidence level of every cell.
    """
    rows = []
    for cell in range(cell_of.max() + 1):
        complete = values.loc[:, cell_of == cell].dropna().to_numpy(float)
        level = float(levels[cell])
        ends = stratified(complete, metric, level) if len(complete) else [np.nan] * 3
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


def intervals_in_words(results: Results) -> str:
    """What the intervals of the means of a study's settings are called."""
    is_search = any(results.looks(policy).any() for policy in results.policies)
    return f"{INTERVALS} that allow for the search" if is_search else INTERVALS


def allowance_in_words(results: Results, rows: pd.DataFrame, metric: str) -> str:
    """Why a setting may be the best although its mean is lower; empty if intervals hardly allow it.

    Args:
        results: The study.
        rows: Its ``ranked``.
        metric: The metric that ranks them.
    """
    first, of = rows.iloc[0], metric_of(metric)
    missions = _missions(results, metric, first["policy"])
    values = missions.loc[missions["point"] == first["point"], metric].to_numpy(float)
    plain = mean_interval(values[~np.isnan(values)])
    half = (plain.high - plain.low) / 2
    wide = (first[f"{metric}_high"] - first[f"{metric}_low"]) / 2
    if not of.is_bounded or not wide > WIDER * half:
        return ""
    best = setting_of(results, first["policy"], first["point"])
    alone, allowing = (f"±{100 * end:.2g} points" for end in (half, wide))
    return allowed_for(f"the {of.within} of {best}", alone, allowing, int(first["n"]))


def best_table(results: Results, rows: pd.DataFrame, metric: str) -> Table:
    """The best settings.

    Args:
        results: The study.
        rows: Its ``ranked``.
        metric: The metric that ranks them.
    """
    top = rows.head(MOST_ROWS)
    cells = _cells(results, top, metric)
    cells.insert(0, "Rank", top["rank"])
    cells.insert(1, "May be the best", top["tied"].map(YES))
    caption = (
        f"The first {len(top)} of {len(rows):,} settings by {metric_of(metric).within}: "
        f"means with {intervals_in_words(results)}"
    )
    return Table(cells, caption, rows)


def best_of_policies(results: Results, metric: str) -> Table:
    """The best setting of every policy, and how many of its settings may be as good."""
    own = [ranked(results, metric, policy) for policy in results.policies]
    best = pd.concat([rows.head(1) for rows in own], ignore_index=True)
    cells = _cells(results, best, metric)
    cells["May be its best"] = [f"{rows['tied'].sum():,} of {len(rows):,} settings" for rows in own]
    caption = f"The best setting of every policy by {metric_of(metric).within}"
    return Table(cells, caption, best.drop(columns=["rank", "tied"]))


def effect_table(results: Results, metric: str) -> Table:
    """The size of the effect of every field on a metric."""
    effects, of, rows = main_effects(results, metric), metric_of(metric), []
    for (field, policy), part in effects.groupby(["field", "policy"], sort=False):
        low, high = part.loc[part["mean"].idxmin()], part.loc[part["mean"].idxmax()]
        both = [f"{of.write(row['mean'])} at {row['value']}" for row in (low, high)]
        span = of.write(high["mean"] - low["mean"]).replace(" %", " points")
        rows.append((parameter(str(field)).name, policy, *both, span))
    heads = ["Field", "Policy", "Lowest mean", "Highest mean", "Difference"]
    caption = f"The effect of each field on {of.within}, averaged over the others"
    return Table(pd.DataFrame(rows, columns=heads), caption, effects.drop(columns="tied"))


def baseline_table(results: Results, point: int, metric: str) -> Table:
    """Every design point compared with a baseline point."""
    data, of = against(results, point, shown_metrics(metric)), metric_of(metric)
    rows = data[data["metric"] == metric]
    order = rows["difference"].abs().sort_values(ascending=False, kind="stable").index
    top = rows.loc[order[:MOST_ROWS]].sort_values("difference", ascending=False, kind="stable")
    cells = _named(results, top)
    cells["Difference"] = [of.change(*row) for row in top[["difference", "low", "high"]].to_numpy()]
    cells["p (Holm)"] = top["p_adjusted"].map(numbers.p_value)
    cells["Pairs"] = counts(top["n"])
    caption = (
        f"{of.name}: paired difference from the baseline{' in percentage points' * of.in_percent} "
        f"with {INTERVALS}; the {len(top):,} largest of {len(rows):,} differences"
    )
    return Table(cells, caption, data)


def shown_metrics(metric: str) -> list[str]:
    """The metrics on the page of a study: the one that ranks the settings, and the paper's."""
    return [*dict.fromkeys((metric, *METRICS))]


def _cells(results: Results, rows: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Rows of ``ranked`` as text."""
    cells = _named(results, rows)
    for of in map(metric_of, home.beside_success(results, shown_metrics(metric))):
        cells[of.name] = numbers.estimates(rows, of.column, of.written)
    return cells.assign(Missions=counts(rows["n"]))


def _named(results: Results, rows: pd.DataFrame) -> pd.DataFrame:
    """The policy, the number of the design point and its varied fields as text."""
    fields = {parameter(f).name: rows[f].map(parameter(f).cell) for f in varied(results)}
    return pd.DataFrame({"Policy": rows["policy"], "Point": rows["point"]} | fields)
