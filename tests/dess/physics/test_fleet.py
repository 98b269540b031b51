"""Types of UAVs."""

import pytest

from dess.scenario.scenario import Scenario
from tests.dess.model.flights import CHANNEL, flown, rows_of

# A node beside the only cell of the zone: a slot carries log2(1 + 255 / 17) = 4 data units.
ADJACENT_NODE = {"zone": [0, 0, 1, 1], "nodes": [[1, 0]], "initial_data": 50.0, "quota": 3}


@pytest.mark.parametrize("rate", [0.5, 3.0])
def test_a_type_takes_its_factor_of_the_rate(rate):
    scenario = Scenario.of(
        **CHANNEL, **ADJACENT_NODE, uavs=1, flying_time=80, fleet=[{"rate": rate}]
    )
    record, log = flown(scenario, "")
    assert rows_of(log, "communication", "value") == pytest.approx(3 * [4 * rate])
    assert record.collected == pytest.approx(12 * rate)
