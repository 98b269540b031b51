"""The page of the verification says so when something is wrong; of sound results it is kept."""

import re
from pathlib import Path
from typing import Any

import pytest

from dess import simulate, simulate_batch
from dess.analysis import load_study, run_study
from dess.analysis.execution import jobs
from dess.analysis.stats.verdict import HOLDS, REFUTED
from dess.analysis.verification.measurements import simulate_missions, write
from dess.scenario import ScenarioSpace
from tests.reports.small import said_by

NAME = "verification"
SMALL: dict[str, Any] = {"missions": 300, "logged": 6}
BLOCK = 20


def said(results: Path) -> str:
    return said_by(NAME, results=str(results), block=BLOCK)


def run_with(folder: Path, monkeypatch: pytest.MonkeyPatch, **changes: Any) -> Path:
    """Results of a simulator whose scenario is another one than the study says."""

    def other(space: Any) -> Any:
        return (
            [*map(other, space)]
            if isinstance(space, (list, tuple))
            else ScenarioSpace.of(space, **changes)
        )

    with monkeypatch.context() as patch:
        patch.setattr(jobs, "simulate_batch", lambda s, *a, **k: simulate_batch(other(s), *a, **k))
        patch.setattr(jobs, "simulate", lambda s, *a, **k: simulate(other(s), *a, **k))
        study = run_study(load_study(NAME, **SMALL | {"policies": ["greedy"]}), folder / NAME)
    write(simulate_missions(study, 2), folder)
    return folder


def test_another_simulator_is_found_out(tmp_path, monkeypatch):
    changes = {"arrival_rate": 0.03, "edge_snr": -24.0, "charge_rate": 11, "uavs": [1, 2]}
    text = said(run_with(tmp_path, monkeypatch, **changes))
    counted = re.search(r"(\d+) of \d+ checks do not hold: ([^.]*)\.", text)
    tests = (
        "Arrivals of all missions: rate per node and slot",
        "Data of a communication",
        "Battery of every UAV in every slot",
        "Number of UAVs: chi-square",
        "Record of the batch engine, simulated again with SimPy",
    )
    assert counted and int(counted[1]) >= len(tests)
    for test in tests:
        assert test in counted[2]
        assert f"{test} {REFUTED}" in text
    for test in ("Flying time: chi-square", "Every node of every log"):  # all else is as it was
        assert f"{test} {HOLDS}" in text


def test_too_few_missions_are_not_taken_for_a_proof(tmp_path):
    few = load_study(NAME, policies=["random"], missions=3, logged=1)
    write(simulate_missions(run_study(few, tmp_path / NAME), 2), tmp_path)
    (tmp_path / "broken").mkdir()
    (tmp_path / "broken" / "manifest.json").write_text("{}")
    text = said(tmp_path)
    assert "the others are inconclusive" in text
    assert "Too few observations for" in text
    assert "not read, incomplete or of other code: broken" in text
    assert REFUTED not in text
