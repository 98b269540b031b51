"""The functions of ``import dess`` that run missions; they take policies and names of policies.

They stand above all packages, since the model takes policies and knows no names of them.
"""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from dess.base.floors import check_floors
from dess.model import batch, mission, years
from dess.model.record import MissionRecord, Records
from dess.model.state import spaces_of
from dess.scenario.scenario import AnyScenario, loaded
from dess.scenario.weather import refuse_weather


def simulate(
    scenario: AnyScenario,
    policy: Any,
    seed: int = 0,
    replication: int = 0,
    *,
    events: bool = False,
    processes: Sequence[mission.Process] = (),
    window: str | None = None,
) -> MissionRecord:
    """Simulate one mission with the SimPy model.

    Args:
        scenario: The scenario, or the space from which the replication draws its parameters; or
            what ``load_scenario`` takes.
        policy: A policy, or a list of policies; UAV i follows ``policy[i % len(policy)]``. A name
            stands for what ``dess.policies.load_team`` loads.
        seed: Seed of the study.
        replication: Number of the replication.
        events: Whether to keep the event log.
        processes: Further processes, functions of the ``Mission`` that yield SimPy events.
        window: With weather, the hour [UTC] in which a window begins, such as ``2013-02-09T14``:
            the window is simulated in its year, and there is no replication.

    Returns:
        The record of the mission.

    Raises:
        InputError: If the seed or the replication is out of range, or if the team has more policies
            than the largest fleet has UAVs; if there is no scenario or policy of a name, or a
            process yields nothing.
        ValueError: If a policy does not return actions.
    """
    team = load_policies(policy)
    scenario = loaded(scenario)
    starts = None
    if window is not None:
        begin = years.start_of_window(spaces_of([scenario])[0], team, seed, window)
        scenario, starts, replication = begin
    refuse_weather([scenario.weather])
    return mission.simulate(
        scenario, team, seed, replication, events=events, processes=processes, starts=starts
    )


def simulate_batch(
    scenario: AnyScenario | Sequence[AnyScenario],
    policy: Any,
    seed: int = 0,
    replications: Sequence[int] | int = 1,
    *,
    workers: int = 1,
    batch_size: int = batch.BATCH_SIZE,
    progress: Callable[[int], object] | None = None,
) -> Records:
    """Simulate many missions in lockstep.

    Args:
        scenario: One scenario or space for all missions, or one per mission; or what
            ``load_scenario`` takes.
        policy: A policy, or a list of policies; UAV i follows ``policy[i % len(policy)]``. A name
            stands for what ``dess.policies.load_team`` loads.
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
            scenario or policy of a name.
        ValueError: If a policy does not return actions.
    """
    if isinstance(scenario, str) or not isinstance(scenario, Sequence):
        scenario = loaded(scenario)
    return batch.simulate_batch(
        scenario,
        load_policies(policy),
        seed,
        replications,
        workers=workers,
        batch_size=batch_size,
        progress=progress,
    )


def load_policies(policy: Any) -> list[Any]:
    """The policies of a team, each name replaced by the policies that it stands for.

    Args:
        policy: A policy or the name of one or more, or a list of these.

    Raises:
        InputError: If there is no policy of a name, or no ``dess.policies``.
    """
    check_floors()
    from dess.policies import load_team

    members: Sequence[Any] = [policy]
    if isinstance(policy, list | tuple):
        members = policy
    team: list[Any] = []
    for member in members:
        if isinstance(member, str | Path):
            team.extend(load_team(str(member)))
        else:
            team.append(member)
    return team
