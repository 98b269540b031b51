"""Intervals of blocks hold the mean as often as they should, if missions are independent."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from dess import load_scenario
from dess.analysis.verification import balances, draws
from dess.analysis.verification.measurements import Log
from dess.scenario import SAMPLED
from tests.analysis.verification.changes import altered
from tests.analysis.verification.verdicts import failing, fails

SPACE = load_scenario("paper")

RATE = SPACE.arrival_rate

NODES = len(SPACE.nodes)


def poisson(rate: float = RATE, slots: int = 8000, seed: int = 1) -> np.ndarray:
    return np.random.default_rng(seed).poisson(rate, (slots, NODES))


ONE_NODE = poisson()
ONE_NODE[:, 3] = poisson(2 * RATE, seed=5)[:, 3]
EVEN = np.zeros((8000, NODES), int)
EVEN[::2, 0] = 1  # as many as lambda says, one every other slot
OF_NODES, SPREAD = f"Rates of the {NODES} nodes: chi-square", "Index of dispersion per slot"


@pytest.mark.parametrize(
    ("counts", "tests"),
    [
        (poisson(1.2 * RATE), {"Counts per node and slot: chi-square", OF_NODES}),
        (2 * poisson(RATE / 2), {SPREAD}),  # packets that come in pairs
        (EVEN, {SPREAD}),
        (
            np.repeat(poisson()[:, ::2], 2, axis=1)[:, :NODES],
            {"Counts per slot, all nodes: chi-square"},
        ),
        (
            np.repeat(poisson(slots=4000), 2, axis=0),
            {"Correlation of a slot and the next", "Counts per node and 50 slots: chi-square"},
        ),
        (ONE_NODE, {OF_NODES}),
    ],
    ids=["rate", "pairs", "even", "dependent nodes", "dependent slots", "a node"],
)
def test_other_arrivals_are_found_out(counts: np.ndarray, tests: set[str]) -> None:
    assert not failing(draws.arrival_checks(poisson(), RATE))
    assert tests <= failing(draws.arrival_checks(counts, RATE))


def test_without_arrivals_a_single_one_is_wrong() -> None:
    counts = np.zeros((50, NODES), int)
    assert not failing(draws.arrival_checks(counts, 0.0))
    counts[7, 2] = 1
    assert failing(draws.arrival_checks(counts, 0.0))


def test_the_chance_of_a_false_alarm_is_what_the_p_values_say() -> None:
    p = np.array(
        [
            [check.p for check in draws.arrival_checks(poisson(slots=1000, seed=seed), RATE)]
            for seed in range(150)
        ]
    )
    for share in (0.05, 0.5):
        low, high = stats.binom(len(p), share).ppf([0.0005, 0.9995]) / len(p)
        assert ((p <= share).mean(0) >= low - 0.02).all()
        assert ((p <= share).mean(0) <= high + 0.02).all()


def test_the_arrivals_of_all_missions_are_held_to_how_long_they_last() -> None:
    slots = np.full(400, 100)
    arrived = np.random.default_rng(4).poisson(RATE * NODES * 100, 400)
    missions = pd.DataFrame({"slots": slots, "arrived": arrived})
    assert not failing([draws.arrived_check(missions, SPACE)])
    assert failing([draws.arrived_check(missions.assign(slots=105), SPACE)])


def drawn(**ranges: Any) -> pd.DataFrame:
    generator = np.random.default_rng(8)
    ends = {field: ranges.get(field, getattr(SPACE, field)) for field in SAMPLED}
    columns = {f: generator.integers(low, high + 1, 5000) for f, (low, high) in ends.items()}
    return pd.DataFrame(columns)


DRAWN = drawn()
OUTSIDE, LATER = DRAWN["flying_time"].where(DRAWN.index != 17, 81), DRAWN["charge_start"] + 50


@pytest.mark.parametrize(
    ("missions", "tests"),
    [
        (DRAWN, set()),
        (drawn(uavs=(1, 2)), {"Number of UAVs: chi-square"}),
        (drawn(flying_time=(70, 79)), {"Flying time: chi-square"}),
        (drawn(charge_start=(10, 51)), {"Charging start capacity C_S: chi-square"}),
        (drawn(charge_complete=(59, 100)), {"Charging complete capacity C_C: chi-square"}),
        (DRAWN.assign(flying_time=OUTSIDE), {"Flying time: chi-square"}),
        (DRAWN.assign(charge_complete=LATER), {"Correlations of all pairs: chi-square"}),
    ],
)
def test_other_parameters_are_found_out(missions: pd.DataFrame, tests: set[str]) -> None:
    assert failing(draws.parameter_checks(missions, SPACE)) == tests


STARTS, FIXED = np.random.default_rng(9).uniform(5, 20, (3000, NODES)), np.full((4, NODES), 12.5)
ONE_MORE = FIXED.copy()
ONE_MORE[2, 3] = 12.6


@pytest.mark.parametrize(
    ("starts", "data", "wrong"),
    [
        (STARTS, [5, 20], 0),
        (12.5 + 0.8 * (STARTS - 12.5), [5, 20], 2),
        (FIXED, 12.5, 0),
        (ONE_MORE, 12.5, 1),
    ],
    ids=["drawn", "narrow", "fixed", "one node"],
)
def test_other_initial_data_are_found_out(starts: np.ndarray, data: Any, wrong: int) -> None:
    space = load_scenario("paper", initial_data=data)
    assert len(failing(draws.initial_checks(starts, starts.sum(1), space))) == wrong


def test_other_start_cells_are_found_out() -> None:
    x, y, width, height = SPACE.zone
    cells = np.random.default_rng(10).integers([x, y], [x + width, y + height], (400, 2))
    beside = cells.copy()
    beside[0] = [x + width, y]
    assert not failing([draws.start_check(cells, SPACE)])
    assert failing([draws.start_check(np.full((400, 2), [x, y]), SPACE)])
    assert failing([draws.start_check(beside, SPACE)])


def test_the_logs_have_what_is_audited(logs: list[Log]) -> None:
    table = pd.concat([draws.communications(log, 7) for log in logs])
    assert (table["known"] == table["residual"]).any()  # nodes that were emptied
    assert (table["known"] < table["residual"]).any()
    assert any(log.uav_slots["charging"].any() for log in logs)
    assert any(log.uav_slots["waiting"].any() for log in logs)


def test_another_communication_is_found_out(logs: list[Log]) -> None:
    """Data that are a trifle off, and another node."""
    trifle = altered(logs, "communication", 5, value=lambda value: value * (1 + 1e-9))
    choice, amount = draws.communication_checks(trifle, 7)
    assert fails(amount) and not fails(choice) and fails(balances.balance_check(trifle))
    other = altered(logs, "communication", 5, node=lambda node: (node + 1) % 3)
    assert fails(draws.communication_checks(other, 7)[0]) and fails(balances.balance_check(other))


def covered(values: np.ndarray, share: bool) -> set[str]:
    return failing([draws.coverage_check("metric", values, 100, share)])


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
