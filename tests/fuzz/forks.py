"""Runs cases: each in a process that is forked from one that has everything loaded.

The parent of all cases is the fork server of ``multiprocessing``.
"""

import multiprocessing
import os
import shutil
import signal
import time
from collections.abc import Callable, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from multiprocessing.connection import wait
from multiprocessing.process import BaseProcess
from pathlib import Path

import psutil
import pyarrow as pa

from tests.fuzz import child
from tests.fuzz.case import FOLDERS, HOME, LOG, SECRET, SECRET_FILE, Case
from tests.fuzz.snapshot import Snapshot, taken
from tests.fuzz.steps import plant_evil

AT_ONCE = 3  # of two cores: some cases wait for a time limit or a lock
# Seconds in which the helpers of a command, such as its workers, have to end after it: 2, and what
# a loaded machine needs.
_GRACE = 4
_START = 300  # seconds that the parent of all cases may need before its first one
_WATCH = 1  # seconds before a command is interrupted in which it has to do something
# Errors of a step that does not fit what an earlier step has left; it does nothing then.
_UNFIT = (OSError, ValueError, LookupError, TypeError, AttributeError, ZeroDivisionError)
_UNFIT += (RecursionError, pa.ArrowException)


@dataclass(frozen=True)
class Outcome:
    """What a case has done.

    Attributes:
        case: The case.
        box: Its folder.
        before: What was in it before.
        after: What was in it afterwards.
        code: The exit code; that of the second run, if the case has one.
        seconds: How long it took.
        late: Whether the command had to be killed because it did not end in its time.
        waited: Whether it did nothing in the second before a command that may last was interrupted.
        ending: The CPU time that it took after its first signal, in seconds.
        left: The processes that it left behind.
    """

    case: Case
    box: Path
    before: Snapshot
    after: Snapshot
    code: int
    seconds: float
    late: bool
    waited: bool
    ending: float
    left: list[str]

    def text(self, name: str) -> str:
        """What it printed on ``stdout`` or ``stderr``."""
        file = self.box / LOG / name
        return file.read_bytes().decode("utf-8", "surrogateescape") if file.exists() else ""


class Forks:
    """Runs cases, a few at a time, below a folder."""

    def __init__(self, folder: Path) -> None:
        """Load everything that commands need, once."""
        self.cases, self.ready = folder / "cases", folder / "ready"
        self._context = multiprocessing.get_context("forkserver")
        self._context.set_forkserver_preload(["tests.fuzz.preload", "tests.fuzz.child"])

    def outcomes(self, cases: Iterable[tuple[int, Case]]) -> Iterator[tuple[int, Outcome]]:
        """Run numbered cases, ``AT_ONCE`` at a time; they come in the order in which they end."""
        waiting, running = iter(cases), list[_Running]()
        try:
            while True:
                while len(running) < AT_ONCE and (entry := next(waiting, None)) is not None:
                    running.append(self._start(*entry))
                if not running:
                    return
                wait([entry.process.sentinel for entry in running], timeout=0.02)
                for entry in [entry for entry in running if entry.has_ended()]:
                    running.remove(entry)
                    yield entry.number, entry.outcome()
        finally:
            for entry in running:
                entry.kill()

    def _process(self, case: Case, box: Path) -> BaseProcess:
        return self._context.Process(target=child.run, args=(case, box))

    def _start(self, number: int, case: Case) -> "_Running":
        box = self.cases / str(number)
        shutil.rmtree(box, ignore_errors=True)
        for name in FOLDERS:
            (box / name).mkdir(parents=True)
        (box / SECRET_FILE).write_text(f"{SECRET},{SECRET}\n")
        plant_evil(box)
        for step in case.steps:
            with suppress(*_UNFIT):
                step.do(box)
        return _Running(number, case, box, self._process)


