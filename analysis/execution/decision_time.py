"""The time that a policy takes to decide: measured by a command, and stored in a file.

Pages read the file and never measure, because a measured time is different every time.
"""

import json
import os
import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path, PurePath
from time import perf_counter
from typing import Annotated, Any, Self

import joblib
import numpy as np
from pydantic import Field, model_validator
from threadpoolctl import threadpool_limits

import dess
from analysis.results.documents import (
    Commit,
    Count,
    Finite,
    Hash,
    Library,
    Seed,
    Version,
    check_versions,
)
from analysis.results.manifest import Manifest
from analysis.results.provenance import (
    Member,
    commit_of_source,
    engine_code,
    library_versions,
    members_of,
    scenario_of,
)
from analysis.study.stopping import Text
from dess import InputError, load_scenario, simulate, simulate_batch
from dess.files import read_text, write_file
from dess.files.documents import Document
from dess.scenario import ScenarioSpace
from dess.state import check_seed
from dess.view import View
from policies.registry import load_team

FILE = "timing.json"
SCHEMA_VERSION = 1
SLOW = 0.95  # the quantile that is reported for slow calls
MAX_MISSIONS = 1_000  # of a policy: the time of every call in them is kept
ROUNDS = 3  # rounds of the batch engine; the median time counts
ENOUGH = 30.0  # seconds of calls after which no further mission of a policy is timed
THREADS = 1  # threads of the numerical libraries; a UAV has at most one free core

Positive = Annotated[Count, Field(ge=1)]
Seconds = Annotated[Finite, Field(gt=0, le=1e6)]
Clock = Callable[[], float]
# Called with the number of steps done and of all steps.
Progress = Callable[[int, int], None]


class Cost(Document):
    """The time that a policy takes to decide [s].

    A call of ``Policy.act`` decides for all UAVs of a mission that must act. The time includes all
    that the policy computes from the view, but not the work of the engine before and after it.

    Attributes:
        policy: The team.
        members: The identities of its policies.
        calls: Number of calls in the SimPy engine, each for one mission slot of one mission.
        rows: Number of decisions in these calls, one for each UAV that had to act.
        median: Median time of the calls [s].
        slow: The ``SLOW`` quantile of the times of the calls [s].
        batch_rows: Number of decisions in a round of the batch engine.
        batch: Time per decision in the batch engine [s], the median over ``ROUNDS`` rounds.
    """

    policy: Text
    members: list[Member]
    calls: Positive
    rows: Positive
    median: Seconds
    slow: Seconds
    batch_rows: Positive
    batch: Seconds


class Timing(Document):
    """Measured times of decisions, and where they were measured.

    Attributes:
        version: Version of dess, which ``code`` (a hash of its sources) and ``commit`` specify.
        libraries: The versions of the libraries and of Python.
        processor: The model of the processor, as the operating system names it.
        cores: Number of cores that the process could use.
        threads: Number of threads that the libraries could use.
        scenario: The name of the scenario.
        constants: The fields of the scenario.
        missions: Number of missions per policy: replications 0, 1, ... of the seed. A policy whose
            calls have taken ``ENOUGH`` seconds has fewer.
    """

    schema_version: int
    version: Version
    code: Hash
    commit: Commit | None
    libraries: dict[Library, Version]
    processor: Text
    cores: Positive
    threads: Positive
    scenario: Text
    constants: dict[str, Any]
    seed: Seed
    missions: Positive
    costs: list[Cost] = Field(min_length=1)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        names = [cost.policy for cost in self.costs]
        if len({*names}) < len(names):
            raise ValueError("costs: a policy is listed twice")
        scenario_of(self.constants)
        return self

    @property
    def space(self) -> ScenarioSpace:
        """The scenario of the missions."""
        return scenario_of(self.constants)


def measure(
    policies: Sequence[str],
    scenario: str | Path = "paper",
    seed: int = 0,
    missions: int = 100,
    clock: Clock = perf_counter,
    progress: Progress | None = None,
) -> Timing:
    """Measure the time of the policies' decisions, on ``THREADS`` threads.

    Missions are simulated one at a time with the SimPy engine, then all together with the batch
    engine. The policies take turns, so that a machine that is slow for a while slows down all of
    them. The first mission and the first round of the batch are simulated once before to warm up.
    A policy that takes ``ENOUGH`` seconds for fewer missions is timed on these.

    Args:
        policies: The names of the teams.
        scenario: Name or file of the scenario.
        seed: Seed of the missions.
        missions: Number of missions per policy.
        clock: Returns the time [s].
        progress: Called after every step.

    Raises:
        InputError: If there is no such policy or scenario, or a number is out of range.
    """
    if not policies or not 1 <= missions <= MAX_MISSIONS:
        raise InputError(
            f"policies, missions: {len(policies)} and {missions}; allowed: at least one of each, "
            f"{MAX_MISSIONS:,} missions at most"
        )
    check_seed(seed, missions - 1)
    space = load_scenario(scenario)
    teams = {name: _Team(name, clock) for name in dict.fromkeys(policies)}
    steps = len(teams) * (1 + missions + 1 + ROUNDS)
    with threadpool_limits(THREADS):
        for done, _ in enumerate(_steps(teams.values(), space, seed, missions), 1):
            if progress:
                progress(done, steps)
    return Timing(
        schema_version=SCHEMA_VERSION,
        version=dess.__version__,
        code=engine_code(),
        commit=commit_of_source(),
        libraries=library_versions(),
        processor=_processor(),
        cores=joblib.cpu_count(),
        threads=THREADS,
        scenario=PurePath(scenario).name,
        constants=space.model_dump(mode="json"),
        seed=seed,
        missions=missions,
        costs=[team.cost() for team in teams.values()],
    )


