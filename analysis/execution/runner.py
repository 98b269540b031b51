"""Run studies: split them into jobs, and let a pool of workers run these.

The result of a job depends only on its fields, so the results of a study are the same wherever and
in whatever order the jobs are run. If a rule decides the number of missions, they are simulated in
rounds. What a round needs depends only on the missions of the rounds before.
"""

import shlex
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from analysis.execution.cluster import Cluster
from analysis.execution.effort import check_workers
from analysis.execution.engines import CHUNK
from analysis.execution.jobs import BoundsJob, Job, LogJob, MissionsJob, Problem, Progress
from analysis.execution.reuse import sources
from analysis.execution.workers import Here, Pool
from analysis.results import commands
from analysis.results.chunks import Chunk, Failure, Part, check_parts, gaps, parts_of, split
from analysis.results.manifest import Cell, Selected
from analysis.results.store import Store
from analysis.results.tables import Results, results_of
from analysis.study.cheapest import Cheapest
from analysis.study.study import Study, load_study
from dess import InputError
from policies.registry import load_team

# Bounds of a chunk: few, since each takes seconds.
BOUNDS_CHUNK = 5

Counts = list[list[int]]  # missions of every team and design point


class Round(NamedTuple):
    """A round of a study.

    Attributes:
        number: The number of the round of missions, from 0.
        missions: Number of missions, event logs and bounds needed up to this round.
        present: Number of those of this round that are already in the folder.
        work: What is made in place of missions: ``event logs``, or ``bounds`` in the last round.
    """

    number: int
    missions: int
    present: int
    work: str = ""


class ChunkError(Exception):
    """Some chunks of a study could not be computed; all others are complete.

    Attributes:
        failures: What went wrong, by the path of the file that describes it.
    """

    def __init__(self, failures: dict[Path, Failure]):
        super().__init__(f"{len(failures)} chunks failed")
        self.failures = failures


def run_study(
    study: Study | str | Path,
    out: str | Path,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    announce: Callable[[Round], object] | None = None,
    accept_code: bool = False,
    reuse: Sequence[Path] = (),
) -> Results:
    """Run a study into a results folder; missions that are already there are kept.

    Results are written as soon as they are computed. After an interruption, the same call computes
    what is missing.

    Args:
        study: The study, its name or its file.
        out: The results folder.
        workers: Number of processes.
        scheduler: Address of a ``dask.distributed`` scheduler on which to run instead.
        progress: Called with the number of missions, event logs or bounds done since its last
            call. The first call of a round counts those that are already there.
        announce: Called before each round.
        accept_code: Whether to keep missions that other code has simulated. The manifest records
            that they were accepted.
        reuse: Other results folders. Their missions are copied if they belong to the study, that
            is, if code, scenario, policy and seed are the same and the files are not damaged.

    Raises:
        InputError: If the study is not valid, the folder cannot be written, is in use or contains
            something else, or the scheduler cannot be used.
        ChunkError: If a chunk could not be computed. It is raised after all other chunks are done.
        SchedulerError: If the connection to the scheduler is lost.
    """
    if not isinstance(study, Study):
        study = load_study(study)
    check_workers(workers)
    pool = Cluster(scheduler) if scheduler else Here(workers)
    with pool, Store.open(study, out, accept_code) as store:
        _Run(study, store, pool, progress, announce, reuse).complete()
        return results_of(store)


