"""The plan of a run of a study: its missions, those that are present already, and the time."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis import numbers
from analysis.execution.runner import CHUNK, check_workers
from analysis.results.chunks import check_parts, parts_of, split
from analysis.results.reuse import sources
from analysis.results.store import Store
from analysis.study.cheapest import Cheapest
from analysis.study.design import MAX_SIZE
from analysis.study.study import MANY_POINTS, Study
from dess import InputError, simulate, simulate_batch
from policies import load_team

# Missions that are timed to estimate the time of all; more, as long as they take no time.
TRIAL, LONG_TRIAL, ENOUGH = 48, 240, 0.2  # the last in seconds
TRIAL_SEED = 400_000_000

# A run that takes longer than this [s] has to be confirmed. Few missions are run without a trial.
LONG_RUN, FEW = 3600.0, 10_000


@dataclass(frozen=True)
class Planned:
    """What a run would do for a policy.

    Attributes:
        policy: The team.
        missions: Missions wanted; by a rule, at least that many.
        present: Those that are in the results folder already.
        seconds: Estimated time of the others [s].
    """

    policy: str
    missions: int
    present: int
    seconds: float


@dataclass(frozen=True)
class Plan:
    """What a run of a study would do.

    Attributes:
        policies: What it would do for every policy.
        points: Number of design points.
        at_most: Missions that a rule may ask for, over all policies; nothing without a rule.
        seconds: Estimated time of what is missing, by all workers [s].
    """

    policies: tuple[Planned, ...]
    points: int
    at_most: int | None
    seconds: float

    @property
    def missions(self) -> int:
        """Missions wanted of all policies, without those that a rule adds."""
        return sum(planned.missions for planned in self.policies)


def plan_study(
    study: Study,
    out: str | Path,
    workers: int = 1,
    clock: Callable[[], float] = time.perf_counter,
    accept_code: bool = False,
) -> Plan:
    """Plan a run; nothing is written.

    Args:
        study: The study.
        out: The results folder, which need not exist.
        workers: Processes.
        clock: Tells the time [s].
        accept_code: Whether missions count that other code has simulated.

    Raises:
        InputError: If the folder holds something else, or there is no worker.
    """
    check_workers(workers)
    store = Store.peek(study, out, accept_code)
    rows = []
    for team in range(len(study.policies)):
        missing, total = _missing(study, store, team)
        seconds = missing * _seconds_per_mission(study, team, clock) if missing else 0.0
        rows.append(Planned(study.policies[team], total, total - missing, seconds))
    at_most = len(study.policies) * _budget(study) if study.rule else None
    seconds = sum(planned.seconds for planned in rows) / workers
    return Plan(tuple(rows), len(study.points), at_most, seconds)


def check_effort(
    study: Study,
    out: str | Path,
    workers: int = 1,
    clock: Callable[[], float] = time.perf_counter,
    accept_code: bool = False,
    reuse: Sequence[Path] = (),
    yes: bool = False,
) -> int:
    """Refuse a run of more than an hour or of very many design points, before these are made.

    Args:
        study: The study.
        out: The results folder, which need not exist.
        workers: Processes.
        clock: Tells the time [s].
        accept_code: As of ``run_study``.
        reuse: As of ``run_study``.
        yes: Whether it may take as long as it takes.

    Returns:
        How many missions are missing; by a rule, at least that many.

    Raises:
        InputError: If it would take long, with the number of missions and the estimated time; if
            the folder holds something else, or there is no worker.
    """
    check_workers(workers)
    teams = range(len(study.policies))
    if study.size > MANY_POINTS:
        missing = [study.size * study.first for _ in teams]
    else:
        store = Store.peek(study, out, accept_code)
        missing = [_missing(study, store, team)[0] for team in teams]
        if sum(missing) > FEW:
            for source in sources(reuse, store.manifest):
                store.count(source)
            missing = [_missing(study, store, team)[0] for team in teams]
    if sum(missing) <= FEW or (yes and study.size <= MAX_SIZE):
        return sum(missing)
    times = [missing[t] * _seconds_per_mission(study, t, clock) for t in teams if missing[t]]
    seconds = sum(times) / workers
    if study.size > MANY_POINTS or seconds > LONG_RUN:
        confirmed = "--yes, or less" if study.size <= MAX_SIZE else f"{MAX_SIZE:,} design points"
        least = "at least " if study.rule else ""
        raise InputError(
            f"study {study.name}: {least}{sum(missing):,} missions to simulate "
            f"(policies: {len(study.policies)}, design points: {study.size:,}, "
            f"workers: {workers}), about {numbers.duration(seconds)}; allowed: {confirmed}"
        )
    return sum(missing)


def check_policies(study: Study) -> None:
    """Have every policy act in a mission in every place of the design: a grid, a zone and nodes.

    Any other error than ``InputError`` is left to the run, which records it.

    Raises:
        InputError: If a policy cannot act in one of them, as one that has learned another place.
    """
    spaces = (point.scenario for point in study.points)
    places = [*{(space.grid, space.zone, space.nodes): space for space in spaces}.values()]
    for policy in study.policies:
        try:
            simulate_batch(places, load_team(policy), study.seed, len(places))
        except InputError:
            raise
        except Exception:  # a policy that raises anything else fails in the run, which records it
            continue


def _missing(study: Study, store: Store, team: int) -> tuple[int, int]:
    """Missions of a team that are missing, and all that are wanted for now."""
    manifest = store.manifest
    parts = parts_of(manifest, team) + check_parts(manifest, team)
    missing = (store.missing(chunk) for chunk in split(parts, CHUNK[study.engine]))
    wanted = sum(len(part.replications) for part in parts)
    return sum(chunk.missions for chunk in missing if chunk), wanted


def _budget(study: Study) -> int:
    """Missions of a policy that the rule of a study may ask for."""
    if study.selection:
        checked = len(study.points) if isinstance(study.selection, Cheapest) else 1
        return study.selection.budget + study.selection.check * checked
    assert study.precision
    return study.precision.budget * len(study.points)


def _seconds_per_mission(study: Study, team: int, clock: Callable[[], float]) -> float:
    """The time of a mission, from a trial of some, spread over the design points [s]."""
    policies = load_team(study.policies[team])

    def trial(missions: int) -> float:
        places = [(n * study.size) // missions for n in range(missions)]
        spaces = [study.point(place).scenario for place in places]
        begin = clock()
        if study.engine == "batch":
            simulate_batch(spaces, policies, TRIAL_SEED, missions)
        else:
            for replication, space in enumerate(spaces):
                simulate(space, policies, TRIAL_SEED, replication)
        return (clock() - begin) / missions

    trial(1)  # compiles
    seconds = trial(TRIAL)
    return trial(LONG_TRIAL) if seconds * TRIAL < ENOUGH else seconds
