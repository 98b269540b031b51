"""The section ``[weather]`` of a scenario: its file, what it replaces, what is refused."""

import shutil
from pathlib import Path
from typing import Any

import pytest

from dess import InputError, load_scenario
from dess.scenario.scenario import Scenario, ScenarioSpace
from dess.scenario.weather import Limit, Weather
from dess.scenario.weather.hours import hours_of
from tests.dess.scenario.weather.test_hours import ERA5, SHEET

TEXT = "time,wind,from\n2020-01-01T00:00,5,180\n2020-01-01T01:00,6,180\n"
SEA = """
zone = [0, 0, 2, 2]
[data_sheet]
endurance = "35 min"
cruise = "15 m/s"
charging = "40 min"
data_rate = "3 MB/h"
bandwidth = "20 MHz"
snr = "12 dB at 2 km"
max_speed = "23 m/s"
[weather]
file = "data/weather.csv"
"""


@pytest.fixture
def sea(tmp_path):
    """The path of a scenario with its weather in a folder beside it."""
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "weather.csv").write_text(TEXT)
    (tmp_path / "sea.toml").write_text(SEA)
    return tmp_path / "sea.toml"


def test_a_scenario_without_weather_is_stored_as_before():
    space = load_scenario("jade-bight")
    assert not space.weather.is_on and "weather" not in space.model_dump()
    assert space.data_sheet.wind == "8 m/s from SW" and space.max_slots == 1371


def test_a_file_lies_beside_its_scenario_and_has_a_hash(sea, tmp_path, monkeypatch):
    monkeypatch.chdir("/")
    space = load_scenario(sea)
    assert space.weather.file == str(sea.parent / "data" / "weather.csv")
    assert len(space.weather.digest) == 64
    text = space.to_toml()
    (tmp_path / "again.toml").write_text(text)
    assert load_scenario(tmp_path / "again.toml") == space
    assert ScenarioSpace.model_validate(space.model_dump(mode="json")) == space
    assert hash(space) == hash(ScenarioSpace.of(space))


def test_another_content_is_refused_where_it_is_used(sea):
    space = load_scenario(sea)
    (sea.parent / "data" / "weather.csv").write_text(TEXT + "2020-01-01T02:00,7,180\n")
    stored = ScenarioSpace.model_validate(space.model_dump(mode="json"))
    with pytest.raises(InputError, match="weather.csv: has other content than the scenario's"):
        hours_of(stored)
    assert len(hours_of(load_scenario(sea)).state) == 3
    (sea.parent / "data" / "weather.csv").unlink()
    assert ScenarioSpace.model_validate(space.model_dump(mode="json")) == space
    with pytest.raises(InputError, match=r"weather.csv: no such file"):
        hours_of(space)
    with pytest.raises(InputError, match=r"weather: .*weather.csv: no such file"):
        load_scenario(sea)


def test_another_file_has_another_hash(sea, tmp_path, monkeypatch):
    """What the command line names lies in the folder where it is typed."""
    (tmp_path / "other.csv").write_text(TEXT.replace("5,", "4,"))
    monkeypatch.chdir(tmp_path)
    space = load_scenario(sea)
    for base in (space, sea):
        changed = load_scenario(sea) if base is sea else space
        other = ScenarioSpace.of(changed, **{"weather.file": "other.csv"})
        assert other.weather.file == str(tmp_path / "other.csv")
        assert other.weather.digest != space.weather.digest
        assert hours_of(other).series.wind[0] == 4
    assert load_scenario(sea, **{"weather.file": "other.csv"}) == other


def test_what_is_shipped_has_a_plain_name(sea):
    space = load_scenario(sea, **{"weather.file": ERA5})
    assert space.weather.file == ERA5
    sea.write_text(SEA.replace("data/weather.csv", ERA5))
    assert load_scenario(sea) == space
    shutil.copy(space.weather.path, sea.parent)
    assert load_scenario(sea).weather.file == str(sea.parent / ERA5)
    assert load_scenario(sea).weather.digest == space.weather.digest


