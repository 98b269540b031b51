"""Evaluate single teams: many missions of one scenario, kept as records or as means alone."""

from collections import defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import reduce
from math import nan
from time import perf_counter
from typing import NamedTuple

import numpy as np
import pandas as pd

from dess import InputError, simulate_batch
from dess.analysis import numbers
from dess.analysis.execution import effort
from dess.analysis.execution.jobs import (
    Job,
    MissionsJob,
    Problem,
    Progress,
    chunk_size,
    simulate_missions,
)
from dess.analysis.execution.workers import Pool, pool_of
from dess.analysis.measured import measured_in, recorded_metrics
from dess.analysis.metric_ranges import metric_in_space
from dess.analysis.metrics import METRICS, NODES_BEHIND, WINDOWS, columns_in_units
from dess.analysis.results.chunks import split_into_chunks
from dess.analysis.results.manifest import Cell, CellPart
from dess.analysis.results.parquet import columns_of_nodes
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import compare
from dess.analysis.stats.intervals import Moments
from dess.analysis.stats.weights import moments_of_space
from dess.analysis.stats.worst_node import moments_of_worst_node
from dess.base.errors import check_type
from dess.model.processes import load_processes
from dess.model.record import (
    AGES_OF_MONTHS,
    MISSION_RECORD,
    NODE_RECORD,
    OPERATIONS,
    UAV_RECORD,
    YEAR_OPERATIONS,
    Records,
)
from dess.model.state import check_seed, spaces_of
from dess.model.view import check_team
from dess.physics.streams import MAX_REPLICATION
from dess.policies.registry import Policy, load_team
from dess.scenario.scenario import AnyScenario, ScenarioSpace

# The memory of the records of missions whose values are added up together [bytes]; the last bits of
# sums depend on it.
MEMORY = 2**24
# By metric, or the metric and a node, and by number of UAVs.
Key = str | tuple[str, int]
ByFleet = dict[Key, dict[int, Moments]]
# Of how many missions the values are kept by which policies are compared: some 50 MB.
MOST_COMPARED = 1_000_000
_COMPARED = ["replication", "uavs", *METRICS]


class Asked(NamedTuple):
    """Missions of one team.

    Attributes:
        scenario: The scenario space from which they are drawn.
        team: ``"P"`` or ``"P,P,..."``.
        missions: Number of missions: replications 0, 1, ...
        seed: Seed of the missions.
        engine: ``batch`` or ``events``.
        workers: Threads of the batch engine, processes of the event engine.
        run_files: Whether Python files of the team may be run, since a user has typed it.
        processes: The processes of the user in every mission, who has typed them.
        scheduler: Address of a ``dask.distributed`` scheduler on which to run instead.
    """

    scenario: ScenarioSpace
    team: str
    missions: int = 1000
    seed: int = 0
    engine: str = "batch"
    workers: int = 1
    run_files: bool = False
    processes: tuple[str, ...] = ()
    scheduler: str | None = None

    def load_policies(self) -> list[Policy]:
        """The policies of the team."""
        return load_team(self.team, run_files=self.run_files)

    def check(self) -> None:
        """Refuse numbers that are out of range, and teams that are unknown or too large."""
        effort.check_workers(self.workers)
        if not 1 <= self.missions <= MAX_REPLICATION + 1:
            allowed = f"1..{MAX_REPLICATION + 1:,}"
            raise InputError("missions", f"{self.missions} is out of range", allowed)
        check_seed(self.seed, self.missions - 1)
        check_team(len(self.load_policies()), [self.scenario])


