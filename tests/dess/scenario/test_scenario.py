"""Scenarios: TOML in and out, refusals in one clear line, and the draws of a space."""

import math
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from dess import InputError, streams
from dess.channel import world_of
from dess.files.parsing import parse_toml
from dess.scenario import (
    SAMPLED,
    Scenario,
    ScenarioSpace,
    load_scenario,
    scenario_names,
)
from dess.state import check_seed, constants_of, sample_scenario, spaces_of
from tests.drawn import replications, scenarios, seeds, spaces


def _load_text(text: str, folder: Path) -> ScenarioSpace:
    path = folder / "scenario.toml"
    path.write_text(text, "utf-8")
    return load_scenario(path)


# --- TOML ---


@given(spaces())
def test_a_space_survives_toml(space: ScenarioSpace) -> None:
    values = parse_toml(space.to_toml(), "text")
    assert ScenarioSpace.of(**values) == space


def test_the_shipped_scenarios_are_the_papers_and_a_bay() -> None:
    assert scenario_names() == ["bay", "fig1", "fig4", "paper"]
    paper, fig4 = load_scenario("paper"), load_scenario("fig4")
    assert paper == ScenarioSpace.of()  # Section VI-A and Table II are the defaults
    assert (paper.uavs, paper.initial_data, paper.flying_time) == ((1, 3), (5.0, 20.0), (70, 80))
    assert (paper.charge_start, paper.charge_complete) == ((10, 50), (60, 100))
    assert (fig4.uavs, fig4.initial_data, fig4.flying_time) == ((1, 3), (12.5, 12.5), (80, 80))
    assert (fig4.charge_start, fig4.charge_complete) == ((30, 30), (80, 80))
    for space in (paper, fig4):
        assert (space.grid, space.cell_size, space.altitude) == (32, 800.0, 10.0)
        assert (space.communication_slots, space.quota, space.arrival_rate) == (4, 440, 0.02)
        assert (space.path_loss_exponent, space.shadowing_variance) == (2.27, 2.0)
        assert (space.zone, space.max_slots, space.pads) == ((26, 2, 4, 4), 500, None)
        assert sorted(space.nodes) == [
            (x, y) for x in (3, 8, 13, 18, 23) for y in (6, 11, 16, 21, 26)
        ]
        rewards = (space.reward_data, space.reward_overruled, space.reward_depleted)
        assert rewards == (1.3, -1.0, -300.0)
        rewards = (space.reward_charging, space.reward_quota, space.reward_step)
        assert rewards == (0.05, 100.0, -0.1)


# --- refusals ---

REFUSED = [
    ({"speed": 3}, "speed", "unknown key"),
    ({"uavs": 2.0}, "uavs", "2.0"),
    ({"uavs": True}, "uavs", "True"),
    ({"uavs": "2"}, "uavs", "'2'"),
    ({"uavs": 0}, "uavs", "1..16"),
    ({"uavs": 17}, "uavs", "1..16"),
    ({"uavs": [3, 1]}, "uavs", "1..16"),
    ({"uavs": [1, 2, 3]}, "uavs", "too long"),
    ({"grid": "32"}, "grid", "integer"),
    ({"grid": 32.0}, "grid", "integer"),
    ({"grid": 1}, "grid", "2..256"),
    ({"cell_size": 0}, "cell_size", "0.01..100,000"),
    ({"cell_size": True}, "cell_size", "number"),
    ({"altitude": float("inf")}, "altitude", "out of range"),
    ({"edge_snr": float("nan")}, "edge_snr", "out of range"),
    ({"nodes": []}, "nodes", "too short; allowed: [x, y] for each (of length 1..1,024)"),
    ({"nodes": [[1, 2, 3]]}, "nodes.0", "too long"),
    ({"nodes": [[1.5, 2]]}, "nodes.0.0", "integer"),
    ({"nodes": [[0, 0], [32, 0]]}, "nodes: [32, 0]", "0 <= x, y < 32"),
    ({"nodes": [[0, -1]]}, "nodes: [0, -1]", "0 <= x, y < 32"),
    ({"nodes": [[4, 5], [6, 7], [4, 5]]}, "nodes: [4, 5]", "distinct"),
    ({"zone": [29, 2, 4, 4]}, "zone: [29, 2, 4, 4]", "x + width"),
    ({"zone": [-1, 2, 4, 4]}, "zone: [-1, 2, 4, 4]", "0 <= x"),
    ({"zone": [0, 0, 0, 4]}, "zone: [0, 0, 0, 4]", "allowed"),
    ({"zone": [1, 2, 3]}, "zone", "too short"),
    ({"pads": 17}, "pads: 17", "1..16"),
    ({"pads": 0}, "pads", "an integer from 1"),
    ({"forbid_swaps": 1}, "forbid_swaps", "true or false"),
    ({"communication_slots": 0}, "communication_slots", "1..64"),
    ({"max_slots": 0}, "max_slots", "1..100,000"),
    ({"shadowing_variance": -0.1}, "shadowing_variance", "0..400"),
    ({"arrival_rate": 101}, "arrival_rate", "0..100"),
    ({"arrival_rate": -1}, "arrival_rate", "0..100"),
    ({"quota": 0}, "quota", "1..1,000,000"),
    ({"initial_data": -1}, "initial_data", "0 <= low <= high"),
    ({"initial_data": [5, 4]}, "initial_data", "0 <= low <= high"),
    ({"initial_data": True}, "initial_data", "True"),
    ({"flying_time": 101}, "flying_time", "1..100"),
    ({"flying_time": [0, 5]}, "flying_time", "1..100"),
    ({"charge_start": 9}, "charge_start", "10..100"),
    ({"flight_cost": 2}, "flight_cost", "0..1"),
    ({"flight_cost": -1}, "flight_cost", "0..1"),
    ({"charge_complete": 101}, "charge_complete", "10..100"),
    ({"charge_start": 60}, "charge_start: 60", "10 <= charge_start < charge_complete <= 100"),
    ({"charge_start": [10, 70]}, "charge_start: 70", "charge_complete 60"),
]


