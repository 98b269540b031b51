"""The sun: elevations and lengths of days against published ones."""

import numpy as np
import pytest

from dess.scenario.weather.sun import is_light, sine_of_elevation

DAY_LENGTHS = {
    ("2020-06-21", 0.0): 12.12,
    ("2020-12-21", 0.0): 12.12,
    ("2020-06-21", 53.5): 17.05,
    ("2020-12-21", 53.5): 7.47,
    ("2020-06-21", 70.0): 24.0,
    ("2020-12-21", 70.0): 0.0,
    ("2020-06-21", -53.5): 7.47,
}


def elevation(times, latitude: float, longitude: float) -> np.ndarray:
    """(N,) the solar elevations [degrees]."""
    return np.degrees(np.arcsin(sine_of_elevation(times, latitude, longitude)))


def minutes_of(day: str) -> np.ndarray:
    return np.datetime64(day, "m") + np.arange(24 * 60)


@pytest.mark.parametrize("longitude", [0.0, 5.0])
@pytest.mark.parametrize(("day", "latitude"), DAY_LENGTHS)
def test_days_are_as_long_as_an_almanac_says(day, latitude, longitude):
    hours = is_light(minutes_of(day), latitude, longitude).sum() / 60
    assert hours == pytest.approx(DAY_LENGTHS[day, latitude], abs=0.03)


def test_the_elevation_is_that_of_the_example_of_the_solar_position_algorithm():
    """I. Reda, A. Andreas, Solar Energy 76(5), 2004: Golden, Colorado, without refraction."""
    [found] = elevation(np.array(["2003-10-17T19:30:30"], "datetime64[s]"), 39.742476, -105.1786)
    assert found == pytest.approx(39.872, abs=0.01)


def test_the_sun_is_overhead_at_noon_of_the_solstice_on_the_tropic():
    """The equation of time is -1.8 min on 21 June: noon is then at 12:01:50 of Greenwich."""
    heights = elevation(minutes_of("2020-06-21"), 23.43, 0.0)
    assert heights.max() == pytest.approx(90, abs=0.15)
    assert abs(int(heights.argmax()) - (12 * 60 + 1.8)) <= 1


def test_a_place_further_west_has_its_noon_later():
    for longitude, minutes in ((-72.5, 290), (30.0, -120)):
        greenwich = elevation(minutes_of("2020-03-01"), 40.0, 0.0).argmax()
        there = elevation(minutes_of("2020-03-01"), 40.0, longitude).argmax()
        assert there - greenwich == pytest.approx(minutes, abs=1)
