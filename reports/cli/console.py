"""Output of the command line: results as tables on stdout, progress and errors on stderr."""

import sys
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

from dess.errors import cut, printable

MESSAGE = 300  # the longest line that says why a command fails
INTERRUPTED = 130  # the exit code after Ctrl-C, as shells and typer have it: 128 + SIGINT


class Interruption(Exception):  # noqa: N818 - nothing went wrong
    """A command was stopped by Ctrl-C; the message says how to go on."""


def fail(message: str, code: int) -> int:
    """Print one line on stderr that says why the command fails, and return the exit code.

    The line has no control characters, and of a long one the beginning and the end.
    """
    print(cut(printable(" ".join(message.split())), MESSAGE), file=sys.stderr)
    return code


def say(text: str) -> None:
    """Print text on stdout, line by line, with escapes for control characters."""
    print("\n".join(map(printable, text.expandtabs().split("\n"))))


def print_list(entries: Iterable[tuple[str, str]]) -> None:
    """Print names with their descriptions, one per line."""
    lines = [(printable(name), printable(description)) for name, description in entries]
    width = max((len(name) for name, _ in lines), default=0)
    for name, description in lines:
        print(f"{name:{width}}  {description}".rstrip())


def print_table(header: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> None:
    """Print a table; its first columns are aligned to the left, the others to the right."""
    lines = [[*map(printable, line)] for line in (header, *rows)]
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    aligns = [str.ljust if number < left else str.rjust for number in range(len(header))]
    aligned = [
        [align(cell, width) for align, cell, width in zip(aligns, line, widths, strict=True)]
        for line in lines
    ]
    aligned.insert(1, ["─" * width for width in widths])
    print("", *("  ".join(cells).rstrip() for cells in aligned), "", sep="\n")


@contextmanager
def bar(unit: str, total: int = 0) -> Iterator[Any]:
    """A progress bar on stderr (``tqdm``), if the work takes longer than a second.

    Outside a terminal it prints a line every ten seconds.
    """
    from tqdm import tqdm

    delay, interval = (1, 0.1) if sys.stderr.isatty() else (10, 10)
    with tqdm(total=total, unit=unit, delay=delay, mininterval=interval) as progress:
        yield progress


@contextmanager
def counted_bar(unit: str) -> Iterator[Callable[..., None]]:
    """A progress bar whose callback gets the count and the total, and the name of the work."""
    with bar(unit) as progress:

        def show(done: int, total: int, name: str = "") -> None:
            progress.total = total
            progress.set_description(name, refresh=False)
            progress.update(done - progress.n)

        yield show


@contextmanager
def compile_notice() -> Iterator[None]:
    """Print a line, once, if numba compiles something that is not in its cache."""
    from numba.core.event import Event, Listener, install_listener

    class Notice(Listener):
        printed = False

        def on_start(self, event: Event) -> None:
            if not self.printed:
                print("compiling the simulator (first run only) ...", file=sys.stderr)
            self.printed = True

        def on_end(self, event: Event) -> None:
            pass

    with install_listener("numba:compile", Notice()):
        yield