class Evaluation(NamedTuple):
    """Many missions of one team.

    Attributes:
        policy: The team.
        moments: For each metric its moments, which have its mean and interval. What an extended
            scenario measures is among the metrics; missions without a value are left out.
        uav_slots: Mission slots in which a UAV was active, summed over the UAVs of all missions.
        seconds: Time of the simulation [s], without compilation and the start of workers; nan where
            results are kept, of which some may have been there.
        records: The records of the missions; None if only their moments are kept.
        compared: What policies are compared by, a row per mission; None of more than
            ``MOST_COMPARED`` missions.
    """

    policy: str
    moments: dict[str, Moments]
    uav_slots: int
    seconds: float
    records: Records | None = None
    compared: pd.DataFrame | None = None


def evaluate(
    scenario: AnyScenario,
    team: str,
    missions: int = 1000,
    seed: int = 0,
    engine: str = "batch",
    workers: int = 1,
    progress: Progress | None = None,
) -> Evaluation:
    """Simulate replications 0, 1, ... of a team, and measure the time.

    The records of all missions are kept, some 300 bytes for each of them; ``estimate_means`` need
    not.

    Args:
        scenario: The scenario space from which the missions are drawn, or what ``load_scenario``
            takes.
        team: ``"P"`` or ``"P,P,..."``.
        missions: Number of missions.
        seed: Seed of the missions.
        engine: ``batch`` or ``events``.
        workers: Threads of the batch engine, processes of the event engine.
        progress: Called with the number of missions done since its last call.

    Raises:
        InputError: If a policy is unknown, a number is out of range, or the team has more policies
            than the largest fleet has UAVs.
    """
    check_type("policy", team, str, "a name such as greedy, or names such as greedy,tour")
    (space,) = spaces_of([scenario])
    asked = Asked(space, team, missions, seed, engine, workers, run_files=True)
    return _evaluate_in_parts(asked, missions, progress)


def estimate_means(asked: Asked, progress: Progress | None = None) -> Evaluation:
    """The metrics of replications 0, 1, ... of a team, in a memory that does not grow with them.

    The number of workers does not change the result.

    Args:
        asked: The missions.
        progress: Called with the number of missions done since its last call.

    Raises:
        InputError: If a policy is unknown, a number is out of range, or the team has more policies
            than the largest fleet has UAVs.
    """
    return _evaluate_in_parts(asked, _missions_at_once(asked.scenario), progress)


def _evaluate_in_parts(asked: Asked, size: int, progress: Progress | None) -> Evaluation:
    """The evaluation, by ``size`` missions at a time; their records are kept if these are all."""
    asked.check()
    moments: ByFleet = {}
    uav_slots, seconds = 0, 0.0
    records: Records | None = None
    values: list[pd.DataFrame] = []
    pieces = (range(n, min(n + size, asked.missions)) for n in range(0, asked.missions, size))
    for records, took in _simulate_pieces(asked, pieces, progress):
        _add_to_moments(moments, _metric_values(records, asked.scenario), records.missions["uavs"])
        if asked.missions <= MOST_COMPARED:
            values.append(_compared_columns(records))
        uav_slots += int(records.missions["uav_slots"].sum())
        seconds += took
    kept = None
    if size >= asked.missions:
        kept = records
    over_space = _over_space(moments, asked.scenario, asked.missions)
    compared = pd.concat(values, ignore_index=True) if values else None
    return Evaluation(asked.team, over_space, uav_slots, seconds, kept, compared)


def _compared_columns(records: Records) -> pd.DataFrame:
    """What policies are compared by, and of years with weather the windows, which tell them."""
    columns = pd.DataFrame(records.missions[_COMPARED])
    if WINDOWS in (records.operations.dtype.names or ()):
        columns[WINDOWS] = records.operations[WINDOWS]
    return columns


