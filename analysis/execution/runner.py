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
from itertools import count, groupby
from pathlib import Path
from typing import NamedTuple

from dess import InputError
from dess.analysis.execution.effort import check_workers
from dess.analysis.execution.jobs import (
    CHUNK,
    BoundsJob,
    Job,
    LogJob,
    MissionsJob,
    Problem,
    Progress,
    chunk_size,
)
from dess.analysis.execution.workers import Pool, pool_of
from dess.analysis.results import chunks, commands
from dess.analysis.results.manifest import CellPart, Manifest, Selected
from dess.analysis.results.replications import Present, gaps_between
from dess.analysis.results.shards import Shard
from dess.analysis.results.store import Failure, Store, source_folders
from dess.analysis.results.tables import Results, results_of
from dess.analysis.study.cheapest import Setting
from dess.analysis.study.files import load_study
from dess.analysis.study.stopping import Samples
from dess.analysis.study.study import Study
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
    with (
        pool_of(workers, scheduler) as pool,
        Store.open(Manifest.of(study), out, accept_code) as store,
    ):
        _Run(study, store, pool, progress, announce, reuse).complete()
        return results_of(store)


def run_shard(
    study: Study,
    out: str | Path,
    shard: Shard,
    workers: int = 1,
    scheduler: str | None = None,
    progress: Progress | None = None,
    announce: Callable[[Round], object] | None = None,
    accept_code: bool = False,
) -> None:
    """Run a shard of a study into a results folder; ``merge_shards`` joins the shards.

    Args:
        study: The study, without a rule that decides the number of missions in rounds.
        out: The results folder, in which other shards may run at the same time.
        shard: Which chunks of the study are computed.
        workers: As for ``run_study``, and so all that follow.
        scheduler: Address of a scheduler.
        progress: Called with what is done.
        announce: Called before each kind of work.
        accept_code: Whether to keep missions that other code has simulated.

    Raises:
        InputError: As ``run_study``, or if the study has such a rule.
        ChunkError: As ``run_study``.
        SchedulerError: As ``run_study``.
    """
    check_shardable(study)
    check_workers(workers)
    manifest = Manifest.of(study)
    with (
        pool_of(workers, scheduler) as pool,
        Store.open_shard(manifest, out, shard, accept_code) as store,
    ):
        _Run(study, store, pool, progress, announce, shard=shard).compute_shard()
        if not store.manifest.complete:
            shard.mark(store.folder, is_complete=True)


def check_shardable(study: Study) -> None:
    """Refuse to divide a study in which the missions of a round depend on those before.

    Raises:
        InputError: If a rule decides the number of its missions.
    """
    if study.rule:
        problem = f"a rule decides round by round how many missions study {study.name} has"
        raise InputError("--shard", problem, "--scheduler ADDRESS, or the study as a whole")


@dataclass
class _Run:
    """A run of a study, or of a shard of it, into its folder, round by round."""

    study: Study
    store: Store
    pool: Pool
    progress: Progress | None
    announce: Callable[[Round], object] | None
    reuse: Sequence[Path] = ()
    shard: Shard | None = None
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
        logs = self._logs()
        asked: Present = defaultdict(list)
        while counts != before:
            of_teams = (manifest.parts_of_team(team, counts[team]) for team in teams)
            self._round(new_parts(of_teams, asked), logs)
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

    def compute_shard(self) -> None:
        """Compute what is missing of a shard; the number of missions is fixed.

        Raises:
            ChunkError: If a chunk could not be computed, after the other chunks.
        """
        manifest = self.store.manifest
        asked: Present = defaultdict(list)
        of_teams = map(manifest.parts_of_team, range(len(self.study.policies)))
        self._round(new_parts(of_teams, asked), self._logs())
        self._make((BoundsJob, new_parts([manifest.parts_with_bounds()], asked)))

    def _logs(self) -> list[CellPart]:
        """The missions whose event logs the study keeps."""
        manifest = self.store.manifest
        counts = [self.study.logged] * len(manifest.points)
        teams = range(len(self.study.policies))
        return new_parts((manifest.parts_of_team(t, counts) for t in teams), defaultdict(list))

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
        if self.reuse and self.store.contents.missing("missions", parts):
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
        needs = [(kind, [*self._chunks(kind, parts)]) for kind, parts in works]
        jobs_of = {kind: [*self._jobs(kind, of_kind)] for kind, of_kind in needs}
        missing = [job.chunk for jobs in jobs_of.values() for job in jobs]
        if missing:
            check_folder(self.store.folder)
        self.store.check_files(missing)
        for kind, of_kind in needs:
            if of_kind:
                needed = sum(chunk.missions for chunk in of_kind)
                present = needed - sum(job.missions for job in jobs_of[kind])
                self._begin(needed, present, kind.work)
                failures |= self._do(jobs_of[kind])
        if failures:
            raise ChunkError(failures)

    def _chunks(self, kind: type[Job], parts: Sequence[CellPart]) -> Iterator[chunks.Chunk]:
        """The chunks of some parts, of a shard its own, cut as if nothing were present."""
        numbers = count()
        for team, of_team in groupby(parts, lambda part: part.cell.team):
            for chunk in chunks.split_into_chunks(of_team, self._size(kind, team)):
                if self.shard is None or self.shard.has(next(numbers)):
                    yield chunk

    def _jobs(self, kind: type[Job], wanted: Sequence[chunks.Chunk]) -> Iterator[Job]:
        """The jobs for what is missing of some chunks."""
        study = self.study
        for chunk in wanted:
            if missing := tuple(self.store.contents.missing(kind.kind, chunk.parts)):
                spaces = tuple(study.scenarios[part.cell.point] for part in missing)
                kept = chunks.Chunk(chunk.team, missing)
                typed = (study.run_files, study.processes)
                policy = self._policy(kind, chunk.team)
                yield kind(kept, spaces, policy, study.seed, study.engine, *typed)

    def _policy(self, kind: type[Job], team: int) -> str:
        """What makes the work of a team."""
        if kind is BoundsJob:
            return "the upper bound"
        return self.study.policies[team]

    def _size(self, kind: type[Job], team: int) -> int:
        """The number of missions of a chunk."""
        if kind is not MissionsJob:
            return BOUNDS_CHUNK if kind is BoundsJob else 1
        members = load_team(self.study.policies[team], run_files=self.study.run_files)
        return chunk_size(self.study.engine, members)

    def _begin(self, needed: int, present: int, work: str = "") -> None:
        """Tell that a round begins, of how many missions, and how many of them are present."""
        self.asked += needed
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
            command = commands.of_folder(self.store.folder, self.store.manifest, *which)
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
