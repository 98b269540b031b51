"""``dess study export``: results with their page as one file."""

from datetime import date
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Annotated

import typer

from reports.cli import console
from reports.cli.report import rendering


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
    from analysis.results.tables import load_results
    from reports.crate import check_page, licence_of, write_crate
    from reports.pages.render import render_study

    results, licence = load_results(folder), licence_of(licence)
    if page:
        check_page(page, results)
    with console.outputs([crate]) as (temporary,), TemporaryDirectory() as pages:
        if page is None:
            with rendering() as progress:
                page = render_study(folder, pages, progress)
        write_crate(results, page, temporary, date.today(), licence)
    if not console.is_stdout(crate):
        missions = f"{len(results.missions):,} missions"
        console.say(f"{crate}: {missions} with {page.name}, licence {licence}")
