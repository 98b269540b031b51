"""What the command line shows: tables on stdout, progress on stderr."""

import sys
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from analysis.execution.runner import Round
    from policies.ddqn.training import Training


WIDE = 200  # characters, where there is no terminal


def fail(message: str, code: int) -> int:
    """Say in one line on stderr why the command ends with this exit code."""
    print(" ".join(message.split()), file=sys.stderr)
    return code


def print_list(entries: Iterable[tuple[str, str]]) -> None:
    """Names with their descriptions, one a line."""
    for name, description in entries:
        print(f"{name:12} {description}".rstrip())


def print_table(header: list[str], rows: list[list[str]]) -> None:
    """A table; its first column is text, the others are aligned to the right."""
    from rich.box import SIMPLE_HEAD
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(box=SIMPLE_HEAD)
    for number, name in enumerate(header):
        table.add_column(Text(name), justify="right" if number else "left")
    for row in rows:
        table.add_row(*map(Text, row))
    Console(width=None if sys.stdout.isatty() else WIDE).print(table)


@contextmanager
def missions_bar(total: int) -> Iterator[Callable[[int], object]]:
    """Progress in missions, if they take longer than a second."""
    with _bar("mission", total) as bar:
        yield bar.update


@contextmanager
def rounds_bar() -> "Iterator[tuple[Callable[[int], object], Callable[[Round], object]]]":
    """Progress of a study in missions: what tells of missions, and of rounds, which bring more."""
    with _bar("mission", 0) as bar:

        def begin(a_round: "Round") -> None:
            if not a_round.number:
                there = f", {a_round.present:,} of them there" if a_round.present else ""
                print(f"{a_round.missions:,} missions{there}", file=sys.stderr)
            bar.total = a_round.missions
            bar.initial += a_round.present  # took no time
            if a_round.number:
                bar.set_description(f"round {a_round.number + 1}", refresh=False)

        yield bar.update, begin


@contextmanager
def cells_bar() -> Iterator[Callable[[str, int, int], None]]:
    """Progress of the reports in cells, of all of them."""
    with _bar("cell") as bar:

        def show(name: str, done: int, total: int) -> None:
            bar.total = total
            bar.set_description(name, refresh=False)
            bar.update(done - bar.n)

        yield show


@contextmanager
def steps_bar() -> Iterator[Callable[[int, int], None]]:
    """Progress in steps."""
    with _bar("step") as bar:

        def show(done: int, total: int) -> None:
            bar.total = total
            bar.update(done - bar.n)

        yield show


@contextmanager
def training_bar(ticks: int) -> "Iterator[Callable[[Training, int], None]]":
    """Progress of a training, with the metrics of its last evaluation."""
    with _bar("tick", ticks) as bar:

        def show(training: "Training", done: int) -> None:
            if bar.n == 0:  # a resumed one begins where it was
                bar.initial = bar.n = training.tick - done
            bar.update(training.tick - bar.n)
            if training.curve:
                last = training.curve[-1]
                bar.set_postfix(
                    phase=last["phase"],
                    success=f"{last['evaluation_success']:.3f}",
                    product=f"{last['evaluation_collection_ratio_and_communication']:.3f}",
                    refresh=False,
                )

        yield show


def _bar(unit: str, total: int | None = None) -> Any:
    """A progress bar; outside a terminal it seldom prints."""
    from tqdm import tqdm

    interval = 0.1 if sys.stderr.isatty() else 10
    return tqdm(total=total, unit=unit, delay=1, mininterval=interval)


@contextmanager
def compile_notice() -> Iterator[None]:
    """Say it, once, if numba compiles something that its cache has not."""
    from numba.core.event import Event, Listener, install_listener

    class Notice(Listener):
        said = False

        def on_start(self, event: Event) -> None:
            if not self.said:
                print("compiling the simulator (first run only) ...", file=sys.stderr)
            self.said = True

        def on_end(self, event: Event) -> None:
            pass

    with install_listener("numba:compile", Notice()):
        yield
