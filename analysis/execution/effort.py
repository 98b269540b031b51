"""How long missions take and how much memory, which policies to ask, and plans of runs."""

import math
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import reduce
from math import ceil
from pathlib import Path
from statistics import mean
from typing import NamedTuple, Self

from dess import InputError
from dess.analysis import numbers
from dess.analysis.execution.jobs import simulate_missions
from dess.analysis.results.store import Count, Store
from dess.analysis.study.study import Study
from dess.base.files.memory import check_memory
from dess.base.files.writing import check_folder
from dess.model.processes import load_processes
from dess.policies.registry import Policy, folder_of, load_team
from dess.policies.shipped import SHIPPED
from dess.scenario.scenario import ScenarioSpace

# The policies from the slowest to the fastest: the time of a decision [s] as measured on one core.
SECONDS = {n: SHIPPED[n].seconds for n in ("planner", "planner-short", "generalist", "greedy")}
BASELINE = "greedy"  # the policy without learning and search that the best one is compared with
# From the best to the worst. A search of the same length is worse for a larger fleet.
OF_SMALL_FLEETS = ("planner", "planner-short", "generalist", BASELINE)
OF_LARGE_FLEETS = ("planner", "generalist", "planner-short", BASELINE)
SMALL = 2.0  # UAVs on average

BUDGET = 300.0  # [s]


def policies_for(spaces: Iterable[ScenarioSpace], missions: int) -> tuple[str, ...]:
    """The best policy that the budget allows, and the one that it is compared with.

    Args:
        spaces: The scenarios of the design points.
        missions: Number of missions of every design point.
    """
    spaces = [*spaces]
    decisions = missions * sum(map(estimate_decisions, spaces))
    is_small = mean(mean(space.uavs) for space in spaces) <= SMALL
    if is_small:
        ranked = OF_SMALL_FLEETS
    else:
        ranked = OF_LARGE_FLEETS
    best = next((name for name in ranked if decisions * SECONDS[name] <= BUDGET), BASELINE)
    return tuple(dict.fromkeys((best, BASELINE)))


def estimate_decisions(space: ScenarioSpace) -> float:
    """About the decisions of a mission: every UAV flies until its quota is filled."""
    longest = space.longest_slots
    needed = ceil(space.quota / space.communication_slots) or longest
    slots = min(needed, longest)
    return sum(space.uavs) / 2 * slots


MAX_WORKERS = 1024
# The memory [bytes] of a process, without what processes share: 119 MiB were measured with greedy,
# 297 with a learned policy.
WORKER_MEMORY = 300 * 2**20

# A run that takes longer than this [s] has to be confirmed.
LONG_RUN = 3600.0
SPREAD = 3.0  # how much longer or shorter than here missions may take elsewhere

# The least and the largest time of a decision [s] on one core of trained policies that are not
# shipped, and of classes of others, in which anything may happen.
_TRAINED = (5e-6, 7e-5)
_OTHER = (2e-6, 1e-3)
START = 15.0  # what a run may take to start its workers and to write its results [s]
BOUND = (1e-4, 1e-2)  # the time of an upper bound [s] for every decision of its mission

# In the SimPy engine: the time of an event [s], with its share of the decisions, and the memory of
# a packet [bytes], with its share of the event log.
EVENT, PACKET_MEMORY = 5e-5, 400
EVENTS = 1e-5  # what it takes in addition for a decision [s]

CONFIRMED = "--yes, or less"  # in Python: yes=True


class Range(NamedTuple):
    """A time [s] that lies between two ends."""

    low: float = 0.0
    high: float = 0.0

    def plus(self, other: Self) -> "Range":
        """This time and another one."""
        return Range(self.low + other.low, self.high + other.high)

    def __str__(self) -> str:
        """The ends in words, such as ``5 seconds to 2 minutes``; one if they are the same."""
        low, high = (numbers.format_duration(max(end, 2.0)) for end in self)
        if self.low < 2.0:
            return f"up to {high}"
        if self.low == self.high:
            return high
        return f"{low.removesuffix(high[high.index(' ') :])} to {high}"


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is out of range.

    Raises:
        InputError: If it is below 1 or above ``MAX_WORKERS``.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise InputError("workers", f"{workers} is out of range", f"1..{MAX_WORKERS:,}")


