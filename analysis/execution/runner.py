"""Run studies: split them into jobs, and let a pool of workers run these.

The result of a job depends only on its fields, so the results of a study are the same wherever and
in whatever order the jobs are run. If a rule decides the number of missions, they are simulated in
rounds. What a round needs depends only on the missions of the rounds before.
"""

from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cached_property
from itertools import groupby
from pathlib import Path
from typing import NamedTuple

from dess.analysis.execution.effort import check_workers
from dess.analysis.execution.jobs import (
    CHUNK,
    BoundsJob,
    Job,
    LogJob,
    MissionsJob,
    Problem,
    Progress,
)
from dess.analysis.execution.workers import Cluster, Here, Pool
from dess.analysis.results import chunks, tables
from dess.analysis.results.manifest import CellPart, Selected
from dess.analysis.results.replications import Present, gaps_between
from dess.analysis.results.store import Failure, Store, source_folders
from dess.analysis.results.tables import Results, results_of
from dess.analysis.study.cheapest import Setting
from dess.analysis.study.stopping import Samples
from dess.analysis.study.study import Study, load_study
from dess.base.files.writing import check_folder
from dess.policies.registry import load_team

# Bounds of a chunk: few, since each takes seconds.
BOUNDS_CHUNK = 5


class Round(NamedTuple):
    """A round of a study.

    Attributes:
        number: The number of the round of missions, from 0.
        missions: Number of missions, event logs and bounds needed up to this round.
        present: Number of those of this round that are already in the folder.
        work: What is made in place of missions: ``event logs``, or ``bounds`` in the last round.
        may_need_more: Whether a rule may ask for more missions after this round.
    """

    number: int
    missions: int
    present: int
    work: str = ""
    may_need_more: bool = False


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
    pool: Pool = Cluster(scheduler) if scheduler else Here(workers)
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
        manifest = self.store.manifest
        teams = range(len(self.study.policies))
        points = len(self.study.points)
        before = [[0] * points for _ in teams]
        counts = [[self.study.first] * points for _ in teams]
        logs = [manifest.parts_of_team(team, [self.study.logged] * points) for team in teams]
        asked: Present = defaultdict(list)
        while counts != before:
            of_teams = (manifest.parts_of_team(team, counts[team]) for team in teams)
            parts = new_parts(of_teams, asked)
            self._round(parts, new_parts(logs, defaultdict(list)))
            before = counts
            logs = []
            counts = [self._more(team, counts[team]) for team in teams]
        selected = [self._select(team, counts[team]) for team in teams]
        chosen = manifest.model_copy(update={"selected": selected})
        checks = [chosen.parts_of_check(team) for team in teams]
        self._round([part for of_team in checks for part in of_team])
        if self.study.rule and not manifest.accepted:  # files of other code may have other columns
            for team in teams:
                all_of_team = manifest.parts_of_team(team, counts[team]), checks[team]
                parts = new_parts(all_of_team, defaultdict(list))
                self.store.merge([*chunks.split_into_chunks(parts, CHUNK[self.study.engine])])
        self._make((BoundsJob, new_parts([manifest.parts_with_bounds(counts)], asked)))
        self.store.finish(counts, selected)

    def _more(self, team: int, counts: list[int]) -> list[int]:
        """How many missions the rule needs at each point of a team, given those present."""
        rule = self.study.rule
        if rule:
            return rule.wanted(*self._samples(team, counts))
        return counts

    def _select(self, team: int, counts: list[int]) -> Selected:
        """What is selected for a team; None if the study selects nothing."""
        rule = self.study.selection
        if rule:
            return rule.choice(*self._samples(team, counts)).selected
        return None

    def _samples(self, team: int, counts: list[int]) -> tuple[Samples, Sequence[Setting]]:
        """The missions and the settings of all design points, by which a rule decides."""
        manifest = self.store.manifest
        return self.store.samples(manifest.parts_of_team(team, counts)), manifest.settings

    def _round(self, parts: Sequence[CellPart], logs: Sequence[CellPart] = ()) -> None:
        """Simulate the missing missions of a round with these parts, then make the event logs."""
        if self.reuse and self.store.missing("missions", parts):
            for source in self._sources:
                self.store.take_over(source, parts)
        self._make((MissionsJob, parts), (LogJob, logs))

    @cached_property
    def _sources(self) -> list[Store]:
        return source_folders(self.reuse, self.store.manifest)

    def _make(self, *works: tuple[type[Job], Sequence[CellPart]]) -> None:
        """One kind of work after the other: find what is missing of its parts, run and store it.

        Raises:
            ChunkError: If some could not be computed, after all others.
        """
        failures: dict[Path, Failure] = {}
        needs = [(kind, sum(map(len, parts)), [*self._jobs(kind, parts)]) for kind, parts in works]
        if any(jobs for _, _, jobs in needs):
            check_folder(self.store.folder)
        self.store.check_files(job.chunk for _, _, jobs in needs for job in jobs)
        for kind, needed, jobs in needs:
            if needed:
                self._begin(needed, needed - sum(job.missions for job in jobs), kind.work)
                failures |= self._do(jobs)
        if failures:
            raise ChunkError(failures)

    def _jobs(self, kind: type[Job], parts: Sequence[CellPart]) -> Iterator[Job]:
        """The jobs for what is missing of some parts, cut as if nothing were present."""
        study = self.study
        for team, of_team in groupby(parts, lambda part: part.cell.team):
            if kind is BoundsJob:
                policy = "the upper bound"
            else:
                policy = study.policies[team]
            for chunk in chunks.split_into_chunks(of_team, self._size(kind, policy)):
                if missing := tuple(self.store.missing(kind.kind, chunk.parts)):
                    spaces = tuple(study.scenarios[part.cell.point] for part in missing)
                    kept = chunks.Chunk(team, missing)
                    typed = (study.run_files, study.processes)
                    yield kind(kept, spaces, policy, study.seed, study.engine, *typed)

    def _size(self, kind: type[Job], policy: str) -> int:
        """The number of missions of a chunk."""
        if kind is not MissionsJob:
            return BOUNDS_CHUNK if kind is BoundsJob else 1
        team = load_team(policy, run_files=self.study.run_files)
        chunks_of_members = (member.chunk for member in team if hasattr(member, "chunk"))
        return min([CHUNK[self.study.engine], *chunks_of_members])

    def _begin(self, count: int, present: int, work: str = "") -> None:
        """Tell that a round begins, of how many missions, and how many of them are present."""
        self.asked += count
        if self.announce:
            may_need_more = self.study.rule is not None
            self.announce(Round(self.rounds, self.asked, present, work, may_need_more))
        self.rounds += not work
        if self.progress:
            self.progress(present)

    def _do(self, jobs: Sequence[Job]) -> dict[Path, Failure]:
        """Run the jobs and store their results; what could not be computed."""
        failures = {}
        with closing(self.pool.run(jobs, self.progress)) as results:
            for number, result in results:
                job = jobs[number]
                if isinstance(result, Problem):
                    failure = self._failure(job, result)
                    failures[self.store.write_failure(job.chunk, failure)] = failure
                else:
                    job.save(self.store, result)
        return failures

    def _failure(self, job: Job, problem: Problem) -> Failure:
        """The failure of a job, with a command that reproduces it by a mission or by the study."""
        command = self.study.command(self.store.folder)
        if (mission := problem.mission) and not isinstance(job, BoundsJob):
            which = mission.cell, mission.replications[0]
            command = tables.of_folder(self.store.folder, self.store.manifest, *which)
        return Failure(job.policy, job.missions, problem.error, command, problem.traceback)


def new_parts(wanted: Iterable[Iterable[CellPart]], asked: Present) -> list[CellPart]:
    """The missions that are needed in addition to those asked for before, each once, in order.

    Args:
        wanted: For each team, the parts that it needs.
        asked: The missions asked for before; points may share a cell. The new ones are added.
    """
    parts = []
    for part in (part for of_team in wanted for part in of_team):
        earlier = asked[part.cell.key]
        new = gaps_between(part.replications, earlier)
        parts += [CellPart(part.cell, gap) for gap in new]
        earlier += new
    return parts
