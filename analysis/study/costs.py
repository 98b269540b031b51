"""Costs: what a fleet costs over all its planned missions, by the prices of a study.

    costs = Costs(uav=20_000, pad=3_000, hour=120, slot_seconds=60, missions=500)

A study's table ``[costs]`` holds the prices. The cost of a simulated mission is the total cost of
the fleet if all its planned missions were like this one: the purchase, plus what this mission
consumes times the number of planned missions. So the mean over simulated missions estimates the
expected total cost.
"""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from analysis.study.stopping import MOST, Line, StrictTable
from dess.scenario import Integer, Number, ScenarioSpace

# A price; the sums of all missions that may be planned are still finite.
Price = Annotated[float, Field(ge=0, le=10**12, allow_inf_nan=False)]

PARTS = ("purchase", "charging", "hours", "losses")


class Costs(StrictTable):
    """Prices in one currency.

    UAVs and pads are bought once. Charging, hours and lost UAVs are paid for in each of the
    ``missions`` planned for the fleet.

    Raises:
        pydantic.ValidationError: If a price is below 0, or hours are without ``slot_seconds``.
    """

    currency: Line = Field("EUR", min_length=1, max_length=16, description="name of the currency")
    uav: Price = Field(0.0, description="price of a UAV")
    pad: Price = Field(0.0, description="price of a charging pad")
    charge: Price = Field(0.0, description="price of charging a battery from 0 to 100 %")
    hour: Price = Field(0.0, description="price of an hour of a mission")
    lost_uav: Price = Field(0.0, description="price of a UAV whose battery is depleted")
    missions: Integer = Field(1, ge=1, le=MOST, description="missions that the fleet is to fly")
    slot_seconds: Number | None = Field(
        None,
        ge=0.001,
        le=1_000_000,
        description="length of a mission slot [s]; needed for the price of an hour",
    )

    @model_validator(mode="after")
    def _hours_have_a_length(self) -> Self:
        if self.hour and self.slot_seconds is None:
            raise ValueError("slot_seconds: is missing; allowed: with hour, the seconds of a slot")
        return self

    def parts(
        self, spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any], uavs: Mapping[str, Any]
    ) -> dict[str, np.ndarray]:
        """The parts of the cost of every mission, in the currency.

        Args:
            spaces: The scenario of every design point.
            missions: (n,) columns of the missions: ``point`` and the fields of ``MISSION_RECORD``.
            uavs: Columns of the UAVs of these missions, in the same order: ``slots_charging``, and
                the name of ``end``.

        Returns:
            The (n,) amounts of each of ``PARTS``.
        """
        fleet, points = np.asarray(missions["uavs"]), np.asarray(missions["point"])
        mission = np.repeat(np.arange(len(fleet)), fleet)
        pads, rates = np.array([(space.charging_pads, space.charge_rate) for space in spaces]).T
        slots = np.bincount(mission, np.asarray(uavs["slots_charging"]), len(fleet))
        lost = np.bincount(mission, np.asarray(uavs["end"]) == "battery", len(fleet))
        hours = np.asarray(missions["slots"]) * (self.slot_seconds or 0.0) / 3600
        return {
            "purchase": self.uav * fleet + self.pad * pads[points],
            "charging": self.missions * self.charge * slots * rates[points] / 100,
            "hours": self.missions * self.hour * hours,
            "losses": self.missions * self.lost_uav * lost,
        }