@pytest.mark.parametrize(("values", "key", "allowed"), REFUSED, ids=lambda v: str(v)[:40])
def test_bad_values_are_refused_in_one_line(values: dict, key: str, allowed: str) -> None:
    with pytest.raises(InputError) as error:
        load_scenario("paper", **values)
    line = str(error.value)
    assert "\n" not in line
    assert line.startswith(f"scenario paper: {key}")
    assert allowed in line


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        (b"uavs = [1, 3", "not valid TOML"),
        (b"uavs = 1\nuavs = 2\n", "not valid TOML"),
        (b"\xff\xfe\x00", "cannot be read"),
        (b"quotas = 3\n", "quotas: unknown key"),
    ],
)
def test_bad_files_are_named(tmp_path: Path, content: bytes, complaint: str) -> None:
    path = tmp_path / "bad.toml"
    path.write_bytes(content)
    with pytest.raises(InputError) as error:
        load_scenario(path)
    assert "\n" not in str(error.value)
    assert str(error.value).startswith(f"{path}: {complaint}")


def test_missing_files_and_folders_are_refused(tmp_path: Path) -> None:
    with pytest.raises(
        InputError, match="no such scenario; allowed: bay, fig1, fig4, paper, or a TOML file"
    ):
        load_scenario("none")
    with pytest.raises(InputError, match=r"no such scenario \(did you mean paper\?\)"):
        load_scenario("papper")
    with pytest.raises(InputError, match="cannot be read"):
        load_scenario(tmp_path)


@pytest.mark.parametrize("values", [(-1, 0), (2**64, 0), (0, -1), (0, 2**32)])
def test_seeds_off_the_counter_are_refused(values: tuple[int, int]) -> None:
    with pytest.raises(InputError, match="out of range; allowed: 0.."):
        check_seed(*values)
    check_seed(streams.MAX_SEED, streams.MAX_REPLICATION)


# --- sampling ---


def test_both_ends_of_every_range_are_drawn_about_equally_often() -> None:
    space = load_scenario("paper")
    drawn = [sample_scenario(space, 11, replication) for replication in range(3000)]
    for name in SAMPLED:
        low, high = getattr(space, name)
        values = np.array([getattr(scenario, name) for scenario in drawn])
        assert values.min() == low
        assert values.max() == high
        counts = np.bincount(values - low, minlength=high - low + 1)
        expected = len(drawn) / len(counts)
        # 5 standard deviations of a binomial count: about 1e-6 per value.
        assert abs(counts - expected).max() < 5 * np.sqrt(expected)


