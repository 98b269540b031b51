"""The batch engine: compiled code that advances many missions together, slot by slot.

    >>> records = simulate_batch(load_scenario("paper"), dess.policies.load("greedy"), 1, range(10))
    >>> records.missions["success"].tolist()
    [1, 1, 1, 1, 1, 1, 1, 1, 1, 1]

Like the SimPy model it calls ``rules.py``, so both give the same records. A batch has a fixed
number of places; when a mission ends, the next mission takes its place. A policy is called once per
slot for all UAVs of the batch. Missions are independent, so their records depend neither on the
order of the missions nor on how they are divided into batches.
"""

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ThreadPoolExecutor, as_completed
from threading import Event
from typing import Any

import numpy as np

from dess.base.errors import InputError, shown
from dess.base.kernels import kernel
from dess.model import rules
from dess.model.campaign import Campaign, check_years
from dess.model.channel import Site, empty_scratch, world_of
from dess.model.record import Records, empty_records_of, write_record
from dess.model.state import check_seed, peak_values, spaces_of, starts_of, state_of
from dess.model.view import decide, team_of
from dess.model.ways import MOST_ENTRIES, Ways
from dess.model.years import Years, most_places
from dess.physics.fleet import slowest
from dess.physics.landing import is_over
from dess.scenario.scenario import AnyScenario, ScenarioSpace

# Enough missions that the time spent in Python is a small part, few enough for the CPU's cache.
BATCH_SIZE = 256
# The most work of a slot of all missions in progress, in units of about 3 ns: for Ctrl-C, which
# waits for compiled code, and for memory.
MOST_WORK = 2**26


def simulate_batch(
    scenario: AnyScenario | Sequence[AnyScenario],
    policy: Any,
    seed: int = 0,
    replications: Sequence[int] | int = 1,
    *,
    workers: int = 1,
    batch_size: int = BATCH_SIZE,
    progress: Callable[[int], object] | None = None,
) -> Records:
    """Simulate many missions in lockstep.

    Args:
        scenario: One scenario or space for all missions, or one per mission; or what
            ``load_scenario`` takes.
        policy: A policy, or a list of policies; UAV i follows ``policy[i % len(policy)]``.
        seed: Seed of all missions.
        replications: The replication numbers, or a number n for the replications 0 to n - 1.
            With weather, each is a year.
        workers: Number of threads; the compiled code does not hold Python's global lock.
        batch_size: Missions in progress per thread; fewer if a slot of them would take long.
        progress: Called with the number of missions finished since its last call.

    Returns:
        The records, in the order of ``replications``; ``workers`` and ``batch_size`` do not
        change them.

    Raises:
        InputError: If the seed or a replication is out of range, if the team has more policies
            than the largest fleet has UAVs, or if a scenario needs the SimPy engine; if there is no
            scenario of a name.
        ValueError: If a policy does not return actions.
    """
    numbers = _numbers(replications)
    for number in (numbers.min(), numbers.max()) if len(numbers) else ():
        check_seed(seed, int(number))
    if min(workers, batch_size) < 1:
        raise ValueError("workers and batch_size must be at least 1")
    if isinstance(scenario, str) or not isinstance(scenario, Sequence):
        scenario = [scenario] * len(numbers)
    if len(scenario) != len(numbers):
        raise ValueError(f"{len(scenario)} scenarios for {len(numbers)} replications")
    distinct = {id(space): space for space in scenario}
    row = {identity: number for number, identity in enumerate(distinct)}
    kinds = np.array([row[id(space)] for space in scenario], np.int64)
    spaces = spaces_of([*distinct.values()])
    check_slotted(spaces)
    check_years(spaces, numbers)
    team = team_of(policy, spaces)
    records = empty_records_of(spaces, len(numbers))

    tasks, stopped = [], Event()
    for members in _by_world(spaces):
        jobs = np.nonzero(np.isin(kinds, members))[0]
        which = np.searchsorted(members, kinds)  # valid only at the indices in ``jobs``
        group = [spaces[member] for member in members]
        for part in np.array_split(jobs, min(workers, len(jobs))):
            source = (starts_of(group, seed), which, numbers, part)
            tasks.append((group, team, source, batch_size, records, progress, stopped))
    _run_all(tasks, workers, stopped)
    return records


def _run_all(tasks: list[tuple], workers: int, stopped: Event) -> None:
    """Run tasks here or in threads; after an error or Ctrl-C, no thread begins a further slot."""
    if workers == 1:
        for task in tasks:
            _run(*task)
        return
    with ThreadPoolExecutor(workers) as pool:
        try:
            for future in as_completed([pool.submit(_run, *task) for task in tasks]):
                future.result()
        finally:
            stopped.set()


def check_slotted(spaces: Iterable[ScenarioSpace]) -> None:
    """Refuse scenarios that only the SimPy engine can simulate.

    Raises:
        InputError: If there is one.
    """
    for space in spaces:
        if space.needs_events:
            raise InputError(
                "arrivals.process",
                f"{space.arrivals.process} needs the SimPy engine",
                "the engine events, or slotted",
            )


