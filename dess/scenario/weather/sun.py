"""Where the sun stands, by the formulas of NOAA's solar calculator (after J. Meeus).

They hold to a hundredth of a degree in the years 1901 to 2099. All functions are elementary ones
that give the same bits on every machine.
"""

import math

import numpy as np

from dess.base.elementary import cos, sin, sqrt

# The solar elevation [degrees] above which it is light: refraction, and half of the sun's disc.
SUNRISE = -0.833
_NOON_2000 = np.datetime64("2000-01-01T12:00:00")
_DAY, _CENTURY = 86_400, 36_525 * 86_400  # [s]


def is_light(times: np.ndarray, latitude: float, longitude: float) -> np.ndarray:
    """(N,) whether the sun stands above ``SUNRISE``; see ``sine_of_elevation``."""
    least = sin(math.radians(SUNRISE))
    return np.asarray(sine_of_elevation(times, latitude, longitude) > least)


def sine_of_elevation(times: np.ndarray, latitude: float, longitude: float) -> np.ndarray:
    """(N,) the sines of the solar elevations, without refraction.

    Args:
        times: (N,) times [UTC], as ``datetime64``.
        latitude: The latitude [degrees].
        longitude: The longitude, to the east [degrees].
    """
    since = (times.astype("datetime64[s]") - _NOON_2000).astype(np.int64)
    sine, equation = _declination(since / _CENTURY)
    of_day = (since + _DAY // 2) % _DAY
    # The hour angle [degrees]: 0 at noon, by the sun.
    turned = of_day / 240 + equation + longitude - 180
    latitude = math.radians(latitude)
    cosine = sqrt(1 - sine * sine)
    return sin(latitude) * sine + cos(latitude) * cosine * cos(np.radians(turned))


def _declination(c: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The sine of the declination, and the equation of time [degrees], at centuries from 2000."""
    mean = np.radians((280.46646 + c * (36000.76983 + c * 0.0003032)) % 360)
    anomaly = np.radians((357.52911 + c * (35999.05029 - 0.0001537 * c)) % 360)
    eccentricity = 0.016708634 - c * (0.000042037 + 0.0000001267 * c)
    sine, double = sin(anomaly), sin(2 * anomaly)
    centre = (
        sine * (1.914602 - c * (0.004817 + 0.000014 * c))
        + double * (0.019993 - 0.000101 * c)
        + sin(3 * anomaly) * 0.000289
    )
    node = np.radians(125.04 - 1934.136 * c)
    longitude = mean + np.radians(centre - 0.00569 - 0.00478 * sin(node))
    seconds = 21.448 - c * (46.815 + c * (0.00059 - c * 0.001813))
    obliquity = np.radians(23 + (26 + seconds / 60) / 60 + 0.00256 * cos(node))
    sine_of_obliquity = sin(obliquity)
    tangent = sine_of_obliquity / (1 + cos(obliquity))  # of its half
    y = tangent * tangent
    of_mean = sin(2 * mean)
    cosine_of_mean = cos(2 * mean)
    equation = np.degrees(
        y * of_mean
        - 2 * eccentricity * sine
        + 4 * eccentricity * y * sine * cosine_of_mean
        - y * y * of_mean * cosine_of_mean
        - 1.25 * eccentricity * eccentricity * double
    )
    return sine_of_obliquity * sin(longitude), equation
