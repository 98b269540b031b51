"""The most data and the strongest wind that a fleet bears, found by bisection."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from dess.analysis.ask.limits import LEAST_WIND, PLACES, SHEET, Limit
from dess.analysis.ask.tried_fleet import Trial, TriedFleet
from dess.analysis.stats.verdict import Verdict
from dess.scenario.quantities import measured, rounded, times, unit_of

CLOSE = 0.05  # the width of the last interval, as a share of its end
MOST_DATA = 8.0  # times the data of the sheet


@dataclass
class Bisection:
    """The search for the largest value of a condition with which nothing breaks.

    Attributes:
        low: The largest value known to be borne.
        high: The least known to be too hard; before ``is_tried``, the largest that is tried.
        floor: Where ``low`` is 0, the least value that is tried; 0 to halve the interval.
        is_tried: Whether ``high`` was tried.
        broken: What breaks at ``high``.
    """

    low: float
    high: float
    floor: float = 0.0
    is_tried: bool = False
    broken: str = ""

    @property
    def value(self) -> float | None:
        """The value to try next; None if the limit is known."""
        if not self.is_tried:
            return self.high
        if self.broken == "" or self.high - self.low <= CLOSE * self.high:
            return None
        if self.low > 0:
            middle = math.sqrt(self.low * self.high)
        elif self.floor > 0:
            middle = self.floor
        else:
            middle = self.high / 2
        value = _shortest_number(middle, self.low, self.high)
        if self.low < value < self.high:
            return value
        return None

    def learn(self, value: float, broken: str) -> None:
        """Take into account what breaks at a value; empty if nothing does."""
        if not self.is_tried:
            self.is_tried = True
            self.broken = broken
            if broken == "":
                self.low = value
        elif broken:
            self.high = value
            self.broken = broken
        else:
            self.low = value


def _shortest_number(value: float, low: float, high: float) -> float:
    """A number near a value with few digits, well inside of an interval if two digits do."""
    short = float(f"{value:.2g}")
    if 0.75 * low + 0.25 * value < short < 0.75 * high + 0.25 * value:
        return short
    return float(f"{value:.3g}")


def digits_of_limit(trials: Mapping[float, Trial], broken: str) -> int:
    """The digits of a limit that trials tell, by the values at which a metric surely breaks or not.

    Args:
        trials: The trials of the values.
        broken: The metric.
    """
    if broken in ("", SHEET):
        return 3
    kept = [0.0]
    missed = [math.inf]
    for value, trial in trials.items():
        if broken in trial.margins:
            verdict = trial.judge(broken)
            if verdict == Verdict.MET:
                kept.append(value)
            elif verdict == Verdict.MISSED:
                missed.append(value)
    if min(missed) - max(kept) <= 2 * CLOSE * min(missed) < math.inf:
        return 2
    return 1


def find_most_data(fleet: TriedFleet, rate: str | tuple[str, ...]) -> Limit:
    """The most data for which the fleet is good enough, up to ``MOST_DATA`` times the sheet's."""

    def multiply(factor: float) -> Any:
        if isinstance(rate, str):
            return times(rate, factor)
        return [times(rate_of_node, factor) for rate_of_node in rate]

    def change(factor: float) -> dict[str, Any]:
        return {"data_sheet.data_rate": multiply(factor)}

    search = Bisection(1.0, MOST_DATA)
    trials = {}
    while (factor := search.value) is not None:
        [trials[factor]] = fleet.try_changes([change(factor)])
        search.learn(factor, trials[factor].broken)
    digits = digits_of_limit(trials, search.broken)
    present = "the listed rates"
    last = present
    if isinstance(rate, str):
        present = rate
        last = max(rate, rounded(multiply(search.low), digits), key=_bits_per_second)
    elif search.low > 1:
        last = f"{rounded(f'{search.low:g} times', digits)} the listed rates"
    small_zone = ""
    if search.broken == "success":
        small_zone = fleet.small_zone_of_losses(change(search.high))
    return Limit(
        field="data_sheet.data_rate",
        present=present,
        last=last,
        harder=search.low,
        broken=search.broken,
        is_rough=digits == 1,
        small_zone=small_zone,
    )


def _bits_per_second(rate: str) -> float:
    return measured(rate, "bit/s")[0]


def find_strongest_wind(fleet: TriedFleet) -> Limit:
    """The strongest wind for which the fleet is good enough, from the worst of ``PLACES``.

    It is no stronger than what UAVs can fly in from all of them.
    """

    def wind(speed: float, place: str) -> dict[str, Any]:
        return {"data_sheet.wind": f"{speed:g} m/s from {place}"}

    sheet = fleet.space.data_sheet
    strongest = {
        place: sheet.strongest_wind(360 / len(PLACES) * number)
        for number, place in enumerate(PLACES)
    }
    worst = min(strongest, key=strongest.__getitem__)
    search = Bisection(0.0, strongest[worst], LEAST_WIND)
    places = PLACES
    trials = {}
    while (speed := search.value) is not None:
        winds = [wind(speed, place) for place in places]
        trial_of = dict(zip(places, fleet.try_changes(winds), strict=True))
        hardest = min(places, key=lambda place: trial_of[place].room)
        trials[speed] = trial_of[hardest]
        search.learn(speed, trials[speed].broken)
        if trials[speed].broken:  # wind from the other places may be stronger than this
            places = [place for place in places if trial_of[place].broken]
            worst = hardest
    digits = digits_of_limit(trials, search.broken)
    last = ""
    if search.low > 0:
        speed_in_unit, unit = in_unit_of(sheet.wind or "1 m/s from N", search.low, "m/s from deg")
        last = rounded(f"{speed_in_unit:.12g} {unit} from {worst}", digits)
    harder = 0.0
    if sheet.wind:
        present, _ = measured(sheet.wind, "m/s from deg")
        harder = search.low / max(present, 0.01)
    small_zone = ""
    if search.broken == "success":
        small_zone = fleet.small_zone_of_losses(wind(search.high, worst))
    return Limit(
        field="data_sheet.wind",
        present=sheet.wind or "",
        last=last,
        harder=harder,
        broken=search.broken or SHEET,
        is_rough=digits == 1,
        small_zone=small_zone,
    )


def in_unit_of(text: str, value: float, units: str) -> tuple[float, str]:
    """A value in the unit in which a quantity was typed, and this unit.

    Args:
        text: The quantity.
        value: The value in the first unit of ``units``.
        units: What the quantity is measured in, of ``quantities.KINDS``.
    """
    unit = unit_of(text, units)
    size = measured(f"1 {unit}", units.split(" ")[0])[0]
    return value / size, unit
