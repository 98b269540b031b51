"""Both engines, any grouping: the same mission is the same record, bit for bit."""

from collections.abc import Sequence
from threading import active_count, get_ident
from time import sleep
from typing import Any

import numpy as np
import pytest
from hypothesis import event, given
from hypothesis import strategies as st

from dess import InputError, batch
from dess.batch import BATCH_SIZE, MOST_WORK, simulate_batch
from dess.mission import simulate
from dess.record import EVENT_NAMES, FAILURE_EVENTS, PACKET_EVENTS, MissionRecord, Records
from dess.scenario import ScenarioSpace, load_scenario
from dess.state import BATTERY, HOVER, QUOTA, TRUNCATED, sample_scenario
from dess.view import View
from tests.drawn import (
    Commuter,
    Fidget,
    Script,
    Wanderer,
    continuous_spaces,
    extended_spaces,
    replications,
    seeds,
    spaces,
    teams,
)

# Few pads, many UAVs, short batteries: everything happens that can happen.
BUSY = ScenarioSpace.of(
    grid=7,
    zone=[2, 3, 3, 2],
    uavs=[1, 6],
    pads=2,
    nodes=[[0, 0], [3, 1], [6, 6], [1, 5]],
    flying_time=[15, 40],
    charge_start=[12, 20],
    charge_complete=[25, 45],
    charge_rate=4,
    communication_slots=5,
    quota=280,
    max_slots=70,
)


def _is(records: Records, job: int, single: MissionRecord) -> bool:
    """Whether a row of a batch is a single mission, to the last bit."""
    fleet = len(single.uavs)
    absent = records.uavs[job, fleet:]
    return (
        records.missions[job].tobytes() == single.metrics.tobytes()
        and records.uavs[job, :fleet].tobytes() == single.uavs.tobytes()
        and absent.tobytes() == np.zeros_like(absent).tobytes()
        and (
            single.operations is None
            or records.operations[job].tobytes() == single.operations.tobytes()
        )
    )


def _equal(one: Records, other: Records) -> bool:
    return all(a.tobytes() == b.tobytes() for a, b in zip(one, other, strict=True))


@given(extended_spaces(), teams, seeds, st.lists(replications, min_size=1, max_size=4))
def test_both_engines_give_the_same_record(
    space: ScenarioSpace, team: Sequence[Any], seed: int, numbers: list[int]
) -> None:
    team = team[: space.uavs[1]]
    records = simulate_batch(space, team, seed, numbers, batch_size=2)
    for job, replication in enumerate(numbers):
        assert _is(records, job, simulate(space, team, seed, replication))
    for name, code in (("quota", QUOTA), ("battery", BATTERY), ("truncated", TRUNCATED)):
        if (records.uavs["end"] == code).any():
            event(f"end {name}")
    if records.uavs["slots_waiting"].any():
        event("queue")
    if records.uavs["slots_charging"].any():
        event("charging")


# Of each kind of failure some are repaired.
FAILING = {
    "failures": {
        **{"uav_rate": 0.01, "uav_repair": 3.0, "pad_rate": 0.05, "pad_repair": 5.0},
        **{"node_rate": 0.02, "node_repair": 4.0, "node_data": "lost"},
    },
    "charging": {"order": "lowest-battery", "power": 7},
}


@pytest.mark.parametrize("sections", [{}, FAILING])
@pytest.mark.parametrize("forbid_swaps", [False, True])
def test_both_engines_agree_where_everything_happens(
    forbid_swaps: bool, sections: dict[str, Any]
) -> None:
    space = ScenarioSpace.of(BUSY, forbid_swaps=forbid_swaps, **sections)
    seen, ends, fleets, waited = set(), set(), set(), 0
    for policy in (Wanderer(), Commuter(), Fidget()):
        records = simulate_batch(space, policy, 2**64 - 1, 25)
        for job in range(25):
            single = simulate(space, policy, 2**64 - 1, job, events=True)
            assert _is(records, job, single)
            assert single.events is not None
            seen.update(single.events.columns()["event"])
            ends.update(single.uavs["end"].tolist())
            fleets.add(len(single.uavs))
            waited += int(single.uavs["slots_waiting"].sum())
    absent = {*PACKET_EVENTS} if sections else {*PACKET_EVENTS, *FAILURE_EVENTS}
    assert seen == {*EVENT_NAMES} - absent
    assert ends == {QUOTA, BATTERY, TRUNCATED}
    assert fleets == {1, 2, 3, 4, 5, 6}
    assert waited > 100


# --- batches ---