def seconds_of(
    spaces: Sequence[ScenarioSpace],
    team: str,
    missions: tuple[float, float],
    engine: str = "batch",
    workers: int = 1,
) -> Range:
    """The time of missions that are spread evenly over scenarios.

    Args:
        spaces: The scenarios.
        team: ``"P"`` or ``"P,P,..."``.
        missions: The least and the largest number of missions.
        engine: ``batch`` or ``events``.
        workers: Number of processes or threads.
    """
    member_times = [_decision_time(name) for name in team.split(",")]
    more = EVENTS if engine == "events" else 0.0
    decisions = sum(map(estimate_decisions, spaces)) / len(spaces) / workers
    low, high = (sum(times) / len(member_times) + more for times in zip(*member_times, strict=True))
    return Range(missions[0] * decisions * low / SPREAD, missions[1] * decisions * high * SPREAD)


def _decision_time(policy: str) -> tuple[float, float]:
    """The least and the largest time of a decision of a policy [s]."""
    if policy in SHIPPED:
        seconds = SHIPPED[policy].seconds
        return seconds, seconds
    return _TRAINED if folder_of(policy) else _OTHER


def check_time(what: str, time: Range) -> None:
    """Refuse work that takes long, by the lower end of its range.

    Args:
        what: The work and its size.
        time: The estimated time [s].

    Raises:
        InputError: If it takes more than ``LONG_RUN``.
    """
    if time.low > LONG_RUN:
        raise InputError("", f"{what}, about {time}", CONFIRMED)


def check_missions(what: str, spaces: Sequence[ScenarioSpace], earlier: float = 0.0) -> float:
    """Refuse missions of the SimPy engine that may take too much, before the first is simulated.

    Args:
        what: What needs the missions, for the message.
        spaces: Their scenarios.
        earlier: The time of what is done before [s].

    Returns:
        The longest time of all [s].

    Raises:
        InputError: If they may take more than ``LONG_RUN``, or one more memory than is available.
    """
    seconds = earlier + sum(map(_longest_mission_time, spaces))
    check_time(f"{what}: {len(spaces)} missions to simulate", Range(seconds, seconds))
    for space in spaces:
        check_memory(f"{what}: a mission", mission_memory(space), CONFIRMED)
    return seconds


def _longest_mission_time(space: ScenarioSpace) -> float:
    """The longest time that the SimPy engine takes for a mission [s]."""
    arrivals = len(space.nodes) * min(space.arrival_rate / space.message, 1) * space.max_slots
    in_slots = space.max_slots * space.uavs[1] * space.communication_slots
    return (in_slots + max(arrivals, space.packets)) * EVENT


def check_workers_memory(
    what: str,
    workers: int,
    spaces: Iterable[ScenarioSpace],
    more: float,
    are_processes: bool = True,
) -> None:
    """Refuse workers that take more memory than is available.

    Args:
        what: What they do, for the message.
        workers: Number of processes or threads.
        spaces: Scenarios of the missions.
        more: What this process needs in addition [bytes].
        are_processes: Whether the workers are processes.

    Raises:
        InputError: If they do.
    """
    memory_of_worker = max(map(mission_memory, spaces)) + (WORKER_MEMORY if are_processes else 0)
    check_memory(what, workers * memory_of_worker + more, CONFIRMED)


