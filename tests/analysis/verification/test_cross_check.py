"""Missions beside a study are those of its replications, and are kept in a file to the last bit."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from analysis.results.tables import Results
from analysis.verification import measurements
from analysis.verification.measurements import FILE, CrossCheck
from dess import InputError

ANOTHER = "f" * 16  # the key of another study


def test_missions_are_spread_over_the_replications_of_every_policy(
    results: Results, again: CrossCheck
) -> None:
    simulated = [(mission.policy, mission.replication) for mission in again.missions]
    last = int(results.missions["replication"].max())
    assert simulated == [(p, r) for p in results.policies for r in (0, last // 2, last)]


def test_missions_that_are_missing_damaged_or_of_other_results_are_refused(
    results: Results, again: CrossCheck, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="no such file.*dess report verification"):
        measurements.read(tmp_path, results)
    (tmp_path / FILE).parent.mkdir()
    (tmp_path / FILE).write_text("{")
    with pytest.raises(InputError, match="not valid JSON"):
        measurements.read(tmp_path, results)
    measurements.write(again.model_copy(update={"study": ANOTHER}), tmp_path)
    with pytest.raises(InputError, match="has study 'f+', not '.*'; allowed: what is made"):
        measurements.read(tmp_path, results)


def test_missions_are_simulated_only_if_they_are_missing_or_of_other_results(
    results: Results, again: CrossCheck, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    measurements.write(again, tmp_path)
    measurements.make(tmp_path, results)
    assert measurements.read(tmp_path, results) == again
    measurements.write(again.model_copy(update={"study": ANOTHER}), tmp_path)
    monkeypatch.setattr(measurements, "simulate_missions", lambda results, progress: again)
    measurements.make(tmp_path, results)
    assert measurements.read(tmp_path, results) == again


def _without(key: str) -> Callable[[dict[str, Any]], object]:
    return lambda document: document["missions"][0].pop(key)


# What a forger changes in the document of the right study, and the key that the line names.
FORGED: dict[str, Callable[[dict[str, Any]], object]] = {
    "missions.0.seed": _without("seed"),
    "missions.0.policy": _without("policy"),
    "missions.0.reward": lambda d: d["missions"][0].update(reward="much"),
    "missions.0.slots": lambda d: d["missions"][0].update(slots=1.5),
    "uavs.0.uav": lambda d: d["uavs"][0].pop("uav"),
    "uavs.0.odd": lambda d: d["uavs"][0].update(odd=1),
    "rates": lambda d: d["rates"].pop(),
    "slots": lambda d: d.update(slots=[]),
}


@pytest.mark.parametrize("key", FORGED)
def test_forged_missions_of_the_study_are_a_line_that_names_the_key(
    key: str, results: Results, again: CrossCheck, tmp_path: Path
) -> None:
    document = json.loads(again.model_dump_json())
    FORGED[key](document)
    path = tmp_path / FILE
    path.parent.mkdir()
    path.write_text(json.dumps(document))
    for use in (measurements.read, measurements.make):
        with pytest.raises(InputError, match=f"^{path}: {key}.*; allowed: ") as error:
            use(tmp_path, results)
        assert "\n" not in str(error.value)
    assert json.loads(path.read_text()) == document
