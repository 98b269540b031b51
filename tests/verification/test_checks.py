"""Sound results pass the checks, and a fault that is planted in logs or records is noticed."""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pandas as pd
import pytest
from hypothesis import given, settings
from scipy import stats

from dess import load_scenario
from dess.analysis.results.tables import Results
from dess.analysis.stats.verdict import HOLDS, INCONCLUSIVE, REFUTED
from dess.model.mission import simulate
from dess.model.state import sample_scenario
from dess.scenario.fields import SAMPLED
from tests.drawn import extended_spaces, policies, replications, seeds
from tests.verification import balances, draws, measurements
from tests.verification.checks import (
    ALPHA,
    Check,
    judge_checks,
    poisson_fit,
    uniform_fit,
)
from tests.verification.measurements import Log

SPACE = load_scenario("paper")
RATE, NODES = SPACE.arrival_rate, len(SPACE.nodes)


def check(**values: float) -> Check:
    return Check("topic", "test", "known", "seen", 10, **values)


def failing(checks: list[Check]) -> set[str]:
    """The tests that do not hold."""
    table = judge_checks(checks)
    return set(table.loc[table["verdict"] == REFUTED, "test"])


def fails(check: Check) -> bool:
    assert check.error is not None and check.p is None
    return check.error > check.bound


def altered(logs: list[Log], event: str, which: int = 0, **columns: Any) -> list[Log]:
    """The logs with one event of the first changed, by a function of each value."""
    events = logs[0].events.copy()
    row = events.index[events["event"] == event][which]
    for name, change in columns.items():
        events.loc[row, name] = change(events.loc[row, name])
    return [replace(logs[0], events=events), *logs[1:]]


def with_records(results: Results, row: int, **changes: Callable[[Any], Any]) -> Results:
    """The results with one record changed."""
    missions = results.missions.copy()
    for name, change in changes.items():
        missions.loc[row, name] = change(missions.loc[row, name])
    return replace(results, missions=missions)


def test_p_values_are_corrected_for_their_number():
    p = 0.6 * ALPHA
    assert judge_checks([check(p=p), check(p=0.5)])["verdict"].tolist() == [HOLDS, HOLDS]
    assert judge_checks([check(p=p / 2), check(p=0.5)])["verdict"].tolist() == [REFUTED, HOLDS]
    # Exact and open ones.
    table = judge_checks([check(p=p), check(error=0.0), check(), check()])
    assert table["verdict"].tolist() == [REFUTED, HOLDS, INCONCLUSIVE, INCONCLUSIVE]


@pytest.mark.parametrize("mean", [0.02, 1.0, 40.0])
def test_classes_of_a_fit_have_all_of_the_distribution(mean):
    counts = np.random.default_rng(2).poisson(mean, 5000)
    table = poisson_fit(counts, mean).table
    assert table["expected"].sum() == pytest.approx(5000)
    assert table["expected"].min() >= 5
    low, high = (int(label.split()[0]) for label in table["label"].iloc[[0, -1]])
    assert table["observed"].iloc[0] == (counts <= low).sum()
    assert table["observed"].iloc[-1] == (counts >= high).sum()
    values = np.random.default_rng(3).integers(1, 7, 600)
    pearson = stats.chisquare(np.bincount(values, minlength=7)[1:])
    assert uniform_fit(values, 1, 6).p == pytest.approx(pearson.pvalue)


def poisson(rate: float = RATE, slots: int = 8000, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).poisson(rate, (slots, NODES))


def parameters(**ranges: tuple[int, int]) -> pd.DataFrame:
    generator = np.random.default_rng(8)
    ends = {field: ranges.get(field, getattr(SPACE, field)) for field in SAMPLED}
    return pd.DataFrame(
        {f: generator.integers(low, high + 1, 5000) for f, (low, high) in ends.items()}
    )


