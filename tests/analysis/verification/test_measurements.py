"""Missions beside a study are those of its replications, and are kept in a file to the last bit."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from dess import InputError, load_scenario
from dess.analysis import run_study
from dess.analysis.results.tables import Results
from dess.analysis.verification import balances, draws, measurements
from dess.analysis.verification.measurements import FILE, STUDY, CrossCheck, Log
from dess.analysis.verification.suite import Suite
from tests.analysis.small import small_study
from tests.analysis.verification.verdicts import failing


def test_without_logs_nothing_is_told(results: Results) -> None:
    checks = [
        *draws.communication_checks([], 7),
        balances.balance_check([]),
        balances.battery_check([]),
        balances.record_check([]),
    ]
    assert {check.error for check in checks} == {None}
    assert measurements.arrivals([], results.scenario()).shape == (0, len(results.scenario().nodes))


def test_of_every_replication_the_longest_log_is_taken(logs: list[Log]) -> None:
    kept = measurements.longest(logs)
    assert [log.replication for log in kept] == list(range(8))
    for log in kept:
        others = [o.record["slots"] for o in logs if o.replication == log.replication]
        assert log.record["slots"] == max(others)


SPACE = load_scenario("paper")


@pytest.fixture(scope="module")
def rates() -> pd.DataFrame:
    return measurements.rates(SPACE, measurements.simulate_rates(SPACE, 11))


def test_the_engine_has_the_rates_of_the_formula(rates: pd.DataFrame) -> None:
    assert not failing([draws.rate_check(rates)])
    assert rates["distance"].is_monotonic_increasing
    # Each distance has draws of its own, so their deviations are independent.
    assert ((rates["mean"] - rates["known"]) / rates["error"]).nunique() == len(rates)


def test_other_rates_are_refuted(rates: pd.DataFrame) -> None:
    assert failing([draws.rate_check(rates.assign(mean=1.01 * rates["mean"]))])
    one = rates.copy()
    one.loc[2, "mean"] += 6 * one.loc[2, "error"]
    assert failing([draws.rate_check(one)])


def test_without_shadowing_the_rates_are_exact() -> None:
    still = load_scenario("paper", shadowing_variance=0.0)
    table = measurements.rates(still, measurements.simulate_rates(still, 11)).assign(error=0.0)
    check = draws.rate_check(table)
    assert check.p is None and not failing([check])
    assert failing([draws.rate_check(table.assign(mean=1.0001 * table["mean"]))])


def test_shadowing_is_normal_and_independent() -> None:
    deviates = measurements.deviates(SPACE, measurements.simulate_slots(SPACE, 11, slots=800))
    assert len(deviates) == 800 * SPACE.communication_slots
    assert not failing(draws.shadowing_checks(deviates))
    assert failing(draws.shadowing_checks(1.1 * deviates))
    assert failing(draws.shadowing_checks(np.repeat(deviates[::2], 2)))


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


def test_a_study_with_failures_is_refused(tmp_path: Path) -> None:
    study = small_study(tmp_path, set={"failures.node_rate": 0.1})
    run_study(study, tmp_path / STUDY)
    with pytest.raises(InputError, match="verification: its scenario has failures.*; allowed: "):
        Suite(tmp_path)
