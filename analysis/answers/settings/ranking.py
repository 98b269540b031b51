"""The settings of a study, the best first, and the facts and tables on them.

    results = load_results("results/fleets")
    rank_settings(results)  # the best setting first, and those that may be as good

Settings are compared on common replications: every setting meets the same random draws.
``metric`` is a column of ``results.missions``.
"""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.settings.home import may_end_in_the_air, with_way_home
from dess.analysis.answers.settings.nodes import hardly_served_nodes
from dess.analysis.answers.settings.points import (
    ends_in_words,
    ends_of_point,
    intervals_in_words,
    metrics_of_page,
    named_cells,
    points_in_words,
    points_left,
    setting_in_words,
    values_of_points,
    varied_values,
)
from dess.analysis.answers.settings.years import age_sentence, year_facts
from dess.analysis.facts import Fact, known_facts
from dess.analysis.measured import check_ranking_metric, metrics_in, ranking_column, usual_metric
from dess.analysis.metric_ranges import metric_in_groups
from dess.analysis.metrics import COST, HOME, PRODUCT, SUCCESS, Metric, format_length, metric_of
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
    MOST_ROWS,
    WIDER,
    Table,
    allowance_sentence,
    format_counts,
)

MOST_NAMES = 3  # the largest number of settings that are named because they may be as good


def ranking_metric(results: Results, metric: str | None = None) -> str:
    """The metric that ranks the settings: the given one, that of the selection, or the usual one.

    Raises:
        InputError: If there is no such metric.
    """
    if metric is None:
        metric = getattr(results.study.selection, "metric", usual_metric(results.missions))
    return ranking_column(metric, results.missions)


def best_setting_headline(results: Results, table: pd.DataFrame, metric: str) -> str:
    """The best setting and the mean of its metric, or that of the best policy.

    Args:
        results: The study.
        table: The result of ``rank_settings`` for the metric.
        metric: The metric.
    """
    best = table.iloc[0]
    measure = metric_of(metric)
    name = setting_in_words(results, best["policy"], best["point"])
    found = f"The best is {name}: {measure.within} {measure.write(best[metric])}."
    if not results.study.years:
        return found
    return f"{found} {age_sentence(results, best['policy'], [best['point']])}"


def best_setting_facts(results: Results, table: pd.DataFrame, metric: str) -> list[Fact]:
    """The best setting, how the others compare, and what each other policy would have found.

    Args:
        results: The study.
        table: The result of ``rank_settings`` for the metric.
        metric: The metric.
    """
    measure = metric_of(metric)
    best = table.iloc[0]
    policy = best["policy"]
    point = best["point"]
    columns = [measure]
    if metric in (SUCCESS, PRODUCT) and may_end_in_the_air(results):
        columns.append(metric_of(HOME))
    facts = [Fact(each.within, _estimate(best, each)) for each in columns]
    name = results.study.replication_name
    facts.append(Fact("measured in", numbers.format_count(best["n"], name)))
    if results.study.years:
        facts += year_facts(results, policy, [point])
    facts.append(Fact("hardly served", hardly_served_nodes(results, policy, [point])))
    facts += _comparison_facts(results, table.iloc[1:])
    ends = ends_in_words(results, point, ends_of_point(results, point))
    facts.append(Fact("a better one may lie beyond", ends))
    if varied_values(results):
        words = points_in_words(results)
        others = table[table["policy"] != policy].drop_duplicates("policy")
        for _, other in others.iterrows():
            other_setting = f"{words[other['point']]}; {measure.within} {_estimate(other, measure)}"
            facts.append(Fact(f"with {other['policy']}", other_setting))
    facts.append(unequal_lengths(results, [measure]))
    return known_facts(facts)


def _estimate(row: pd.Series, metric: Metric) -> str:
    """The mean of a metric in a row of ``rank_settings`` with its interval, as text."""
    return metric.written(*row[[metric.column, f"{metric.column}_low", f"{metric.column}_high"]])


