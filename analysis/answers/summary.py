"""The means of a study's policies, what the numbers say in words, and Sobol indices."""

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.settings.points import points_in_words
from dess.analysis.figures import Drawing, name_best_mean
from dess.analysis.metrics import (
    HOME,
    METRICS,
    PRODUCT,
    RATIO,
    SUCCESS,
    metric_group,
    metric_in_groups,
    metric_of,
    ranking_column,
    usual_metric,
)
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.analysis.stats.alternatives import ONLY, judge_alternatives
from dess.analysis.stats.differences import (
    P_VALUES,
    compare,
    difference_of_intervals,
    insert_adjusted,
)
from dess.analysis.stats.distribution import distribution
from dess.analysis.stats.groups import summary
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.kinds import level_after
from dess.analysis.stats.learners import compare_learners
from dess.analysis.stats.requirement import Requirement
from dess.analysis.stats.verdict import MARKS, Verdict, position_of
from dess.analysis.stats.weights import by_replication, values_within
from dess.analysis.study.cheapest import Cheapest
from dess.analysis.tables import (
    INTERVALS,
    MARKED,
    MOST_ROWS,
    WIDER,
    Table,
    allowance_sentence,
    comparison_cells,
    format_counts,
    stack_by_policy,
)
from dess.policies.shipped import HEURISTICS

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure

# How the numbers of the paper are drawn.
PRINTED: dict[str, Any] = {"linestyle": "--", "linewidth": 1.3}
_ENDS = ["mean", "low", "high"]
UNGUARDED = "random-unguarded"  # the policy that acts without the return guard


def means_of_points(results: Results) -> pd.DataFrame:
    """Means with intervals of every policy at every design point.

    Returns:
        A row per policy, design point and metric, as ``dess.analysis.summary`` returns it. After a
        search, the intervals allow for it (``stats.kinds.level_after``).
    """
    cell = ["policy", "point"]
    looks = {name: results.looks(name) for name in results.policies}
    if not any(of_policy.any() for of_policy in looks.values()):
        return summary(results.missions, by=cell)
    tables = [
        summary(missions, cell, float(level_after(looks[policy][point])))
        for (policy, point), missions in results.missions.groupby(cell, sort=False)
    ]
    return pd.concat(tables, ignore_index=True)


def settings_meeting(means: pd.DataFrame, targets: Mapping[str, float]) -> pd.DataFrame:
    """The rows of ``means_of_points`` of the settings that meet all targets.

    A setting is a policy at a design point. It meets a target if the whole interval of the mean
    does, so that chance alone seldom lets a setting pass that does not meet it.

    Args:
        means: Rows of ``means_of_points``.
        targets: Metric -> the least mean, or the largest of a metric of which less is better.
    """
    for metric, bound in targets.items():
        requirement = Requirement(metric_of(metric), bound)
        rows = means[means["metric"] == metric]
        verdicts = map(requirement.judge, rows["low"], rows["high"])
        passed = rows[[verdict == Verdict.MET for verdict in verdicts]]
        means = means.merge(passed[["policy", "point"]])
    return means


