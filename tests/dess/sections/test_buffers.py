"""Buffers of packets by hand, and against laws of queues."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess.sections.buffers import DELIVERED, LOST, PACKET, WAITING, Buffers, teeth_of


def _left(buffers: Buffers) -> list[float | None]:
    """When each packet left its buffer."""
    return [None if math.isnan(time) else time for time in buffers.packets["left"].tolist()]


def test_the_newest_packet_is_served_first_by_hand() -> None:
    buffers = Buffers(1, newest_first=True)
    buffers.store(0, 0.0, 1.0)
    buffers.serve(0, 1.0, 0.5)  # half of packet 0
    buffers.store(0, 2.0, 1.0)
    buffers.serve(0, 3.0, 1.0)  # packet 1 goes first; the rest of packet 0 stays
    assert _left(buffers) == [None, 3.0]
    buffers.serve(0, 4.0, 0.5)
    assert _left(buffers) == [4.0, 3.0]
    assert buffers.delivered == [1, 0]


def test_a_full_buffer_refuses_the_new_packet_or_loses_its_oldest_by_hand() -> None:
    refuses, replaces = Buffers(2, limit=2), Buffers(2, limit=2, newest_first=True)
    for buffers, lost in ((refuses, 2), (replaces, 0)):
        assert [buffers.store(0, float(time), 1.0) for time in range(3)] == [-1, -1, lost]
        assert buffers.store(1, 3.0, 1.0) == -1  # the buffer of another node
        assert buffers.packets["status"][lost] == LOST
        assert buffers.packets["left"][lost] == 2.0
        assert [*map(len, buffers.queues)] == [2, 1]
        assert (len(buffers.all), buffers.delivered, buffers.lost) == (4, [], 1)


# --- laws ---

# Operations on two nodes: (time since the last one, node, data units served or None for a packet).
operations = st.lists(
    st.tuples(
        st.integers(0, 8).map(lambda eighths: eighths / 8),
        st.integers(0, 1),
        st.none() | st.integers(1, 20).map(lambda eighths: eighths / 8),
    ),
    max_size=400,
)


@given(operations, st.integers(0, 4), st.booleans())
def test_laws_of_every_queue(steps: list[Any], limit: int, newest_first: bool) -> None:
    """Conservation of packets and data, order of service, and Little's law, for each node."""
    buffers = Buffers(2, limit, newest_first)
    now, stored, served = 0.0, [0.0, 0.0], [0.0, 0.0]
    lost_data, area = [0.0, 0.0], np.zeros(2)  # area: of the number in the buffer over time
    for gap, k, amount in steps:
        now += gap
        area += gap * np.array([*map(len, buffers.queues)])
        if amount is None:
            stored[k] += 1.0
            lost = buffers.store(k, now, 1.0)
            if lost >= 0:
                lost_data[k] += buffers.packets["remaining"][lost]
        else:
            waiting = buffers.packets["status"] == WAITING
            data = buffers.packets["remaining"][waiting & (buffers.packets["node"] == k)].sum()
            buffers.serve(k, now, amount)
            served[k] += min(amount, data)
        assert limit == 0 or max(map(len, buffers.queues)) <= limit
    for k in (0, 1):
        own = buffers.packets[buffers.packets["node"] == k]
        status = own["status"]
        assert len(own) == stored[k]
        assert (status == WAITING).sum() == len(buffers.queues[k])
        held = own["remaining"][status == WAITING].sum()
        assert stored[k] == pytest.approx(served[k] + lost_data[k] + held)
        # Little's law, where a packet that is still there has waited until now.
        left = np.where(status == WAITING, now, own["left"])
        assert area[k] == pytest.approx((left - own["generated"]).sum())
        done = own[status == DELIVERED]
        assert (done["left"] >= done["generated"]).all() and not done["remaining"].any()
        if not newest_first:
            order = [n for n in buffers.delivered if buffers.packets["node"][n] == k]
            assert order == sorted(order)
    assert len(buffers.delivered) == (buffers.packets["status"] == DELIVERED).sum()
    assert buffers.lost == (buffers.packets["status"] == LOST).sum()


# --- age ---


def _done(*deliveries: tuple[int, float, float]) -> np.ndarray:
    """Delivered packets: (node, generated, delivered)."""
    packets = np.zeros(len(deliveries), PACKET)
    for row, values in enumerate(deliveries):
        packets[["node", "generated", "left"]][row] = values
    return packets


def _teeth(*deliveries: tuple[int, float, float], nodes: int = 1, end: float) -> Any:
    lows, highs, peaks = teeth_of(_done(*deliveries), nodes, end)
    return list(zip(lows.tolist(), highs.tolist(), strict=True)), peaks


def test_the_sawtooth_of_time_stamps_by_hand() -> None:
    """At 2 the age falls from 2 to 1, at 5 from 4 to 2; older data change nothing."""
    teeth, peaks = _teeth((0, 1.0, 2.0), (0, 3.0, 5.0), (0, 2.0, 6.0), end=8.0)
    assert teeth == [(0.0, 2.0), (1.0, 4.0), (2.0, 5.0)]
    assert peaks == 2
