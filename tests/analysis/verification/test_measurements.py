"""Missions beside a study are those of its replications, and are kept in a file to the last bit."""

import pytest

from dess import InputError
from dess.analysis import run_study
from dess.analysis.verification import measurements
from dess.analysis.verification.measurements import STUDY
from dess.analysis.verification.suite import Suite
from tests.analysis.small import small_study

ANOTHER = "f" * 16  # the key of another study


def test_of_every_replication_the_longest_log_is_taken(logs):
    kept = measurements.longest(logs)
    assert [log.replication for log in kept] == list(range(8))
    for log in kept:
        others = [o.record["slots"] for o in logs if o.replication == log.replication]
        assert log.record["slots"] == max(others)


def test_missions_are_kept_and_refused_where_they_are_not_of_these_results(
    results, again, tmp_path, monkeypatch
):
    """They are simulated only if they are missing or of other results."""
    simulated = [(mission.policy, mission.replication) for mission in again.missions]
    last = int(results.missions["replication"].max())
    assert simulated == [(p, r) for p in results.policies for r in (0, last // 2, last)]
    with pytest.raises(InputError, match="no such file.*dess report verification"):
        measurements.read(tmp_path, results)
    measurements.write(again, tmp_path)
    measurements.make(tmp_path, results)
    assert measurements.read(tmp_path, results) == again
    measurements.write(again.model_copy(update={"study": ANOTHER}), tmp_path)
    with pytest.raises(InputError, match="has study 'f+', not '.*'; allowed: what is made"):
        measurements.read(tmp_path, results)
    monkeypatch.setattr(measurements, "simulate_missions", lambda results, progress: again)
    measurements.make(tmp_path, results)
    assert measurements.read(tmp_path, results) == again


def test_a_study_with_failures_is_refused(tmp_path):
    study = small_study(tmp_path, set={"failures.node_rate": 0.1})
    run_study(study, tmp_path / STUDY)
    with pytest.raises(InputError, match="verification: its scenario has failures.*; allowed: "):
        Suite(tmp_path)