def add_verdicts(results: Results, means: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``means_of_points`` with a ``verdict``: how a policy compares with the others there.

    Compared are the policies of the table at the same design point, by each metric, on the
    replications that they have in common, by ``stats.alternatives.judge_alternatives``.

    Args:
        results: The study.
        means: Rows of ``means_of_points``.

    Returns:
        The rows, with the verdicts of ``judge_alternatives``.
    """
    verdicts = pd.Series(ONLY, means.index, dtype=object)
    for (metric, point), rows in means.groupby(["metric", "point"], sort=False):
        missions = results.missions[results.missions["point"] == point]
        measure = metric_in_groups(missions, str(metric), ["policy"], rows[["policy"]])
        if measure.is_neutral:
            continue
        wide = by_replication(missions, str(metric), "policy")
        values = wide[rows["policy"]].to_numpy(float)
        looks = np.array([results.looks(policy)[point] for policy in rows["policy"]])
        verdicts[rows.index] = judge_alternatives(values, rows["low"], rows["high"], measure, looks)
    return means.assign(verdict=verdicts)


def weights_in_words(results: Results) -> str:
    """How means weigh missions with different numbers of UAVs; empty if a study has one number."""
    ends = {space.uavs for space in results.store.manifest.scenarios}
    if all(low == high for low, high in ends):
        return ""
    policy = best_policy(results.missions)
    missions = results.missions[results.missions["policy"] == policy]
    weighted = summary(missions, by=[]).set_index("metric").loc[PRODUCT, "mean"]
    return (
        "Every number of UAVs that may be drawn has the same weight in a mean, however often the "
        f"missions drew it: the product of {policy} is {numbers.format_percent(weighted)}, and "
        f"would be {numbers.format_percent(missions[PRODUCT].mean())} "
        "as a plain mean of all missions."
    )


def means_by_fleet(missions: pd.DataFrame) -> pd.DataFrame:
    """Means with intervals of every policy by number of UAVs.

    Returns:
        Rows of ``dess.analysis.summary`` by ``policy`` (in order of appearance) and ``uavs``
        (sorted).
    """
    policies = missions.groupby("policy", sort=False)
    tables = [summary(part.sort_values("uavs"), by=["policy", "uavs"]) for _, part in policies]
    return pd.concat(tables, ignore_index=True)


def compare_with_paper(
    estimates: pd.DataFrame, printed: Mapping[Any, Mapping[str, Interval]]
) -> pd.DataFrame:
    """The metrics of every policy, with marks relative to the numbers that the paper prints.

    Args:
        estimates: Rows of ``dess.analysis.summary`` by ``policy``, and by ``uavs`` if needed.
        printed: The printed numbers by number of UAVs (None for all missions), then by metric;
            one whose number of missions is not known is its own interval.

    Returns:
        A row of the printed numbers and a row per policy, with a column of text per metric and
        number of UAVs, see ``format_with_mark``; of all missions, also the share with the battery
        for the way home, which the paper does not have.
    """
    policies = estimates["policy"].unique()
    of_home = estimates[estimates["metric"] == HOME]
    columns = {("", "Policy"): ["paper", *policies]}
    for metric in next(iter(printed.values())):
        of_metric = estimates[estimates["metric"] == metric]
        for uavs, figures in printed.items():
            if uavs is None:
                rows = of_metric
            else:
                rows = of_metric[of_metric["uavs"] == uavs]
            texts = [format_with_mark(row, figures[metric]) for row in rows.itertuples()]
            head = ""
            if uavs is not None:
                head = f"I = {uavs}"
            columns[METRICS[metric], head] = [format_printed(figures[metric]), *texts]
    if None in printed and len(of_home):
        texts = [numbers.format_estimate(row) for _, row in of_home.iterrows()]
        columns[metric_of(HOME).name, ""] = ["", *texts]
    return pd.DataFrame(columns)


def way_home_in_words(means: pd.DataFrame) -> str:
    """What the paper's success is, and how often the UAVs of a success could fly home.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
    """
    of_home = means[means["metric"] == HOME].itertuples()
    shares = [f"{numbers.format_percent(row.mean)} with `{row.policy}`" for row in of_home]
    return (
        "Success is the paper's: the mission of a UAV ends where its quota is filled. The share of "
        "missions in which every UAV ends with the battery for its way home is "
        f"{numbers.join_words(shares) or 'not known'}. With `landing = true`, missions end on the "
        "ground."
    )


def format_printed(printed: Interval) -> str:
    """A printed number, with its interval if it has one."""
    if printed.low < printed.high:
        return numbers.format_interval(*printed)
    return numbers.format_percent(printed.mean)


def format_with_mark(estimate: Any, printed: Interval) -> str:
    """An estimate and its difference from a printed number: ``97.3 % [96.1, 98.1] +7.4 ▲``.

    The mark tells whether the interval of this difference lies above 0 or below it.
    """
    own = Interval(estimate.mean, estimate.low, estimate.high)
    mark = MARKS[position_of(difference_of_intervals(own, printed))]
    difference = numbers.format_difference(estimate.mean, printed.mean)
    return f"{numbers.format_interval(*own)} {difference} {mark}"


def metrics_of_policy(means: pd.DataFrame, policy: str) -> pd.Series:
    """The means of a policy by metric, as text with their intervals.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
        policy: The policy.
    """
    rows = means[means["policy"] == policy].set_index("metric")
    return rows.loc[[*METRICS]].apply(numbers.format_estimate, axis=1)


def paper_sentence(means: pd.DataFrame, policy: str, printed: Mapping[str, float]) -> str:
    """The success and the product of a policy, beside the paper's product, in a sentence.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
        policy: The policy.
        printed: The paper's numbers by metric.
    """
    texts = metrics_of_policy(means, policy)
    n = means["n"].min()
    count = means["policy"].nunique()
    return (
        f"The best of {count} policies, {policy}, succeeds in {texts[SUCCESS]} of {n:,} missions "
        f"with a product of {texts[PRODUCT]}; the paper prints "
        f"{numbers.format_percent(printed[SUCCESS])} and "
        f"{numbers.format_percent(printed[PRODUCT])}."
    )


def guard_sentences(means: pd.DataFrame) -> str:
    """How often policies succeed under the return guard, and what success is without it.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
    """
    policies = {*means["policy"]}
    guarded_means = means[(means["metric"] == SUCCESS) & (means["policy"] != UNGUARDED)]["mean"]
    ends = dict.fromkeys(map(numbers.format_percent, (guarded_means.min(), guarded_means.max())))
    text = (
        f"All policies but `{UNGUARDED}` act under the return guard: they succeed in "
        f"{' to '.join(ends)} of the missions."
    )
    for policy, guarded in (("random", "under"), (UNGUARDED, "without")):
        if policy in policies:
            share = metrics_of_policy(means, policy)[SUCCESS]
            text += f" Random moves {guarded} the guard have a success of {share}."
    return text


def rank_policies(missions: pd.DataFrame, among: Iterable[str] | None = None) -> list[str]:
    """The policies by their mean product, or in years age, the best one first.

    Every design point has the same weight. Of policies with equal means, the one that appears first
    is ranked first.

    Args:
        missions: A row per mission.
        among: The policies to rank; by default all.
    """
    if among is None:
        among = missions["policy"].unique()
    else:
        among = [*among]
    cell = ["policy", "point"]
    metric = usual_metric(missions)
    values = missions[cell].assign(value=values_within(missions, metric, cell))
    at_points = values.groupby(cell, sort=False)["value"].mean()
    means = at_points.groupby("policy", sort=False).mean()
    ranked = means.sort_values(ascending=metric_of(metric).less_is_better, kind="stable").index
    return [str(policy) for policy in ranked if policy in among]


def best_policy(missions: pd.DataFrame, among: Iterable[str] | None = None) -> str:
    """The policy with the highest mean product, or in years with the youngest data."""
    return rank_policies(missions, among)[0]


def rank_learned_and_others(results: Results) -> tuple[list[str], list[str]]:
    """The learned policies of a study and its heuristics, the best of each first.

    Of a study without a heuristic that is part of dess, these are all other policies.
    """
    trained = trained_policies_by_learner(results).values()
    learned = {policy for trainings in trained for policy in trainings}
    ranked = rank_policies(results.missions)
    others = [policy for policy in ranked if policy not in learned]
    heuristics = [policy for policy in others if policy in HEURISTICS]
    return [policy for policy in ranked if policy in learned], heuristics or others


def leading_policies(
    results: Results, learned: str | None = None, heuristic: str | None = None
) -> list[str]:
    """The best learned policy of a study, if it has one, and its best heuristic.

    Args:
        results: The study.
        learned: The learned policy to take instead of the best one.
        heuristic: The heuristic to take instead of the best one.

    Raises:
        InputError: If the study lacks a policy that is named.
    """
    for name in (learned, heuristic):
        if name is not None:
            results.check_policy(name)
    all_learned, others = rank_learned_and_others(results)
    learned = learned or next(iter(all_learned), None)
    heuristic = heuristic or next(iter(others), None)
    return [policy for policy in (learned, heuristic) if policy]


def worst_missions(
    results: Results,
    policy: str,
    missions: int = 5,
    point: int | None = None,
    folder: str | Path | None = None,
) -> pd.DataFrame:
    """The missions of a policy with the lowest product.

    Args:
        results: The study.
        policy: The policy.
        missions: Number of missions.
        point: The design point; by default all.
        folder: The results folder that the commands name; ``results/NAME`` by default.

    Returns:
        A row per mission, the worst first (among equal ones, the one with the lower collection
        ratio): ``policy``, ``point``, ``replication``, the metrics, and ``command``, which
        simulates the mission again.
    """
    of_policy = results.missions[results.missions["policy"] == policy]
    if point is not None:
        of_policy = of_policy[of_policy["point"] == point]
    table = of_policy.sort_values([PRODUCT, RATIO], kind="stable", ignore_index=True)[:missions]
    table = table[["policy", "point", "replication", *metric_group("paper", "reward")]]
    keys = zip(table["point"], table["replication"], strict=True)
    folder = folder or results.usual_folder
    return table.assign(command=[results.command(policy, *key, folder) for key in keys])


def worst_missions_table(results: Results, rows: pd.DataFrame) -> Table:
    """The worst missions of a policy.

    Args:
        results: The study.
        rows: The result of ``worst_missions``.
    """
    cells = {
        "Replication": rows["replication"],
        "Success": rows["success"].map(numbers.format_truth),
        "Collection ratio": rows["collection_ratio"].map(numbers.format_percent),
        "Reward": rows["reward"].map(numbers.format_quantity),
    }
    policy = rows["policy"].iloc[0]
    points = rows["point"].unique()
    caption = f"The worst missions of {policy}"
    words = points_in_words(results)[points[0]]
    if len(points) == 1 and words:
        caption += f", {words}"
    return Table(pd.DataFrame(cells), caption, rows)


def count_tests(results: Results) -> int:
    """The number of comparisons that a study allows, by all of the paper's metrics.

    Compared are every two policies, and every learner of several trainings with every heuristic.
    """
    trained = trained_policies_by_learner(results)
    policies = len(results.policies)
    several = sum(len(trainings) > 1 for trainings in trained.values())
    heuristics = policies - sum(map(len, trained.values()))
    return len(METRICS) * (policies * (policies - 1) // 2 + several * heuristics)


def correct_for_all_tests(results: Results, table: pd.DataFrame) -> pd.DataFrame:
    """A table of comparisons, corrected for all comparisons that the study allows (Bonferroni).

    So it does not matter which of them were chosen by these data, and a comparison has the same
    p-value in every table of the study.

    Args:
        results: The study.
        table: The comparisons, with ``p``.
    """
    count = count_tests(results)
    for name in P_VALUES:
        table = insert_adjusted(table, (table[name] * count).clip(upper=1), name)
    return table


def has_policies_to_compare(results: Results) -> bool:
    """Whether a study has several policies, with the same missions in spite of a stopping rule."""
    return len(results.policies) > 1 and _same_missions(results)


def has_learned_to_compare(results: Results) -> bool:
    """Whether a study has learned policies and others, with the same missions."""
    trained = trained_policies_by_learner(results).values()
    learned = {policy for trainings in trained for policy in trainings}
    return bool(learned) and learned < {*results.policies} and _same_missions(results)


def compare_with_best(results: Results) -> pd.DataFrame:
    """Every policy compared with the best one on the same missions, over all design points.

    Returns:
        A row per policy and metric, as ``dess.analysis.compare`` returns it,
        ``correct_for_all_tests``. Empty unless the study ``has_policies_to_compare``.
    """
    if not has_policies_to_compare(results):
        return pd.DataFrame()
    best = best_policy(results.missions)
    return correct_for_all_tests(
        results, compare(results.missions, best, [*METRICS], correction=None)
    )


def comparison_table(results: Results) -> Table:
    """The ``compare_with_best``."""
    data = compare_with_best(results)
    caption = f"Differences from {data['baseline'].iloc[0]}"
    return _difference_table(results, data, "policy", caption)


def compare_learned_with_heuristic(results: Results) -> pd.DataFrame:
    """Every learner compared with the best policy that is not learned, on the same missions.

    Returns:
        A row per learner and metric, as ``dess.analysis.compare_learners`` returns it: about the
        learner if it has several trainings, otherwise about this one checkpoint,
        ``correct_for_all_tests``. Empty unless the study ``has_learned_to_compare``.
    """
    if not has_learned_to_compare(results):
        return pd.DataFrame()
    trained = trained_policies_by_learner(results)
    _, heuristics = rank_learned_and_others(results)
    table = compare_learners(results.missions, trained, heuristics[0], [*METRICS], correction=None)
    return correct_for_all_tests(results, table)


def learner_table(results: Results) -> Table:
    """What ``compare_learned_with_heuristic`` finds."""
    data = compare_learned_with_heuristic(results)
    caption = f"Learned policies: differences from {data['baseline'].iloc[0]}, the best heuristic"
    return _difference_table(results, data, "learner", caption)


def _difference_table(results: Results, rows: pd.DataFrame, of: str, caption: str) -> Table:
    caption = (
        f"{caption} [percentage points], with {INTERVALS}, each by itself; {MARKED}, by p. "
        f"{correction_in_words(results)}"
    )
    return Table(comparison_cells(rows, of), caption, rows)


def allowance_for_difference(rows: pd.DataFrame, of: str, metric: str = PRODUCT) -> str:
    """Why the intervals of differences are wider than the missions alone would make them.

    Args:
        rows: Rows of ``dess.analysis.compare``.
        of: The column that tells what is compared.
        metric: The metric of the example.

    Returns:
        Sentences with the example that becomes wider by most; empty if none becomes much wider.
    """
    rows = rows[(rows["metric"] == metric) & rows["student"].notna()]
    halves = (rows["high"] - rows["low"]) / 2
    widest = rows.assign(half=halves)[halves > WIDER * rows["student"]]
    if widest.empty:
        return ""
    row = widest.loc[(widest["half"] / widest["student"].clip(lower=1e-12)).idxmax()]
    unit = metric_of(metric)
    if unit.in_percent:
        scale, words = (100, " points")
    else:
        scale, words = (1, f" {unit.unit}".rstrip())
    plain, wide = (f"±{scale * row[half]:.2g}{words}" for half in ("student", "half"))
    what = f"the difference of {row[of]} in {unit.within}"
    return allowance_sentence(what, plain, wide, int(row["n"]))


def correction_in_words(results: Results) -> str:
    """For what p-values are corrected, and why a mark may differ from its interval."""
    return (
        f"P-values are corrected for the {count_tests(results):,} comparisons that the policies "
        "and metrics allow (Bonferroni). So ≈ may stand beside an interval without 0, which is "
        "not corrected."
    )


def _same_missions(results: Results) -> bool:
    counts = results.store.manifest.missions
    return len({n for of_team in counts for n in of_team}) == 1


def product_distributions(results: Results) -> pd.DataFrame:
    """The distribution of product over the missions of every policy.

    Returns:
        A row per policy and view, as ``dess.analysis.distribution`` returns it. Empty if there are
        several design points, whose missions have different distributions.
    """
    if len(results.store.manifest.points) > 1:
        return pd.DataFrame()
    generator = np.random.default_rng(results.store.manifest.seed)
    return distribution(results.missions, PRODUCT, generator)


def quantile_table(rows: pd.DataFrame, metric: str) -> Table:
    """Quantiles of a metric over the missions, and means of the worst ones.

    Args:
        rows: Rows of ``dess.analysis.distribution``.
        metric: The metric.
    """
    measure = metric_of(metric)
    heads = []
    for row in rows.itertuples():
        share = numbers.format_level(row.share)
        heads.append(
            f"{share} quantile" if row.view == "quantile" else f"Mean of the worst {share}"
        )
    long = rows.assign(head=heads).rename(columns={"value": "mean"})
    cells = numbers.estimates_as_text(long, "policy", "head", measure.written).reset_index(
        names="Policy"
    )
    return Table(cells, f"Quantiles of {measure.within} over missions, with {INTERVALS}", rows)


def reached_precisions(results: Results) -> pd.DataFrame:
    """How narrow the intervals are, for a study with targets.

    Returns:
        A row per policy, design point and metric: ``policy``, and the fields of
        ``dess.analysis.study.stopping.Reached``. Empty if the study has no targets.
    """
    manifest = results.store.manifest
    if (rule := manifest.study.precision) is None:
        return pd.DataFrame()
    tables = {
        policy: pd.DataFrame(rule.reached(results.store.samples(manifest.parts_of_team(team))))
        for team, policy in enumerate(results.policies)
    }
    return stack_by_policy(tables)


def precision_table(rows: pd.DataFrame, most: int | None = MOST_ROWS) -> Table:
    """The precision of each estimate beside its target.

    Args:
        rows: The ``reached_precisions``.
        most: The largest number of rows that it has; None: all.
    """
    top = rows[:most]
    cells = {
        "Policy": top["policy"],
        "Point": top["point"],
        "Metric": top["metric"].map(lambda metric: metric_of(metric).name),
        "Missions": format_counts(top["missions"]),
        "Mean": top["mean"].map(numbers.format_quantity),
        "Half-width": top["half_width"].map("{:.2g}".format),
        "Target": top["target"].map("{:.2g}".format),
        "Reached": top["met"].map({True: "yes", False: "no: the budget ended"}),
    }
    return Table(pd.DataFrame(cells), f"Half-widths of {INTERVALS}, and their targets", rows)


def selected_settings(results: Results) -> pd.DataFrame:
    """The design point that was selected for every policy, and its guarantee.

    Returns:
        A row per policy: ``policy``, ``point``, ``setting`` in words, number of ``missions``,
        ``left`` (number of points not ruled out), ``guaranteed``, ``guarantee`` in words, and the
        ``metric`` that it is selected by with its ``mean``, ``low`` and ``high`` over the missions
        of the selection. Empty if the study selects nothing. For a study that selects the cheapest
        setting, the rows of ``FleetSearch.selected_fleets``.
    """
    rule = results.study.selection
    if isinstance(rule, Cheapest):
        return search_of(results).selected_fleets()
    words = points_in_words(results)
    rows = []
    for policy in results.policies:
        if (c := results.choice(policy)) is not None:
            selected = (policy, c.best, words[c.best], c.missions, len(c.survivors))
            rows.append((*selected, c.guaranteed, c.guarantee))
    columns = ["policy", "point", "setting", "missions", "left", "guaranteed", "guarantee"]
    table = pd.DataFrame(rows, columns=columns)
    if rule is None:
        return table
    metric = ranking_column(rule.metric, results.missions)
    means = means_of_points(results)
    ends = means.loc[means["metric"] == metric, ["policy", "point", "metric", *_ENDS]]
    return table.merge(ends, on=["policy", "point"], how="left")


def selected_by_cells(selected: pd.DataFrame) -> list[str]:
    """What each setting was selected by, with its interval, as text.

    Args:
        selected: Rows of ``selected_settings``.
    """
    write = metric_of(selected["metric"].iloc[0]).written
    return [write(*ends) for ends in selected[_ENDS].to_numpy(float)]


def selection_table(results: Results) -> Table:
    """The setting that was selected for every policy."""
    data = selected_settings(results)
    cells = {
        "Policy": data["policy"],
        "Selected setting": data["setting"],
        "Missions of the selection": format_counts(data["missions"]),
        "Settings not ruled out": data["left"],
    }
    measure = metric_of(data["metric"].iloc[0])
    cells[measure.label] = selected_by_cells(data)
    caption = f"The setting that was selected for every policy by {measure.within}"
    return Table(pd.DataFrame(cells), caption, data)


def means_of_check(results: Results) -> pd.DataFrame:
    """Means with intervals of the selected points, over missions not used for the selection."""
    return summary(results.checks, by=["policy", "point"])


def plot_performance(
    summary: pd.DataFrame, metric: str, printed: Interval | None = None
) -> "Figure":
    """A metric of every policy: means with intervals, and the paper's number as a line and a band.

    Args:
        summary: Rows of ``dess.analysis.summary`` by ``policy``.
        metric: The metric.
        printed: The paper's number with its interval.
    """
    from dess.analysis.figures import style

    rows = summary[summary["metric"] == metric]
    measure = metric_of(metric)
    with style.new_panels(1.3 + 0.42 * len(rows), values="x") as (figure, ax):
        style.plot_in_rows(rows, ax)
        for y, mean in enumerate(rows["mean"]):
            style.note_at_right(measure.write(mean), y, ax)
        if printed is not None:
            ax.axvspan(printed.low, printed.high, **style.band(style.MUTED))
            ax.axvline(
                printed.mean,
                color=style.INK,
                **PRINTED,
                label=f"paper {measure.write(printed.mean)}",
                zorder=1,
            )
        ax.set(xlabel=measure.label, xlim=(-0.02, 1.02) if measure.is_bounded else None)
        style.set_axis_unit(ax.xaxis, measure.axis, 5)
    return figure


def plot_by_fleet(
    summary: pd.DataFrame, metric: str, printed: Mapping[int, float] | None = None
) -> "Figure":
    """A metric of every policy against the number of UAVs, with intervals.

    Args:
        summary: Rows of ``dess.analysis.summary`` by ``policy`` and ``uavs``.
        metric: One of ``METRICS``.
        printed: The paper's numbers by number of UAVs.
    """
    from dess.analysis.figures import style

    rows = style.place_values(summary[summary["metric"] == metric], "uavs")
    with style.new_panels(3.9, values="y", legend=5) as (figure, ax):
        style.plot_along(rows, style.policy_colours(rows["policy"]), "%", ax)
        if printed:
            ax.plot(
                *zip(*sorted(printed.items()), strict=True),
                "D",
                label="paper",
                color=style.INK,
                **PRINTED,
            )
        ax.set(ylabel=METRICS[metric], xlabel="number of UAVs", ylim=(-0.03, 1.04))
    return figure


def draw_performance(results: Results, metric: str) -> Drawing:
    """A metric of every policy at the only design point."""
    table = means_of_points(results)
    data = table[table["metric"] == metric]
    caption = name_best_mean(data, metric, ["policy"])
    name = results.study.replication_name
    caption += f"n = {numbers.format_span(data['n'])} {name}s per policy; bars are {INTERVALS}."
    alt = f"{metric_of(metric).name} of every policy"
    return Drawing(plot_performance(table, metric), alt, caption, data)
