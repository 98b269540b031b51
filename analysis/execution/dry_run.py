"""The plan of a run: how many missions are needed, how many are present, how long it takes."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis import numbers
from analysis.execution.reuse import sources
from analysis.execution.runner import CHUNK, check_workers
from analysis.results.chunks import check_parts, parts_of, split
from analysis.results.store import Store
from analysis.study.cheapest import Cheapest
from analysis.study.design import MAX_SIZE
from analysis.study.study import MANY_POINTS, Study
from dess import InputError, simulate, simulate_batch
from policies import load_team

# Missions that are timed to estimate the time of all: TRIAL, or LONG_TRIAL if TRIAL missions take
# less than ENOUGH seconds.
TRIAL, LONG_TRIAL, ENOUGH = 48, 240, 0.2
TRIAL_SEED = 400_000_000

# A run that takes longer than this [s] has to be confirmed. Few missions need no estimate.
LONG_RUN, FEW = 3600.0, 10_000


@dataclass(frozen=True)
class Planned:
    """What a run would do for a policy.

    Attributes:
        policy: The team.
        missions: Number of missions needed; a lower bound if a rule decides it.
        present: Number of these missions that are already in the results folder.
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
        policies: What the run would do for every policy.
        points: Number of design points.
        at_most: Largest number of missions that a rule may ask for, over all policies; None without
            a rule.
        seconds: Estimated time of the missing missions with all workers [s].
    """

    policies: tuple[Planned, ...]
    points: int
    at_most: int | None
    seconds: float

    @property
    def missions(self) -> int:
        """Number of missions needed of all policies, without those that a rule adds."""
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
        workers: Number of processes.
        clock: Returns the time [s].
        accept_code: Whether missions that other code has simulated count as present.

    Raises:
        InputError: If the folder contains something else, or ``workers`` is below 1.
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
        workers: Number of processes.
        clock: Returns the time [s].
        accept_code: As for ``run_study``.
        reuse: As for ``run_study``.
        yes: Whether a run of any length is allowed.

    Returns:
        The number of missing missions; a lower bound if a rule decides it.

    Raises:
        InputError: If the run would take long (the message has the number of missions and the
            estimated time), the folder contains something else, or ``workers`` is below 1.
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
    """Check that every policy can act on every layout of the design (grid, zone and nodes).

    Errors other than ``InputError`` are ignored here, because the run records them as failures.

    Raises:
        InputError: If a policy cannot act on a layout, such as a learned policy on a layout that
            differs from that of its training.
    """
    spaces = (point.scenario for point in study.points)
    places = [*{(space.grid, space.zone, space.nodes): space for space in spaces}.values()]
    for policy in study.policies:
        try:
            team = load_team(policy, max(space.uavs[1] for space in places))
            simulate_batch(places, team, study.seed, len(places))
        except InputError:
            raise
        except Exception:  # the run will record it as a failure
            continue


def _missing(study: Study, store: Store, team: int) -> tuple[int, int]:
    """Number of missions of a team that are missing, and that are needed for now."""
    manifest = store.manifest
    parts = parts_of(manifest, team) + check_parts(manifest, team)
    missing = (store.missing(chunk) for chunk in split(parts, CHUNK[study.engine]))
    wanted = sum(len(part.replications) for part in parts)
    return sum(chunk.missions for chunk in missing if chunk), wanted


def _budget(study: Study) -> int:
    """Largest number of missions of a policy that the rule of a study may ask for."""
    if study.selection:
        checked = len(study.points) if isinstance(study.selection, Cheapest) else 1
        return study.selection.budget + study.selection.check * checked
    assert study.precision
    return study.precision.budget * len(study.points)


def _seconds_per_mission(study: Study, team: int, clock: Callable[[], float]) -> float:
    """The mean time of a mission [s], measured on some missions of various design points."""
    policies = load_team(study.policies[team])

    def trial(missions: int) -> float:
        places = [(n * study.size) // missions for n in range(missions)]
        spaces = [study.point(place).scenario for place in places]
        begin = clock()
        if study.engine == "batch":
            fleet = max(space.uavs[1] for space in spaces)
            simulate_batch(spaces, policies[:fleet], TRIAL_SEED, missions)
        else:
            for replication, space in enumerate(spaces):
                simulate(space, policies[: space.uavs[1]], TRIAL_SEED, replication)
        return (clock() - begin) / missions

    trial(1)  # compiles
    seconds = trial(TRIAL)
    return trial(LONG_TRIAL) if seconds * TRIAL < ENOUGH else seconds