@dataclass
class _Run:
    """A run of a study into its folder, round by round."""

    study: Study
    store: Store
    pool: Pool
    progress: Progress | None
    announce: Callable[[Round], object] | None
    reuse: Sequence[Path]
    rounds: int = 0  # so far
    asked: int = 0  # missions, event logs and bounds needed in these rounds

    def complete(self) -> None:
        """Compute what is missing, round by round.

        Raises:
            ChunkError: If a chunk could not be computed, after the other chunks of the round.
        """
        teams, points = range(len(self.study.policies)), range(len(self.study.points))
        before: Counts = [[0 for _ in points] for _ in teams]
        wanted: Counts = [[self.study.first for _ in points] for _ in teams]
        logs = self._log_jobs()
        while wanted != before:
            self._round(new_parts(self.store.manifest.cells, before, wanted), logs)
            before, logs = wanted, []
            wanted = [self._more(team, wanted[team]) for team in teams]
        selected = [self._select(team, wanted[team]) for team in teams]
        manifest = self.store.manifest.model_copy(update={"selected": selected})
        checks = [part for team in teams for part in check_parts(manifest, team)]
        if any(part.replications for part in checks):
            self._round(checks, [])
        if self.study.bounds:
            self._bounds([max(counts) for counts in zip(*wanted, strict=True)])
        self.store.finish(wanted, selected)

    def _more(self, team: int, counts: list[int]) -> list[int]:
        """How many missions the rule needs at each point of a team, given those present."""
        rule = self.study.rule
        if isinstance(rule, Cheapest):
            return rule.wanted(self._samples(team, counts), self.store.manifest.settings)
        return rule.wanted(self._samples(team, counts)) if rule else counts

    def _select(self, team: int, counts: list[int]) -> Selected:
        """What is selected for a team; None if the study selects nothing."""
        rule = self.study.selection
        if isinstance(rule, Cheapest):
            return rule.choice(self._samples(team, counts), self.store.manifest.settings).selected
        return rule.choice(self._samples(team, counts)).best if rule else None

    def _samples(self, team: int, counts: list[int]) -> list[dict[str, np.ndarray]]:
        return self.store.samples(parts_of(self.store.manifest, team, counts))

    def _round(self, parts: Sequence[Part], logs: Sequence[Job]) -> None:
        """Simulate the missing missions of a round with these parts, then make the event logs.

        Raises:
            ChunkError: If some could not be computed, after all others.
        """
        self._take_over(parts)
        jobs, present = [], 0
        for chunk in self._chunks(parts):
            missing = self.store.missing(chunk)
            present += chunk.missions - (missing.missions if missing else 0)
            if missing:
                jobs.append(self._missions_job(missing))
        self._begin(missions_in(parts), present)
        failures = self._do(jobs)
        if logs:
            self._begin(len(logs), 0, "event logs")
            failures |= self._do(logs)
        if failures:
            raise ChunkError(failures)

    def _chunks(self, parts: Sequence[Part]) -> Iterator[Chunk]:
        """The parts, in the order of their teams, as chunks of the size that suits the team."""
        for team, of_team in groupby(parts, lambda part: part.cell.team):
            policies = load_team(self.study.policies[team])
            own = (policy.chunk for policy in policies if hasattr(policy, "chunk"))
            yield from split(of_team, min([CHUNK[self.study.engine], *own]))

    def _bounds(self, counts: list[int]) -> None:
        """Compute the missing bounds of as many missions of every design point."""
        cells = self.store.manifest.bound_cells
        parts, jobs = new_parts([cells], [[0] * len(cells)], [counts]), []
        for chunk in filter(None, map(self.store.bounds.missing, split(parts, BOUNDS_CHUNK))):
            spaces = (self.study.points[part.cell.point].scenario for part in chunk.parts)
            jobs.append(BoundsJob(chunk, tuple(spaces), self.study.seed))
        missing = sum(job.missions for job in jobs)
        count = missions_in(parts)
        self._begin(count, count - missing, "bounds")
        if failures := self._do(jobs):
            raise ChunkError(failures)

    def _begin(self, count: int, present: int, work: str = "") -> None:
        """Tell that a round begins, of how many missions, and how many of them are present."""
        self.asked += count
        if self.announce:
            self.announce(Round(self.rounds, self.asked, present, work))
        self.rounds += not work
        if self.progress:
            self.progress(present)

    def _take_over(self, parts: Sequence[Part]) -> None:
        """Copy missing missions of the parts from the other folders, as far as they have them."""
        if self.reuse and any(map(self.store.missing, self._chunks(parts))):
            for source in self._sources:
                self.store.take_over(source, parts)

    @cached_property
    def _sources(self) -> list[Store]:
        return sources(self.reuse, self.store.manifest)

    def _log_jobs(self) -> list[Job]:
        """The jobs for missions whose event logs are needed and missing."""
        return [
            LogJob(
                Chunk(cell.team, (Part(cell, range(replication, replication + 1)),)),
                self.study.points[cell.point].scenario,
                self.study.policies[cell.team],
                self.study.seed,
            )
            for cells in self.store.manifest.cells
            for cell in cells
            for replication in self.store.missing_logs(cell, self.study.logged)
        ]

    def _missions_job(self, chunk: Chunk) -> MissionsJob:
        return MissionsJob(
            chunk,
            tuple(self.study.points[part.cell.point].scenario for part in chunk.parts),
            self.study.policies[chunk.team],
            self.study.seed,
            self.study.engine,
        )

    def _do(self, jobs: Sequence[Job]) -> dict[Path, Failure]:
        """Run the jobs and store their results; what could not be computed."""
        failures = {}
        with closing(self.pool.run(jobs, self.progress)) as results:
            for number, result in results:
                job = jobs[number]
                problem = result if isinstance(result, Problem) else self._save(job, result)
                if problem:
                    failure = self._failure(job, problem)
                    failures[self.store.write_failure(job.chunk, failure)] = failure
        return failures

    def _save(self, job: Job, result: Any) -> Problem | None:
        """Store the result of a job; if the store refuses it, the job has a problem."""
        try:
            job.save(self.store, result)
        except InputError:  # it cannot be written
            raise
        except ValueError as error:
            return Problem.of(error)
        return None

    def _failure(self, job: Job, problem: Problem) -> Failure:
        """The failure of a job, with a command that reproduces it by a mission or by the study."""
        command = shlex.join([*self.study.command, "--out", str(self.store.folder)])
        if (mission := problem.mission) and not isinstance(job, BoundsJob):
            which = mission.cell, mission.replications[0]
            command = commands.of_folder(self.store.folder, self.store.manifest, *which)
        return Failure(job.policy, job.missions, problem.error, command, problem.traceback)


def missions_in(parts: Sequence[Part]) -> int:
    """The number of missions in some parts."""
    return sum(len(part.replications) for part in parts)


def new_parts(all_cells: Sequence[Sequence[Cell]], before: Counts, wanted: Counts) -> list[Part]:
    """The missions that are needed in addition to earlier ones, each once, in the study's order."""
    parts: list[Part] = []
    asked: dict[tuple[int, str], list[range]] = defaultdict(list)  # points may share a cell
    for cells, begins, ends in zip(all_cells, before, wanted, strict=True):
        for cell, begin, end in zip(cells, begins, ends, strict=True):
            earlier = asked[cell.team, cell.key]
            new = gaps(range(cell.first + begin, cell.first + end), earlier)
            parts += [Part(cell, gap) for gap in new]
            earlier += new
    return parts
