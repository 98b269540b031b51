"""Missions with packets: when they are served, what policies see of them, what is lost."""

from typing import Any

import numpy as np
import pytest

from dess import InputError, parallel_env
from dess.batch import simulate_batch
from dess.mission import MissionModel
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from dess.sections.buffers import Buffers
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


@pytest.mark.parametrize("m", [1, 3, 4, 7])
def test_a_packet_is_served_in_the_next_communication_slot(m: int) -> None:
    """Also where the node was empty before, and inside a group of communication slots."""
    buffers, record = _above(communication_slots=m, arrival_rate=1.5)
    done = buffers.packets[buffers.delivered]
    assert len(done) > 50
    assert done["left"] == pytest.approx(np.ceil(done["generated"] * m) / m)
    assert record.latency == pytest.approx((done["left"] - done["generated"]).mean())


def test_policies_see_the_age_of_the_newest_data() -> None:
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


@pytest.mark.parametrize("node_data", ["kept", "lost"])
def test_packets_of_silent_nodes_wait_or_are_lost(node_data: str) -> None:
    """A node falls silent after slot 0 for good: no UAV gets the packets that arrive later."""
    failures = {"node_rate": 1.0, "node_data": node_data}
    buffers, record = _above(arrival_rate=1.0, failures=failures)
    late = [n for n, packet in enumerate(buffers.all) if packet.generated > 1]
    assert len(late) > 20 and not {*late} & {*buffers.delivered}
    assert np.isnan(buffers.packets["left"][late]).all() == (node_data == "kept")
    lost, residual = (len(late), 0) if node_data == "lost" else (0, len(late))
    assert (record.lost, record.residual) == (lost, residual)


def test_only_the_simpy_engine_has_continuous_arrivals() -> None:
    space = load_scenario("paper", **{"arrivals.process": "continuous"})
    for refused in (lambda: simulate_batch(space, HOVER), lambda: parallel_env(space)):
        with pytest.raises(InputError, match="arrivals.process: continuous needs the SimPy"):
            refused()
