"""Missions that only the page on verification needs: simulated before the page, kept in a file.

``dess report`` simulates missions of the study ``verification`` again with the SimPy engine,
missions of a single UAV with both engines, and queues that theory knows. The page reads them and
simulates nothing::

    make("results", results)
    missions = read("results", results)
    records.engine_check(results, missions)
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from pydantic import BaseModel, ConfigDict, ValidationError

from analysis.questions.missions import FOLDER
from analysis.results.tables import Results
from analysis.verification import lone_uav
from analysis.verification.queues.suite import Measured
from analysis.verification.queues.suite import simulate as simulate_queues
from dess import InputError, simulate
from dess.files import replacing, writable
from dess.record import MISSION_RECORD, UAV_RECORD, MissionRecord
from dess.state import END_NAMES
from policies.registry import files_of, load_team

STUDY = "verification"
FILE = Path(FOLDER, "missions.json")  # in the folder of all results
MISSIONS = 50  # missions of every policy to simulate again, spread over its replications

# Called with the number of steps done and of all steps.
Progress = Callable[[int, int], None]
Fields = dict[str, Any]


class CrossCheck(BaseModel):
    """Missions simulated in addition to those of a study.

    Attributes:
        study: The key of the study, a hash of all that its records depend on.
        missions: Records by the SimPy engine, each with its ``policy``.
        uavs: The records of their UAVs, each with ``policy``, ``replication`` and ``uav``.
        rates: The result of ``lone_uav.simulate_rates``.
        slots: The result of ``lone_uav.simulate_slots``.
        queues: The result of ``queues.suite.simulate``.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    study: str
    missions: list[Fields]
    uavs: list[Fields]
    rates: list[float]
    slots: list[float]
    queues: Measured


def simulate_missions(
    results: Results, count: int = MISSIONS, progress: Progress | None = None
) -> CrossCheck:
    """Simulate the missions; those of policies that are classes of Python files are left out.

    Args:
        results: The results of the study.
        count: Missions of every policy to simulate again, all of them if there are fewer; and
            batches of each queue, at least 2.
        progress: Called after every mission.

    Raises:
        InputError: If there is no other policy.
    """
    space, seed = results.scenario(), results.store.manifest.seed
    teams = {name: load_team(name) for name in results.policies if not files_of(name)}
    if not teams:
        raise InputError(
            f"{results.store.folder}: has only policies of Python files, which are not simulated "
            "again; allowed: a study with another policy"
        )
    missions, uavs, chosen = [], [], [*_chosen(results, teams, count)]
    for done, (policy, replication) in enumerate(chosen, 1):
        record = simulate(space, teams[policy], seed, replication)
        fields = {name: record.metrics[name].item() for name in MISSION_RECORD.names or ()}
        missions.append({"policy": policy, **fields})
        uavs += [{"policy": policy, "replication": replication, **uav} for uav in _uavs(record)]
        if progress:
            progress(done, len(chosen))
    return CrossCheck(
        study=results.store.manifest.key,
        missions=missions,
        uavs=uavs,
        rates=lone_uav.simulate_rates(space, seed),
        slots=lone_uav.simulate_slots(space, seed),
        queues=simulate_queues(space, seed, max(count, 2)),
    )


def _chosen(results: Results, policies: Iterable[str], count: int) -> Iterator[tuple[str, int]]:
    """The policies and replications of the missions to simulate again, at the first point."""
    missions = results.missions[results.missions["point"] == 0]
    for policy in policies:
        replications = missions.loc[missions["policy"] == policy, "replication"].to_numpy()
        rows = np.unique(np.linspace(0, len(replications) - 1, count).astype(int))
        yield from ((policy, int(replication)) for replication in replications[rows])


def _uavs(record: MissionRecord) -> Iterator[Fields]:
    for number, uav in enumerate(record.uavs):
        fields = {name: uav[name].item() for name in UAV_RECORD.names or ()}
        yield {"uav": number, **fields, "end": END_NAMES[uav["end"]]}


def make(folder: str | Path, results: Results, progress: Progress | None = None) -> None:
    """Simulate the missions and write them, unless they are already in the folder.

    Args:
        folder: A folder that contains a results folder per study.
        results: The results of the study.
        progress: Called after every mission.

    Raises:
        InputError: If they cannot be written.
    """
    try:
        read(folder, results)
    except InputError:
        write(simulate_missions(results, progress=progress), folder)


def write(missions: CrossCheck, folder: str | Path) -> Path:
    """Write missions, in place of earlier ones, and return the file.

    Args:
        missions: The missions.
        folder: A folder that contains a results folder per study.

    Raises:
        InputError: If it cannot be written.
    """
    path = Path(folder) / FILE
    with writable(path):
        path.parent.mkdir(parents=True, exist_ok=True)
    with replacing(path) as temporary:
        temporary.write_text(missions.model_dump_json(indent=1), "utf-8")
    return path


def read(folder: str | Path, results: Results) -> CrossCheck:
    """Read missions.

    Args:
        folder: A folder that contains a results folder per study.
        results: The results of the study to which the missions must belong.

    Raises:
        InputError: If there are none, or they are damaged or belong to other results.
    """
    path = Path(folder) / FILE
    allowed = "allowed: what is made by: dess report verification"
    try:
        missions = CrossCheck.model_validate_json(path.read_bytes())
    except (OSError, ValidationError):
        raise InputError(f"{path}: missing or damaged; {allowed}") from None
    if missions.study != results.store.manifest.key:
        raise InputError(f"{path}: belongs to other results than those of the study; {allowed}")
    return missions
