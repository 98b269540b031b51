"""What work takes, in time and in memory: what takes too much is refused before it begins.

The command line refuses what would take more than ``LONG_RUN`` or more memory than is available,
unless ``--yes`` is given. Functions of Python have the same checks where they have the argument
``yes``; ``run_study``, ``evaluate`` and ``simulate_batch`` do what they are asked to do.
"""

import math
import time
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from analysis import numbers
from analysis.execution.engines import simulate_missions
from dess import InputError
from dess.code.memory import check_memory
from dess.scenario import ScenarioSpace

Clock = Callable[[], float]

MAX_WORKERS = 1024
# The memory [bytes] of a process, without what processes share: 119 MiB were measured with greedy,
# 297 with a learned policy.
WORKER_MEMORY = 300 * 2**20

# Missions that are timed to estimate the time of all: ONE, if it takes longer than SLOW seconds;
# otherwise TRIAL, or LONG_TRIAL if TRIAL missions take less than ENOUGH seconds.
ONE, TRIAL, LONG_TRIAL = 1, 48, 240
SLOW, ENOUGH = 5.0, 0.2
TRIAL_SEED = 400_000_000

# A run that takes longer than this [s] has to be confirmed. Few missions need no estimate.
LONG_RUN, FEW = 3600.0, 10_000
ORDINARY = 3 * 500  # UAVs times mission slots of the missions that FEW counts

# In the SimPy engine: the time of an event [s], with its share of the decisions, and the memory of
# a packet [bytes], with its share of the event log.
EVENT, PACKET_MEMORY = 5e-5, 400

CONFIRMED = "--yes, or less"  # in Python: yes=True


def check_workers(workers: int) -> None:
    """Refuse a number of workers that is out of range.

    Raises:
        InputError: If it is below 1 or above ``MAX_WORKERS``.
    """
    if not 1 <= workers <= MAX_WORKERS:
        raise InputError(f"workers: {workers} is out of range; allowed: 1..{MAX_WORKERS:,}")


def are_few(missions: int, space: ScenarioSpace) -> bool:
    """Whether missions are so few and so short that no estimate of their time is needed."""
    longer = (space.uavs[1] * space.max_slots + space.packets) / ORDINARY
    return missions * max(longer, 1.0) <= FEW


def seconds_per_mission(
    spaces_of: Callable[[int], Sequence[ScenarioSpace]],
    team: Sequence[Any],
    engine: str = "batch",
    clock: Clock = time.perf_counter,
) -> float:
    """The mean time of a mission [s], measured on some missions.

    Args:
        spaces_of: Returns the scenarios of that many missions.
        team: The policies.
        engine: ``batch`` or ``events``.
        clock: Returns the time [s].
    """

    def trial(missions: int) -> float:
        spaces = spaces_of(missions)
        begin = clock()
        simulate_missions(engine, spaces, team, TRIAL_SEED, range(missions))
        return (clock() - begin) / missions

    trial(ONE)  # compiles
    if (seconds := trial(ONE)) > SLOW:
        return seconds
    seconds = trial(TRIAL)
    return trial(LONG_TRIAL) if seconds * TRIAL < ENOUGH else seconds


def check_time(what: str, seconds: float, allowed: str = CONFIRMED) -> None:
    """Refuse work that takes long.

    Args:
        what: The work and its size.
        seconds: The estimated time [s].
        allowed: What is allowed instead.

    Raises:
        InputError: If it takes more than ``LONG_RUN``.
    """
    if seconds > LONG_RUN:
        raise InputError(f"{what}, about {numbers.duration(seconds)}; allowed: {allowed}")


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
    return PACKET_MEMORY * space.packets + steps + space.chart.ways.nbytes
