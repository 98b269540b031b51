"""The WebAssembly module gives the records of the batch engine, byte for byte."""

from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from dess import InputError, load_scenario, policies
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.sequences import add_values, ends_of_what_was_seen, sequence_ends
from dess.analysis.study.prices import Costs
from dess.analysis.wasm import entry, image
from dess.model.batch import simulate_batch
from dess.model.record import Records
from dess.scenario.scenario import ScenarioSpace
from tests import drawn
from tests.compiled import new_sequence
from tests.flown import Engine, fly

FAILURES: dict[str, Any] = {
    "uavs": [1, 4],
    "pads": 1,
    "failures": {
        **{"uav_rate": 0.002, "uav_repair": 30.0, "pad_rate": 0.01, "pad_repair": 20.0},
        **{"node_rate": 0.01, "node_repair": 15.0},
    },
    "age": {"measured": True},
}
FLEET: dict[str, Any] = {
    "uavs": 4,
    "fleet": [{}, {"slots_per_cell": 2, "flying_time": 90}],
    "wind": {"strength": 1.0, "direction": 30.0, "gusts": 0.5},
}
SCENARIOS = {
    "paper with 1 UAV": ("paper", {"uavs": 1}),
    "paper with 3 UAVs": ("paper", {"uavs": 3}),
    "bay": ("bay", {}),
    "jade-bight": ("jade-bight", {}),
    "failures and ages": ("paper", FAILURES),
    "a fleet of types": ("paper", FLEET),
}
# Rates in steps, and nodes of which one makes messages and one has exactly its rate.
SHEET: dict[str, Any] = {
    **{"grid": 16, "nodes": [[2, 2], [12, 5], [8, 14]], "zone": [8, 8, 2, 2], "uavs": 2},
    "data_sheet": {
        **{"endurance": "35 min", "cruise": "15 m/s", "charging": "40 min", "bandwidth": "125 kHz"},
        **{"data_rate": ["3 MB/h", "20 kB/h", "12 MB/h"], "snr": "-12 dB at 1 km"},
        **{"modulation": "lora", "duty_cycle": "40 %", "altitude": "60 m", "horizon": "2 h"},
    },
}
HEURISTICS = ("random", "random-unguarded", "nearest", "greedy", "tour", "age")
ALONE = ("greedy", entry.NETWORK)


def assert_same(space: ScenarioSpace, team: str, seed: int, missions: int) -> None:
    names = team.split(",")
    theirs = fly(space, names, seed, missions)
    records = simulate_batch(space, [policies.load(name) for name in names], seed, missions)
    assert_same_records(theirs, records)


def assert_same_records(theirs: Records, records: Records) -> None:
    assert theirs.missions.tobytes() == records.missions.tobytes()
    assert theirs.uavs.tobytes() == records.uavs.tobytes()
    if len(records.operations):
        assert theirs.operations.tobytes() == records.operations.tobytes()
    else:
        assert np.isnan(theirs.operations.view(np.float64)).all()


@pytest.mark.parametrize("policy", ALONE)
@pytest.mark.parametrize("name", SCENARIOS)
def test_the_module_flies_the_missions_of_the_batch_engine(name: str, policy: str):
    scenario, values = SCENARIOS[name]
    missions = 20 if name == "jade-bight" else 100
    if policy == entry.NETWORK:  # takes ten times as long
        missions //= 4
    assert_same(load_scenario(scenario, **values), policy, 7, missions)


def test_the_module_has_rates_in_steps_and_messages():
    space = ScenarioSpace.of(**SHEET)
    assert min(space.message_rates) < 1 and max(space.message_rates) > 50 and space.radio.steps
    for policy in ALONE:
        assert_same(space, policy, 7, 20)


@pytest.mark.parametrize("team", [*HEURISTICS, "greedy,random", f"random,{entry.NETWORK}"])
def test_the_module_has_all_heuristics_and_teams(team: str):
    assert_same(load_scenario("paper", uavs=3), team, 7, 20)


@pytest.mark.slow
@pytest.mark.parametrize("policy", [*HEURISTICS, entry.NETWORK])
@pytest.mark.parametrize("name", SCENARIOS)
def test_a_thousand_missions_of_each_policy_are_the_same(name: str, policy: str):
    scenario, values = SCENARIOS[name]
    assert_same(load_scenario(scenario, **values), policy, 1, 1000)


@pytest.mark.slow
@settings(max_examples=300, suppress_health_check=list(HealthCheck))
@given(drawn.spaces(), drawn.seeds)
def test_missions_of_drawn_scenarios_are_the_same(space: ScenarioSpace, seed: int):
    if image.explain_refusal(space, ["age"]):
        return
    for policy in ("age", "random", entry.NETWORK):
        assert_same(space, policy, seed, 3)


