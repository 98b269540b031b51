"""Ten data sheets (``ten-sheets.md``), computed a second time by formulas of this module.

``DESS_WRITE_PINS=1`` writes the table of the page.
"""

import math
import os
import re
import tomllib
from pathlib import Path
from typing import Any, NamedTuple

import pytest

from dess import ScenarioSpace
from dess.analysis.sheet import sheet_facts
from dess.scenario.data_sheet import DataSheet

DOCS = Path(__file__).parents[2] / "docs"
PAGE = Path(__file__).with_name("ten-sheets.md")
SEA, *SHEETS = re.findall(r"^```toml\n(.*?)^```", PAGE.read_text("utf-8"), re.M | re.S)
NAMES = re.findall(r"^## (\d+\. .*)$", PAGE.read_text("utf-8"), re.M)

UNITS = {
    "s": 1, "min": 60, "h": 3600, "m": 1, "km": 1000, "m/s": 1, "km/h": 1 / 3.6,
    "B": 8, "kB/h": 8e3 / 3600, "MB/h": 8e6 / 3600, "bit/s/Hz": 1,
    "kbit/s": 1e3, "Mbit/s": 1e6, "kHz": 1e3, "MHz": 1e6, "GHz": 1e9,
    "dB": 1, "dBm": 1, "%": 1,
}  # fmt: skip

# Y. Zeng, J. Xu, R. Zhang, 2019: the shares of the blades and of the inflow, and the drag.
BLADES = 0.474
INFLOW = 0.526
DRAG = 5.48e-5
TIP_SPEED = 120.0
PATH_LOSS_EXPONENT = 2.27
LORA = {12: -20.0, 11: -17.5, 10: -15.0, 9: -12.5, 8: -10.0, 7: -7.5}


class Row(NamedTuple):
    """What follows from a sheet; costs in percent of the battery a slot."""

    slot: float
    cell: float
    north: float
    east: float
    south: float
    west: float
    hover: float
    near_rate: float
    far_rate: float
    reach: float
    messages: float


def number(sheet: dict[str, Any], field: str, missing: float = 0.0) -> float:
    """The first number of a quantity, in SI units."""
    if field in sheet:
        return in_units(sheet[field])
    return missing


def in_units(text: str) -> float:
    value, unit = text.split()[:2]
    return float(value) * UNITS[unit]


def power(airspeed: float, induced_speed: float, drag: float) -> float:
    """The power of a rotary wing, as a share of that of hovering in still air."""
    blades = BLADES * (1 + 3 * airspeed**2 / TIP_SPEED**2)
    ratio = airspeed**2 / (2 * induced_speed**2)
    return blades + INFLOW * math.sqrt(math.sqrt(1 + ratio**2) - ratio) + drag * airspeed**3


def cost(share: float) -> float:
    """Percent of the battery, in whole thousandths, rounded up."""
    return math.ceil(1000 * share) / 1000


def steps_of(sheet: dict[str, Any]) -> list[tuple[float, float]]:
    """From which SNR on the rate is which."""
    duty = number(sheet, "duty_cycle", 100) / 100
    if sheet.get("modulation") == "lora":
        bandwidth = number(sheet, "bandwidth")
        bits = {sf: sf - 2 * (2**sf / bandwidth >= 0.016) for sf in LORA}
        return [(snr, duty * bits[sf] * bandwidth / 2**sf * 4 / 5) for sf, snr in LORA.items()]
    return [(in_units(snr), duty * in_units(rate)) for snr, rate in sheet.get("rates", ())]


def rate_at(distance: float, sheet: dict[str, Any], exponent: float) -> float:
    """The rate at the mean SNR at a distance through the air."""
    bandwidth = number(sheet, "bandwidth")
    if "snr" in sheet:
        snr, anchor = sheet["snr"].split(" at ")
        received, anchor = in_units(snr), in_units(anchor)
    else:
        anchor = number(sheet, "free_space", 1.0)
        wavelength = 299_792_458 / number(sheet, "frequency")
        loss = 20 * math.log10(4 * math.pi * anchor / wavelength)
        noise = 10 * math.log10(1.380649e-23 * 290 * bandwidth * 1000) + number(
            sheet, "noise_figure"
        )
        received = number(sheet, "tx_power") - loss - noise
    snr = received - 10 * exponent * math.log10(distance / anchor)
    steps = steps_of(sheet)
    if steps:
        return max((rate for least, rate in steps if snr >= least), default=0.0)
    most = number(sheet, "max_rate", 6.0)
    return bandwidth * min(math.log2(1 + 10 ** (snr / 10)), most)


