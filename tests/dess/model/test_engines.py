"""Both engines, any grouping: the same mission is the same record, bit for bit."""

from threading import get_ident
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dess.model import batch
from dess.model.batch import BATCH_SIZE, MOST_WORK, simulate_batch
from dess.model.events import EVENT_NAMES, FAILURE_EVENTS, PACKET_EVENTS
from dess.model.mission import simulate
from dess.model.record import Records
from dess.model.state import BATTERY, HOVER, LANDED, QUOTA, TRUNCATED, sample_scenario
from dess.model.view import View
from dess.policies import load
from dess.scenario.families import FAMILIES
from dess.scenario.scenario import ScenarioSpace, load_scenario
from tests.dess.model.flights import assert_same_alone, is_same
from tests.drawn import (
    Commuter,
    Fidget,
    Script,
    Wanderer,
    continuous_spaces,
    extended_spaces,
    replications,
    seeds,
    sheet_spaces,
    spaces,
    teams,
)

# Few pads, many UAVs, short batteries: everything happens that can happen.
BUSY = ScenarioSpace.of(
    **{"grid": 7, "zone": [2, 3, 3, 2], "nodes": [[0, 0], [3, 1], [6, 6], [1, 5]]},
    **{"uavs": [1, 6], "pads": 2, "flying_time": [15, 40], "charge_start": [12, 20]},
    **{"charge_complete": [25, 45], "charge_rate": 4, "communication_slots": 5},
    **{"quota": 280, "max_slots": 70},
)
# Of each kind of failure some are repaired.
FAILING = {
    "failures": {
        **{"uav_rate": 0.01, "uav_repair": 3.0, "pad_rate": 0.05, "pad_repair": 5.0},
        **{"node_rate": 0.02, "node_repair": 4.0, "node_data": "lost"},
    },
    "charging": {"order": "lowest-battery", "power": 7},
}
BOTH = pytest.mark.parametrize("run", [simulate, simulate_batch])


def _equal(one: Records, other: Records) -> bool:
    return all(a.tobytes() == b.tobytes() for a, b in zip(one, other, strict=True))


@given(
    extended_spaces() | sheet_spaces(), teams, seeds, st.lists(replications, min_size=1, max_size=4)
)
def test_both_engines_give_the_same_record(space, team, seed, numbers):
    assert_same_alone(space, team[: space.uavs[1]], seed, numbers, batch_size=2)


@pytest.mark.parametrize("sections", [{}, FAILING, FAILING | {"landing": True, "quota": 100}])
def test_both_engines_agree_where_everything_happens(sections):
    space = ScenarioSpace.of(BUSY, forbid_swaps=not sections, **sections)
    seen, ends, fleets, waited = set(), set(), set(), 0
    for policy in (Wanderer(), Commuter(), Fidget()):
        records = simulate_batch(space, policy, 2**64 - 1, 15)
        for job in range(15):
            single = simulate(space, policy, 2**64 - 1, job, events=True)
            assert is_same(records, job, single) and single.events is not None
            seen.update(single.events.event)
            ends.update(single.uavs["end"].tolist())
            fleets.add(len(single.uavs))
            waited += int(single.uavs["slots_waiting"].sum())
    lands = space.landing
    absent = {*PACKET_EVENTS, "remainder", *(() if lands else ["landing"])}
    assert seen == {*EVENT_NAMES} - absent - ({*()} if sections else {*FAILURE_EVENTS})
    assert ends == {LANDED if lands else QUOTA, BATTERY, TRUNCATED}
    assert fleets == {1, 2, 3, 4, 5, 6}
    assert waited > 100


@pytest.mark.parametrize("sea", [f"{family}:5" for family in FAMILIES] + ["german-bight"])
def test_both_engines_agree_on_generated_seas_and_bays(sea):
    assert_same_alone(load_scenario(sea), load("greedy"), 3, range(2))


# --- batches ---


def test_a_batch_is_its_missions_in_any_order_and_grouping():
    numbers, team = np.array([5, 3, 2**32 - 1, 0, 77, 3, 12, 8]), [Fidget(), Wanderer()]
    whole = simulate_batch(BUSY, team, 9, numbers)
    assert whole.missions["replication"].tolist() == numbers.tolist()
    for batch_size in (1, 3, 100):
        assert _equal(simulate_batch(BUSY, team, 9, numbers, batch_size=batch_size), whole)
    order = np.random.default_rng(1).permutation(len(numbers))
    for jobs in (order, *np.arange(len(numbers))[:, None]):
        part = simulate_batch(BUSY, team, 9, numbers[jobs], batch_size=4)
        assert _equal(part, Records(whole.missions[jobs], whole.uavs[jobs]))


