"""What a decision costs in time: measured by a command, and kept in a file that pages read.

A time differs whenever it is measured, so no report measures any.
"""

import json
import platform
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path, PurePath
from time import perf_counter
from typing import Any, Self

import joblib
import numpy as np
from pydantic import Field, model_validator
from threadpoolctl import threadpool_limits

import dess
from analysis.results.documents import Document
from analysis.results.manifest import Manifest
from analysis.results.provenance import (
    Member,
    commit_of_source,
    engine_code,
    library_versions,
    members_of,
)
from dess import InputError, load_scenario, simulate, simulate_batch
from dess.files import replacing, writable
from dess.scenario import ScenarioSpace
from dess.state import check_seed
from dess.view import View
from policies import load_team

FILE = "timing.json"
SCHEMA_VERSION = 1
SLOW = 0.95  # the quantile of the slow calls
ROUNDS = 3  # of the batch; the middle one counts
THREADS = 1  # of the libraries that compute: a UAV has one core to spare, if that

Clock = Callable[[], float]
# Called with the steps done and the steps in all.
Progress = Callable[[int, int], None]


class Cost(Document):
    """What the decisions of a policy cost [s].

    A call of ``Policy.act`` decides for all UAVs of a mission that must act, with all that the
    policy derives from the view; not the work of the engine before and after it.

    Attributes:
        policy: The team.
        members: The identities of its policies.
        calls: In the SimPy engine, each with the rows of one mission.
        rows: In these calls: UAVs that were decided for.
        median: Of the calls.
        slow: Their ``SLOW`` quantile.
        batch_rows: UAVs that were decided for in a round of the batch engine.
        batch: Time in calls per row, of the middle one of ``ROUNDS`` rounds.
    """

    policy: str
    members: list[Member]
    calls: int = Field(ge=1)
    rows: int = Field(ge=1)
    median: float = Field(gt=0)
    slow: float = Field(gt=0)
    batch_rows: int = Field(ge=1)
    batch: float = Field(gt=0)


class Timing(Document):
    """What decisions cost, and on what they were measured.

    Attributes:
        version: Of dess, as ``code`` (a hash of its sources) and ``commit``.
        libraries: And their versions, Python among them.
        processor: Its model, as the system calls it.
        cores: That the process might use.
        threads: That the libraries were allowed.
        scenario: The name of the scenario.
        constants: What it says.
        missions: Number per policy: replications 0, 1, ... of the seed.
    """

    schema_version: int
    version: str
    code: str
    commit: str | None
    libraries: dict[str, str]
    processor: str
    cores: int = Field(ge=1)
    threads: int = Field(ge=1)
    scenario: str
    constants: dict[str, Any]
    seed: int
    missions: int = Field(ge=1)
    costs: list[Cost] = Field(min_length=1)

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        names = [cost.policy for cost in self.costs]
        if len({*names}) < len(names):
            raise ValueError("costs: a policy is listed twice")
        ScenarioSpace.of(**self.constants)
        return self

    @property
    def text(self) -> str:
        """The timing as JSON."""
        return json.dumps(self.model_dump(mode="json", by_alias=True), indent=1) + "\n"

    @property
    def space(self) -> ScenarioSpace:
        """The scenario of the missions."""
        return ScenarioSpace.of(**self.constants)


def measure(
    policies: Sequence[str],
    scenario: str | Path = "paper",
    seed: int = 0,
    missions: int = 100,
    clock: Clock = perf_counter,
    progress: Progress | None = None,
) -> Timing:
    """Measure what the decisions of policies cost, on ``THREADS`` threads.

    One mission at a time in the SimPy engine, then all at once in the batch engine. The policies
    take turns, so that a machine that slows down for a while slows down all of them. The first
    mission, and the first round of the batch, are simulated once before to warm up.

    Args:
        policies: The teams, by name.
        scenario: Name or file of the scenario.
        seed: Of the missions.
        missions: Number of missions per policy.
        clock: Tells the time [s].
        progress: Called after every step.

    Raises:
        InputError: If there is no such policy or scenario, or a number is out of range.
    """
    if not policies or missions < 1:
        raise InputError(
            f"policies, missions: {len(policies)} and {missions}; allowed: at least one of each"
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


@contextmanager
def writing(folder: str | Path) -> Iterator[Path]:
    """Where to write a timing: a file that takes its place in the folder in the end.

    Raises:
        InputError: At once, if none can be written there.
    """
    path = Path(folder) / FILE
    with writable(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        yield temporary


def read(folder: str | Path) -> Timing:
    """Read the timing in a folder.

    Raises:
        InputError: If there is none, or it is damaged or of another version.
    """
    path = Path(folder) / FILE
    allowed = f"allowed: what is made by: dess timing --out {Path(folder).resolve()}"
    return Timing.load(path, SCHEMA_VERSION, allowed, allowed)


def is_current(folder: str | Path, policies: Sequence[str], missions: int) -> bool:
    """Whether a folder holds a timing of these policies, by the code and on the processor at hand.

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
    """A policy that notes the time [s] and the rows of each of its calls."""

    def __init__(self, policy: Any, clock: Clock, calls: list[tuple[float, int]]):
        self.name, self.policy, self.clock, self.calls = policy.name, policy, clock, calls

    def act(self, view: View) -> np.ndarray:
        """Choose as the policy does."""
        start = self.clock()
        actions = self.policy.act(view)
        self.calls.append((self.clock() - start, len(view)))
        return actions


class _Team:
    """A team that is timed; a time [s] is kept with the number of rows that it was spent on."""

    def __init__(self, name: str, clock: Clock):
        self.name = name
        self.calls: list[tuple[float, int]] = []  # of the mission or round that is simulated
        self.policies = [_Timed(policy, clock, self.calls) for policy in load_team(name)]
        self.single: list[tuple[float, int]] = []  # every call of the SimPy engine
        self.rounds: list[tuple[float, int]] = []  # every round of the batch engine

    def cost(self) -> Cost:
        """What it has cost."""
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
    """Simulate all that is measured, step by step."""
    for number, replication in enumerate([0, *range(missions)]):
        for team in teams:
            team.calls.clear()
            simulate(space, team.policies, seed, replication)
            team.single += team.calls if number else []
            yield
    for number in range(1 + ROUNDS):
        for team in teams:
            team.calls.clear()
            simulate_batch(space, team.policies, seed, missions)
            times, rows = zip(*team.calls, strict=True)
            team.rounds += [(sum(times), sum(rows))] if number else []
            yield


def _processor() -> str:
    """The model of the processor."""
    try:
        lines = Path("/proc/cpuinfo").read_text("utf-8").splitlines()
    except OSError:
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return models[0] if models else platform.processor() or platform.machine() or "unknown"
