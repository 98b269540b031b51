"""``dess study``: run a study into a results folder; show, compare and bundle results."""

import json
import sys
from collections.abc import Callable, Iterable
from datetime import date
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dess.base.commands import command_line
from dess.base.errors import InputError, unknown_name
from dess.base.libraries import needs
from dess.reports.cli import console, options
from dess.reports.cli.console import YesOption, run_or_exit
from dess.reports.cli.report import rendering_bar
from dess.reports.pages import PREFIX, check_pages

if TYPE_CHECKING:
    import pandas as pd

    from dess.analysis.answers.diff import Diff
    from dess.analysis.execution.effort import Planned
    from dess.analysis.execution.jobs import Progress
    from dess.analysis.results.shards import Shard
    from dess.analysis.results.tables import Results
    from dess.analysis.study.study import Study
    from dess.reports.cli.console import Announce

TARGET = "a metric and its least mean, such as success=0.99, or its largest, such as age=40"

app = typer.Typer(
    help="Run studies (policies x design points x replications), show and compare results."
)


@options.add_command(app)
def run(
    names: Annotated[
        list[str], typer.Argument(metavar="NAME|FILE...", autocompletion=options.complete_studies)
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Results folder; of several studies, the folder of their results folders.  "
            f"[default: {options.RESULTS}/NAME]",
        ),
    ] = None,
    workers: options.WorkersOption = 1,
    scheduler: options.SchedulerOption = None,
    shard: options.ShardOption = None,
    missions: Annotated[int | None, typer.Option(min=1)] = None,
    years: options.YearsOption = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="P[,P...]",
            autocompletion=options.complete_policies,
            callback=options.use_current_names,
        ),
    ] = None,
    process: options.ProcessOption = None,
    dry_run: Annotated[bool, typer.Option("--dry-run")] = False,
    accept_code: Annotated[bool, typer.Option("--accept-code")] = False,
    page: Annotated[
        bool,
        typer.Option("--report", help=f"Also render the page of the study into {options.PAGES}."),
    ] = False,
    yes: YesOption = False,
) -> None:
    """Run a study into a results folder; run it again to resume it or to add missions.

    Args:
        names: The names of shipped studies, or TOML files.
        missions: Missions per design point and policy.
        policy: Policies in place of those of the study; repeatable.
        dry_run: Only print the plan and the range of its time.
        accept_code: Keep missions that other code has simulated; the results say so.
    """
    from dess.analysis.execution.effort import check_run, plan_study
    from dess.analysis.execution.runner import run_shard
    from dess.analysis.study.files import load_study

    changes = {"missions": missions, "years": years, "policies": policy}
    chosen = {key: value for key, value in changes.items() if value is not None}
    processes = options.typed_processes(process)
    studies = [load_study(name, processes=processes, **chosen) for name in names]
    if out and len(studies) == 1:
        folders = [out]
    else:
        folders = [(out or options.RESULTS) / study.name for study in studies]
    runs = [*zip(studies, folders, strict=True)]
    part = options.parse_shard(shard, studies, report=page)
    shards = part.total if part else 1
    if dry_run:
        for study, folder in runs:
            plan = plan_study(study, folder, workers, accept_code)
            print_plan(plan, study, folder, workers * shards)
        return
    if page:
        needs("reports", "--report")
        check_pages(options.PAGES, *(f"{PREFIX}{study.name}" for study in studies))
    with console.compile_notice():
        for study, folder in runs:
            check_run(study, folder, workers, accept_code, yes=yes, shards=shards)
    for study, folder in runs:
        if part:
            about = (study, folder, part, workers, scheduler)
            run = partial(run_shard, *about, accept_code=accept_code)
            complete_shard(study, folder, part, run)
        else:
            _run_and_summarize(study, folder, workers, scheduler, accept_code)
    if page:
        from dess.analysis.results.tables import load_results
        from dess.reports.pages.render import render_study

        with rendering_bar() as progress:
            for folder in folders:
                page_file = render_study(load_results(folder), options.PAGES, progress)
                console.print_text(page_file)


def _run_and_summarize(
    study: "Study", out: Path, workers: int, scheduler: str | None, accept: bool
) -> None:
    """Run a study, and print its summary."""
    from dess.analysis.execution.runner import run_study
    from dess.reports.cli.tables import print_summary

    results = run_or_exit(
        study.name,
        lambda progress, announce: run_study(
            study, out, workers, scheduler, progress, announce, accept
        ),
        replication=study.replication_name,
    )
    print_summary(results, out, short=True)
    console.print_text(f"more: {command_line('study', 'show', out)}")


