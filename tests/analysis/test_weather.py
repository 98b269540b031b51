"""What hourly weather leaves to UAVs, counted by hand."""

import numpy as np
import pytest

from dess import load_scenario
from dess.analysis.weather import weather_facts, weather_lines


@pytest.fixture
def sea(tmp_path):
    """A function that loads jade-bight with a wind an hour from 2020-01-01T00 UTC on."""

    def load(winds, **weather):
        hours = np.datetime64("2020-01-01T00") + np.arange(len(winds)) * np.timedelta64(1, "h")
        lines = [f"{hour}:00,{wind},45" for hour, wind in zip(hours, winds, strict=True)]
        path = tmp_path / "weather.csv"
        path.write_text("\n".join(["time,wind,from", *lines]))
        return load_scenario("jade-bight", weather={"file": str(path), **weather})

    return load


def test_a_year_of_days_that_begin_in_calm(sea):
    """Every day has 8 open hours, a window of 6 and one of 2, and 16 h of storm."""
    days = [[5] * 8 + [20] * 16] * 366
    space = sea(np.concatenate(days), longitude=0)
    facts = weather_facts(space)
    assert (facts["hours"], facts["years"]) == (366 * 24, [2020])
    assert facts["shares"] == pytest.approx(
        {"open": 1 / 3, "night": 0, "missing": 0, "wind": 2 / 3}
    )
    assert (facts["windows"], facts["longest_gap_h"]) == (732, {"median": 16, "largest": 16})
    assert weather_lines(space) == [
        "weather: 8,784 hours with 1 whole year, 2020",
        "33.3 % of the hours are open, 66.7 % too windy to fly",
        "of the operating hours 33.3 % are open: 732 windows of at most 6 h; the longest gap is "
        "16 h",
    ]


def test_a_part_of_a_year_with_limits_nights_and_missing_values(sea):
    """Of 24 hours 12 are operating: 2 missing, 1 too windy, 3 beyond the limit, 6 open."""
    winds = [5] * 12 + [20, "", "", 9, 9, 9, 5, 5, 5, 5, 5, 5]
    space = sea(winds, limits={"wind": "8 m/s"}, operating="12:00-24:00", longitude=0)
    facts = weather_facts(space)
    assert facts["open_of_operating"] == 0.5 and facts["missing"] == {"wind": 2}
    assert facts["windows"] == 1 and facts["longest_gap_h"]["largest"] == 18
    lines = weather_lines(space)
    assert lines[0].startswith("weather: 24 hours without a whole calendar year")
    assert lines[1] == (
        "25.0 % of the hours are open, 50.0 % not operating, 8.3 % without a value, "
        "4.2 % too windy to fly, 12.5 % beyond limits.wind"
    )
    assert lines[3] == "hours without a value: wind 2"
