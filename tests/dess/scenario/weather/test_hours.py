"""Which hours are open, what a slot takes in them, years and windows, by other arithmetic."""

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, load_scenario
from dess.scenario.data_sheet import DataSheet
from dess.scenario.rotary_wing import airspeed_along, airspeeds_of
from dess.scenario.scenario import ScenarioSpace
from dess.scenario.weather.hours import (
    Hours,
    HourState,
    Year,
    hours_of,
    offset_of,
    wind_factor,
    years,
)
from dess.scenario.weather.series import Series
from dess.scenario.weather.windows import Window, longest_gap, shares_of, windows_of

ERA5 = "era5-40.0N-72.5W-1990-2020.parquet"
SHEET = {
    **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "data_rate": "3 MB/h"},
    **{"bandwidth": "20 MHz", "snr": "12 dB at 2 km", "max_speed": "23 m/s"},
}


@pytest.fixture
def write(tmp_path):
    """A function that writes a CSV file with rows of wind, direction and waves, hour by hour."""

    def write(values: list[tuple[Any, ...]], begin: str = "2020-01-01T00") -> Path:
        hours = np.datetime64(begin, "h") + np.arange(len(values))
        lines = [
            f"{hour}:00,{','.join(map(str, row))}" for hour, row in zip(hours, values, strict=True)
        ]
        path = tmp_path / "weather.csv"
        path.write_text("\n".join(["time,wind,from,waves", *lines]))
        return path

    return write


def space_of(path: Path | str, sheet: dict[str, Any] | None = None, **weather: Any) -> Any:
    """A sea without degrees whose weather is in a file."""
    fleet = weather.pop("fleet", ())
    weather = {"file": str(path), **weather}
    return ScenarioSpace.of(data_sheet=SHEET | (sheet or {}), weather=weather, fleet=fleet)


def states(path: Path, **about: Any) -> list[int]:
    return hours_of(space_of(path, **about)).state.tolist()


def test_an_hour_is_closed_by_the_first_reason(write):
    path = write([(5, 0, 1.0), (5, 0, 1.6), ("", 0, 1.0), (9, 0, 1.0), (9, 45, 1.6), (5, 0, "")])
    limits = {"waves": "1.5 m", "wind": "4 m/s"}
    assert states(path) == [0, 0, 2, 3, 0, 0]
    open_, missing, wind, waves = HourState.OPEN, HourState.MISSING, HourState.WIND, HourState.LIMIT
    assert states(path, limits={"waves": "1.5 m"}) == [open_, waves, missing, wind, waves, missing]
    assert states(path, limits=limits) == [waves + 1, waves, missing, wind, waves, missing]
    assert states(path, limits=limits, operating="03:00-05:00", longitude=0) == [
        *[HourState.NIGHT] * 3,
        *[wind, waves, HourState.NIGHT],
    ]
    hours = hours_of(space_of(path, limits=limits))
    assert hours.names == {1: "night", 2: "missing", 3: "wind", 4: "limits.waves", 5: "limits.wind"}


def test_in_still_air_known_hours_cost_and_close_as_without_wind(write):
    rows = [(20, 45, 1.0), ("", 0, 1.0), (8, 180, 1.6), (8, 180, 1.0)]
    limits = {"waves": "1.5 m", "wind": "4 m/s"}
    about: dict[str, Any] = {"limits": limits, "calm": True}
    hours = hours_of(space_of(write(rows), **about))
    state, costs = hours.state.tolist(), hours.costs
    assert state == [HourState.OPEN, HourState.MISSING, HourState.LIMIT, HourState.OPEN]
    still = hours_of(space_of(write([(0, *row[1:]) for row in rows]), limits=limits))
    assert (costs[[0, 3]] == still.costs[3]).all() and still.state[3] == HourState.OPEN


def test_a_limit_may_be_the_least_value(write):
    path = write([(5, 0, 1.0), (5, 0, 2.0), (5, 0, 3.0)])
    assert states(path, limits={"waves": "> 2 m"}) == [HourState.LIMIT, 0, 0]
    assert states(path, limits={"waves": "<= 2 m"}) == [0, 0, HourState.LIMIT]
    assert states(path, limits={"swh": "200 cm"}) == [0, 0, HourState.LIMIT]
    with pytest.raises(InputError, match="weather.csv: has no gust, of the limits; allowed: wind"):
        states(path, limits={"gust": "9 m/s"})