def test_a_batch_is_its_missions_in_any_order_and_grouping() -> None:
    numbers = np.array([5, 3, 2**32 - 1, 0, 77, 3, 12, 8])
    whole = simulate_batch(BUSY, Fidget(), 9, numbers)
    assert whole.missions["replication"].tolist() == numbers.tolist()
    for batch_size in (1, 3, 100):
        assert _equal(simulate_batch(BUSY, Fidget(), 9, numbers, batch_size=batch_size), whole)
    order = np.random.default_rng(1).permutation(len(numbers))
    shuffled = simulate_batch(BUSY, Fidget(), 9, numbers[order], batch_size=4)
    assert _equal(shuffled, Records(whole.missions[order], whole.uavs[order]))
    for job, number in enumerate(numbers):
        alone = simulate_batch(BUSY, Fidget(), 9, [number])
        assert _equal(alone, Records(whole.missions[[job]], whole.uavs[[job]]))


@pytest.mark.parametrize("workers", [2, 3, 20])
def test_workers_change_nothing(workers: int) -> None:
    one = simulate_batch(BUSY, [Fidget(), Wanderer()], 4, 13, workers=1)
    assert _equal(simulate_batch(BUSY, [Fidget(), Wanderer()], 4, 13, workers=workers), one)


class _Endless:
    """A policy that fails in one thread, and never ends in the others."""

    name = "endless"
    failing = -1

    def act(self, view: View) -> np.ndarray:
        if self.failing < 0:
            self.failing = get_ident()
        waited = 0
        while self.failing != get_ident() and waited < 20_000:
            sleep(0.001)
            waited += 1
        raise RuntimeError("waited" if waited == 20_000 else "failed")


def test_an_error_in_one_thread_ends_the_others() -> None:
    """So does Ctrl-C, which is raised in the main thread."""
    policy, threads = _Endless(), active_count()
    with pytest.raises(RuntimeError, match="failed"):
        simulate_batch(BUSY, policy, 4, 13, workers=3)
    assert active_count() == threads


def test_a_batch_is_small_where_a_mission_is_large(monkeypatch: pytest.MonkeyPatch) -> None:
    """A slot of all missions in progress is one call of compiled code, which cannot be ended."""
    advanced: list[int] = []
    original = batch._advance

    def counted(job_of: np.ndarray, *others: Any) -> None:
        advanced.append(len(job_of))
        original(job_of, *others)

    monkeypatch.setattr(batch, "_advance", counted)
    whole = simulate_batch(BUSY, Fidget(), 9, 30)
    assert {*advanced} == {30}
    monkeypatch.setattr(batch, "MOST_WORK", 5 * batch.work_of(BUSY))
    advanced.clear()
    assert _equal(simulate_batch(BUSY, Fidget(), 9, 30), whole)
    assert {*advanced} == {5}
    large = ScenarioSpace.of(
        grid=57,
        zone=[0, 0, 57, 57],
        uavs=64,
        communication_slots=64,
        nodes=[[x, y] for x in range(32) for y in range(32)],
    )
    assert batch.work_of(large) > MOST_WORK > BATCH_SIZE * batch.work_of(load_scenario("paper"))


@given(st.lists(spaces(), min_size=2, max_size=5), st.data(), seeds)
def test_scenarios_of_different_worlds_fly_in_one_batch(
    worlds: list[ScenarioSpace], data: st.DataObject, seed: int
) -> None:
    # The same worlds again with other fleets, so that some missions share a world.
    mixed = worlds + [ScenarioSpace.of(space, uavs=1) for space in worlds]
    mixed = data.draw(st.permutations(mixed))
    workers = data.draw(st.integers(1, 2))
    records = simulate_batch(
        mixed, Fidget(), seed, range(len(mixed)), workers=workers, batch_size=2
    )
    for job, space in enumerate(mixed):
        assert _is(records, job, simulate(space, Fidget(), seed, job))


@pytest.mark.parametrize("workers", [1, 2])
def test_progress_counts_every_mission_once(workers: int) -> None:
    finished: list[int] = []
    simulate_batch(BUSY, Wanderer(), 1, 30, batch_size=4, workers=workers, progress=finished.append)
    assert sum(finished) == 30
    assert len(finished) > 1
    assert min(finished) > 0


# --- spaces ---


