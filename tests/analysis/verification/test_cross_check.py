"""Missions beside a study are those of its replications, and are kept in a file to the last bit."""

from pathlib import Path

import pytest

from analysis.results.tables import Results
from analysis.verification import cross_check
from analysis.verification.cross_check import FILE, CrossCheck
from dess import InputError, simulate
from policies import load_team


def test_missions_are_spread_over_the_replications_of_every_policy(
    results: Results, again: CrossCheck
) -> None:
    simulated = [(mission["policy"], mission["replication"]) for mission in again.missions]
    last = int(results.missions["replication"].max())
    assert simulated == [(p, r) for p in results.policies for r in (0, last // 2, last)]


def test_records_are_those_of_the_simpy_engine(results: Results, again: CrossCheck) -> None:
    mission = again.missions[-1]
    seed, replication = results.store.manifest.seed, mission["replication"]
    record = simulate(results.scenario(), load_team(mission["policy"]), seed, replication)
    assert mission["reward"] == record.metrics["reward"]
    uavs = [
        u for u in again.uavs if (u["policy"], u["replication"]) == (mission["policy"], replication)
    ]
    assert [uav["collected"] for uav in uavs] == record.uavs["collected"].tolist()


def test_a_file_keeps_missions_to_the_last_bit(
    results: Results, again: CrossCheck, tmp_path: Path
) -> None:
    cross_check.write(again, tmp_path / "new")
    assert cross_check.read(tmp_path / "new", results) == again


def test_missions_that_are_missing_damaged_or_of_other_results_are_refused(
    results: Results, again: CrossCheck, tmp_path: Path
) -> None:
    with pytest.raises(InputError, match="missing or damaged.*dess report verification"):
        cross_check.read(tmp_path, results)
    (tmp_path / FILE).parent.mkdir()
    (tmp_path / FILE).write_text("{")
    with pytest.raises(InputError, match="missing or damaged"):
        cross_check.read(tmp_path, results)
    cross_check.write(again.model_copy(update={"study": "another"}), tmp_path)
    with pytest.raises(InputError, match="other results"):
        cross_check.read(tmp_path, results)


def test_missions_are_simulated_only_if_they_are_missing_or_of_other_results(
    results: Results, again: CrossCheck, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cross_check.write(again, tmp_path)
    cross_check.make(tmp_path, results)
    assert cross_check.read(tmp_path, results) == again
    cross_check.write(again.model_copy(update={"study": "another"}), tmp_path)
    monkeypatch.setattr(cross_check, "simulate_missions", lambda results, progress: again)
    cross_check.make(tmp_path, results)
    assert cross_check.read(tmp_path, results) == again


def test_a_folder_that_cannot_be_written_is_named(
    results: Results, again: CrossCheck, tmp_path: Path
) -> None:
    (tmp_path / FILE.parent).write_text("a file")
    with pytest.raises(InputError, match="cross-check/.*: cannot be written: .*; allowed"):
        cross_check.write(again, tmp_path)
