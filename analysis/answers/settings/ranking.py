"""The settings of a study, the best first, and the sentences and tables on them.

    results = load_results("results/fleets")
    rank_settings(results)  # the best setting first, and those that may be as good

Settings are compared on common replications: every setting meets the same random draws.
``metric`` is a column of ``results.missions``.
"""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.settings.home import way_home_sentence_of, with_way_home
from dess.analysis.answers.settings.nodes import hardly_served_clause
from dess.analysis.answers.settings.points import (
    ends_of_point,
    ends_sentence,
    intervals_in_words,
    metrics_of_page,
    named_cells,
    points_in_words,
    setting_in_words,
    values_of_points,
    varied_values,
)
from dess.analysis.metrics import (
    COST,
    PRODUCT,
    SUCCESS,
    Metric,
    check_ranking_metric,
    format_length,
    metric_in_missions,
    metric_of,
    metrics_in,
    ranking_column,
)
from dess.analysis.names import field_named
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.intervals import (
    by_replication,
    column_intervals,
    level_after,
    mean_interval,
)
from dess.analysis.stats.verdict import may_be_best, within_reach
from dess.analysis.tables import (
    MOST_PRINTED,
    MOST_ROWS,
    WIDER,
    Table,
    allowance_sentence,
    format_counts,
)

MOST_NAMES = 3  # the largest number of settings that are named because they may be as good


def ranking_metric(results: Results, metric: str | None = None) -> str:
    """The metric that ranks the settings: the given one, the one of the selection, or the product.

    Raises:
        InputError: If there is no such metric.
    """
    if metric is None:
        metric = getattr(results.study.selection, "metric", PRODUCT)
    return ranking_column(metric, results.missions)


def best_settings_sentence(results: Results, table: pd.DataFrame, metric: str) -> str:
    """The best setting, and how many settings may be as good.

    Args:
        results: The study.
        table: The result of ``rank_settings`` for the metric.
        metric: The metric.
    """
    sentences = best_settings_sentences(results, table, metric)
    if len(results.policies) == 2:
        return " ".join(sentences)
    return sentences[0]


def best_settings_sentences(results: Results, table: pd.DataFrame, metric: str) -> list[str]:
    """The best setting, then what each other policy would have found.

    Args:
        results: The study.
        table: The result of ``rank_settings`` for the metric.
        metric: The metric.
    """
    best = best_setting_sentence(results, table, metric)
    return [best, *other_policies_sentences(results, table, metric)]


def best_setting_sentence(results: Results, table: pd.DataFrame, metric: str) -> str:
    """The best setting, how many may be as good, and what else is to be said of it.

    Args:
        results: The study.
        table: The result of ``rank_settings`` for the metric.
        metric: The metric.
    """
    measure = metric_of(metric)
    best = table.iloc[0]
    others = len(table) - 1
    tied = table[table["tied"]]
    value = measure.written(*best[[metric, f"{metric}_low", f"{metric}_high"]])
    names = [setting_in_words(results, row.policy, row.point) for row in tied.itertuples()]
    if varied_values(results):
        what = "setting"
    else:
        what = "policy"
    many = len(names) - 1
    named = ""
    if many <= MOST_NAMES:
        named = f" ({'; '.join(names[1:])})"
    if not others:
        rest = ""
    elif others == 1 and many:
        rest = f"The other {what} may be as good."
    elif others == 1:
        rest = f"The other {what} is significantly worse."
    elif not many:
        rest = f"All {others:,} others are significantly worse."
    elif many == others:
        rest = f"All {others:,} others may be as good{named}."
    else:
        rest = (
            f"Of the {others:,} others, {many:,} may be as good{named}; the rest are "
            "significantly worse."
        )
    hardly = hardly_served_clause(results, best["policy"], [best["point"]])
    parts = [
        f"The best {what} is {names[0]}: {measure.within} {value}, n = {best['n']:,}{hardly}.",
        rest,
        ends_sentence(results, best["point"], ends_of_point(results, best["point"])).strip(),
        way_home_sentence_of(results, best, metric),
        unequal_lengths_sentence(results, [measure]),
    ]
    return " ".join(filter(None, parts))


