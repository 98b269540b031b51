"""The state of B missions with up to I UAVs and K nodes, as arrays; a single mission has B = 1.

>>> state = state_of([load_scenario("paper", uavs=2)], missions=1)
>>> state.uavs.shape, state.residual.shape    # (B, I) and (B, K)
((1, 2), (1, 25))
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from statistics import fmean
from typing import NamedTuple

import numpy as np
from numpy.lib.recfunctions import repack_fields

from dess.base.errors import InputError, check_type
from dess.base.kernels import kernel
from dess.model.link import service_cells
from dess.physics import fleet, streams
from dess.physics.energy import ACTIONS, ENERGY, SPEEDS, energy_constants
from dess.physics.failures import MOST_PADS
from dess.physics.radio import MOST_STEPS
from dess.scenario.fields import MOST_ZONES, SAMPLED
from dess.scenario.scenario import AnyScenario, Scenario, ScenarioSpace, loaded

NORTH, EAST, SOUTH, WEST, HOVER = range(5)
ACTION_NAMES = ("north", "east", "south", "west", "hover")
# Steps [cells] of the actions; y grows south.
STEP_X = np.array([0, 1, 0, -1, 0])
STEP_Y = np.array([-1, 0, 1, 0, 0])

# How the mission of a UAV ended; ACTIVE while it has not ended.
ACTIVE, QUOTA, BATTERY, TRUNCATED, LOST, LANDED = range(6)
END_NAMES = ("active", "quota", "battery", "truncated", "lost", "landed")


def fields(kind: type, names: str) -> list[tuple[str, type]]:
    """Fields of one type for a ``numpy.dtype``."""
    return [(name, kind) for name in names.split()]


# One mission: the constants of its scenario, then its progress.
MISSION = np.dtype(
    [
        ("seed", np.uint64),
        ("replication", np.int64),
        # World: the start zone, and the pads of all zones together and of each; ``is_extended``
        # tells whether a section of the scenario is on.
        *fields(np.int64, "grid nodes zone_x zone_y zone_width zone_height pads forbid_swaps"),
        ("zones", np.int64),
        ("zone_pads", np.int64, MOST_ZONES),
        ("is_extended", np.int64),
        # Time, fleet and energy.
        *fields(np.int64, "communication_slots max_slots uavs flying_time charge_start"),
        # A charging slot gains ``charge_rate / charge_slots`` percent, in lowest terms.
        *fields(np.int64, "charge_complete charge_rate charge_slots flight_cost quota"),
        ("landing", np.int64),  # whether missions end on the ground
        # Charging (dess.physics.charging); ``plans_waits`` tells whether the return guard allows
        # for the wait for a pad.
        *fields(np.int64, "has_charging plans_waits lowest_battery_first power"),
        # Failures (dess.physics.failures): probabilities per slot.
        ("has_failures", np.int64),
        *fields(np.float64, "uav_rate uav_repair"),
        ("uav_data_lost", np.int64),
        *fields(np.float64, "pad_rate pad_repair node_rate node_repair"),  # of pads the largest
        ("zone_pad_rate", np.float64, MOST_ZONES),
        ("zone_pad_repair", np.float64, MOST_ZONES),
        ("node_data_lost", np.int64),
        # Channel; the length of a communication slot is the part of it that the duty cycle leaves.
        *fields(np.float64, "communication_slot_length shadowing_deviation"),
        # Radio (dess.physics.radio): range [m], largest efficiency [bit/s/Hz], both 0 for none, and
        # the steps of the rate: from which SNR [dB] on the efficiency is which.
        *fields(np.float64, "range max_rate"),
        ("service_cells", np.int64),  # how far nodes are served by their mean SNR [cells]
        ("steps", np.int64),
        ("step_snr", np.float64, MOST_STEPS),
        ("step_rate", np.float64, MOST_STEPS),
        # Energy: what a slot takes [% / 1000], by the slots per cell and the action, and the most
        # that one takes; whether this is not one percent everywhere; and what the return guard
        # counts for a slot of waiting.
        ("has_costs", np.int64),
        ("slot_costs", np.int16, SPEEDS * ACTIONS),
        ("max_slot_cost", np.int64),
        ("waiting_slot", np.int64),
        ("energy", np.int64),  # which of the energies of a batch it is
        # What the mean wind takes of the four moves and its deviation from cell to cell [% of
        # battery per cell], which count where gusts blow.
        ("pushes", np.float64, 4),
        ("gusts", np.float64),
        ("gust_seed", np.uint64),
        ("slowest", np.int64),  # the most slots that a UAV of the fleet takes for a cell
        # Data and rewards.
        *fields(np.float64, "initial_low initial_high arrival_rate reward_data reward_overruled"),
        *fields(np.float64, "reward_depleted reward_charging reward_quota reward_step"),
        ("continuous", np.int64),  # whether arrivals are
        ("own_rates", np.int64),  # whether nodes have their own, and arrival_rate is their mean
        ("message", np.float64),  # what a node makes at once [data units], 0 without messages
        # How long nodes have collected data before the mission, and after which time data are late
        # (0 for never) [slots].
        *fields(np.float64, "idle due"),
        ("age_measured", np.int64),  # in the slotted model
        ("age_reward", np.float64),
        # Progress: mission slots done, UAVs still active, and data [data units], of which
        # ``slot_collected`` are of the present slot; ``newest`` is the sum of that of the nodes.
        *fields(np.int64, "slot active"),
        *fields(np.float64, "initial arrived collected slot_collected newest lost"),
        *fields(np.int64, "uav_failures slots_grounded pad_requests"),
        ("pads_out", np.int8, MOST_PADS),  # 1 for a pad out of order
    ],
    align=True,
)

# The same for scenarios without sections. It differs in the name of a field only, which tells the
# compiler to leave out the code of the sections (``dess.physics.section.for_sections``).
PLAIN_MISSION = np.dtype(
    [("is_plain", *field[1:]) if field[0] == "is_extended" else field for field in MISSION.descr],
    align=True,
)


def mission_part(*names: str) -> np.dtype:
    """The type of records that have these fields of ``MISSION`` and no others.

    A table that missions share is computed from such records and kept by their bytes. So it cannot
    depend on a field that is not in its key: a function that reads one does not compile.
    """
    return repack_fields(MISSION[[*names]])


# What the tables of ``dess.model.ways`` are computed from.
ENERGY_PART = mission_part(*ENERGY)

# One UAV: its state and the outcome of the present slot.
UAV = np.dtype(
    [
        # The cell, the cell at the start of the slot, the battery, and the communication slots
        # counted toward the quota.
        *fields(np.int64, "x y from_x from_y battery communications quota"),
        # The slots that a move takes, and those of its move after the present one.
        *fields(np.int64, "slots_per_cell slots_left"),
        # What the policy chose, and what the safety controller made of it.
        *fields(np.int64, "action executed"),
        ("end", np.int64),
        ("pad_request", np.int64),  # slot of the pending or granted pad request, -1 if none
        ("pad", np.int64),  # index of the pad held, where pads may fail
        ("zone", np.int64),  # number of the charging zone that it is in, negative for none
        *fields(np.int64, "slots_flying slots_charging slots_waiting"),
        ("charge_slots", np.int64),  # of the present charge
        ("charged", np.int64),  # the battery that all charges of the mission have added [%]
        ("overruled_by", np.int64),  # if overruled: the UAV in its way, -1 at the edge of the grid
        ("served", np.int64),  # node served in the present communication slot, -1 for none
        # ``latch`` is the charging latch iota; who is ``charging`` holds a pad, and who is
        # ``grounded`` is under repair.
        *fields(np.bool_, "active latch charging grounded overruled"),
        # The battery [%] at which it is charged, 0 for that of the mission.
        ("charge_complete", np.int8),
        # What it has spent of the next percent of its battery [% / 1000], where slots have costs.
        ("remainder", np.int16),
        # A charging slot gains ``charge_rate / rate_slots`` percent, in lowest terms; 0 for what it
        # gains in the mission.
        *fields(np.int64, "charge_rate rate_slots"),
        ("rate", np.float64),  # factor of the rate at which it collects data
        # Data and SNR [dB] of the present communication slot, data of the mission, rewards of the
        # present slot and of the mission.
        *fields(np.float64, "amount snr collected reward total_reward"),
    ],
    align=True,
)


# One sensor node, beyond its residual data; without sections, it has the first fields alone.
_SENSOR_FIELDS = [
    ("newest", np.float64),  # from when the newest data are that were collected [slots]
    ("silent", np.bool_),
    ("hidden", np.float64),  # its data while it is silent [data units]
    ("rate", np.float64),  # its arrival rate, where nodes have their own
]
PLAIN_SENSOR = np.dtype(_SENSOR_FIELDS, align=True)
# With sections also: its data [data units], the area below its age until the newest of its data
# was collected [slots^2], and how long in all its age at a collection was above ``due`` [slots].
SENSOR = np.dtype(
    [*_SENSOR_FIELDS, *fields(np.float64, "initial arrived collected age_area late")], align=True
)


class State(NamedTuple):
    """The state of B missions with up to I UAVs and K nodes.

    Attributes:
        missions: (B,) ``MISSION`` records.
        uavs: (B, I) ``UAV`` records.
        residual: (B, K) residual data [data units].
        sensors: (B, K) ``SENSOR`` or ``PLAIN_SENSOR`` records.
        peaks: (B, G) where ages are measured, the number of their peaks by age in communication
            slots (``dess.physics.age``); otherwise (B, 0).
    """

    missions: np.ndarray
    uavs: np.ndarray
    residual: np.ndarray
    sensors: np.ndarray
    peaks: np.ndarray


def state_of(spaces: Sequence[ScenarioSpace], missions: int) -> State:
    """A state filled with zeros, for that many missions of scenarios with the same nodes."""
    fleet, nodes = max(space.uavs[1] for space in spaces), len(spaces[0].nodes)
    mission = _constants_of(spaces[0]).dtype
    sensor = PLAIN_SENSOR if mission == PLAIN_MISSION else SENSOR
    return State(
        np.zeros(missions, mission),
        np.zeros((missions, fleet), UAV),
        np.zeros((missions, nodes)),
        np.zeros((missions, nodes), sensor),
        np.zeros((missions, peak_values(spaces)), np.int32),
    )


def peak_values(spaces: Iterable[ScenarioSpace]) -> int:
    """How many values the peaks of ages can have in missions of these scenarios."""
    measured = (s for s in spaces if s.age.measured and not s.needs_events)
    return max((_longest_age(s) + 1 for s in measured), default=0)


def _longest_age(space: ScenarioSpace) -> int:
    """The largest age of a node in a mission [communication slots]."""
    idle = round(space.idle_slots * space.communication_slots)
    return space.max_slots * space.communication_slots + idle


def constants_of(scenario: ScenarioSpace) -> np.ndarray:
    """The constants of a scenario: (1,) ``MISSION``, or ``PLAIN_MISSION`` if it has no sections.

    Sampled parameters have the low end of their range; ``draw_parameters`` overwrites them.
    """
    return _constants_of(scenario).copy()


def part_of(missions: np.ndarray, kind: np.dtype) -> np.ndarray:
    """A part of ``MISSION`` records."""
    return missions[[*(kind.names or ())]].astype(kind)


@lru_cache(maxsize=8)
def _constants_of(scenario: ScenarioSpace) -> np.ndarray:
    low, high = np.transpose(scenario.node_data)
    arrivals = scenario.arrivals
    own_rates = not scenario.needs_events and bool(arrivals.rates or arrivals.merged)
    slotted_age = scenario.age.measured and not scenario.needs_events
    values = {
        **dict(scenario),
        **{name: getattr(scenario, name)[0] for name in SAMPLED},
        **dict(zip(("zone_x", "zone_y", "zone_width", "zone_height"), scenario.zone, strict=True)),
        **{"nodes": len(scenario.nodes), "pads": scenario.charging_pads},
        "zones": len(scenario.rectangles),
        **{"initial_low": low.min(), "initial_high": high.max()},
        **{"own_rates": own_rates, "slowest": fleet.slowest(scenario.fleet)},
        "communication_slot_length": (
            scenario.slot_length / scenario.communication_slots * scenario.radio.duty_cycle
        ),
        "shadowing_deviation": np.sqrt(scenario.shadowing_variance),
        **{"continuous": scenario.needs_events, "age_measured": slotted_age},
        **{"message": arrivals.message, "idle": scenario.idle_slots},
        "charge_rate": scenario.charge_fraction.numerator,
        "charge_slots": scenario.charge_fraction.denominator,
        "age_reward": scenario.age.reward,
        **({"arrival_rate": fmean(scenario.node_rates)} if own_rates else {}),
        **scenario.radio.constants(),
        "service_cells": service_cells(scenario),
        **energy_constants(
            scenario.consumption, scenario.wind, scenario.size, fleet.slowest(scenario.fleet)
        ),
        **scenario.charging.constants(),
        **scenario.failures.constants(),
    }
    mission = np.zeros(1, MISSION)
    for name in set(values).intersection(MISSION.names or ()):
        mission[name] = values[name]
    zones = len(scenario.zone_pads)
    mission["zone_pads"][0, :zones] = scenario.zone_pads
    for name, of_zones in scenario.failures.zone_constants(zones).items():
        mission[name][0, :zones] = of_zones
    return mission if scenario.is_extended else mission.view(PLAIN_MISSION)


def ranges_of(scenario: ScenarioSpace) -> np.ndarray:
    """The (4, 2) low and high ends of the sampled parameters, in the order of ``SAMPLED``."""
    return np.array([getattr(scenario, name) for name in SAMPLED], np.int64)


def types_of(scenario: ScenarioSpace, uavs: int | None = None) -> np.ndarray:
    """(I,) ``UAV`` records before a mission, off the grid; a battery of 0 is that of the mission.

    Without ``uavs``, there are as many as the largest fleet of the scenario has.
    """
    records = np.zeros(uavs or scenario.uavs[1], UAV)
    for i, record in enumerate(records):
        kind = fleet.type_of(scenario.fleet, i)
        record["battery"], record["slots_per_cell"] = kind.flying_time or 0, kind.slots_per_cell
        record["quota"], record["rate"] = kind.quota or scenario.quota, kind.rate
        record["charge_complete"] = scenario.battery_of_type(kind) or 0
        if rate := scenario.charge_fraction_of_type(kind):
            record["charge_rate"], record["rate_slots"] = rate.numerator, rate.denominator
    records["action"] = records["executed"] = HOVER
    for name in ("x", "y", "from_x", "from_y", "pad_request", "pad", "served", "overruled_by"):
        records[name] = -1
    return records


class Starts(NamedTuple):
    """What missions of P scenarios start from (``rules.launch``).

    Attributes:
        constants: (P,) records of ``constants_of``, with the seed.
        ranges: (P, 4, 2) ranges of the sampled parameters.
        uavs: (P, I) records of ``types_of``.
        data: (P, K, 2) ranges of the initial data of the nodes.
        rates: (P, K) arrival rates of the nodes.
        ages: (P, K) ages of the nodes before they were idle [slots].
        silent: (P, K) whether the nodes are silent.
    """

    constants: np.ndarray
    ranges: np.ndarray
    uavs: np.ndarray
    data: np.ndarray
    rates: np.ndarray
    ages: np.ndarray
    silent: np.ndarray


def starts_of(spaces: Sequence[ScenarioSpace], seed: int = 0) -> Starts:
    """What missions of these scenarios, which are all extended or all not, start from."""
    fleet = max(space.uavs[1] for space in spaces)
    # With the very dtypes of the state: a call of compiled code compares any others field by field.
    kind = _constants_of(spaces[0]).dtype
    constants = np.concatenate([constants_of(space) for space in spaces], dtype=kind)
    constants["seed"] = seed
    _number_energies(constants)
    ranges = np.stack([ranges_of(space) for space in spaces])
    types = np.stack([types_of(space, fleet) for space in spaces], dtype=UAV)
    data, rates = (
        np.array([getattr(s, field) for s in spaces]) for field in ("node_data", "node_rates")
    )
    ages, silent = np.zeros(rates.shape), np.zeros(rates.shape, np.bool_)
    return Starts(constants, ranges, types, data, rates, ages, silent)


def _number_energies(constants: np.ndarray) -> None:
    """Number the different energies of scenarios, in the order in which they come."""
    numbers: dict[bytes, int] = {}
    for mission, energy in zip(constants, part_of(constants, ENERGY_PART), strict=True):
        mission["energy"] = numbers.setdefault(energy.tobytes(), len(numbers))


@kernel
def draw_parameters(mission, ranges):
    """Draw the sampled parameters of a mission from their ranges (Table II)."""
    w0, w1, w2, w3 = streams.block(mission.seed, mission.replication, streams.PARAMETERS, 0, 0, 0)
    mission.uavs = streams.integer(w0, ranges[0, 0], ranges[0, 1])
    mission.flying_time = streams.integer(w1, ranges[1, 0], ranges[1, 1])
    mission.charge_start = streams.integer(w2, ranges[2, 0], ranges[2, 1])
    mission.charge_complete = streams.integer(w3, ranges[3, 0], ranges[3, 1])


def sample_scenario(scenario: ScenarioSpace, seed: int, replication: int) -> Scenario:
    """The scenario of one replication: its sampled parameters are drawn, its constants are kept.

    Raises:
        InputError: If the seed or the replication is out of range.
    """
    check_seed(seed, replication)
    missions = constants_of(scenario)
    missions["seed"], missions["replication"] = seed, replication
    draw_parameters(missions[0], ranges_of(scenario))
    return scenario.scenario_at(**{name: int(missions[name][0]) for name in SAMPLED})


def check_seed(seed: int, replication: int) -> None:
    """Refuse a seed or a replication that the random streams cannot represent.

    Raises:
        InputError: If one of them is no integer, or out of range.
    """
    for name, number in (("seed", seed), ("replication", replication)):
        check_type(name, number, int | np.integer, "an integer")
    seed, replication = int(seed), int(replication)
    if not 0 <= seed <= streams.MAX_SEED:
        raise InputError("seed", f"{seed} is out of range", "0..2**64-1")
    if not 0 <= replication <= streams.MAX_REPLICATION:
        raise InputError("replication", f"{replication} is out of range", "0..2**32-1")


def spaces_of(scenarios: Iterable[AnyScenario]) -> list[ScenarioSpace]:
    """The scenarios as spaces; a single scenario becomes a space of one.

    Raises:
        InputError: If there is no scenario of a name, or something is neither one nor a name.
    """
    constants = map(loaded, scenarios)
    return [s if isinstance(s, ScenarioSpace) else ScenarioSpace.of(s) for s in constants]
