"""The planner as a policy: the same in any engine and batch, safe, and better than the others."""

from typing import Any

from hypothesis import given
from hypothesis import strategies as st

import policies
from dess import simulate, simulate_batch
from dess.observations.guard import guard
from dess.scenario import ScenarioSpace
from policies.planner import Planner
from tests.drawn import Checked, replications, seeds, spaces


class Quick(Planner):
    """The planner with a search that is short enough for tests."""

    name = "quick"
    new, kept = 60, 3


def _same(one: Any, records: Any, job: int) -> None:
    assert one.metrics.tobytes() == records.missions[job].tobytes()
    assert one.uavs.tobytes() == records.uavs[job, : len(one.uavs)].tobytes()


@given(
    spaces(),
    st.lists(st.sampled_from([Quick(), policies.load("greedy")]), min_size=1, max_size=3),
    seeds,
    st.lists(replications, min_size=1, max_size=4),
    st.integers(1, 4),
)
def test_the_planner_does_the_same_in_any_engine_and_batch(
    space: ScenarioSpace, team: list[Any], seed: int, numbers: list[int], batch_size: int
) -> None:
    team = team[: space.uavs[1]]
    records = simulate_batch(
        space, team, seed, numbers, batch_size=batch_size, workers=1 + batch_size % 2
    )
    for job, number in enumerate(numbers):
        _same(simulate(space, team, seed, number), records, job)


@given(spaces(), seeds, replications)
def test_its_actions_are_safe_and_do_not_depend_on_the_rows_asked_for(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    simulate(space, Checked(Quick(), guard), seed, replication)