def of_results(results: Results) -> list[Evaluation]:
    """The evaluations of the teams of a study that has the scenario as its only design point."""
    evaluations = []
    for team, rows in results.missions.groupby("policy", sort=False):
        metrics: dict[Key, np.ndarray] = {n: rows[n].to_numpy(float) for n in recorded_metrics()}
        names = [name for name in YEAR_OPERATIONS.names or () if name not in AGES_OF_MONTHS]
        measured = [name for name in names if name in rows]
        for name in (*measured, *measured_in(rows)):  # as they are measured, then in units
            if name not in NODES_BEHIND:
                metrics[name] = rows[name].to_numpy(float)
        moments: ByFleet = {}
        _add_to_moments(moments, metrics | _values_by_node(rows), rows["uavs"].to_numpy())
        over_space = _over_space(moments, results.scenario(), len(rows))
        uav_slots = int(rows["uav_slots"].sum())
        columns = [*_COMPARED, *(name for name in [WINDOWS] if name in rows)]
        evaluation = Evaluation(str(team), over_space, uav_slots, nan, compared=rows[columns])
        evaluations.append(evaluation)
    return evaluations


def compare_with_first(evaluations: Sequence[Evaluation]) -> pd.DataFrame:
    """Every other team compared with the first one, mission by mission.

    Returns:
        A row per team and metric of ``METRICS``, as ``dess.analysis.compare`` returns it; empty if
        there is one team, or the values of the missions were not kept.
    """
    tables = [e.compared.assign(policy=e.policy) for e in evaluations if e.compared is not None]
    if len(tables) < 2 or len(tables) < len(evaluations):
        return pd.DataFrame()
    return compare(pd.concat(tables), evaluations[0].policy, [*METRICS])


def _add_to_moments(
    moments: ByFleet, metrics: Mapping[Key, np.ndarray], fleets: np.ndarray
) -> None:
    """Add the metrics of missions, by the number of UAVs of each; those without a value are not."""
    for metric, values in metrics.items():
        for fleet in np.unique(fleets[~np.isnan(values)]):
            new = Moments.of(values[(fleets == fleet) & ~np.isnan(values)])
            old = moments.setdefault(metric, {}).get(fleet)
            if old:
                moments[metric][int(fleet)] = old.with_others(new)
            else:
                moments[metric][int(fleet)] = new


def _over_space(moments: ByFleet, space: ScenarioSpace, missions: int) -> dict[str, Moments]:
    """The moments of every metric over the space; of nodes those of the worst one."""
    fleets = range(space.uavs[0], space.uavs[1] + 1)
    over_space: dict[str, Moments] = {}
    by_node: dict[str, list[Moments]] = defaultdict(list)
    for key, by_fleet in moments.items():
        whole = moments_of_space([by_fleet.get(n) for n in fleets], missions)
        if isinstance(key, str):
            over_space[key] = whole
        else:
            by_node[key[0]].append(whole)
    for metric, nodes in by_node.items():
        over_space[metric] = moments_of_worst_node(nodes, metric_in_space(metric, space))
    return over_space


def _metric_values(records: Records, space: ScenarioSpace) -> dict[Key, np.ndarray]:
    """The values of every metric that some of the missions have measured, in units as well."""
    values = {metric: records.missions[metric] for metric in recorded_metrics()}
    if len(records.operations):
        names = records.operations.dtype.names or ()
        measured = [name for name in names if name not in AGES_OF_MONTHS]
        values |= {name: records.operations[name] for name in measured}
    if space.units:
        values |= columns_in_units(values, space.units)
    metrics: dict[Key, np.ndarray] = {m: column.astype(float) for m, column in values.items()}
    if not space.units:
        return metrics
    nodes = pd.DataFrame(columns_of_nodes(records))
    return metrics | _values_by_node(nodes.assign(**columns_in_units(nodes, space.units)))


def _values_by_node(missions: pd.DataFrame) -> dict[Key, np.ndarray]:
    """The values of every node, of the metrics of the worst one that missions have."""
    values: dict[Key, np.ndarray] = {}
    for metric, nodes in NODES_BEHIND.items():
        if nodes in missions:
            by_node = np.stack(missions[nodes].to_numpy())
            values |= {(metric, node): of_node for node, of_node in enumerate(by_node.T)}
    return values


