"""The zone, the buffers and missions as queues: by hand, and with Little's law."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess.scenario import load_scenario
from tests.dess.queues.model import Server, Station, ages_of, mission_above, visited

times = st.integers(1, 40).map(lambda eighths: eighths / 8)


def test_three_uavs_and_a_pad_by_hand() -> None:
    """They come at 1, 2 and 3 and charge for 4, 1 and 1: the pad is free at 5, 6 and 7."""
    station = Station(1, np.array([1.0, 1.0, 1.0]), np.array([4.0, 1.0, 1.0]))
    assert station.waits.tolist() == [0.0, 3.0, 3.0]
    assert station.queues.tolist() == [0.0, 0.0, 1.0 + 5.0]  # one from 2 to 3, two to 5, one to 6


def test_two_pads_by_hand() -> None:
    station = Station(2, np.array([1.0, 1.0, 1.0]), np.array([4.0, 1.5, 1.0]))
    assert station.waits.tolist() == [0.0, 0.0, 0.5]


@given(st.integers(1, 3), st.lists(st.tuples(times, times), min_size=1, max_size=60))
def test_littles_law_of_the_zone(pads: int, uavs: list[tuple[float, float]]) -> None:
    gaps, charging = np.array(uavs).T
    station = Station(pads, gaps, charging)
    assert station.queues.sum() == pytest.approx(station.waits.sum())


def test_three_packets_by_hand() -> None:
    """They come at 1, 2 and 3 and take 1.5, 1.5 and 1 to serve: they leave at 2.5, 4 and 5."""
    server = Server(np.array([1.0, 2.0, 3.0]), np.array([1.5, 1.5, 1.0]))
    assert server.buffers.packets["left"].tolist() == [2.5, 4.0, 5.0]
    assert server.numbers.tolist() == [0.0, 1.0, 0.5 * 2 + 0.5 + 1.0 * 2 + 1.0]


def test_a_packet_in_service_takes_a_place_of_the_buffer() -> None:
    server = Server(np.array([1.0, 2.0, 3.0]), np.array([1.5, 1.5, 1.0]), limit=1)
    buffers = server.buffers
    assert (len(buffers.all), len(buffers.delivered), buffers.lost) == (3, 2, 1)  # the second
    assert server.buffers.packets["left"].tolist() == [2.5, 2.0, 4.5]


@given(st.integers(0, 3), st.lists(st.tuples(times, times), min_size=1, max_size=60))
def test_littles_law_of_a_buffer(limit: int, packets: list[tuple[float, float]]) -> None:
    gaps, work = np.array(packets).T
    server = Server(gaps.cumsum(), work, limit)
    stays = server.buffers.packets["left"] - server.buffers.packets["generated"]
    assert server.numbers.sum() == pytest.approx(stays.sum())


def test_the_ages_of_two_visits_by_hand() -> None:
    """At 2 and 5, watched until 5: teeth of 2 and 3 slots."""
    mean, peak, percentile = ages_of(visited(np.array([2.0, 5.0])), 5.0)
    assert (mean, peak) == pytest.approx(((2.0 + 4.5) / 5, 2.5))
    assert percentile == pytest.approx(3.0 - 0.05)


@pytest.mark.parametrize("m", [1, 4])
def test_a_uav_above_a_node_collects_a_packet_per_communication_slot(m: int) -> None:
    """With more arrivals than that, so many are delivered, and the others are still there."""
    space = load_scenario("paper", communication_slots=m)
    record = mission_above(space, 5.0, 1, 0, max_slots=40)
    assert record.slots == 40
    assert record.delivered == pytest.approx(40 * m, abs=2)  # the first slots may find none
