"""What a study is made of, fit to be handed to a worker: chunks of missions, and event logs."""

import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, Self

import numpy as np

from analysis.results.chunks import Chunk, Part
from analysis.results.manifest import Cell
from analysis.results.store import Store
from dess import InputError, simulate, simulate_batch
from dess.record import Records, empty_records
from dess.scenario import ScenarioSpace
from policies import load_team

Progress = Callable[[int], object]


@dataclass(frozen=True)
class MissionsJob:
    """The missions of a chunk.

    Attributes:
        chunk: What they are, and where they are kept.
        spaces: The scenario of each of its parts.
        policy: Its team.
        seed: Their seed.
        engine: ``batch`` or ``events``.
    """

    chunk: Chunk
    spaces: tuple[ScenarioSpace, ...]
    policy: str
    seed: int
    engine: str

    @property
    def missions(self) -> int:
        """How many missions it has."""
        return self.chunk.missions

    def run(self, progress: Progress | None = None) -> Records:
        """Simulate the missions; ``progress`` is told how many are done since its last call."""
        team = load_team(self.policy)
        rows = [(space, r) for space, r, _ in self._missions()]
        spaces, replications = [list(column) for column in zip(*rows, strict=True)]
        if self.engine == "batch":
            return simulate_batch(spaces, team, self.seed, replications, progress=progress)
        records = empty_records(len(rows), max(space.uavs[1] for space in self.spaces))
        for row, (space, replication) in enumerate(rows):
            record = simulate(space, team, self.seed, replication)
            records.missions[row] = record.metrics
            records.uavs[row, : len(record.uavs)] = record.uavs
            if progress:
                progress(1)
        return records

    def alone(self) -> Iterator["MissionsJob"]:
        """Its missions, one by one."""
        for space, replication, cell in self._missions():
            part = Part(cell, range(replication, replication + 1))
            yield replace(self, chunk=replace(self.chunk, parts=(part,)), spaces=(space,))

    def _missions(self) -> Iterator[tuple[ScenarioSpace, int, Cell]]:
        for space, part in zip(self.spaces, self.chunk.parts, strict=True):
            for replication in part.replications:
                yield space, replication, part.cell

    def save(self, store: Store, records: Records) -> None:
        """Keep the records."""
        store.write(self.chunk, records)


@dataclass(frozen=True)
class LogJob:
    """One mission, for its event log.

    Attributes:
        chunk: The mission; its record comes with another job.
        space: Its scenario.
        policy: Its team.
        seed: Its seed.
    """

    chunk: Chunk
    space: ScenarioSpace
    policy: str
    seed: int
    missions = 0

    @property
    def mission(self) -> Part:
        """The only part of its chunk."""
        return self.chunk.parts[0]

    def run(self, progress: Progress | None = None) -> dict[str, np.ndarray]:
        """Simulate the mission with the SimPy engine."""
        team, replication = load_team(self.policy), self.mission.replications[0]
        log = simulate(self.space, team, self.seed, replication, events=True).events
        assert log is not None
        return log.columns()

    def alone(self) -> Iterator["LogJob"]:
        """Itself."""
        yield self

    def save(self, store: Store, columns: dict[str, np.ndarray]) -> None:
        """Keep the event log."""
        store.write_log(self.mission.cell, self.mission.replications[0], columns)


Job = MissionsJob | LogJob


@dataclass(frozen=True)
class Problem:
    """Why a job has no result.

    Attributes:
        error: In a line.
        traceback: Where it was raised.
        mission: The first of its missions that fails alone, if one does.
    """

    error: str
    traceback: str = ""
    mission: Part | None = None

    @classmethod
    def of(cls, error: Exception, mission: Part | None = None) -> Self:
        """What was raised."""
        line = " ".join(traceback.format_exception_only(error)[-1].split())
        return cls(line, "".join(traceback.format_exception(error)), mission)


def attempt(job: Job, progress: Progress | None = None) -> Any:
    """Do a job: what comes of it, or its ``Problem``.

    Raises:
        InputError: If it cannot be done at all, such as for want of its policy.
        KeyboardInterrupt: If it is interrupted.
    """
    try:
        return job.run(progress)
    except InputError:
        raise
    except Exception as error:
        if was_interrupted(error):
            raise KeyboardInterrupt from None
        return Problem.of(error, _culprit(job))


def was_interrupted(error: BaseException | None) -> bool:
    """Whether an error comes of Ctrl-C: in compiled code, numba makes it a ``SystemError``."""
    while error is not None:
        if isinstance(error, KeyboardInterrupt):
            return True
        error = error.__cause__ or error.__context__
    return False


def _culprit(job: Job) -> Part | None:
    """The first mission of a job that fails alone."""
    for single in job.alone():
        try:
            single.run()
        except Exception:
            return single.chunk.parts[0]
    return None
