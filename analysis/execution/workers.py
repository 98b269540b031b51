"""Pools that run jobs: the base class, pools on this machine, and one on a dask cluster.

A job that raises an error has a ``Problem`` as its result. A worker that is killed is replaced, and
its job is run again; a job that kills its worker every time also has a ``Problem``. What the
libraries of a cluster log or warn of is not shown: what matters to a user is an error or a note of
this module.
"""

import asyncio
import logging
import os
import signal
import warnings
from abc import abstractmethod
from collections.abc import Generator, Iterator, Mapping, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from contextlib import AbstractContextManager, ExitStack, contextmanager, suppress
from queue import Empty, SimpleQueue
from typing import Any

from dess import InputError
from dess.analysis.execution import live_and_die_with, set_variable
from dess.analysis.execution.jobs import Job, Problem, Progress, attempt_job, first_failing
from dess.analysis.results.provenance import Member, engine_code
from dess.base.libraries import needs

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
                yield number, report_job(waiting.pop(number), result, progress)
            # Workers died, and one of these jobs caused it.
            for number in sorted(suspects & waiting.keys()):
                yield (
                    number,
                    report_job(waiting[number], self._alone(waiting.pop(number)), progress),
                )

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
                yield delayed(_numbered_result)(number, job)

        try:
            with _results_of_tasks(parallel, tasks()) as results:
                # An expression in between, since "yield from" would close the results themselves.
                yield from (result for result in results)
        except BrokenProcessPool:
            return


@contextmanager
def _results_of_tasks(parallel: Any, tasks: Iterator[Any]) -> Iterator[Iterator[Any]]:
    """The results of tasks as joblib workers finish them; no task is left at the end.

    Workers inherit that the signals are blocked. So if one is sent to all processes, this process
    alone handles it, and ends the workers.
    """
    results: Generator[Any, None, None] = (_ for _ in [])
    try:
        with _blocked_signals(), _quiet_joblib():
            results = parallel(tasks)
        yield results
    finally:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # that tasks were not finished
            results.close()


@contextmanager
def _blocked_signals() -> Iterator[None]:
    """Let the signals wait that end a command, where the system can do so."""
    if not hasattr(signal, "pthread_sigmask"):
        yield
        return
    mask = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT, signal.SIGTERM, signal.SIGHUP})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, mask)


def _quiet_joblib() -> AbstractContextManager[None]:
    """A process of joblib that starts here does not warn of what a killed run left and it removed.

    The warnings would follow the last line of a command, and a user need not do anything.
    """
    ignored = os.environ.get("PYTHONWARNINGS"), "ignore:resource_tracker:UserWarning"
    return set_variable("PYTHONWARNINGS", ",".join(filter(None, ignored)))


def _in_turn(job: Job, progress: Progress | None) -> Any:
    """Run a job in this process, and report progress while it runs."""
    done = 0

    def report(missions: int) -> None:
        nonlocal done
        done += missions
        if progress:
            progress(missions)

    result = attempt_job(job, report)
    if done < job.missions:
        report(job.missions - done)
    return result


def report_job(job: Job, result: Any, progress: Progress | None) -> Any:
    """Report the missions of a finished job to ``progress``, and return its result."""
    if progress:
        progress(job.missions)
    return result


def _numbered_result(number: int, job: Job) -> tuple[int, Any]:
    return number, attempt_job(job)


log = logging.getLogger(__name__)

ADDRESS = "tls://HOST:PORT or tcp://HOST:PORT of a scheduler"
ANSWER = 10.0  # seconds in which a scheduler must answer
LOOK = 5.0  # seconds without a result after which to look whether there are workers
GOODBYE = 3.0  # seconds to take leave of a scheduler
GONE = (OSError, asyncio.CancelledError, CancelledError)  # raised where a scheduler is gone
NOISY = ("distributed", "tornado", "asyncio")  # libraries that log what goes wrong


class SchedulerError(ConnectionError):
    """The scheduler of a cluster is gone; what had been computed before is complete."""