@pytest.mark.parametrize(
    ("operating", "longitude", "expected"),
    [
        ("06:00-18:00", 0, range(6, 18)),
        ("06:00-18:00", -72.5, range(11, 23)),
        ("22:00-04:00", 0, (22, 23, 0, 1, 2, 3)),
        ("06:30-07:30", 0, (6,)),
        ("00:00-24:00", 30, range(24)),
    ],
)
def test_operating_hours_are_of_local_solar_time(write, operating, longitude, expected):
    path = write([(5, 0, 1.0)] * 24)
    found = states(path, operating=operating, longitude=longitude)
    assert [hour for hour in range(24) if found[hour] == HourState.OPEN] == sorted(expected)


def test_daylight_is_that_of_the_sea_and_of_the_longitude_of_the_series(write):
    """At 53.5 N 17.05 hours are light on 21 June, and 7.47 on 21 December."""
    for day, light in (("2020-06-21", 17.05), ("2020-12-21", 7.47)):
        for longitude, midnight in ((None, 0), (-72.5, 5)):
            path = write([(5, 0, 1.0)] * 24, f"{day}T{midnight:02}")
            about = {"operating": "daylight", "file": str(path)}
            if longitude:
                about["longitude"] = longitude
            hours = hours_of(load_scenario("jade-bight", weather=about))
            is_open = np.flatnonzero(hours.state == HourState.OPEN)
            assert abs(len(is_open) - light) < 1
            assert is_open.mean() + 0.5 == pytest.approx(11.7, abs=0.7)  # the noon of the sun


@given(
    st.lists(st.tuples(st.floats(0, 30), st.floats(0, 359)), min_size=1, max_size=20),
    st.sampled_from(["15 m/s", "10 m/s", "12.34 m/s"]),
)
def test_costs_are_those_of_a_sheet_with_this_wind(tmp_path_factory, winds, cruise):
    """In every bit; and an hour is open if such a sheet is accepted, but for its rounding."""
    path = tmp_path_factory.mktemp("weather") / "weather.csv"
    times = np.datetime64("2020-01-01T00") + np.arange(len(winds) + 1) * np.timedelta64(1, "h")
    rows = [(0.0, 0.0), *winds]
    lines = (f"{t}:00,{w!r},{d!r}" for t, (w, d) in zip(times, rows, strict=True))
    path.write_text("\n".join(["time,wind,from", *lines]))
    fleet = [{"slots_per_cell": 1}, {"slots_per_cell": 3}]
    hours = hours_of(space_of(path, {"cruise": cruise}, fleet=fleet))
    for state, costs, (wind, origin) in zip(hours.state, hours.costs, rows, strict=True):
        sheet = {**SHEET, "cruise": cruise, "wind": f"{wind:.20f} m/s from {origin:.20f} deg"}
        strongest = DataSheet.model_validate(SHEET | {"cruise": cruise}).strongest_wind(origin)
        if wind <= strongest:
            expected = np.array(DataSheet.model_validate(sheet).costs())
            assert state == HourState.OPEN
            assert costs[:3].tolist() == expected[:3].tolist() and not costs[3:].any()
        elif wind > strongest + 0.011:
            assert state == HourState.WIND and not costs.any()


def test_airspeeds_of_many_winds_are_those_of_each():
    draw = np.random.default_rng(1)
    wind, origin = draw.uniform(0, 30, 200), draw.uniform(0, 360, 200)
    found = airspeeds_of(15.0, wind, origin)
    for row, w, direction in zip(found.tolist(), wind.tolist(), origin.tolist(), strict=True):
        moves = [airspeed_along(course, 15.0, w, direction) for course in (0, 90, 180, 270)]
        assert row == [*moves, w]


def test_the_fastest_type_tells_which_wind_can_be_flown(write):
    """From the north at v over ground, w + v may be 23 m/s: 8 at 15, 15.5 at 7.5 m/s."""
    path = write([(w, 0, 1.0) for w in (8, 8.1, 15.5, 15.6)])
    slow = [{"cruise": "7.5 m/s"}]
    assert states(path) == states(path, fleet=[{}, *slow]) == [0, 3, 3, 3]
    assert states(path, fleet=slow) == [0, 0, 0, 3]


