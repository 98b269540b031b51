"""How the cost of a UAV-slot and the memory grow with a question.

Every line of the CSV is measured in a process of its own, one after the other. Times are of the
processor, not of a clock, so other processes disturb them little.

    python -m benchmarks.scale --measure benchmarks/scale.csv     # about 10 minutes
    python -m benchmarks.scale --table benchmarks/scale.csv
    python -m benchmarks.scale --draw benchmarks/scale.csv docs/scale.png

The cluster is simulated: its workers take the measured times of chunks, one after the other, and
one process stores what they return, in its measured time.
"""

import argparse
import heapq
import json
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
import pandas as pd

from dess import load_scenario, simulate_batch
from dess.analysis import numbers
from dess.analysis.execution import jobs
from dess.analysis.execution.runner import run_study
from dess.analysis.study.files import load_study
from dess.analysis.study.study import study_from
from dess.policies.registry import load_team
from dess.scenario.scenario import ScenarioSpace

SLOTS_PER_HOUR = 60
BASE = {"uavs": 4, "nodes": 25, "grid": 32, "hours": 8, "side": 9}
# The values of every axis; the other numbers are those of ``BASE``.
AXES: dict[str, tuple[int, ...]] = {
    "uavs": (1, 2, 4, 8, 16, 32, 64),
    "uavs in a full zone": (1, 4, 16, 36, 64),
    "nodes": (25, 50, 100, 250, 500, 1000),
    "grid": (32, 64, 128, 256),
    "hours": (1, 4, 12, 24, 48, 96),
    "design points": (10, 100, 1_000, 10_000),
    "workers": (1, 2, 10, 100),
}
MISSIONS_OF_STUDY = 20_000
CHUNKS = 2_000  # that the workers of a cluster simulate, drawn from the measured ones
MISSIONS = 16  # of a measurement of the engine, together; fewer would cost more each
TASK = 1e-3  # what a scheduler is assumed to take for each chunk [s]


def scenario(uavs: int, nodes: int, grid: int, hours: int, side: int) -> ScenarioSpace:
    """A square sea with a square zone in its middle, and nodes anywhere else."""
    corner = (grid - side) // 2
    zone = range(corner, corner + side)
    cells = [(x, y) for x in range(grid) for y in range(grid) if x not in zone or y not in zone]
    places = np.random.default_rng(0).choice(len(cells), nodes, replace=False)
    return load_scenario(
        "paper",
        grid=grid,
        nodes=[[*cells[place]] for place in places],
        zone=[corner, corner, side, side],
        uavs=uavs,
        quota=1_000_000,  # which nobody fills, so missions last to the end
        max_slots=hours * SLOTS_PER_HOUR,
    )


def measure_engine(axis: str, value: int) -> dict[str, float]:
    """The batch engine with ``greedy``: the time of a UAV-slot, and that of the first mission."""
    numbers_of_sea = dict(BASE)
    if axis == "uavs in a full zone":
        numbers_of_sea |= {"uavs": value, "side": round(value**0.5)}
    elif axis == "nodes":
        numbers_of_sea |= {"nodes": value, "grid": 40}  # a cell for each
    else:
        numbers_of_sea[axis] = value
    team = load_team("greedy")
    simulate_batch([scenario(**BASE)], team, 0, [0])  # compiles
    begin = process_time()
    sea = scenario(**numbers_of_sea)
    first = simulate_batch([sea], team, 0, [0]).missions["uav_slots"].sum()
    begun = process_time()
    records = simulate_batch([sea] * MISSIONS, team, 0, [*range(1, MISSIONS + 1)])
    seconds = process_time() - begun
    uav_slots = int(records.missions["uav_slots"].sum())
    set_up = max(0.0, begun - begin - seconds * first / uav_slots)
    return {"ns_per_uav_slot": 1e9 * seconds / uav_slots, "set_up_seconds": set_up}


def study_of(points: int, missions: int) -> Any:
    """A study of many design points of short missions."""
    rates = [0.01 + 0.04 * point / points for point in range(points)]
    data = {
        "name": "scale",
        "description": "how a study grows",
        "scenario": "paper",
        "set": {"grid": 8, "nodes": [[1, 1], [2, 6], [5, 4]], "zone": [5, 0, 3, 2], "uavs": 2},
        "policies": ["greedy"],
        "missions": missions,
        "design": {"kind": "grid", "values": {"arrival_rate": rates}},
    }
    data["set"] |= {"quota": 60, "flying_time": 25, "charge_start": 10, "charge_complete": 50}
    return study_from(data, "scale")


