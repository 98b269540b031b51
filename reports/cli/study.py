"""``dess study``: run a study into a results folder; show, compare and bundle results."""

import json
from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated

import typer

from dess import InputError
from dess.files import check_folder, replacing
from reports.cli import console
from reports.cli.report import rendering
from reports.cli.running import YesOption, complete
from reports.cli.settings import PAGES, RESULTS, JsonOption, WorkersOption

if TYPE_CHECKING:
    from analysis.questions.diff import Diff

app = typer.Typer(help="Studies: policies x design points x replications.")


@app.command("run")
def run(
    name: Annotated[str, typer.Argument(metavar="NAME|FILE", help="A study or a TOML file.")],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help=f"Results folder.  [default: {RESULTS}/NAME]"),
    ] = None,
    workers: WorkersOption = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(metavar="ADDRESS", help="Run on this dask.distributed scheduler."),
    ] = None,
    missions: Annotated[
        int | None, typer.Option(min=1, help="Missions per design point and policy.")
    ] = None,
    policy: Annotated[
        list[str] | None, typer.Option(metavar="P[,P...]", help="Policies instead; repeatable.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Print the plan and the estimated time, run nothing.")
    ] = False,
    accept_code: Annotated[
        bool,
        typer.Option("--accept-code", help="Keep missions simulated by other code, and note it."),
    ] = False,
    page: Annotated[
        bool, typer.Option("--report", help=f"Render the page of the study into {PAGES} as well.")
    ] = False,
    yes: YesOption = False,
) -> None:
    """Run a study into a results folder; run again to resume or to top up."""
    from analysis.execution.dry_run import check_effort, check_policies, plan_study
    from analysis.execution.runner import run_study
    from analysis.study.study import load_study
    from reports.cli import study_tables

    changes = {"missions": missions, "policies": policy}
    study = load_study(name, **{key: value for key, value in changes.items() if value is not None})
    out = out or RESULTS / study.name
    if dry_run:
        with console.compile_notice():
            plan = plan_study(study, out, workers, accept_code=accept_code)
            study_tables.print_plan(plan, study, out, workers)
        return
    if page:
        check_folder(PAGES)
    with console.compile_notice():
        if check_effort(study, out, workers, accept_code=accept_code, yes=yes):
            check_policies(study)
    results = complete(
        study.name,
        lambda progress, announce: run_study(
            study, out, workers, scheduler, progress, announce, accept_code
        ),
    )
    study_tables.print_summary(results, out, short=True)
    print(f"more: dess study show {out}")
    if page:
        from reports.pages.render import render_study

        with rendering() as progress:
            print(render_study(out, PAGES, progress))


@app.command("show")
def show(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A results folder.")],
    policy: Annotated[
        str | None,
        typer.Option(
            metavar="P[,P...]", help="Policy of the worst missions.  [default: the best policy]"
        ),
    ] = None,
    worst: Annotated[int, typer.Option(min=0, help="How many of the worst missions.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Show the results of a study: means, comparisons, selections, the worst missions."""
    import pandas as pd

    from analysis.questions import costs, summary
    from analysis.results.tables import load_results
    from reports.cli import study_tables

    results = load_results(folder)
    if policy is not None and policy not in results.policies:
        allowed = ", ".join(results.policies)
        raise InputError(f"--policy: {policy!r} is not in the study; allowed: {allowed}")
    policy = policy or summary.best_policy(results.missions)
    tables = {
        "means": summary.means(results),
        "distributions": summary.distributions(results),
        "precisions": summary.precisions(results),
        "comparisons": summary.comparisons(results),
        "learned_against_heuristic": summary.learned_against_heuristic(results),
        "sensitivities": summary.sensitivities(results),
        "costs": costs.front(results) if results.store.manifest.costs else pd.DataFrame(),
        "selected": summary.selections(results),
        "checks": summary.checks(results),
        "worst": summary.worst(results, policy, worst),
    }
    if as_json:
        rows = {name: json.loads(t.to_json(orient="records")) for name, t in tables.items()}
        about = {
            "study": results.manifest["study"]["name"],
            "accepted": results.manifest["accepted"],
        }
        print(json.dumps(about | rows, indent=2))
        return
    study_tables.print_summary(results, folder, short=False)
    study_tables.print_details(results, tables)


@app.command("diff")
def diff(
    a: Annotated[Path, typer.Argument(metavar="A", help="A results folder.")],
    b: Annotated[Path, typer.Argument(metavar="B", help="Another results folder.")],
    most: Annotated[int, typer.Option(min=0, help="How many of the most changed missions.")] = 5,
    as_json: JsonOption = False,
) -> None:
    """Compare two results folders mission by mission, on the same random draws."""
    from analysis.questions import diff
    from analysis.results.tables import load_results
    from reports.cli import study_tables

    found = diff.diff(load_results(a), load_results(b))
    if as_json:
        print(json.dumps(_document(found, most), indent=2))
    else:
        study_tables.print_diff(found, most)


def _document(found: "Diff", most: int) -> dict:
    """All that is found, as plain data."""
    from analysis.questions import diff

    identity = ["policy_a", "policy_b", "point_a", "point_b", "replication", "fields"]
    tables = {
        "alone": found.alone,
        "policies": diff.effects(found),
        "points": diff.effects(found, ["policy_a", "point_a"]),
        "changed": found.changed[identity],
        "most_changed": diff.most_changed(found, most)[[*identity, "command_a", "command_b"]],
    }
    return {
        "a": str(found.a.store.folder),
        "b": str(found.b.store.folder),
        "identical": found.identical,
        "missions": len(found.missions),
        "differ": len(found.changed),
        "origins": diff.origins(found),
        **{name: json.loads(table.to_json(orient="records")) for name, table in tables.items()},
    }


@app.command("export")
def export(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="A results folder.")],
    crate: Annotated[Path, typer.Option(metavar="FILE.zip", help="The RO-Crate to write.")],
    page: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="Its page.  [default: it is rendered for the crate]"),
    ] = None,
    licence: Annotated[
        str, typer.Option("--license", metavar="ID", help="Of the results, as SPDX names it.")
    ] = "MIT",
) -> None:
    """Bundle results, page, study and scenario as a research object (RO-Crate)."""
    from analysis.results.tables import load_results
    from reports.crate import check_page, licence_of, write_crate
    from reports.pages.render import render_study

    results, licence = load_results(folder), licence_of(licence)
    if page:
        check_page(page, results)
    with replacing(crate) as temporary, TemporaryDirectory() as pages:
        if page is None:
            with rendering() as progress:
                page = render_study(folder, pages, progress)
        write_crate(results, page, temporary, date.today(), licence)
    print(f"{crate}: {len(results.missions):,} missions with {page.name}, licence {licence}")
