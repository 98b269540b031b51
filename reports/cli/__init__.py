"""The ``dess`` command: one module per command group.

``dess --help`` must answer at once, so the modules import only what the help needs; a command
imports the simulator, pandas or torch when it runs.
"""

import sys
from collections.abc import Sequence
from typing import Annotated

import typer
from typer.exceptions import TyperException

import dess
from dess import InputError
from dess.code.libraries import absence
from reports.cli import console, evaluate, lists, report, simulate, study, sweep, train


def _print_version(is_wanted: bool) -> None:
    if is_wanted:
        print(f"dess {dess.__version__}")
        raise typer.Exit


app = typer.Typer(
    help="Discrete-event simulation of UAV data harvesting with charging at sea.",
    pretty_exceptions_enable=False,
    rich_markup_mode=None,
)


@app.callback()
def options(
    version: Annotated[
        bool,
        typer.Option(
            "--version", callback=_print_version, is_eager=True, help="Print the version."
        ),
    ] = False,
) -> None:
    """Options of the command itself."""


for group in (simulate, evaluate, train, sweep, report):
    app.add_typer(group.app)
for name in ("policies", "scenarios", "studies"):
    app.add_typer(getattr(lists, name), name=name)
app.add_typer(study.app, name="study")


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: Without the name of the program; those of the process by default.

    Returns:
        The exit code: 0 done, 2 bad input, 130 interrupted, 1 anything else.
    """
    try:
        code = app(arguments, prog_name="dess", standalone_mode=False)
    except TyperException as error:
        context = getattr(error, "ctx", None)
        hint = f" (see {context.command_path} --help)" if context else ""
        return console.fail(f"dess: error: {error.format_message()}{hint}", error.exit_code)
    except InputError as error:
        return console.fail(f"dess: error: {error}", 2)
    except console.Interruption as interruption:
        return console.fail(str(interruption), console.INTERRUPTED)
    except ModuleNotFoundError as error:
        command = [*(sys.argv[1:] if arguments is None else arguments)][:1]
        absent = absence(error, " ".join(["dess", *command]))
        if absent is None:
            raise
        return console.fail(f"dess: error: {absent}", 2)
    except SystemError as error:
        from analysis.execution.jobs import was_interrupted

        if not was_interrupted(error):
            raise
        code = console.INTERRUPTED
    # Typer returns the same number for a Ctrl-C that no command has caught.
    return console.fail("interrupted", code) if code == console.INTERRUPTED else code or 0
