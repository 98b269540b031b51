"""What missions share, and what is kept from one simulation to the next, follows every field.

Tables are kept by what they are computed from. If a key lacked a field, the missions of scenarios
that differ in it would share a table that is right for one of them.
"""

import sys
from collections.abc import Iterator
from copy import deepcopy
from typing import Any

from dess import policies
from dess.model.batch import simulate_batch
from dess.model.reach import reach_of_nodes
from dess.model.state import constants_of
from dess.model.ways import Ways
from dess.policies.planner.policy import Budget, Planner
from dess.scenario import fields
from dess.scenario.scenario import ScenarioSpace
from tests.dess.model.flights import is_same
from tests.drawn import Fidget, Script

BASE = ScenarioSpace.of(
    **{"grid": 9, "rows": 8, "zone": [2, 3, 3, 2], "nodes": [[0, 0], [3, 1], [8, 7], [1, 6]]},
    **{"zones": [{"cells": [7, 0, 2, 1], "pads": 2}], "no_fly": [[5, 1], [5, 2], [5, 3], [5, 4]]},
    **{"uavs": 5, "pads": 2, "flying_time": 24, "charge_start": 20, "charge_complete": 40},
    **{"quota": 130, "max_slots": 60, "communication_slots": 5, "names": ["a", "b", "c", "d"]},
    **{"fleet": [{"slots_per_cell": 1}, {"slots_per_cell": 2}]},
)
FAILING = {"uav_rate": 0.02, "pad_rate": 0.1, "node_rate": 0.1, "node_repair": 5.0}
STEPS = [[-40, 0.1], [-30, 0.5]]
# Scenarios of whose fields each is changed, alone or with one that it needs.
VARIED: dict[str, Any] = {
    "grid": 10,
    "rows": 9,
    "cell_size": 300.0,
    "altitude": 700.0,
    "nodes": [[0, 0], [3, 1], [8, 7], [2, 6]],
    "zone": [2, 4, 3, 2],
    "pads": 1,
    "zones": [{"cells": [6, 5, 2, 1], "pads": 1}],
    "no_fly": [[5, 1], [5, 2], [4, 1], [6, 4]],
    "forbid_swaps": not BASE.forbid_swaps,
    "slot_length": 2.0,
    "communication_slots": 4,
    "max_slots": 50,
    "landing": True,
    "charge_rate": 5.5,
    "flight_cost": 0,
    "edge_snr": -20.0,
    "path_loss_exponent": 3.0,
    "shadowing_variance": 6.0,
    "initial_data": (6.0, 21.0),
    "arrival_rate": 0.3,
    "quota": 100,
    "reward_data": 1.0,
    "reward_overruled": -7.0,
    "reward_depleted": -5.0,
    "reward_charging": 0.5,
    "reward_quota": 7.0,
    "reward_step": -0.3,
    "uavs": 4,
    "flying_time": 33,
    "charge_start": 25,
    "charge_complete": 50,
    "arrivals.rates": [0.1, 0.5, 0.02, 0.3],
    "arrivals.initial": [9.0, 8.0, 7.0, 30.0],
    "arrivals.message": {"message": 0.5, "rates": [0.1, 0.5, 0.02, 0.3]},
    "arrivals.merged": [1, 2, 3, 1],
    "age.measured": True,
    "age.reward": {"measured": True, "reward": -0.1},
    "charging.order": "lowest-battery",
    "charging.power": 6,
    "charging.measured": True,
    "charging.plan_waits": {"plan_waits": True, "power": 6},
    "radio.anchor": 500.0,
    "radio.range": 3000.0,
    "radio.max_rate": 0.2,
    "radio.steps": STEPS,
    "radio.duty_cycle": 0.5,
    "failures.uav_rate": {**FAILING, "uav_rate": 0.1},
    "failures.uav_repair": {**FAILING, "uav_repair": 4.0},
    "failures.uav_data": {**FAILING, "uav_data": "lost"},
    "failures.pad_rate": {**FAILING, "pad_rate": 0.5},
    "failures.pad_repair": {**FAILING, "pad_repair": 8.0},
    "failures.pad_rates": {"pad_rates": [0.1, 0.4]},
    "failures.pad_repairs": {"pad_rates": [0.1, 0.4], "pad_repairs": [2.0, 9.0]},
    "failures.node_rate": {**FAILING, "node_rate": 0.4},
    "failures.node_repair": {**FAILING, "node_repair": 2.0},
    "failures.node_data": {**FAILING, "node_data": "lost"},
    "wind.strength": 1.0,
    "wind.direction": {"strength": 1.0, "direction": 90.0},
    "wind.gusts": 1.0,
    "wind.seed": {"gusts": 1.0, "seed": 1},
    "wind.moves": (0.5, 0.0, 0.2, 0.0),
    "consumption.slots": [[900, 1100, 1000, 1200, 700], [800, 900, 1000, 1100, 700]],
    "fleet": [{"slots_per_cell": 1}, {"slots_per_cell": 3}],
}
# They change no mission: names, what places are called, and where on Earth they are; or the SimPy
# engine alone has them; or other fields follow from them.
WITHOUT_EFFECT = {
    *("names", "moved", "centre", "data_sheet", "weather"),
    *("arrivals.process", "arrivals.schedule", "arrivals.buffer", "arrivals.service"),
}


