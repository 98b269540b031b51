"""Runs studies: splits them into jobs and runs these here, in joblib workers or on a dask cluster.

A job depends on nothing but its fields, so the result is the same wherever and in whatever order
the jobs are run.
"""

import signal
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from analysis.manifest import Cell, fingerprint
from analysis.store import Results, Store, load_results
from analysis.study import Study, load_study
from dess import simulate, simulate_batch
from dess.errors import InputError
from dess.record import Records, empty_records
from dess.scenario import ScenarioSpace
from policies import load_team

# Missions of a chunk, by engine: enough to fill the batch, few enough to lose little.
CHUNK = {"batch": 250, "events": 50}

Progress = Callable[[int], object]


@dataclass(frozen=True)
class Chunk:
    """Consecutive replications of a team on a scenario."""

    scenario: ScenarioSpace
    team: str
    seed: int
    engine: str
    part: range

    def run(self, progress: Progress | None = None) -> Records:
        """Simulate the missions; ``progress`` is told how many are done since its last call."""
        team = load_team(self.team)
        if self.engine == "batch":
            return simulate_batch(self.scenario, team, self.seed, self.part, progress=progress)
        records = empty_records(len(self.part), self.scenario.uavs[1])
        for row, replication in enumerate(self.part):
            record = simulate(self.scenario, team, self.seed, replication)
            records.missions[row] = record.metrics
            records.uavs[row, : len(record.uavs)] = record.uavs
            if progress:
                progress(1)
        return records

    def save(self, store: Store, cell: Cell, records: Records) -> None:
        """Keep the records."""
        store.write(cell, self.part, records)


@dataclass(frozen=True)
class Log:
    """One mission, for its event log."""

    scenario: ScenarioSpace
    team: str
    seed: int
    replication: int
    part = range(0)  # its record comes with a chunk

    def run(self, progress: Progress | None = None) -> dict[str, np.ndarray]:
        """Simulate the mission with the SimPy engine."""
        team = load_team(self.team)
        log = simulate(self.scenario, team, self.seed, self.replication, events=True).events
        assert log is not None
        return log.columns()

    def save(self, store: Store, cell: Cell, columns: dict[str, np.ndarray]) -> None:
        """Keep the event log."""
        store.write_log(cell, self.replication, columns)


Job = Chunk | Log