def test_a_mission_simulated_slot_by_slot_is_the_same():
    """A player shows the state after each slot."""
    space = load_scenario("paper", uavs=2)
    engine = Engine(image.make_image(space, ["greedy"], 7, 3))
    engine.call("launch", 2.0)
    slots = 0
    while not engine.call("advance", 1.0):
        slots += 1
        assert engine.read("missions")["slot"][0] == slots
    record = simulate_batch(space, policies.load("greedy"), 7, [2])
    assert engine.read("mission_records")[:1].tobytes() == record.missions.tobytes()


def test_missions_leave_no_memory_behind():
    engine = Engine(image.make_image(load_scenario("jade-bight"), ["greedy"], 7, 5))
    engine.call("play", 0.0, 5)
    size = engine.memory_size()
    engine.call("play", 5.0, 5)
    assert engine.memory_size() == size


PRICES: dict[str, Any] = {
    **{"uav": 1000.0, "pad": 300.0, "charge": 0.4, "hour": 7.0, "lost_uav": 900.0},
    "slot_seconds": 12.0,
}
PLANS: dict[str, dict[str, Any]] = {
    "of a number of missions": {"missions": 3},
    "of a year": {"years": 5, "interest": 0.04, "days": 250, "pack": 350.0},
    "of a year without interest": {"years": 3, "days": 12, "pack_cycles": 150.0},
}


@pytest.mark.parametrize("plan", PLANS)
@pytest.mark.parametrize("fleet", [[], [{"price": 1234.5, "flying_time": 60}, {}]])
def test_metrics_costs_and_sums_are_those_of_the_records(fleet, plan):
    space = load_scenario("paper", **FAILURES, fleet=fleet)
    costs = Costs(**PRICES, **PLANS[plan])
    engine = Engine(image.make_image(space, ["greedy"], 7, 30, costs=costs))
    engine.call("play", 0.0, 30)
    engine.call("measure", 30)
    engine.call("begin", 0)
    engine.call("add", 10)
    records = engine.records()
    values = dict(zip(entry.METRICS, engine.read("values").T, strict=True))
    for name in entry.METRICS[:5]:
        assert values[name].tolist() == records.missions[name].tolist()
    for name in records.operations.dtype.names or ():
        np.testing.assert_array_equal(values[name], records.operations[name])
    parts = parts_of(costs, space, records)
    assert values["cost"].tolist() == sum(parts.values()).tolist()
    totals = dict(zip(entry.METRICS, engine.read("totals"), strict=True))
    for name, column in values.items():
        measured = column[:10][~np.isnan(column[:10])].tolist()
        squares = [value * value for value in measured]
        ends = [min(measured), max(measured)] if measured else [0.0, 0.0]
        expected = [len(measured), _sum(measured), _sum(squares), *ends]
        assert totals[name].tolist() == expected


def parts_of(costs: Costs, space: ScenarioSpace, records: Records) -> dict[str, np.ndarray]:
    """The parts of the cost of missions, as Python computes them."""
    columns = {name: records.missions[name] for name in ("uavs", "slots", "flying_time")}
    columns["point"] = np.zeros(len(records.missions), int)
    flown = np.arange(records.uavs.shape[1]) < columns["uavs"][:, None]
    uavs = {name: records.uavs[name][flown] for name in ("charged", "down", "battery")}
    return costs.parts([space], columns, uavs)


def test_a_year_of_a_sheet_pays_for_the_packs_of_each_type():
    """A pack wears by the full battery of its own type, and all pads are paid for."""
    types = [{"endurance": "20 min", "price": 900.0}, {}]
    space = load_scenario("jade-bight", uavs=2, fleet=types)
    costs = Costs(uav=1000.0, pad=300.0, charge=2.0, years=5, days=250, pack=350.0)
    settings = {"pads": [1, 2], "zones.pads": [1, 2], "data_sheet.wind": ["4 m/s from SW"]}
    made = image.make_image(space, ["greedy"], 7, 5, settings, costs)
    engine = Engine(made)
    for slider in made.sliders:
        slider.apply(made.arrays, slider.values[-1])
    engine.lay_out(made)
    engine.call("play", 0.0, 5)
    engine.call("measure", 5)
    changed = ScenarioSpace.of(space, **{name: values[-1] for name, values in settings.items()})
    records = simulate_batch(changed, [policies.load("greedy")], 7, 5)
    assert_same_records(engine.records(), records)
    parts = parts_of(costs, changed, records)
    assert parts["packs"].min() > 0
    assert engine.read("values")[:, -1].tolist() == sum(parts.values()).tolist()


def test_intervals_of_means_and_differences_are_the_confidence_sequences():
    space = load_scenario("paper", uavs=2)
    engine = Engine(image.make_image(space, ["greedy"], 7, 60))
    engine.call("play", 0.0, 60)
    engine.call("measure", 60)
    before = engine.read("values")
    engine.lay_out(image.make_image(space, ["random"], 7, 60))
    engine.call("play", 0.0, 60)
    engine.call("measure", 60)
    ratio = entry.METRICS.index("collection_ratio")
    values = engine.read("values")
    for is_difference, least in ((0, 0.0), (1, -1.0)):
        if is_difference:
            engine.write("baseline", before)
            engine.call("subtract", 60)
            values = values - before
        engine.call("begin", is_difference)
        engine.call("add", 60)
        sequence = new_sequence(least, 1.0)
        add_values(sequence, values[:, ratio].copy())
        *ends, low_seen, high_seen = engine.read("ends")[ratio]
        assert tuple(ends) == sequence_ends(sequence) != (least, 1.0)
        assert (low_seen, high_seen) == ends_of_what_was_seen(sequence)


