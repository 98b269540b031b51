"""``dess study run``: a study into a results folder, or the plan of the run."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from dess.code.libraries import needs
from reports.cli import completion, console
from reports.cli.report import rendering
from reports.cli.running import YesOption, complete
from reports.cli.settings import PAGES, RESULTS, WorkersOption
from reports.folders import PREFIX, check_pages

if TYPE_CHECKING:
    from analysis.execution.dry_run import Planned
    from analysis.study.study import Study


def run(
    name: Annotated[
        str,
        typer.Argument(
            metavar="NAME|FILE",
            help="The name of a shipped study, or a TOML file.",
            autocompletion=completion.studies,
        ),
    ],
    out: Annotated[
        Path | None,
        typer.Option(metavar="DIR", help=f"Results folder.  [default: {RESULTS}/NAME]"),
    ] = None,
    workers: WorkersOption = 1,
    scheduler: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="Run on the cluster of this dask.distributed scheduler."
        ),
    ] = None,
    missions: Annotated[
        int | None, typer.Option(min=1, help="Missions per design point and policy.")
    ] = None,
    policy: Annotated[
        list[str] | None,
        typer.Option(
            metavar="P[,P...]",
            autocompletion=completion.policies,
            help="Policies in place of those of the study; repeatable.",
        ),
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Only print the plan and the estimated time.")
    ] = False,
    accept_code: Annotated[
        bool,
        typer.Option(
            "--accept-code", help="Keep missions that other code has simulated; the results say so."
        ),
    ] = False,
    page: Annotated[
        bool, typer.Option("--report", help=f"Also render the page of the study into {PAGES}.")
    ] = False,
    yes: YesOption = False,
) -> None:
    """Run a study into a results folder; run it again to resume it or to add missions."""
    from analysis.execution.dry_run import check_run, plan_study
    from analysis.execution.runner import run_study
    from analysis.study.study import load_study
    from reports.cli.study.tables import print_summary

    changes = {"missions": missions, "policies": policy}
    study = load_study(name, **{key: value for key, value in changes.items() if value is not None})
    out = out or RESULTS / study.name
    if dry_run:
        with console.compile_notice():
            plan = plan_study(study, out, workers, accept_code=accept_code)
            _print_plan(plan, study, out, workers)
        return
    if page:
        needs("reports", "--report")
        check_pages(PAGES, f"{PREFIX}{study.name}")
    with console.compile_notice():
        check_run(study, out, workers, accept_code=accept_code, yes=yes)
    results = complete(
        study.name,
        lambda progress, announce: run_study(
            study, out, workers, scheduler, progress, announce, accept_code
        ),
    )
    print_summary(results, out, short=True)
    console.say(f"more: dess study show {out}")
    if page:
        from reports.pages.render import render_study

        with rendering() as progress:
            console.say(render_study(out, PAGES, progress))


def _print_plan(plan: "list[Planned]", study: "Study", out: Path, workers: int) -> None:
    """Print the missions that a run would simulate, and an estimate of the time."""
    from analysis.execution.dry_run import budget

    rows = [[p.policy, f"{p.missions:,}", f"{p.present:,}", f"{p.seconds:,.0f} s"] for p in plan]
    console.print_table(["policy", "missions", "present", "time on one core"], rows)
    per_cell, more = f"{study.first} replications", ""
    if study.rule:
        rule, more = "selection" if study.selection else "precision", "at least "
        per_cell += f" and more, up to {budget(study):,} missions, as {rule} asks"
    missions = sum(p.missions for p in plan[: len(study.policies)])
    console.say(
        f"{out}: {missions:,} missions of study {study.name} ({len(study.policies)} policies "
        f"x {study.size:,} design points x {per_cell})"
    )
    seconds = sum(p.seconds for p in plan) / workers
    console.say(f"about {more}{seconds:,.0f} s with {workers} at work")
