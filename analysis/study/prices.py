"""What a fleet costs: the prices of a study, and the cost of its missions by what is paid for."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Self

import numpy as np
from pydantic import Field, model_validator

from dess import InputError
from dess.analysis import numbers
from dess.analysis.study.stopping import MOST_MISSIONS, Line, StrictTable
from dess.model.state import types_of
from dess.physics.energy import PERCENT, energy_constants
from dess.physics.fleet import slowest, type_of
from dess.physics.section import Integer, Number
from dess.scenario.scenario import ScenarioSpace

# A price; the sums of all missions that may be planned are still finite.
Price = Annotated[float, Field(ge=0, le=10**12, allow_inf_nan=False)]

PURCHASE, PACKS = "purchase", "packs"
PARTS = (PURCHASE, "charging", "hours", "losses")
PARTS_OF_A_YEAR = (PURCHASE, PACKS, "charging", "hours", "losses")

_PAID_FOR = {
    "uav": "a UAV",
    "pad": "a charging pad",
    "charge": "charging a battery from 0 to 100 %",
    "hour": "an hour of a mission",
    "lost_uav": "a lost UAV",
    "pack": "a battery pack",
}
# What only the costs of a year have.
_OF_A_YEAR = ("interest", "days", "pack", "pack_cycles")


class Costs(StrictTable):
    """Prices in one currency.

    UAVs and pads are bought once. Charging, hours and lost UAVs are paid for in each of the
    ``missions`` planned for the fleet. Where missions are paid for, a lost UAV costs what it was
    bought for, unless ``lost_uav`` says what it costs.

    With ``years``, costs are those of a year with ``days`` missions: UAVs and pads are paid off by
    equal amounts, and worn battery packs are replaced.

    Raises:
        pydantic.ValidationError: If a price is below 0, or fields of a year and of a number of
            missions are mixed.
    """

    currency: Line = Field("EUR", min_length=1, max_length=16, description="name of the currency")
    uav: Price = Field(0.0, description="price of a UAV")
    pad: Price = Field(0.0, description="price of a charging pad")
    charge: Price = Field(0.0, description="price of charging a battery from 0 to 100 %")
    hour: Price = Field(0.0, description="price of an hour of a mission")
    lost_uav: Price | None = Field(
        None,
        description="price of a lost UAV: its battery is depleted, it has failed for good, or it "
        "floats out at sea at the end; what it was bought for, where missions are paid for",
    )
    missions: Integer = Field(
        1, ge=1, le=MOST_MISSIONS, description="missions that the fleet is to fly"
    )
    slot_seconds: Number | None = Field(
        None,
        ge=0.001,
        le=1_000_000,
        description="length of a mission slot [s]; needed for the price of an hour, unless there "
        "is a data sheet",
    )
    years: Number | None = Field(
        None,
        ge=0.1,
        le=100,
        description="years over which UAVs and pads are paid off; costs are then those of a year",
    )
    interest: Number = Field(
        0.0, ge=0, le=1, description="interest a year, as a share: 0.04 for 4 %; with years"
    )
    days: Integer | None = Field(
        None, ge=1, le=365, description="days of a year with a mission; needed with years"
    )
    pack: Price = Field(
        0.0,
        description="price of a battery pack that replaces a worn one, with years; uav includes "
        "the first one",
    )
    pack_cycles: Number = Field(
        300.0,
        ge=1,
        le=1_000_000,
        description="how often a battery pack can be emptied before it is worn, with years",
    )

    @model_validator(mode="after")
    def _is_of_a_year_or_of_missions(self) -> Self:
        if self.years is None:
            for field in _OF_A_YEAR:
                self._refuse_if_given(field, "is given without years", "with years")
        else:
            self._refuse_if_given("missions", "is given beside years", "days instead")
        return self

    def _refuse_if_given(self, field: str, problem: str, allowed: str) -> None:
        if getattr(self, field) != type(self).model_fields[field].default:
            raise InputError(field, problem, allowed)

    def check(self, spaces: Sequence[ScenarioSpace]) -> None:
        """Check that the length of a slot and the missions of a year are known where they are paid.

        Raises:
            InputError: If one is not, or is given although it follows from a data sheet or weather.
        """
        if any(space.weather.is_on for space in spaces):
            if self.days is not None:
                raise InputError("costs: days", "follows from the weather", "without this field")
        elif self.years is not None and self.days is None:
            allowed = "with years, the missions of a year: 1..365"
            raise InputError("costs: days", "is missing", allowed)
        follows = any(space.units for space in spaces)
        where = "costs.slot_seconds"
        if follows and self.slot_seconds is not None:
            raise InputError(where, "follows from the data sheet", "without this field")
        if self.hour and self.slot_seconds is None and not follows:
            raise InputError(where, "is missing", "with hour, the seconds of a slot")

    @property
    def pays_for_missions(self) -> bool:
        """Whether missions have a price, not the purchase alone."""
        return any((self.charge, self.hour, self.pays_for_losses, self.pack))

    @property
    def pays_for_losses(self) -> bool:
        """Whether a lost UAV costs anything."""
        if self.lost_uav is not None:
            return self.lost_uav > 0
        plans_missions = self.years is not None or self.missions > 1
        return plans_missions or any((self.charge, self.hour, self.pack))

    @property
    def unit(self) -> str:
        """What costs are in: the currency, or the currency a year."""
        if self.years is None:
            return self.currency
        return f"{self.currency} a year"

    @property
    def paid_parts(self) -> set[str]:
        """The parts of ``part_names`` that have a price, beside the purchase."""
        prices = {"packs": self.pack, "charging": self.charge, "hours": self.hour}
        prices["losses"] = float(self.pays_for_losses)
        return {part for part, price in prices.items() if price}

    @property
    def part_names(self) -> tuple[str, ...]:
        """What costs consist of."""
        if self.years is None:
            return PARTS
        return PARTS_OF_A_YEAR

    @property
    def paid_missions(self) -> int:
        """The number of missions that are paid for: those that are planned, or those of a year."""
        return self.days or self.missions

    @property
    def annuity_in_words(self) -> str:
        """Over how many years UAVs and pads are paid off, and at what interest."""
        years = self.years or 0.0
        return (
            f"UAVs and pads are paid off over {years:g} {numbers.inflect('year', years)} at "
            f"{100 * self.interest:g} % interest"
        )

    def amounts_on(self, spaces: Sequence[ScenarioSpace]) -> dict[str, str]:
        """What everything that may have a price costs, in words; empty if nothing is paid for it.

        Args:
            spaces: The scenario of every design point; their types of UAVs may have prices.
        """
        amounts = {
            f"a UAV of type {number}": numbers.format_money(kind.price, self.currency)
            for space in spaces
            for number, kind in enumerate(space.fleet, 1)
            if kind.price is not None
        }
        for price, thing in _PAID_FOR.items():
            value = getattr(self, price)
            is_of_types = price == "uav" and all(_prices_all_uavs(space) for space in spaces)
            is_of_a_year = price in _OF_A_YEAR
            if is_of_types or (is_of_a_year and self.years is None):
                continue
            if price == "hour" and any(space.weather.is_on for space in spaces):
                thing = "an hour of a window"
            amounts[thing] = ""
            if value:
                amounts[thing] = numbers.format_money(value, self.currency)
            elif price == "lost_uav" and self.pays_for_losses:
                amounts[thing] = "what it was bought for"
        return amounts

    def price_of_uavs(self, space: ScenarioSpace, uavs: int) -> float:
        """What the first UAVs of a scenario and its spares cost.

        The price of a type replaces ``uav``; a spare costs as much as the most expensive UAV.
        """
        spares = space.data_sheet.spares
        if not has_priced_types(space):
            return self.uav * (uavs + spares)
        prices = self.prices_of_uavs(space, uavs)
        return sum(prices) + spares * max(prices, default=self.uav)

    def prices_of_uavs(self, space: ScenarioSpace, uavs: int) -> list[float]:
        """What each of the first UAVs of a scenario costs."""
        prices = [type_of(space.fleet, uav).price for uav in range(uavs)]
        return [self.uav if price is None else price for price in prices]

    def price_of_fleet(self, space: ScenarioSpace) -> float:
        """What the largest fleet of a scenario and its pads cost when they are bought."""
        return self.price_of_uavs(space, space.uavs[1]) + self.pad * space.charging_pads

    def purchase_of(self, price_of_uavs: Any, pads: Any) -> Any:
        """What UAVs and pads cost: once, or in each of the years over which they are paid off.

        The amount of a year is an annuity, ``P r (1 + r)^n / ((1 + r)^n - 1)``.

        Args:
            price_of_uavs: The price of all UAVs together.
            pads: The number of pads.
        """
        interest, worth = self.annuity
        return (price_of_uavs + self.pad * pads) * interest / worth

    @property
    def annuity(self) -> tuple[float, float]:
        """By what a purchase is multiplied, and then divided, for the amount of a year.

        Both are 1 where UAVs and pads are bought once.
        """
        if self.years is None:
            return 1.0, 1.0
        if self.interest == 0:
            return 1.0, self.years
        return self.interest, -math.expm1(-self.years * math.log1p(self.interest))

    def prices_of_lost_uavs(self, space: ScenarioSpace, uavs: int) -> list[float]:
        """What it costs to lose each of the first UAVs of a scenario."""
        if not self.pays_for_losses:
            return [0.0] * uavs
        if self.lost_uav is not None:
            return [self.lost_uav] * uavs
        return self.prices_of_uavs(space, uavs)

    def loss_of_fleets(self, space: ScenarioSpace) -> float:
        """What it costs if every mission loses the largest fleet of a scenario, in the currency."""
        return self.paid_missions * sum(self.prices_of_lost_uavs(space, space.uavs[1]))

    def most_running(
        self, spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any]
    ) -> np.ndarray:
        """The most that missions may cost beside the purchase, in the currency.

        All UAVs are in the air until the longest mission ends, and are lost.

        Args:
            spaces: The scenario of every design point.
            missions: (n,) columns of the missions: ``point`` and ``uavs``.
        """
        points = np.asarray(missions["point"])
        slots = np.array([space.longest_slots for space in spaces])
        hours = slots * [self.seconds_per_slot(space) / 3600 for space in spaces]
        spent = slots * [most_battery_per_slot(space) for space in spaces]
        smallest_packs = [min(full_packs_of(space, space.uavs[1])) for space in spaces]
        packs = spent / smallest_packs / self.pack_cycles
        lost = np.array([max(self.prices_of_lost_uavs(space, space.uavs[1])) for space in spaces])
        of_uav = lost + self.charge * spent / 100 + self.pack * packs
        of_fleet = of_uav[points] * np.asarray(missions["uavs"])
        return self.paid_missions * (of_fleet + self.hour * hours[points])

    def seconds_per_slot(self, space: ScenarioSpace) -> float:
        """The length of a slot [s]; 0 where it is not known."""
        if space.units:
            return space.units.slot
        return self.slot_seconds or 0.0

    def parts(
        self, spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any], uavs: Mapping[str, Any]
    ) -> dict[str, np.ndarray]:
        """The parts of the cost of every mission, in the currency.

        Args:
            spaces: The scenario of every design point.
            missions: (n,) columns of the missions: ``point`` and the fields of ``MISSION_RECORD``.
            uavs: Columns of the UAVs of these missions, in the same order: ``charged``, ``down``
                and ``battery`` of ``UAV_RECORD``.

        Returns:
            The (n,) amounts of each of ``part_names``.

        Raises:
            InputError: If charging, packs or lost UAVs have a price, and results of before lack
                what was charged and lost.
        """
        fleet = np.asarray(missions["uavs"])
        points = np.asarray(missions["point"])
        mission = np.repeat(np.arange(len(fleet)), fleet)
        pads = np.array([space.charging_pads for space in spaces])
        price_of_battery = self.charge or self.pack
        charged: np.ndarray = np.zeros(len(fleet))
        if price_of_battery:
            charged = np.bincount(mission, _recorded(uavs, "charged"), len(fleet))
        losses: np.ndarray = np.zeros(len(fleet))
        if self.pays_for_losses:
            prices = self._prices_of_losses(spaces, missions)
            losses = np.bincount(mission, prices * _recorded(uavs, "down"), len(fleet))
        seconds = [self.seconds_per_slot(space) for space in spaces]
        hours = np.asarray(missions["slots"]) * np.array(seconds)[points] / 3600
        of_uavs = self._prices_of_fleets(spaces, points, fleet)
        amounts = {PURCHASE: self.purchase_of(of_uavs, pads[points])}
        if self.years is not None:
            emptied: np.ndarray = np.zeros(len(fleet))
            if price_of_battery:  # the recharge after the mission is paid for, too
                spent = spent_battery(spaces, missions, uavs)
                charged = np.bincount(mission, spent, len(fleet))
                emptied = np.bincount(mission, spent / _full_packs(spaces, missions), len(fleet))
            amounts[PACKS] = self.paid_missions * self.pack * emptied / self.pack_cycles
        return amounts | {
            "charging": self.paid_missions * self.charge * charged / 100,
            "hours": self.paid_missions * self.hour * hours,
            "losses": self.paid_missions * losses,
        }

    def _prices_of_fleets(
        self, spaces: Sequence[ScenarioSpace], points: np.ndarray, fleet: np.ndarray
    ) -> np.ndarray:
        """(n,) what the UAVs of every mission cost together."""
        prices = self.uav * fleet
        for point, space in enumerate(spaces):
            if has_priced_types(space) or space.data_sheet.spares:
                totals = [self.price_of_uavs(space, uavs) for uavs in range(space.uavs[1] + 1)]
                at_point = points == point
                prices[at_point] = np.array(totals)[fleet[at_point]]
        return prices

    def _prices_of_losses(
        self, spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any]
    ) -> np.ndarray:
        """(u,) what it costs to lose each UAV of the missions."""
        most = max(space.uavs[1] for space in spaces)
        prices = np.array([self.prices_of_lost_uavs(space, most) for space in spaces])
        return prices[_places_of_uavs(missions)]


def _recorded(uavs: Mapping[str, Any], field: str) -> np.ndarray:
    """(u,) a field of the records of UAVs.

    Raises:
        InputError: If records of before lack it.
    """
    if field not in uavs or np.isnan(np.asarray(uavs[field], float)).any():
        raise InputError(
            "costs",
            f"the records of an earlier version have no {field}, which has a price",
            "results of this version, in another results folder",
        )
    return np.asarray(uavs[field])


def has_priced_types(space: ScenarioSpace) -> bool:
    """Whether a type of UAVs of a scenario has a price of its own."""
    return any(kind.price is not None for kind in space.fleet)


def _prices_all_uavs(space: ScenarioSpace) -> bool:
    """Whether all types of UAVs of a scenario have prices of their own."""
    return has_priced_types(space) and all(kind.price is not None for kind in space.fleet)


def most_battery_per_slot(space: ScenarioSpace) -> float:
    """The most that a slot in the air takes of a battery [%]."""
    energy = energy_constants(space.consumption, space.wind, space.size, slowest(space.fleet))
    return float(space.flight_cost * energy["max_slot_cost"] / PERCENT)


def spent_battery(
    spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any], uavs: Mapping[str, Any]
) -> np.ndarray:
    """(u,) the battery that each UAV has spent in the air [%].

    It is what it had at the start and what was charged, without what is left at the end.

    Args:
        spaces: The scenario of every design point.
        missions: As in ``Costs.parts``.
        uavs: As in ``Costs.parts``.
    """
    types = types_of_uavs(spaces, missions)
    drawn = np.repeat(np.asarray(missions["flying_time"]), np.asarray(missions["uavs"]))
    start = np.where(types["battery"] > 0, types["battery"], drawn)
    limit = types["charge_complete"].astype(np.int64)
    start = np.where(limit > 0, np.minimum(start, limit), start)
    return start + np.asarray(uavs["charged"]) - np.asarray(uavs["battery"])


def types_of_uavs(spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any]) -> np.ndarray:
    """(u,) records of ``dess.model.state.types_of`` of the UAVs of all missions.

    Args:
        spaces: The scenario of every design point.
        missions: As in ``Costs.parts``.
    """
    most = max(space.uavs[1] for space in spaces)
    return np.stack([types_of(space, most) for space in spaces])[_places_of_uavs(missions)]


def _full_packs(spaces: Sequence[ScenarioSpace], missions: Mapping[str, Any]) -> np.ndarray:
    """(u,) the full battery of each UAV, its reserve included [%]."""
    most = max(space.uavs[1] for space in spaces)
    packs = np.array([full_packs_of(space, most) for space in spaces])
    return packs[_places_of_uavs(missions)]


def full_packs_of(space: ScenarioSpace, uavs: int) -> list[float]:
    """The full battery of each of the first UAVs of a scenario, its reserve included [%]."""
    if not space.units:
        return [100.0] * uavs
    kinds = [type_of(space.fleet, uav) for uav in range(uavs)]
    return [100 * float(space.data_sheet.share_of_type(kind)) for kind in kinds]


def _places_of_uavs(missions: Mapping[str, Any]) -> tuple[np.ndarray, np.ndarray]:
    """(u,) the design points of the UAVs of all missions, and their numbers in their missions."""
    fleet = np.asarray(missions["uavs"])
    first = np.repeat(np.cumsum(fleet) - fleet, fleet)
    return np.repeat(np.asarray(missions["point"]), fleet), np.arange(fleet.sum()) - first


def stranded_uavs(uavs: Mapping[str, Any]) -> np.ndarray:
    """(u,) whether UAVs that are not lost have no battery for their way home, by ``UAV_RECORD``.

    Where missions do not end on the ground, this is not paid for.
    """
    is_short = np.asarray(uavs["battery"]) < np.asarray(uavs["way_home"])
    return is_short & (np.asarray(uavs["down"]) == 0)