def complete_shard(
    study: "Study",
    out: Path,
    shard: "Shard",
    run: "Callable[[Progress, Announce], None]",
    again: str = console.AGAIN,
) -> None:
    """Run a shard, and say how the shards are joined."""
    run_or_exit(study.name, run, again, study.replication_name)
    merge = command_line("study", "merge", out)
    console.print_text(f"shard {shard} of study {study.name} is complete; when all are: {merge}")


@options.add_command(app)
def merge(
    folders: Annotated[list[Path], typer.Argument(metavar="DIR")],
    out: Annotated[Path | None, typer.Option(metavar="DIR")] = None,
) -> None:
    """Join the shards of a study, and check that nothing is missing.

    The folder then has the same bytes as after dess study run without --shard.

    Args:
        folders: The results folder of the shards, or the folders if they have several.
        out: Results folder in which they are joined.  [default: the first DIR]
    """
    from dess.analysis.results.merge import merge_shards
    from dess.reports.cli.tables import print_summary

    results = merge_shards(folders, out)
    print_summary(results, results.store.folder, short=True)
    console.print_text(f"more: {command_line('study', 'show', results.store.folder)}")


def print_plan(plan: "list[Planned]", study: "Study", out: Path, workers: int) -> None:
    """Print the missions or years that a run would simulate, and the range of its time."""
    from dess.analysis.execution.effort import total_time
    from dess.analysis.numbers import format_count

    name = study.replication_name
    rows = [[p.policy, f"{p.missions:,}", f"{p.present:,}", str(p.seconds)] for p in plan]
    console.print_table(["policy", f"{name}s", "present", "time on one core"], rows)
    per_cell = format_count(study.first, "replication")
    if study.rule:
        rule = "selection" if study.selection else "precision"
        most = len(study.policies) * study.most_missions
        per_cell += f" and more, up to {most:,} {name}s, as {rule} asks"
    missions = sum(p.missions for p in plan[: len(study.policies)])
    policies = format_count(len(study.policies), "policy")
    points = format_count(study.size, "design point")
    console.print_text(
        f"{out}: {format_count(missions, name)} of study {study.name} ({policies} "
        f"x {points} x {per_cell})"
    )
    console.print_text(
        f"{total_time(plan, workers)} with {workers} at work, by their usual speed; "
        "compiling, on the first run, takes a few minutes more"
    )


@options.add_command(app)
def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    policy: Annotated[str | None, typer.Option(metavar="P[,P...]")] = None,
    worst: Annotated[int, typer.Option(min=0)] = 5,
    target: Annotated[list[str] | None, typer.Option(metavar="METRIC=SHARE")] = None,
    compare: Annotated[int | None, typer.Option(metavar="POINT")] = None,
    everything: Annotated[bool, typer.Option("--all")] = False,
    missions: Annotated[bool, typer.Option("--missions")] = False,
    as_csv: Annotated[bool, typer.Option("--csv")] = False,
    as_json: options.JsonOption = False,
) -> None:
    """Show the results of a study: means, comparisons, selections, the worst missions.

    Of a study that was interrupted, the means of the missions that are there.

    Args:
        folder: A results folder.
        policy: Policy of the worst missions.  [default: the best policy]
        worst: How many of the worst missions.
        target: Show the policies and design points whose mean of a metric (success, ratio,
            product) is at least this, by the lower end of its interval; repeatable.
        compare: Compare every design point with this one, mission by mission: its number, as the
            column point of --csv has it.
        everything: Show the tables of all metrics, not of the product alone.
        missions: Print the missions as CSV: a row per mission, with its design point and the value
            of every field that the design varies.
        as_csv: Print the means as CSV: a row per policy, design point and metric; with --compare,
            the differences.
    """
    from dess.analysis import numbers
    from dess.analysis.answers import summary
    from dess.analysis.metrics import column_in_sheet_unit, without_nodes
    from dess.reports.cli import tables as printed

    if as_csv + as_json + missions > 1:
        raise InputError("--csv, --json, --missions", "given together", "one of them")
    targets = _parse_targets(target or [])
    results = _load_folder(folder, begun=True)
    is_complete = results.manifest["complete"]
    if not is_complete:
        note = f"{folder}: incomplete, so these are means of what is there"
        console.print_text(f"{note}; run the study again to complete it", sys.stderr)
    if policy is not None and policy not in results.policies:
        raise unknown_name("--policy", f"{policy!r} is not in the study", policy, results.policies)
    targets = {
        column_in_sheet_unit(metric, results.missions): end for metric, end in targets.items()
    }
    if missions:
        console.print_text(numbers.write_csv(without_nodes(results.missions)).rstrip())
        return
    if compare is not None:
        _show_comparison(results, compare, everything, as_csv, as_json)
        return
    if not is_complete:
        _show_begun(results, folder, targets, as_csv, as_json)
        return
    means = summary.settings_meeting(summary.means_of_points(results), targets)
    means = summary.add_verdicts(results, means)
    if as_csv:
        console.print_text(numbers.write_csv(_add_field_values(results, means)).rstrip())
    elif as_json:
        tables = _make_tables(results, means, policy, worst, folder)
        print(json.dumps(_make_document(results, tables, targets), indent=2))
    else:
        if targets:
            printed.print_meeting(results, means, targets)
            return
        printed.print_summary(results, folder, short=False)
        shown = _make_tables(results, means, policy, worst, folder)
        printed.print_details(results, shown, everything)


