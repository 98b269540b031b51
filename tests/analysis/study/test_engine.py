"""The engine is chosen by what the scenarios need."""

import pytest

from analysis.study.engine import engine_of
from dess import InputError, load_scenario
from tests.analysis.small import grid, small_study

SLOTTED = load_scenario("paper")
CONTINUOUS = load_scenario("paper", **{"arrivals.process": "continuous"})


def test_the_batch_engine_is_taken_unless_a_scenario_needs_the_other():
    assert engine_of([SLOTTED]) == "batch"
    assert engine_of([SLOTTED], "events") == "events"
    assert engine_of([SLOTTED, CONTINUOUS]) == "events"
    with pytest.raises(InputError, match=r"arrivals\.process: continuous needs the SimPy engine"):
        engine_of([SLOTTED, CONTINUOUS], "batch")


def test_a_study_takes_the_engine_that_one_of_its_points_needs(tmp_path):
    design = grid(**{"arrivals.process": ["slotted", "continuous"]})
    assert small_study(tmp_path).engine == "batch"
    assert small_study(tmp_path, design=design).engine == "events"
    assert small_study(tmp_path, design=design, engine="events").engine == "events"
    with pytest.raises(InputError, match="needs the SimPy engine"):
        small_study(tmp_path, design=design, engine="batch")
