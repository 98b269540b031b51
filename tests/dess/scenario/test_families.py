"""Generated seas: the same everywhere, valid, within reach, and of all numbers of UAVs."""

import hashlib
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, load_scenario
from dess.physics.chart import parking_of, spread
from dess.scenario import families
from dess.scenario.families import FAMILIES, MOST_SEED, SET_FAMILIES, sea_of, seas_of
from dess.scenario.scenario import ScenarioSpace, scenario_description, scenario_names

# What never changes: a sea of each family, as TOML.
HASHES = {
    "scattered:7": "d09a00c22cd03891",
    "clustered:7": "8765eace45cefdce",
    "coast:7": "c0860422834f70ea",
    "archipelago:7": "77ae766b0a8402ff",
    "corridor:7": "afbce02bbee5de3c",
    "dense:7": "69ff6f86cea1bcf0",
    "large:7": "e4a8b5258898f52d",
}


def check(name: str) -> ScenarioSpace:
    """A sea with all that its family promises."""
    space = load_scenario(name)  # which checks that all is on the grid and can be reached
    chart, least = space.chart, space.charge_complete[0]
    columns, rows = space.size
    assert 16 <= min(columns, rows) <= max(columns, rows) <= 64
    assert 6 <= len(space.nodes) <= (100 if name.startswith("dense") else 60)
    assert all(chart.zones[y, x] == -1 for x, y in space.nodes)  # in no zone
    home = spread(chart.zones, chart.parking)[0].reshape(chart.zones.shape)
    assert all(5 * home[y, x] <= 2 * least for x, y in space.nodes)
    assert 1 <= len(space.rectangles) <= 3
    for (*_, width, height), pads in zip(space.rectangles, space.zone_pads, strict=True):
        assert 2 <= min(width, height) <= max(width, height) <= 4 and 1 <= pads <= width * height
    ways = spread(chart.zones, np.array(parking_of(space.rectangles[:1])))[0]
    for x, y, *_ in space.rectangles[1:]:
        assert 0 < ways[y * columns + x] <= 0.8 * least  # a charged UAV comes from the start zone
    assert space.uavs[1] <= space.zone_cells and space.pads is not None
    assert 3 * space.pads >= space.uavs[1]
    assert 60 <= space.quota / space.communication_slots <= 150
    return space


@pytest.mark.parametrize("name", HASHES)
def test_a_sea_never_changes(name):
    assert hashlib.sha256(load_scenario(name).to_toml().encode()).hexdigest()[:16] == HASHES[name]


def test_a_sea_depends_on_its_name_alone():
    """Not on those drawn before it."""
    drawn = load_scenario("archipelago:11").to_toml()
    sea_of("archipelago:11").clear()
    families._fields_of.cache_clear()
    assert load_scenario("archipelago:11").to_toml() == drawn


@pytest.mark.slow
@pytest.mark.brief
def test_a_sea_is_the_same_in_another_process():
    """Whose hashes are others."""
    script = "from dess import load_scenario; print(load_scenario('archipelago:11').to_toml())"
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, cwd=Path(__file__).parents[3])
    assert done.stdout.strip() == load_scenario("archipelago:11").to_toml().strip()


def test_sets_are_disjoint_and_have_seas_of_each_family():
    sizes = {"train": 300, "validation": 10, "test": 60}
    drawn = {name: seas_of(name) for name in sizes}
    for name, size in sizes.items():
        assert len(drawn[name]) == size * len(SET_FAMILIES)
        assert {sea.split(":")[0] for sea in drawn[name]} == {*SET_FAMILIES}
    assert len({sea for name in drawn for sea in drawn[name]}) == sum(map(len, drawn.values()))
    with pytest.raises(InputError, match="'tests' is unknown .did you mean test.*; allowed: train"):
        seas_of("tests")


@given(st.sampled_from([*FAMILIES]), st.integers(0, MOST_SEED))
def test_a_sea_is_a_scenario_as_any(family, seed):
    name = f"{family}:{seed}"
    space = check(name)
    changed = load_scenario(name, uavs=1, no_fly=[])
    assert (changed.uavs, changed.no_fly, changed.nodes) == ((1, 1), (), space.nodes)
    assert f"seed {seed}" in scenario_description(name)
    assert name not in scenario_names()


@pytest.mark.parametrize(
    ("name", "line"),
    [
        ("coast", "coast: has no seed; allowed: coast:0..coast:999999999"),
        ("coast:", "coast: has no seed; allowed: coast:0..coast:999999999"),
        ("coast:x\n7", r"coast: has the seed 'x\\n7'; allowed: coast:0"),
        ("coast:-1", "coast: has the seed '-1'; allowed: coast:0"),
        ("coast:07", "coast: has the seed '07'; allowed: coast:0"),
        ("coast:1000000000", "coast: has the seed '1000000000'; allowed: coast:0"),
        ("coats:7", "coats:7: no such family of seas .did you mean coast.*; allowed: scattered, "),
    ],
)
def test_bad_names_are_refused_in_one_line(name, line):
    with pytest.raises(InputError, match=f"^{line}") as error:
        load_scenario(name)
    assert "\n" not in str(error.value)


def test_a_data_sheet_takes_the_place_of_what_is_drawn_beside_the_sea():
    """Batteries, data and channel follow from the sheet; cells, zones, pads and fleet stay."""
    sheet = {"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min"}
    sheet |= {"bandwidth": "125 kHz", "snr": "12 dB at 2 km", "data_rate": "3 MB/h"}
    drawn = load_scenario("archipelago:7")
    space = load_scenario("archipelago:7", **{f"data_sheet.{n}": v for n, v in sheet.items()})
    for field in ("grid", "rows", "nodes", "no_fly", "zone", "zones", "pads", "uavs"):
        assert getattr(space, field) == getattr(drawn, field), field
    assert (space.cell_size, space.quota, space.flying_time) == (315, 0, (100, 100))
    assert space == load_scenario("archipelago:7", data_sheet=sheet)
    assert load_scenario("archipelago:7", data_sheet=sheet, quota=90).quota == 90
    assert load_scenario("archipelago:7") == drawn
