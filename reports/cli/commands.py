"""The commands and options of ``dess``."""

from typing import Annotated

import typer

import dess
from dess.reports.cli import ask, console, evaluate, lists, report, simulate, studies, train


def _print_version(is_wanted: bool) -> None:
    if is_wanted:
        console.print_text(f"dess {dess.__version__}")
        raise typer.Exit


app = typer.Typer(
    help="Discrete-event simulation of UAV data harvesting with charging at sea.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
    context_settings={"help_option_names": ["-h", "--help"]},
)


@app.callback()
def take_common_options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Options of the command itself."""


for group in (simulate, evaluate, train, ask, report):
    app.add_typer(group.app)
for name in ("policies", "scenarios", "studies"):
    app.add_typer(getattr(lists, name), name=name)
app.add_typer(studies.app, name="study")
