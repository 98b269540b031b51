"""What batteries allow a UAV: phases between charges, and the slots that charging can take.

The state of a UAV counts its flying slots f so far. A *phase* says what is known about its
battery: not charged yet; charged so early that it must charge again; or charged so late that its
battery suffices for the rest of the mission. Every phase has a *deadline*, the number of flying
slots at which its battery is empty at the latest, and a *clock*: the latest mission slot in which
flying slot f can take place (docs/concepts/bound.md, relaxations 4 and 5).
"""

from typing import NamedTuple

import numpy as np

from dess.scenario import Scenario, ScenarioSpace

_WIDTH = 8  # flying slots whose first charges share a phase


class Phases(NamedTuple):
    """The phases of a mission's UAVs, in the order in which a UAV can pass through them.

    Attributes:
        clock: (P, F) latest mission slot of flying slot f in each phase.
        deadline: (P,) flying slots after which the phase's battery is empty at the latest.
        opens: (P,) flying slots from which on a UAV in this phase may charge.
        closes: (P,) flying slots up to which it may charge; less than ``opens`` if never.
        after: (F,) the phase after a charge that begins after f flying slots.
        charged: (P,) charging slots that a UAV in this phase has had at least.
        slots: The most mission slots that are over at the end of a mission.
    """

    clock: np.ndarray
    deadline: np.ndarray
    opens: np.ndarray
    closes: np.ndarray
    after: np.ndarray
    charged: np.ndarray
    slots: int


def most_flying(scenario: Scenario | ScenarioSpace) -> int:
    """The most slots that a UAV flies before the sea is empty or the mission ends."""
    return min(-(-scenario.quota // scenario.communication_slots), scenario.max_slots)


def early_charges(slots: int, start: int, low: int, full: int) -> np.ndarray:
    """The first flying slots of the phases of charges that do not suffice for the rest.

    Args:
        slots: The most flying slots.
        start, low, full: Battery at the start, and at which charging may begin and ends [%].
    """
    return np.arange(max(start - low, 0), max(slots - full, 0), min(full - low, _WIDTH))


def phases_of(scenario: Scenario) -> Phases:
    """The phases of the UAVs of one mission."""
    slots = most_flying(scenario)
    flying = np.arange(slots)
    if scenario.flight_cost == 0:
        return _without_battery(scenario, flying)
    start, low, full = scenario.flying_time, scenario.charge_start, scenario.charge_complete
    charging = most_charging(scenario, slots)
    # Charges before flying slot ``late`` do not suffice for the rest of the mission.
    first, late = max(start - low, 0), min(max(slots - full, 0), slots)
    width = min(full - low, _WIDTH)
    early = early_charges(slots, start, low, full)
    last = np.minimum(early + width, late) - 1
    free = 1 + len(early)
    after = np.full(slots, free)
    after[first:late] = 1 + (flying[first:late] - first) // width
    clock = np.tile(flying + charging, (free + 1, 1))
    clock[0] = flying
    return Phases(
        np.minimum(clock, scenario.max_slots - 1),
        np.array([start, *(last + full), slots]),
        np.array([first, *(early + full - low), slots]),
        np.array([start - 1, *(last + full - 1), 0]),
        after,
        np.array([0] + [-(-(full - low) // scenario.charge_rate)] * free),
        min(slots + int(charging[-1]), scenario.max_slots),
    )


def _without_battery(scenario: Scenario, flying: np.ndarray) -> Phases:
    """One phase without a deadline: flying takes no battery, so a UAV charges once at most."""
    needed = scenario.charge_complete - scenario.flying_time
    charging = -(-needed // scenario.charge_rate)
    if scenario.flying_time > scenario.charge_start:
        charging = 0
    slots, never = np.array([len(flying)]), np.array([0])
    clock = np.minimum(flying + charging, scenario.max_slots - 1)[None, :]
    most = min(len(flying) + charging, scenario.max_slots)
    return Phases(clock, slots, slots, never, never.repeat(len(flying)), never, most)


def most_charging(scenario: Scenario, slots: int) -> np.ndarray:
    """(F,) the most charging slots of a UAV before its flying slot f = 0..F-1.

    A charge begins at a battery of 1 to C_S and ends at C_C, so between two charges a UAV flies
    C_C - C_S to C_C - 1 slots.
    """
    start, low, full = scenario.flying_time, scenario.charge_start, scenario.charge_complete
    most = np.full(slots, -np.inf)  # if the last charge begins after exactly f flying slots
    for f in range(slots):
        if start - low <= f <= start - 1:
            most[f] = -(-(full - start + f) // scenario.charge_rate)
        for flying in range(full - low, min(full - 1, f) + 1):
            most[f] = max(most[f], most[f - flying] - (-flying // scenario.charge_rate))
    return np.maximum(np.maximum.accumulate(most), 0).astype(np.int64)
