"""Buffers of packets by hand, and against laws of queues."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess.sections.buffers import PACKET, Buffers, teeth_of

WAITING, DELIVERED, LOST = range(3)


def _status(buffers: Buffers) -> np.ndarray:
    """What has become of each packet."""
    status = np.where(np.isnan(buffers.packets["left"]), WAITING, LOST)
    status[buffers.delivered] = DELIVERED
    return status


def test_the_newest_packet_is_served_first_by_hand() -> None:
    buffers = Buffers(1, newest_first=True)
    buffers.store(0, 0.0, 1.0)
    buffers.serve(0, 1.0, 0.5)  # half of packet 0
    buffers.store(0, 2.0, 1.0)
    buffers.serve(0, 3.0, 1.0)  # packet 1 goes first; the rest of packet 0 stays
    assert np.array_equal(buffers.packets["left"], [np.nan, 3.0], equal_nan=True)
    buffers.serve(0, 4.0, 0.5)
    assert buffers.packets["left"].tolist() == [4.0, 3.0]
    assert buffers.delivered == [1, 0]


def test_a_full_buffer_refuses_the_new_packet_or_loses_its_oldest_by_hand() -> None:
    refuses, replaces = Buffers(2, limit=2), Buffers(2, limit=2, newest_first=True)
    for buffers, lost in ((refuses, 2), (replaces, 0)):
        assert [buffers.store(0, float(time), 1.0) for time in range(3)] == [-1, -1, lost]
        assert buffers.store(1, 3.0, 1.0) == -1  # the buffer of another node
        assert _status(buffers)[lost] == LOST and buffers.packets["left"][lost] == 2.0
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
            data = sum(buffers.all[number].remaining for number in buffers.queues[k])
            buffers.serve(k, now, amount)
            served[k] += min(amount, data)
        assert limit == 0 or max(map(len, buffers.queues)) <= limit
    for k in (0, 1):
        of_node = buffers.packets["node"] == k
        own, status = buffers.packets[of_node], _status(buffers)[of_node]
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
    assert buffers.lost == (_status(buffers) == LOST).sum()


# --- age ---


def test_the_sawtooth_of_time_stamps_by_hand() -> None:
    """At 2 the age falls from 2 to 1, at 5 from 4 to 2; older data change nothing."""
    done = np.zeros(3, PACKET)
    done["generated"], done["left"] = [1.0, 3.0, 2.0], [2.0, 5.0, 6.0]
    lows, highs, peaks = teeth_of(done, 1, 8.0)
    assert (lows.tolist(), highs.tolist(), peaks) == ([0.0, 1.0, 2.0], [2.0, 4.0, 5.0], 2)