def distances_of(sheet: dict[str, Any], cell: float) -> tuple[float, float]:
    return cell, number(sheet, "range", 10 * cell)


def computed(scenario: dict[str, Any]) -> Row:
    """What follows from a sheet, in a wind of 8 m/s from the west."""
    sheet = scenario["data_sheet"]
    assert sheet["wind"] == "8 m/s from W"
    induced_speed = number(sheet, "induced_speed", 4.03)
    endurance, speed = (in_units(text) for text in sheet["endurance"].split(" at "))
    drag = DRAG
    if "hover" in sheet:
        share = number(sheet, "hover") / endurance
        drag = (share - power(speed, induced_speed, 0.0)) / speed**3
    cruise = number(sheet, "cruise")
    of_cruise = power(cruise, induced_speed, drag)
    slot = endurance * power(speed, induced_speed, drag) / of_cruise / 100
    cell = slot * cruise
    across, with_it, against, still = math.hypot(cruise, 8), abs(cruise - 8), cruise + 8, 8
    north, east, west, hover = (
        cost(power(airspeed, induced_speed, drag) / of_cruise)
        for airspeed in (across, with_it, against, still)
    )
    battery = 100 - number(sheet, "reserve")
    # Something is left of the battery at the end: at least a thousandth.
    cells = math.floor((battery - hover - 0.001) / max(north + north, east + west) + 1e-9)
    exponent = scenario.get("path_loss_exponent", PATH_LOSS_EXPONENT)
    near, far = (rate_at(d, sheet, exponent) for d in distances_of(sheet, cell))
    messages = number(sheet, "data_rate") * slot / number(sheet, "message", 8000)
    return Row(slot, cell, north, east, north, west, hover, near, far, cells * cell, messages)


@pytest.mark.parametrize("text", SHEETS, ids=NAMES)
def test_what_follows_is_what_a_second_computation_says(text):
    scenario = tomllib.loads(SEA + text)
    row = computed(scenario)
    facts = sheet_facts(ScenarioSpace.of(**scenario))
    costs = facts["battery_per_slot"]
    (near, near_rate), (far, far_rate) = facts["rates"]
    told = Row(
        facts["slot_s"],
        facts["cell_m"],
        costs["north"],
        costs["east"],
        costs["south"],
        costs["west"],
        costs["hover"],
        near_rate,
        far_rate,
        facts["reach_m"],
        facts["messages_per_slot"][1],
    )
    assert told == pytest.approx(row, rel=1e-6)
    assert (near, far) == pytest.approx(distances_of(scenario["data_sheet"], row.cell), rel=1e-6)
    steps = steps_of(scenario["data_sheet"])
    assert [tuple(step) for step in facts["steps"]] == [pytest.approx(step) for step in steps]


def printed(value: float) -> str:
    """A number with at least seven digits."""
    if value >= 1e6:
        return f"{value:,.0f}"
    return f"{value:,.7g}"


def test_the_table_of_the_page_has_these_numbers():
    assert len(SHEETS) == len(NAMES) == 10
    rows = []
    for name, text in zip(NAMES, SHEETS, strict=True):
        numbers = [printed(value) for value in computed(tomllib.loads(SEA + text))]
        rows.append(f"| {' | '.join([name, *numbers])} |\n")
    page = PAGE.read_text("utf-8")
    table = r"(^\| sheet \|.*\n\| ---.*\n)(?:\|.*\n)*"
    written = re.sub(table, rf"\g<1>{''.join(rows)}", page, flags=re.M)
    if os.environ.get("DESS_WRITE_PINS"):
        PAGE.write_text(written, "utf-8")
    assert PAGE.read_text("utf-8") == written


def test_the_how_to_says_of_every_field_where_it_stands():
    page = (DOCS / "how-to/data-sheet.md").read_text("utf-8")
    section = page.split("\n## Where a value stands\n")[1].split("\n## ")[0]
    rows = [row.split("|")[1] for row in section.splitlines() if row.startswith("| `")]
    assert sorted(re.findall("`(.*?)`", "".join(rows))) == sorted(DataSheet.model_fields)
