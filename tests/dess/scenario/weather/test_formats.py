"""Files of weather in the forms in which people have them, each with the hours that follow.

``NDBC`` is a year of the National Data Buoy Center, a US agency: its data are in the public domain.
"""

from pathlib import Path

import numpy as np
import pyarrow as pa
import pytest

from dess import InputError
from dess.base.files.tables import write_table
from dess.scenario.weather.series import Series, read_series
from tests.outside import install_package

NDBC = Path(__file__).parent / "ndbc-44005-2012.txt"


@pytest.fixture
def read(tmp_path):
    """A function that reads the series of a file with some text."""

    def read(text: str, name: str = "weather.csv", stamps: str = "begin", **units: str) -> Series:
        path = tmp_path / name
        path.write_text(text, "utf-8")
        return read_series(path, units, stamps)

    return read


def rows(*values: str, head: str = "time,wind,from") -> str:
    """A CSV file with a row an hour from 2020-01-01T00:00 on."""
    lines = (f"2020-01-01T{hour:02}:00,{value}" for hour, value in enumerate(values))
    return "\n".join([head, *lines]) + "\n"


def begins(series: Series) -> str:
    return str(series.first)


def test_times_without_an_offset_are_utc(read):
    series = read(rows("5,180", "6,190"))
    assert begins(series) == "2020-01-01T00"
    assert series.wind.tolist() == [5, 6] and series.origin.tolist() == [180, 190]


@pytest.mark.parametrize(
    ("first", "second", "begin"),
    [
        ("2020-06-01T00:00:00Z", "2020-06-01T01:00:00Z", "2020-06-01T00"),
        ("2020-06-01T02:00+02:00", "2020-06-01T03:00+02:00", "2020-06-01T00"),
        ("2020-06-01 02:00:00 +0200", "2020-06-01 03:00:00 +0200", "2020-06-01T00"),
        ("2020-05-31 19:00-05", "2020-05-31 20:00-05", "2020-06-01T00"),
        ("2020-06-01 00:00:00.000", "2020-06-01 01:00:00.000", "2020-06-01T00"),
        # A clock that is put back: the offset says which hour is meant.
        ("2020-10-25T02:00+02:00", "2020-10-25T02:00+01:00", "2020-10-25T00"),
    ],
)
def test_times_have_offsets_or_not(read, first, second, begin):
    series = read(f"time,wind,from\n{first},5,180\n{second},6,180\n")
    assert (begins(series), series.wind.tolist()) == (begin, [5, 6])


def test_what_is_no_time_is_refused(read):
    for wrong in ("01.02.2020 00:00", "2020-13-01T00:00", "2020-01-01T25:00", "noon"):
        with pytest.raises(InputError, match="weather.csv: has the time .*; allowed: times as"):
            read(f"time,wind,from\n{wrong},5,180\n2020-02-01T00:00,5,180\n")


@pytest.mark.parametrize(
    "head",
    [
        "TIME,Wind_Speed,Wind_Direction",
        "valid_time,windspeed_10m,winddirection_10m",
        "datetime,WSPD,WDIR",
        "time (UTC),wind (m/s),from (°)",
        "date,wind [m/s],wind_from [deg]",
    ],
)
def test_columns_have_their_usual_names(read, head):
    series = read(rows("5,180", "6,190", head=head))
    assert series.wind.tolist() == [5, 6] and series.origin.tolist() == [180, 190]


def test_semicolons_and_decimal_commas_are_read(read):
    text = "sep=;\ntime;wind;from\n2020-01-01 00:00;5,5;180,5\n2020-01-01 01:00;1,25;90\n"
    for content in (text, text.partition("\n")[2], text.replace(";", "\t")):
        series = read(content)
        assert series.wind.tolist() == [5.5, 1.25] and series.origin.tolist() == [180.5, 90]


def test_units_stand_in_the_head_or_in_the_settings(read):
    head = "time,wind (km/h),from,waves (ft),temperature (°C)"
    series = read(rows("36,180,10,-4", "18,90,5,3", head=head))
    assert series.wind.tolist() == [10, 5]
    assert series.columns["waves"].tolist() == pytest.approx([3.048, 1.524])
    assert series.columns["temperature"].tolist() == [-4, 3]
    knots = read(rows("36,180", "18,90"), wind="knots")
    assert knots.wind.tolist() == pytest.approx([36 * 1852 / 3600, 18 * 1852 / 3600])
    assert read(rows("36,180", "18,90", head="time,wind (km/h),from"), wind="m/s").wind[0] == 36


