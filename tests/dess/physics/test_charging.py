"""What a charge adds, slot by slot: exact fractions of what was typed."""

import math
from fractions import Fraction
from typing import Any

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from dess import ScenarioSpace, simulate
from dess.base.kernels import kernel
from dess.model.state import constants_of, types_of
from dess.physics.charging import charged_after, gain, slots_to_charge
from tests.drawn import Script

SHEET: dict[str, str] = {
    **{"cruise": "15 m/s", "data_rate": "3 MB/h", "bandwidth": "125 kHz", "snr": "12 dB at 2 km"},
    **{"endurance": "14 min", "charging": "20 min"},
}
MINUTES = st.integers(100, 9999).map(lambda hundredths: f"{hundredths / 100:.2f}")


@kernel
def _charged(missions, uavs, slots):
    """What the first slots of a charge add together, and each of them."""
    together, each = np.empty(slots, np.int64), np.empty(slots, np.int64)
    for k in range(slots):
        together[k] = charged_after(missions[0], uavs[0], k + 1)
        each[k] = gain(missions[0], uavs[0], k + 1)
    return together, each


@kernel
def _slots_to_charge(missions, uavs, lacking, begun):
    return slots_to_charge(missions[0], uavs[0], lacking, begun)


def _space(**values: Any) -> ScenarioSpace:
    plain = {"landing": True} if "data_sheet" not in values else {}
    return ScenarioSpace.of(**plain | values)


def _assert_exact(space: ScenarioSpace, rate: Fraction, slots: int) -> None:
    """Assert that k slots of a charge add ``floor(k g)``, and how many a charge takes."""
    missions, uavs = constants_of(space), types_of(space)
    together, each = _charged(missions, uavs, slots)
    assert together.tolist() == [int(k * rate) for k in range(1, slots + 1)]
    assert each.cumsum().tolist() == together.tolist()
    for lacking, begun in ((1, 0), (63, 0), (70, 7), (100, 3)):
        added = int(begun * rate) + lacking
        wanted = next(n for n in range(10**6) if int((begun + n) * rate) >= added)
        assert _slots_to_charge(missions, uavs, lacking, begun) == wanted


@given(MINUTES, MINUTES)
def test_with_a_sheet_the_rate_is_the_exact_fraction_of_the_times_that_were_typed(some, others):
    endurance, charging = sorted((some, others), key=float)
    sheet = SHEET | {"endurance": f"{endurance} min", "charging": f"{charging} min"}
    rate = Fraction(endurance) / Fraction(charging)
    if rate * 10_000 >= 100:  # a charge of more slots is refused
        _assert_exact(_space(data_sheet=sheet), rate, 300)


@given(st.decimals("0.02", "20", places=3).map(str) | st.integers(1, 100).map(str))
def test_without_a_sheet_the_rate_is_the_decimal_that_was_typed(typed):
    _assert_exact(_space(charge_rate=float(typed)), Fraction(typed), 300)


def test_a_charge_ends_in_the_slot_in_which_its_sum_is_reached():
    """14 min of flying in 20 min of charging: 63 % take 90 slots, though 90 * 0.7 is below 63."""
    assert 90 * 0.7 < 63
    values = {"uavs": 1, "flying_time": 20, "charge_complete": 83, "quota": 9}
    record = simulate(_space(data_sheet=SHEET, max_slots=120, **values), Script(""), 1, events=True)
    assert record.uavs[["charged", "slots_charging"]].tolist() == [(63, 90)]
    assert record.events is not None
    assert [e.time for e in record.events if e.event == "charge_end"] == [90.0]


def test_a_whole_rate_is_an_integer_however_it_is_written():
    space = ScenarioSpace.of(charge_rate=5.0)
    assert type(space.charge_rate) is int and space == ScenarioSpace.of(charge_rate=5)
    assert not space.is_extended


def test_without_a_request_there_is_no_waiting_time_for_a_pad():
    """A mission that says nothing of the wait does not count as one without a wait."""
    space = ScenarioSpace.of(uavs=1, max_slots=9, charging={"measured": True})
    record = simulate(space, Script("W" * 9), 1)
    assert (record.pad_requests, record.queue) == (0, 0)
    assert math.isnan(record.waiting)
