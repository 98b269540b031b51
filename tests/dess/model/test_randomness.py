"""What is random in a log is what the coordinates of the mission give; the auditor has the rest."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from scipy import special, stats

from dess.model.mission import simulate
from dess.physics import streams
from dess.scenario.scenario import Scenario
from tests.drawn import Wanderer, policies, replications, scenarios, seeds


class _Words:
    """The random words of a mission, as uniform numbers."""

    def __init__(self, seed: int, replication: int):
        self.key = np.uint64(seed), replication

    def words(self, stream: int, substream: int, slot: int, index: int) -> list[int]:
        return [int(word) for word in streams.block(*self.key, stream, substream, slot, index)]

    def uniform(self, stream: int, substream: int, slot: int, index: int, word: int) -> float:
        return (self.words(stream, substream, slot, index)[word] + 0.5) / 2**32


def _starts(scenario: Scenario, words: _Words) -> list[tuple[int, int]]:
    """The word of a UAV picks one of the cells not yet taken, which stand from its index on."""
    x, y, width, height = scenario.zone
    free = [(x + a, y + b) for b in range(height) for a in range(width)]
    for i in range(scenario.uavs):
        pick = i + words.words(streams.START, 0, 0, i)[0] * (len(free) - i) // 2**32
        free[i], free[pick] = free[pick], free[i]
    return free[: scenario.uavs]


def _snr(scenario: Scenario, words: _Words, row: dict[str, Any]) -> np.ndarray:
    """The SNR of each node for a row of a communication [dB], from distances in metres."""
    m, slot = scenario.communication_slots, int(np.ceil(row["time"])) - 1
    n = round((row["time"] - slot) * m)
    across = (np.array(scenario.nodes) - (row["x"], row["y"])) * scenario.cell_size
    distance = np.sqrt((across**2).sum(1) + scenario.altitude**2)
    edge = np.hypot(*scenario.size) / 2 * scenario.cell_size
    mean = scenario.edge_snr - 10 * scenario.path_loss_exponent * np.log10(distance / edge)
    place = streams.SHADOWING, ((n - 1) // 4) * 2**16 + row["uav"], slot
    draws = [words.uniform(*place, k, (n - 1) % 4) for k in range(len(distance))]
    return mean + np.sqrt(scenario.shadowing_variance) * special.ndtri(draws)


def _check(scenario: Scenario, policy: Any, seed: int, replication: int) -> None:
    record = simulate(scenario, policy, seed, replication, events=True)
    assert record.events is not None
    words, log = _Words(seed, replication), record.events.columns()
    nodes = range(len(scenario.nodes))
    low, high = scenario.initial_data
    draws = [words.uniform(streams.INITIAL_DATA, 0, 0, k // 4, k % 4) for k in nodes]
    residual = low + (high - low) * np.array(draws)
    begins = log["event"] == "mission_start"
    cells = list(zip(log["x"][begins], log["y"][begins], strict=True))
    assert cells[: scenario.uavs] == _starts(scenario, words)
    assert log["value"][begins][scenario.uavs :] == pytest.approx(residual, abs=1e-12)
    arrived = np.zeros((record.slots + 1, len(residual)))
    for row in (dict(zip(log, values, strict=True)) for values in zip(*log.values(), strict=True)):
        if row["event"] == "arrival":
            arrived[int(row["time"]), row["node"]] = row["value"]
            residual[row["node"]] += row["value"]
        elif row["event"] == "communication":
            snr = np.where(residual > 1e-9, _snr(scenario, words, row), -np.inf)
            best = row["node"]
            # Without shadowing nodes can tie; the table and the metres round differently.
            assert row["snr"] == pytest.approx(snr[best], abs=1e-9)
            assert row["snr"] > snr.max() - 1e-9
            residual[best] -= row["value"]
    for slot in range(record.slots):
        draws = [words.uniform(streams.ARRIVAL, 0, slot, k // 4, k % 4) for k in nodes]
        expected = stats.poisson.ppf(draws, scenario.arrival_rate)
        assert arrived[slot + 1].tolist() == expected.tolist()


@given(scenarios(initial_data=(0.1, 15.0), max_slots=50), policies, seeds, replications)
def test_a_mission_has_the_random_numbers_of_its_coordinates(scenario, policy, seed, replication):
    _check(scenario, policy, seed, replication)


def test_so_have_those_in_which_shadowing_decides():
    """From high above, all of 36 nodes are about as near: the best one is seldom the nearest."""
    nodes = [[x, y] for x in range(6) for y in range(6)]
    values = {"grid": 6, "zone": [2, 2, 2, 1], "nodes": nodes, "uavs": 2, "altitude": 2000}
    values |= {"initial_data": 1e6, "flight_cost": 0, "quota": 10**6, "max_slots": 60}
    scenario = Scenario.of(**values, shadowing_variance=9)
    for replication in range(2**32 - 4, 2**32):
        _check(scenario, Wanderer(), 2**64 - 1, replication)
