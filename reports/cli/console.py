"""What commands print: lines, tables, progress, interrupts."""

import errno
import io
import logging
import os
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Annotated, Any, TextIO, TypeVar

import typer

from dess.base.errors import InputError, cut, printable
from dess.base.files.reading import read_bytes
from dess.base.files.writing import replacing_all

LARGEST = 2**32  # bytes of a file for standard output
AGAIN = "the same command again"  # what completes what was interrupted
MESSAGE = 300  # the longest line that says why a command fails
_STREAMS = {"stdout": "standard output", "stderr": "standard error"}


class Interruption(Exception):  # noqa: N818 - nothing went wrong
    """A command was stopped by Ctrl-C; the message says how to go on."""


class _Line(logging.Formatter):
    """A message of a log as one line of printable characters."""

    def format(self, record: logging.LogRecord) -> str:
        return cut(_in_one_line(record.getMessage()), MESSAGE)


WIDTH = 100  # of a table in the terminal [characters]


def prepare_streams() -> None:
    """Let stdout and stderr take any text, even if they are closed, and logs print lines."""
    for name in _STREAMS:
        if getattr(sys, name) is None:  # closed, as by >&-
            setattr(sys, name, open(os.devnull, "w"))  # noqa: SIM115 - as long as the process
        if isinstance(stream := getattr(sys, name), io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    if logging.lastResort:  # prints the warnings of all modules
        logging.lastResort.setFormatter(_Line())


def print_system_error(error: OSError | SystemExit) -> int:
    """Print what the system refused to a command, and return the exit code.

    A broken pipe, for which typer raises ``SystemExit``, is no error to tell: the program that
    reads the output, such as ``head``, has seen enough. A stream that cannot be written is given
    up, since Python would try it again at the end.
    """
    broken = []
    for name in _STREAMS:
        try:
            (stream := getattr(sys, name)).flush()
        except OSError:
            broken.append(_STREAMS[name])
            _silence_stream(stream)
    if isinstance(error, BrokenPipeError | SystemExit):
        return 1
    place = error.filename or " and ".join(broken)
    reason = error.strerror or str(error)
    line = f"dess: error: {reason}"
    if place:
        line = f"dess: error: {place}: {reason}"
    if error.errno == errno.ENAMETOOLONG:  # such a name is bad input
        return print_failure(line, 2, "another path")
    return print_failure(line, 1)


def print_refusal(error: InputError) -> int:
    """Print the line about bad input on stderr, and return the exit code."""
    return print_failure(f"dess: error: {error.complaint}", 2, error.allowed)


def print_failure(message: str, code: int, allowed: str = "") -> int:
    """Print one line on stderr that says why the command fails, and return the exit code.

    The line has no control characters, and of a long one the beginning and the end.

    Args:
        message: Why.
        code: The exit code.
        allowed: What is allowed; a line that is too long still says it.
    """
    line = _in_one_line(message)
    end = ""
    if allowed:
        end = "; allowed: "
        room = MESSAGE - len(line) - len(end)
        end += cut(_in_one_line(allowed), max(room, MESSAGE // 2))
    line = cut(line, MESSAGE - len(end))
    try:
        print(line + end, file=sys.stderr)
    except OSError:  # there is no stream left for the line
        _silence_stream(sys.stderr)
    return code


def _silence_stream(stream: TextIO) -> None:
    """Let nothing more be written to a stream that cannot be written, not even at the end."""
    os.dup2(os.open(os.devnull, os.O_WRONLY), stream.fileno())


def _in_one_line(text: str) -> str:
    return printable(" ".join(text.split()))


def print_text(text: object, stream: TextIO | None = None) -> None:
    """Print text on stdout or another stream, with escapes for all control characters."""
    lines = str(text).expandtabs().split("\n")
    print("\n".join(map(printable, lines)), file=stream or sys.stdout, flush=True)


def ask_questions(
    given: Mapping[str, str],
    questions: Mapping[str, tuple[str, str | None]],
    check: Callable[[str, str], None],
) -> dict[str, str]:
    """An answer to every question: what is given, or asked for, a line each, or the default.

    Args:
        given: Answers by name.
        questions: By name, what they mean and their default, None without one.
        check: Refuses an answer with an ``InputError``; then it is asked for again.

    Raises:
        InputError: If a given answer is refused; without a terminal, if one is missing.
    """
    for name, answer in given.items():
        check(name, answer)
    answered = dict(given)
    asked = [name for name in questions if name not in given]
    missing = [name for name in asked if questions[name][1] is None]
    if missing and not sys.stdin.isatty():
        allowed = f"--set {missing[0]}=..., or a terminal, where it is asked"
        raise InputError(", ".join(missing), "missing", allowed)
    while asked:
        name = asked[0]
        meaning, default = questions[asked[0]]
        answer = ""
        if sys.stdin.isatty():
            answer = input(f"{name}: {meaning}{_use_of_enter(default)}? ").strip()
        try:
            check(name, answer or default or "")
            answered[asked.pop(0)] = answer or default or ""
        except InputError as error:
            print_text(error, sys.stderr)
    return answered


def _use_of_enter(default: str | None) -> str:
    """What an empty answer to a question means, if one is allowed."""
    if default is None:
        return ""
    return f" (Enter: {default or 'without'})"


@contextmanager
def open_outputs(paths: Sequence[Path]) -> Iterator[list[Path]]:
    """Yield a temporary path for each file that a command writes; they are replaced together.

    ``-`` and ``/dev/stdout`` mean standard output, where the content is written at the end.

    Raises:
        InputError: If a file cannot be written, or if standard output is a terminal.
    """
    files = [path for path in paths if not is_stdout(path)]
    if len(files) < len(paths) and sys.stdout.isatty():
        raise InputError("-", "standard output is a terminal", "a file, or a pipe")
    with replacing_all(files) as temporaries:
        if len(files) == len(paths):
            yield temporaries
            return
        with TemporaryDirectory() as folder:
            buffer = Path(folder, "stdout")
            rest = iter(temporaries)
            yield [buffer if is_stdout(path) else next(rest) for path in paths]
            sys.stdout.buffer.write(read_bytes(buffer, LARGEST))
            sys.stdout.flush()


def check_ending(
    option: str, path: Path | None, allowed: Sequence[str], kind: str, is_stream: bool = False
) -> None:
    """Refuse an output whose ending does not say what is to be written.

    Args:
        option: The option that names the file.
        path: The file, if there is one.
        allowed: The endings.
        kind: What is written, for the message.
        is_stream: Whether it may be standard output, which has no ending.

    Raises:
        InputError: If the ending is another one.
    """
    if path and not (is_stream and is_stdout(path)) and path.suffix.lower() not in allowed:
        raise InputError(option, f"{path} is not {kind}", ", ".join(allowed))


def is_stdout(path: Path) -> bool:
    """Whether the name of an output means standard output."""
    return str(path) in ("-", "/dev/stdout")


def print_list(entries: Iterable[tuple[str, str]]) -> None:
    """Print names with their descriptions, one per line."""
    lines = [(printable(name), printable(description)) for name, description in entries]
    width = max((len(name) for name, _ in lines), default=0)
    for name, description in lines:
        print(f"{name:{width}}  {description}".rstrip())


def print_table(header: Sequence[str], rows: Iterable[Sequence[str]], left: int = 1) -> None:
    """Print a table; its first columns are aligned to the left, the others to the right.

    A table that is wider than ``WIDTH`` goes on below, with its first column again, or with its
    first two where it takes both to tell the rows apart.
    """
    lines = [[*map(printable, line)] for line in (header, *rows)]
    names = {line[0] for line in lines}
    keys = 1
    if len(names) < len({tuple(line[:2]) for line in lines}) == len(lines):
        keys = 2
    widths = [max(map(len, column)) for column in zip(*lines, strict=True)]
    aligns = [str.ljust if number < left else str.rjust for number in range(len(header))]
    aligned = [
        [align(cell, width) for align, cell, width in zip(aligns, line, widths, strict=True)]
        for line in lines
    ]
    aligned.insert(1, ["─" * width for width in widths])
    for columns in _group_columns(widths, keys):
        shown = ("  ".join(line[number] for number in columns).rstrip() for line in aligned)
        print("", *shown, "", sep="\n")
    if any("nan" in cell for line in lines for cell in line):
        from dess.analysis.numbers import why_nan  # which loads pandas

        print("".join(f" {why}\n" for why in [why_nan(sum(lines, []))] if why), end="")


def _group_columns(widths: Sequence[int], keys: int) -> Iterator[list[int]]:
    """The numbers of the columns that are printed side by side; the first ones are in all."""
    block = [*range(keys)]
    for number in range(keys, len(widths)):
        if len(block) > keys and sum(widths[n] + 2 for n in (*block, number)) > WIDTH + 2:
            yield block
            block = [*range(keys)]
        block.append(number)
    yield block


@contextmanager
def progress_bar(unit: str, total: int = 0) -> Iterator[Any]:
    """A progress bar on stderr (``tqdm``), if the work takes longer than a second.

    Outside a terminal it prints a line every ten seconds. While something is compiled it says so;
    this time is no part of the speed that it shows.
    """
    from tqdm import tqdm

    is_terminal = sys.stderr.isatty()
    times: dict[str, float] = {"delay": 10, "mininterval": 10}
    if is_terminal:
        times = {"delay": 1, "mininterval": 0.1}
    with tqdm(total=total, unit=unit, **times) as progress:
        before = ""

        def begin() -> None:
            nonlocal before
            before = progress.desc
            progress.set_description("compiling", refresh=is_terminal)

        def end() -> None:
            progress.unpause()
            progress.set_description_str(before, refresh=False)

        with _watch_compiling(begin, end):
            yield progress


@contextmanager
def counted_bar(unit: str) -> Iterator[Callable[..., None]]:
    """A progress bar whose callback gets the count and the total, and the name of the work."""
    with progress_bar(unit) as progress:

        def show(done: int, total: int, name: str = "") -> None:
            progress.total = total
            progress.set_description(printable(name), refresh=False)
            progress.update(done - progress.n)

        yield show


@contextmanager
def compile_notice() -> Iterator[None]:
    """Print a line, once in a process, if numba compiles something that is not in its cache."""
    with _watch_compiling(announce_compiling, lambda: None):
        yield


@cache
def announce_compiling() -> None:
    """Print that the simulator is compiled, the first time that this is called.

    It has a line of its own beside a progress bar.
    """
    from numba.core.caching import NullCache
    from tqdm import tqdm

    from dess.model.rules import launch  # any kernel

    when = "first run only"
    if isinstance(launch._cache, NullCache):  # no folder beside the code can be written
        when = "in every run; NUMBA_CACHE_DIR=DIR keeps it"
    tqdm.write(f"compiling the simulator ({when}) ...", file=sys.stderr)


@contextmanager
def _watch_compiling(begin: Callable[[], object], end: Callable[[], object]) -> Iterator[None]:
    """Call functions before and after numba compiles a function with all that it calls."""
    from numba.core.event import Event, Listener, install_listener

    class Outermost(Listener):
        depth = 0

        def on_start(self, event: Event) -> None:
            if self.depth == 0:
                begin()
            self.depth += 1

        def on_end(self, event: Event) -> None:
            self.depth -= 1
            if self.depth == 0:
                end()

    with install_listener("numba:compile", Outermost()):
        yield


if TYPE_CHECKING:
    from dess.analysis.execution.jobs import Progress
    from dess.analysis.execution.runner import Round

    Announce = Callable[[Round], object]

Found = TypeVar("Found")

YesOption = Annotated[
    bool, typer.Option("--yes", help="Run it even if it has very many missions or takes long.")
]


def run_or_exit(
    name: str,
    run: "Callable[[Progress, Announce], Found]",
    again: str = AGAIN,
    replication: str = "mission",
) -> Found:
    """Run a study; an interruption (exit code 130) or a failure (1) ends the command with a line.

    Args:
        name: The study.
        run: Runs it, with callbacks for missions done and for rounds.
        again: What completes it after an interruption.
        replication: What its replications are.

    Raises:
        Interruption: If it was.
        typer.Exit: If some of it could not be computed.
    """
    from dess.analysis.execution.runner import ChunkError
    from dess.analysis.execution.workers import SchedulerError

    try:
        with compile_notice(), _replication_bar(replication) as (progress, announce):
            return run(progress, announce)
    except KeyboardInterrupt:
        line = f"interrupted: run {again} to complete it"
        raise Interruption(line) from None
    except SchedulerError as error:
        line = f"dess: error: {error}; run {again} to complete it"
        raise typer.Exit(print_failure(line, 1)) from None
    except ChunkError as error:
        for path, failure in error.failures.items():
            print_failure(f"failed: {failure.error} ({path}); command: {failure.command}", 1)
        count = len(error.failures)
        line = f"dess: error: {count} of the chunks of study {name} failed, all others are complete"
        raise typer.Exit(print_failure(line, 1)) from None


@contextmanager
def _replication_bar(name: str) -> "Iterator[tuple[Progress, Announce]]":
    """Progress in missions or years: callbacks for those done, and for rounds, which add some."""
    with progress_bar(name) as shown:

        def begin(started: "Round") -> None:
            from dess.analysis.numbers import format_count  # which loads pandas

            if started.work:
                shown.set_description(started.work, refresh=False)
            elif started.number:
                shown.set_description(f"round {started.number + 1}", refresh=False)
            else:
                line = format_count(started.missions, name)
                if started.may_need_more:
                    line = f"at least {line}"
                if started.present:
                    line += f", {started.present:,} of them present"
                print_text(line, sys.stderr)
            shown.total = started.missions
            shown.initial += started.present  # took no time

        yield shown.update, begin