@pytest.mark.parametrize("workers", [1, 2, 20])
def test_workers_change_nothing(workers):
    """And each mission is reported once."""
    finished: list[int] = []
    one, changes = simulate_batch(BUSY, Fidget(), 4, 30), {"batch_size": 4, "workers": workers}
    other = simulate_batch(BUSY, Fidget(), 4, 30, **changes, progress=finished.append)
    assert _equal(one, other)
    assert sum(finished) == 30 and len(finished) > 1 and min(finished) > 0


class _FailsInOneThread:
    """Hovers, but for the thread that asks first; there it fails when others have been asked."""

    name = "fails"

    def __init__(self) -> None:
        self.first, self.last_slot = 0, 0

    def act(self, view: View) -> np.ndarray:
        self.first = self.first or get_ident()
        if self.first != get_ident():
            self.last_slot = max(self.last_slot, int(view.constants["slot"].max()))
        elif self.last_slot:
            raise RuntimeError("failed")
        return np.full(len(view), HOVER)


def test_an_error_in_one_thread_ends_the_others():
    """So does Ctrl-C, which is raised in the main thread."""
    endless = ScenarioSpace.of(BUSY, flight_cost=0, quota=10**6, max_slots=100_000)
    policy = _FailsInOneThread()
    with pytest.raises(RuntimeError, match="failed"):
        simulate_batch(endless, policy, 4, 3, workers=3)
    assert 0 < policy.last_slot < 90_000


def test_a_batch_is_small_where_a_mission_is_large(monkeypatch):
    """A slot of all missions in progress is one call of compiled code, which cannot be ended."""
    advanced: list[int] = []
    original = batch._advance

    def counted(job_of: np.ndarray, *others: Any) -> None:
        advanced.append(len(job_of))
        original(job_of, *others)

    monkeypatch.setattr(batch, "_advance", counted)
    whole = simulate_batch(BUSY, Fidget(), 9, 30)
    monkeypatch.setattr(batch, "MOST_WORK", 5 * batch.work_of(BUSY))
    assert _equal(simulate_batch(BUSY, Fidget(), 9, 30), whole)
    assert [*dict.fromkeys(advanced)] == [30, 5]
    nodes = [[x, y] for x in range(32) for y in range(32)]
    large = {"grid": 57, "zone": [0, 0, 57, 57], "uavs": 64, "communication_slots": 64}
    assert batch.work_of(ScenarioSpace.of(**large, nodes=nodes)) > MOST_WORK
    assert BATCH_SIZE * batch.work_of(load_scenario("paper")) < MOST_WORK