def test_units_that_a_column_cannot_have_are_refused(read):
    for head in ("time,wind (hPa),from", "time,wind (m),from"):
        with pytest.raises(InputError, match="wind: has the unit .*; allowed: a speed"):
            read(rows("5,180", "6,190", head=head))
    with pytest.raises(InputError, match="has no gust, of the units"):
        read(rows("5,180", "6,190"), gust="km/h")


@pytest.mark.parametrize("missing", ["", "NaN", "nan", "MM", "NA", "null"])
def test_missing_values_are_neither_calm_nor_interpolated(read, missing):
    series = read(rows("5,180", f"{missing},190", f"6,{missing}", "7,200"))
    assert series.wind.tolist() == pytest.approx([5, np.nan, 6, 7], nan_ok=True)
    assert series.origin.tolist() == pytest.approx([180, np.nan, np.nan, 200], nan_ok=True)
    assert series.missing == {"wind": 1, "from": 1}


def test_a_calm_comes_from_nowhere(read):
    series = read(rows("0,", "6,190"))
    assert (series.wind.tolist(), series.origin.tolist()) == ([0, 6], [0, 190])


@pytest.mark.parametrize(
    ("value", "said"),
    [("-999,180", "wind is -999 m/s"), ("9999,180", "wind is 9999"), ("5,999", "from is 999 deg")],
)
def test_codes_for_missing_values_are_no_weather(read, value, said):
    with pytest.raises(InputError, match=f"{said}.* at 2020-01-01T01:00.*; allowed: .*empty"):
        read(rows("5,180", value))


def test_a_value_that_is_no_number_is_named_with_its_time(read):
    with pytest.raises(InputError, match="wind: is 'calm' at 2020-01-01T01:00:00"):
        read(rows("5,180", "calm,180"))


def test_a_row_missing_leaves_the_hours_after_the_next_closed(read):
    """An hour takes a row that is one step old; the hours after it are missing."""
    series = read(rows(*["5,180"] * 4) + "2020-01-01T07:00,6,90\n")
    assert series.wind.tolist() == pytest.approx([5] * 5 + [np.nan] * 2 + [6], nan_ok=True)
    assert series.without_row == 2 and series.missing["wind"] == 2


def test_stamps_between_hours_are_taken_by_the_next(read):
    text = "time,wind,from\n2020-01-01T00:50,5,180\n2020-01-01T01:50,6,180\n"
    series = read(text)
    assert (begins(series), series.wind.tolist()) == ("2020-01-01T01", [5, 6])


def test_of_several_rows_an_hour_the_last_until_then_counts(read):
    lines = (f"2020-01-01T{m // 60:02}:{m % 60:02},{m},180" for m in range(0, 150, 10))
    assert read("time,wind,from\n" + "\n".join(lines)).wind.tolist() == [0, 60, 120]


def test_a_row_every_three_hours_holds_for_three(read):
    text = "time,wind,from\n2020-01-01T00:00,5,180\n2020-01-01T03:00,6,180\n"
    assert read(text).wind.tolist() == [5, 5, 5, 6, 6, 6]
    with pytest.raises(InputError, match="has a row every 6 h; allowed: 3 h at most"):
        read(text.replace("T03", "T06"))


def test_stamps_may_end_the_hour(read):
    text = rows("5,180", "6,190")
    assert begins(read(text, stamps="end")) == "2019-12-31T23"


def test_rows_may_stand_in_any_order(read):
    lines = rows("5,180", "6,190", "7,200").splitlines()
    assert read("\n".join([lines[0], *lines[:0:-1]])).wind.tolist() == [5, 6, 7]


def test_components_of_the_wind_tell_where_it_comes_from(read):
    """As of ERA5 at a point: a wind to the east comes from the west."""
    head = "valid_time,u10,v10,t2m,latitude,longitude"
    place = "280,40.0,-72.5"
    values = [f"{u},{v},{place}" for u, v in ((3, 4), (5, 0), (0, 5), (-5, 0), (0, -5), (0, 0))]
    series = read(rows(*values, head=head).replace("T", " ", 9))
    assert series.wind.tolist() == [5] * 5 + [0]
    expected = [180 + np.degrees(np.arctan2(3, 4)), 270, 180, 90, 0, 0]
    assert series.origin.tolist() == pytest.approx(expected)


