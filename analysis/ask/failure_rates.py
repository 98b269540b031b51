"""The most frequent failures that a fleet bears.

Failures are rare: the means at any rate follow from missions without failures and from missions
with many, each weighed by how likely it is at that rate.
"""

import math
from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from dess.analysis.ask.bisection import CLOSE, in_unit_of
from dess.analysis.ask.limits import FAILURES, Limit
from dess.analysis.ask.tried_fleet import Flights, Trial, TriedFleet
from dess.analysis.stats.worst_node import worst_node
from dess.scenario.quantities import measured, rounded

RAREST = 1e-8  # failures that never happen [1/h of flying]
_MORE_FAILURES = 3  # times as many as those that are borne


@dataclass(frozen=True)
class FailureModel:
    """The means of metrics at any rate of failures.

    A mission has no failure with probability exp(-rate * hours), and is then one of ``unfailed``.
    If it has some, it is one of those of ``failing`` that have, weighed by their likelihood ratio.

    Attributes:
        unfailed: Missions without failures.
        failing: The same missions with frequent failures.
    """

    unfailed: Flights
    failing: Flights

    def mean(self, column: str, rate: float) -> float:
        """The mean of a metric at a rate [1/h of flying]; of the worst node, if it is of one."""
        chances = np.exp(-rate * self.unfailed.hours)
        means = np.mean(chances[:, None] * self.unfailed.values(column), axis=0)
        has_failed = self.failing.failures > 0
        if has_failed.any():
            failures = self.failing.failures[has_failed]
            hours = self.failing.hours[has_failed]
            logarithms = failures * math.log(rate / self.failing.rate)
            logarithms -= (rate - self.failing.rate) * hours
            weights = np.exp(logarithms - logarithms.max())
            values = self.failing.values(column)[has_failed]
            means += (1 - chances.mean()) * np.average(values, axis=0, weights=weights)
        return float(means[worst_node(means, column)])

    def without(self, row: int) -> "FailureModel":
        """The same without one of the missions."""
        return FailureModel(self.unfailed.without(row), self.failing.without(row))


def find_most_failures(fleet: TriedFleet) -> Limit:
    """The most frequent failures for which the fleet is good enough."""
    sheet = fleet.space.data_sheet
    present = RAREST
    if sheet.mtbf:
        present = 3600 / measured(sheet.mtbf, "s")[0]
    least = max(FAILURES[0], present)
    most = min(max(FAILURES[1], 2 * present), 3600 / sheet.units.slot)

    def trial(model: FailureModel, rate: float) -> Trial:
        changes = {}
        for requirement in fleet.requirements:
            column = requirement.column
            changes[column] = model.mean(column, rate) - model.mean(column, present)
        return Trial(fleet.margins_after(changes))

    unfailed = fleet.fly_with_failures(RAREST)
    rate = min(max(1 / max(unfailed.hours.mean(), RAREST), 2 * least), most)  # one in a mission
    model = FailureModel(unfailed, fleet.fly_with_failures(rate))
    while rate < most and not trial(model, rate).broken:
        rate = min(_MORE_FAILURES * rate, most)
        model = FailureModel(unfailed, fleet.fly_with_failures(rate))

    limit = rate
    broken = trial(model, rate).broken
    digits = 3
    last = ""
    if trial(model, least).broken:
        limit = least
        broken = trial(model, least).broken
        if sheet.mtbf:
            last = sheet.mtbf
    else:
        if broken:
            exponent = brentq(
                lambda exponent: trial(model, math.exp(exponent)).room,
                math.log(least),
                math.log(rate),
            )
            limit = math.exp(exponent)
            broken = trial(model, 1.001 * limit).broken
            digits = _digits_of_rate(model, broken, limit)
        mean_time, unit = in_unit_of(sheet.mtbf or "1 h", 3600 / limit, "s")
        last = rounded(f"{mean_time:.6g} {unit}", digits, is_up=True)
        if sheet.mtbf:
            last = min(last, sheet.mtbf, key=_seconds)
    harder = 0.0
    if sheet.mtbf:
        harder = limit / present
    return Limit(
        field="data_sheet.mtbf",
        present=sheet.mtbf or "",
        last=last,
        harder=harder,
        broken=broken,
        is_rough=digits == 1,
    )


def _digits_of_rate(model: FailureModel, broken: str, rate: float) -> int:
    """The digits that missions tell of the rate at which a metric breaks, by the jackknife."""
    missions = len(model.unfailed.hours)
    means = [model.without(row).mean(broken, rate) for row in range(missions)]
    error = 1.96 * np.std(means) * math.sqrt(missions - 1)
    change = 0.01  # of the rate
    slope = (model.mean(broken, (1 + change) * rate) - model.mean(broken, rate)) / change
    if error <= 0.2 * CLOSE * abs(slope):
        return 3
    if error <= 2 * CLOSE * abs(slope):
        return 2
    return 1


def _seconds(time: str) -> float:
    return measured(time, "s")[0]