@settings(max_examples=settings().max_examples // 3)  # an example has six missions or more
@given(st.lists(spaces(), min_size=2, max_size=3), st.data(), seeds, st.integers(1, 2))
def test_scenarios_of_different_worlds_fly_in_one_batch(worlds, data, seed, workers):
    # The same worlds again with other fleets, which share a world, and with nodes in another order.
    again = [ScenarioSpace.of(space, uavs=1) for space in worlds]
    again += [ScenarioSpace.of(space, nodes=space.nodes[::-1]) for space in worlds]
    mixed = data.draw(st.permutations(worlds + again))
    numbers = range(len(mixed))
    records = simulate_batch(mixed, Fidget(), seed, numbers, workers=workers, batch_size=2)
    for job, space in enumerate(mixed):
        assert is_same(records, job, simulate(space, Fidget(), seed, job))


# --- random numbers ---


@given(spaces(), seeds, replications)
def test_a_mission_of_a_space_is_the_mission_of_its_drawn_scenario(space, seed, replication):
    """And whether its events are kept changes nothing."""
    drawn = sample_scenario(space, seed, replication)
    one = simulate(space, Fidget(), seed, replication)
    other = simulate(drawn, Fidget(), seed, replication, events=True)
    assert one.metrics.tobytes() == other.metrics.tobytes()
    assert one.uavs.tobytes() == other.uavs.tobytes()
    assert one.metrics["uavs"] == drawn.uavs == len(one.uavs)


RANDOM_EVENTS = (
    "mission_start",
    "arrival",
    "node_failure",
    "node_repair",
    "pad_failure",
    "pad_repair",
)


@given(spaces(arrival_rate=0.3) | extended_spaces() | continuous_spaces(), seeds, replications)
def test_two_policies_have_common_random_numbers(space, seed, replication):
    """Start cells, initial data, arrivals, and failures but for those of UAVs that fly or not."""
    records = [simulate(space, p, seed, replication, events=True) for p in (Wanderer(), Commuter())]
    until, kept = min(record.slots for record in records), []
    for record in records:
        assert record.events is not None
        rows = [row for row in record.events if row.event in RANDOM_EVENTS and row.time < until]
        held = [0.0 if row.event in RANDOM_EVENTS[2:4] else row.value for row in rows]
        places = [(row.time, row.event, row.uav, row.node, row.x, row.y) for row in rows]
        kept.append([*zip(places, held, strict=True)])
    assert kept[0] == kept[1]


# --- teams ---


class _Watcher(Script):
    """Hovers, and remembers whom it was asked for, and what it saw of the first UAV's decision."""

    def __init__(self) -> None:
        super().__init__(*[""] * 5)
        self.uavs: set[int] = set()
        self.seen: set[int] = set()

    def act(self, view: View) -> np.ndarray:
        self.uavs.update(view.uav.tolist())
        self.seen.update(view.team["action"][:, 0].tolist())
        return super().act(view)


def test_a_queue_changes_its_order_where_hovering_takes_more_of_some():
    costs = [[1] * 5 for _ in range(8)]
    costs[3][HOVER] = 2  # of a UAV that takes four slots for a cell
    space = ScenarioSpace.of(
        **{"grid": 4, "zone": [0, 0, 3, 2], "nodes": [[0, 0]], "pads": 1, "quota": 5},
        **{"uavs": 4, "flying_time": 8, "charge_start": 10, "charge_complete": [11, 20]},
        **{"charge_rate": 3, "max_slots": 20, "charging": {"order": "lowest-battery"}},
        **{"initial_data": 0.0, "arrival_rate": 0.0, "consumption": {"slots": costs}},
        fleet=[{}, {"flying_time": 8, "slots_per_cell": 4}, {}],
    )
    assert_same_alone(space, [Fidget()], 11, range(40))


@BOTH
def test_uav_i_has_policy_i_modulo_the_team_and_sees_no_decision_of_the_slot(run):
    one, other = _Watcher(), _Watcher()
    run(ScenarioSpace.of(BUSY, uavs=5), [one, other], 0)
    assert (one.uavs, other.uavs) == ({0, 2, 4}, {1, 3})
    run(ScenarioSpace.of(BUSY, uavs=2, max_slots=1), [Script("N"), one], 0)
    assert one.seen == {HOVER}


# --- what is refused ---


# No action, too many, real numbers, truth values.
@BOTH
@pytest.mark.parametrize("actions", [[5], [-1], [0, 0], [1.0], [True]])
def test_what_is_no_action_is_refused(run, actions):
    policy = Script()
    policy.act = lambda view: np.resize(actions, len(view) + len(actions) - 1)
    with pytest.raises(ValueError, match="policy script: act must return"):
        run(BUSY, policy, 0)


OF_BOTH: list[tuple[dict[str, Any], str]] = [
    ({"policy": [Wanderer()] * 7}, "has 7 policies, but the largest fleet has 6 UAVs; allowed: 6"),
    ({"policy": []}, "at least one policy"),
    ({"seed": -1}, "seed: -1 is out of range"),
    ({"seed": 1.5}, "^seed: 1.5 is of type float; allowed: an integer$"),
]
OF_BATCHES: list[tuple[dict[str, Any], str]] = [
    ({"replications": [0, 2**32]}, "replication: 4294967296 is out of range"),
    ({"replications": [-1, 4]}, "replication: -1 is out of range"),
    ({"replications": [0.5]}, "integers"),
    ({"workers": 0}, "at least 1"),
    ({"batch_size": 0}, "at least 1"),
]
REFUSED = [(run, *row) for run in (simulate, simulate_batch) for row in OF_BOTH]
REFUSED += [(simulate_batch, *row) for row in OF_BATCHES]


@pytest.mark.parametrize(("run", "arguments", "line"), REFUSED)
def test_bad_arguments_are_refused(run, arguments, line):
    with pytest.raises((ValueError, TypeError), match=line):
        run(**{"scenario": BUSY, "policy": Wanderer()} | arguments)
