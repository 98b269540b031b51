"""The plan of a run: how many missions are needed, how many are present, how long it takes."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from pathlib import Path

from analysis.bound import upper_bound
from analysis.execution.effort import (
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
from analysis.results.chunks import bound_parts, check_parts, missions_in, parts_of
from analysis.results.store import Store, sources
from analysis.study.cheapest import Cheapest
from analysis.study.study import Study
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
        logs: Number of missing event logs.
        seconds: Estimated time of what is missing [s]; 0 before it is estimated.
    """

    policy: str
    missions: int
    present: int
    logs: int = 0
    seconds: float = 0.0

    @property
    def missing(self) -> int:
        """Number of missions that a run would simulate."""
        return self.missions - self.present


def plan_study(
    study: Study,
    out: str | Path,
    workers: int = 1,
    clock: Clock = time.perf_counter,
    accept_code: bool = False,
) -> list[Planned]:
    """Plan a run; nothing is written.

    Args:
        study: The study.
        out: The results folder, which need not exist.
        workers: Number of processes.
        clock: Returns the time [s].
        accept_code: Whether missions that other code has simulated count as present.

    Returns:
        What the run would do for every policy and, if the study has bounds, for these.

    Raises:
        InputError: If the folder contains something else, or ``workers`` is below 1.
    """
    check_workers(workers)
    counted = _counted(study, Store.peek(study, out, accept_code))
    return [replace(planned, seconds=_seconds(study, planned, clock)) for planned in counted]


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
    """Refuse a run that takes too much time or memory.

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
            the number of missions and the estimate), the folder contains something else, or
            ``workers`` is out of range.
    """
    check_workers(workers)
    store, teams = Store.peek(study, out, accept_code), len(study.policies)
    parts = _counted(study, store)
    if sum(planned.missing for planned in parts[:teams]) > FEW:
        for source in sources(reuse, store.manifest):
            store.count(source)
        parts = _counted(study, store)
    missing = sum(planned.missing for planned in parts[:teams])
    what = (
        f"study {study.name}: {'at least ' if study.rule else ''}{missing:,} missions to "
        f"simulate (policies: {teams}, design points: {study.size:,}, workers: {workers:,})"
    )
    work = sum(planned.missing + planned.logs for planned in parts)
    if yes or not work:
        return missing
    ends = [study.points[number].scenario for number in (0, -1)]
    bounds = parts[-1].missing if study.bounds else 0
    few = all(are_few(work - bounds, space) for space in ends)
    estimated = [] if few else parts[:teams]
    estimated += parts[teams:] if bounds > FEW_BOUNDS else []
    seconds = sum(_seconds(study, planned, clock) for planned in estimated) / workers
    check_time(what, seconds)
    held = study.size * (POINT_MEMORY + study.first * teams * MISSION_MEMORY)
    check_workers_memory(what, workers, ends, held)
    return missing


def _check_policies(study: Study) -> None:
    """Check that every policy can act on every layout of the design, in the first mission slot.

    A layout is the zones, no-fly cells and nodes.

    Errors other than ``InputError`` are ignored here, because the run records them as failures.
    """
    spaces = (point.scenario for point in study.points)
    places = {(space.size, space.rectangles, space.no_fly, space.nodes): space for space in spaces}
    loaded = cache(partial(load_team, uavs=max(space.uavs[1] for space in places.values())))
    for number, space in enumerate(places.values()):
        first_slot = space.model_copy(update={"max_slots": 1})
        for policy in study.policies:
            try:
                team = loaded(policy)
                simulate_missions(study.engine, [first_slot], team, study.seed, [number])
            except InputError:
                raise
            except Exception:  # the run will record it as a failure
                continue


def _counted(study: Study, store: Store) -> list[Planned]:
    """What is needed for now, and what of it is present: of every policy, then of the bounds."""
    manifest, logged = store.manifest, [study.logged] * study.size
    plan = []
    for team, policy in enumerate(study.policies):
        parts = parts_of(manifest, team) + check_parts(manifest, team)
        needed, missing = missions_in(parts), missions_in(store.missing("missions", parts))
        logs = missions_in(store.missing("events", parts_of(manifest, team, logged)))
        plan.append(Planned(policy, needed, needed - missing, logs))
    if study.bounds:
        parts = bound_parts(manifest)
        missing = missions_in(store.missing("bounds", parts))
        plan.append(Planned("upper bounds", missions_in(parts), missions_in(parts) - missing))
    return plan


def budget(study: Study) -> int:
    """Largest number of missions that a study may need, which a rule decides if it has one."""
    each = study.most * study.size
    if study.selection:
        checked = study.size if isinstance(study.selection, Cheapest) else 1
        each = study.selection.budget + study.selection.check * checked
    return len(study.policies) * each


def _seconds(study: Study, planned: Planned, clock: Clock) -> float:
    """Estimated time [s] on one core of the missing missions and event logs, or of the bounds."""
    if planned.policy not in study.policies:
        return planned.missing * _seconds_per_bound(study, clock) if planned.missing else 0.0
    team = load_team(planned.policy)

    def spaces_of(missions: int) -> list[ScenarioSpace]:
        """The scenarios of missions that are spread over the design points."""
        places = [(n * study.size) // missions for n in range(missions)]
        return [study.points[place].scenario for place in places]

    return sum(
        count * seconds_per_mission(spaces_of, team, engine, clock)
        for engine, count in ((study.engine, planned.missing), ("events", planned.logs))
        if count
    )


def _seconds_per_bound(study: Study, clock: Clock) -> float:
    """The time of an upper bound [s], measured on one."""
    space = study.points[0].scenario
    upper_bound(space, TRIAL_SEED, 0, iterations=1)  # compiles
    begin = clock()
    upper_bound(space, TRIAL_SEED, 0)
    return clock() - begin
