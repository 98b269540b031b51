"""Tables of the results of a study in the terminal."""

import textwrap
from collections.abc import Iterable, Mapping
from dataclasses import astuple
from itertools import zip_longest
from pathlib import Path

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers import decided, diff, distributions, optimality, summary
from dess.analysis.answers.fleet.costs import setting_cells
from dess.analysis.answers.policies import comparisons
from dess.analysis.answers.settings.points import points_in_words, setting_in_words
from dess.analysis.answers.settings.ranking import ranking_metric
from dess.analysis.answers.settings.sobol import index_table
from dess.analysis.ask.answer import settings_answer
from dess.analysis.facts import Fact
from dess.analysis.measured import measured_in, usual_metric
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS, Metric, metric_group, metric_of
from dess.analysis.names import field_named
from dess.analysis.paper import values
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import MARKS, NOT_RULED_OUT, SEEN_BELOW, SEEN_WORSE, WORSE
from dess.analysis.tables import Table, comparison_cells, format_counts
from dess.analysis.tables import means_table as means_table
from dess.reports.cli import console
from dess.scenario.fields import fields_of
from dess.scenario.scenario import ScenarioSpace

# Heads as the options of commands have them: metrics, and fields of the scenario.
_SHORT = {name: metric_of(metric).head for metric, name in METRICS.items()}
_SHORT |= {field_named(field).name: field for field in fields_of(ScenarioSpace)}
_QUANTILES = (0.05, 0.5, 0.95)
_FACT_HEADS = ("", "Found", "Required", "Guaranteed")
_LABEL_WIDTH = 28  # of the facts of an answer [characters]
MANY_POINTS = 40  # more design points are not listed


def print_summary(results: Results, folder: Path, short: bool) -> None:
    """Print the means at the only design point, or the selected points and their check."""
    study = results.study
    missions = numbers.format_count(len(results.missions), study.replication_name)
    console.print_text(f"{folder}: {missions} of study {study.name}")
    if results.store.manifest.processes:
        console.print_text(f" with {results.store.manifest.functions}, in the SimPy engine")
    for change in results.store.manifest.accepted:
        console.print_text(f" accepted: {change.text}")
    printed = values.PRINTED.get(study.name, {})
    if study.selection:
        selected = decided.selected_settings(results)
        _print_selections(selected, study.replication_name)
        is_search = "condition" in selected
        if is_search and study.costs:
            answer = settings_answer(results)
            console.print_text(f" {answer.headline()}")
            print_facts(answer.facts())
        if len(results.checks):
            means = summary.means_of_check(results)
            checks = study.selection.check
            if is_search:
                pairs = means[["policy", "point"]].itertuples(index=False)
                means = means.assign(policy=[setting_in_words(results, *pair) for pair in pairs])
            selected_by = [*selected["metric"].unique()] if "metric" in selected else []
            _print_means(means, f"{checks} further missions", printed, selected_by)
    elif len(results.store.manifest.points) == 1:
        _print_means(summary.means_of_points(results), "mean, 95 % interval", printed)
    elif short:
        of_points = pd.DataFrame()
        if len(results.store.manifest.points) <= MANY_POINTS:
            of_points = summary.means_of_points(results)
        _print_by_point(results, of_points, [ranking_metric(results)])


def print_begun(results: Results, means: pd.DataFrame, folder: Path) -> None:
    """Print the means of a study that is not complete, with the missions of each."""
    name = results.study.replication_name
    missions = numbers.format_count(len(results.missions), name)
    console.print_text(f"{folder}: {missions} of study {results.study.name}, which is incomplete")
    if results.study.selection:
        console.print_text(" intervals do not allow for the search, which has not ended")
    points = points_in_words(results)
    shown = means[means["metric"].isin([SUCCESS, RATIO, PRODUCT])]
    rows = []
    for (policy, point), of_setting in shown.groupby(["policy", "point"], sort=False):
        estimates = [
            metric_of(row.metric).written(row.mean, row.low, row.high)
            for row in of_setting.itertuples()
        ]
        rows.append([policy, points[int(point)], f"{of_setting['n'].max():,}", *estimates])
    heads = [metric_of(metric).head for metric in (SUCCESS, RATIO, PRODUCT)]
    console.print_table(["policy", "setting", f"{name}s", *heads], rows[:MANY_POINTS])
    if (more := len(rows) - MANY_POINTS) > 0:
        console.print_text(f" {more:,} more rows; --csv and --json have them")


