"""The heuristics: legal, without memory, independent of grouping, and as good as is claimed."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import policies
from dess.envs.stepper import MissionStepper
from dess.model.batch import simulate_batch
from dess.model.guard import guard
from dess.model.mission import simulate
from dess.model.state import HOVER
from dess.model.view import View
from dess.policies.shipped import HEURISTICS
from dess.scenario.scenario import Scenario, load_scenario
from tests.dess.model.flights import assert_same_alone, cells_of
from tests.drawn import NORTH, SOUTH, Checked, replications, seeds, spaces

NAMES = tuple(name for name in HEURISTICS if name != "random-unguarded")
heuristics = st.sampled_from(NAMES).map(policies.load)


def _checked(policy: Any) -> Checked:
    """A heuristic, with a check that its actions are legal and safe."""

    def allowed(view: View) -> np.ndarray:
        safe = guard(view)
        safe[:, HOVER] |= policy.name == "random"  # which hovers if every safe move is contested
        return safe & view.legal

    return Checked(policy, allowed)


def test_random_without_the_guard_is_legal_and_fails_nearly_all_missions():
    """Both choose among the same moves, unless the guard forbids one."""
    paper, unguarded = load_scenario("paper"), policies.load("random-unguarded")
    simulate(paper, Checked(unguarded, lambda view: view.legal), 21, 0)
    shares = [
        simulate_batch(paper, policies.load(name), 32, 100).missions["success"].mean()
        for name in ("random", "random-unguarded")
    ]
    assert shares[0] >= 0.97 and shares[1] <= 0.05


@given(spaces(), heuristics, seeds, replications)
def test_heuristics_are_legal_safe_and_without_memory(space, policy, seed, replication):
    simulate(space, _checked(policy), seed, replication)


@given(
    spaces(),
    st.lists(st.sampled_from([*HEURISTICS]).map(policies.load), min_size=1, max_size=3),
    seeds,
    st.lists(replications, min_size=1, max_size=4),
    st.integers(1, 4),
)
def test_heuristics_do_the_same_in_any_batch(space, team, seed, numbers, batch_size):
    team = team[: space.uavs[1]]
    workers = 1 + batch_size % 2
    assert_same_alone(space, team, seed, numbers, batch_size=batch_size, workers=workers)


# --- what each of them goes for ---


@pytest.mark.parametrize(
    ("name", "data", "ages", "action"),
    [
        # A third of the near node's data, or a fifth of the other's, whichever is more.
        *(("greedy", (20, 30), (0, 0), NORTH), ("greedy", (20, 34), (0, 0), SOUTH)),
        *(("greedy", (60, 99), (0, 0), NORTH), ("greedy", (60, 101), (0, 0), SOUTH)),
        # At the end of the slot 30 / 3 + 0.1 * 50 / 9 > 50 / 5 + 0.1 * 30 / 11; not for 60 / 5.
        *(("age", (5, 5), (30, 50), NORTH), ("age", (5, 5), (30, 60), SOUTH)),
        ("age", (5, 0), (30, 60), NORTH),
    ],
)
def test_the_node_that_is_worth_the_way(name, data, ages, action):
    """One 2 cells to the north, the other 4 cells to the south."""
    scenario = {"grid": 16, "zone": [8, 8, 1, 1], "uavs": 1, "nodes": [[8, 6], [8, 12]]}
    stepper = MissionStepper(Scenario.of(**scenario), 1, 1)
    stepper.launch(stepper.indices)
    state, here = stepper.state, np.zeros(1, int)
    state.missions["slot"], state.residual[0] = 99, data
    state.sensors["newest"][0] = 100 - np.array(ages)
    view = View(state, stepper.world, here, here)
    assert policies.load(name).act(view).tolist() == [action]


def test_tour_visits_every_node_once_around():
    # Eight nodes on a ring, listed in no order: the circuit takes them one after another.
    ring = [(2, 2), (8, 2), (14, 2), (14, 8), (14, 14), (8, 14), (2, 14), (2, 8)]
    nodes = [ring[k] for k in (3, 6, 0, 5, 1, 7, 4, 2)]
    world = {"nodes": nodes, "initial_data": 20, "flying_time": 100, "quota": 1000}
    world |= {"grid": 16, "zone": [8, 8, 1, 1], "uavs": 1, "max_slots": 80, "arrival_rate": 0.0}
    path = cells_of(simulate(Scenario.of(**world), policies.load("tour"), 3, events=True))
    visits = list(dict.fromkeys(ring.index(cell) for cell in path if cell in ring))
    assert sorted(visits) == list(range(8))
    steps = {(b - a) % 8 for a, b in zip(visits, visits[1:], strict=False)}
    assert steps in ({1}, {7})


# Of a sea with four nodes about the zone, whose data never end.
SHEET = {
    **{"endurance": "30 min", "cruise": "10 m/s", "charging": "30 min", "horizon": "3 h"},
    **{"bandwidth": "1 MHz", "snr": "20 dB at 100 m", "range": "400 m"},
}


@pytest.mark.parametrize("data_rate", ["1 MB/h", "10 GB/h"])
def test_tour_goes_on_from_nodes_that_are_never_without_data(data_rate):
    """At e1931ad2 a UAV stayed at the first node until it had to charge, and came back to it.

    Of 10 GB/h no node can be emptied: there a visit ends when the others have more data.
    """
    nodes = [[2, 2], [9, 2], [9, 9], [2, 9]]
    world = {"nodes": nodes, "grid": 12, "zone": [5, 5, 2, 2], "uavs": 1}
    sheet = SHEET | {"data_rate": data_rate}
    scenario = Scenario.of(data_sheet=sheet, **world)
    log = simulate(scenario, policies.load("tour"), 3, events=True).events.columns()
    is_served = log["event"] == "communication"
    collected = np.bincount(log["node"][is_served], log["value"][is_served], len(nodes))
    assert collected.min() > 0.5 * collected.max()


@pytest.mark.parametrize("name", ["greedy", "tour", "age"])
def test_a_node_beyond_the_battery_is_served_from_where_it_is_in_range(name):
    """A full battery is 49 cells out and back; the range of 400 m is 5 cells."""
    sheet = SHEET | {"cruise": "4 m/s", "data_rate": "1 MB/h"}
    world = {"nodes": [[4, 0], [53, 0]], "grid": 64, "rows": 4, "zone": [0, 0, 1, 2], "uavs": 1}
    result = simulate(Scenario.of(data_sheet=sheet, **world), policies.load(name), 3, events=True)
    log = result.events.columns()
    is_served = log["event"] == "communication"
    collected = np.bincount(log["node"][is_served], log["value"][is_served], 2)
    assert collected[1] > 0.2 * collected[0]
    assert result.metrics["success"] == 1
    assert max(x for x, _ in cells_of(result)) < 49


# --- how good they are ---


def test_the_best_heuristic_is_as_good_as_the_readme_says():
    products = {}
    for name in NAMES:
        missions = simulate_batch(load_scenario("paper"), policies.load(name), 32, 500).missions
        products[name] = missions["collection_ratio_and_communication"].mean()
        if name != "random":
            assert missions["success"].mean() >= 0.99
    assert max(products.values()) >= 0.74
    assert min(products, key=lambda name: products[name]) == "random"