ONE_NODE = poisson()
ONE_NODE[:, 3] = poisson(2 * RATE, seed=5)[:, 3]
DRAWN, OF_NODES = parameters(), f"Rates of the {NODES} nodes: chi-square"
# Arrivals or parameters that are not those of the scenario, and what has to fail.
OTHERS: dict[str, tuple[Any, str]] = {
    "another rate": (poisson(1.2 * RATE), "Counts per node and slot: chi-square"),
    "packets in pairs": (2 * poisson(RATE / 2), "Index of dispersion per slot"),
    "a slot like the one before": (
        np.repeat(poisson(slots=4000), 2, axis=0),
        "Correlation of a slot and the next",
    ),
    "nodes alike": (
        np.repeat(poisson()[:, ::2], 2, axis=1)[:, :NODES],
        "Counts per slot, all nodes: chi-square",
    ),
    "one node": (ONE_NODE, OF_NODES),
    "smaller fleets": (parameters(uavs=(1, 2)), "Number of UAVs: chi-square"),
    "outside the range": (
        DRAWN.assign(flying_time=DRAWN["flying_time"].where(DRAWN.index != 17, 81)),
        "Flying time: chi-square",
    ),
    "dependent parameters": (
        DRAWN.assign(charge_complete=DRAWN["charge_start"] + 50),
        "Correlations of all pairs: chi-square",
    ),
}


@pytest.mark.parametrize("case", OTHERS)
def test_draws_of_another_distribution_are_found_out(case):
    given, test = OTHERS[case]
    if isinstance(given, np.ndarray):
        assert not failing(draws.arrival_checks(poisson(), RATE))
        assert test in failing(draws.arrival_checks(given, RATE))
    else:
        assert not failing(draws.parameter_checks(DRAWN, SPACE))
        assert failing(draws.parameter_checks(given, SPACE)) == {test}


def test_intervals_of_missions_that_depend_on_each_other_cover_too_rarely():
    generator = np.random.default_rng(14)
    shifts, noise = np.repeat(generator.normal(size=200), 100), generator.normal(size=20_000)
    assert failing([draws.coverage_check("metric", shifts + noise, 100, False)])
    assert not failing([draws.coverage_check("metric", noise, 100, False)])
    # Here Wilson covers more or less often than 95 %.
    for p in (0.6, 0.97, 0.9995):
        independent = (generator.random(20_000) < p).astype(int)
        assert not failing([draws.coverage_check("metric", independent, 100, True)])


def test_starts_rates_and_shadowing_of_another_simulator_are_found_out():
    x, y, width, height = SPACE.zone
    cells = np.random.default_rng(10).integers([x, y], [x + width, y + height], (400, 2))
    assert not failing([draws.start_check(cells, SPACE)])
    assert failing([draws.start_check(np.vstack([cells, [x + width, y]]), SPACE)])
    rates = measurements.compare_rates(SPACE, measurements.simulate_rates(SPACE, 11))
    assert not failing([draws.rate_check(rates)])
    assert failing([draws.rate_check(rates.assign(mean=1.01 * rates["mean"]))])
    deviates = measurements.shadowing_deviates(
        SPACE, measurements.simulate_slots(SPACE, 11, slots=800)
    )
    assert not failing(draws.shadowing_checks(deviates))
    assert failing(draws.shadowing_checks(1.1 * deviates))
    assert failing(draws.shadowing_checks(np.repeat(deviates[::2], 2)))


