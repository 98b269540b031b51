"""Pools that run jobs: the base class, and pools on this machine.

A job that raises an error has a ``Problem`` as its result. A worker that is killed is replaced, and
its job is run again; a job that kills its worker every time also has a ``Problem``.
"""

import os
import signal
import warnings
from abc import abstractmethod
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from typing import Any

from dess.analysis.execution.jobs import Job, Problem, Progress, attempt, first_failing
from dess.analysis.execution.orphans import live_and_die_with

Finished = Generator[tuple[int, Any], None, None]  # numbers and results of jobs

DEATHS = 2  # a job is given up after this many deaths of workers that ran only this job


class Pool(AbstractContextManager["Pool"]):
    """A pool that runs jobs, to be used in a ``with`` block.

    Attributes:
        attempts: How often a job is run alone before it is given up because its workers die.
    """

    attempts = DEATHS

    def run(self, jobs: Sequence[Job], progress: Progress | None = None) -> Finished:
        """Run the jobs; yield their numbers and results as they come in."""
        waiting = dict(enumerate(jobs))
        while waiting:
            suspects: set[int] = set()
            for number, result in self._finished(waiting, suspects):
                yield number, reported(waiting.pop(number), result, progress)
            # Workers died, and one of these jobs caused it.
            for number in sorted(suspects & waiting.keys()):
                yield number, reported(waiting[number], self._alone(waiting.pop(number)), progress)

    @abstractmethod
    def _finished(self, jobs: Mapping[int, Job], suspects: set[int]) -> Iterator[tuple[int, Any]]:
        """Results by job number as they come in, until a worker dies.

        Args:
            jobs: The jobs by their numbers.
            suspects: Gets the numbers of those that may have killed the worker.
        """

    def _alone(self, job: Job) -> Any:
        """The result of a job that may have killed its worker, while no other job is running."""
        for _ in range(self.attempts):
            if (result := self._once(job)) is not None:
                return result
        line = "its workers died: killed, out of memory, or crashed"
        deadly = first_failing(job, lambda single: self._once(single) is None)
        return Problem(line, mission=deadly)

    def _once(self, job: Job) -> Any:
        """The result of a job; None if its worker dies."""
        return next((result for _, result in [*self._finished({0: job}, set())]), None)


class Here(Pool):
    """A pool on this machine: this process, or joblib workers."""

    def __init__(self, workers: int):
        self.workers = workers

    def __exit__(self, *_: object) -> None:
        pass

    def run(self, jobs: Sequence[Job], progress: Progress | None = None) -> Finished:
        """Run the jobs; yield their numbers and results as they come in."""
        if self.workers == 1:
            for number, job in enumerate(jobs):
                yield number, _in_turn(job, progress)
            return
        for job in {type(job): job for job in jobs}.values():
            job.warm_up()  # compiles once in this process, so that the workers only load it
        yield from super().run(jobs, progress)

    def _finished(self, jobs: Mapping[int, Job], suspects: set[int]) -> Iterator[tuple[int, Any]]:
        from joblib import Parallel, delayed
        from joblib.externals.loky.process_executor import BrokenProcessPool

        parallel = Parallel(
            self.workers,
            return_as="generator_unordered",
            batch_size=1,
            initializer=live_and_die_with,
            initargs=(os.getpid(),),
        )

        def tasks() -> Iterator[Any]:
            for number, job in [*jobs.items()]:
                suspects.add(number)  # from now on it may be running
                yield delayed(_numbered)(number, job)

        try:
            with _results(parallel, tasks()) as results:
                # An expression in between, since "yield from" would close the results themselves.
                yield from (result for result in results)
        except BrokenProcessPool:
            return


@contextmanager
def _results(parallel: Any, tasks: Iterator[Any]) -> Iterator[Iterator[Any]]:
    """The results of tasks as joblib workers finish them; no task is left at the end.

    Workers inherit that the signals are blocked. So if one is sent to all processes, this process
    alone handles it, and ends the workers.
    """
    results: Generator[Any, None, None] = (_ for _ in [])
    try:
        with _blocked(), _quiet():
            results = parallel(tasks)
        yield results
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that tasks were not finished
            results.close()


@contextmanager
def _blocked() -> Iterator[None]:
    """Let the signals wait that end a command, where the system can do so."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


@contextmanager
def _quiet() -> Iterator[None]:
    """A process of joblib that starts here does not warn of what a killed run left and it removed.

    The warnings would follow the last line of a command, and a user need not do anything.
    """
    before = os.environ.get("PYTHONWARNINGS")
    ignored = "ignore:resource_tracker:UserWarning"
    os.environ["PYTHONWARNINGS"] = f"{before},{ignored}" if before else ignored
    try:
        yield
    finally:
        del os.environ["PYTHONWARNINGS"]
        if before is not None:
            os.environ["PYTHONWARNINGS"] = before


def _in_turn(job: Job, progress: Progress | None) -> Any:
    """Run a job in this process, and report progress while it runs."""
    done = 0

    def report(missions: int) -> None:
        nonlocal done
        done += missions
        if progress:
            progress(missions)

    result = attempt(job, report)
    if done < job.missions:
        report(job.missions - done)
    return result


def reported(job: Job, result: Any, progress: Progress | None) -> Any:
    """Report the missions of a finished job to ``progress``, and return its result."""
    if progress:
        progress(job.missions)
    return result


def _numbered(number: int, job: Job) -> tuple[int, Any]:
    return number, attempt(job)