def check_evaluation(asked: Sequence[Asked], yes: bool = False) -> None:
    """Refuse means of several teams that could not come to their end, before the first mission.

    Args:
        asked: For each team its missions, which differ in nothing else.
        yes: Whether any time and memory is allowed.

    Raises:
        InputError: If a team is unknown or cannot act in the scenario, or a number is out of range;
            if it would take long, or more memory than is available.
    """
    for team in asked:
        team.check()
    scenario, workers, engine = asked[0].scenario, asked[0].workers, asked[0].engine
    missions = sum(team.missions for team in asked)
    counted = numbers.format_count(missions, "mission")
    what = f"evaluate: {counted} (policies: {len(asked)}, workers: {workers:,})"
    if not yes:
        effort.check_workers_memory(what, workers, [scenario], 4 * MEMORY, engine == "events")
        times = [
            effort.seconds_of(
                [scenario], team.team, (team.missions, team.missions), engine, workers
            )
            for team in asked
        ]
        effort.check_time(what, reduce(effort.Range.plus, times))
    for team in asked[1:]:  # the first one is refused at its first mission
        processes = load_processes(team.processes)
        policies = team.load_policies()
        simulate_missions(engine, [scenario], policies, team.seed, [0], processes=processes)


def _missions_at_once(scenario: ScenarioSpace) -> int:
    """Number of missions to simulate together: a power of two whose records fit in ``MEMORY``."""
    memory_of_mission = MISSION_RECORD.itemsize + scenario.uavs[1] * UAV_RECORD.itemsize
    if scenario.is_extended:
        memory_of_mission += OPERATIONS.itemsize
    if scenario.units:
        memory_of_mission += len(scenario.nodes) * NODE_RECORD.itemsize
    return 2 ** ((MEMORY // memory_of_mission).bit_length() - 1)


def _simulate_pieces(
    asked: Asked, pieces: Iterable[range], progress: Progress | None
) -> Iterator[tuple[Records, float]]:
    """The records of each piece of the replications, and the time of the simulation alone [s]."""
    with pool_of(asked.workers, asked.scheduler) as pool:
        _warm_up(asked, pool)
        for piece in pieces:
            begin = perf_counter()
            if asked.engine == "batch" and not asked.scheduler:
                about = (asked.scenario, asked.load_policies(), asked.seed, piece)
                records = simulate_batch(*about, workers=asked.workers, progress=progress)
            else:
                records = _results_in_order(pool, _jobs(asked, piece), progress)
            yield records, perf_counter() - begin


def _warm_up(asked: Asked, pool: Pool) -> None:
    """Compile the batch engine, or start the processes of this machine."""
    if asked.scheduler:
        return
    if asked.engine == "batch":
        simulate_batch(asked.scenario.without_weather(), asked.load_policies(), asked.seed, 1)
        return
    starts = 1 if asked.workers == 1 else 2 * asked.workers
    _results_in_order(pool, _jobs(asked, range(1)) * starts)


def _jobs(asked: Asked, replications: range) -> list[Job]:
    """The jobs of some missions."""
    size = chunk_size(asked.engine, asked.load_policies())
    chunks = split_into_chunks([CellPart(Cell(0, 0, "", 0), replications)], size)
    spaces = (asked.scenario,)
    about = (asked.team, asked.seed, asked.engine, asked.run_files, asked.processes)
    return [MissionsJob(chunk, spaces, *about) for chunk in chunks]


def _results_in_order(pool: Pool, jobs: Sequence[Job], progress: Progress | None = None) -> Records:
    """The records of all jobs, in the order of the jobs.

    Raises:
        RuntimeError: If one of them failed.
    """
    done = dict(pool.run(jobs, progress))
    for result in done.values():
        if isinstance(result, Problem):
            raise RuntimeError(f"{result.error}\n{result.traceback}")
    chunks = (done[number] for number in range(len(jobs)))
    return Records(*(np.concatenate(kind) for kind in zip(*chunks, strict=True)))