def test_the_interval_of_costs_allows_for_losses_at_the_prices_of_the_reader():
    """The fleet is bought anyway; at the most, all UAVs are lost, and the mission takes longest."""
    space = load_scenario("paper", uavs=[1, 2], max_slots=300)
    costs = Costs(uav=100.0, pad=10.0, missions=50, slot_seconds=12.0)
    engine = Engine(image.make_image(space, ["greedy"], 7, 60, costs=costs))
    prices = dict(zip(entry.PRICES, engine.read("prices"), strict=True))
    prices |= {"lost_uav": 900.0, "hour": 6.0}
    engine.write("prices", np.array([*prices.values()]))
    engine.call("play", 0.0, 60)
    engine.call("measure", 60)
    engine.call("begin", 0)
    engine.call("add", 60)
    cost = entry.METRICS.index("cost")
    failure = 50 * (2 * 900.0 + 6.0 * 300 * 12 / 3600)
    assert engine.read("bounds")[cost].tolist() == [
        100.0 + 10.0 * space.charging_pads,
        np.inf,
        failure,
        1 - LEVEL,
    ]
    sequence = new_sequence(engine.read("bounds")[cost, 0], np.inf, 1 - LEVEL, failure)
    add_values(sequence, engine.read("values")[:, cost].copy())
    assert tuple(engine.read("ends")[cost, :2]) == sequence_ends(sequence)
    engine.write("bounds", engine.read("bounds"))
    engine.call("begin", 1)  # of differences, with the bounds that the caller has written
    assert engine.read("sequences")[cost]["failure"] == failure


def _sum(values: list[float]) -> float:
    total = 0.0
    for value in values:
        total += value
    return total


SETTINGS: dict[str, list[Any]] = {
    "uavs": [1, 2, 6],
    "pads": [1, 4, 16],
    "arrival_rate": [0.0, 0.01, 0.05],
    "max_slots": [100, 500],
    "charge_rate": [1, 5, 7],
    "failures.uav_rate": [0.0, 0.01],
}


def test_a_slider_makes_the_arrays_that_python_makes_for_its_value():
    space = load_scenario("paper")
    made = image.make_image(space, ["greedy"], 7, 5, SETTINGS)
    for slider in made.sliders:
        for value in slider.values:
            changed = ScenarioSpace.of(space, **{slider.setting: value})
            expected = image.make_image(changed, ["greedy"], 7, 5, {"uavs": [1, 6]}).arrays
            arrays = image.copy_inputs(made.arrays)
            slider.apply(arrays, value)
            for name in arrays:
                assert arrays[name].tobytes() == expected[name].tobytes(), (slider.setting, name)
    with_recipe = {slider.setting for slider in made.sliders if slider.recipe}
    assert with_recipe == {"uavs", "pads", "arrival_rate", "max_slots", "charge_rate"}


@pytest.mark.parametrize("policy", ALONE)
def test_sliders_that_are_moved_together_give_the_records_of_the_changed_scenario(policy: str):
    values = {"uavs": 6, "pads": 1, "arrival_rate": 0.05, "max_slots": 100}
    made = image.make_image(load_scenario("paper"), [policy], 7, 10, SETTINGS)
    engine = Engine(made)
    for slider in made.sliders:
        if slider.setting in values:
            slider.apply(made.arrays, values[slider.setting])
    engine.lay_out(made)
    engine.call("play", 0.0, 10)
    records = simulate_batch(load_scenario("paper", **values), policies.load(policy), 7, 10)
    assert_same_records(engine.records(), records)


def test_what_the_module_cannot_fly_is_refused_with_a_sentence():
    packets = load_scenario("paper", arrivals={"process": "continuous"})
    large = load_scenario("paper", grid=120, no_fly=[[50, 50]])
    for space, team in ((packets, "greedy"), (large, "greedy"), (load_scenario(), "planner")):
        why = image.explain_refusal(space, [team])
        assert why.endswith(".")
        with pytest.raises(InputError, match=why.split(",")[0]):
            image.make_image(space, [team])
    with pytest.raises(InputError, match="the largest fleet has 1 UAV"):
        image.make_image(load_scenario(uavs=1), ["greedy", "random"])
    with pytest.raises(InputError, match="shape"):
        image.make_image(load_scenario(), ["greedy"], settings={"communication_slots": [4, 5]})
    with pytest.raises(InputError, match="same words"):
        rates = {"failures.uav_rate": [0.0, 0.01], "failures.pad_rate": [0.0, 0.01]}
        image.make_image(load_scenario(), ["greedy"], settings=rates)