@settings(max_examples=settings().max_examples // 3)
@given(extended_spaces(landing=False), policies, seeds, replications)
def test_the_batteries_of_every_scenario_follow_the_rules(space, policy, seed, replication):
    """With wind, fleets, shared power and failures; a battery that is off by one is noticed."""
    record = simulate(space, policy, seed, replication, events=True)
    assert record.events is not None
    events = pd.DataFrame(record.events.columns())
    log = Log("", sample_scenario(space, seed, replication), None, pd.DataFrame(), events)
    assert not balances.battery_errors(log).any()
    (changed,) = altered([log], "move", -1, value=lambda value: value + 1)
    assert balances.battery_errors(changed).any()


def test_what_the_simulator_leaves_passes(results, logs, again):
    checks = [
        *draws.communication_checks(logs, results.manifest["seed"]),
        balances.conservation_check({"trial": results}),
        balances.balance_check(logs),
        balances.battery_check(logs),
        balances.record_check(logs),
        *balances.realisation_checks(results, logs),
        balances.engine_check(results, again),
    ]
    assert not any(map(fails, checks))
    assert all(check.n > 0 for check in checks)
    # Without logs nothing is told.
    assert balances.balance_check([]).error is None


OF_MISSION = ["slots", "uav_slots", "arrived", "initial", "collected"]


@pytest.mark.parametrize("name", [*OF_MISSION, "quota", "battery", "slots_charging"])
def test_a_record_that_its_log_does_not_add_up_to_is_noticed(logs, name):
    first, *rest = logs
    changed = replace(first, uavs=first.uavs.assign(**{name: first.uavs.get(name, 0) + 1}))
    if name in OF_MISSION:
        changed = replace(first, record=first.record.copy())
        changed.record[name] += 1
    assert fails(balances.record_check([changed, *rest]))


def test_logs_and_missions_that_are_not_of_the_study_are_noticed(results, logs):
    """Data that are a trifle off, another node, an arrival that is lost, and another mission."""
    trifle = altered(logs, "communication", 5, value=lambda value: value * (1 + 1e-9))
    choice, amount = draws.communication_checks(trifle, 7)
    assert fails(amount) and not fails(choice) and fails(balances.balance_check(trifle))
    other = altered(logs, "communication", 5, node=lambda node: (node + 1) % 3)
    assert fails(draws.communication_checks(other, 7)[0])
    longest = measurements.longest_logs(logs)
    log = next(log for log in logs if log not in longest and log.arrivals.any())
    row = log.events.index[log.events["event"] == "arrival"][0]
    lossy = [replace(o, events=o.events.drop(index=row)) if o is log else o for o in logs]
    assert fails(balances.balance_check(lossy)) and fails(balances.record_check(lossy))
    assert fails(balances.realisation_checks(results, lossy)[1])
    for name in ("initial", "flying_time"):
        changed = with_records(results, 0, **{name: lambda value: value + 1})
        assert fails(balances.realisation_checks(changed, logs)[0])


def test_data_that_come_from_nowhere_or_another_engine_are_noticed(results):
    """Off by a trifle; data that are recorded as lost are no imbalance."""
    for name in ("collected", "residual", "initial", "arrived"):
        changed = with_records(results, 3, **{name: lambda value: value + 1e-9})
        assert fails(balances.conservation_check({"sound": results, "trial": changed}))
    half = results.missions["collected"] / 2
    missions = results.missions.assign(lost=half, collected=half)
    assert not fails(balances.conservation_check({"trial": replace(results, missions=missions)}))
    changed = with_records(results, 0, reward=lambda value: np.nextafter(value, np.inf))
    row = results.uavs.index[results.uavs["replication"] == results.missions["replication"].max()]
    uavs = results.uavs.copy()
    uavs.loc[row[0], "battery"] += 1
    again = measurements.simulate_again(replace(changed, uavs=uavs), 3)
    engine = balances.engine_check(changed, again)
    assert (engine.n, engine.error) == (6, 2)


# Two groups of communication slots, a queue for one pad, all nodes emptied now and then.
CHANGES: dict[str, Any] = {"communication_slots": 6, "pads": 1, "initial_data": [0, 2], "quota": 90}


@pytest.fixture(scope="session")
def results(studied):
    return studied(logged=8, set=CHANGES)


@pytest.fixture(scope="session")
def logs(results):
    return measurements.logs_of(results)


@pytest.fixture(scope="session")
def again(results):
    return measurements.simulate_again(results, 3)


def test_of_every_replication_the_longest_log_is_taken(logs):
    kept = measurements.longest_logs(logs)
    assert [log.replication for log in kept] == list(range(8))
    for log in kept:
        others = [o.record["slots"] for o in logs if o.replication == log.replication]
        assert log.record["slots"] == max(others)


def test_the_missions_that_are_simulated_again_are_spread_over_all(results, again):
    last = int(results.missions["replication"].max())
    simulated = [(mission.policy, mission.replication) for mission in again]
    assert simulated == [(p, r) for p in results.policies for r in (0, last // 2, last)]
