"""What rounding leaves of the data of a node."""

import pytest

from dess.model.mission import simulate
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import CHANNEL, flown
from tests.drawn import Script


def test_what_rounding_leaves_of_the_data_is_no_data():
    """Of 0.9 data units, three times 0.3 leave 1.1e-16, which nobody serves a fourth time."""
    sea = {"nodes": [[1, 1]], "zone": [0, 0, 2, 1], "initial_data": 0.9, "quota": 9}
    fields = CHANNEL | sea | {"flying_time": 5, "radio": {"max_rate": 0.3}}
    assert 0.9 - 0.3 - 0.3 - 0.3 > 0
    for uavs, served in ((1, [3]), (2, [2, 1])):
        record, _ = flown(ScenarioSpace.of(**fields, uavs=uavs), *[""] * uavs)
        assert [row["quota"] for row in record.uav_rows()] == served
        assert record.metrics["residual"] == 0 and record.metrics["collected"] == pytest.approx(0.9)
        # In continuous time, the second UAV of a communication slot serves nothing, too.
        moments = ScenarioSpace.of(**fields, uavs=uavs, arrivals={"process": "continuous"})
        record = simulate(moments, Script(*[""] * uavs), 0, 0)
        assert [row["quota"] for row in record.uav_rows()] == served
        assert record.metrics["residual"] == 0
