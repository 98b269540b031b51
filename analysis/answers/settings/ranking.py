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
    points_left,
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
    metric_in_groups,
    metric_in_missions,
    metric_of,
    metrics_in,
    ranking_column,
)
from dess.analysis.names import field_named
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.stats.alternatives import judge_alternatives, may_lead
from dess.analysis.stats.intervals import column_intervals, mean_interval
from dess.analysis.stats.kinds import level_after
from dess.analysis.stats.verdict import (
    MARKS,
    NOT_RULED_OUT,
    SEEN_BELOW,
    SEEN_WORSE,
    WORSE,
)
from dess.analysis.stats.weights import by_replication
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
    value = measure.written(*best[[metric, f"{metric}_low", f"{metric}_high"]])
    name = setting_in_words(results, best["policy"], best["point"])
    what = "policy"
    if varied_values(results):
        what = "setting"
    hardly = hardly_served_clause(results, best["policy"], [best["point"]])
    parts = [
        f"The best {what} is {name}: {measure.within} {value}, n = {best['n']:,}{hardly}.",
        _others_in_words(results, table.iloc[1:], what),
        ends_sentence(results, best["point"], ends_of_point(results, best["point"])).strip(),
        way_home_sentence_of(results, best, metric),
        unequal_lengths_sentence(results, [measure]),
    ]
    return " ".join(filter(None, parts))


def _others_in_words(results: Results, others: pd.DataFrame, what: str) -> str:
    """How all settings but the best compare with it, in a sentence; empty if there are none.

    Args:
        results: The study.
        others: The rows of ``rank_settings`` but the first.
        what: What each is called: a setting, or a policy.
    """
    tied = others[others["tied"]]
    worse = "significantly worse"
    if any(results.choice(policy) for policy in results.policies):
        worse = "ruled out by the selection"
        if len(results.policies) > 1:
            worse += " or significantly worse"
    as_good = "may be as good"
    if 0 < len(tied) <= MOST_NAMES and len(others) > 1:
        names = [setting_in_words(results, row.policy, row.point) for row in tied.itertuples()]
        as_good += f" ({'; '.join(names)})"
    seen = int((others["standing"] == SEEN_WORSE).sum())
    verb = "are"
    if len(others) == 1:
        verb = "is"
    verb_of_seen = "are"
    if seen == 1:
        verb_of_seen = "is"
    counts = {
        as_good: len(tied),
        f"{verb_of_seen} worse in what was seen, where {NOT_RULED_OUT}": seen,
        f"{verb} {worse}": int((others["standing"] == WORSE).sum()),
    }
    non_empty = {words: count for words, count in counts.items() if count}
    if not non_empty:
        return ""
    if len(others) == 1:
        return f"The other {what} {next(iter(non_empty))}."
    if len(non_empty) == 1:
        return f"All {len(others):,} others {next(iter(non_empty))}."
    *first, last = [f"{count:,} {words}" for words, count in non_empty.items()]
    if counts[f"{verb} {worse}"]:
        last = f"the rest are {worse}"
    return f"Of the {len(others):,} others, {'; '.join([*first, last])}."


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
        ``dess.analysis.summary``, which allow for a search), ``n`` missions, ``standing``: how the
        setting compares with the others (``stats.alternatives.judge_alternatives``), and ``tied``:
        whether it may be the best by what was seen. Where a study selects, its selected settings
        come first, and those that it has ruled out are worse. Settings of different numbers of
        missions are ranked by their differences from the first on common replications. Of equal
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
        of_cells = metric_in_groups(missions, name, cell, table)
        ends = column_intervals(wide, of_cells, level_after(seen))
        table[[name, f"{name}_low", f"{name}_high"]] = ends[["mean", "low", "high"]].to_numpy()
    # By the ranking metric, which was the last one.
    values = wide.to_numpy(float)
    left = np.array([points_left(results, row.policy)[row.point] for row in table.itertuples()])
    ends = table[f"{metric}_low"], table[f"{metric}_high"]
    table["standing"] = judge_alternatives(values, *ends, measure, seen, left)
    table["tied"] = may_lead(table["standing"].to_numpy())
    table = table.iloc[_order_settings(results, table, values, measure)].reset_index(drop=True)
    table.insert(0, "rank", np.arange(1, len(table) + 1))
    return table


def _order_settings(
    results: Results, table: pd.DataFrame, values: np.ndarray, metric: Metric
) -> np.ndarray:
    """The positions of settings, the best first, see ``rank_settings``.

    Args:
        results: The study.
        table: The settings, with ``policy``, ``point``, ``n`` and ``tied``.
        values: (R, K) their values, nan where a setting lacks a replication.
        metric: The metric.
    """
    sign = -1.0
    if metric.less_is_better:
        sign = 1.0
    leads = sign * table[metric.column].to_numpy(float)
    chosen = {policy: results.choice(policy) for policy in results.policies}
    is_selected = np.array(
        [
            (choice := chosen[row.policy]) is not None and choice.best == row.point
            for row in table.itertuples()
        ]
    )
    if table["n"].nunique() > 1:
        # Means over other replications do not compare: the longest of the leading ones is the
        # reference, and the others are as far from it as where both were simulated.
        candidates = is_selected if is_selected.any() else table["tied"].to_numpy()
        longest = candidates & (table["n"] == table["n"][candidates].max()).to_numpy()
        reference = np.flatnonzero(longest)[np.argmin(leads[longest])]
        common = sign * (values - values[:, [reference]])
        shared = np.isfinite(common).any(axis=0)
        leads = leads - leads[reference]
        leads[shared] = np.nanmean(common[:, shared], axis=0)
    return np.lexsort((leads, ~is_selected))


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
    may_be = top["tied"].map(numbers.format_truth)
    may_be = np.where(top["standing"] == SEEN_WORSE, "not in what was seen", may_be)
    cells.insert(1, "May be the best", may_be)
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
    marks = np.select([top["tied"], top["standing"] == SEEN_WORSE], ["≈", MARKS[SEEN_BELOW]], "")
    cells = pd.DataFrame({"rank": top["rank"].astype(str), "": marks})
    cells["policy"] = top["policy"]
    for field in varied_values(results):
        cells[field] = top[field].map(field_named(field).cell)
    for measure in map(metric_of, with_way_home(results, [metric, SUCCESS, PRODUCT])):
        if measure.column != COST:
            cells[measure.head] = numbers.format_estimates(top, measure.column, measure.written)
    if prices := results.study.costs:
        costs = numbers.format_estimates(top, COST, metric_of(COST).written)
        cells[COST] = [f"{cost} {prices.unit}" for cost in costs]
    settings = f"{len(rows):,} settings"
    if len(rows) > MOST_PRINTED:
        settings += f", the first {MOST_PRINTED} are shown"
    legend = f"≈: the {metric_of(metric).within} may be as good as that of the first"
    if (top["standing"] == SEEN_WORSE).any():
        legend += f"; {MARKS[SEEN_BELOW]}: it is worse in what was seen, where {NOT_RULED_OUT}"
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
    return Table(cells, caption, best.drop(columns=["rank", "standing", "tied"]))


def _ranking_cells(results: Results, rows: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Rows of ``rank_settings`` as text."""
    cells = named_cells(results, rows)
    for measure in map(metric_of, with_way_home(results, metrics_of_page(metric))):
        cells[measure.name] = numbers.format_estimates(rows, measure.column, measure.written)
    return cells.assign(Missions=format_counts(rows["n"]))
