"""The record of a mission and its event log."""

import pickle

import numpy as np
import pytest
from hypothesis import given

from dess.mission import simulate
from dess.record import MISSION_RECORD, measures_of
from dess.scenario import Scenario, ScenarioSpace
from dess.state import sample_scenario
from tests.drawn import (
    Commuter,
    continuous_spaces,
    extended_spaces,
    policies,
    replications,
    seeds,
    spaces,
)

# Nothing was delivered, or no age has come to its end.
NOT_ALWAYS = {"latency", "latency_p99", "peak_age"}


# A mission of any small space under any of the test policies.
missions = given(spaces(), policies, seeds, replications)


@missions
def test_the_log_costs_nothing_and_changes_nothing(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    without = simulate(space, policy, seed, replication)
    assert without.events is None
    logged = simulate(space, policy, seed, replication, events=True)
    assert logged.metrics.tobytes() == without.metrics.tobytes()
    assert logged.uavs.tobytes() == without.uavs.tobytes()


def test_the_metrics_of_a_record_are_attributes() -> None:
    space = ScenarioSpace.of(uavs=[1, 3])
    record = simulate(space, Commuter(), 3, 4)
    drawn = sample_scenario(space, 3, 4)
    assert (record.seed, record.replication) == (3, 4)
    assert record.metrics["uavs"] == drawn.uavs
    for name in ("flying_time", "charge_start", "charge_complete"):
        assert getattr(record, name) == getattr(drawn, name)
    for name in set(MISSION_RECORD.names or ()) - {"uavs"}:
        assert type(getattr(record, name)) in (int, float)
    assert isinstance(record.success, int)
    rows = record.uav_rows()
    assert [set(row) for row in rows] == [{"quota", "battery", "slots_charging", "end"}] * len(rows)
    with pytest.raises(AttributeError, match="speed"):
        _ = record.speed
    copy = pickle.loads(pickle.dumps(record))
    assert copy.metrics.tobytes() == record.metrics.tobytes()
    assert copy.uavs.tobytes() == record.uavs.tobytes()


def test_the_columns_of_a_log_are_attributes() -> None:
    log = simulate(ScenarioSpace.of(), Commuter(), 3, 4, events=True).events
    assert log is not None and log.event[0] == "mission_start"
    for name, column in log.columns().items():
        np.testing.assert_array_equal(getattr(log, name), column)
    with pytest.raises(AttributeError, match="colour"):
        _ = log.colour


def test_the_collection_ratio_without_data_is_one() -> None:
    scenario = Scenario.of(initial_data=0, arrival_rate=0, uavs=1)
    record = simulate(scenario, Commuter(), 0, 0)
    assert (record.initial, record.arrived, record.collected, record.residual) == (0, 0, 0, 0)
    assert (record.collection_ratio, record.success) == (1.0, 0)


@given(extended_spaces() | continuous_spaces(), policies, seeds, replications)
def test_a_record_has_what_the_scenario_measures(
    space: ScenarioSpace, policy: object, seed: int, replication: int
) -> None:
    measured, known = {*simulate(space, policy, seed, replication).measured}, {*measures_of(space)}
    assert known - NOT_ALWAYS <= measured <= known
