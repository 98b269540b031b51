"""``dess report`` and ``dess verify``: pages and checks of them."""

import json
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from dess.base.errors import InputError, shown, unknown_name
from dess.reports.cli import console
from dess.reports.cli.console import YesOption
from dess.reports.cli.options import (
    PAGES,
    PARAMETER,
    RESULTS,
    JsonOption,
    add_command,
    parse_setting,
    typed_processes,
)
from dess.reports.pages import PICTURES

if TYPE_CHECKING:
    from dess.reports.pages.missing import Progress
    from dess.reports.pages.verify import Check

WHAT_IF = "what-if"  # the only report that has --set

app = typer.Typer()


@add_command(app)
def report(
    names: Annotated[list[str] | None, typer.Argument(metavar="[NAME|DIR]...")] = None,
    results: Annotated[Path, typer.Option(metavar="DIR")] = RESULTS,
    out: Annotated[Path, typer.Option(metavar="DIR")] = PAGES,
    settings: Annotated[list[str] | None, typer.Option("--set", metavar="KEY=VALUE")] = None,
    parameters: Annotated[
        list[str] | None, typer.Option("--parameter", metavar="NAME=VALUE")
    ] = None,
    figures: Annotated[str, typer.Option(metavar="FORMAT[,FORMAT]")] = "",
    yes: YesOption = False,
) -> None:
    """Render results as HTML pages with an index: reports on the paper, and pages of any study.

    If a results folder has the same name as a report, write it with a path separator: ./learning.

    Args:
        names: Reports, and results folders of any studies; all reports by default.
        results: Folder that contains a results folder per study.
        out: Folder of the pages.
        settings: A change that the report what-if asks about: a field of the scenario, the
            value in TOML syntax, a quantity such as 35 min without quotes; repeatable.
        parameters: A parameter of the notebooks, such as missions or policies of what-if, the
            value in TOML syntax; repeatable.
        figures: Also write every figure as a file into the folder NAME-figures beside its page:
            svg, pdf or png, or several of them.
    """
    formats = []
    if figures:
        formats = [kind.strip() for kind in figures.split(",")]
    for kind in formats:
        if kind not in PICTURES:
            raise unknown_name("--figures", f"{shown(kind)} is unknown", kind, PICTURES)
    if results != RESULTS and not os.path.lexists(results):
        raise InputError(f"--results: {results}", "no such folder", "one with results")
    values = dict(parse_setting(text, "--parameter", PARAMETER) for text in parameters or [])
    if settings:
        if names and WHAT_IF not in names:
            raise InputError("--set", f"{' '.join(names)} takes no --set", WHAT_IF)
        values["settings"] = dict(parse_setting(text) for text in settings)
        values.setdefault("baseline", {})  # the scenario itself, not that of the default question
    if yes:  # a parameter of the notebooks that simulate missions
        values["yes"] = True
    from dess.analysis.results.tables import load_results
    from dess.reports.pages.notebook import report_names
    from dess.reports.pages.render import render, render_study

    shipped = report_names()
    folders = [n for n in names or [] if os.sep in n or (n not in shipped and os.path.isdir(n))]
    reports = [name for name in names or [] if name not in folders]
    with rendering_bar() as progress:
        if reports or not folders:
            console.print_text(render(reports, results, out, progress, values, formats=formats))
        for folder in folders:
            results_of_study = load_results(folder)
            console.print_text(render_study(results_of_study, out, progress, values, formats))
    if formats:
        console.print_text(f"figures: {out / '*-figures'}")


@contextmanager
def rendering_bar() -> "Iterator[Progress]":
    """A bar for the progress of pages; a notebook that fails is one line and exit code 1."""
    from dess.reports.pages.render import ReportError

    try:
        with console.compile_notice(), console.counted_bar("step") as progress:
            yield progress
    except ReportError as error:
        raise typer.Exit(console.print_failure(f"dess: error: {error}", 1)) from error


@add_command(app)
def verify(
    path: Annotated[Path, typer.Argument(metavar="PAGE|DIR")],
    missions: Annotated[int, typer.Option(min=1, max=10000)] = 20,
    seed: Annotated[int | None, typer.Option(min=0)] = None,
    policy: Annotated[list[str] | None, typer.Option(metavar="FILE.py:CLASS")] = None,
    process: Annotated[list[str] | None, typer.Option(metavar="FILE.py:FUNCTION")] = None,
    yes: YesOption = False,
    as_json: JsonOption = False,
) -> None:
    """Check a page or results: simulate a random sample of the missions again, and compare.

    Args:
        path: A page of dess report, or results.
        missions: Largest number of missions to simulate again, for every study.
        seed: Seed of the random sample.  [default: a random number]
        policy: A policy of a Python file that the results name. It is not run without this
            option, since anybody may have made the results; repeatable.
        process: A process of a Python file that the results name; likewise.
    """
    import secrets

    from dess.reports.pages.verify import verify_page, verify_results

    if seed is None:
        seed = secrets.randbelow(2**32)
    check: Any = verify_page
    if path.is_dir():
        check = verify_results
    named = [*(policy or []), *typed_processes(process)]
    with console.compile_notice():
        verdicts = check(path, missions, seed, named, yes)
    if as_json:
        checks = [asdict(verdict) for verdict in verdicts]
        print(json.dumps({"seed": seed, "checks": checks}, indent=2))
    else:
        _print_verdicts(path, verdicts)
    if differing := [line for verdict in verdicts for line in verdict.differing]:
        for line in differing:
            console.print_failure(f"differs: {line}", 1)
        compared = sum(verdict.compared for verdict in verdicts)
        line = f"{path}: {len(differing)} of {compared} differ (--seed {seed})"
        raise typer.Exit(console.print_failure(f"dess: error: {line}", 1))


def _print_verdicts(path: Path, verdicts: "list[Check]") -> None:
    rows = [[v.what, str(v.compared), str(len(v.differing))] for v in verdicts]
    console.print_table([str(path), "compared", "differing"], rows)
    for note in dict.fromkeys(f"{v.what}: {note}" for v in verdicts for note in v.notes):
        console.print_text(f"note: {note}")
