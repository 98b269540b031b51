"""Records of trained policies are the same bytes, whatever computes them.

These are some missions; ``python -m tests.policies.parity`` flies as many as are asked for.
"""

import os
import shutil
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

from tests.policies import parity

ROOT = Path(parity.__file__).parents[2]
SEAS = {"generalist": ("paper", "bay", "types"), "ddqn": ("paper",)}
MISSIONS = 8
# Environment and options of each way to fly.
WAYS: dict[str, tuple[dict[str, str], list[str]]] = {
    "Haswell": ({"OPENBLAS_CORETYPE": "Haswell"}, []),
    "SkylakeX": ({"OPENBLAS_CORETYPE": "SkylakeX", "OPENBLAS_NUM_THREADS": "2"}, []),
    "Prescott": ({"OPENBLAS_CORETYPE": "Prescott"}, ["--batch", "1"]),
    "two processes": ({}, ["--batch", "3", "--workers", "2"]),
    "SSE2": ({}, ["--form", "sse2"]),
    "plain": ({}, ["--form", "plain"]),
    "one by one": ({}, ["--engine", "simpy"]),
}
IN_MODULE = {name: ({}, ["--engine", name]) for name in ("wasmtime", "node")}
CASES = [
    *((policy, *way) for policy in SEAS for way in WAYS.values()),
    *(("generalist", *way) for way in IN_MODULE.values()),
]
NAMES = [*(f"{policy}, {way}" for policy in SEAS for way in WAYS), *IN_MODULE]


@cache
def hashes(policy: str) -> str:
    """The hashes of the records that this process would make."""
    return run(policy, {}, [])


def run(policy: str, environment: dict[str, str], options: list[str]) -> str:
    """The hashes of records, flown in a process of their own."""
    command = [sys.executable, "-m", "tests.policies.parity", policy, *SEAS[policy]]
    command += ["--missions", str(MISSIONS), *options]
    done = subprocess.run(
        command, cwd=ROOT, env=os.environ | environment, capture_output=True, text=True, check=True
    )
    assert len(done.stdout.splitlines()) == len(SEAS[policy])
    return done.stdout


@pytest.mark.slow
@pytest.mark.parametrize(("policy", "environment", "options"), CASES, ids=NAMES)
def test_records_are_the_same_whatever_computes_them(policy, environment, options):
    if "node" in options and not shutil.which("node"):
        pytest.skip("node is not installed")
    assert run(policy, environment, options) == hashes(policy)
