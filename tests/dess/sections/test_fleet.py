"""Fleets that differ: where slow UAVs are, what they collect, and what each type must do."""

import numpy as np
import pytest

from dess import simulate
from dess.observations.states import compact_states, masks
from dess.scenario import ScenarioSpace
from dess.state import QUOTA, TRUNCATED
from dess.view import View
from tests.dess.flights import flown, rows_of
from tests.drawn import Script

# There is one node, with data without end.
ROW = {
    **{"grid": 8, "nodes": [[2, 6]], "initial_data": 1e6, "shadowing_variance": 0.0},
    **{"arrival_rate": 0.0, "flying_time": 50, "charge_start": 10, "max_slots": 4},
}
LONE = ROW | {"zone": [2, 2, 1, 1], "uavs": 1}


def test_a_slow_uav_is_at_equal_parts_of_its_way_and_collects_what_its_distance_gives() -> None:
    """It flies 3 slots per cell towards the node, from 4 cells away to 3 and on to 2."""
    space = ScenarioSpace.of(
        **LONE | {"max_slots": 6, "communication_slots": 2}, fleet=[{"slots_per_cell": 3}]
    )
    # It holds the cell that it flies to from the first slot on; "E" is asked for in the middle.
    _, log = flown(space, "SE.S..")
    assert rows_of(log, "move", "x", "y") == [(2, 3)] * 3 + [(2, 4)] * 3
    edge = np.hypot(*(8 * space.cell_size / 2,) * 2)
    for n, (x, y, amount) in enumerate(rows_of(log, "communication", "x", "y", "value"), 1):
        assert (x, y) == (2, pytest.approx(2 + n / 6))
        distance = np.hypot(space.cell_size * (6 - (2 + n / 6)), space.altitude)
        snr = space.edge_snr - 10 * space.path_loss_exponent * np.log10(distance / edge)
        assert amount == pytest.approx(0.5 * np.log2(1 + 10 ** (snr / 10)), rel=1e-12)


def test_types_are_given_in_turn_and_success_needs_the_quota_of_each() -> None:
    values = ROW | {"zone": [0, 2, 8, 1], "uavs": 3, "quota": 12}
    fleet: list[dict[str, float]] = [{"quota": 8, "flying_time": 30, "rate": 3.0}, {}]
    for quota, end in ((12, QUOTA), (17, TRUNCATED)):
        fleet[1] = {"flying_time": 20, "quota": quota}
        record, log = flown(ScenarioSpace.of(**values, fleet=fleet), "", "", "")
        assert rows_of(log, "mission_start", "value")[:3] == [30, 20, 30]
        assert record.uavs["end"].tolist() == [QUOTA, end, QUOTA]
        assert record.uavs["quota"].tolist() == [8, min(quota, 16), 8]
        assert record.success == (end == QUOTA)


def test_a_uav_on_its_way_is_not_asked_and_may_only_hover() -> None:
    seen = []

    class Spy(Script):
        def act(self, view: View) -> np.ndarray:
            everyone = View(view.state, view.world, np.zeros(2, int), np.arange(2))
            legal = everyone.legal
            states = compact_states(view.state, guarded=False)
            assert (masks(states, everyone.mission, everyone.uav) == legal).all()
            seen.append((view.uav.tolist(), legal.sum(1).tolist()))
            return super().act(view)

    row = ROW | {"zone": [2, 2, 2, 1], "uavs": 2, "max_slots": 3}
    simulate(ScenarioSpace.of(**row, fleet=[{"slots_per_cell": 2}, {}]), Spy("S..", "..."), 1)
    assert seen == [([0, 1], [5, 5]), ([1], [1, 5]), ([0, 1], [5, 5])]