def print_details(
    results: Results, frames: Mapping[str, pd.DataFrame], everything: bool = False
) -> None:
    """Print the tables of ``dess study show``, by their names in its JSON; none that is empty.

    Args:
        results: The study.
        frames: The tables.
        everything: Whether the means of all metrics are printed, not of the product and of what
            the study selects by.
    """
    measured = measured_in({*frames["means"]["metric"]})
    metrics = [*dict.fromkeys([ranking_metric(results), usual_metric(results.missions)])]
    if everything:
        metrics = [*dict.fromkeys([*metrics, *METRICS, *measured])]
    printers = {
        "sensitivities": lambda table: _print_titled(
            "shares of the collection ratio's variance:",
            index_table(table[table["metric"] == RATIO]).cells.drop(columns="Metric"),
        ),
        "costs": lambda table: _print_costs(table, results.manifest["study"]["costs"]["currency"]),
        "means": lambda means: _print_by_point(results, means, metrics),
        "distributions": _print_distributions,
        "precisions": lambda table: _print_precisions(results, table),
        "comparisons": lambda table: _print_comparisons(results, table),
        "gaps": lambda table: print_frame(
            "optimality gap", optimality.fleet_bound_table(table).set_index("Policy")
        ),
        "learned_against_heuristic": _print_learners,
        "worst": _print_worst,
    }
    if results.study.years:  # these are of single missions, or of the paper's metrics
        printers = {name: printers[name] for name in ("costs", "means")}
    for name, print_rows in printers.items():
        if not frames[name].empty:
            print_rows(frames[name])


def print_frame(title: str, cells: pd.DataFrame) -> None:
    """Print a table of text under its title; the index is its first column."""
    rows = [[str(name), *map(str, row)] for name, *row in cells.itertuples(name=None)]
    console.print_table([title, *(_SHORT.get(head, head) for head in map(str, cells))], rows)


def print_cells(cells: pd.DataFrame) -> None:
    """Print a table of text."""
    first = cells.columns[0]
    print_frame(str(first), cells.set_index(first))


def print_facts(facts: Iterable[Fact]) -> None:
    """Print the facts of an answer as a table; long ones take several lines."""
    lines = [astuple(fact) for fact in facts]
    columns = [
        [head, *column]
        for head, column in zip(_FACT_HEADS, zip(*lines, strict=True), strict=True)
        if any(column)
    ]
    widths = [max(map(len, column)) for column in columns]
    widths[0] = min(widths[0], _LABEL_WIDTH)
    widths[1] = console.WIDTH - sum(width + 2 for width in widths[2:]) - widths[0] - 2
    heads, *rows = zip(*columns, strict=True)
    wrapped: list[tuple[str, ...]] = []
    for row in rows:
        cells = [textwrap.wrap(cell, width) for cell, width in zip(row, widths, strict=True)]
        wrapped += zip_longest(*cells, fillvalue="")
    console.print_table(heads, wrapped, left=len(heads))


def print_table_with_caption(table: Table) -> None:
    """Print a table, and its caption below."""
    print_cells(table.cells)
    console.print_text(f" {table.caption}")


def _print_titled(title: str, cells: pd.DataFrame) -> None:
    """Print a table of text below its title."""
    console.print_text(title)
    print_cells(cells)


def _print_selections(selected: pd.DataFrame, replication: str) -> None:
    """The selected point of every policy, of how many missions or years, and the guarantee."""
    columns = ["setting", "missions", "left"]
    if "condition" in selected and any(selected["condition"]):
        columns = ["condition", *columns]
    cells = selected.set_index("policy")[columns]
    cells["missions"] = format_counts(cells["missions"])
    cells = cells.rename(columns={"missions": f"{replication}s"})
    if "metric" in selected:
        measure = metric_of(selected["metric"].iloc[0])
        cells[measure.head] = decided.selected_by_cells(selected)
    print_frame("selected for", cells)
    for guarantee in dict.fromkeys(selected["guarantee"]):
        console.print_text(f" {guarantee}")


def _print_costs(table: pd.DataFrame, currency: str) -> None:
    """The settings, the cheapest first, with success, and the probability to be on the front."""
    if len(table) > MANY_POINTS:
        console.print_text(
            f"the costs of {len(table)} settings are too many to list; --json has them"
        )
        return
    cells = setting_cells(table, [SUCCESS])
    cells["On the front"] = table["probability"].map(numbers.format_percent)
    _print_titled(f"cost [{currency}] against success:", cells)


def _print_precisions(results: Results, table: pd.DataFrame) -> None:
    """The precision of each estimate beside its target, with the design points in words."""
    cells = decided.precision_table(table, most=None).cells
    points = points_in_words(results)
    cells["Point"] = cells["Point"].map(points.__getitem__)
    _print_titled("precision:", cells)