def run_study(
    study: Study | str | Path,
    out: str | Path,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
) -> Results:
    """Run a study into a results folder; what is there already is kept.

    Results are written as they come in, so after an interruption the same call completes them.

    Args:
        study: The study, its name or its file.
        out: The results folder.
        workers: Processes.
        scheduler: Address of a ``dask.distributed`` scheduler to run on instead.
        progress: Called with the number of missions done since its last call, first with those
            that are there already.

    Raises:
        InputError: If the study is not valid, the folder cannot be written or holds something else,
            or the scheduler cannot be used.
    """
    if not isinstance(study, Study):
        study = load_study(study)
    check_workers(workers)
    with _Cluster(scheduler) if scheduler else nullcontext(_Here(workers)) as pool:
        store = Store.open(study, out)
        todo = _jobs(study, store)
        jobs = [job for _, job in todo]
        if progress:
            whole = study.missions * len(store.manifest.cells)
            progress(whole - sum(len(job.part) for job in jobs))
        for number, result in pool.run(jobs, progress):
            cell, job = todo[number]
            job.save(store, cell, result)
    return load_results(out)


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is none.

    Raises:
        InputError: If it is below 1.
    """
    if workers < 1:
        raise InputError(f"workers: {workers} is out of range; allowed: 1 or more")


def _jobs(study: Study, store: Store) -> list[tuple[Cell, Job]]:
    """What is missing in the folder, with the cells that it belongs to."""
    todo: list[tuple[Cell, Job]] = []
    for number, point, cell in store.manifest.cells:
        scenario, team = study.points[point].scenario, study.policies[number]
        for replication in store.missing_logs(cell, study.logged):
            todo.append((cell, Log(scenario, team, study.seed, replication)))
        for part in store.missing(cell, study.missions, CHUNK[study.engine]):
            todo.append((cell, Chunk(scenario, team, study.seed, study.engine, part)))
    return todo


@dataclass(frozen=True)
class Evaluation:
    """Many missions of one team.

    Attributes:
        policy: The team.
        records: What the missions left.
        seconds: Time of their simulation alone, compilation and start of workers apart [s].
    """

    policy: str
    records: Records
    seconds: float

    @property
    def uav_slots(self) -> int:
        """Mission slots flown or charged, summed over the UAVs of all missions."""
        return int(self.records.missions["uav_slots"].sum())


def evaluate(
    scenario: ScenarioSpace,
    team: str,
    missions: int = 1000,
    seed: int = 0,
    engine: str = "batch",
    workers: int = 1,
    progress: Progress | None = None,
    clock: Callable[[], float] = time.perf_counter,
) -> Evaluation:
    """Simulate replications 0, 1, ... of a team, and time it.

    Args:
        scenario: The scenario space that the missions are drawn from.
        team: ``"P"`` or ``"P,P,..."``.
        missions: How many.
        seed: Their seed.
        engine: ``batch`` or ``events``.
        workers: Threads of the batch engine, processes of the event engine.
        progress: Called with the number of missions done since its last call.
        clock: Tells the time [s].

    Raises:
        InputError: If a policy is unknown or a number out of range.
    """
    check_workers(workers)
    policies = load_team(team)
    if engine == "batch":
        simulate_batch(scenario, policies, seed, 1)  # compiles
        begin = clock()
        records = simulate_batch(
            scenario, policies, seed, missions, workers=workers, progress=progress
        )
        return Evaluation(team, records, clock() - begin)
    starts = range(0, missions, CHUNK[engine])
    parts = [range(first, min(first + CHUNK[engine], missions)) for first in starts]
    jobs = [Chunk(scenario, team, seed, engine, part) for part in parts]
    pool, warm_up = _Here(workers), Chunk(scenario, team, seed, engine, range(1))
    dict(pool.run([warm_up] * (1 if workers == 1 else 2 * workers)))
    begin = clock()
    done = dict(pool.run(jobs, progress))
    seconds = clock() - begin
    chunks = [done[number] for number in range(len(jobs))]
    records = Records(*(np.concatenate(kind) for kind in zip(*chunks, strict=True)))
    return Evaluation(team, records, seconds)


class _Here:
    """This machine: this process, or joblib workers."""

    def __init__(self, workers: int):
        self.workers = workers

    def run(
        self, jobs: Sequence[Job], progress: Progress | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Run the jobs; their numbers and results as they come in."""
        if self.workers == 1 or not jobs:
            for number, job in enumerate(jobs):
                yield number, job.run(progress)
        else:
            _compile(jobs)
            yield from self._run_in_workers(jobs, progress)

    def _run_in_workers(
        self, jobs: Sequence[Job], progress: Progress | None
    ) -> Iterator[tuple[int, Any]]:
        from joblib import Parallel, delayed

        parallel = Parallel(
            self.workers,
            return_as="generator_unordered",
            batch_size=1,
            initializer=_leave_interrupts_to_the_parent,
        )
        tasks = (delayed(_numbered)(number, job) for number, job in enumerate(jobs))
        with closing(parallel(tasks)) as results:
            for number, result in results:
                if progress:
                    progress(len(jobs[number].part))
                yield number, result


def _compile(jobs: Sequence[Job]) -> None:
    """Compile what the jobs need, once, so that the workers only load it."""
    for job in {job.team: job for job in jobs if isinstance(job, Chunk)}.values():
        replace(job, part=range(1)).run()


def _numbered(number: int, job: Job) -> tuple[int, Any]:
    return number, job.run()


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


class _Cluster:
    """A dask.distributed cluster, whose workers must have this code."""

    def __init__(self, address: str):
        try:
            from distributed import Client
            from distributed.comm import get_address_host_port
        except ModuleNotFoundError:
            raise InputError(
                "scheduler: needs the package distributed: pip install dess[distributed]"
            ) from None
        try:
            get_address_host_port(address)  # a Client that fails on it would hang when it is closed
            self.client = Client(address, timeout="10s", set_as_default=False)
        except (OSError, ValueError) as error:
            raise InputError(
                f"scheduler: {address} cannot be reached: {error}; allowed: tcp://HOST:PORT"
            ) from None

    def __enter__(self) -> "_Cluster":
        return self

    def __exit__(self, *_: object) -> None:
        self.client.close()

    def run(
        self, jobs: Sequence[Job], progress: Progress | None = None
    ) -> Iterator[tuple[int, Any]]:
        """Run the jobs; their numbers and results as they come in."""
        from distributed import as_completed

        code = fingerprint("dess")
        futures = [self.client.submit(_checked, job, code, pure=False) for job in jobs]
        numbers = {future.key: number for number, future in enumerate(futures)}
        try:
            for future, result in as_completed(futures, loop=self.client.loop, with_results=True):
                number = numbers[future.key]
                if progress:
                    progress(len(jobs[number].part))
                yield number, result
                future.release()
        finally:
            self.client.cancel(futures)


def _checked(job: Job, code: str) -> Any:
    if fingerprint("dess") != code:
        raise InputError("scheduler: a worker has other code of dess; allowed: the same version")
    return job.run()