class _Running:
    """A case whose command runs."""

    def __init__(
        self, number: int, case: Case, box: Path, process_of: Callable[[Case, Path], BaseProcess]
    ) -> None:
        self.number, self.case, self.box, self._process_of = number, case, box, process_of
        self.before, self.began, self.late = taken(box), time.monotonic(), False
        self._repeated = False
        self._run(case)

    def _run(self, case: Case) -> None:
        lasting = [(case.lasting, signal.SIGTERM)] if case.lasting else []
        self._signals = sorted([*case.signals, *lasting])
        self.process = self._process_of(replace(case, steps=()), self.box)
        self.process.start()
        self._started, self._begins = 0.0, time.monotonic()
        self._watched: float | None = None  # CPU time when a command that lasts was looked at
        self._signalled: float | None = None  # CPU time at the first signal
        self._is_idle, self.waited, self.ending = True, False, 0.0

    def has_ended(self) -> bool:
        """Send the signals that are due; the result says whether the case has ended."""
        if self.process.exitcode is None:
            self._send()
            return False
        if self.case.again and not self._repeated:
            self._repeated = True
            shutil.rmtree(self.box / LOG)
            (self.box / LOG).mkdir()
            self._run(replace(self.case, signals=(), lasting=0))
            return False
        return True

    def _send(self) -> None:
        now = time.monotonic()
        if not self._started and (self.box / LOG / child.STARTED).exists():
            self._started = now
        if now - (self._started or self._begins + _START) > self.case.seconds:
            self.late = True
            self.kill()
            return
        if not self._started:
            return
        age, used = now - self._started, self._used()
        if self.case.lasting and age > self.case.lasting - _WATCH:
            self._watched = used if self._watched is None else self._watched
            self._is_idle &= self._is_asleep()
        if self._signalled is not None:
            self.ending = max(self.ending, used - self._signalled)
        while self._signals and age > self._signals[0][0]:
            self.waited |= self._watched == used and self._is_idle
            self._signalled = used if self._signalled is None else self._signalled
            with suppress(ProcessLookupError):
                os.kill(self.process.pid, self._signals.pop(0)[1])

    def _is_asleep(self) -> bool:
        with suppress(psutil.NoSuchProcess):
            return psutil.Process(self.process.pid).status() == psutil.STATUS_SLEEPING
        return False

    def _used(self) -> float:
        """The CPU time of the command so far, in seconds."""
        with suppress(psutil.NoSuchProcess):
            times = psutil.Process(self.process.pid).cpu_times()
            return times.user + times.system  # without workers, which count when they have ended
        return 0.0

    def kill(self) -> None:
        """Kill the command and all its processes."""
        self.process.kill()
        for process in self._left():
            with suppress(psutil.NoSuchProcess):
                process.kill()
        self.process.join()

    def outcome(self) -> Outcome:
        """What the case has done; processes that it left behind are killed."""
        seconds = time.monotonic() - self.began
        while (left := self._left()) and time.monotonic() - self.began < seconds + _GRACE:
            time.sleep(0.05)
        names = [" ".join(process.info["cmdline"] or ["?"])[:200] for process in left]
        for process in left:
            with suppress(psutil.NoSuchProcess):
                process.kill()
        code, after = self.process.exitcode, taken(self.box)
        assert code is not None
        self.process.close()
        how = (code, seconds, self.late, self.waited, self.ending)
        return Outcome(self.case, self.box, self.before, after, *how, names)

    def _left(self) -> list[psutil.Process]:
        """The processes in the session of the case, and all others with its home."""
        home = str(self.box / HOME)
        left = []
        for process in psutil.process_iter(["pid", "cmdline", "environ", "status"]):
            with suppress(ProcessLookupError, psutil.NoSuchProcess):
                is_of_case = os.getsid(process.pid) == self.process.pid
                is_of_case |= (process.info["environ"] or {}).get("HOME") == home
                if is_of_case and process.info["status"] != psutil.STATUS_ZOMBIE:
                    left.append(process)
        return [process for process in left if process.pid != self.process.pid]