def unequal_lengths_sentence(results: Results, metrics: Iterable[Metric]) -> str:
    """That missions of different lengths are compared by what depends on it; empty if not so.

    Ages grow while a mission lasts, and hours are paid for. A cost is only to be among the metrics
    where it depends on them.

    Args:
        results: The study.
        metrics: The metrics that are compared.
    """
    compared = [metric.within for metric in metrics if metric.grows]
    missions = results.missions
    has_quota = any(space.quota for space in results.store.manifest.scenarios)
    if not compared or not has_quota or missions["slots"].nunique() == 1:
        return ""
    means = missions.groupby(["policy", "point"])["slots"].mean()
    units = results.scenario().units
    lengths = [format_length(round(slots), units) for slots in (means.min(), means.max())]
    return (
        f"Missions end with their last UAV, after {' to '.join(dict.fromkeys(lengths))} on "
        f"average, so settings are compared by {numbers.join_words(compared)} over missions of "
        "different lengths; with quota = 0, all missions last until max_slots."
    )


def other_policies_sentences(results: Results, ranked: pd.DataFrame, metric: str) -> list[str]:
    """A sentence for each policy but the best: which setting it would have found, and its mean.

    Args:
        results: The study.
        ranked: The result of ``rank_settings`` for the metric.
        metric: The metric.
    """
    words = points_in_words(results)
    best = ranked.iloc[0]
    others = ranked[ranked["policy"] != best["policy"]].drop_duplicates("policy")
    ends = others[[metric, f"{metric}_low", f"{metric}_high"]].to_numpy()
    named = zip(others["policy"], others["point"], ends, strict=True)
    return [
        f"With the policy {policy}, it would be {words[point]}: {metric_of(metric).within} "
        f"{metric_of(metric).written(*of_metric)}."
        for policy, point, of_metric in named
        if len(words) > 1
    ]


@compute_once
def rank_settings(
    results: Results, metric: str = PRODUCT, policy: str | None = None
) -> pd.DataFrame:
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
    check_ranking_metric(metric, results.missions)
    missions = results.missions_of(policy)
    looks = {name: results.looks(name) for name in missions["policy"].unique()}
    cell = ["policy", "point"]
    table = missions.groupby(cell, sort=False).size().rename("n").reset_index()
    table = table.join(values_of_points(results), on="point")
    seen = np.array([looks[row.policy][row.point] for row in table.itertuples()])
    others = [name for name in metrics_in(missions) if name != metric]
    for name in (*others, metric):
        measure = metric_in_missions(missions, name)
        wide = by_replication(missions, name, cell)
        wide = wide.reindex(columns=pd.MultiIndex.from_frame(table[cell]))
        ends = column_intervals(wide, measure, level_after(seen))
        table[[name, f"{name}_low", f"{name}_high"]] = ends[["mean", "low", "high"]].to_numpy()
    # By the ranking metric, which was the last one.
    table["tied"] = may_be_best(wide.to_numpy(float), measure, seen)
    table["tied"] &= within_reach(table[f"{metric}_low"], table[f"{metric}_high"], measure)
    ascending = measure.less_is_better
    table = table.sort_values(metric, ascending=ascending, kind="stable", ignore_index=True)
    table.insert(0, "rank", np.arange(1, len(table) + 1))
    return table


def missions_at_best(results: Results, table: pd.DataFrame) -> pd.DataFrame:
    """The missions of every policy at its best design point.

    Args:
        results: The study.
        table: The result of ``rank_settings``.
    """
    best = table.drop_duplicates("policy")[["policy", "point"]]
    return results.missions.merge(best, on=["policy", "point"])


