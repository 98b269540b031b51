"""Commands that are killed while they run, and a check of what they leave behind."""

import atexit
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import suppress
from functools import partial
from pathlib import Path
from random import Random
from uuid import uuid4

import psutil
import pyarrow.parquet as pq

from tests.analysis.small import environment

MARK = "DESS_TEST_COMMAND"  # a variable by which the processes of a command are found
SECONDS = 300.0  # in which a command makes progress, ends, and is followed by its processes
# What a command prints on stderr beside the line for an error.
PROGRESS = re.compile(
    r"\s*|compiling the simulator .*|(at least )?[\d,]+ missions(, [\d,]+ of them present)?|"
    r"replay memory: .*|on this machine: .*|curves: .*|a live view of the curves .*|.*\[\d\d:\d\d.*"
)


class Command:
    """A ``dess`` command in a folder, with a folder for its temporary files.

    Args:
        arguments: The arguments of the command, whose ``--out`` is ``out``.
        folder: The folder in which it runs.
        before: Python code that is run before the command.
    """

    def __init__(self, arguments: list[str], folder: Path, before: str = "pass"):
        self.folder, self.out = folder, folder / "out"
        # Not beside the folder, since the names of the sockets of kernels must be short.
        self.temporary = Path(tempfile.mkdtemp(prefix="dess-killed-"))
        atexit.register(shutil.rmtree, self.temporary, ignore_errors=True)
        script = f"import sys\n{before}\nfrom dess.reports.cli import main\nsys.exit(main())"
        self.words = [sys.executable, "-c", script, *arguments, "--out", "out"]
        self.stderr = folder.with_name(f"{folder.name}.stderr")

    def run(self) -> None:
        """Run the command to its end."""
        with self._started() as running:
            code = running.wait()
        assert code == 0, self.stderr.read_text("utf-8")
        assert self._temporaries() == []

    def kill(
        self, number: int, is_there: Callable[[], bool], delay: float, group: bool = False
    ) -> bool:
        """Send a signal to the command some seconds after it has made progress.

        Args:
            number: The signal.
            is_there: Whether the progress has been made.
            delay: The seconds.
            group: Whether to signal the processes of its process group, too.

        Returns:
            Whether the command was killed; it may have ended before.
        """
        before = self._others()
        with self._started() as running:
            _wait(lambda: is_there() or running.poll() is not None, 0.002)
            time.sleep(delay)
            with suppress(ProcessLookupError):
                (os.killpg if group else os.kill)(running.pid, number)
            code = running.wait(SECONDS)
        self._check(code, number)
        assert self._others() == before
        return code != 0

    def _started(self) -> "subprocess.Popen[bytes]":
        self.mark = uuid4().hex
        variables = environment() | {MARK: self.mark, "TMPDIR": str(self.temporary)}

        def heed() -> None:  # a background job of a shell ignores some signals
            for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
                signal.signal(number, signal.SIG_DFL)

        with open(self.stderr, "wb") as stderr:
            return subprocess.Popen(
                self.words,
                cwd=self.folder,
                env=variables,
                stdout=subprocess.DEVNULL,
                stderr=stderr,
                preexec_fn=heed,
                start_new_session=True,
            )

    def _check(self, code: int, number: int) -> None:
        """Check the exit code, the line, the processes and the files of the killed command."""
        text = self.stderr.read_text("utf-8")
        lines = [line for line in re.split(r"[\r\n]", text) if not PROGRESS.fullmatch(line)]
        if number == signal.SIGKILL:
            assert code in (-signal.SIGKILL, 0), text
            assert lines == [], text
        else:
            assert code in (130, 0), text
            assert len(lines) == (code == 130), text
            assert all(line.startswith("interrupted") and len(line) <= 300 for line in lines)
        _wait(lambda: not [*self.processes()], 0.1)
        if number != signal.SIGKILL:
            assert self._temporaries() == []
            assert not [path for path in self.out.rglob(".*") if not path.name.endswith("lock")]
        for path in self.out.rglob("*.parquet"):
            pq.read_table(path)

    def _temporaries(self) -> list[Path]:
        """The temporary files of the command, but for the cache that torch keeps there."""
        return [path for path in self.temporary.iterdir() if "torch" not in path.name]

    def processes(self) -> Iterator[psutil.Process]:
        """The processes of the command that are still there."""
        for process in psutil.process_iter():
            with suppress(psutil.Error):
                if process.environ().get(MARK) == self.mark:
                    yield process

    def _others(self) -> set[Path]:
        """The files that are not those of the command."""
        return {path for path in self.folder.rglob("*") if not path.is_relative_to(self.out)}


def _wait(condition: Callable[[], bool], interval: float) -> None:
    begin = time.monotonic()
    while not condition():
        assert time.monotonic() - begin < SECONDS
        time.sleep(interval)


def _has(command: Command, progress: Callable[[Command], int], wanted: int) -> bool:
    return progress(command) >= wanted


def kill(
    commands: Iterator[Command],
    number: int,
    kills: int,
    progress: Callable[[Command], int],
    longest: float,
    generator: Random,
) -> Iterator[Command]:
    """Kill a command, run it again and kill it after some more progress, and so on.

    Args:
        commands: The command in one new folder after the other.
        number: The signal.
        kills: How many times to kill it.
        progress: A number that grows while the command runs.
        longest: The longest delay between some progress and the signal [s].
        generator: Draws the moments, and whether the whole process group gets the signal.

    Yields:
        A command that was killed until it was complete or killed often enough, then completed.
    """
    killed = 0
    while killed < kills:
        command, is_complete = next(commands), False
        while killed < kills and not is_complete:
            wanted = progress(command) + generator.randint(1, 3)
            group = number != signal.SIGKILL and generator.random() < 0.5
            is_complete = not command.kill(
                number,
                partial(_has, command, progress, wanted),
                generator.uniform(0, longest),
                group,
            )
            killed += not is_complete
        command.run()
        yield command
    print(f"{' '.join(command.words[3:6])}: killed {killed} times by {signal.Signals(number).name}")
