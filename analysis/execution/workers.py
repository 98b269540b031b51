"""Pools that run jobs: this process, joblib workers, or a dask.distributed cluster.

A job that raises an error has a ``Problem`` as its result. A worker that is killed is replaced, and
its job is run again; a job that kills its worker every time also has a ``Problem``.
"""

import os
import signal
import time
from abc import abstractmethod
from collections.abc import Generator, Iterator, Sequence
from contextlib import AbstractContextManager, closing
from dataclasses import replace
from threading import Thread
from typing import Any

from analysis.execution.jobs import Job, MissionsJob, Problem, Progress, attempt
from analysis.results.chunks import Part
from analysis.results.provenance import Member, engine_code, members_of
from dess import InputError
from dess.code.libraries import needs

Finished = Generator[tuple[int, Any], None, None]  # numbers and results of jobs
DEATHS = 2  # a job is given up after this many deaths of workers that ran only this job


class Pool(AbstractContextManager["Pool"]):
    """A pool that runs jobs, to be used in a ``with`` block."""

    @abstractmethod
    def run(self, jobs: Sequence[Job], progress: Progress | None = None) -> Finished:
        """Run the jobs; yield their numbers and results as they come in."""


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
        _compile(jobs)
        waiting = dict(enumerate(jobs))
        while waiting:
            started: set[int] = set()
            for number, result in self._finished(waiting, started):
                yield number, _reported(waiting.pop(number), result, progress)
            # A worker died, and one of the jobs that were running caused it.
            for number in sorted(started & waiting.keys()):
                yield number, _reported(waiting[number], self._alone(waiting.pop(number)), progress)

    def _alone(self, job: Job) -> Any:
        """Run a job that may have killed its worker, while no other job is running."""
        for _ in range(DEATHS):
            for _, result in self._finished({0: job}, set()):
                return result
        line = f"its worker died {DEATHS} times: killed, out of memory, or crashed"
        return Problem(line, mission=self._deadly(job))

    def _deadly(self, job: Job) -> Part | None:
        """The first mission of a job that kills its worker when it is simulated alone."""
        for single in job.alone():
            if not [*self._finished({0: single}, set())]:
                return single.chunk.parts[0]
        return None

    def _finished(self, jobs: dict[int, Job], started: set[int]) -> Iterator[tuple[int, Any]]:
        """Results by job number as they come in, until a worker dies; ``started`` is updated."""
        from joblib import Parallel, delayed
        from joblib.externals.loky.process_executor import BrokenProcessPool

        parallel = Parallel(
            self.workers,
            return_as="generator_unordered",
            batch_size=1,
            initializer=_live_and_die_with,
            initargs=(os.getpid(),),
        )

        def tasks() -> Iterator[Any]:
            for number, job in [*jobs.items()]:
                started.add(number)
                yield delayed(_numbered)(number, job)

        try:
            with closing(parallel(tasks())) as results:
                yield from results
        except BrokenProcessPool:
            return


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


def _reported(job: Job, result: Any, progress: Progress | None) -> Any:
    """Report the missions of a finished job to ``progress``, and return its result."""
    if progress and job.missions:
        progress(job.missions)
    return result


def _compile(jobs: Sequence[Job]) -> None:
    """Compile the engine once in this process, so that the workers only load it.

    A heuristic of this project is used for it, because it is unknown what other policies do.
    """
    for job in [job for job in jobs if isinstance(job, MissionsJob)][:1]:
        replace(next(job.alone()), policy="random").run()


def _numbered(number: int, job: Job) -> tuple[int, Any]:
    return number, attempt(job)


def _live_and_die_with(parent: int) -> None:
    """Ignore interrupts, which the parent process handles, and end when the parent is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(1)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


class Cluster(Pool):
    """A dask.distributed cluster, whose workers must have this code."""

    def __init__(self, address: str):
        needs("distributed", "a scheduler")
        from distributed import Client
        from distributed.comm import get_address_host_port

        try:
            get_address_host_port(
                address
            )  # check first, because a Client with a wrong address would hang when it is closed
            self.client = Client(address, timeout="10s", set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError(
                f"scheduler: {address} cannot be reached: {error}; allowed: tcp://HOST:PORT"
            ) from None

    def __exit__(self, *_: object) -> None:
        self.client.close()

    def run(self, jobs: Sequence[Job], progress: Progress | None = None) -> Finished:
        """Run the jobs; yield their numbers and results as they come in."""
        from distributed import as_completed

        code = engine_code()
        teams = {policy: members_of(policy) for policy in {job.policy for job in jobs}}
        futures = [
            self.client.submit(_checked, job, code, teams[job.policy], pure=False) for job in jobs
        ]
        numbers = {future.key: number for number, future in enumerate(futures)}
        finished = as_completed(
            futures, loop=self.client.loop, with_results=True, raise_errors=False
        )
        try:
            for future, result in finished:
                number = numbers[future.key]
                if future.status == "error":  # dask gives the exception with its type and traceback
                    result = _problem(result[1])
                yield number, _reported(jobs[number], result, progress)
                future.release()
        finally:
            self.client.cancel(futures)


def _checked(job: Job, code: str, members: list[Member]) -> Any:
    other = "code of dess" if engine_code() != code else ""
    if members_of(job.policy) != members:
        other = f"code or weights of {job.policy}"
    if other:
        raise InputError(f"scheduler: a worker has other {other}; allowed: the same as here")
    return attempt(job)


def _problem(error: Exception) -> Problem:
    """The problem of a job whose workers died, as dask reports it; other errors are raised."""
    from distributed import KilledWorker

    if isinstance(error, KilledWorker):
        return replace(
            Problem.of(error), error="its workers died: killed, out of memory, or crashed"
        )
    raise error
