"""rliable: it reads the scores of a study; no environment is involved."""

import os
import runpy
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from dess.analysis import rliable_scores, run_study
from tests.analysis.small import grid, small_study

pytest.importorskip("rliable")

EXAMPLE = Path(__file__).parents[2] / "examples" / "rliable_iqm.py"


def test_contract(tmp_path):
    """The example computes its means from the scores of a study, prints them and draws."""
    study = small_study(tmp_path, missions=40, design=grid(quota=[30, 60]))
    results = run_study(study, tmp_path / "out")
    scores = rliable_scores(results)
    estimates = runpy.run_path(str(EXAMPLE))["iqm"](scores, reps=200)
    for name, (mean, low, high) in estimates.items():
        ordered = np.sort(scores[name], axis=None)  # 10 runs x 2 tasks
        assert mean == pytest.approx(ordered[5:15].mean())
        assert low <= mean <= high
        assert low < high
    assert estimates["greedy"][0] > estimates["random"][0]

    picture = tmp_path / "profiles.png"
    command = [sys.executable, str(EXAMPLE), str(results.store.folder), str(picture)]
    environment = os.environ | {"PYTHONPATH": os.pathsep.join(sys.path), "MPLBACKEND": "agg"}
    done = subprocess.run(command, capture_output=True, text=True, env=environment)
    assert done.returncode == 0, done.stderr
    assert [line.split(":")[0] for line in done.stdout.splitlines()] == ["greedy", "random"]
    assert picture.read_bytes().startswith(b"\x89PNG")