def mission_memory(space: ScenarioSpace) -> float:
    """The memory [bytes] of the packets and of all tables of ``dess.model.channel.World``."""
    nodes = len(space.nodes)
    steps = 5 * math.prod(space.size) * (8 * nodes * space.communication_slots + 2 * (nodes + 1))
    return PACKET_MEMORY * space.packets + steps + space.chart.ways.nbytes


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
        reuse: Other results folders, whose missions are copied where they belong to the study.

    Returns:
        What the run would do for every policy and, if the study has bounds, for these.

    Raises:
        InputError: If the folder contains something else, or ``workers`` is below 1.
    """
    check_workers(workers)
    store = Store.peek(study, out, accept_code, reuse)
    work = store.work()
    teams = zip(study.policies, work.missions, work.logs, strict=True)
    plan = [_plan_team(study, *team) for team in teams]
    if study.bounds:
        plan.append(_plan_bounds(study, work.bounds))
    return plan


def total_time(plan: Sequence[Planned], workers: int) -> Range:
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
    shards: int = 1,
) -> None:
    """Refuse a run that could not come to its end, before its first mission.

    Args:
        study: The study.
        out: The results folder, which need not exist.
        workers: Number of processes.
        accept_code: Whether missions that other code has simulated count as present.
        reuse: Other results folders, whose missions are copied where they belong to the study.
        yes: Whether any time and memory is allowed.
        shards: How many shards the study is divided into, of which this is one.

    Raises:
        InputError: If the run would take long or more memory than is available (the message has
            the number of missions and the estimate), the folder contains something else, or
            ``workers`` is out of range; if a policy cannot act in a scenario of the study, such as
            a learned policy on a layout that differs from that of its training.
    """
    plan = plan_study(study, out, workers, accept_code)
    teams = len(study.policies)
    at_work = workers * shards
    if reuse and total_time(plan, at_work).low > LONG_RUN:
        plan = plan_study(study, out, workers, accept_code, reuse)
    missing = sum(planned.missing for planned in plan[:teams])
    if any(planned.missing + planned.logs for planned in plan):
        check_folder(Path(out))
    what = (
        f"study {study.name}: {'at least ' if study.rule else ''}{missing:,} "
        f"{study.replication_name}s to simulate (policies: {teams}, design points: "
        f"{study.size:,}, workers: {workers:,})"
    )
    if not yes and any(planned.missing + planned.logs for planned in plan):
        check_time(what, total_time(plan, at_work))
        needed_memory = study.size * (POINT_MEMORY + study.first * teams * MISSION_MEMORY)
        check_workers_memory(
            what, workers, [study.scenarios[0], study.scenarios[-1]], needed_memory
        )
    if missing:
        _check_policies(study)


def _check_policies(study: Study) -> None:
    """Check that every policy can act on two layouts of the design, in the first mission slot.

    A layout is the zones, no-fly cells and nodes. The first one and the largest of the others are
    enough: a policy that knows a single layout refuses one of the two, and a policy that needs too
    much memory refuses the largest.

    Errors other than ``InputError`` are ignored here, because the run records them as failures.
    """
    places = {(s.geometry, s.nodes): s for s in study.scenarios}
    largest = max(space.uavs[1] for space in places.values())
    teams = _load_teams(study, largest)
    processes = load_processes(study.processes)
    first, *others = places.values()
    by_size = sorted(others, key=lambda space: len(space.nodes) * math.prod(space.size))
    for number, space in enumerate([first, *by_size[-1:]]):
        first_slot = space.without_weather().model_copy(update={"max_slots": 1})
        for team in teams:
            with _failures_left_to_the_run():
                about = (study.engine, [first_slot], team, study.seed, [number])
                simulate_missions(*about, processes=processes)


def _load_teams(study: Study, uavs: int) -> list[list[Policy]]:
    """The policies of every team for so many UAVs; without those that fail when they are made."""
    teams = []
    for policy in study.policies:
        with _failures_left_to_the_run():
            teams.append(load_team(policy, uavs, run_files=study.run_files))
    return teams


@contextmanager
def _failures_left_to_the_run() -> Iterator[None]:
    """Ignore errors that a run records as failures: all but ``InputError``."""
    try:
        yield
    except InputError:
        raise
    except Exception:  # a policy is anybody's code
        return


def _plan_team(study: Study, policy: str, missions: Count, logs: Count) -> Planned:
    """What a run would do for a team, as far as it is known now."""
    most = missions.needed
    if study.rule and missions.missing:
        most = max(missions.needed, study.most_missions)
    present = missions.needed - missions.missing
    to_simulate = (missions.missing, most - present)
    time_of_logs = seconds_of(study.scenarios, policy, (logs.missing, logs.missing), "events")
    seconds = seconds_of(study.scenarios, policy, to_simulate, study.engine).plus(time_of_logs)
    return Planned(policy, missions.needed, present, logs.missing, most, seconds)


def _plan_bounds(study: Study, bounds: Count) -> Planned:
    """What a run would do for the upper bounds."""
    decisions = bounds.missing * sum(map(estimate_decisions, study.scenarios)) / study.size
    seconds = Range(*(decisions * of_decision for of_decision in BOUND))
    present = bounds.needed - bounds.missing
    return Planned("upper bounds", bounds.needed, present, most=bounds.needed, seconds=seconds)
