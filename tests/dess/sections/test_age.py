"""Age of information against sawtooths worked out by hand and from the event log."""

import math
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from dess import InputError
from dess.mission import simulate
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from dess.sections.age import MOST_TEETH, age_of_teeth
from dess.view import View
from tests.drawn import Fidget, policies, replications, seeds, spaces

Tooth = tuple[float, float]


def _of_teeth(teeth: list[Tooth]) -> tuple[float, float]:
    lows, highs = (np.array(ends) for ends in zip(*teeth, strict=True))
    return age_of_teeth(lows, highs, np.ones(len(teeth)))


# --- the teeth ---


def test_two_teeth_by_hand() -> None:
    """Areas 8 and 2 over 6 slots; the longer tooth alone passes the highest 0.06 slots."""
    mean, percentile = _of_teeth([(0.0, 4.0), (0.0, 2.0)])
    assert mean == pytest.approx(10 / 6)
    assert percentile == pytest.approx(4 - 0.06)


def test_teeth_that_begin_above_zero_by_hand() -> None:
    """50 slots in [0, 1] and 0.2 in [3, 3.2]: of the highest 0.502 slots 0.302 are in [0, 1]."""
    mean, percentile = _of_teeth([(0.0, 1.0)] * 50 + [(3.0, 3.2)])
    assert mean == pytest.approx((50 * 0.5 + 0.2 * 3.1) / 50.2)
    assert percentile == pytest.approx(1 - 0.302 / 50)


def test_a_weight_is_a_repetition() -> None:
    weighted = age_of_teeth(np.zeros(2), np.array([1.0, 3.0]), np.array([4.0, 2.0]))
    assert weighted == pytest.approx(_of_teeth([(0.0, 1.0)] * 4 + [(0.0, 3.0)] * 2))


def test_teeth_without_time_have_no_age() -> None:
    assert all(math.isnan(value) for value in _of_teeth([(0.0, 0.0), (2.0, 2.0)]))


ages = st.integers(0, 400).map(lambda quarters: quarters / 4)


@given(st.lists(st.tuples(ages, ages).map(lambda ends: (min(ends), max(ends))), min_size=1))
def test_the_mean_and_the_percentile_are_those_of_a_fine_sample(teeth: list[Tooth]) -> None:
    if all(low == high for low, high in teeth):
        return
    mean, percentile = _of_teeth(teeth)
    lows, highs = np.array(teeth).T
    time, step = (highs - lows).sum(), 1 / 64
    sample = np.concatenate([np.arange(low, high, step) + step / 2 for low, high in teeth])
    assert mean == pytest.approx(sample.mean())
    above = np.maximum(highs - np.maximum(lows, percentile), 0.0).sum()
    assert above == pytest.approx(0.01 * time)
    assert lows.min() <= percentile <= highs.max()


# --- missions ---


def test_a_node_that_is_emptied_at_fixed_gaps() -> None:
    """A UAV hovers over a node, which new data reach in each slot: it is empty after t + 1/m."""
    slots, m = 40, 5
    scenario = Scenario.of(
        grid=4,
        zone=[1, 1, 1, 1],
        nodes=[[1, 1]],
        uavs=1,
        slot_length=1000,
        edge_snr=300,
        arrival_rate=100,
        quota=1000,
        flying_time=100,
        max_slots=slots,
        communication_slots=m,
        **{"age.measured": True},
    )
    record = simulate(scenario, _Hover(), seed=3)
    assert record.slots == slots
    area = (1 / m) ** 2 / 2 + (slots - 1) / 2 + (1 - 1 / m) ** 2 / 2
    assert record.age == pytest.approx(area / slots)
    assert record.peak_age == pytest.approx((1 / m + slots - 1) / slots)
    # 39 of 41 teeth pass the highest ages.
    assert record.age_p99 == pytest.approx(1 - 0.01 * slots / (slots - 1))


