"""The plan of a run: how many missions are needed, how many are present, how long it takes."""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from analysis import numbers
from analysis.bound import upper_bound
from analysis.execution.effort import (
    CONFIRMED,
    FEW,
    TRIAL_SEED,
    Clock,
    are_few,
    check_time,
    check_workers,
    check_workers_memory,
    seconds_per_mission,
)
from analysis.execution.engines import simulate_missions
from analysis.execution.reuse import sources
from analysis.results.chunks import Chunk, bound_parts, check_parts, parts_of
from analysis.results.manifest import NO_TEAM
from analysis.results.store import MANIFEST, Store
from analysis.study.cheapest import Cheapest
from analysis.study.design import MAX_SIZE
from analysis.study.study import MANY_POINTS, Study
from dess import InputError
from dess.scenario import ScenarioSpace
from policies.registry import load_team

# The memory [bytes] of a design point and of a mission, measured on studies of many of either.
POINT_MEMORY, MISSION_MEMORY = 12_000, 1_200

FEW_BOUNDS = 300  # upper bounds that need no estimate of their time


@dataclass(frozen=True)
class Planned:
    """What a run would do for a policy.

    Attributes:
        policy: The team.
        missions: Number of missions needed; a lower bound if a rule decides it.
        present: Number of these missions that are already in the results folder.
        seconds: Estimated time of the others and of missing event logs [s].
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
        seconds: Estimated time of what is missing with all workers [s].
        bounds: What the run would do for the upper bounds; None if the study has none.
    """

    policies: tuple[Planned, ...]
    points: int
    at_most: int | None
    seconds: float
    bounds: Planned | None = None

    @property
    def missions(self) -> int:
        """Number of missions needed of all policies, without those that a rule adds."""
        return sum(planned.missions for planned in self.policies)


