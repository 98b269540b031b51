"""Print a hash of records, which is the same however missions with a trained policy are flown.

    python -m tests.policies.parity generalist paper bay --missions 1000 --batch 64

The environment chooses what libraries compute with: OPENBLAS_CORETYPE, OPENBLAS_NUM_THREADS, and
NUMBA_CPU_NAME=generic for all compiled code without AVX. ``--form`` compiles the network alone for
other instructions. ``node`` is the JavaScript engine of this name, which has to be installed.
"""

import argparse
import json
import subprocess
import tempfile
from collections.abc import Iterable
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from numba import njit

from dess.base import vectors
from dess.model.batch import simulate_batch
from dess.model.mission import simulate
from dess.model.record import Records
from dess.policies import dense, integers
from dess.policies.learner import policy as acting
from dess.policies.learner.trained import load_policy
from dess.policies.registry import TRAINED
from dess.scenario.scenario import ScenarioSpace, load_scenario

SEED = 7301
TYPES = [{}, {"endurance": "20 min", "charging": "25 min", "cruise": "7.5 m/s"}]
SCENARIOS: dict[str, Any] = {
    **{"paper": ("paper", {}), "bay": ("bay", {}), "jade-bight": ("jade-bight", {})},
    "types": ("jade-bight", {"fleet": TYPES}),
}
# Calls the exports of the module as a page does, and prints the records in base 64.
NODE = Path(__file__).with_name("parity.cjs")


def main() -> None:
    """Print a line for each scenario."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("policy")
    parser.add_argument("scenarios", nargs="+", choices=SCENARIOS)
    parser.add_argument("--missions", type=int, default=100)
    parser.add_argument("--batch", type=int, default=256, help="missions that fly together")
    parser.add_argument("--workers", type=int, default=1)
    parser.add_argument("--engine", choices=ENGINES, default="batch")
    parser.add_argument("--form", choices=vectors.FORMS, help="instructions of the network")
    arguments = parser.parse_args()
    if arguments.form:
        compile_network(arguments.form)
    for name in arguments.scenarios:
        scenario, values = SCENARIOS[name]
        records = ENGINES[arguments.engine](load_scenario(scenario, **values), arguments)
        print(name, hash_of(records), flush=True)


def hash_of(records: Iterable[np.ndarray]) -> str:
    """A hash of the records of missions and UAVs."""
    missions, uavs, *_ = records
    return sha256(missions.tobytes() + uavs.tobytes()).hexdigest()[:16]


def compile_network(form: str) -> None:
    """Let policies act with networks that are compiled in this process for other instructions."""
    vectors.instructions_of = lambda _: vectors.FORMS[form]
    acting.decide = njit(integers.decide.py_func, error_model="numpy")
    acting.choose = njit(dense.choose.py_func, error_model="numpy")


def fly_in_batches(space: ScenarioSpace, arguments: argparse.Namespace) -> Records:
    """The records of the batch engine."""
    policy = load_policy(TRAINED / arguments.policy)
    options = {"batch_size": arguments.batch, "workers": arguments.workers}
    return simulate_batch(space, policy, SEED, arguments.missions, **options)


def fly_one_by_one(space: ScenarioSpace, arguments: argparse.Namespace) -> Records:
    """The records of the engine that flies a mission at a time."""
    policy = load_policy(TRAINED / arguments.policy)
    records = [simulate(space, policy, SEED, number) for number in range(arguments.missions)]
    uavs = np.zeros((len(records), space.uavs[1]), records[0].uavs.dtype)
    for row, record in zip(uavs, records, strict=True):
        row[: len(record.uavs)] = record.uavs
    return np.array([record.metrics for record in records]), uavs


def fly_in_wasmtime(space: ScenarioSpace, arguments: argparse.Namespace) -> Records:
    """The records of the module in wasmtime."""
    from tests.flown import fly

    return fly(space, [arguments.policy], SEED, arguments.missions)


def fly_in_node(space: ScenarioSpace, arguments: argparse.Namespace) -> Any:
    """The records of the module in Node."""
    from dess.analysis.wasm.image import EMPTY, make_image
    from dess.analysis.wasm.module import read_module

    arrays = make_image(space, [arguments.policy], SEED, arguments.missions).arrays
    with tempfile.TemporaryDirectory() as folder:
        at = Path(folder)
        (at / "module.wasm").write_bytes(read_module())
        described = []
        for name, array in arrays.items():
            has_content = name not in EMPTY or name == "operations"
            if has_content:
                (at / name).write_bytes(array.tobytes())
            described.append([name, array.nbytes, array.shape, has_content])
        (at / "arrays.json").write_text(json.dumps(described), "utf-8")
        command = ["node", str(NODE), folder, str(arguments.missions)]
        subprocess.run(command, check=True)
        return [
            np.frombuffer((at / f"{name}.out").read_bytes(), arrays[name].dtype)
            for name in ("mission_records", "uav_records")
        ]


ENGINES = {
    "batch": fly_in_batches,
    "simpy": fly_one_by_one,
    "wasmtime": fly_in_wasmtime,
    "node": fly_in_node,
}

if __name__ == "__main__":
    main()
