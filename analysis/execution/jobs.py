"""Jobs: a part of the missions, logs or bounds of a study, simulated in one process."""

import errno
import traceback
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, ClassVar, Self

import numpy as np

from dess import InputError, simulate, simulate_batch
from dess.analysis.bound import Bound, upper_bound
from dess.analysis.results import parquet
from dess.analysis.results.chunks import Chunk
from dess.analysis.results.manifest import Cell, CellPart
from dess.analysis.results.provenance import (
    Member,
    ProcessIdentity,
    bound_code,
    identify_process,
    members_of,
)
from dess.analysis.results.store import Store
from dess.model.mission import Process
from dess.model.processes import load_processes
from dess.model.record import Records, empty_records_of
from dess.policies.registry import Policy, load_team
from dess.scenario.scenario import ScenarioSpace

# Missions of a chunk, by engine: enough to fill a batch, few enough to lose little when
# interrupted.
CHUNK = {"batch": 500, "events": 50}


def chunk_size(engine: str, team: Iterable[Policy]) -> int:
    """The number of missions of a chunk of a team; a slow policy has its own (``chunk``)."""
    return min([CHUNK[engine], *(policy.chunk for policy in team if hasattr(policy, "chunk"))])


def simulate_missions(
    engine: str,
    spaces: Sequence[ScenarioSpace],
    team: Sequence[Any],
    seed: int,
    replications: Sequence[int],
    progress: Callable[[int], object] | None = None,
    processes: Sequence[Process] = (),
) -> Records:
    """Simulate missions one after the other, or together with the batch engine.

    Args:
        engine: ``batch`` or ``events``.
        spaces: The scenario of each mission.
        team: The policies; those without a UAV in a mission are left out.
        seed: Seed of the missions.
        replications: The replication of each mission.
        progress: Called with the number of missions finished since its last call.
        processes: The processes of the user in every mission, for the engine ``events``.

    Raises:
        InputError: If the batch engine cannot simulate one of the scenarios.
    """
    if engine == "batch":
        fleet = max(space.uavs[1] for space in spaces)
        return simulate_batch(spaces, team[:fleet], seed, replications, progress=progress)
    records = empty_records_of(spaces, len(spaces))
    for row, (space, replication) in enumerate(zip(spaces, replications, strict=True)):
        acting = team[: space.uavs[1]]
        records.add(row, simulate(space, acting, seed, replication, processes=processes))
        if progress:
            progress(1)
    return records


Progress = Callable[[int], object]

# The errors of a disk without room, or with none for this user.
_FULL = {getattr(errno, name, None) for name in ("ENOSPC", "EDQUOT", "EFBIG")} - {None}


@dataclass(frozen=True)
class Job(ABC):
    """Work on the missions of a chunk: their records, their event logs or their bounds.

    Attributes:
        chunk: The chunk, which tells the missions and where the result is stored.
        spaces: The scenario of each part of the chunk.
        policy: The team of the chunk.
        seed: Seed of the missions.
        engine: ``batch`` or ``events``, for the records.
        run_files: Whether Python files of the team may be run, since a user has typed it.
        processes: The processes of the user in every mission, who has typed them.
        kind: The kind of work, as in ``contents.TABLES``.
        work: What is made in place of records, in words.
    """

    chunk: Chunk
    spaces: tuple[ScenarioSpace, ...]
    policy: str
    seed: int
    engine: str
    run_files: bool = False
    processes: tuple[str, ...] = ()
    kind: ClassVar[str]
    work: ClassVar[str] = ""

    @property
    def missions(self) -> int:
        """The number of missions."""
        return self.chunk.missions

    @property
    def each(self) -> list[tuple[ScenarioSpace, Cell, int]]:
        """The scenario, the cell and the replication of each of the missions."""
        parts = zip(self.spaces, self.chunk.parts, strict=True)
        return [(space, part.cell, r) for space, part in parts for r in part.replications]

    def alone(self) -> Iterator[Self]:
        """A job for each of the missions."""
        for space, cell, replication in self.each:
            part = CellPart(cell, range(replication, replication + 1))
            yield replace(self, chunk=replace(self.chunk, parts=(part,)), spaces=(space,))

    @abstractmethod
    def run(self, progress: Progress | None = None) -> Any:
        """Do the work; ``progress`` gets the number of missions done since its last call."""

    @abstractmethod
    def save(self, store: Store, result: Any) -> None:
        """Store the result."""

    def warm_up(self) -> None:
        """Compile what ``run`` needs; nothing by default."""
        return

    @property
    def code(self) -> list[Member | ProcessIdentity] | str:
        """The code, beside that of the engines, on which the result depends."""
        return [
            *members_of(self.policy, run_files=self.run_files),
            *map(identify_process, self.processes),
        ]