def test_the_series_takes_the_place_of_wind_and_horizon(sea, caplog):
    """The horizon is that of the longest window: 6 h are 1028 slots of 21 s."""
    space = load_scenario("jade-bight", **{"weather.file": ERA5})
    assert space.data_sheet.wind is None and space.data_sheet.horizon == "6 h"
    assert space.max_slots == 1028
    calm = load_scenario("jade-bight", **{"data_sheet.wind": "0 m/s from N"})
    assert space.consumption == calm.consumption
    sea.write_text(SEA.replace("[weather]", 'horizon = "8 h"\n[weather]'))
    assert load_scenario(sea).max_slots == 1028
    said = f"{sea}: the series of weather.file takes the place of data_sheet.horizon"
    assert said in caplog.text
    longer = load_scenario("jade-bight", **{"weather.file": ERA5, "weather.longest": "8 h"})
    assert longer.max_slots == 1371
    assert ScenarioSpace.of(space, **{"weather.longest": "8 h"}) == longer
    storm = {"weather.file": ERA5, "data_sheet.wind": "20 m/s from N"}
    assert load_scenario("jade-bight", **storm) == space


def test_limits_are_quantities_of_their_columns():
    weather = Weather(
        file=ERA5,
        limits={"wind": "36 km/h", "waves": "< 150 cm", "visibility": "> 2 km", "PRES": ">= 990"},
    )
    assert weather.bounds() == [
        *(Limit("wind", False, 10.0), Limit("waves", False, 1.5)),
        *(Limit("visibility", True, 2000.0), Limit("PRES", True, 990.0)),
    ]


REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"file": "missing.csv"}, "weather: .*missing.csv: no such file"),
    ({"file": "", "operating": "daylight"}, "weather: file: is missing"),
    ({"limits": {"waves": "2"}}, "limits.waves: '2' is no limit of it; allowed: a distance"),
    ({"limits": {"wind": "2 m"}}, "limits.wind: '2 m' is no limit of it; allowed: a speed"),
    ({"limits": {"x": "much"}}, "limits.x: 'much' is no limit"),
    ({"limits": "2 m"}, "limits: '2 m' is not a table"),
    ({"limits": {"wind": 12}}, "limits.wind: 12 is not text"),
    ({"operating": "by day"}, "operating: 'by day' is unknown; allowed: always, daylight, or"),
    ({"operating": "06:00-06:00"}, "operating: .* is no time"),
    ({"operating": "06:00-24:30"}, "operating: .* is no time"),
    ({"operating": "daylight"}, "weather.operating: daylight needs a sea with degrees"),
    ({"operating": "06:00-18:00"}, "weather.operating: solar time needs a longitude"),
    ({"longest": "90 min"}, "longest: '90 min' is not whole; allowed: whole hours"),
    ({"longest": "30 min"}, "longest: '30 min' is out of range"),
    ({"height": "10"}, "height: '10' has no unit"),
    ({"due": "0 h"}, "due: '0 h' is out of range"),
    ({"longitude": 200}, "longitude: 200 is out of range"),
    ({"units": {"wind": "kg"}}, "weather: units: wind: has the unit 'kg'; allowed: a speed"),
    ({"units": {"x": "kg"}}, "units.x: 'kg' is unknown"),
    ({"digest": "abc"}, "digest"),
    ({"stamps": "middle"}, "stamps: 'middle' is unknown; allowed: begin, end"),
    ({"speed": 1}, "weather.speed: unknown key"),
]


@pytest.mark.parametrize(("weather", "said"), REFUSED)
def test_what_cannot_be_is_refused_in_a_line(weather, said):
    with pytest.raises(InputError, match=said) as error:
        Scenario.of(data_sheet=SHEET, weather={"file": ERA5} | weather)
    assert "\n" not in str(error.value)


def test_weather_needs_a_sheet_that_tells_what_can_be_flown():
    with pytest.raises(InputError, match="weather: needs a data sheet; allowed: .*max_speed"):
        Scenario.of(weather={"file": ERA5})
    sheet = {name: value for name, value in SHEET.items() if name != "max_speed"}
    with pytest.raises(InputError, match="data_sheet.max_speed: is missing, and weather needs it"):
        Scenario.of(data_sheet=sheet, weather={"file": ERA5})
    with pytest.raises(InputError, match="weather: needs quota = 0 and landing = true"):
        Scenario.of(data_sheet=SHEET, weather={"file": ERA5}, quota=100)


def test_a_path_is_not_that_of_a_shipped_file():
    with pytest.raises(InputError, match="no such file"):
        Scenario.of(data_sheet=SHEET, weather={"file": str(Path("somewhere") / ERA5)})