def test_wind_grows_with_the_altitude(write):
    """By (altitude / height) to the power of 0.11: 1.194 from 10 to 50 m."""
    path = write([(w, 0, 1.0) for w in (6.6, 6.8, 8.0)])
    assert wind_factor(50, 10) == pytest.approx(5**0.11, rel=1e-15)
    assert wind_factor(10, 10) == 1.0
    assert states(path) == [0, 0, 0]
    assert states(path, sheet={"altitude": "50 m"}) == [0, 3, 3]
    assert states(path, sheet={"altitude": "50 m"}, height="50 m") == [0, 0, 0]


def test_a_slot_that_takes_too_much_in_an_hour_that_can_be_flown_is_refused(write):
    path = write([(5, 0, 1.0), (55, 0, 1.0)])
    with pytest.raises(InputError, match="an open hour takes .* % a slot; allowed: 11 % at most"):
        hours_of(space_of(path, {"max_speed": "80 m/s"}))


# --- years ---


def test_years_are_whole_but_for_a_day_at_the_edges(write):
    path = write([(5, 0, 1.0)] * (366 * 24 + 10), "2020-01-01T00")
    hours = hours_of(space_of(path, longitude=-72.5))
    assert years(hours) == [Year(2020, 5, 366 * 24)]
    assert hours.first == np.datetime64("2020-01-01T00")
    east = hours_of(space_of(path, longitude=150.0))  # local midnight is 10 h before that of UTC
    assert years(east) == [Year(2020, 0, 366 * 24)]
    assert east.first == np.datetime64("2019-12-31T14")
    assert east.state[:11].tolist() == [HourState.MISSING] * 10 + [HourState.OPEN]
    assert not east.costs[:10].any() and east.costs[10, 0].all()


def test_a_series_of_less_than_a_year_has_no_whole_one(write):
    assert years(hours_of(space_of(write([(5, 0, 1.0)] * (364 * 24))))) == []


def test_local_time_is_that_of_the_longitude_in_whole_hours():
    assert [offset_of(lon) for lon in (0, 7.4, 7.6, -72.5, 180, -180)] == [0, 0, 1, -5, 12, -12]


# --- windows ---


def hours_with(is_open: Any) -> Hours:
    state = np.where(np.array(is_open, bool), HourState.OPEN, HourState.WIND).astype(np.int8)
    nothing = np.empty(0)
    series = Series(np.datetime64("2020-01-01T00"), nothing, nothing, {}, "", 0, {})
    return Hours(series.first, state, np.zeros((len(state), 8, 5), np.int16), (), 0, series)


def test_windows_are_runs_of_open_hours_cut_at_the_longest_and_at_the_turn_of_the_year():
    hours = hours_with([1, 1, 1, 0, 1, 0, 0, *[1] * 8])
    year = Year(2020, 1, 12)
    assert windows_of(hours, year, 6, 21.0) == [
        *(Window(1, 2), Window(4, 1), Window(7, 6)),
    ]
    assert windows_of(hours, year, 3, 21.0) == [
        *(Window(1, 2), Window(4, 1), Window(7, 3), Window(10, 3)),
    ]
    assert windows_of(hours, year, 6, 3601.0) == [Window(1, 2), Window(7, 6)]
    assert longest_gap(hours, year) == 2
    assert shares_of(hours, year) == {"open": 0.75, "night": 0, "missing": 0, "wind": 0.25}


def test_a_chain_of_two_states_has_the_windows_of_its_probabilities():
    """Verification 4: share q / (p + q), mean window 1 / p, P(window >= L) = (1 - p)^(L - 1)."""
    leaves, returns, count = 0.08, 0.15, 200_000
    draws = np.random.default_rng(0).random(count)
    chain = np.ones(count, bool)
    for hour in range(1, count):
        change = leaves if chain[hour - 1] else returns
        chain[hour] = chain[hour - 1] ^ (draws[hour] < change)
    hours = hours_with(chain)
    lengths = np.array([w.hours for w in windows_of(hours, Year(1, 0, count), count, 1.0)])
    assert chain.mean() == pytest.approx(returns / (leaves + returns), abs=0.01)
    assert lengths.mean() == pytest.approx(1 / leaves, rel=0.03)
    assert (lengths >= 10).mean() == pytest.approx((1 - leaves) ** 9, abs=0.02)


