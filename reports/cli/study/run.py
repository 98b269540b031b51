"""``dess study run``: studies, each into a results folder, or the plans of the runs."""

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
    names: Annotated[
        list[str], typer.Argument(metavar="NAME|FILE...", autocompletion=completion.studies)
    ],
    out: Annotated[
        Path | None,
        typer.Option(
            metavar="DIR",
            help="Results folder; of several studies, the folder of their results folders.  "
            f"[default: {RESULTS}/NAME]",
        ),
    ] = None,
    workers: WorkersOption = 1,
    scheduler: Annotated[str | None, typer.Option(metavar="ADDRESS")] = None,
    missions: Annotated[int | None, typer.Option(min=1)] = None,
    policy: Annotated[
        list[str] | None, typer.Option(metavar="P[,P...]", autocompletion=completion.policies)
    ] = None,
    dry_run: Annotated[bool, typer.Option("--dry-run")] = False,
    accept_code: Annotated[bool, typer.Option("--accept-code")] = False,
    page: Annotated[
        bool, typer.Option("--report", help=f"Also render the page of the study into {PAGES}.")
    ] = False,
    yes: YesOption = False,
) -> None:
    """Run a study into a results folder; run it again to resume it or to add missions.

    Args:
        names: The names of shipped studies, or TOML files.
        scheduler: Run on the cluster of this dask.distributed scheduler.
        missions: Missions per design point and policy.
        policy: Policies in place of those of the study; repeatable.
        dry_run: Only print the plan and the range of its time.
        accept_code: Keep missions that other code has simulated; the results say so.
    """
    from analysis.execution.dry_run import check_run, plan_study
    from analysis.study.study import load_study

    changes = {"missions": missions, "policies": policy}
    given = {key: value for key, value in changes.items() if value is not None}
    studies = [load_study(name, **given) for name in names]
    if out and len(studies) == 1:
        folders = [out]
    else:
        folders = [(out or RESULTS) / study.name for study in studies]
    runs = [*zip(studies, folders, strict=True)]
    if dry_run:
        for study, folder in runs:
            plan = plan_study(study, folder, workers, accept_code)
            print_plan(plan, study, folder, workers)
        return
    if page:
        needs("reports", "--report")
        check_pages(PAGES, *(f"{PREFIX}{study.name}" for study in studies))
    with console.compile_notice():
        for study, folder in runs:
            check_run(study, folder, workers, accept_code=accept_code, yes=yes)
    for study, folder in runs:
        _run(study, folder, workers, scheduler, accept_code)
    if page:
        from reports.pages.render import render_study

        with rendering() as progress:
            for folder in folders:
                console.say(render_study(folder, PAGES, progress))


def _run(study: "Study", out: Path, workers: int, scheduler: str | None, accept: bool) -> None:
    """Run a study, and print its summary."""
    from analysis.execution.runner import run_study
    from reports.cli.study.tables import print_summary

    results = complete(
        study.name,
        lambda progress, announce: run_study(
            study, out, workers, scheduler, progress, announce, accept
        ),
    )
    print_summary(results, out, short=True)
    console.say(f"more: dess study show {out}")


def print_plan(plan: "list[Planned]", study: "Study", out: Path, workers: int) -> None:
    """Print the missions that a run would simulate, and the range of its time."""
    from analysis.execution.dry_run import budget, total

    rows = [[p.policy, f"{p.missions:,}", f"{p.present:,}", str(p.seconds)] for p in plan]
    console.print_table(["policy", "missions", "present", "time on one core"], rows)
    per_cell = f"{study.first} replications"
    if study.rule:
        rule = "selection" if study.selection else "precision"
        per_cell += f" and more, up to {budget(study):,} missions, as {rule} asks"
    missions = sum(p.missions for p in plan[: len(study.policies)])
    console.say(
        f"{out}: {missions:,} missions of study {study.name} ({len(study.policies)} policies "
        f"x {study.size:,} design points x {per_cell})"
    )
    console.say(
        f"{total(plan, workers)} with {workers} at work, by the usual speed of such missions; "
        "compiling, on the first run, takes a few minutes more"
    )