def write(timing: Timing, folder: str | Path) -> None:
    """Write a timing into a folder, in place of an earlier one.

    Raises:
        InputError: If it cannot be written.
    """
    write_file(Path(folder) / FILE, json.dumps(timing.data, indent=1) + "\n")


def read(folder: str | Path) -> Timing:
    """Read the timing in a folder.

    Raises:
        InputError: If there is none, or it is damaged or has another version.
    """
    path = Path(folder) / FILE
    allowed = f"allowed: what is made by: dess timing --out {os.path.abspath(folder)}"

    def check(data: dict) -> None:
        check_versions(data, path, SCHEMA_VERSION, allowed)

    return Timing.load(path, allowed, first=check)


def is_current(folder: str | Path, policies: Sequence[str], missions: int) -> bool:
    """Whether a folder contains a timing of these policies by this code on this processor.

    Raises:
        InputError: If there is no such policy.
    """
    try:
        kept = read(folder)
    except InputError:
        return False
    timed = {cost.policy: cost.members for cost in kept.costs}
    wanted = {policy: members_of(policy) for policy in policies}
    here = (engine_code(), _processor(), library_versions(), missions)
    return timed == wanted and (kept.code, kept.processor, kept.libraries, kept.missions) == here


def unlike(timing: Timing, manifest: Manifest) -> list[str]:
    """The policies of a study that were timed with other code or weights than the study has."""
    timed = {cost.policy: cost.members for cost in timing.costs}
    if timing.code != manifest.engine_code:
        return [team.policy for team in manifest.policies if team.policy in timed]
    return [t.policy for t in manifest.policies if timed.get(t.policy, t.members) != t.members]


class _Timed:
    """A policy that records the time [s] and the number of rows of each of its calls."""

    def __init__(self, policy: Any, clock: Clock, calls: list[tuple[float, int]]):
        self.name, self.policy, self.clock, self.calls = policy.name, policy, clock, calls

    def act(self, view: View) -> np.ndarray:
        """Return the actions of the policy, and record the time."""
        start = self.clock()
        actions = self.policy.act(view)
        self.calls.append((self.clock() - start, len(view)))
        return actions


class _Team:
    """A team whose calls are timed; each time [s] is stored with the call's number of rows."""

    def __init__(self, name: str, clock: Clock):
        self.name = name
        self.calls: list[tuple[float, int]] = []  # of the mission or round in progress
        self.policies = [_Timed(policy, clock, self.calls) for policy in load_team(name)]
        self.single: list[tuple[float, int]] = []  # every call of the SimPy engine
        self.rounds: list[tuple[float, int]] = []  # every round of the batch engine
        self.missions = 0  # that were timed

    def cost(self) -> Cost:
        """The measured times of the team."""
        seconds, rows = zip(*self.single, strict=True)
        median, slow = np.quantile(seconds, [0.5, SLOW]).tolist()
        return Cost(
            policy=self.name,
            members=members_of(self.name),
            calls=len(rows),
            rows=sum(rows),
            median=median,
            slow=slow,
            batch_rows=self.rounds[0][1],
            batch=float(np.median([time / rows for time, rows in self.rounds])),
        )


def _steps(
    teams: Iterable[_Team], space: ScenarioSpace, seed: int, missions: int
) -> Iterator[None]:
    """Simulate all missions that are measured, step by step."""
    for number, replication in enumerate([0, *range(missions)]):
        for team in teams:
            if sum(seconds for seconds, _ in team.single) < ENOUGH:
                team.calls.clear()
                simulate(space, team.policies, seed, replication)
                team.single += team.calls if number else []
                team.missions = number
            yield
    for number in range(1 + ROUNDS):
        for team in teams:
            team.calls.clear()
            simulate_batch(space, team.policies, seed, team.missions)
            times, rows = zip(*team.calls, strict=True)
            team.rounds += [(sum(times), sum(rows))] if number else []
            yield


def _processor() -> str:
    """The model of the processor."""
    try:
        lines = read_text(Path("/proc/cpuinfo")).splitlines()
    except (OSError, InputError):
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine() or "unknown"