@given(st.lists(st.booleans(), min_size=1, max_size=80), st.integers(1, 7))
def test_windows_cover_the_open_hours_once(is_open, longest):
    hours = hours_with(is_open)
    windows = windows_of(hours, Year(1, 0, len(is_open)), longest, 60.0)
    covered = [hour for first, count in windows for hour in range(first, first + count)]
    assert covered == np.flatnonzero(is_open).tolist()
    assert all(1 <= count <= longest for _, count in windows)


# --- the shipped series ---


@pytest.fixture(scope="module")
def era5() -> Series:
    return load_scenario("jade-bight", **{"weather.file": ERA5}).weather.series()


def by_year(series: Series, is_open: np.ndarray) -> list[np.ndarray]:
    of_year = series.hours.astype("datetime64[Y]")
    return [is_open[of_year == year] for year in np.unique(of_year)]


def runs(is_in: np.ndarray) -> list[int]:
    """The lengths of runs, counted one hour after the other."""
    lengths, length = [], 0
    for inside in [*is_in.tolist(), False]:
        if not inside and length:
            lengths.append(length)
        length = length + 1 if inside else 0
    return lengths


def test_the_shares_of_the_shipped_series_are_known(era5):
    """Verification 8."""
    wind = era5.wind
    assert len(wind) == 271_752 and era5.first == np.datetime64("1990-01-01T00")
    assert not any(era5.missing.values())
    is_open = wind <= 9.8
    shares = [year.mean() for year in by_year(era5, is_open)]
    assert is_open.mean() == pytest.approx(0.7842, abs=5e-5)
    assert np.std(shares, ddof=1) == pytest.approx(0.0203, abs=5e-5)
    assert (min(shares), max(shares)) == pytest.approx((0.754, 0.832), abs=5e-4)
    assert len(runs(is_open)) / 31 == pytest.approx(153.2, abs=0.05)
    assert np.mean(runs(~is_open)) == pytest.approx(12.35, abs=0.005)
    gaps = [max(runs(~year)) for year in by_year(era5, is_open)]
    assert (np.median(gaps), max(gaps)) == (76, 124)
    both = is_open & (era5.columns["waves"] <= 1.5)
    assert both.mean() == pytest.approx(0.6149, abs=5e-5)
    assert (wind <= 8).mean() == pytest.approx(0.6280, abs=5e-5)
    assert (wind <= 12).mean() == pytest.approx(0.9070, abs=5e-5)


@pytest.mark.parametrize(("cruise", "share"), [(15, 0.6849), (12, 0.8920), (10, 0.9572)])
def test_slower_uavs_have_more_open_hours(era5, cruise, share):
    """Verification 8: by direction, with 23 m/s through the air."""
    sheet = {"data_sheet.cruise": f"{cruise} m/s", "data_sheet.endurance": f"{525 / cruise} min"}
    space = load_scenario("jade-bight", **{"weather.file": ERA5}, **sheet)
    hours = hours_of(space)
    begin = int((era5.first - hours.first) / np.timedelta64(1, "h"))
    is_open = hours.state[begin : begin + len(era5.wind)] == HourState.OPEN
    assert is_open.mean() == pytest.approx(share, abs=5e-5)
    angle = np.radians(era5.origin)
    along = np.maximum(abs(np.sin(angle)), abs(np.cos(angle)))
    needed = era5.wind**2 + cruise**2 + 2 * era5.wind * cruise * along
    assert ((needed <= 23**2 + 1e-9) == is_open).all()
    assert len(years(hours)) == 31


def test_limits_and_years_of_the_shipped_series():
    values = {"weather.file": ERA5, "weather.limits": {"wind": "9.8 m/s", "waves": "1.5 m"}}
    slow = {"data_sheet.max_speed": "60 m/s"}
    hours = hours_of(load_scenario("jade-bight", **values, **slow, **{"weather.longitude": -72.5}))
    whole = years(hours)
    assert [year.year for year in whole] == [*range(1990, 2021)]
    assert whole[0].first == 5 and whole[-1].first + whole[-1].hours == len(hours.state)
    assert (hours.state[-5:] == HourState.MISSING).all()
    shares = [shares_of(hours, year) for year in whole]
    assert all(math.isclose(sum(share.values()), 1) for share in shares)