def _comparison_facts(results: Results, others: pd.DataFrame) -> list[Fact]:
    """How many of the other settings may be as good as the best one, and which if few may.

    Args:
        results: The study.
        others: The rows of ``rank_settings`` but the first.
    """
    tied = others[others["tied"]]
    worse = "significantly worse"
    if any(results.choice(policy) for policy in results.policies):
        worse = "ruled out or significantly worse"
    names = ""
    if len(tied) <= MOST_NAMES:
        names = "; ".join(setting_in_words(results, r.policy, r.point) for r in tied.itertuples())
    counts = {
        "may be as good": len(tied),
        f"worse in what was seen, where {NOT_RULED_OUT}": (others["standing"] == SEEN_WORSE).sum(),
        worse: (others["standing"] == WORSE).sum(),
    }
    facts = {label: f"{count:,} of {len(others):,} others" for label, count in counts.items()}
    if names:
        facts["may be as good"] += f": {names}"
    return [Fact(label, text) for label, text in facts.items() if counts[label]]


def unequal_lengths(results: Results, metrics: Iterable[Metric]) -> Fact:
    """That missions of different lengths are compared by what depends on it; empty if not so.

    Args:
        results: The study.
        metrics: The metrics by which settings are compared.
    """
    compared = [metric.within for metric in metrics if metric.grows]
    label = f"length of missions, compared by {numbers.join_words(compared)}"
    missions = results.missions
    has_quota = any(space.quota for space in results.store.manifest.scenarios)
    if not compared or not has_quota or missions["slots"].nunique() == 1:
        return Fact(label, "")
    means = missions.groupby(["policy", "point"])["slots"].mean()
    units = results.scenario().units
    lengths = [format_length(round(slots), units) for slots in (means.min(), means.max())]
    return Fact(label, f"{' to '.join(dict.fromkeys(lengths))} on average")


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
    analyses = {name: results.analyses(name) for name in missions["policy"].unique()}
    cell = ["policy", "point"]
    table = missions.groupby(cell, sort=False).size().rename("n").reset_index()
    table = table.join(values_of_points(results), on="point")
    seen = np.array([analyses[row.policy][row.point] for row in table.itertuples()])
    others = [name for name in metrics_in(missions) if name != metric]
    for name in (*others, metric):
        wide = by_replication(missions, name, cell)
        wide = wide.reindex(columns=pd.MultiIndex.from_frame(table[cell]))
        of_cells = metric_in_groups(missions, name, cell, table)
        ends = column_intervals(wide, of_cells, level_after(seen))
        table[[name, f"{name}_low", f"{name}_high"]] = ends[["mean", "low", "high"]].to_numpy()
    # By the ranking metric, which was the last one.
    values = wide.to_numpy(float)
    left = np.array([points_left(results, row.policy)[row.point] for row in table.itertuples()])
    ends = table[f"{metric}_low"], table[f"{metric}_high"]
    table["standing"] = judge_alternatives(values, *ends, of_cells, seen, left)
    table["tied"] = may_lead(table["standing"].to_numpy())
    table = table.iloc[_order_settings(results, table, values, of_cells)].reset_index(drop=True)
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


def ranked_table(results: Results, rows: pd.DataFrame, metric: str) -> Table:
    """The first settings of the ranking.

    Args:
        results: The study.
        rows: The result of ``rank_settings`` for the metric, with the costs if there are prices.
        metric: The metric.
    """
    top = rows.head(MOST_ROWS)
    cells = _ranking_cells(results, top, metric)
    cells.insert(0, "Rank", top["rank"].astype(str))
    marks = np.select([top["tied"], top["standing"] == SEEN_WORSE], ["≈", MARKS[SEEN_BELOW]], "")
    cells.insert(1, "", marks)
    if COST in rows:
        costs = numbers.format_estimates(top, COST, metric_of(COST).written)
        cells[metric_of(COST).name] = [f"{cost} {results.prices.unit}" for cost in costs]
    caption = (
        f"The first {len(top)} of {len(rows):,} settings by {metric_of(metric).within}: means with "
        f"{intervals_in_words(results)}; ≈: may be the best"
    )
    if (top["standing"] == SEEN_WORSE).any():
        caption += f"; {MARKS[SEEN_BELOW]}: worse in what was seen, where {NOT_RULED_OUT}"
    return Table(cells, caption, rows)


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
    for measure in map(metric_of, with_way_home(results, metrics_of_page(results, metric))):
        cells[measure.name] = numbers.format_estimates(rows, measure.column, measure.written)
    return cells.assign(**{results.replications_head: format_counts(rows["n"])})
