"""Intervals of blocks hold the mean as often as they should, if missions are independent."""

from typing import Any

import numpy as np
import pandas as pd
import pytest
from scipy import stats

from analysis.stats.intervals import mean_interval, wilson
from analysis.verification import balances, draws
from analysis.verification.measurements import Log
from dess import load_scenario
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
    assert len(failing(draws.parameter_checks(missions, SPACE))) == 1


def test_a_single_value_outside_its_range_is_wrong() -> None:
    missions = drawn()
    missions.loc[17, "flying_time"] = 81
    assert failing(draws.parameter_checks(missions, SPACE))


def test_parameters_that_depend_on_each_other_are_found_out() -> None:
    missions = drawn()
    missions["charge_complete"] = 60 + (missions["charge_start"] - 10)
    assert failing(draws.parameter_checks(missions, SPACE)) == {
        "Correlations of all pairs: chi-square"
    }


def test_initial_data_hold_and_others_do_not() -> None:
    starts = np.random.default_rng(9).uniform(5, 20, (3000, NODES))
    assert not failing(draws.initial_checks(starts, starts.sum(1), SPACE))
    narrow = 12.5 + 0.8 * (starts - 12.5)
    assert len(failing(draws.initial_checks(narrow, narrow.sum(1), SPACE))) == 2


def test_fixed_initial_data_are_exact() -> None:
    fixed = load_scenario("paper", initial_data=12.5)
    starts = np.full((4, NODES), 12.5)
    assert not failing(draws.initial_checks(starts, starts.sum(1), fixed))
    starts[2, 3] = 12.6
    assert failing(draws.initial_checks(starts, starts.sum(1), fixed))


def test_start_cells_are_uniform_over_the_zone() -> None:
    generator = np.random.default_rng(10)
    x, y, width, height = SPACE.zone
    cells = np.stack(
        [generator.integers(x, x + width, 400), generator.integers(y, y + height, 400)]
    )
    assert not failing([draws.start_check(cells.T, SPACE)])
    assert failing([draws.start_check(np.full((400, 2), [x, y]), SPACE)])
    beside = cells.T.copy()
    beside[0] = [x + width, y]
    assert failing([draws.start_check(beside, SPACE)])


def test_the_logs_have_what_is_audited(logs: list[Log]) -> None:
    table = pd.concat([draws.communications(log, 7) for log in logs])
    assert (table["known"] == table["residual"]).any()  # nodes that were emptied
    assert (table["known"] < table["residual"]).any()
    assert any(log.uav_slots["charging"].any() for log in logs)
    assert any(log.uav_slots["waiting"].any() for log in logs)


def test_data_that_are_a_trifle_off_are_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 5, value=lambda value: value * (1 + 1e-9))
    choice, amount = draws.communication_checks(changed, 7)
    assert fails(amount) and not fails(choice)
    assert fails(balances.balance_check(changed))


def test_another_node_is_noticed(logs: list[Log]) -> None:
    changed = altered(logs, "communication", 5, node=lambda node: (node + 1) % 3)
    choice, _ = draws.communication_checks(changed, 7)
    assert fails(choice)
    assert fails(balances.balance_check(changed))


def test_blocks_have_the_intervals_of_their_missions() -> None:
    values = np.random.default_rng(12).uniform(size=45)
    table = draws.blocks(values, 10, share=False)
    assert len(table) == 4
    assert tuple(table.loc[1, ["mean", "low", "high"]]) == mean_interval(values[10:20])
    held = [low <= values[:40].mean() <= high for low, high in table[["low", "high"]].to_numpy()]
    assert table["holds"].tolist() == held
    successes = (values > 0.3).astype(int)
    ends = tuple(draws.blocks(successes, 10, share=True).loc[0, ["mean", "low", "high"]])
    assert ends == wilson(successes[:10].sum(), 10)


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