class Cluster(Pool):
    """A dask.distributed cluster, whose workers must have this code.

    It runs a job several times by itself before it reports that the workers of the job have died.
    """

    attempts = 1

    def __init__(self, address: str):
        """Name the cluster.

        Args:
            address: The address of its scheduler.

        Raises:
            InputError: If ``distributed`` is not installed.
        """
        needs("distributed", "a scheduler")
        self.address = address

    def __enter__(self) -> "Cluster":
        """Connect to the scheduler.

        Raises:
            InputError: If there is no scheduler at the address.
        """
        from distributed import Client

        with ExitStack() as stack:
            stack.enter_context(_silence_libraries())
            try:
                self._greet()
                self.client = Client(self.address, timeout=ANSWER, set_as_default=False)
            except InputError:
                raise
            except Exception as error:  # of many types, by what is at the address
                reason = str(error) or f"no scheduler answers within {ANSWER:.0f} s"
                raise self._refusal(f"cannot be reached: {reason}") from None
            stack.callback(self._leave)
            self._exits = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._exits.close()

    def _finished(self, jobs: Mapping[int, Job], suspects: set[int]) -> Iterator[tuple[int, Any]]:
        """Results by job number as they come in; ``suspects`` gets the jobs whose workers died.

        Raises:
            InputError: If a worker cannot run the jobs.
            SchedulerError: If the connection to the scheduler is lost.
        """
        done: SimpleQueue[Any] = SimpleQueue()
        code = engine_code()
        codes = {policy: job.code for policy, job in {j.policy: j for j in jobs.values()}.items()}
        futures = []
        try:
            for job in jobs.values():
                code_here = codes[job.policy]
                futures.append(self.client.submit(_check_and_run, job, code, code_here, pure=False))
                futures[-1].add_done_callback(done.put)
            numbers = {future.key: number for future, number in zip(futures, jobs, strict=True)}
            for _ in futures:
                future = self._next(done)
                if (result := self._result(future)) is None:
                    suspects.add(numbers[future.key])
                else:
                    yield numbers[future.key], result
                future.release()
        except InputError:
            raise
        except (Exception, asyncio.CancelledError) as error:
            if isinstance(error, GONE) or self.client.status != "running":
                line = f"scheduler: the connection to {self.address} is lost"
                raise SchedulerError(line) from None
            raise
        finally:
            with suppress(Exception):  # the scheduler may be gone
                self.client.cancel(futures)

    def _next(self, done: "SimpleQueue[Any]") -> Any:
        """The next future that is done; a line says so once if there are no workers to wait for."""
        is_told = False
        while True:
            try:
                return done.get(timeout=LOOK)
            except Empty:
                if not is_told and not self.client.nthreads():
                    log.warning("note: %s has no workers; waiting for them", self.address)
                    is_told = True

    def _result(self, future: Any) -> Any:
        """The result of a future that is done; None if the workers of its job have died."""
        from distributed import KilledWorker

        if future.status == "error":
            error = future.exception()
            if isinstance(error, KilledWorker):
                return None
            if isinstance(error, InputError):
                raise error
            reason = f"a worker cannot run jobs: {type(error).__name__}: {error}"
            raise self._refusal(reason, "workers with the same libraries")
        return future.result()

    def _refusal(self, problem: str, allowed: str = ADDRESS) -> InputError:
        return InputError(f"scheduler: {self.address}", problem, allowed)

    def _greet(self) -> None:
        """Ask the scheduler who it is: a client would wait for an answer for ever.

        Raises:
            InputError: If it is something else.
        """
        if self.address.startswith("tls://") and not _connection().get("ssl_context"):
            allowed = "a configuration of dask with certificates, see docs/how-to/distributed.md"
            raise self._refusal("no certificates are configured for it", allowed)
        with ThreadPoolExecutor(1) as thread:  # this one may have an event loop, as in a notebook
            kind = thread.submit(asyncio.run, _kind(self.address)).result()
        if kind != "Scheduler":
            raise self._refusal(f"is a {kind}")

    def _leave(self) -> None:
        with suppress(Exception):  # the scheduler may be gone
            self.client.close(timeout=GOODBYE)


def pool_of(workers: int, scheduler: str | None) -> Pool:
    """The cluster of a scheduler, or without one as many workers on this machine."""
    if scheduler:
        return Cluster(scheduler)
    return Here(workers)


def _connection() -> dict[str, Any]:
    """How a client connects, by the configuration of dask: with TLS if there are certificates."""
    from distributed.security import Security

    connection: dict[str, Any] = Security().get_connection_args("client")
    return connection


async def _kind(address: str) -> str:
    """What kind of server of dask answers at an address."""
    from distributed import rpc

    async with rpc(address, timeout=ANSWER, connection_args=_connection()) as server:
        identity = await asyncio.wait_for(server.identity(), ANSWER)
    return str(identity["type"])


@contextmanager
def _silence_libraries() -> Iterator[None]:
    """Let the libraries of the cluster log and warn of nothing."""
    names = [name for name in logging.root.manager.loggerDict if name.split(".")[0] in NOISY]
    loggers = [logging.getLogger(name) for name in {*names, *NOISY}]
    levels = [logger.level for logger in loggers]
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", module="distributed")
        for logger in loggers:
            logger.setLevel(logging.CRITICAL + 1)
        try:
            yield
        finally:
            for logger, level in zip(loggers, levels, strict=True):
                logger.setLevel(level)


def _check_and_run(job: Job, code: str, own: list[Member] | str) -> Any:
    other = ""
    if engine_code() != code:
        other = "code of dess"
    if job.code != own:
        other = f"code or weights of {job.policy}"
    if other:
        raise InputError("scheduler", f"a worker has other {other}", "the same as here")
    return attempt_job(job)
