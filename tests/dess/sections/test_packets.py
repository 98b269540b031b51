"""Missions with packets: conservation, latency, and the event log packet by packet."""

from typing import Any

import numpy as np
import pytest

from dess import InputError, parallel_env
from dess.batch import simulate_batch
from dess.mission import MissionModel, simulate
from dess.record import EventLog
from dess.scenario import Scenario, ScenarioSpace, load_scenario
from dess.view import View


def _flown(space: ScenarioSpace, policy: Any, seed: int, replication: int) -> tuple[Any, Any]:
    """A mission that has been flown, and its record."""
    model = MissionModel(space, [policy], seed, replication, EventLog())
    return model, model.run()


class _Hover:
    name = "hover"

    def act(self, view: View) -> np.ndarray:
        return np.full(len(view), 4)


def _over_a_node(**values: Any) -> Scenario:
    """A UAV hovers over a node; it collects up to ``slot_length`` data units per slot or so."""
    base = {
        "grid": 4,
        "zone": [1, 1, 1, 1],
        "nodes": [[1, 1]],
        "uavs": 1,
        "initial_data": 0.0,
        "quota": 100_000,
        "flying_time": 100,
        "max_slots": 50,
        "edge_snr": 300,
        "arrivals.process": "continuous",
    }
    return Scenario.of(**(base | values))


@pytest.mark.parametrize("m", [1, 3, 4, 7])
def test_a_packet_is_served_in_the_next_communication_slot(m: int) -> None:
    """Also where the node was empty before, and inside a group of communication slots."""
    scenario = _over_a_node(communication_slots=m, slot_length=100, arrival_rate=1.5)
    model, record = _flown(ScenarioSpace.of(scenario), _Hover(), 5, 0)
    done = model.packets.buffers.packets[model.packets.buffers.delivered]
    assert len(done) > 50
    assert done["left"] == pytest.approx(np.ceil(done["generated"] * m) / m)
    assert record.latency == pytest.approx((done["left"] - done["generated"]).mean())


def test_policies_see_the_age_of_the_newest_data() -> None:
    seen = {}

    class Reader(_Hover):
        def act(self, view: View) -> np.ndarray:
            seen[int(view.constants["slot"][0])] = float(view.age[0, 0])
            return super().act(view)

    scenario = _over_a_node(slot_length=100, arrival_rate=0.3, **{"age.reward": -2.0})
    model, record = _flown(ScenarioSpace.of(scenario), Reader(), 5, 0)
    packets = model.packets.buffers.packets
    for slot, age in seen.items():
        known = packets["generated"][packets["left"] <= slot]
        assert age == pytest.approx(slot - known.max(initial=0.0))
    plain = simulate(_over_a_node(slot_length=100, arrival_rate=0.3), _Hover(), 5, 0)
    ends = [
        *[seen[slot] for slot in range(1, 50)],
        record.slots - packets["generated"][packets["left"] <= record.slots].max(),
    ]
    assert record.reward - plain.reward == pytest.approx(-2.0 * sum(ends))


def test_only_the_simpy_engine_has_continuous_arrivals() -> None:
    space = load_scenario("paper", **{"arrivals.process": "continuous"})
    for refused in (lambda: simulate_batch(space, _Hover()), lambda: parallel_env(space)):
        with pytest.raises(InputError, match="arrivals.process: continuous needs the SimPy"):
            refused()


@pytest.mark.parametrize("node_data", ["kept", "lost"])
def test_packets_of_silent_nodes_wait_or_are_lost(node_data: str) -> None:
    """A node falls silent after slot 0 for good: later packets arrive, and nobody gets them."""
    scenario = _over_a_node(
        slot_length=100,
        arrival_rate=1.0,
        **{"failures.node_rate": 1.0, "failures.node_data": node_data},
    )
    model, record = _flown(ScenarioSpace.of(scenario), _Hover(), 5, 0)
    buffers = model.packets.buffers
    late = [n for n, packet in enumerate(buffers.all) if packet.generated > 1]
    assert len(late) > 20 and not {*late} & {*buffers.delivered}
    assert np.isnan(buffers.packets["left"][late]).all() == (node_data == "kept")
    lost, residual = (len(late), 0) if node_data == "lost" else (0, len(late))
    assert (record.lost, record.residual) == (lost, residual)
