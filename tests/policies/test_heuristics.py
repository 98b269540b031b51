"""The heuristics: legal, without memory, independent of grouping, and as good as is claimed."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import policies
from dess.batch import simulate_batch
from dess.env.stepper import MissionStepper
from dess.guard import guard
from dess.mission import simulate
from dess.policies.registry import HEURISTICS
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from dess.state import HOVER
from dess.view import View
from tests.drawn import NORTH, SOUTH, Checked, replications, seeds, spaces
from tests.policies.flown import assert_same_alone, cells_of

NAMES = tuple(name for name in HEURISTICS if name != "random-unguarded")
heuristics = st.sampled_from(NAMES).map(policies.load)


def _checked(policy: Any) -> Checked:
    """A heuristic, with a check that its actions are legal and safe."""

    def allowed(view: View) -> np.ndarray:
        safe = guard(view)
        safe[:, HOVER] |= policy.name == "random"  # which hovers if every safe move is contested
        return safe & view.legal

    return Checked(policy, allowed)


def test_random_without_the_guard_is_legal_and_fails_nearly_all_missions() -> None:
    """Both choose among the same moves, unless the guard forbids one."""
    paper, unguarded = load_scenario("paper"), policies.load("random-unguarded")
    simulate(paper, Checked(unguarded, lambda view: view.legal), 21, 0)
    shares = [
        simulate_batch(paper, policies.load(name), 32, 100).missions["success"].mean()
        for name in ("random", "random-unguarded")
    ]
    assert shares[0] >= 0.97 and shares[1] <= 0.05


@given(spaces(), heuristics, seeds, replications)
def test_heuristics_are_legal_safe_and_without_memory(
    space: ScenarioSpace, policy: Any, seed: int, replication: int
) -> None:
    simulate(space, _checked(policy), seed, replication)


@given(
    spaces(),
    st.lists(st.sampled_from([*HEURISTICS]).map(policies.load), min_size=1, max_size=3),
    seeds,
    st.lists(replications, min_size=1, max_size=4),
    st.integers(1, 4),
)
def test_heuristics_do_the_same_in_any_batch(
    space: ScenarioSpace, team: list[Any], seed: int, numbers: list[int], batch_size: int
) -> None:
    team = team[: space.uavs[1]]
    workers = 1 + batch_size % 2
    assert_same_alone(space, team, seed, numbers, batch_size=batch_size, workers=workers)


# --- what each of them goes for ---


def _path(name: str, slots: int, **scenario: Any) -> list[tuple[float, float]]:
    """The cells of a lone UAV that starts at (8, 8), slot by slot."""
    world = {"grid": 16, "zone": [8, 8, 1, 1], "uavs": 1, "max_slots": slots}
    record = simulate(Scenario.of(**(world | scenario)), policies.load(name), 3, events=True)
    return cells_of(record)


def test_greedy_weighs_data_against_distance() -> None:
    nodes = [[8, 6], [8, 12]]  # 2 and 4 cells from (8, 8)
    seen = set()
    for seed in range(40):
        world = {"grid": 16, "zone": [8, 8, 1, 1], "uavs": 1, "max_slots": 1, "nodes": nodes}
        scenario = Scenario.of(**world, initial_data=[0.0, 100.0])
        record = simulate(scenario, policies.load("greedy"), seed, events=True)
        assert record.events is not None
        log = record.events.columns()
        data = log["value"][(log["event"] == "mission_start") & (log["node"] >= 0)]
        ((_, y),) = cells_of(record)
        near = data[0] / (2 + 1) > data[1] / (4 + 1)
        if min(data) > 15:  # both worth a visit
            assert y == (7 if near else 9)
            seen.add(near)
    assert seen == {True, False}


def test_tour_visits_every_node_once_around() -> None:
    # Eight nodes on a ring, listed in no order: the circuit takes them one after another.
    ring = [(2, 2), (8, 2), (14, 2), (14, 8), (14, 14), (8, 14), (2, 14), (2, 8)]
    nodes = [ring[k] for k in (3, 6, 0, 5, 1, 7, 4, 2)]
    world = {"nodes": nodes, "initial_data": 20, "flying_time": 100, "quota": 1000}
    path = _path("tour", 80, **world, arrival_rate=0.0)
    visits = list(dict.fromkeys(ring.index(cell) for cell in path if cell in ring))
    assert sorted(visits) == list(range(8))
    steps = {(b - a) % 8 for a, b in zip(visits, visits[1:], strict=False)}
    assert steps in ({1}, {7})


# --- how good they are ---


@pytest.mark.parametrize("name", NAMES)
def test_a_lone_uav_never_fails(name: str) -> None:
    records = simulate_batch(load_scenario("paper", uavs=1), policies.load(name), 31, 250)
    assert records.missions["success"].all()
    assert (records.uavs["slots_charging"] > 0).all()  # eq. 6: it takes at least one charge


def test_the_best_heuristic_is_as_good_as_the_readme_says() -> None:
    products = {}
    for name in NAMES:
        missions = simulate_batch(load_scenario("paper"), policies.load(name), 32, 500).missions
        products[name] = missions["collection_ratio_and_communication"].mean()
        if name != "random":
            assert missions["success"].mean() >= 0.99
    assert max(products.values()) >= 0.74
    assert min(products, key=lambda name: products[name]) == "random"


def test_age_flies_to_the_stalest_node_for_the_distance() -> None:
    # 2 cells to the north, age 30 at the end of the slot; 4 cells to the south, age 50 or 60.
    scenario = {"grid": 16, "zone": [8, 8, 1, 1], "uavs": 1, "nodes": [[8, 6], [8, 12]]}
    for age, data, action in ((50, 5, NORTH), (60, 5, SOUTH), (60, 0, NORTH)):
        stepper = MissionStepper(Scenario.of(**scenario), 1, 1)
        stepper.launch(stepper.indices)
        state, here = stepper.state, np.zeros(1, int)
        state.missions["slot"], state.residual[0] = 99, (5, data)
        state.sensors["newest"][0] = 70, 100 - age
        # 30 / 3 + 0.1 * 50 / 9 > 50 / 5 + 0.1 * 30 / 11, but 30 / 3 + ... < 60 / 5 + ...
        (asked,) = policies.load("age").act(View(state, stepper.world, here, here))
        assert asked == action