class _Hover:
    name = "hover"

    def act(self, view: View) -> np.ndarray:
        return np.full(len(view), 4)


def _newest(record: Any, space: ScenarioSpace) -> list[list[float]]:
    """For each node the times at which it was emptied, from the event log alone."""
    log = record.events.columns()
    left = [0.0] * len(space.nodes)
    emptied: list[list[float]] = [[] for _ in left]
    rows = zip(log["time"], log["event"], log["node"], log["value"], strict=True)
    for time, name, node, value in rows:
        if node < 0 or name == "mission_end":
            continue
        left[node] += -value if name == "communication" else value
        if name == "communication" and left[node] < 1e-9:
            emptied[node].append(time)
    return emptied


# Data units of 1: the log tells exactly when a node is empty.
measured = spaces(max_slots=30, initial_data=3.0, **{"age.measured": True})


@settings(max_examples=20)
@given(measured, policies, seeds, replications)
def test_the_ages_of_a_mission_are_those_of_its_log(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    record = simulate(space, policy, seed, replication, events=True)
    teeth, peaks = [], []
    for times in _newest(record, space):
        for earlier, later in pairwise([0.0, *times]):
            teeth.append((0.0, later - earlier))
            peaks.append(later - earlier)
        teeth.append((0.0, record.slots - (times[-1] if times else 0.0)))
    assert (record.age, record.age_p99) == pytest.approx(_of_teeth(teeth))
    if peaks:
        assert record.peak_age == pytest.approx(np.mean(peaks))
    else:
        assert math.isnan(record.peak_age)


class _AgeReader(Fidget):
    """Keeps the ages that it sees in each slot."""

    def __init__(self) -> None:
        self.seen: dict[int, np.ndarray] = {}

    def act(self, view: View) -> np.ndarray:
        self.seen[int(view.constants["slot"][0])] = view.age[0]
        return super().act(view)


@settings(max_examples=20)
@given(measured, seeds, replications)
def test_policies_see_the_ages_whether_they_are_measured_or_not(
    space: ScenarioSpace, seed: int, replication: int
) -> None:
    reader, other = _AgeReader(), _AgeReader()
    record = simulate(space, reader, seed, replication, events=True)
    emptied = _newest(record, space)
    for slot, seen in reader.seen.items():
        last = [max((t for t in times if t <= slot), default=0.0) for times in emptied]
        assert seen == pytest.approx(slot - np.array(last))
    without = ScenarioSpace.of(space, **{"age.measured": False})
    simulate(without, other, seed, replication)
    assert all((other.seen[slot] == seen).all() for slot, seen in reader.seen.items())


@settings(max_examples=20)
@given(measured, st.floats(-2.0, 2.0), seeds, replications)
def test_the_reward_of_age_is_the_mean_age_at_the_end_of_each_slot(
    space: ScenarioSpace, weight: float, seed: int, replication: int
) -> None:
    plain = simulate(space, Fidget(), seed, replication, events=True)
    rewarded = simulate(
        ScenarioSpace.of(space, **{"age.reward": weight}), Fidget(), seed, replication
    )
    emptied, log = _newest(plain, space), plain.events.columns()
    ages = 0.0
    for time in log["time"][log["event"] == "move"] + 1:  # a row per UAV that was active
        last = [max((t for t in times if t <= time), default=0.0) for times in emptied]
        ages += time - np.mean(last)
    assert rewarded.reward - plain.reward == pytest.approx(weight * ages, abs=1e-6)


def test_too_many_communication_slots_are_refused_only_where_ages_are_measured() -> None:
    slots = MOST_TEETH // 4
    load_scenario("paper", max_slots=slots, **{"age.measured": True})
    load_scenario("paper", max_slots=slots + 1)
    with pytest.raises(InputError, match=f"age.measured: .*allowed: .* <= {MOST_TEETH}"):
        load_scenario("paper", max_slots=slots + 1, **{"age.measured": True})
