"""Scenarios: TOML in and out, refusals in one clear line, and the draws of a space."""

import re
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError
from dess.base.files.reading import parse_toml
from dess.model.state import check_seed, sample_scenario, spaces_of
from dess.physics import streams
from dess.physics.age import MOST_AGES
from dess.physics.chart import spread
from dess.scenario.fields import SAMPLED
from dess.scenario.scenario import (
    ScenarioSpace,
    load_scenario,
    scenario_description,
    scenario_names,
)
from tests.drawn import continuous_spaces, extended_spaces, replications, seeds, spaces


@given(spaces() | extended_spaces() | continuous_spaces())
def test_a_space_survives_toml(space):
    assert ScenarioSpace.of(**parse_toml(space.to_toml(), "text")) == space


BAYS = ("biscay-corner", "galway-bay", "german-bight", "gulf-of-finland", "kattegat", "oresund")
BAYS += ("puget-sound", "san-francisco-bay", "saronic-gulf", "tokyo-bay")


@pytest.mark.parametrize("name", BAYS)
def test_bays_have_land_and_invented_nodes_within_reach(name):
    bay = load_scenario(name)
    assert 24 <= min(bay.size) <= max(bay.size) <= 64 and bay.rows
    assert 2 <= bay.uavs[0] <= bay.uavs[1] <= 5
    assert 100 < len(bay.no_fly) < 0.8 * bay.size[0] * bay.size[1]
    home = spread(bay.chart.zones, bay.chart.parking)[0].reshape(bay.chart.zones.shape)
    assert all(home[y, x] <= 27 for x, y in bay.nodes)
    assert "coarse" in scenario_description(name) and "invented" in scenario_description(name)


def test_the_shipped_scenarios_are_the_papers_and_bays():
    assert scenario_names() == sorted(
        ["bay", "fig1", "fig4", "jade-bight", "jade-lora", "new-jersey", "paper", *BAYS]
    )
    assert sum(len(load_scenario(name).zones) for name in BAYS) == 8
    paper, fig4 = load_scenario("paper"), load_scenario("fig4")
    assert paper == ScenarioSpace.of()  # Section VI-A, Table II and Table III are the defaults
    names = ("uavs", "initial_data", "flying_time", "charge_start", "charge_complete")
    ranges = [[getattr(space, name) for name in names] for space in (paper, fig4)]
    assert ranges[0] == [(1, 3), (5.0, 20.0), (70, 80), (10, 50), (60, 100)]
    assert ranges[1] == [(1, 3), (12.5, 12.5), (80, 80), (30, 30), (80, 80)]
    assert (paper.grid, paper.cell_size, paper.altitude, paper.max_slots) == (32, 800, 10, 500)
    assert (paper.communication_slots, paper.quota, paper.arrival_rate) == (4, 440, 0.02)
    assert (paper.path_loss_exponent, paper.shadowing_variance) == (2.27, 2.0)
    assert (paper.zone, paper.charging_pads, len(paper.nodes)) == ((26, 2, 4, 4), 16, 25)
    rewards = {name: value for name, value in paper if name.startswith("reward")}
    assert [*rewards.values()] == [1.3, -1.0, -300.0, 0.05, 100.0, -0.1]


# --- refusals ---

