"""Fleets that differ: where slow UAVs are, what they collect, and what each type must do."""

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, load_scenario, simulate, simulate_batch
from dess.observations.states import compact_states, masks
from dess.record import MissionRecord
from dess.scenario import ScenarioSpace
from dess.state import HOVER, QUOTA, TRUNCATED
from dess.view import View
from tests.drawn import Recorder, Script, Wanderer, seeds

# There is one node, with data without end.
ROW = {
    "grid": 8,
    "nodes": [[2, 6]],
    "initial_data": 1e6,
    "shadowing_variance": 0.0,
    "arrival_rate": 0.0,
    "flying_time": 50,
    "charge_start": 10,
    "max_slots": 4,
}
LONE = ROW | {"zone": [2, 2, 1, 1], "uavs": 1}
SLOW = [{"slots_per_cell": 2}]


def _simulated(scenario: dict[str, Any], *routes: str, **fields: Any) -> MissionRecord:
    space = ScenarioSpace.of(**(scenario | fields))
    record = simulate(space, Script(*routes), 1, events=True)
    batch = simulate_batch(space, Script(*routes), 1, 1)
    assert batch.uavs[0].tobytes() == record.uavs.tobytes()
    return record


def _log(record: MissionRecord, event: str, uav: int = 0) -> list[tuple[float, ...]]:
    """Time, x, y and value of the events of a UAV."""
    assert record.events is not None
    log = record.events.columns()
    rows = (log["event"] == event) & (log["uav"] == uav)
    return list(zip(*(log[c][rows].tolist() for c in ("time", "x", "y", "value")), strict=True))


# --- speed ---


def test_a_slow_uav_is_at_equal_parts_of_its_way_in_its_communication_slots() -> None:
    # Two slots per cell and m = 4: an eighth of a cell per communication slot. Then it hovers.
    record = _simulated(LONE, "ES..", fleet=SLOW, max_slots=3)
    places = [(x, y) for _, x, y, _ in _log(record, "communication")]
    assert places == [(2 + n / 8, 2) for n in range(1, 9)] + [(3, 2)] * 4
    # It holds the cell that it flies to from the first slot on; "S" was asked for in the middle.
    assert [(x, y) for _, x, y, _ in _log(record, "move")] == [(3, 2)] * 3


def test_what_a_slow_uav_collects_is_what_its_distance_gives() -> None:
    # It flies 3 slots per cell towards the node, so from 4 cells away to 3 and on to 2.
    record = _simulated(
        LONE, "S..S..", fleet=[{"slots_per_cell": 3}], max_slots=6, communication_slots=2
    )
    space = ScenarioSpace.of(**LONE)
    edge = np.hypot(*(8 * space.cell_size / 2,) * 2)
    for n, (_, x, y, amount) in enumerate(_log(record, "communication"), 1):
        assert (x, y) == (2, pytest.approx(2 + n / 6))
        distance = np.hypot(space.cell_size * (6 - (2 + n / 6)), space.altitude)
        snr = space.edge_snr - 10 * space.path_loss_exponent * np.log10(distance / edge)
        assert amount == pytest.approx(0.5 * np.log2(1 + 10 ** (snr / 10)), rel=1e-12)


@given(st.lists(st.integers(1, 4), min_size=1, max_size=3), seeds)
def test_moves_take_the_slots_of_their_type_and_nothing_is_decided_meanwhile(
    speeds: list[int], seed: int
) -> None:
    fleet = [{"slots_per_cell": s} for s in speeds]
    space = ScenarioSpace.of(
        **ROW | {"zone": [0, 2, 8, 1], "uavs": 4, "max_slots": 24}, fleet=fleet
    )
    policy = Recorder(Wanderer())
    record = simulate(space, policy, seed, events=True)
    for i in range(4):
        busy = 0
        cells = [(x, y) for _, x, y, _ in _log(record, "move", i)]
        (_, x, y, _) = _log(record, "mission_start", i)[0]
        for slot, cell in enumerate(cells):
            assert ((slot, i) in policy.asked) == (busy == 0)
            if busy:
                busy -= 1
                assert cell == cells[slot - 1]
            elif cell != (cells[slot - 1] if slot else (x, y)):
                assert policy.asked[slot, i] != HOVER
                busy = speeds[i % len(speeds)] - 1


