"""Packets: when they arrive, what policies see of them, and who simulates them."""

from typing import Any

import numpy as np
import pytest
from scipy import stats

from dess import InputError, parallel_env
from dess.model.batch import simulate_batch
from dess.model.mission import Mission
from dess.model.packets import Buffers
from dess.model.state import constants_of
from dess.model.view import View
from dess.physics.arrivals import draw_arrival, factors_of, sources_of
from dess.scenario.scenario import Scenario, ScenarioSpace, load_scenario
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
    model = Mission(space, [policy], 5, 0)
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


def _arrivals(k: int, **values: Any) -> np.ndarray:
    """The times [slots] of all arrivals at a node until the last slot of a mission."""
    process = {"process": "continuous"} | values.pop("arrivals")
    space = ScenarioSpace.of(**values, arrivals=process)
    missions, sources = constants_of(space), sources_of(space.node_rates)
    missions["seed"], found = 1, []
    while sources["time"][k] < np.inf:
        draw_arrival(missions, sources, *factors_of(space.arrivals), k)
        found.append(sources["time"][k])
    return np.array(found[:-1])


def test_thinned_arrivals_are_a_poisson_process_in_the_integrated_rate():
    """In the integral of the factor of the schedule over time, their rate is one and the same."""
    schedule, rate, end = ((100, 3.0), (400, 0.0), (500, 0.25), (1500, 2.0)), 2.0, 3000
    times = _arrivals(0, arrival_rate=rate, max_slots=end, arrivals={"schedule": schedule})
    slots, factors = zip((0, 1.0), *schedule, strict=True)
    edges = np.array([*slots, end])
    areas = np.concatenate([[0.0], (factors * np.diff(edges)).cumsum()])
    own = rate * np.interp(times, edges, areas)
    assert stats.kstest(np.diff(own, prepend=0.0), "expon").pvalue > 0.001
    assert 0.001 < stats.poisson(rate * areas[-1]).cdf(len(times)) < 0.999


def test_a_node_has_its_own_rate():
    rates = [0.0, 5.0, *[0.1] * 23]
    counts = [len(_arrivals(k, max_slots=1000, arrivals={"rates": rates})) for k in range(3)]
    assert counts[0] == 0
    assert 0.01 < stats.poisson.cdf(counts[1], 5000) < 0.99
    assert 0.01 < stats.poisson.cdf(counts[2], 100) < 0.99