@given(spaces(), seeds, replications)
def test_a_mission_of_a_space_is_the_mission_of_its_drawn_scenario(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    drawn = sample_scenario(space, seed, replication)
    one = simulate(space, Fidget(), seed, replication)
    other = simulate(drawn, Fidget(), seed, replication)
    assert one.metrics.tobytes() == other.metrics.tobytes()
    assert one.uavs.tobytes() == other.uavs.tobytes()
    assert one.metrics["uavs"] == drawn.uavs == len(one.uavs)
    assert one.flying_time == drawn.flying_time


# --- common random numbers ---


FATE = ("mission_start", "arrival", "node_failure", "node_repair", "pad_failure", "pad_repair")


@given(spaces(arrival_rate=0.3) | extended_spaces() | continuous_spaces(), seeds, replications)
def test_two_policies_have_common_random_numbers(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    """Start cells, initial data, arrivals, and failures but for those of UAVs that fly or not."""
    records = [
        simulate(space, policy, seed, replication, events=True)
        for policy in (Wanderer(), Commuter())
    ]
    until, kept = min(record.slots for record in records), []
    for record in records:
        assert record.events is not None
        log = record.events.columns()
        own = np.isin(log["event"], FATE) & (log["time"] < until)
        columns = [log[name][own].tolist() for name in ("time", "event", "uav", "node", "x", "y")]
        values = np.where(np.isin(log["event"][own], FATE[2:4]), 0.0, log["value"][own])
        kept.append([*zip(*columns, values.tolist(), strict=True)])
    assert kept[0] == kept[1]


# --- teams ---


class _Watcher:
    """Hovers, and remembers whom it was asked for."""

    def __init__(self, name: str):
        self.name, self.asked_for = name, set()  # type: ignore[var-annotated]

    def act(self, view: View) -> np.ndarray:
        self.asked_for.update(view.uav.tolist())
        return np.full(len(view), HOVER)


@pytest.mark.parametrize("run", [simulate, simulate_batch])
def test_uav_i_has_policy_i_modulo_the_team(run: Any) -> None:
    team = [_Watcher("a"), _Watcher("b")]
    run(ScenarioSpace.of(BUSY, uavs=5), team, 0)
    assert team[0].asked_for == {0, 2, 4}
    assert team[1].asked_for == {1, 3}


@pytest.mark.parametrize("run", [simulate, simulate_batch])
def test_a_policy_that_would_never_act_is_refused(run: Any) -> None:
    team = [_Watcher(name) for name in "abc"]
    line = "policy: the team has 3 policies, but the largest fleet has 2 UAVs; allowed: 2 at most"
    with pytest.raises(InputError, match=line):
        run(ScenarioSpace.of(BUSY, uavs=[1, 2]), team, 0)
    run(ScenarioSpace.of(BUSY, uavs=[1, 3]), team, 0)


@pytest.mark.parametrize("run", [simulate, simulate_batch])
def test_nobody_sees_what_a_teammate_has_just_decided(run: Any) -> None:
    class Spy(_Watcher):
        """Notes what a teammate's entry says of the present slot's decision."""

        def act(self, view: View) -> np.ndarray:
            self.asked_for.update(view.team["action"][:, 0].tolist())
            return np.full(len(view), HOVER)

    spy = Spy("spy")
    run(ScenarioSpace.of(BUSY, uavs=2, max_slots=1), [Script("N"), spy], 0)
    assert spy.asked_for == {HOVER}


def test_a_team_of_equals_is_one_policy() -> None:
    alone = simulate_batch(BUSY, Fidget(), 3, 10)
    assert _equal(simulate_batch(BUSY, [Fidget(), Fidget(), Fidget()], 3, 10), alone)
    assert not _equal(simulate_batch(BUSY, [Fidget(), Wanderer()], 3, 10), alone)


# --- what is refused ---


class _Answer:
    name = "answer"

    def __init__(self, actions: Any):
        self.actions = actions

    def act(self, view: View) -> Any:
        return self.actions(len(view))


NO_ACTIONS = {
    "too large": lambda rows: np.full(rows, 5),
    "negative": lambda rows: np.full(rows, -1),
    "too many": lambda rows: np.full(rows + 1, 0),
    "a scalar": lambda rows: 0,
    "real": lambda rows: np.full(rows, 1.0),
    "truth": lambda rows: np.full(rows, True),
    "none": lambda rows: None,
}


@pytest.mark.parametrize("run", [simulate, simulate_batch])
@pytest.mark.parametrize("actions", NO_ACTIONS.values(), ids=NO_ACTIONS.keys())
def test_what_is_no_action_is_refused(run: Any, actions: Any) -> None:
    with pytest.raises(ValueError, match="policy answer: act must return"):
        run(BUSY, _Answer(actions), 0)


@pytest.mark.parametrize("run", [simulate, simulate_batch])
def test_bad_arguments_are_refused(run: Any) -> None:
    with pytest.raises(InputError, match="seed: -1 is out of range"):
        run(BUSY, Wanderer(), -1)
    with pytest.raises(ValueError, match="at least one policy"):
        run(BUSY, [], 0)
    with pytest.raises((InputError, TypeError)):
        run(BUSY, Wanderer(), 1.5)


def test_bad_replications_and_workers_are_refused() -> None:
    with pytest.raises(InputError, match="replication: 4294967296 is out of range"):
        simulate_batch(BUSY, Wanderer(), 0, [0, 2**32])
    with pytest.raises(InputError, match="replication: -1 is out of range"):
        simulate_batch(BUSY, Wanderer(), 0, [-1, 4])
    with pytest.raises(ValueError, match="integers"):
        simulate_batch(BUSY, Wanderer(), 0, [0.5])
    for wrong in ({"workers": 0}, {"batch_size": 0}):
        with pytest.raises(ValueError, match="at least 1"):
            simulate_batch(BUSY, Wanderer(), 0, 3, **wrong)
