"""Missions that only the page on verification needs: simulated before the page, kept in a file.

``dess report`` simulates missions of the study ``verification`` again with the SimPy engine, and
missions of a single UAV with both engines. The page reads them and simulates nothing::

    make("results", results)
    missions = read("results", results)
    records.engine_check(results, missions)
"""

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import Field, create_model

from analysis.questions.missions import FOLDER
from analysis.results.provenance import Key
from analysis.results.tables import Results
from analysis.study.stopping import Text
from analysis.verification import lone_uav
from dess import InputError, simulate
from dess.files.documents import Document, Outdated
from dess.files.reading import Missing
from dess.files.writing import check_target, write_file
from dess.record import MISSION_RECORD, UAV_RECORD, MissionRecord
from dess.state import END_NAMES
from policies.registry import files_of, load_team

STUDY = "verification"
FILE = Path(FOLDER, "missions.json")  # in the folder of all results
MISSIONS = 50  # missions of every policy to simulate again, spread over its replications

# Called with the number of steps done and of all steps.
Progress = Callable[[int, int], None]

_ALLOWED = "what is made by: dess report verification"


def _fields(record: np.dtype) -> dict[str, Any]:
    """The fields of a record, as those of a model."""
    assert record.fields is not None
    kinds = {name: kind for name, (kind, *_) in record.fields.items()}
    return {name: (float if kind.kind == "f" else Whole, ...) for name, kind in kinds.items()}


Whole = Annotated[int, Field(ge=-(2**63), lt=2**64)]
Data = Annotated[float, Field(ge=0, le=1e9)]
Mission: Any = create_model(
    "Mission", __base__=Document, policy=(Text, ...), **_fields(MISSION_RECORD)
)
_OF_UAV = {"policy": (Text, ...), "replication": (Whole, ...), "uav": (Whole, ...)}
Uav: Any = create_model(
    "Uav", __base__=Document, **_OF_UAV | _fields(UAV_RECORD) | {"end": (Text, ...)}
)


class CrossCheck(Document):
    """Missions simulated in addition to those of a study.

    Attributes:
        study: The key of the study, a hash of all that its records depend on.
        missions: Records by the SimPy engine, each with its ``policy``.
        uavs: The records of their UAVs, each with ``policy``, ``replication`` and ``uav``.
        rates: The result of ``lone_uav.simulate_rates``.
        slots: The result of ``lone_uav.simulate_slots``.
    """

    study: Key
    missions: list[Mission]
    uavs: list[Uav]
    rates: list[Data]
    slots: list[Data] = Field(min_length=2)


def simulate_missions(
    results: Results, count: int = MISSIONS, progress: Progress | None = None
) -> CrossCheck:
    """Simulate the missions; those of policies that are classes of Python files are left out.

    Args:
        results: The results of the study.
        count: Missions of every policy to simulate again, all of them if there are fewer.
        progress: Called after every mission.
    """
    space, seed = results.scenario(), results.store.manifest.seed
    teams = {name: load_team(name) for name in results.policies if not files_of(name)}
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
    )


def _chosen(results: Results, policies: Iterable[str], count: int) -> Iterator[tuple[str, int]]:
    """The policies and replications of the missions to simulate again, at the first point."""
    missions = results.missions[results.missions["point"] == 0]
    for policy in policies:
        replications = missions.loc[missions["policy"] == policy, "replication"].to_numpy()
        rows = np.unique(np.linspace(0, len(replications) - 1, count).astype(int))
        yield from ((policy, int(replication)) for replication in replications[rows])


def _uavs(record: MissionRecord) -> Iterator[dict[str, Any]]:
    for number, uav in enumerate(record.uavs):
        fields = {name: uav[name].item() for name in UAV_RECORD.names or ()}
        yield {"uav": number, **fields, "end": END_NAMES[uav["end"]]}


def make(folder: str | Path, results: Results, progress: Progress | None = None) -> None:
    """Simulate the missions and write them, unless the folder has those of these results.

    Args:
        folder: A folder that contains a results folder per study.
        results: The results of the study.
        progress: Called after every mission.

    Raises:
        InputError: If those of the folder are damaged, or new ones cannot be written.
    """
    try:
        read(folder, results)
    except (Missing, Outdated):
        check_target(Path(folder) / FILE)
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
    write_file(path, missions.model_dump_json(indent=1))
    return path


def read(folder: str | Path, results: Results) -> CrossCheck:
    """Read missions.

    Args:
        folder: A folder that contains a results folder per study.
        results: The results of the study to which the missions must belong.

    Raises:
        Missing: If there are none.
        Outdated: If they belong to other results.
        InputError: If they are damaged.
    """
    path, space, key = Path(folder) / FILE, results.scenario(), results.store.manifest.key
    missions = CrossCheck.load(path, _ALLOWED, fixed={"study": key})
    if len(missions.rates) != len(lone_uav.offsets(space)):
        raise InputError(f"{path}: rates: are not those of the study; allowed: {_ALLOWED}")
    return missions
