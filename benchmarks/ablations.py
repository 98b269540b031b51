"""Ablation of the batch engine: its speed without each of its optimisations.

Every variant is a copy of the packages with one line changed. All give the same records.

    python benchmarks/ablations.py
"""

import shutil
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).parents[1]
ROUNDS = 3

# Variant -> changes: file, line, replacement.
VARIANTS = {
    "as it is": (),
    "no pruning: every node with data is drawn": (
        ("dess/model/channel.py", "if batch.rest + reach < best or", "if"),
    ),
    "no vector code: the length of a batch is known to the compiler": (
        ("dess/model/channel.py", "batch, search[i, WIDTH])", "batch, _BATCH)"),
        ("dess/model/channel.py", "word, search[i, WIDTH])", "word, _BATCH)"),
    ),
    "no bounds: every deviate is transformed exactly": (
        ("dess/model/channel.py", "streams.normal_or_bound(", "streams.normal("),
    ),
    "no table of steps: order and means worked out in every slot": (
        ("dess/model/channel.py", "if order[row, mission.nodes] == 0:", "if True:"),
    ),
    "no inlining: the rules are called": (
        ("dess/base/kernels.py", '{"forceinline": True, "_nrt": False}', "{}"),
    ),
    "references counted in inlined rules, too": (
        ("dess/base/kernels.py", '"forceinline": True, "_nrt": False', '"forceinline": True'),
    ),
    "the code of sections compiled in": (
        (
            "dess/model/state.py",
            "mission if scenario.is_extended else mission.view(PLAIN_MISSION)",
            "mission",
        ),
    ),
    "no batch: one mission at a time": (
        ("dess/model/batch.py", "BATCH_SIZE = 256", "BATCH_SIZE = 1"),
    ),
}

TIMED = """
import hashlib, sys, time
sys.path.insert(0, ".")
import numpy as np
from benchmarks.recorded import Recorded, Recorder
from dess import load_scenario, policies, simulate_batch
scenario, missions = load_scenario("paper"), 600
recorder = Recorder(policies.load("greedy"), missions, scenario.max_slots, scenario.uavs[1])
simulate_batch(scenario, recorder, 5, missions)
recorded, best = Recorded(recorder.actions), float("inf")
for _ in range(4):
    start = time.perf_counter()
    records = simulate_batch(scenario, recorded, 5, missions).missions
    best = min(best, time.perf_counter() - start)
print(1e9 * best / records["uav_slots"].sum(), hashlib.sha256(records.tobytes()).hexdigest())
"""


def _copy(folder: Path, changes: tuple) -> Path:
    """The package with these lines changed."""
    for name in ("dess", "benchmarks"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    for name, line, instead in changes:
        text = (folder / name).read_text()
        assert line in text, f"{name} has no {line!r}"
        (folder / name).write_text(text.replace(line, instead))
    return folder


def main() -> None:
    """Measure the variants in turn and print a table."""
    with tempfile.TemporaryDirectory() as base:
        folders = {
            name: _copy(Path(base) / str(number), changes)
            for number, (name, changes) in enumerate(VARIANTS.items())
        }
        times: dict[str, list[float]] = {name: [] for name in VARIANTS}
        seen = set()
        for _ in range(ROUNDS):
            for name, folder in folders.items():
                done = subprocess.run(
                    [sys.executable, "-c", TIMED],
                    cwd=folder, env={"PATH": ""}, capture_output=True, text=True, check=True,
                )  # fmt: skip
                nanoseconds, records = done.stdout.split()
                times[name].append(float(nanoseconds))
                seen.add(records)
        assert len(seen) == 1, "the variants give different records"
    whole = statistics.median(times["as it is"])
    print("| the engine | ns per UAV-slot | slower by |\n| --- | ---: | ---: |")
    for name, measured in times.items():
        median = statistics.median(measured)
        print(f"| {name} | {median:,.0f} | {median / whole:.2f} x |")


if __name__ == "__main__":
    main()
