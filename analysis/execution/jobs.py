"""Jobs: units of work that are sent to workers: chunks of missions or of bounds, event logs."""

import errno
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from analysis.bound import Bound, upper_bound
from analysis.execution.engines import simulate_missions
from analysis.results.chunks import Chunk, Part
from analysis.results.manifest import Cell
from analysis.results.provenance import Member, bound_code, members_of
from analysis.results.store import Store
from dess import InputError, simulate
from dess.record import Records
from dess.scenario import ScenarioSpace
from policies.registry import load_team

Progress = Callable[[int], object]

# The errors of a disk without room, or with none for this user.
_FULL = {getattr(errno, name, None) for name in ("ENOSPC", "EDQUOT", "EFBIG")} - {None}


@dataclass(frozen=True)
class MissionsJob:
    """A job that simulates the missions of a chunk.

    Attributes:
        chunk: The chunk, which tells the missions and where they are stored.
        spaces: The scenario of each part of the chunk.
        policy: The team of the chunk.
        seed: Seed of the missions.
        engine: ``batch`` or ``events``.
    """

    chunk: Chunk
    spaces: tuple[ScenarioSpace, ...]
    policy: str
    seed: int
    engine: str

    @property
    def missions(self) -> int:
        """The number of missions."""
        return self.chunk.missions

    def run(self, progress: Progress | None = None) -> Records:
        """Simulate the missions; ``progress`` gets the number of missions since its last call."""
        team = load_team(self.policy, max(space.uavs[1] for space in self.spaces))
        rows = [(space, r) for space, r, _ in self._missions()]
        spaces, replications = [list(column) for column in zip(*rows, strict=True)]
        return simulate_missions(self.engine, spaces, team, self.seed, replications, progress)

    def alone(self) -> Iterator["MissionsJob"]:
        """A job for each of the missions."""
        for space, replication, cell in self._missions():
            part = Part(cell, range(replication, replication + 1))
            yield replace(self, chunk=replace(self.chunk, parts=(part,)), spaces=(space,))

    def _missions(self) -> Iterator[tuple[ScenarioSpace, int, Cell]]:
        for space, part in zip(self.spaces, self.chunk.parts, strict=True):
            for replication in part.replications:
                yield space, replication, part.cell

    def save(self, store: Store, records: Records) -> None:
        """Store the records."""
        store.write(self.chunk, records)

    def warm_up(self) -> None:
        """Compile the engine, with a heuristic, since it is unknown what other policies do."""
        replace(next(self.alone()), policy="random").run()

    @property
    def code(self) -> list[Member]:
        """The code, beside that of the engines, on which the result depends."""
        return members_of(self.policy)


@dataclass(frozen=True)
class LogJob:
    """A job that simulates one mission for its event log.

    Attributes:
        chunk: The mission; another job stores its record.
        space: The scenario of the mission.
        policy: The team.
        seed: The seed.
    """

    chunk: Chunk
    space: ScenarioSpace
    policy: str
    seed: int
    missions = 1

    @property
    def mission(self) -> Part:
        """The only part of the chunk."""
        return self.chunk.parts[0]

    def run(self, progress: Progress | None = None) -> dict[str, np.ndarray]:
        """Simulate the mission with the SimPy engine."""
        team = load_team(self.policy, self.space.uavs[1])
        replication = self.mission.replications[0]
        log = simulate(self.space, team, self.seed, replication, events=True).events
        assert log is not None
        return log.columns()

    def alone(self) -> Iterator["LogJob"]:
        """The job itself, since it has one mission."""
        yield self

    def save(self, store: Store, columns: dict[str, np.ndarray]) -> None:
        """Store the event log."""
        store.write_log(self.mission.cell, self.mission.replications[0], columns)

    def warm_up(self) -> None:
        """Do nothing, since the log of a single mission is soon made."""

    @property
    def code(self) -> list[Member]:
        """The code, beside that of the engines, on which the result depends."""
        return members_of(self.policy)


@dataclass(frozen=True)
class BoundsJob:
    """A job that computes the upper bounds of missions, which hold for every policy.

    Attributes:
        chunk: The missions.
        spaces: The scenario of each part of the chunk.
        seed: Seed of the missions.
    """

    chunk: Chunk
    spaces: tuple[ScenarioSpace, ...]
    seed: int
    policy = "the upper bound"

    @property
    def missions(self) -> int:
        """The number of missions."""
        return self.chunk.missions

    def run(self, progress: Progress | None = None) -> list[Bound]:
        """Compute the bounds; ``progress`` gets the number of bounds since its last call."""
        bounds = []
        for space, part in zip(self.spaces, self.chunk.parts, strict=True):
            for replication in part.replications:
                bounds.append(upper_bound(space, self.seed, replication))
                if progress:
                    progress(1)
        return bounds

    def alone(self) -> Iterator["BoundsJob"]:
        """A job for each of the missions."""
        for space, part in zip(self.spaces, self.chunk.parts, strict=True):
            for number in part.replications:
                alone = Part(part.cell, range(number, number + 1))
                yield BoundsJob(Chunk(self.chunk.team, (alone,)), (space,), self.seed)

    def save(self, store: Store, bounds: list[Bound]) -> None:
        """Store the bounds."""
        store.bounds.write(self.chunk, bounds)

    def warm_up(self) -> None:
        """Compile the bound."""
        upper_bound(self.spaces[0], self.seed, self.chunk.parts[0].replications[0], iterations=1)

    @property
    def code(self) -> str:
        """The code, beside that of the engines, on which the result depends."""
        return bound_code()


Job = MissionsJob | LogJob | BoundsJob


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
    mission: Part | None = None

    @classmethod
    def of(cls, error: Exception, mission: Part | None = None) -> Self:
        """The problem that belongs to an exception."""
        line = " ".join(traceback.format_exception_only(error)[-1].split())
        return cls(line, "".join(traceback.format_exception(error)), mission)


def attempt(job: Job, progress: Progress | None = None) -> Any:
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
            line = f"{job.policy}: {error.strerror}; allowed: a disk with room for compiled code"
            raise InputError(line) from None
        return Problem.of(error, _culprit(job))


def was_interrupted(error: BaseException | None) -> bool:
    """Whether an error was caused by Ctrl-C, which numba reports as a ``SystemError``."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _culprit(job: Job) -> Part | None:
    """The first mission of a job that fails when it is simulated alone."""
    for single in job.alone():
        try:
            single.run()
        except Exception:
            return single.chunk.parts[0]
    return None
