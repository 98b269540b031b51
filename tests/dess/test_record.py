"""The record of a mission and its event log."""

import pickle

import numpy as np
import pytest
from hypothesis import given

from dess.mission import simulate
from dess.record import MISSION_RECORD, measures_of
from dess.scenario import ScenarioSpace
from tests.drawn import Commuter, continuous_spaces, extended_spaces, policies, replications, seeds

# Nothing was delivered, no age has come to its end, or no UAV has asked for a pad.
NOT_ALWAYS = {"latency", "latency_p99", "peak_age", "waiting"}


def test_metrics_and_the_columns_of_a_log_are_attributes():
    record = simulate(ScenarioSpace.of(), Commuter(), 3, 4, events=True)
    assert (record.seed, record.replication) == (3, 4) and isinstance(record.success, int)
    for name in set(MISSION_RECORD.names or ()) - {"uavs"}:
        assert type(getattr(record, name)) in (int, float)
    assert record.events is not None and record.events.event[0] == "mission_start"
    for name, column in record.events.columns().items():
        np.testing.assert_array_equal(getattr(record.events, name), column)
    for holder in (record, record.events):
        with pytest.raises(AttributeError, match="speed"):
            _ = holder.speed
    assert pickle.loads(pickle.dumps(record)).metrics.tobytes() == record.metrics.tobytes()


@given(extended_spaces() | continuous_spaces(), policies, seeds, replications)
def test_a_record_has_what_the_scenario_measures(space, policy, seed, replication):
    measured, known = {*simulate(space, policy, seed, replication).measured}, {*measures_of(space)}
    assert known - NOT_ALWAYS <= measured <= known
