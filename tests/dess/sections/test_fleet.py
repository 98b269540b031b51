"""Fleets that differ: slow UAVs have nothing to decide on their way."""

import numpy as np

from dess import simulate
from dess.observations.states import compact_states, masks
from dess.scenario import ScenarioSpace
from dess.view import View
from tests.drawn import Script

# There is one node, with data without end.
ROW = {
    **{"grid": 8, "nodes": [[2, 6]], "initial_data": 1e6, "shadowing_variance": 0.0},
    **{"arrival_rate": 0.0, "flying_time": 50, "charge_start": 10, "max_slots": 4},
}


def test_a_uav_on_its_way_is_not_asked_and_may_only_hover() -> None:
    seen = []

    class Spy(Script):
        def act(self, view: View) -> np.ndarray:
            everyone = View(view.state, view.world, np.zeros(2, int), np.arange(2))
            legal = everyone.legal
            states = compact_states(view.state, view.world.chart, guarded=False)
            assert (masks(states, everyone.mission, everyone.uav) == legal).all()
            seen.append((view.uav.tolist(), legal.sum(1).tolist()))
            return super().act(view)

    row = ROW | {"zone": [2, 2, 2, 1], "uavs": 2, "max_slots": 3}
    simulate(ScenarioSpace.of(**row, fleet=[{"slots_per_cell": 2}, {}]), Spy("S..", "..."), 1)
    assert seen == [([0, 1], [5, 5]), ([1], [1, 5]), ([0, 1], [5, 5])]
