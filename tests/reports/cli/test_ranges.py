"""Values of fields on the command line."""

import shlex

import pytest

from dess import InputError
from dess.reports.cli.options import parse_setting, parse_values

VALUES = {
    "uavs=2..5": (2, 3, 4, 5),
    "uavs=3": (3,),
    "uavs=[1,3]": ([1, 3],),
    "uavs=1,3": (1, 3),
    "quota=100..600:6": (100, 200, 300, 400, 500, 600),
    "arrival_rate=0.01..0.05:5": (0.01, 0.02, 0.03, 0.04, 0.05),
    "initial_data=[5, 20]": ([5, 20],),
    "initial_data=[5, 10],[10, 20]": ([5, 10], [10, 20]),
    "forbid_swaps=false,true": (False, True),
    "arrivals.service=newest, oldest": ("newest", "oldest"),
    "arrivals.process=continuous": ("continuous",),
    "data_sheet.wind=5 m/s from W": ("5 m/s from W",),
    "weather.operating=daylight,06:00-18:00": ("daylight", "06:00-18:00"),
    "weather.longest=4 h,6 h": ("4 h", "6 h"),
    'weather.limits={waves = "1 m"},{waves = "2 m"}': ({"waves": "1 m"}, {"waves": "2 m"}),
    "data_sheet.data_rate=20 kB/h, 3 MB/h": ("20 kB/h", "3 MB/h"),
    'data_sheet.data_rate="20 kB/h","3 MB/h"': ("20 kB/h", "3 MB/h"),
    "data_sheet.backlog=[1 kB, 2 kB],[3 kB,4 kB]": (["1 kB", "2 kB"], ["3 kB", "4 kB"]),
}


@pytest.mark.parametrize("text", VALUES)
def test_values(text):
    field, values = parse_values(text)
    assert field == text.split("=")[0].strip()
    assert values == VALUES[text]
    assert [type(value) for value in values] == [type(value) for value in VALUES[text]]


QUANTITIES = {
    "data_sheet.data_rate=20 kB/h": "20 kB/h",
    "data_sheet.backlog=3,5 MB": "3,5 MB",
    "data_sheet.backlog=[1 kB, 2 kB]": ["1 kB", "2 kB"],
    "data_sheet.wind='5 m/s from W'": "5 m/s from W",
    "weather.longest=8 h": "8 h",
    "weather.operating=06:00-18:00": "06:00-18:00",
    "weather.file=../my buoy.csv": "../my buoy.csv",
    'weather.limits={waves = "1.5 m"}': {"waves": "1.5 m"},
}


@pytest.mark.parametrize("text", QUANTITIES)
def test_a_quantity_needs_no_quotes_of_its_own(text):
    assert parse_setting(text) == (text.partition("=")[0], QUANTITIES[text])


@pytest.mark.parametrize("text", ["uavs=2, 3", "data_sheet.data_rate=1 MB/h, 2 MB/h"])
def test_the_command_for_several_values_can_be_pasted(text):
    with pytest.raises(
        InputError, match="has several values; allowed: one, or dess sweep"
    ) as error:
        parse_setting(text)
    *_, option, pasted = shlex.split(str(error.value).partition("or dess sweep ")[2])
    assert (option, pasted) == ("--set", text) and len(parse_values(pasted)[1]) == 2


REFUSED = {
    "uavs": "'uavs' is not KEY=VALUES; allowed: a field",
    "uavs=": "uavs: has no values",
    "uavs=2,,3": "'uavs=2,,3' is not KEY=VALUES",
    "uavs=two": "--set: uavs: 'two' has the wrong form",
    "arrival_rate=0.1,lots": "arrival_rate: 'lots' is not a number",
    "uavs=5..2": "'uavs=5..2' begins with the larger number; allowed: uavs=2..5",
    "uavs=a..3": "has an end 'a' that is not a number",
    "uavs=1.5..3": "has an end that is not an integer",
    "arrival_rate=0.01..0.05": "has no number of values",
    "arrival_rate=0..1:1000000000": "has no number of values",
    "quota=1..1e30": "quota: has 1,000,000,000,000,000,000,000,000,000,000 values",
}


@pytest.mark.parametrize("text", REFUSED)
def test_what_is_no_value(text):
    with pytest.raises(InputError) as error:
        parse_values(text)
    assert REFUSED[text] in str(error.value)
