"""The ``dess`` command: one module per command group.

``dess --help`` must answer at once, so the modules import only what the help needs; a command
imports the simulator, pandas or torch when it runs.
"""

import sys
from collections.abc import Sequence

from dess.analysis.execution import set_variable
from dess.reports.interrupts import EXIT_CODE, LINE, Interrupts


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: Without the name of the program; those of the process by default.

    Returns:
        The exit code: 0 done, 2 bad input, 130 interrupted, 1 anything else.
    """
    words = sys.argv[1:] if arguments is None else [*arguments]
    # Workers import nothing from the working directory, which may be a results folder.
    safe = set_variable("PYTHONSAFEPATH", "1")
    with safe, Interrupts(is_last=arguments is None) as interrupts:
        try:  # the imports take a while, in which a signal may come
            from dess.reports.cli import console
            from dess.reports.cli.commands import app

            console.prepare_streams()
            _check_text(words)
            code = app(words, prog_name="dess", standalone_mode=False) or 0
            sys.stdout.flush()  # an error of the output is an error of the command
            if code == EXIT_CODE:  # as typer ends a command after a Ctrl-C
                raise KeyboardInterrupt
            interrupts.is_over = True
            return code
        except BaseException as error:
            # Signals are noticed at calls, so none comes between the error and this assignment.
            interrupts.is_over = True
            return _report_error(error, words, interrupts.received)


def _check_text(words: Sequence[str]) -> None:
    """Refuse arguments that are not UTF-8, which not every library could write or print.

    Python makes halves of characters of their bytes.
    """
    from dess.base.errors import InputError, shown

    for word in words:
        try:
            word.encode()
        except UnicodeEncodeError:
            raise InputError(shown(word), "is not text in UTF-8", "another name") from None


def _report_error(error: BaseException, words: Sequence[str], is_interrupted: bool) -> int:
    """Print the line for an error that ended a command, and return the exit code.

    Args:
        error: The error; one that has no line is raised again.
        words: The arguments of the command.
        is_interrupted: Whether there was a signal; a library may have made another error of it.
    """
    from typer.exceptions import TyperException

    from dess import InputError
    from dess.base.libraries import absence
    from dess.reports.cli import console

    if isinstance(error, console.Interruption):
        return console.print_failure(str(error), EXIT_CODE)
    if is_interrupted or isinstance(error, KeyboardInterrupt):
        return console.print_failure(LINE, EXIT_CODE)
    if isinstance(error, TyperException):
        context = getattr(error, "ctx", None)
        hint = f" (see {context.command_path} --help)" if context else ""
        return console.print_failure(
            f"dess: error: {error.format_message()}{hint}", error.exit_code
        )
    if isinstance(error, InputError):
        return console.print_refusal(error)
    if isinstance(error, ModuleNotFoundError):
        absent = absence(error, " ".join(["dess", *words[:1]]))
        if absent is not None:
            return console.print_refusal(absent)
    if isinstance(error, OSError | SystemExit):
        return console.print_system_error(error)
    if isinstance(error, MemoryError):
        return console.print_failure("dess: error: there is not enough memory", 1)
    if isinstance(error, RecursionError):
        return console.print_failure("dess: error: the input is nested too deeply", 1)
    raise error