def _show_comparison(
    results: "Results", point: int, everything: bool, as_csv: bool, as_json: bool
) -> None:
    """Show how every design point differs from one of them, with the same policy."""
    from dess.analysis import numbers
    from dess.analysis.answers.settings import baseline
    from dess.analysis.measured import measured_in, usual_metric
    from dess.analysis.metrics import METRICS
    from dess.reports.cli import tables as printed

    metrics = [*METRICS, *measured_in(results.missions)]
    if as_csv or as_json:
        table = baseline.compare_with_baseline(results, point, metrics)
        if as_csv:
            console.print_text(numbers.write_csv(table).rstrip())
            return
        about = {"study": results.study.name, "baseline": point}
        rows = json.loads(table.to_json(orient="records"))
        print(json.dumps(about | {"compared": rows}, indent=2))
        return
    console.print_text(f"against {baseline.baseline_in_words(results, point)}")
    for metric in metrics if everything else [usual_metric(results.missions)]:
        printed.print_table_with_caption(baseline.baseline_table(results, point, metric))


def _show_begun(
    results: "Results", folder: Path, targets: dict[str, float], as_csv: bool, as_json: bool
) -> None:
    """Show the means of a study that is not complete, and how many missions they are of."""
    from dess.analysis import numbers, summary
    from dess.analysis.answers.summary import settings_meeting
    from dess.reports.cli import tables as printed

    means = settings_meeting(summary(results.missions, by=["policy", "point"]), targets)
    if as_csv:
        console.print_text(numbers.write_csv(_add_field_values(results, means)).rstrip())
    elif as_json:
        document = _make_document(results, {"means": means}, targets) | {"complete": False}
        print(json.dumps(document, indent=2))
    else:
        printed.print_begun(results, means, folder)


def _load_folder(folder: Path, begun: bool = False) -> "Results":
    """The results in a folder; a study that is kept elsewhere is named with its folder.

    Args:
        folder: The folder.
        begun: Whether the study may be incomplete.
    """
    from dess.analysis.results.chunks import MANIFEST
    from dess.analysis.results.manifest import Manifest
    from dess.analysis.results.tables import load_begun, load_results

    if not folder.exists() and (options.RESULTS / folder).is_dir():
        raise InputError(folder, "no such folder", f"a results folder: {options.RESULTS / folder}")
    if begun and not Manifest.read(folder / MANIFEST).complete:
        return load_begun(folder)
    return load_results(folder)


def _parse_targets(texts: Iterable[str]) -> dict[str, float]:
    """Metric -> the least mean, or the largest of a metric of which less is better."""
    from dess.analysis.metrics import ALIASES, METRICS, metric_group

    operations = metric_group("operations")
    targets = {}
    for name, share in options.parse_all_settings(texts, "--target", TARGET).items():
        if (metric := ALIASES.get(name, name)) not in METRICS | operations:
            names = [*METRICS, *ALIASES, *operations]
            raise unknown_name("--target", f"{name!r} is unknown", name, names)
        is_number = isinstance(share, int | float) and not isinstance(share, bool)
        if metric in operations and not (is_number and share >= 0):
            raise InputError(f"--target: {name}", f"{share!r} is not allowed", "0 or more")
        if metric in METRICS and not (is_number and 0 <= share <= 1):
            raise InputError(f"--target: {name}", f"{share!r} is not a share", "0..1")
        if metric in targets:
            raise InputError("--target", f"{metric} is given twice", "once")
        targets[metric] = float(share)
    return targets


def _make_tables(
    results: "Results", means: "pd.DataFrame", policy: str | None, worst: int, folder: Path
) -> "dict[str, pd.DataFrame]":
    """All tables, by their names in the JSON."""
    import pandas as pd

    from dess.analysis.answers import decided, distributions, optimality, summary
    from dess.analysis.answers.fleet.costs import cost_front
    from dess.analysis.answers.policies import comparisons, ranks
    from dess.analysis.answers.settings.sobol import sobol_indices_of
    from dess.analysis.answers.worst_missions import worst_missions

    policy = policy or ranks.best_policy(results.missions)
    costs = pd.DataFrame()
    if results.study.costs:
        costs = cost_front(results)
    return {
        "means": means,
        "distributions": distributions.product_distributions(results),
        "precisions": decided.reached_precisions(results),
        "comparisons": comparisons.compare_with_best(results),
        "learned_against_heuristic": comparisons.compare_learned_with_heuristic(results),
        "sensitivities": sobol_indices_of(results),
        "costs": costs,
        "selected": decided.selected_settings(results),
        "gaps": optimality.by_fleet(results),
        "checks": summary.means_of_check(results),
        "worst": worst_missions(results, policy, worst, folder=folder),
    }


