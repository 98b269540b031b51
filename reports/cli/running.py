"""Runs a study for a command: with a bar, and a line for everything that can end it early."""

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Annotated

import typer

from reports.cli import console

if TYPE_CHECKING:
    from analysis.execution.jobs import Progress
    from analysis.execution.runner import Round
    from analysis.results.tables import Results

    Announce = Callable[[Round], object]

YesOption = Annotated[
    bool, typer.Option("--yes", help="Run it even if it has very many missions or takes long.")
]


def complete(
    name: str, run: "Callable[[Progress, Announce], Results]", again: str = "the same command again"
) -> "Results":
    """Run a study; an interruption (exit code 130) or a failure (1) ends the command with a line.

    Args:
        name: The study.
        run: Runs it, with callbacks for missions done and for rounds.
        again: What completes it after an interruption.

    Raises:
        Interruption: If it was.
        typer.Exit: If some of it could not be computed.
    """
    from analysis.execution.cluster import SchedulerError
    from analysis.execution.runner import ChunkError

    try:
        with console.compile_notice(), _bar() as (progress, announce):
            return run(progress, announce)
    except KeyboardInterrupt:
        line = f"interrupted: run {again} to complete it"
        raise console.Interruption(line) from None
    except SchedulerError as error:
        line = f"dess: error: {error}; run {again} to complete it"
        raise typer.Exit(console.fail(line, 1)) from None
    except ChunkError as error:
        for path, failure in error.failures.items():
            console.fail(f"failed: {failure.error} ({path}); command: {failure.command}", 1)
        count = len(error.failures)
        line = f"dess: error: {count} of the chunks of study {name} failed, all others are complete"
        raise typer.Exit(console.fail(line, 1)) from None


@contextmanager
def _bar() -> "Iterator[tuple[Progress, Announce]]":
    """Progress in missions: callbacks for missions done, and for rounds, which add missions."""
    with console.bar("mission") as bar:

        def begin(started: "Round") -> None:
            if started.work:
                bar.set_description(started.work, refresh=False)
            elif started.number:
                bar.set_description(f"round {started.number + 1}", refresh=False)
            else:
                present = f", {started.present:,} of them present" if started.present else ""
                console.say(f"{started.missions:,} missions{present}", sys.stderr)
            bar.total = started.missions
            bar.initial += started.present  # took no time

        yield bar.update, begin