def _print_means(
    means: pd.DataFrame, title: str, printed: Mapping[str, float], also: Iterable[str] = ()
) -> None:
    """A row per policy, and one with the values that the paper prints; a column per metric.

    Args:
        means: Rows of ``dess.analysis.summary``.
        title: What they are means of.
        printed: The values of the paper; may be empty.
        also: Metrics that are printed beside the paper's and what extended scenarios measure.
    """
    cells = means_table(means).cells.drop(columns="Missions").set_index("Policy")
    if printed:
        cells.loc["paper"] = [numbers.format_percent(printed[metric]) for metric in METRICS]
    print_frame(title, cells)
    others = {*metric_group("operations", in_units=True), *also}.difference(METRICS)
    measured = means[means["metric"].isin(others)]
    if not measured.empty:
        cells = numbers.estimates_as_text(
            measured, "metric", "policy", numbers.format_quantities
        ).fillna("")
        print_frame(title, cells.rename(index=lambda metric: metric_of(metric).label))


def _print_by_point(results: Results, means: pd.DataFrame, metrics: list[str]) -> None:
    """A table per metric, a row per design point, if there are several and not too many."""
    points = points_in_words(results)
    if len(points) == 1:
        return
    if len(points) > MANY_POINTS:
        console.print_text(f"{len(points)} design points are too many to list; --json has them")
        return
    for metric in metrics:
        rows = means[means["metric"] == metric]
        cells = numbers.estimates_as_text(
            rows, "point", "policy", metric_of(metric).written
        ).fillna("")
        if metric == PRODUCT and "verdict" in rows and len(cells.columns) > 1:
            cells["best"] = _best_policies(rows)
        print_frame(metric_of(metric).head, cells.rename(index=dict(enumerate(points))))
        if "best" in cells:
            console.print_text(
                " best: significantly better than the others on common replications (95 %, at "
                "each design point by itself); ≈: these may all be the best; "
                f"{MARKS[SEEN_BELOW]}: worse in what was seen, where {NOT_RULED_OUT}"
            )


def _best_policies(rows: pd.DataFrame) -> pd.Series:
    """The policy that is the best at each design point, or those that may be, the first first."""
    may_be = rows[rows["verdict"] != WORSE].sort_values("mean", ascending=False)
    is_behind = may_be["verdict"] == SEEN_WORSE
    leading = may_be[~is_behind].groupby("point")["policy"].agg(" ≈ ".join)
    behind = may_be[is_behind].groupby("point")["policy"].agg(f" {MARKS[SEEN_BELOW]} ".join)
    return leading.str.cat(f" {MARKS[SEEN_BELOW]} " + behind, join="left", na_rep="")


def _target_in_words(metric: Metric, end: float) -> str:
    """A target, as ``success of 0.99 or more``."""
    bound = f"{metric.within} of {end:g}"
    if metric.is_in_sheet_unit:
        bound += f" {metric.unit}"
    if metric.less_is_better:
        return f"{bound} or less"
    return f"{bound} or more"


def print_meeting(results: Results, means: pd.DataFrame, targets: Mapping[str, float]) -> None:
    """Print the settings that meet targets.

    Args:
        results: The study.
        means: Rows of ``summary.add_verdicts`` of these settings.
        targets: Metric -> the least mean.
    """
    asked = [_target_in_words(metric_of(metric), end) for metric, end in targets.items()]
    product = means[means["metric"] == PRODUCT].set_index(["policy", "point"])
    count = f"{len(product):,} of {len(results.store.manifest.points) * len(results.policies):,}"
    meet = "meets" if len(product) == 1 else "meet"
    console.print_text(
        f"{count} settings {meet} {numbers.join_words(asked)}, by the whole interval"
    )
    if product.empty:
        return
    cells = numbers.estimates_as_text(means[means["metric"].isin(METRICS)], ["policy", "point"])
    cells = cells.rename(columns=METRICS).assign(**{"of these policies": product["verdict"]})
    names = [setting_in_words(results, *setting) for setting in cells.index]
    print_frame("setting", cells.set_axis(names, axis="index")[:MANY_POINTS])
    if len(cells) > MANY_POINTS:
        console.print_text(f" {len(cells) - MANY_POINTS:,} more settings; --csv has them")


def _print_distributions(table: pd.DataFrame) -> None:
    """Quantiles of the product over the missions, and the mean of the worst ones."""
    rows = table[(table["view"] != "quantile") | table["share"].isin(_QUANTILES)]
    print_frame(
        "spread of the product",
        distributions.quantile_table(rows, PRODUCT).cells.set_index("Policy"),
    )


def _print_comparisons(results: Results, table: pd.DataFrame) -> None:
    """Differences of the other policies from the best one."""
    cells, product = choose_product_differences(table, "policy")
    # How many times as many missions the comparison needs without common random numbers.
    gains = product["variance_reduction"].map(lambda v: f"{1 / (1 - v):.1f} x" if v < 1 else "")
    cells["pairing saves"] = gains
    print_frame(f"against {table['baseline'].iloc[0]} [points]", cells)
    console.print_text(f" {comparisons.correction_in_words(results)}")
    if why := comparisons.allowance_for_difference(table, "policy"):
        console.print_text(f" {why}")