def _make_document(
    results: "Results", tables: "dict[str, pd.DataFrame]", targets: dict[str, float]
) -> dict[str, Any]:
    """All tables as plain data; rows on a design point have the values of its fields as well."""
    rows = {name: json.loads(table.to_json(orient="records")) for name, table in tables.items()}
    values = results.store.manifest.values
    placed = (row for of_table in rows.values() for row in of_table if row.get("point") is not None)
    for row in placed:
        row |= {field: value for field, value in values[row["point"]].items() if field not in row}
    about: dict[str, Any] = {
        "study": results.study.name,
        "accepted": results.manifest["accepted"],
    }
    if targets:
        about["targets"] = targets
    return about | rows


def _add_field_values(results: "Results", means: "pd.DataFrame") -> "pd.DataFrame":
    """Means with a column per field that the design sets; a list of values is JSON."""
    table = means.copy()
    values = results.store.manifest.values
    for place, field in enumerate(values[0], 2):
        column = [of_point[field] for of_point in values]
        texts = [json.dumps(v) if isinstance(v, list | bool) else v for v in column]
        table.insert(place, field, table["point"].map(dict(enumerate(texts))))
    return table


@options.add_command(app)
def diff(
    a: Annotated[Path, typer.Argument(metavar="A")],
    b: Annotated[Path, typer.Argument(metavar="B")],
    most: Annotated[int, typer.Option(min=0)] = 5,
    as_json: options.JsonOption = False,
) -> None:
    """Compare two results folders mission by mission, with the same random draws.

    Args:
        a: A results folder.
        b: Another results folder.
        most: Number of most changed missions to show.
    """
    from dess.analysis.answers import diff
    from dess.reports.cli.tables import print_diff

    differences = diff.diff_results(_load_folder(a), _load_folder(b))
    if as_json:
        print(json.dumps(_diff_document(differences, most), indent=2))
    else:
        print_diff(differences, most)


def _diff_document(found: "Diff", most: int) -> dict:
    """All that is found, as plain data."""
    from dess.analysis.answers import diff

    identity = ["policy_a", "policy_b", "point_a", "point_b", "replication", "fields"]
    tables = {
        "alone": found.alone,
        "policies": diff.estimate_differences(found),
        "points": diff.estimate_differences(found, ["policy_a", "point_a"]),
        "changed": found.changed[identity],
        "most_changed": diff.most_changed(found, most)[[*identity, "command_a", "command_b"]],
    }
    return {
        "a": str(found.a.store.folder),
        "b": str(found.b.store.folder),
        "identical": found.identical,
        "paired": found.unpaired is None,
        "missions": len(found.missions),
        "differ": len(found.changed),
        "origins": diff.differing_origins(found),
        **{name: json.loads(table.to_json(orient="records")) for name, table in tables.items()},
    }


@options.add_command(app)
def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR")],
    crate: Annotated[Path, typer.Option(metavar="FILE.zip")],
    page: Annotated[Path | None, typer.Option(metavar="FILE")] = None,
    licence: Annotated[str, typer.Option("--license", metavar="ID")] = "MIT",
) -> None:
    """Write results, page, study and scenario into one file, a research object (RO-Crate).

    Args:
        folder: A results folder.
        crate: The RO-Crate to write; - for standard output.
        page: The page of the results.  [default: it is rendered for the crate]
        licence: Licence of the results, by its SPDX identifier.
    """
    from dess.analysis.numbers import format_count
    from dess.reports.crate import check_page, find_licence, write_crate
    from dess.reports.pages.render import render_study

    console.check_ending("--crate", crate, (".zip",), "a zip file", is_stream=True)
    results = _load_folder(folder)
    licence = find_licence(licence)
    if page:
        check_page(page, results)
    with console.open_outputs([crate]) as (temporary,), TemporaryDirectory() as pages:
        if page is None:
            with rendering_bar() as progress:
                page = render_study(results, pages, progress)
        write_crate(results, page, temporary, date.today(), licence)
    if not console.is_stdout(crate):
        missions = format_count(len(results.missions), "mission")
        console.print_text(f"{crate}: {missions} with {page.name}, licence {licence}")