SPEEDS = [{"slots_per_cell": s} for s in (5, 7, 8)]
FAILING = {"failures.pad_rate": 0.1}
# Fields of the paper's scenario, and what the message says of the last of them, and allows.
REFUSED: list[tuple[dict[str, Any], str, str]] = [
    *(({"uavs": value}, "", "") for value in (2.0, True, "2", [1, 2, 3])),
    *(
        ({"uavs": value}, "", "1..16, one for each cell of the start zone")
        for value in (0, 17, [3, 1])
    ),
    ({"edge_snr": float("nan")}, "out of range", ""),
    ({"nodes": [[0, 0], [32, 0]]}, "[32, 0] is off the grid", "0 <= x, y < 32"),
    ({"nodes": [[4, 5], [6, 7], [4, 5]]}, "[4, 5] is listed twice", "distinct"),
    *(({"zone": zone}, f"{zone}", "x + width") for zone in ([29, 2, 4, 4], [0, 0, 0, 4])),
    ({"zone": [-1, 2, 4, 4]}, "[-1, 2, 4, 4]", "0 <= x"),
    ({"pads": 17}, "17 is more than the zone has cells", "1..16"),
    ({"initial_data": -1}, "is not a range", "0 <= low <= high"),
    ({"initial_data": [5, 4]}, "is not a range", "0 <= low <= high"),
    ({"flying_time": [0, 5]}, "[0, 5] is out of range", "1..100"),
    ({"charge_start": 60}, "60 is not below charge_complete 60", "eq. 1"),
    ({"grid": 256, "nodes": [[0, 0]], "fleet": SPEEDS, "communication_slots": 64}, "", "<= 1"),
    (
        {"max_slots": MOST_AGES // 4 + 1, "age.measured": True},
        "too many",
        f"<= {MOST_AGES}",
    ),
    ({"arrivals": {"buffer": 3}}, "slotted arrivals have no", "continuous"),
    ({"arrivals": {"process": "continuous", "rates": [0.1]}}, "there are 1", "25"),
    ({"arrivals": {"process": "continuous", "schedule": [[3, 1], [3, 2]]}}, "slot 3 comes", ""),
    ({"arrivals.process": "continuous", "arrival_rate": 99, "max_slots": 1000}, "packets", ""),
    ({"failures.pad_repair": 0.5}, "0.5 is less than a slot", "0, or 1 and more"),
    (FAILING | {"zone": [0, 0, 13, 5]}, "65 are too many to fail", "64 at most"),
]


@pytest.mark.parametrize(("values", "problem", "allowed"), REFUSED, ids=lambda v: str(v)[:40])
def test_bad_values_are_refused_in_one_line(values, problem, allowed):
    with pytest.raises(InputError) as error:
        load_scenario("paper", **values)
    line = str(error.value)
    assert re.match(r"scenario paper: [\w., ]+: \S", line) and "\n" not in line
    told, _, end = line.partition("; allowed: ")
    assert problem in told and allowed in end


def test_what_just_fits_is_allowed():
    load_scenario("paper", max_slots=MOST_AGES // 4, **{"age.measured": True})
    load_scenario("paper", zone=[0, 0, 13, 5], pads=64, **FAILING)


def test_bad_files_are_named(tmp_path):
    path = tmp_path / "bad.toml"
    for content, complaint in (
        (b"uavs = 1\nuavs = 2\n", "not valid TOML"),
        (b"\xff\xfe\x00", "cannot be read"),
        (b"quotas = 3\n", "quotas: unknown key"),
    ):
        path.write_bytes(content)
        with pytest.raises(InputError, match=f"^{path}: {complaint}.*$"):
            load_scenario(path)


@pytest.mark.parametrize("values", [(-1, 0), (2**64, 0), (0, -1), (0, 2**32)])
def test_seeds_off_the_counter_are_refused(values):
    with pytest.raises(InputError, match="out of range; allowed: 0.."):
        check_seed(*values)
    check_seed(streams.MAX_SEED, streams.MAX_REPLICATION)


# --- sampling ---


def test_both_ends_of_every_range_are_drawn_about_equally_often():
    space = load_scenario("paper")
    drawn = [sample_scenario(space, 11, replication) for replication in range(3000)]
    for name in SAMPLED:
        low, high = getattr(space, name)
        counts = np.bincount([getattr(scenario, name) - low for scenario in drawn])
        assert len(counts) == high - low + 1
        expected = len(drawn) / len(counts)
        # 5 standard deviations of a binomial count: about 1e-6 per value.
        assert abs(counts - expected).max() < 5 * np.sqrt(expected)


@given(spaces(), seeds, replications, st.sampled_from(SAMPLED))
def test_fixing_one_field_leaves_the_other_draws(space, seed, replication, name):
    free = sample_scenario(space, seed, replication)
    assert sample_scenario(spaces_of([free])[0], seed, replication) == free
    fixed = ScenarioSpace.of(space, **{name: getattr(space, name)[1]})
    drawn = sample_scenario(fixed, seed, replication)
    for other in SAMPLED:
        low, high = getattr(space, other)
        assert low <= getattr(free, other) <= high
        assert getattr(drawn, other) == (high if other == name else getattr(free, other))


# --- limits ---


# C_S must be below C_C, and no quota needs landing.
NOT_ALONE = [("charge_start", 100), ("charge_complete", 10), ("quota", 0)]


def test_values_at_the_limits_are_allowed_and_those_beyond_are_not():
    space = ScenarioSpace.of(charge_start=10, charge_complete=100)
    fields = (*SAMPLED, "pads", "quota", "arrival_rate", "communication_slots", "edge_snr")
    for field in fields:
        low, high = space.limits(field)
        kind = type(getattr(space, field)[0] if field in SAMPLED else getattr(space, field) or 1)
        for allowed in (low, high):
            if (field, allowed) not in NOT_ALONE:
                ScenarioSpace.of(space, **{field: kind(allowed)})
        for refused in (low - 1, high + 1):
            with pytest.raises(InputError, match=field):
                ScenarioSpace.of(space, **{field: kind(refused)})


def test_the_snr_is_known_at_no_distance_near_zero():
    """The ratio of a distance to it would overflow."""
    assert load_scenario("paper", **{"radio.anchor": 0.001}).radio.anchor == 0.001
    with pytest.raises(
        InputError, match="radio.anchor: 1e-308 m is too near; allowed: 0, or 0.001"
    ):
        load_scenario("paper", **{"radio.anchor": 1e-308})


def test_no_number_of_a_scenario_is_minus_zero():
    """Compiled code divides by rates, and by -0.0 with another result than by 0.0."""
    space = load_scenario("paper")
    values: dict[str, Any] = {
        name: -0.0
        for name in space.numeric
        if space.limits(name)[0] <= 0 and isinstance(space.value(name), float)
    }
    assert {"arrival_rate", "shadowing_variance", "wind.direction", "failures.uav_rate"} < {*values}
    values |= {"initial_data": [-0.0, -0.0], "arrivals.process": "continuous"}
    values |= {"arrivals.rates": [-0.0] * 25, "arrivals.schedule": [[-0.0, -0.0], [5, 1]]}
    dumped = ScenarioSpace.of(space, **values).model_dump_json()
    assert "-0.0" not in dumped and '"schedule":[[0.0,0.0],[5.0,1.0]]' in dumped
