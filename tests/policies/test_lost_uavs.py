"""Hardly any guarded UAV is lost, and a judge explains each one that is.

The judge itself is tried on missions whose ways to live are known, and its ways are flown.
"""

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import pytest

from dess import load_scenario
from dess.batch import simulate_batch
from dess.mission import simulate
from dess.policies.registry import load
from dess.scenario import Scenario, ScenarioSpace
from dess.sea.families import FAMILIES
from dess.state import BATTERY, END_NAMES
from tests.dess.flights import flown
from tests.drawn import Script
from tests.policies.judge import judged

# Seas of each family, missions of each policy on a sea, and the seed of both.
SEAS, MISSIONS, SEED = 12, 8, 42
POLICIES = ("greedy", "any", "planner-short")


def drawn_spaces(seed: int) -> Iterator[list[ScenarioSpace]]:
    """Seas of all families, wind on a quarter, each with fleets of 1 to 6 UAVs.

    There are at least half as many pads as UAVs, and at most two more than that.
    """
    draws = np.random.default_rng(seed)
    for number in range(SEAS * len(FAMILIES)):
        sea = load_scenario(f"{[*FAMILIES][number % len(FAMILIES)]}:{draws.integers(10**9)}")
        wind: dict[str, Any] = {"strength": 0.0}
        if number // len(FAMILIES) % 4 == 0:
            gusts, direction = draws.uniform(0.1, 0.4), int(draws.integers(360))
            wind = {"strength": 0.8, "direction": direction, "gusts": gusts, "seed": number}
        zones = [{"cells": zone.cells, "pads": 1} for zone in sea.zones]
        room = sea.zone[2] * sea.zone[3]
        fields = []
        for _ in range(MISSIONS):
            uavs = int(draws.integers(1, min(room, 6) + 1))
            least = max((uavs + 1) // 2 - len(zones), 1)
            pads = min(least + int(draws.integers(3)), room)
            fields.append({"uavs": uavs, "pads": pads, "zones": zones, "wind": wind})
        yield [ScenarioSpace.of(sea, **each) for each in fields]


def failures(seed: int) -> tuple[int, list[str]]:
    """The number of drawn missions, and what was the matter in those that failed.

    A mission in which no UAV is lost and all but 1 % of the data are collected does not count as
    failed: the data of its sea do not suffice for all quotas until it is truncated.
    """
    missions, failed = 0, []
    for number, spaces in enumerate(drawn_spaces(seed)):
        for first, name in enumerate(POLICIES):
            policy, numbers = load(name), first * MISSIONS + np.arange(MISSIONS)
            records = simulate_batch(spaces, policy, seed + number, numbers)
            missions += len(numbers)
            lost = (records.uavs["end"] == BATTERY).any(axis=1)
            lacks_data = ~lost & (records.missions["collection_ratio"] >= 0.99)
            for n in np.nonzero((records.missions["success"] == 0) & ~lacks_data)[0]:
                space, which = spaces[n], (seed + number, int(numbers[n]))
                ends = [END_NAMES[end] for end in records.uavs[n]["end"][: space.uavs[1]]]
                found = "; ".join(map(str, judged(space, policy, *which))) or f"ends: {ends}"
                what = f"{space.uavs[1]} UAVs, {space.zone_pads} pads, {space.wind.strength} wind"
                failed.append(f"{name}, sea {number}, {which}, {what}: {found}")
    return missions, failed


@pytest.mark.slow
def test_at_most_one_of_a_thousand_drawn_missions_fails():
    missions, failed = failures(SEED)
    assert len(failed) <= missions / 1000, "\n".join(failed)


# --- the judge ---

# A zone at the western edge; UAVs may charge from a battery of 12 on, which takes up to 88 slots.
# The node has data for all the time, and the quota cannot be filled.
FIELDS: dict[str, Any] = {
    **{"grid": 8, "zone": [0, 0, 1, 2], "nodes": [[7, 7]], "initial_data": 1e6, "quota": 1000},
    **{"flying_time": 14, "charge_start": 12, "charge_complete": 100, "charge_rate": 1},
}
FURTHER = {"zones": [{"cells": [0, 6, 1, 1], "pads": 1}]}


class Case(NamedTuple):
    """A mission whose last UAV is lost, and from when on it could have lived.

    Attributes:
        routes: What each UAV does; then it hovers.
        starts: The cells in which they start.
        fields: Fields of the scenario that differ from ``FIELDS``.
        latest: The last slot from which a way to live exists, None if there is none.
        moves: The number of moves from there on.
    """

    routes: tuple[str, ...]
    starts: list[tuple[int, int]]
    fields: dict[str, Any]
    latest: int | None
    moves: int = 0


CASES = {
    # At the start of slot 6 it is 6 cells away with a battery of 8: it is home with 2, and charges.
    "too far": Case(("EEEEEEE",), [(0, 0)], {}, 6, 7),
    # A move to the east costs 2: at the start of slot 4 it is 4 cells away with a battery of 6.
    "too far against the wind": Case(
        ("EEEEEEE",), [(0, 0)], {"wind": {"strength": 1.0, "direction": 90}}, 4, 5
    ),
    # Both may charge from slot 2 on, and the teammate is granted the only pad for 88 slots.
    "no pad": Case(("", ""), [(0, 0), (0, 1)], {"pads": 1}, None),
    # The same with a pad 5 cells away: from slot 8 on, with a battery of 6, it is there with 1.
    "another zone": Case(("", ""), [(0, 0), (0, 1)], {"pads": 1} | FURTHER, 8, 6),
}


@pytest.mark.parametrize("case", CASES.values(), ids=CASES)
def test_the_judge_finds_the_last_moment(case):
    """And with the moves that it finds, the UAV lives, and its teammates do what they did."""
    scenario = Scenario.of(**FIELDS | {"uavs": len(case.routes)} | case.fields)
    record, _ = flown(scenario, *case.routes, starts=case.starts)
    replication, lost = int(record.metrics["replication"]), len(case.routes) - 1
    (finding,) = judged(scenario, Script(*case.routes), 0, replication)
    assert finding.uav == lost
    assert (finding.latest, len(finding.moves)) == (case.latest, case.moves)
    if finding.latest is not None:
        route = case.routes[-1].ljust(finding.latest, ".")[: finding.latest] + finding.moves
        saved = simulate(scenario, Script(*case.routes[:-1], route), 0, replication)
        assert saved.uavs[lost]["slots_charging"] > 0
        assert (saved.uavs[:lost]["slots_charging"] == record.uavs[:lost]["slots_charging"]).all()


def test_mission_without_losses_has_no_findings():
    assert judged(Scenario.of(**FIELDS | {"uavs": 1, "quota": 4}), Script("N"), 0, 0) == []