def measure_study(_: str, points: int) -> dict[str, float]:
    """A study of as many missions, whatever the number of its design points."""
    with TemporaryDirectory() as folder:
        run_study(study_of(2, 10), Path(folder) / "compiles")
        begin = process_time()
        results = run_study(study_of(points, MISSIONS_OF_STUDY // points), Path(folder) / "out")
        seconds = process_time() - begin
    uav_slots = int(results.missions["uav_slots"].sum())
    return {"ns_per_uav_slot": 1e9 * seconds / uav_slots}


def measure_workers(_: str, workers: int) -> dict[str, float]:
    """How many times as fast so many workers are as one, from the measured times of chunks.

    The chunks are of 500 missions of ``greedy`` in the paper's sea.
    """
    times: dict[str, list[float]] = {"run": [], "save": []}

    def timed(name: str) -> Callable[..., Any]:
        function = getattr(jobs.MissionsJob, name)

        def measured(*arguments: Any) -> Any:
            begin = process_time()
            result = function(*arguments)
            times[name].append(process_time() - begin)
            return result

        return measured

    study = load_study("fig5", policies=["greedy"], missions=1000)
    with TemporaryDirectory() as folder:
        run_study(load_study("fig5", policies=["greedy"], missions=2), Path(folder) / "compiles")
        for name in times:
            setattr(jobs.MissionsJob, name, timed(name))
        run_study(study, Path(folder) / "out")
    chunks = np.random.default_rng(0).choice(times["run"], CHUNKS)
    stored = float(np.mean(times["save"]))
    one = simulate_cluster(chunks, 1, stored)
    several = simulate_cluster(chunks, workers, stored)
    chunk = {"chunk_seconds": float(chunks.mean()), "stored_seconds": stored}
    return {"speed_up": one / several} | chunk


def simulate_cluster(chunks: np.ndarray, workers: int, stored: float) -> float:
    """The time until all chunks are stored [s]."""
    free = [0.0] * workers
    ends = []
    for seconds in chunks:
        ends.append(heapq.heappop(free) + TASK + seconds)
        heapq.heappush(free, ends[-1])
    done = 0.0
    for end in sorted(ends):
        done = max(done, end) + stored
    return done


MEASURES: dict[str, Callable[[str, int], dict[str, float]]] = {
    **dict.fromkeys(AXES, measure_engine),
    "design points": measure_study,
    "workers": measure_workers,
}


def measure_all() -> Iterator[dict[str, Any]]:
    """A row for every value of every axis, each from a process of its own."""
    for axis, values in AXES.items():
        for value in values:
            words = [sys.executable, "-m", "benchmarks.scale", "--one", axis, str(value)]
            printed = subprocess.run(words, check=True, capture_output=True, text=True).stdout
            row = {"axis": axis, "value": value} | json.loads(printed)
            print(row, flush=True)
            yield row


def measure_one(axis: str, value: int) -> dict[str, float]:
    """The numbers of a value, and the largest memory of this process [MiB]."""
    found = MEASURES[axis](axis, value)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return {name: round(number, 4) for name, number in found.items()} | {"peak_mib": round(peak)}


def table(measured: pd.DataFrame) -> str:
    """The numbers of every axis but the workers, as Markdown."""
    rows = ["| axis | values | ns per UAV-slot | set-up [s] | peak memory [MiB] |"]
    rows.append("| --- | --- | --- | --- | --- |")
    for axis, of_axis in measured[measured["axis"] != "workers"].groupby("axis", sort=False):
        columns = [
            " ".join(f"{value:,}" for value in of_axis["value"]),
            " ".join(f"{value:,.0f}" for value in of_axis["ns_per_uav_slot"]),
            " ".join(f"{value:.1f}" for value in of_axis["set_up_seconds"].dropna()),
            " ".join(f"{value:,.0f}" for value in of_axis["peak_mib"]),
        ]
        rows.append(f"| {axis} | {' | '.join(columns)} |")
    return "\n".join(rows)


def draw(measured: pd.DataFrame, path: Path) -> None:
    """The cost and the memory over every axis, on logarithmic scales."""
    from matplotlib.figure import Figure

    figure = Figure((11, 5.5), layout="constrained")
    for place, (axis, of_axis) in enumerate(measured.groupby("axis", sort=False), 1):
        axes = figure.add_subplot(2, 4, place)
        name, label = "ns_per_uav_slot", "ns per UAV-slot"
        if axis == "workers":
            name, label = "speed_up", "times as fast as one"
        axes.loglog(of_axis["value"], of_axis[name], "o-", color="C0")
        axes.set(xlabel=axis, ylabel=label, ylim=(of_axis[name].min() / 3, of_axis[name].max() * 3))
        values = of_axis["value"].tolist()
        axes.set_xticks(values, [f"{value:,}" for value in values], fontsize=7)
        axes.minorticks_off()
        memory = axes.twinx()
        memory.loglog(of_axis["value"], of_axis["peak_mib"], "s:", color="C1", markersize=3)
        memory.set(ylim=(50, 20_000))
        memory.tick_params(colors="C1")
    figure.supxlabel("blue: time of the processor; orange, dotted: peak memory [MiB]", fontsize=9)
    figure.savefig(path, dpi=110)


def main() -> None:
    """Measure, draw or print."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--measure", type=Path, metavar="CSV")
    parser.add_argument("--table", type=Path, metavar="CSV")
    parser.add_argument("--draw", type=Path, nargs=2, metavar=("CSV", "PNG"))
    parser.add_argument("--one", nargs=2, metavar=("AXIS", "VALUE"))
    asked = parser.parse_args()
    if asked.one:
        print(json.dumps(measure_one(asked.one[0], int(asked.one[1]))))
    if asked.measure:
        asked.measure.write_text(numbers.write_csv(pd.DataFrame(measure_all())), "utf-8")
    if asked.table:
        print(table(pd.read_csv(asked.table)))
    if asked.draw:
        draw(pd.read_csv(asked.draw[0]), asked.draw[1])


if __name__ == "__main__":
    main()