def plan_study(
    study: Study,
    out: str | Path,
    workers: int = 1,
    clock: Clock = time.perf_counter,
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
    if study.size > MAX_SIZE:
        raise InputError(
            f"study {study.name}: {study.size:,} design points; allowed: {MAX_SIZE:,} at most"
        )
    many = study.size > MANY_POINTS and not (Path(out) / MANIFEST).exists()
    store = None if many else Store.peek(study, out, accept_code)
    rows, logs = [], _logs(study, store) / len(study.policies)
    for team in range(len(study.policies)):
        missing, total = _missing(study, store, team)
        seconds = _seconds(study, team, missing, logs, clock)
        rows.append(Planned(study.policies[team], total, total - missing, seconds))
    at_most = len(study.policies) * _budget(study) if study.rule else None
    bounds = None
    if study.bounds:
        total, missing = study.size * study.first, _missing_bounds(study, store)
        each = _seconds_per_bound(study, clock) if missing else 0.0
        bounds = Planned("upper bounds", total, total - missing, missing * each)
    parts = [*rows, bounds] if bounds else rows
    seconds = sum(planned.seconds for planned in parts) / workers
    return Plan(tuple(rows), study.size, at_most, seconds, bounds)


def check_run(
    study: Study,
    out: str | Path,
    workers: int = 1,
    accept_code: bool = False,
    reuse: Sequence[Path] = (),
    yes: bool = False,
) -> None:
    """Refuse a run that could not come to its end, before its first mission.

    The arguments are those of ``check_effort``.

    Raises:
        InputError: As from ``check_effort``; or if a policy cannot act in a scenario of the study,
            such as a learned policy on a layout that differs from that of its training.
    """
    if check_effort(study, out, workers, accept_code=accept_code, reuse=reuse, yes=yes):
        _check_policies(study)


def check_effort(
    study: Study,
    out: str | Path,
    workers: int = 1,
    clock: Clock = time.perf_counter,
    accept_code: bool = False,
    reuse: Sequence[Path] = (),
    yes: bool = False,
) -> int:
    """Refuse a run that takes too much time or memory, before the design points are made.

    Args:
        study: The study.
        out: The results folder, which need not exist.
        workers: Number of processes.
        clock: Returns the time [s].
        accept_code: As for ``run_study``.
        reuse: As for ``run_study``.
        yes: Whether any time and memory is allowed.

    Returns:
        The number of missing missions; a lower bound if a rule decides it.

    Raises:
        InputError: If the run would take long or more memory than is available (the message has
            the number of missions and the estimate), has too many design points, the folder
            contains something else, or ``workers`` is out of range.
    """
    check_workers(workers)
    teams = range(len(study.policies))
    if study.size > MANY_POINTS:
        missing, logs = [study.size * study.first for _ in teams], _logs(study)
        bounds = _missing_bounds(study, None)
    else:
        store = Store.peek(study, out, accept_code)
        missing = [_missing(study, store, team)[0] for team in teams]
        if sum(missing) > FEW:
            for source in sources(reuse, store.manifest):
                store.count(source)
            missing = [_missing(study, store, team)[0] for team in teams]
        logs, bounds = _logs(study, store), _missing_bounds(study, store)
    what = (
        f"study {study.name}: {'at least ' if study.rule else ''}{sum(missing):,} missions to "
        f"simulate (policies: {len(study.policies)}, design points: {study.size:,}, "
        f"workers: {workers:,})"
    )
    if study.size > MAX_SIZE:
        raise InputError(f"{what}; allowed: {MAX_SIZE:,} design points")
    if yes or not sum(missing) + logs + bounds:
        return sum(missing)
    if study.size > MANY_POINTS:
        seconds = _all_seconds(study, missing, logs, clock) / workers
        raise InputError(f"{what}, about {numbers.duration(seconds)}; allowed: {CONFIRMED}")
    ends = [study.point(number).scenario for number in {0, study.size - 1}]
    few = all(are_few(sum(missing) + logs, space) for space in ends)
    seconds = 0.0 if few else _all_seconds(study, missing, logs, clock)
    if bounds > FEW_BOUNDS:
        seconds += bounds * _seconds_per_bound(study, clock)
    check_time(what, seconds / workers)
    held = study.size * (POINT_MEMORY + study.first * len(teams) * MISSION_MEMORY)
    check_workers_memory(what, workers, ends, held)
    return sum(missing)


def _check_policies(study: Study) -> None:
    """Check that every policy can act on every layout of the design (grid, zone and nodes).

    Errors other than ``InputError`` are ignored here, because the run records them as failures.
    """
    spaces = (point.scenario for point in study.points)
    places = [*{(space.grid, space.zone, space.nodes): space for space in spaces}.values()]
    for policy in study.policies:
        try:
            team = load_team(policy, max(space.uavs[1] for space in places))
            simulate_missions(study.engine, places, team, study.seed, range(len(places)))
        except InputError:
            raise
        except Exception:  # the run will record it as a failure
            continue


def _missing(study: Study, store: Store | None, team: int) -> tuple[int, int]:
    """Number of missions of a team that are missing, and that are needed for now."""
    if store is None:
        return study.size * study.first, study.size * study.first
    manifest = store.manifest
    parts = parts_of(manifest, team) + check_parts(manifest, team)
    missing = store.missing(Chunk(team, tuple(parts)))
    return missing.missions if missing else 0, sum(len(part.replications) for part in parts)


def _missing_bounds(study: Study, store: Store | None) -> int:
    """Number of upper bounds that are missing and needed for now; all, if there is no folder."""
    if store is None:
        return study.size * study.first * study.bounds
    chunk = store.bounds.missing(Chunk(NO_TEAM, tuple(bound_parts(store.manifest))))
    return chunk.missions if chunk else 0


def _seconds_per_bound(study: Study, clock: Clock) -> float:
    """The time of an upper bound [s], measured on one."""
    space = study.point(0).scenario
    upper_bound(space, TRIAL_SEED, 0, iterations=1)  # compiles
    begin = clock()
    upper_bound(space, TRIAL_SEED, 0)
    return clock() - begin


def _budget(study: Study) -> int:
    """Largest number of missions of a policy that the rule of a study may ask for."""
    if study.selection:
        checked = study.size if isinstance(study.selection, Cheapest) else 1
        return study.selection.budget + study.selection.check * checked
    assert study.precision
    return study.precision.budget * study.size


def _logs(study: Study, store: Store | None = None) -> int:
    """Number of event logs that are missing; all, if the folder is not known."""
    needed = study.logged * study.size * len(study.policies)
    present = store.logged if store and needed else []
    return needed - sum(number < cell.first + study.logged for cell, number in present)


def _all_seconds(study: Study, missing: Sequence[int], logs: int, clock: Clock) -> float:
    """Estimated time [s] of missing missions of every team, and of event logs, on one core."""
    each = logs / len(missing)
    return sum(_seconds(study, team, count, each, clock) for team, count in enumerate(missing))


def _seconds(study: Study, team: int, missions: int, logs: float, clock: Clock) -> float:
    """Estimated time [s] of missions and event logs of a team on one core."""
    return sum(
        count * _seconds_per_mission(study, team, engine, clock)
        for engine, count in ((study.engine, missions), ("events", logs))
        if count
    )


def _seconds_per_mission(study: Study, team: int, engine: str, clock: Clock) -> float:
    """The mean time of a mission [s], measured on missions of various design points."""

    def spaces_of(missions: int) -> list[ScenarioSpace]:
        places = [(n * study.size) // missions for n in range(missions)]
        return [study.point(place).scenario for place in places]

    return seconds_per_mission(spaces_of, load_team(study.policies[team]), engine, clock)
