"""What batteries allow: compared with hand-worked cases and with all ways to charge."""

from functools import cache

from hypothesis import example, given
from hypothesis import strategies as st

from dess.analysis.bound.paths import last_slot, phases_of
from dess.scenario.scenario import Scenario


def scenario(**values: object) -> Scenario:
    return Scenario.of(**{"uavs": 1, "quota": 80, "communication_slots": 4} | values)


def test_phases_of_a_case_worked_by_hand():
    # 20 flying slots; the battery lasts 12, and 15 after a charge that may begin at slot 2.
    phases = phases_of(scenario(flying_time=12, charge_start=10, charge_complete=15, charge_rate=5))
    # A charge before slot 20 - 15 = 5 does not suffice: one phase for charges at slots 2 to 4.
    assert phases.deadline.tolist() == [12, 4 + 15, 20]
    assert (phases.opens[0], phases.closes[0]) == (2, 11)
    assert (phases.opens[1], phases.closes[1]) == (2 + 5, 4 + 14)
    assert phases.after[[2, 4, 5, 19]].tolist() == [1, 1, 2, 2]
    assert phases.charged.tolist() == [0, 1, 1]
    assert phases.clock[0].tolist() == [*range(20)]


@given(
    start=st.integers(1, 15),
    low=st.integers(10, 12),
    charge=st.integers(1, 10),
    rate=st.integers(1, 12),
    cost=st.integers(0, 1),
    slots=st.integers(1, 30),
    longest=st.integers(1, 60),
)
@example(start=10, low=10, charge=8, rate=1, cost=0, slots=5, longest=60)
@example(start=1, low=10, charge=4, rate=3, cost=1, slots=30, longest=60)
@example(start=12, low=10, charge=1, rate=1, cost=1, slots=30, longest=33)
def test_the_phases_allow_all_that_a_battery_allows(start, low, charge, rate, cost, slots, longest):
    full = low + charge
    values = {"flying_time": start, "charge_start": low, "charge_complete": full}
    phases = phases_of(
        scenario(**values, charge_rate=rate, flight_cost=cost, quota=4 * slots, max_slots=longest)
    )
    # The phase in which batteries count no more.
    free = len(phases.deadline) - 1

    @cache
    def go(slot: int, f: int, battery: int, latch: bool, phase: int) -> None:
        """All that can come after f flying slots."""
        assert slot <= phases.slots
        if battery == 0 or f == min(slots, longest) or slot == longest:
            return
        assert f < phases.deadline[phase]
        assert last_slot(phases, phase, f + 1, phases.slots) <= slot <= phases.clock[phase, f]
        left = battery - cost
        go(slot + 1, f + 1, left, latch or left <= low, phase)
        if latch:
            if phase < free:
                assert phases.opens[phase] <= f <= phases.closes[phase]
                phase = phases.after[f]
            go(min(slot - (battery - full) // rate, longest), f, full, False, phase)

    go(0, 0, start, start <= low, 0)