def test_a_uav_on_its_way_gives_way_to_nobody_and_frees_the_cell_it_left() -> None:
    # UAV 0 and 1 start in (2, 2) and (3, 2), in one of the two orders.
    row = ROW | {"zone": [2, 2, 2, 1], "uavs": 2, "fleet": [{"slots_per_cell": 3}, {}]}
    starts = simulate(ScenarioSpace.of(**row), Script("", ""), 1, events=True)
    x0 = _log(starts, "mission_start", 0)[0][1]
    # UAV 0 flies south; UAV 1 moves into the cell that it left, then wants the one below.
    record = _simulated(row, "S...", "ES.." if x0 == 3 else "WS..")
    assert [(x, y) for _, x, y, _ in _log(record, "move", 0)] == [(x0, 3)] * 4
    assert [(x, y) for _, x, y, _ in _log(record, "move", 1)] == [(x0, 2)] * 4
    assert [t for t, *_ in _log(record, "collision", 1)] == [1.0]
    assert _log(record, "collision", 0) == []


def test_a_slow_move_pays_for_the_wind_once() -> None:
    wind = {"wind.strength": 5, "wind.direction": 180}
    record = _simulated(LONE, "S...", fleet=[{"slots_per_cell": 3}], **wind)
    assert [battery for *_, battery in _log(record, "move")] == [44, 43, 42, 41]


# --- quota, battery and rate ---


def test_types_are_given_in_turn() -> None:
    fleet = [{"quota": 8, "flying_time": 30}, {"flying_time": 20}]
    record = _simulated(
        ROW | {"zone": [0, 2, 8, 1], "uavs": 3, "quota": 12}, *3 * [""], fleet=fleet
    )
    assert [_log(record, "mission_start", i)[0][3] for i in range(3)] == [30, 20, 30]
    assert record.uavs["end"].tolist() == [QUOTA] * 3
    assert record.uavs["quota"].tolist() == [8, 12, 8]
    assert record.uavs["slots_flying"].tolist() == [2, 3, 2]


def test_success_needs_the_quota_of_every_type() -> None:
    base = ROW | {"zone": [0, 2, 8, 1], "uavs": 2, "quota": 4}
    assert _simulated(base, "", "").success == 1
    record = _simulated(base, "", "", fleet=[{}, {"quota": 17}])
    assert (record.success, record.uavs["end"].tolist()) == (0, [QUOTA, TRUNCATED])


def test_the_rate_of_a_type_multiplies_what_it_collects() -> None:
    one = _simulated(LONE, "....")
    for factor in (0.25, 3.0):
        other = _simulated(LONE, "....", fleet=[{"rate": factor}])
        assert other.collected == pytest.approx(factor * one.collected, rel=1e-12)


def test_a_fleet_of_the_default_type_is_the_same_mission() -> None:
    space = load_scenario("paper")
    typed = ScenarioSpace.of(space, fleet=[{"quota": 440}])
    for one, other in zip(
        simulate_batch(space, Wanderer(), 3, 4)[:2],
        simulate_batch(typed, Wanderer(), 3, 4)[:2],
        strict=True,
    ):
        assert one.tobytes() == other.tobytes()


def test_a_uav_on_its_way_is_not_asked_and_may_only_hover() -> None:
    seen = []

    class Spy(Script):
        def act(self, view: View) -> np.ndarray:
            everyone = View(view.state, view.world, np.zeros(2, int), np.arange(2))
            legal = everyone.legal
            states = compact_states(view.state, guarded=False)
            assert (masks(states, everyone.mission, everyone.uav) == legal).all()
            seen.append((view.uav.tolist(), legal.sum(1).tolist()))
            return super().act(view)

    row = ROW | {"zone": [2, 2, 2, 1], "uavs": 2, "max_slots": 3}
    simulate(ScenarioSpace.of(**row, fleet=[{"slots_per_cell": 2}, {}]), Spy("S..", "..."), 1)
    assert seen == [([0, 1], [5, 5]), ([1], [1, 5]), ([0, 1], [5, 5])]


def test_what_is_no_fleet_is_refused() -> None:
    for kind in ({"slots_per_cell": 9}, {"quota": 0}, {"rate": 0}, {"flying_time": 101}):
        (field,) = kind
        with pytest.raises(InputError, match=field):
            load_scenario("paper", fleet=[kind])
    speeds = [{"slots_per_cell": s} for s in (5, 7, 8)]
    with pytest.raises(InputError, match="fleet: slots_per_cell"):
        load_scenario("paper", grid=256, communication_slots=64, nodes=[[0, 0]], fleet=speeds)
