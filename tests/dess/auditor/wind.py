"""The wind: what a move against it costs is taken from the log, and must be possible."""

import math
from collections.abc import Mapping
from typing import Any

from tests.dess.auditor.log import Log

LARGEST_DEVIATE = 6.34  # of a gust, in standard deviations


class Wind:
    """The surcharges that have been seen: the field does not change in a mission."""

    def __init__(self, log: Log, constants: Mapping[str, Any]):
        self.log, self.cost = log, constants["flight_cost"]
        wind = constants.get("wind", {"strength": 0.0, "direction": 0.0, "gusts": 0.0})
        comes_from = math.radians(wind["direction"])
        self.push = (
            -wind["strength"] * math.sin(comes_from),
            wind["strength"] * math.cos(comes_from),
        )
        self.reach = LARGEST_DEVIATE * wind["gusts"]
        self.seen: dict[tuple[int, ...], int] = {}

    def battery_after(self, before: int, after: int, x: int, y: int, step: tuple[int, int]) -> int:
        """The battery after the surcharge of a move, as the log has it.

        Args:
            before: Battery without the surcharge.
            after: Battery as in the log.
            x, y: The cell that the move leads to.
            step: The step of the move.
        """
        against = -(self.push[0] * step[0] + self.push[1] * step[1])
        least = math.floor(max(against - self.reach + 1e-9, 0.0))
        most = math.ceil(max(against + self.reach - 1e-9, 0.0)) if self.cost else 0
        extra, opposite = before - after, (x, y, -step[0], -step[1])
        if after == 0:  # the battery did not suffice for the rest of the surcharge
            self.log.require(extra <= most, "the wind cannot cost that much")
            return after
        known = self.seen.setdefault((x, y, *step), extra)
        self.log.require(min(least, most) <= extra <= most, "the wind cannot cost that")
        self.log.require(extra == known, "the wind has changed")
        self.log.require(extra == 0 or self.seen.get(opposite, 0) == 0, "wind from both sides")
        return after