def work_of(space: ScenarioSpace) -> int:
    """The most work of a slot of a mission: the loops of the engine, the guard and the policies."""
    nodes, fleet = len(space.nodes), space.uavs[1]
    work_of_uav = nodes * (nodes + space.communication_slots) + fleet * len(space.chart.parking)
    return fleet * work_of_uav + peak_values([space])


def _numbers(replications: Sequence[int] | int) -> np.ndarray:
    """The replication numbers as an array of integers."""
    numbers = np.asarray(replications)
    if numbers.ndim == 0 and numbers.dtype.kind in "iu" and numbers >= 0:
        return np.arange(int(numbers))
    if numbers.ndim != 1 or (len(numbers) and numbers.dtype.kind not in "iu"):
        raise InputError("replications", shown(replications), "a number, or integers")
    return numbers.astype(np.int64)


def _by_world(spaces: list[ScenarioSpace]) -> list[np.ndarray]:
    """The indices of the scenarios, grouped by what a batch must share."""
    groups: dict[tuple, list[int]] = {}
    for member, space in enumerate(spaces):
        # The return guard needs tables of ways in none of them or in all.
        has_costs = space.wind.blows or space.consumption.is_on
        key = (Site.of(space), space.is_extended, has_costs, space.weather.is_on)
        groups.setdefault(key, []).append(member)
    return [part for members in groups.values() for part in _by_energy(spaces, members)]


def _by_energy(spaces: list[ScenarioSpace], members: list[int]) -> list[np.ndarray]:
    """The indices of scenarios in groups, the tables of whose ways have room in memory."""
    chart = spaces[members[0]].chart
    entries = len(chart.parking) * slowest(spaces[members[0]].fleet) * chart.zones.size
    most = max(MOST_ENTRIES // entries, 1)
    numbers: dict[tuple, int] = {}
    groups: dict[int, list[int]] = {}
    for member in members:
        energy = (spaces[member].wind, spaces[member].consumption)
        number = numbers.setdefault(energy, len(numbers))
        groups.setdefault(number // most, []).append(member)
    return [np.array(group) for group in groups.values()]


def _run(spaces, team, source, batch_size, records, progress, stopped) -> None:
    """Simulate missions that share one grid with its nodes and channel, and write their records."""
    jobs, world = source[-1], world_of(spaces[0])
    if spaces[0].weather.is_on:
        _run_years(spaces, team, source, batch_size, records, progress, stopped)
        return
    size = min(batch_size, len(jobs), max(MOST_WORK // max(map(work_of, spaces)), 1))
    state = state_of(spaces, size)
    scratch = empty_scratch(state.uavs.shape[1], len(world.nodes))
    job_of = np.full(size, -1)
    queue = np.array([0, 0])  # next job, jobs done
    for b in range(size):
        _next_mission(b, job_of, queue, source, state)
    ways = Ways(source[0].constants, world.chart)
    shown = world.shown()
    # Reporting holds Python's global lock, so about a hundred reports are made in all.
    reported, step = 0, max(1, len(jobs) // 100)
    while queue[1] < len(jobs) and not stopped.is_set():
        decide(team, state, shown, ways)
        _advance(job_of, queue, source, state, world, scratch, ways.home, records)
        if progress and (queue[1] >= reported + step or queue[1] == len(jobs)):
            progress(int(queue[1]) - reported)
            reported = int(queue[1])


def _run_years(spaces, team, source, batch_size, records, progress, stopped) -> None:
    """Simulate years of fleets that share one grid, and write their records."""
    starts, which, numbers, jobs = source
    seed, world = int(starts.constants["seed"][0]), world_of(spaces[0])
    size = min(batch_size, most_places(spaces, world.chart))
    for part in np.array_split(jobs, -(-len(jobs) // size)):
        campaigns = [Campaign(spaces[which[job]], seed, int(numbers[job])) for job in part]
        Years(campaigns, world).run(team, records, part.tolist(), progress, stopped)


@kernel
def _next_mission(b, job_of, queue, source, state):
    """Start the next job in place ``b``; if no job is left, the place stays empty."""
    starts, which, numbers, jobs = source
    if queue[0] == len(jobs):
        job_of[b] = -1
        state.missions[b].active = 0
        return
    job = jobs[queue[0]]
    queue[0] += 1
    job_of[b] = job
    rules.launch(state, b, starts, which[job], numbers[job])


@kernel
def _advance(job_of, queue, source, state, world, scratch, ways, records):
    """Advance every mission by one slot; a mission that ends is recorded and replaced."""
    for b in range(len(job_of)):
        if job_of[b] < 0:
            continue
        rules.run_slot(state, b, world, scratch)
        if is_over(state.missions[b]):
            write_record(state, b, ways, records, job_of[b])
            queue[1] += 1
            _next_mission(b, job_of, queue, source, state)