def allowance_for_setting(results: Results, rows: pd.DataFrame, metric: str) -> str:
    """Why a setting may be the best although its mean is lower; empty if intervals hardly allow it.

    Args:
        results: The study.
        rows: Its ``rank_settings``.
        metric: The metric that ranks them.
    """
    first = rows.iloc[0]
    measure = metric_of(metric)
    missions = results.missions_of(first["policy"])
    values = missions.loc[missions["point"] == first["point"], metric].to_numpy(float)
    plain = mean_interval(values[~np.isnan(values)])
    half = (plain.high - plain.low) / 2
    wide = (first[f"{metric}_high"] - first[f"{metric}_low"]) / 2
    if not measure.is_bounded or not wide > WIDER * half:
        return ""
    best = setting_in_words(results, first["policy"], first["point"])
    alone, allowing = (f"±{100 * end:.2g} points" for end in (half, wide))
    return allowance_sentence(f"the {measure.within} of {best}", alone, allowing, int(first["n"]))


def best_settings_table(results: Results, rows: pd.DataFrame, metric: str) -> Table:
    """The best settings.

    Args:
        results: The study.
        rows: Its ``rank_settings``.
        metric: The metric that ranks them.
    """
    top = rows.head(MOST_ROWS)
    cells = _ranking_cells(results, top, metric)
    cells.insert(0, "Rank", top["rank"])
    cells.insert(1, "May be the best", top["tied"].map(numbers.format_truth))
    caption = (
        f"The first {len(top)} of {len(rows):,} settings by {metric_of(metric).within}: "
        f"means with {intervals_in_words(results)}"
    )
    return Table(cells, caption, rows)


def ranked_table(results: Results, rows: pd.DataFrame, metric: str) -> Table:
    """The first settings of the ranking, in few columns, as the terminal prints them.

    Args:
        results: The study.
        rows: The result of ``rank_settings`` for the metric, with the costs if there are prices.
        metric: The metric.
    """
    top = rows.head(MOST_PRINTED)
    cells = pd.DataFrame({"rank": top["rank"].astype(str), "": np.where(top["tied"], "≈", "")})
    cells["policy"] = top["policy"]
    for field in varied_values(results):
        cells[field] = top[field].map(field_named(field).cell)
    for measure in map(metric_of, with_way_home(results, [metric, SUCCESS, PRODUCT])):
        if measure.column != COST:
            cells[measure.head] = numbers.format_estimates(top, measure.column, measure.written)
    if prices := results.study.costs:
        cells[COST] = [numbers.format_money(cost, prices.unit) for cost in top[COST]]
    settings = f"{len(rows):,} settings"
    if len(rows) > MOST_PRINTED:
        settings += f", the first {MOST_PRINTED} are shown"
    legend = f"≈: the {metric_of(metric).within} may be as good as that of the first"
    return Table(cells, f"{settings}; {legend}", rows)


def best_of_policies_table(results: Results, metric: str) -> Table:
    """The best setting of every policy, and how many of its settings may be as good."""
    rankings = [rank_settings(results, metric, policy) for policy in results.policies]
    best = pd.concat([rows.head(1) for rows in rankings], ignore_index=True)
    cells = _ranking_cells(results, best, metric)
    cells["May be its best"] = [
        f"{rows['tied'].sum():,} of {len(rows):,} settings" for rows in rankings
    ]
    caption = f"The best setting of every policy by {metric_of(metric).within}"
    return Table(cells, caption, best.drop(columns=["rank", "tied"]))


def _ranking_cells(results: Results, rows: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Rows of ``rank_settings`` as text."""
    cells = named_cells(results, rows)
    for measure in map(metric_of, with_way_home(results, metrics_of_page(metric))):
        cells[measure.name] = numbers.format_estimates(rows, measure.column, measure.written)
    return cells.assign(Missions=format_counts(rows["n"]))
