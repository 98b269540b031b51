"""A rule of thumb for the size of a fleet, beside the one that a search has found.

    rule = rule_of_thumb(results, "greedy", [3])  # of the missions at design point 3
    rule.uavs

With ``a`` UAVs in the air, each of which flies for a time F and then needs a time R until it can
fly again, ``a (ceil(R / F) + 1)`` are enough (arXiv 2604.15890). The means of simulated missions
take the place of what an engineer would estimate.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from dess.analysis import numbers
from dess.analysis.results.tables import Results
from dess.analysis.study.prices import spent_battery, types_of_uavs
from dess.scenario.quantities import printed
from dess.scenario.scenario import ScenarioSpace


@dataclass(frozen=True)
class RuleOfThumb:
    """The rule, with what it takes from the missions of a fleet.

    Attributes:
        flying: The mean number of UAVs in the air.
        flight: The mean time in the air between charges [s].
        recovery: The time to charge from the mean battery at landing to full, with the mean wait
            for a pad [s].
    """

    flying: float
    flight: float
    recovery: float

    @property
    def uavs(self) -> int:
        """How many UAVs the rule asks for."""
        return self._kept_flying * (self._spares_of_each + 1)

    @property
    def _kept_flying(self) -> int:
        return math.ceil(self.flying)

    @property
    def _spares_of_each(self) -> int:
        return math.ceil(self.recovery / self.flight)

    @property
    def in_words(self) -> str:
        """What the rule says, with its numbers in it."""
        uavs = numbers.format_count(self.uavs, "UAV")
        ratio = f"{_format_time(self.recovery)} / {_format_time(self.flight)}"
        return f"{uavs} = {self._kept_flying} (ceil({ratio}) + 1); {self.flying:.1f} in the air"


def _format_time(seconds: float) -> str:
    """A time of three digits, as ``36.7 min``."""
    return printed(60 * float(f"{seconds / 60:.3g}"), "s")


def rule_of_thumb(results: Results, policy: str, points: Sequence[int]) -> RuleOfThumb | None:
    """The rule for a fleet, of its missions in a search.

    Args:
        results: A study whose missions measure the use of the pads.
        policy: The policy.
        points: The design points of the fleet, one for each condition.

    Returns:
        The rule; None without a data sheet, of years, or if no UAV has charged.
    """
    missions = results.missions
    scenarios = results.store.manifest.scenarios
    if "pad_requests" not in missions or not all(scenarios[point].units for point in points):
        return None
    if any(scenarios[point].weather.is_on for point in points):
        return None
    is_of_fleet = (missions["policy"] == policy) & missions["point"].isin(points)
    is_of_its_uavs = (results.uavs["policy"] == policy) & results.uavs["point"].isin(points)
    missions = missions[is_of_fleet]
    uavs = results.uavs[is_of_its_uavs]
    flights = missions["pad_requests"].sum()
    if not flights > 0:
        return None
    space = scenarios[points[0]]
    assert space.units
    charge = charging_slots(scenarios, missions, uavs).sum() / flights
    wait = uavs["slots_waiting"].sum() / flights
    flown = uavs["slots_flying"].sum()
    return RuleOfThumb(
        flying=float(flown / missions["slots"].sum()),
        flight=float(flown / flights * space.units.slot),
        recovery=float((charge + wait) * space.units.slot),
    )


def charging_slots(
    spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any], uavs: Mapping[str, Any]
) -> np.ndarray:
    """(u,) the slots in which what each UAV has spent is charged, by the rate of its type.

    Args:
        spaces: The scenario of every design point.
        missions: As in ``Costs.parts``.
        uavs: As in ``Costs.parts``.
    """
    types = types_of_uavs(spaces, missions)
    points = np.repeat(np.asarray(missions["point"]), np.asarray(missions["uavs"]))
    rates = np.array([float(space.charge_fraction) for space in spaces])[points]
    has_own = types["charge_rate"] > 0
    rates[has_own] = types["charge_rate"][has_own] / types["rate_slots"][has_own]
    return spent_battery(spaces, missions, uavs) / rates
