"""What work takes, in time and in memory: what takes too much is refused before it begins.

Times are ranges, computed from the times of decisions that were measured once for every shipped
policy: nothing is compiled or simulated for them, so they take no time, and are the same each time.
Another machine, sea or mission may take ``SPREAD`` times as long or as short.

The command line refuses what would take more than ``LONG_RUN`` by the lower end of its range or
more memory than is available, unless ``--yes`` is given. Functions of Python have the same checks
where they have the argument ``yes``; ``run_study``, ``evaluate`` and ``simulate_batch`` do what
they are asked to do.
"""

import math
from collections.abc import Iterable, Sequence
from typing import NamedTuple, Self

from analysis import numbers
from analysis.study.best import SECONDS, decisions
from dess import InputError
from dess.code.memory import check_memory
from dess.scenario import ScenarioSpace
from policies.registry import SHIPPED, folder_of

MAX_WORKERS = 1024
# The memory [bytes] of a process, without what processes share: 119 MiB were measured with greedy,
# 297 with a learned policy.
WORKER_MEMORY = 300 * 2**20

# A run that takes longer than this [s] has to be confirmed.
LONG_RUN = 3600.0
SPREAD = 3.0  # how much longer or shorter than here missions may take elsewhere

# The times of a decision [s] on one core, of the shipped policies, of other trained ones, and of
# classes of others, in which anything may happen.
_SECONDS = SECONDS | {"planner-long": 3e-3, "ddqn-paper": 7e-5}
_SECONDS |= dict.fromkeys(("ddqn", "ddqn-2", "ddqn-3"), 6e-6)
_HEURISTIC, _TRAINED, _OTHER = (2e-6, 2e-6), (5e-6, 7e-5), (2e-6, 1e-3)
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
        """The ends in words, such as ``5 seconds to 2 minutes``."""
        low, high = (numbers.duration(max(end, 2.0)) for end in self)
        if self.low < 2.0:
            return f"up to {high}"
        return f"{low.removesuffix(high[high.index(' ') :])} to {high}"


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is out of range.

    Raises:
        InputError: If it is below 1 or above ``MAX_WORKERS``.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise InputError(f"workers: {workers} is out of range; allowed: 1..{MAX_WORKERS:,}")


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
    each = [_decision(name) for name in team.split(",")]
    more = EVENTS if engine == "events" else 0.0
    made = sum(map(decisions, spaces)) / len(spaces) / workers
    low, high = (sum(of) / len(each) + more for of in zip(*each, strict=True))
    return Range(missions[0] * made * low / SPREAD, missions[1] * made * high * SPREAD)


def _decision(policy: str) -> tuple[float, float]:
    """The least and the largest time of a decision of a policy [s]."""
    if policy in _SECONDS:
        return _SECONDS[policy], _SECONDS[policy]
    if policy in SHIPPED:
        return _HEURISTIC
    return _TRAINED if folder_of(policy) else _OTHER


def check_time(what: str, seconds: float | Range, allowed: str = CONFIRMED) -> None:
    """Refuse work that takes long, by the lower end of its range.

    Args:
        what: The work and its size.
        seconds: The estimated time [s].
        allowed: What is allowed instead.

    Raises:
        InputError: If it takes more than ``LONG_RUN``.
    """
    if (seconds.low if isinstance(seconds, Range) else seconds) > LONG_RUN:
        text = seconds if isinstance(seconds, Range) else numbers.duration(seconds)
        raise InputError(f"{what}, about {text}; allowed: {allowed}")


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
    seconds = earlier + sum(map(_longest, spaces))
    check_time(f"{what}: {len(spaces)} missions to simulate", seconds)
    for space in spaces:
        check_memory(f"{what}: a mission", mission_memory(space), CONFIRMED)
    return seconds


def _longest(space: ScenarioSpace) -> float:
    """The longest time that the SimPy engine takes for a mission [s]."""
    arrivals = len(space.nodes) * space.arrival_rate * space.max_slots
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
    each = max(map(mission_memory, spaces)) + (WORKER_MEMORY if are_processes else 0)
    check_memory(what, workers * each + more, CONFIRMED)


def mission_memory(space: ScenarioSpace) -> float:
    """The memory [bytes] of the packets, and the tables of ``dess.channel.World``, all filled."""
    nodes = len(space.nodes)
    steps = 5 * math.prod(space.size) * (8 * nodes * space.communication_slots + 2 * (nodes + 1))
    ways = space.chart.ways
    return PACKET_MEMORY * space.packets + steps + (0 if ways is None else ways.nbytes)