class HastyPlanner(Planner):
    """Plans with a short search."""

    name = "hasty"
    budget = Budget(40, 20)


def _leaves() -> Iterator[str]:
    """The fields of scenarios and of their sections, as ``section.field``."""
    for name, field in ScenarioSpace.model_fields.items():
        section = field.default
        if (
            name in fields.SECTIONS
            and hasattr(section, "off")
            and name not in ("data_sheet", "weather")
        ):
            yield from (f"{name}.{inner}" for inner in type(section).model_fields)
        else:
            yield name


def _spaces() -> list[ScenarioSpace]:
    """The scenario, and those that differ from it in one field."""
    spaces = [BASE]
    for name, value in VARIED.items():
        section, _, inner = name.partition(".")
        if inner and not isinstance(value, dict):
            value = {inner: value}
        spaces.append(ScenarioSpace.of(BASE, **{section: value}))
    return spaces


def _caches() -> list[Any]:
    """All caches of the simulator, which are emptied so that every table is computed anew."""
    modules = [module for name, module in sys.modules.items() if name.startswith("dess.")]
    values = [value for module in modules for value in vars(module).values()]
    return [value for value in values if hasattr(value, "cache_clear")]


def test_every_field_is_varied():
    assert {*VARIED} | WITHOUT_EFFECT == {*_leaves()}


def test_missions_together_are_those_of_empty_caches():
    spaces = _spaces()
    effects = set()
    leaving = Script(*5 * ["N" * 9])  # until its battery is empty
    teams = [*map(policies.load, ("greedy", "generalist")), HastyPlanner(), Fidget(), leaving]
    for policy in teams:
        together = simulate_batch(spaces, policy, 3, [1] * len(spaces))
        different, caches = {}, _caches()
        for number, space in enumerate(spaces):
            for cache in caches:
                cache.cache_clear()
            alone = simulate_batch(space, policy, 3, [1])
            changed = ["nothing", *VARIED][number]
            assert is_same(together, number, alone.mission(0)), (policy.name, changed)
            different[changed] = b"".join(records.tobytes() for records in alone)
        effects |= {name for name in VARIED if different[name] != different["nothing"]}
    assert effects == {*VARIED}


def test_reach_is_that_of_empty_caches():
    spaces = _spaces()
    warm, caches = [reach_of_nodes(space) for space in spaces], _caches()
    for space, reach in zip(spaces, warm, strict=True):
        for cache in caches:
            cache.cache_clear()
        assert reach_of_nodes(space) == reach


def test_the_tables_of_a_copy_cannot_be_written_to_either():
    """To the compiler, arrays that can be written to have another type."""
    space = ScenarioSpace.of(BASE, wind={"strength": 0.5})
    ways = Ways(constants_of(space), space.chart)
    assert ways.home.any()
    assert not deepcopy(ways).home.flags.writeable
