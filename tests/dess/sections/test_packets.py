"""Missions with packets: what policies see of them, and who simulates them."""

from typing import Any

import numpy as np
import pytest

from dess import InputError, parallel_env
from dess.batch import simulate_batch
from dess.mission import MissionModel
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from dess.sections.packets import Buffers
from dess.view import View
from tests.drawn import Script

HOVER = Script("")
# A UAV hovers over a node; it collects up to 100 data units per slot or so.
ABOVE: dict[str, Any] = {
    **{"grid": 4, "zone": [1, 1, 1, 1], "nodes": [[1, 1]], "uavs": 1, "initial_data": 0.0},
    **{"quota": 100_000, "flying_time": 100, "max_slots": 50, "edge_snr": 300},
    **{"slot_length": 100, "arrivals.process": "continuous"},
}


def _above(policy: Any = HOVER, **values: Any) -> tuple[Buffers, Any]:
    """The packets of a mission above a node, and its record."""
    space = ScenarioSpace.of(Scenario.of(**(ABOVE | values)))
    model = MissionModel(space, [policy], 5, 0, None)
    record = model.run()
    assert model.packets is not None
    return model.packets.buffers, record


def test_policies_see_the_age_of_the_newest_data():
    seen = []

    class Reader(Script):
        def act(self, view: View) -> np.ndarray:
            seen.append(float(view.age[0, 0]))
            return super().act(view)

    buffers, record = _above(Reader(""), arrival_rate=0.3, **{"age.reward": -2.0})
    packets = buffers.packets
    for slot, age in enumerate(seen):
        known = packets["generated"][packets["left"] <= slot]
        assert age == pytest.approx(slot - known.max(initial=0.0))
    _, plain = _above(arrival_rate=0.3)
    last = record.slots - packets["generated"][packets["left"] <= record.slots].max()
    assert record.reward - plain.reward == pytest.approx(-2.0 * (sum(seen[1:]) + last))


def test_only_the_simpy_engine_has_continuous_arrivals():
    space = load_scenario("paper", **{"arrivals.process": "continuous"})
    for refused in (lambda: simulate_batch(space, HOVER), lambda: parallel_env(space)):
        with pytest.raises(InputError, match="arrivals.process: continuous needs the SimPy"):
            refused()
