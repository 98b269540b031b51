"""The plan of a run: how many missions are needed, how many are present, how long it takes."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cache, partial, reduce
from pathlib import Path

from analysis.execution.effort import (
    BOUND,
    LONG_RUN,
    START,
    Range,
    check_time,
    check_workers,
    check_workers_memory,
    seconds_of,
)
from analysis.execution.engines import simulate_missions
from analysis.results.chunks import bound_parts, check_parts, missions_in, parts_of
from analysis.results.store import Store, sources
from analysis.study.best import decisions
from analysis.study.cheapest import Cheapest
from analysis.study.study import Study
from dess import InputError
from policies.registry import load_team

# The memory [bytes] of a design point and of a mission, measured on studies of many of either.
POINT_MEMORY, MISSION_MEMORY = 12_000, 1_200


@dataclass(frozen=True)
class Planned:
    """What a run would do for a policy.

    Attributes:
        policy: The team.
        missions: Number of missions needed; a lower bound if a rule decides it.
        present: Number of these missions that are already in the results folder.
        logs: Number of missing event logs.
        most: The largest number of missions that a rule may ask for; without one, ``missions``.
        seconds: Estimated time of what is missing on one core.
    """

    policy: str
    missions: int
    present: int
    logs: int = 0
    most: int = 0
    seconds: Range = Range()

    @property
    def missing(self) -> int:
        """Number of missions that a run would simulate."""
        return self.missions - self.present


def plan_study(
    study: Study,
    out: str | Path,
    workers: int = 1,
    accept_code: bool = False,
    reuse: Sequence[Path] = (),
) -> list[Planned]:
    """Plan a run; nothing is written.

    Args:
        study: The study.
        out: The results folder, which need not exist.
        workers: Number of processes.
        accept_code: Whether missions that other code has simulated count as present.
        reuse: As for ``run_study``.

    Returns:
        What the run would do for every policy and, if the study has bounds, for these.

    Raises:
        InputError: If the folder contains something else, or ``workers`` is below 1.
    """
    check_workers(workers)
    store = Store.peek(study, out, accept_code)
    for source in sources(reuse, store.manifest):
        store.count(source)
    return [replace(p, seconds=_seconds(study, p)) for p in _counted(study, store)]


def total(plan: Sequence[Planned], workers: int) -> Range:
    """The time of a plan with so many workers."""
    low, high = reduce(Range.plus, (planned.seconds for planned in plan), Range())
    return Range(low / workers, high / workers + (START if high else 0.0))


def check_run(
    study: Study,
    out: str | Path,
    workers: int = 1,
    accept_code: bool = False,
    reuse: Sequence[Path] = (),
    yes: bool = False,
) -> None:
    """Refuse a run that could not come to its end, before its first mission.

    Args:
        study: The study.
        out: The results folder, which need not exist.
        workers: Number of processes.
        accept_code: As for ``run_study``.
        reuse: As for ``run_study``.
        yes: Whether any time and memory is allowed.

    Raises:
        InputError: If the run would take long or more memory than is available (the message has
            the number of missions and the estimate), the folder contains something else, or
            ``workers`` is out of range; if a policy cannot act in a scenario of the study, such as
            a learned policy on a layout that differs from that of its training.
    """
    plan, teams = plan_study(study, out, workers, accept_code), len(study.policies)
    if reuse and total(plan, workers).low > LONG_RUN:
        plan = plan_study(study, out, workers, accept_code, reuse)
    missing = sum(planned.missing for planned in plan[:teams])
    what = (
        f"study {study.name}: {'at least ' if study.rule else ''}{missing:,} missions to "
        f"simulate (policies: {teams}, design points: {study.size:,}, workers: {workers:,})"
    )
    if not yes and any(planned.missing + planned.logs for planned in plan):
        check_time(what, total(plan, workers))
        held = study.size * (POINT_MEMORY + study.first * teams * MISSION_MEMORY)
        ends = [study.points[number].scenario for number in (0, -1)]
        check_workers_memory(what, workers, ends, held)
    if missing:
        _check_policies(study)


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
        most = _most(study) if study.rule and missing else needed
        plan.append(Planned(policy, needed, needed - missing, logs, max(most, needed)))
    if study.bounds:
        parts = bound_parts(manifest)
        needed, missing = missions_in(parts), missions_in(store.missing("bounds", parts))
        plan.append(Planned("upper bounds", needed, needed - missing, most=needed))
    return plan


def budget(study: Study) -> int:
    """Largest number of missions that a study may need, which a rule decides if it has one."""
    return len(study.policies) * _most(study)


def _most(study: Study) -> int:
    """The largest number of missions of a policy."""
    if not study.selection:
        return study.most * study.size
    checked = study.size if isinstance(study.selection, Cheapest) else 1
    return study.selection.budget + study.selection.check * checked


def _seconds(study: Study, planned: Planned) -> Range:
    """Estimated time on one core of the missing missions and event logs, or of the bounds."""
    spaces = [point.scenario for point in study.points]
    if planned.policy not in study.policies:
        made = planned.missing * sum(map(decisions, spaces)) / len(spaces)
        return Range(*(made * each for each in BOUND))
    logs = seconds_of(spaces, planned.policy, (planned.logs, planned.logs), "events")
    missions = planned.missing, planned.most - planned.present
    return seconds_of(spaces, planned.policy, missions, study.engine).plus(logs)