class MissionsJob(Job):
    """A job that simulates the missions of a chunk."""

    kind = "missions"

    def run(self, progress: Progress | None = None) -> Records:
        """Simulate the missions; ``progress`` gets the number of missions since its last call."""
        largest = max(space.uavs[1] for space in self.spaces)
        team = load_team(self.policy, largest, run_files=self.run_files)
        spaces, _, replications = zip(*self.each, strict=True)
        processes = load_processes(self.processes)
        return simulate_missions(
            self.engine, spaces, team, self.seed, replications, progress, processes
        )

    def save(self, store: Store, records: Records) -> None:
        """Store the records."""
        store.keep(self.kind, self.chunk, parquet.tables_of(self.chunk, records))

    def warm_up(self) -> None:
        """Compile the engine, with a heuristic, since it is unknown what other policies do.

        Most studies have greedy, so nothing is compiled that no worker needs.
        """
        replace(next(self.alone()), policy="greedy", processes=()).run()


class LogJob(Job):
    """A job that simulates one mission for its event log; another job stores its record."""

    kind, work = "events", "event logs"

    def run(self, progress: Progress | None = None) -> dict[str, np.ndarray]:
        """Simulate the mission with the SimPy engine."""
        ((space, _, replication),) = self.each
        team = load_team(self.policy, space.uavs[1], run_files=self.run_files)
        processes = load_processes(self.processes)
        about = (space, team, self.seed, replication)
        log = simulate(*about, events=True, processes=processes).events
        assert log is not None
        return log.columns()

    def save(self, store: Store, columns: dict[str, np.ndarray]) -> None:
        """Store the event log."""
        ((_, cell, replication),) = self.each
        store.keep_log(cell, replication, columns)


class BoundsJob(Job):
    """A job that computes the upper bounds of missions, which hold for every policy."""

    kind = work = "bounds"

    def run(self, progress: Progress | None = None) -> list[Bound]:
        """Compute the bounds; ``progress`` gets the number of bounds since its last call."""
        bounds = []
        for space, _, replication in self.each:
            bounds.append(upper_bound(space, self.seed, replication))
            if progress:
                progress(1)
        return bounds

    def save(self, store: Store, bounds: list[Bound]) -> None:
        """Store the bounds."""
        store.keep(self.kind, self.chunk, [parquet.table_of_bounds(self.chunk, bounds)])

    def warm_up(self) -> None:
        """Compile the bound."""
        space, _, replication = self.each[0]
        upper_bound(space, self.seed, replication, iterations=1)

    @property
    def code(self) -> str:
        """The code, beside that of the engines, on which the result depends."""
        return bound_code()


@dataclass(frozen=True)
class Problem:
    """The reason why a job has no result.

    Attributes:
        error: The error in one line.
        traceback: Where the error was raised.
        mission: The first mission of the job that also fails when it is simulated alone, if any.
    """

    error: str
    traceback: str = ""
    mission: CellPart | None = None

    @classmethod
    def of(cls, error: Exception, mission: CellPart | None = None) -> Self:
        """The problem that belongs to an exception."""
        line = " ".join(traceback.format_exception_only(error)[-1].split())
        return cls(line, "".join(traceback.format_exception(error)), mission)


def attempt_job(job: Job, progress: Progress | None = None) -> Any:
    """Run a job and return its result, or a ``Problem``.

    Raises:
        InputError: If the job cannot be run at all, for example because a policy is missing, or the
            disk has no room for compiled code.
        KeyboardInterrupt: If it is interrupted.
    """
    try:
        return job.run(progress)
    except InputError:
        raise
    except Exception as error:
        if was_interrupted(error):
            raise KeyboardInterrupt from None
        if isinstance(error, OSError) and error.errno in _FULL:
            allowed = "a disk with room for compiled code"
            raise InputError(job.policy, str(error.strerror), allowed) from None
        return Problem.of(error, first_failing(job, _must_fail))


def first_failing(job: Job, fails: Callable[[Job], bool]) -> CellPart | None:
    """The first mission of a job that also fails when it is simulated alone."""
    return next((single.chunk.parts[0] for single in job.alone() if fails(single)), None)


def _must_fail(job: Job) -> bool:
    try:
        job.run()
    except Exception:
        return True
    return False


def was_interrupted(error: BaseException | None) -> bool:
    """Whether an error was caused by Ctrl-C, which numba reports as a ``SystemError``."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False
