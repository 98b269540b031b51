"""Quantities: every unit that is read and its size, numbers as people write them, refusals."""

import math
import re
from fractions import Fraction
from pathlib import Path

import pytest

from dess import InputError
from dess.scenario.quantities import KINDS, UNITS, exactly, measured, times, unit_of
from tests.test_docs import PAGES

# What an engineer would look up.
SIZES = {
    ("54 km/h", "m/s"): 15.0,
    ("54 kmph", "m/s"): 15.0,
    ("15 knots", "m/s"): 15 * 1852 / 3600,
    ("15 kn", "m/s"): 15 * 1852 / 3600,
    ("30 mph", "m/s"): 13.4112,
    ("900 m / min", "m/s"): 15.0,
    ("1 nautical mile", "m"): 1852.0,
    ("35min", "s"): 2100.0,
    ("30 d", "s"): 2_592_000.0,
    ("3,5 MB/h", "bit/s"): 3.5e6 * 8 / 3600,
    ("0,125 MB", "bit"): 1e6,
    ("64 KiB", "bit"): 64 * 1024 * 8.0,
    ("5.5 kbps", "bit/s"): 5500.0,
    ("868 MHz", "Hz"): 868e6,
    ("100 mW", "dBm"): 20.0,
    ("-10 dBW", "dBm"): 20.0,
    ("20 %", "percent"): 20.0,
}


@pytest.mark.parametrize(("text", "unit"), SIZES)
def test_a_quantity_has_the_size_of_its_unit(text, unit):
    assert measured(text, unit) == pytest.approx((SIZES[text, unit],), rel=1e-15)


def test_the_unit_is_told_as_it_was_typed():
    typed = {
        "90 min": "s",
        "1.5h": "s",
        "10 nautical miles": "m",
        "36 km/h from SW": "m/s from deg",
    }
    units = [unit_of(text, kind) for text, kind in typed.items()]
    assert units == ["min", "h", "nautical miles", "km/h"]


def test_what_was_typed_is_kept_exactly():
    assert exactly("0.1 h", "s") == (Fraction(360),)
    assert exactly("12.3 dB at 2,5 km", "dB at m") == (Fraction(123, 10), Fraction(2500))
    assert measured("5 m/s from WSW", "m/s from deg") == (5.0, 247.5)
    assert times("2,5 m/s from SW", 2) == "5 m/s from SW"


@pytest.mark.parametrize(
    ("text", "unit", "line"),
    [
        ("35 minits", "s", "has an unknown unit (did you mean minutes?); allowed: a time"),
        ("54 kmps", "m/s", "has an unknown unit (did you mean kmph?); allowed: a speed"),
        ("3 mb/h", "bit/s", "has an unknown unit (did you mean MB/h or "),
        ("3 KB/h", "bit/s", "has an unknown unit (did you mean kB/h or "),
        ("35 m", "s", "has a unit of another kind; allowed: a time"),
        ("35", "s", "has no unit"),
        ("1,000 m", "m", "may part thousands or decimals; allowed: 1000 or 1.000"),
        ("1.234,5 m", "m", "is not a number and a unit"),
        ("9" * 40 + " m", "m", "is not a number and a unit"),
        ("0 mW", "dBm", "is not above 0; allowed: a power"),
    ],
)
def test_what_cannot_be_read_is_refused_in_a_line(text, unit, line):
    with pytest.raises(InputError) as error:
        measured(text, unit)
    assert line in str(error.value) and "\n" not in str(error.value)


def test_the_docs_list_every_unit():
    """Row by row, with all spellings: the list is that of the code, which needs no library."""
    page = PAGES["docs/how-to/data-sheet.md"].partition("## Units")[2].partition("\n## ")[0]
    rows = dict(re.findall(r"^\| ([a-z ]+) \| (.*?) \|", page, re.M))
    kinds = {KINDS[unit][0].split(" ", 1)[1]: unit for unit in UNITS}
    assert rows.keys() - {"what"} == kinds.keys()
    for kind, unit in kinds.items():
        listed = re.findall(r"`([^`]+)`", rows[kind])
        spellings = [spelling for units in UNITS[unit] for spelling in units]
        assert listed[: len(spellings)] == spellings, kind
        for spelling in listed:
            assert math.isfinite(measured(f"2 {spelling}", unit)[0]) if unit != "deg" else True
    code = (Path(__file__).parents[3] / "dess/scenario/quantities.py").read_text("utf-8")
    assert "import pint" not in code