@given(spaces(), seeds, replications, st.sampled_from(SAMPLED))
def test_fixing_one_field_leaves_the_other_draws(
    space: ScenarioSpace, seed: int, replication: int, name: str
) -> None:
    free = sample_scenario(space, seed, replication)
    for name_of in SAMPLED:
        low, high = getattr(space, name_of)
        assert low <= getattr(free, name_of) <= high
    fixed = ScenarioSpace.of(space, **{name: getattr(space, name)[1]})
    drawn = sample_scenario(fixed, seed, replication)
    assert getattr(drawn, name) == getattr(space, name)[1]
    for other in set(SAMPLED) - {name}:
        assert getattr(drawn, other) == getattr(free, other)


@given(scenarios(), seeds, replications)
def test_a_scenario_is_a_space_of_one(scenario: Scenario, seed: int, replication: int) -> None:
    (space,) = spaces_of([scenario])
    assert spaces_of([space]) == [space]
    assert sample_scenario(space, seed, replication) == scenario


# --- the arrays made of it ---


@given(scenarios())
def test_constants_are_the_scenarios(scenario: Scenario) -> None:
    (space,) = spaces_of([scenario])
    (mission,) = constants_of(space)
    for name in set(mission.dtype.names) & set(Scenario.model_fields) - {"nodes", "pads"}:
        assert mission[name] == getattr(scenario, name)
    assert mission["nodes"] == len(scenario.nodes)
    assert mission["pads"] == (scenario.pads or scenario.zone[2] * scenario.zone[3])
    zone = [mission[f"zone_{name}"] for name in ("x", "y", "width", "height")]
    assert tuple(zone) == scenario.zone
    assert (mission["initial_low"], mission["initial_high"]) == scenario.initial_data
    length = scenario.slot_length / scenario.communication_slots
    assert mission["communication_slot_length"] == length
    assert mission["shadowing_deviation"] == pytest.approx(scenario.shadowing_variance**0.5)


@given(scenarios(), st.data())
def test_the_path_loss_table_is_eq_10(scenario: Scenario, data: st.DataObject) -> None:
    (space,) = spaces_of([scenario])
    m, grid = scenario.communication_slots, scenario.grid
    coarse = data.draw(st.integers(0, grid - 1))
    fine = data.draw(st.integers(0, m * (grid - 1)))
    distance = np.sqrt(
        (scenario.cell_size * coarse) ** 2
        + (scenario.cell_size * fine / m) ** 2
        + scenario.altitude**2
    )
    edge = np.sqrt(2) / 2 * grid * scenario.cell_size
    snr = 10 ** (scenario.edge_snr / 10) * (distance / edge) ** -scenario.path_loss_exponent
    assert world_of(space).mean_snr[coarse, fine] == pytest.approx(10 * np.log10(snr), abs=1e-9)


# --- limits ---


def test_values_at_the_limits_are_allowed_and_those_beyond_are_not() -> None:
    space = ScenarioSpace.of(charge_start=10, charge_complete=100)
    fields = (*SAMPLED, "pads", "quota", "arrival_rate", "communication_slots", "edge_snr")
    for field in fields:
        low, high = space.limits(field)
        kind = type(getattr(space, field)[0] if field in SAMPLED else getattr(space, field) or 1)
        assert low < high < math.inf
        for allowed in (low, high):
            if (field, allowed) not in {("charge_start", 100), ("charge_complete", 10)}:
                ScenarioSpace.of(space, **{field: kind(allowed)})
        for refused in (low - 1, high + 1):
            with pytest.raises(InputError, match=field):
                ScenarioSpace.of(space, **{field: kind(refused)})


def test_no_number_of_a_scenario_is_minus_zero() -> None:
    """Compiled code divides by rates, and by -0.0 with another result than by 0.0."""
    space = load_scenario("paper")
    allowed = {name: space.limits(name) for name in space.numeric}
    values = {
        name: -0.0
        for name, (low, high) in allowed.items()
        if low <= 0 <= high and isinstance(space.value(name), float)
    }
    assert {"arrival_rate", "shadowing_variance", "wind.direction", "failures.uav_rate"} < {*values}
    values |= {
        "initial_data": [-0.0, -0.0],
        "arrivals.process": "continuous",
        "arrivals.rates": [-0.0] * 25,
        "arrivals.schedule": [[-0.0, -0.0], [5, 1]],
    }
    dumped = ScenarioSpace.of(space, **values).model_dump_json()
    assert "-0.0" not in dumped
    assert '"schedule":[[0.0,0.0],[5.0,1.0]]' in dumped