def test_rows_of_several_places_are_refused(read):
    head = "valid_time,u10,v10,latitude,longitude"
    with pytest.raises(InputError, match="several values of longitude"):
        read(rows("3,4,40.0,-72.5", "3,4,40.0,-72.25", head=head))


def test_what_lacks_columns_is_refused(read):
    with pytest.raises(InputError, match="has no times in its columns when, wind, from"):
        read(rows("5,180", head="when,wind,from"))
    with pytest.raises(InputError, match="has no from in its columns wind; .*u10 and v10"):
        read(rows("5", "6", head="time,wind"))
    with pytest.raises(InputError, match="has the columns wind and wspd for wind"):
        read(rows("5,5,180", head="time,wind,wspd,from"))
    with pytest.raises(InputError, match="has no rows at different times"):
        read(rows("5,180"))
    for text in ("time,wind,from\n", "time,wind,from\n2020-01-01T00:00,5\n2020-01-01T01:00,6\n"):
        with pytest.raises(InputError, match="weather.csv: .*; allowed: "):
            read(text)


# --- NDBC ---

HISTORIC = (
    "#YY  MM DD hh mm WDIR WSPD GST  WVHT   DPD   APD MWD   PRES  ATMP  WTMP  DEWP  VIS  TIDE"
)
UNITS = "#yr  mo dy hr mn degT m/s  m/s     m   sec   sec degT   hPa  degC  degC  degC   mi    ft"
REAL_TIME = (
    "#YY  MM DD hh mm WDIR WSPD GST  WVHT   DPD   APD MWD   PRES  ATMP  WTMP  DEWP  VIS PTDY  TIDE"
)
OLD = "YY MM DD hh WD   WSPD GST  WVHT  DPD   APD  MWD  BAR    ATMP  WTMP  DEWP  VIS"


def test_a_historic_file_of_18_columns_is_read(read):
    text = f"""{HISTORIC}
{UNITS}
2019 12 31 23 50 316  4.8  6.0  0.92  5.56  4.88 999 1008.1   6.8   8.1   6.8 10.0 99.00
2020 01 01 00 50 999 99.0 99.0 99.00 99.00 99.00 999 9999.0 999.0 999.0 999.0 99.0 99.00
2020 01 01 01 50 311  8.4 10.0  0.87  8.33  4.09 999 1008.2   5.5   8.1   5.5 99.0  1.00
"""
    series = read(text, "44005h2020.txt")
    assert begins(series) == "2020-01-01T00"
    assert series.wind.tolist() == pytest.approx([4.8, np.nan, 8.4], nan_ok=True)
    assert series.origin.tolist() == pytest.approx([316, np.nan, 311], nan_ok=True)
    assert series.columns["gust"][0] == 6 and series.columns["waves"][0] == 0.92
    assert series.columns["visibility"][0] == 18520  # nautical miles
    assert series.missing["visibility"] == 2 and series.missing["MWD"] == 3
    assert series.columns["TIDE"][2] == pytest.approx(0.3048)


def test_a_file_of_the_last_days_of_19_columns_runs_backwards_and_has_mm(read):
    text = f"""{REAL_TIME}
{UNITS}
2020 01 01 02 00 120  5.0   MM    MM    MM    MM  MM 1008.1   6.8   8.1   6.8   MM   MM    MM
2020 01 01 01 00  MM   MM   MM   1.0    MM    MM  MM 1008.1   6.8   8.1   6.8   MM -1.2    MM
2020 01 01 00 00 110  4.0  6.0   0.9    MM    MM  MM 1008.1   6.8   8.1   6.8   MM   MM    MM
"""
    series = read(text, "44005.txt")
    assert series.wind.tolist() == pytest.approx([4, np.nan, 5], nan_ok=True)
    assert series.columns["waves"].tolist() == pytest.approx([0.9, 1.0, np.nan], nan_ok=True)


def test_an_old_file_has_no_minutes_and_short_years(read):
    text = f"""{OLD}
98 01 01 00 316  4.8  6.0  0.92  5.56  4.88 999 1008.1   6.8   8.1   6.8 99.0
98 01 01 01 999  0.0  6.0  0.92  5.56  4.88 999 1008.1   6.8   8.1   6.8 99.0
{OLD}
98 01 01 02 310  4.0  6.0  0.92  5.56  4.88 999 1008.1   6.8   8.1   6.8 99.0
"""
    series = read(text, "old.txt")
    assert begins(series) == "1998-01-01T00"
    assert series.wind.tolist() == [4.8, 0, 4] and series.origin.tolist() == [316, 0, 310]


