"""The power of a rotary wing at an airspeed, and the wind that it can fly in.

    >>> wing = RotaryWing()
    >>> wing.power(15.0) < wing.power(0.0) < wing.power(30.0)      # hovering, in still air
    True

The power is that of Zeng, Xu and Zhang, "Energy minimization for wireless communication with
rotary-wing UAV", IEEE Trans. Wireless Commun. 18(4), 2019, eq. 12, as a share of the power that
hovering takes in still air.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from dess.base.elementary import cos, sin, sqrt
from dess.physics.energy import ACTIONS, HOVERING

# Shares of the power of the blades' profile and of the induced power when hovering, and the drag of
# the fuselage [(m/s)^-3] of the UAV in that paper.
BLADES, INDUCED, DRAG = 0.474, 0.526, 5.48e-5
TIP_SPEED, INDUCED_SPEED = 120.0, 4.03  # [m/s]

# The courses of the moves north, east, south and west [degrees].
COURSES = (0, 90, 180, 270)


class RotaryWing(NamedTuple):
    """A rotary wing.

    Attributes:
        tip_speed: The speed of the rotor's tips [m/s].
        induced_speed: The mean speed of the air through the rotor when hovering [m/s].
        drag: What the fuselage takes [(m/s)^-3].
    """

    tip_speed: float = TIP_SPEED
    induced_speed: float = INDUCED_SPEED
    drag: float = DRAG

    def power(self, airspeed: Any) -> Any:
        """The power at an airspeed [m/s], or at each, as a share of hovering in still air."""
        return self.power_without_drag(airspeed) + self.drag * airspeed * airspeed * airspeed

    def power_without_drag(self, airspeed: Any) -> Any:
        """The power at an airspeed [m/s] without the drag of the fuselage."""
        of_tips = (airspeed / self.tip_speed) * (airspeed / self.tip_speed)
        # The difference of the paper's equation in a form that does not cancel at high speeds.
        half = (airspeed / self.induced_speed) * (airspeed / self.induced_speed) / 2
        of_inflow = 1 / (sqrt(1 + half * half) + half)
        return BLADES * (1 + 3 * of_tips) + INDUCED * sqrt(of_inflow)

    def climbing_power(self, rate: float) -> float:
        """The power of a climb at a rate [m/s], as a share of that of hovering in still air.

        By momentum theory the flow through the rotor is ``c / 2 + sqrt(c^2 / 4 + v0^2)`` with the
        induced speed v0 of hovering (Leishman, Principles of Helicopter Aerodynamics, 2nd edition,
        section 2.13). That of the blades stays as it is.
        """
        half = rate / (2 * self.induced_speed)
        return BLADES + INDUCED * (half + math.sqrt(half * half + 1))

    def with_power(self, airspeed: float, power: float) -> "RotaryWing":
        """The same with the drag of which the power at an airspeed [m/s] follows."""
        drag = (power - self.power_without_drag(airspeed)) / (airspeed * airspeed * airspeed)
        return self._replace(drag=drag)


def airspeed_along(course: float, speed: float, wind: Any, direction: Any) -> Any:
    """The airspeed [m/s] of a UAV that flies along a course at a ground speed.

    Args:
        course: The course [degrees from north, clockwise].
        speed: The ground speed [m/s].
        wind: The wind [m/s], or an array of winds.
        direction: Where it comes from [degrees from north, clockwise], or an array.
    """
    turned = direction - course
    angle = np.radians(turned) if isinstance(turned, np.ndarray) else math.radians(turned)
    ahead = speed + wind * cos(angle)
    beside = wind * sin(angle)
    return sqrt(ahead * ahead + beside * beside)


def airspeeds_of(speed: float, wind: np.ndarray, direction: np.ndarray) -> np.ndarray:
    """(N, 5) the airspeeds [m/s] of the moves at a ground speed and of hovering, in N winds.

    Args:
        speed: The ground speed of the moves [m/s].
        wind: (N,) the winds [m/s].
        direction: (N,) where they come from [degrees from north, clockwise].
    """
    airspeeds = np.empty((len(wind), ACTIONS))
    for action, course in enumerate(COURSES):
        airspeeds[:, action] = airspeed_along(course, speed, wind, direction)
    airspeeds[:, HOVERING] = wind
    return airspeeds


def largest_speed(other: float, direction: float, most: float) -> float:
    """The largest wind in which all four moves are possible at a cruising speed, or vice versa.

    The one that is looked for and the other one stand for each other in the condition: with k, the
    larger of the sine and the cosine of the wind's direction, it is w^2 + v^2 + 2 v w k <= A^2.

    Args:
        other: The cruising speed, or the wind [m/s].
        direction: Where the wind comes from [degrees].
        most: The largest airspeed A [m/s].
    """
    angle = math.radians(direction)
    along = max(abs(sin(angle)), abs(cos(angle)))
    within = other * other * along * along + most * most - other * other
    return math.sqrt(max(within, 0.0)) - other * along
