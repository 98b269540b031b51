"""The planner as a policy: the same in any engine and batch, safe, and ahead of the heuristics."""

import gc

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from dess import load_scenario, policies, simulate, simulate_batch
from dess.model.guard import guard
from dess.model.view import View
from dess.policies.planner import Planner, plan_of
from dess.policies.planner.policy import _MEMORIES, Budget
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import assert_same_alone, cells_of
from tests.drawn import PLAIN_SEA, Checked, extended_spaces, replications, seeds, spaces


class Quick(Planner):
    """The planner with a search that is short enough for tests."""

    name = "quick"
    budget = Budget(60, 20)


QUICK = Quick()


@given(
    # Two kinds of seas that the pins of records have, as each kind compiles a planner.
    spaces().filter(lambda space: space.no_fly)
    | extended_spaces(fleet=[{"slots_per_cell": 2}, {}], **PLAIN_SEA),
    st.lists(st.sampled_from([QUICK, policies.load("greedy")]), min_size=1, max_size=3),
    seeds,
    st.lists(replications, min_size=1, max_size=4),
    st.integers(1, 4),
)
@settings(max_examples=12)
def test_the_planner_does_the_same_in_any_engine_and_batch(space, team, seed, numbers, batch_size):
    team = team[: space.uavs[1]]
    assert_same_alone(space, team, seed, numbers, batch_size=batch_size)


def test_the_planner_does_the_same_in_two_processes():
    space = load_scenario("paper", quota=80)
    alone, together = (simulate_batch(space, QUICK, 5, 4, workers=n) for n in (1, 2))
    assert together.missions.tobytes() == alone.missions.tobytes()


@given(spaces(), seeds, replications)
@settings(max_examples=20)
def test_its_actions_are_safe_and_do_not_depend_on_the_rows_asked_for(space, seed, replication):
    simulate(space, Checked(QUICK, guard), seed, replication)


def test_missions_of_the_same_coordinates_do_not_meet():
    """Two missions in turns, of the same seed and replication but with other seas."""
    one = load_scenario("paper", uavs=2, quota=60)
    other = ScenarioSpace.of(one, arrival_rate=0.5)
    alone = [simulate(space, QUICK, 3, 1).metrics for space in (one, other)]

    class InTurns:
        """The planner, which between its decisions is asked to plan for the other mission."""

        name = "in-turns"

        def act(self, view: View) -> np.ndarray:
            simulate(other, QUICK, 3, 1)
            return QUICK.act(view)

    short = ScenarioSpace.of(one, quota=12)
    assert simulate(short, InTurns(), 3, 1).metrics == simulate(short, QUICK, 3, 1).metrics
    assert [simulate(space, QUICK, 3, 1).metrics for space in (one, other)] == alone


def test_plans_go_with_the_missions_that_they_belong_to():
    gc.collect()
    before = len(_MEMORIES)
    simulate_batch(load_scenario("paper", uavs=1, quota=20), QUICK, 1, 3, batch_size=2)
    gc.collect()
    assert len(_MEMORIES) == before


# --- how good it is ---


def test_a_longer_search_pays_and_beats_the_best_heuristic():
    paper, products = load_scenario("paper"), {}

    class Better(Planner):
        budget = Budget(6_000, 600)

    team = {"quick": QUICK, "better": Better(), "greedy": policies.load("greedy")}
    for name, policy in team.items():
        missions = simulate_batch(paper, policy, 777001, 20).missions
        products[name] = missions["collection_ratio_and_communication"]
        assert missions["success"].all()
    assert (products["better"] - products["quick"]).mean() > 0.02
    assert (products["better"] - products["greedy"]).mean() > 0.02


# --- courses ---


def test_a_plan_is_drawn_as_it_is_flown():
    """A lone UAV's first step of every plan is where it flies, but for what the guard forbids."""
    space = load_scenario("paper", uavs=1)
    plans = plan_of(space, 777001, 3, QUICK)
    record = simulate(space, QUICK, 777001, 3, events=True)
    cells = cells_of(record)
    assert set(plans) <= set(range(len(cells))) and 0 in plans
    kept = 0
    for slot, (course,) in plans.items():
        assert len(course.waypoints) == len(course.stays)
        assert np.abs(np.diff(course.path, axis=0)).sum(1).max() <= 1  # a cell per slot
        if slot > 0:
            assert tuple(course.path[0]) == cells[slot - 1]
        kept += tuple(course.path[1]) == cells[slot]
    assert kept > 0.9 * len(plans)
    start = plans[0][0]
    assert (start.stays == -1).any()  # it must charge
    assert len(start.path) > 100  # some 110 flying slots, and those to charge


def test_a_search_is_the_same_after_one_for_another_mission():
    """Teams fly these missions for a number of slots that ends between two snapshots."""
    space, policy = load_scenario("paper", uavs=3), policies.load("planner-short")
    together = simulate_batch(space, policy, 0, [4, 11, 24]).missions
    for record in together:
        (alone,) = simulate_batch(space, policy, 0, [record["replication"]]).missions
        assert record.tobytes() == alone.tobytes()
