"""Draws from the distribution that is known hold; draws from others are found out."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.stats.intervals import mean_interval, wilson
from analysis.stats.verdict import HOLDS, REFUTED
from analysis.verification import chance, lone_uav
from analysis.verification.checks import Check, judge
from dess import load_scenario
from dess.scenario import SAMPLED

SPACE = load_scenario("paper")
RATE = SPACE.arrival_rate
NODES = len(SPACE.nodes)


def failing(checks: list[Check]) -> set[str]:
    """The tests that do not hold."""
    table = judge(checks)
    assert set(table["verdict"]) <= {HOLDS, REFUTED}
    return set(table.loc[table["verdict"] == REFUTED, "test"])


def poisson(rate: float = RATE, slots: int = 8000, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).poisson(rate, (slots, NODES))


# --- arrivals ---


def test_poisson_arrivals_hold() -> None:
    assert not failing(chance.arrival_checks(poisson(), RATE))


def test_arrivals_of_another_rate_do_not() -> None:
    found = failing(chance.arrival_checks(poisson(1.2 * RATE), RATE))
    assert {
        "Counts per node and slot: chi-square",
        f"Rates of the {NODES} nodes: chi-square",
    } <= found


def test_packets_that_come_in_pairs_are_overdispersed() -> None:
    found = failing(chance.arrival_checks(2 * poisson(RATE / 2), RATE))
    assert "Index of dispersion per slot" in found


def test_arrivals_that_are_too_even_are_found_out() -> None:
    even = np.zeros((8000, NODES), int)
    even[np.arange(8000) % 2 == 0, 0] = 1  # as many as lambda says, one every other slot
    assert "Index of dispersion per slot" in failing(chance.arrival_checks(even, RATE))


def test_nodes_that_depend_on_each_other_are_found_out() -> None:
    together = poisson()
    together[:, 1::2] = together[:, 0:-1:2]
    found = failing(chance.arrival_checks(together, RATE))
    assert "Counts per slot, all nodes: chi-square" in found


def test_slots_that_depend_on_each_other_are_found_out() -> None:
    lasting = np.repeat(poisson(slots=4000), 2, axis=0)
    found = failing(chance.arrival_checks(lasting, RATE))
    assert {
        "Correlation of a slot and the next",
        "Counts per node and 50 slots: chi-square",
    } <= found


def test_a_node_of_another_rate_is_found_out() -> None:
    counts = poisson()
    counts[:, 3] = np.random.default_rng(5).poisson(2 * RATE, 8000)
    assert f"Rates of the {NODES} nodes: chi-square" in failing(chance.arrival_checks(counts, RATE))


def test_few_arrivals_tell_nothing_and_none_at_all_neither() -> None:
    for slots in (0, 3):
        checks = chance.arrival_checks(poisson(slots=slots), RATE)
        assert {check.p for check in checks} == {None}
        assert all(check.error is None for check in checks)


def test_without_arrivals_a_single_one_is_wrong() -> None:
    counts = np.zeros((50, NODES), int)
    assert not failing(chance.arrival_checks(counts, 0.0))
    counts[7, 2] = 1
    assert failing(chance.arrival_checks(counts, 0.0))


def test_the_chance_of_a_false_alarm_is_what_the_p_values_say() -> None:
    p = np.array(
        [
            [check.p for check in chance.arrival_checks(poisson(slots=1000, seed=seed), RATE)]
            for seed in range(150)
        ]
    )
    for share in (0.05, 0.5):
        low, high = stats.binom(len(p), share).ppf([0.0005, 0.9995]) / len(p)
        assert ((p <= share).mean(0) >= low - 0.02).all()
        assert ((p <= share).mean(0) <= high + 0.02).all()


@pytest.mark.parametrize("mean", [0.02, 1.0, 40.0])
def test_classes_of_a_fit_have_all_of_the_distribution(mean: float) -> None:
    counts = np.random.default_rng(2).poisson(mean, 5000)
    fit = chance.poisson_fit(counts, mean)
    assert fit.n == 5000
    assert fit.table["expected"].sum() == pytest.approx(5000)
    assert fit.table["expected"].min() >= 5
    first, last = fit.table["label"].iloc[[0, -1]]
    low, high = (int(label.split()[0]) for label in (first, last))
    assert fit.table["observed"].iloc[0] == (counts <= low).sum()
    assert fit.table["observed"].iloc[-1] == (counts >= high).sum()
    assert last.endswith(" or more") and first.endswith(" or less") == (low > 0)


def test_the_arrivals_of_all_missions_are_held_to_how_long_they_last() -> None:
    slots = np.full(400, 100)
    arrived = np.random.default_rng(4).poisson(RATE * NODES * 100, 400)
    missions = pd.DataFrame({"slots": slots, "arrived": arrived})
    assert not failing([chance.arrived_check(missions, SPACE)])
    assert failing([chance.arrived_check(missions.assign(slots=105), SPACE)])


# --- the channel ---


@pytest.fixture(scope="module")
def rates() -> pd.DataFrame:
    return lone_uav.rates(SPACE, 11)


def test_the_engine_has_the_rates_of_the_formula(rates: pd.DataFrame) -> None:
    assert not failing([chance.rate_check(rates)])
    assert rates["distance"].is_monotonic_increasing
    # Each distance has draws of its own, so their deviations are independent.
    assert ((rates["mean"] - rates["known"]) / rates["error"]).nunique() == len(rates)


def test_other_rates_are_found_out(rates: pd.DataFrame) -> None:
    assert failing([chance.rate_check(rates.assign(mean=1.01 * rates["mean"]))])
    one = rates.copy()
    one.loc[2, "mean"] += 6 * one.loc[2, "error"]
    assert failing([chance.rate_check(one)])


def test_an_engine_with_another_exponent_is_found_out() -> None:
    other = lone_uav.rates(load_scenario("paper", path_loss_exponent=2.26), 11)
    known = lone_uav.rates(SPACE, 11)
    assert failing([chance.rate_check(known.assign(mean=other["mean"]))])


def test_without_shadowing_the_rates_are_exact() -> None:
    still = load_scenario("paper", shadowing_variance=0.0)
    table = lone_uav.rates(still, 11).assign(error=0.0)
    check = chance.rate_check(table)
    assert check.p is None and not failing([check])
    assert failing([chance.rate_check(table.assign(mean=1.0001 * table["mean"]))])


def test_shadowing_is_normal_and_independent() -> None:
    deviates = lone_uav.deviates(SPACE, 11, slots=800)
    assert len(deviates) == 800 * SPACE.communication_slots
    assert not failing(chance.shadowing_checks(deviates))
    assert failing(chance.shadowing_checks(1.1 * deviates))
    assert failing(chance.shadowing_checks(np.repeat(deviates[::2], 2)))


# --- draws ---


def drawn(**ranges: Any) -> pd.DataFrame:
    generator = np.random.default_rng(8)
    ends = {field: ranges.get(field, getattr(SPACE, field)) for field in SAMPLED}
    columns = {f: generator.integers(low, high + 1, 5000) for f, (low, high) in ends.items()}
    return pd.DataFrame(columns)


def test_uniform_parameters_hold() -> None:
    assert not failing(chance.parameter_checks(drawn(), SPACE))


@pytest.mark.parametrize(
    "missions",
    [
        drawn(uavs=(1, 2)),
        drawn(flying_time=(70, 79)),
        drawn(charge_start=(10, 51)),
        drawn(charge_complete=(59, 100)),
    ],
    ids=SAMPLED,
)
def test_parameters_of_other_ranges_do_not(missions: pd.DataFrame) -> None:
    assert len(failing(chance.parameter_checks(missions, SPACE))) == 1


def test_a_single_value_outside_its_range_is_wrong() -> None:
    missions = drawn()
    missions.loc[17, "flying_time"] = 81
    assert failing(chance.parameter_checks(missions, SPACE))


def test_parameters_that_depend_on_each_other_are_found_out() -> None:
    missions = drawn()
    missions["charge_complete"] = 60 + (missions["charge_start"] - 10)
    assert failing(chance.parameter_checks(missions, SPACE)) == {
        "Correlations of all pairs: chi-square"
    }


def test_fixed_parameters_are_not_tested() -> None:
    fixed = load_scenario("fig4", uavs=2)
    assert not chance.parameter_checks(drawn(), fixed)


def test_initial_data_hold_and_others_do_not() -> None:
    starts = np.random.default_rng(9).uniform(5, 20, (3000, NODES))
    assert not failing(chance.initial_checks(starts, starts.sum(1), SPACE))
    narrow = 12.5 + 0.8 * (starts - 12.5)
    assert len(failing(chance.initial_checks(narrow, narrow.sum(1), SPACE))) == 2


def test_fixed_initial_data_are_exact() -> None:
    fixed = load_scenario("paper", initial_data=12.5)
    starts = np.full((4, NODES), 12.5)
    assert not failing(chance.initial_checks(starts, starts.sum(1), fixed))
    starts[2, 3] = 12.6
    assert failing(chance.initial_checks(starts, starts.sum(1), fixed))


def test_start_cells_are_uniform_over_the_zone() -> None:
    generator = np.random.default_rng(10)
    x, y, width, height = SPACE.zone
    cells = np.stack(
        [generator.integers(x, x + width, 400), generator.integers(y, y + height, 400)]
    )
    assert not failing([chance.start_check(cells.T, SPACE)])
    assert failing([chance.start_check(np.full((400, 2), [x, y]), SPACE)])
    beside = cells.T.copy()
    beside[0] = [x + width, y]
    assert failing([chance.start_check(beside, SPACE)])


# --- intervals ---


def test_blocks_have_the_intervals_of_their_missions() -> None:
    values = np.random.default_rng(12).uniform(size=45)
    table = chance.blocks(values, 10, share=False)
    assert len(table) == 4
    assert tuple(table.loc[1, ["mean", "low", "high"]]) == mean_interval(values[10:20])
    held = [low <= values[:40].mean() <= high for low, high in table[["low", "high"]].to_numpy()]
    assert table["holds"].tolist() == held
    successes = (values > 0.3).astype(int)
    ends = tuple(chance.blocks(successes, 10, share=True).loc[0, ["mean", "low", "high"]])
    assert ends == wilson(successes[:10].sum(), 10)


def covered(values: np.ndarray, share: bool) -> set[str]:
    return failing([chance.coverage_check("metric", values, 100, share)])


def test_intervals_of_independent_missions_cover_as_often_as_they_promise() -> None:
    generator = np.random.default_rng(13)
    assert not covered(generator.beta(8, 2, 20_000), share=False)
    for p in (0.6, 0.97, 0.9995):  # here Wilson covers more or less often than 95 %
        assert not covered((generator.random(20_000) < p).astype(int), share=True)


def test_missions_that_depend_on_each_other_are_covered_too_rarely() -> None:
    generator = np.random.default_rng(14)
    shifts = np.repeat(generator.normal(size=200), 100)
    assert covered(shifts + generator.normal(size=20_000), share=False)
    assert covered((generator.random(20_000) < np.where(shifts > 0, 0.9, 0.7)).astype(int), True)


def test_missions_that_are_too_alike_are_covered_too_often() -> None:
    values = np.tile(np.random.default_rng(15).uniform(size=100), 200)
    values += 1e-3 * np.random.default_rng(16).uniform(size=20_000)
    assert covered(values, share=False)


def test_nothing_to_cover_tells_nothing() -> None:
    for values in (np.ones(20_000), np.random.default_rng(17).uniform(size=150)):
        check = chance.coverage_check("metric", values, 100, share=False)
        assert check.p is None and check.error is None