def _print_learners(table: pd.DataFrame) -> None:
    """Differences of the learners from the best heuristic."""
    cells, product = choose_product_differences(table, "learner")
    cells = cells.assign(about=product["about"])
    print_frame(f"learned against {table['baseline'].iloc[0]} [points]", cells)


def choose_product_differences(table: pd.DataFrame, who: str) -> tuple[pd.DataFrame, pd.DataFrame]:
    """``comparison_cells`` by what is compared, and the rows of the product."""
    cells = comparison_cells(table, who).set_index(who.capitalize())
    return cells, table[table["metric"] == PRODUCT].set_index(who)


def _print_worst(table: pd.DataFrame) -> None:
    """The worst missions of a policy, with the commands that simulate them again."""
    policy = table["policy"].iloc[0]
    console.print_text(f" worst missions of {policy}, by product:")
    for row in table.itertuples():
        outcome = "" if row.success else ", no success"
        console.print_text(f"   {numbers.format_percent(row.collection_ratio)} collected{outcome}:")
        console.print_text(f"     {row.command}")


MANY, FIELDS = 10, 4  # rows on differences, and fields of a mission, that are printed


def print_diff(found: diff.Diff, most: int) -> None:
    """Print how many missions of two results differ, by how much, and the most changed ones."""
    counted = numbers.format_count(len(found.missions), "mission")
    differ = len(found.changed)
    if found.unpaired is not None:
        both = numbers.format_count(len(found.unpaired), "mission")
        console.print_text(f"{both} of both, with different random draws")
    elif found.identical:
        console.print_text(f"identical: {counted}")
    elif not differ:
        console.print_text(f"identical: the {counted} that both have")
    else:
        console.print_text(f"{differ:,} of {counted} differ")
    for origin in diff.differing_origins(found):
        console.print_text(f" {origin}")
    _print_alone(found.alone)
    if differ or found.unpaired is not None:
        _print_effects(found)
    if differ:
        _print_most_changed(found, most)


def _print_alone(alone: pd.DataFrame) -> None:
    """What only one of the folders has."""
    for side, rows in alone.groupby("only_in"):
        for row in rows[:MANY].itertuples():
            counted = numbers.format_count(row.missions, "mission")
            console.print_text(f" only in {side}: {row.what} ({counted})")
        if len(rows) > MANY:
            console.print_text(
                f" only in {side}: {len(rows) - MANY:,} more groups of missions; --json has them"
            )


def _print_effects(found: diff.Diff) -> None:
    """Differences by policy, and by policy and design point if there are several."""
    table = diff.estimate_differences(found)
    _print_differences(table.assign(who=table["policy_a"]))
    if len(found.a.store.manifest.points) > 1:
        table = diff.estimate_differences(found, ["policy_a", "point_a"])
        pairs = table[["policy_a", "point_a"]].itertuples(index=False)
        _print_differences(table.assign(who=[setting_in_words(found.a, *pair) for pair in pairs]))


def _print_differences(table: pd.DataFrame) -> None:
    """A row for everything whose missions differ: how many do, and B - A in every metric."""
    rows = table[table["differ"] > 0]
    names = rows["who"].drop_duplicates()
    cells, product = choose_product_differences(rows[rows["who"].isin(names[:MANY])], "who")
    counts = product["differ"].map("{:,}".format) + " of " + product["missions"].map("{:,}".format)
    cells.insert(0, "missions that differ", counts)
    print_frame("B - A [points]", cells)
    if (more := len(names) - MANY) > 0:
        console.print_text(f" {more:,} more rows; --json has them")
    if same := table["who"].nunique() - len(names):
        console.print_text(f" {same:,} more without any difference")


def _print_most_changed(found: diff.Diff, most: int) -> None:
    """The most changed missions, with the commands that simulate them again."""
    for side, results in (("A", found.a), ("B", found.b)):
        console.print_text(f" {side}, {results.store.folder}: {diff.at_hand(results)}")
    console.print_text(" most changed missions:")
    for row in diff.most_changed(found, most).itertuples():
        where = setting_in_words(found.a, row.policy_a, row.point_a)
        console.print_text(
            f"   {where}, replication {row.replication}: {_shorten_fields(row.fields.split(', '))}"
        )
        console.print_text(f"     A: {row.command_a}\n     B: {row.command_b}")


def _shorten_fields(fields: list[str]) -> str:
    """The first of the fields that differ, and how many more there are."""
    first = ", ".join(fields[:FIELDS])
    if len(fields) > FIELDS:
        return f"{first}, and {len(fields) - FIELDS} more"
    return first
