"""``dess study show``: the results of a study, as tables, as one document, or as CSV."""

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dess.errors import InputError, one_of
from reports.cli import console
from reports.cli.ranges import all_settings
from reports.cli.settings import JsonOption

if TYPE_CHECKING:
    import pandas as pd

    from analysis.results.tables import Results

TARGET = "a metric and its least mean, such as success=0.99, or its largest, such as age=40"


def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    policy: Annotated[str | None, typer.Option(metavar="P[,P...]")] = None,
    worst: Annotated[int, typer.Option(min=0)] = 5,
    target: Annotated[list[str] | None, typer.Option(metavar="METRIC=SHARE")] = None,
    everything: Annotated[bool, typer.Option("--all")] = False,
    as_csv: Annotated[bool, typer.Option("--csv")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show the results of a study: means, comparisons, selections, the worst missions.

    Args:
        folder: A results folder.
        policy: Policy of the worst missions.  [default: the best policy]
        worst: How many of the worst missions.
        target: Show the policies and design points whose mean of a metric (success, ratio,
            product) is at least this, by the lower end of its interval; repeatable.
        everything: Show the tables of all metrics, not of the product alone.
        as_csv: Print the means as CSV: a row per policy, design point and metric.
    """
    from analysis import numbers
    from analysis.questions import summary
    from analysis.results.tables import load_results
    from reports.cli.study import tables as printed

    if as_csv and as_json:
        raise InputError("--csv: not with --json; allowed: one of them")
    targets = _targets(target or [])
    results = load_results(folder)
    if policy is not None and policy not in results.policies:
        raise InputError(
            f"--policy: {policy!r} is not in the study{one_of(policy, results.policies)}"
        )
    means = summary.meeting(summary.means(results), targets)
    means = summary.with_verdicts(results, means)
    if as_csv:
        console.say(numbers.csv(_with_values(results, means)).rstrip())
    elif as_json:
        tables = _tables(results, means, policy, worst, folder)
        print(json.dumps(_document(results, tables, targets), indent=2))
    else:
        if targets:
            printed.print_meeting(results, means, targets)
            return
        printed.print_summary(results, folder, short=False)
        shown = _tables(results, means, policy, worst, folder)
        printed.print_details(results, shown, everything)


def _targets(texts: Iterable[str]) -> dict[str, float]:
    """Metric -> the least mean, or the largest of a metric of which less is better."""
    from analysis.names import ALIASES, MEASURES, METRICS

    targets = {}
    for name, share in all_settings(texts, "--target", TARGET).items():
        if (metric := ALIASES.get(name, name)) not in METRICS | MEASURES:
            known = one_of(name, [*METRICS, *ALIASES, *MEASURES])
            raise InputError(f"--target: {name!r} is unknown{known}")
        is_number = isinstance(share, int | float) and not isinstance(share, bool)
        if metric in MEASURES and not (is_number and share >= 0):
            raise InputError(f"--target: {name}: {share!r} is not allowed; allowed: 0 or more")
        if metric in METRICS and not (is_number and 0 <= share <= 1):
            raise InputError(f"--target: {name}: {share!r} is not a share; allowed: 0..1")
        if metric in targets:
            raise InputError(f"--target: {metric} is given twice; allowed: once")
        targets[metric] = float(share)
    return targets


def _tables(
    results: "Results", means: "pd.DataFrame", policy: str | None, worst: int, folder: Path
) -> "dict[str, pd.DataFrame]":
    """All tables, by their names in the JSON."""
    import pandas as pd

    from analysis.questions import costs, summary
    from analysis.questions.optimality import gap

    policy = policy or summary.best_policy(results.missions)
    return {
        "means": means,
        "distributions": summary.distributions(results),
        "precisions": summary.precisions(results),
        "comparisons": summary.comparisons(results),
        "learned_against_heuristic": summary.learned_against_heuristic(results),
        "sensitivities": summary.sensitivities(results),
        "costs": costs.front(results) if results.store.manifest.costs else pd.DataFrame(),
        "selected": summary.selections(results),
        "gaps": gap.by_fleet(results),
        "checks": summary.checks(results),
        "worst": summary.worst(results, policy, worst, folder=folder),
    }


def _document(
    results: "Results", tables: "dict[str, pd.DataFrame]", targets: dict[str, float]
) -> dict[str, Any]:
    """All tables as plain data; rows on a design point have the values of its fields as well."""
    rows = {name: json.loads(table.to_json(orient="records")) for name, table in tables.items()}
    values = results.store.manifest.values
    for row in (row for of_table in rows.values() for row in of_table if "point" in row):
        row |= {field: value for field, value in values[row["point"]].items() if field not in row}
    about = {
        "study": results.manifest["study"]["name"],
        "accepted": results.manifest["accepted"],
    }
    return about | ({"targets": targets} if targets else {}) | rows


def _with_values(results: "Results", means: "pd.DataFrame") -> "pd.DataFrame":
    """Means with a column per field that the design sets; a list of values is JSON."""
    table = means.copy()
    for place, field in enumerate(results.store.manifest.values[0], 2):
        column = [of_point[field] for of_point in results.store.manifest.values]
        texts = [json.dumps(v) if isinstance(v, list | bool) else v for v in column]
        table.insert(place, field, table["point"].map(dict(enumerate(texts))))
    return table
