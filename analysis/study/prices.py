"""What a fleet costs: the prices of a study, and the cost of a mission by what is paid for."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any

import numpy as np
from pydantic import Field

from dess import InputError
from dess.analysis import numbers
from dess.analysis.study.stopping import MOST, Line, StrictTable
from dess.physics.section import Integer, Number
from dess.scenario.scenario import ScenarioSpace

# A price; the sums of all missions that may be planned are still finite.
Price = Annotated[float, Field(ge=0, le=10**12, allow_inf_nan=False)]

PURCHASE = "purchase"
PARTS = (PURCHASE, "charging", "hours", "losses")

_PAID_FOR = {
    "uav": "a UAV",
    "pad": "a charging pad",
    "charge": "charging a battery from 0 to 100 %",
    "hour": "an hour of a mission",
    "lost_uav": "a lost UAV",
}


class Costs(StrictTable):
    """Prices in one currency.

    UAVs and pads are bought once. Charging, hours and lost UAVs are paid for in each of the
    ``missions`` planned for the fleet.

    Raises:
        pydantic.ValidationError: If a price is below 0.
    """

    currency: Line = Field("EUR", min_length=1, max_length=16, description="name of the currency")
    uav: Price = Field(0.0, description="price of a UAV")
    pad: Price = Field(0.0, description="price of a charging pad")
    charge: Price = Field(0.0, description="price of charging a battery from 0 to 100 %")
    hour: Price = Field(0.0, description="price of an hour of a mission")
    lost_uav: Price = Field(
        0.0,
        description="price of a lost UAV: its battery is depleted, it has failed for good, or it "
        "floats out at sea at the end",
    )
    missions: Integer = Field(1, ge=1, le=MOST, description="missions that the fleet is to fly")
    slot_seconds: Number | None = Field(
        None,
        ge=0.001,
        le=1_000_000,
        description="length of a mission slot [s]; needed for the price of an hour, unless there "
        "is a data sheet",
    )

    def check(self, spaces: Sequence[ScenarioSpace]) -> None:
        """Check that the length of a slot is known where hours have a price.

        Raises:
            InputError: If it is not, or is given although it follows from a data sheet.
        """
        follows = any(space.units for space in spaces)
        where = "costs.slot_seconds"
        if follows and self.slot_seconds is not None:
            raise InputError(where, "follows from the data sheet", "without this field")
        if self.hour and self.slot_seconds is None and not follows:
            raise InputError(where, "is missing", "with hour, the seconds of a slot")

    @property
    def pays_for_missions(self) -> bool:
        """Whether missions have a price, not the purchase alone."""
        return any((self.charge, self.hour, self.lost_uav))

    @property
    def in_words(self) -> str:
        """The prices, the missions that are paid for, and what has no price."""
        paid = []
        free = []
        for price, thing in _PAID_FOR.items():
            value = getattr(self, price)
            if value:
                paid.append(f"{numbers.format_money(value, self.currency)} for {thing}")
            else:
                free.append(thing)
        text = f"Prices: {numbers.join_words(paid)}."
        if self.pays_for_missions:
            text += f" The fleet is to make {numbers.format_count(self.missions, 'mission')}."
        if free:
            text += f" Nothing is paid for {numbers.join_words(free, 'or')}."
        return text

    def of_lost(self, uavs: Any) -> Any:
        """What it costs if every mission loses this number of UAVs, in the currency."""
        return self.missions * self.lost_uav * uavs

    def parts(
        self, spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any], uavs: Mapping[str, Any]
    ) -> dict[str, np.ndarray]:
        """The parts of the cost of every mission, in the currency.

        Args:
            spaces: The scenario of every design point.
            missions: (n,) columns of the missions: ``point`` and the fields of ``MISSION_RECORD``.
            uavs: Columns of the UAVs of these missions, in the same order: ``charged`` and ``down``
                of ``UAV_RECORD``.

        Returns:
            The (n,) amounts of each of ``PARTS``.

        Raises:
            InputError: If charging or lost UAVs have a price, and results of before lack what was
                charged and lost.
        """
        fleet = np.asarray(missions["uavs"])
        points = np.asarray(missions["point"])
        mission = np.repeat(np.arange(len(fleet)), fleet)
        pads = np.array([space.charging_pads for space in spaces])
        charged = self._sum_of(uavs, "charged", mission, len(fleet), self.charge)
        lost = self._sum_of(uavs, "down", mission, len(fleet), self.lost_uav)
        seconds = [space.units.slot if space.units else self.slot_seconds or 0 for space in spaces]
        hours = np.asarray(missions["slots"]) * np.array(seconds)[points] / 3600
        return {
            PURCHASE: self.uav * fleet + self.pad * pads[points],
            "charging": self.missions * self.charge * charged / 100,
            "hours": self.missions * self.hour * hours,
            "losses": self.missions * self.lost_uav * lost,
        }

    @staticmethod
    def _sum_of(
        uavs: Mapping[str, Any], field: str, mission: np.ndarray, missions: int, price: float
    ) -> np.ndarray:
        """(n,) sums of a field over the UAVs of every mission; 0 if it has no price."""
        if not price:
            return np.zeros(missions)
        if field not in uavs or np.isnan(np.asarray(uavs[field], float)).any():
            raise InputError(
                "costs",
                f"the records of an earlier version have no {field}, which has a price",
                "results of this version, in another results folder",
            )
        return np.bincount(mission, np.asarray(uavs[field]), missions)


def stranded_uavs(uavs: Mapping[str, Any]) -> np.ndarray:
    """(u,) whether UAVs that are not lost have no battery for their way home, by ``UAV_RECORD``.

    Where missions do not end on the ground, this is not paid for.
    """
    is_short = np.asarray(uavs["battery"]) < np.asarray(uavs["way_home"])
    return is_short & (np.asarray(uavs["down"]) == 0)