def test_times_that_cannot_be_are_refused(read):
    row = "316  4.8  6.0  0.92  5.56  4.88 999 1008.1   6.8   8.1   6.8 99.0"
    for when in ("98 13 01 00", "98 01 32 00", "98 01 01 24", "98 xx 01 00"):
        with pytest.raises(InputError, match="old.txt: .*; allowed: [01]..[0-9]+"):
            read(f"{OLD}\n98 01 01 00 {row}\n{when} {row}\n", "old.txt")
    with pytest.raises(InputError, match="old.txt: is not a CSV file"):
        read(f"{OLD}\n98 01 01 00 {row}\n98 01 01 01 {row} 1\n", "old.txt")


def test_a_series_ends_after_some_generations(read):
    lines = rows("5,180", "6,180", "7,180") + "9020-01-01T00:00,5,180\n"
    with pytest.raises(InputError, match="has rows from 2020-.* to 9020-.*; allowed: 200 years"):
        read(lines)


def test_the_gaps_of_a_year_of_a_buoy_are_not_calm():
    """Verification 9: NDBC's buoy 44005 in 2012, whose rows stand at :50, and end in December."""
    series = read_series(NDBC, {})
    hours = np.arange("2012-01-01T00", "2013-01-01T00", dtype="datetime64[h]")
    wind = np.full(len(hours), np.nan)
    wind[np.searchsorted(hours, series.hours)] = series.wind
    has_wind = np.isfinite(wind)
    assert (has_wind.sum(), (~has_wind).sum()) == (7970, 814)
    assert (wind <= 9.79).mean() == pytest.approx(0.773, abs=0.0005)
    assert (np.nan_to_num(wind) <= 9.79).mean() == pytest.approx(0.866, abs=0.0005)


# --- parquet, and other packages ---


def test_a_parquet_file_has_a_column_of_times(tmp_path):
    times = np.arange("2020-01-01T00", "2020-01-01T03", dtype="datetime64[h]")
    columns = {"wind": [5.0, None, 7.0], "from": [10, 20, 30]}
    expected = ("2020-01-01T00", [5, np.nan, 7])
    for number, stamps in enumerate((times.astype("datetime64[us]"), times.astype(str))):
        path = tmp_path / f"{number}.parquet"
        write_table(path, pa.table({"time": stamps, **columns}))
        series = read_series(path, {})
        assert begins(series) == expected[0]
        assert series.wind.tolist() == pytest.approx(expected[1], nan_ok=True)


def test_the_metadata_of_a_parquet_file_tell_start_step_and_units(tmp_path):
    said = {"start": "2020-01-01T00:00Z", "step": "3 h", "columns": "wind [0.1 m/s], from [deg]"}
    table = pa.table({"wind": pa.array([55, 60], pa.uint16()), "from": pa.array([90, 100])})
    write_table(tmp_path / "w.parquet", table.replace_schema_metadata(said))
    series = read_series(tmp_path / "w.parquet", {})
    assert series.wind.tolist() == [5.5] * 3 + [6.0] * 3
    assert series.origin.tolist() == [90] * 3 + [100] * 3


def test_a_package_reads_files_of_another_ending(tmp_path, monkeypatch):
    path = tmp_path / "weather.hourly"
    path.write_text("5 6")
    with pytest.raises(InputError, match="has no known file ending; allowed: .csv, .tsv, .txt"):
        read_series(path, {})
    code = """
import numpy as np
def read(path):
    wind = np.array(path.read_text().split(), float)
    times = np.datetime64("2020-01-01T00", "s") + 3600 * np.arange(len(wind))
    return times, {"wind": wind, "from": 0 * wind}
"""
    entry = {".hourly": "hourly_reader:read"}
    install_package(tmp_path / "site", monkeypatch, "hourly_reader", code, "dess.readers", **entry)
    assert read_series(path, {}).wind.tolist() == [5, 6]
    path.write_text("5 -7")
    with pytest.raises(InputError, match="wind is -7 m/s"):
        read_series(path, {})
    path.write_text("5 calm")
    with pytest.raises(InputError, match="cannot be read by hourly_reader:read: ValueError"):
        read_series(path, {})


def test_a_file_that_changes_is_read_again(read, tmp_path):
    first = read(rows("5,180", "6,190"))
    assert read_series(tmp_path / "weather.csv", {}) is first
    second = read(rows("5,180", "6,190", "7,190"))
    assert len(second.wind) == 3 and second.digest != first.digest
