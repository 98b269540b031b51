"""The state of B missions with up to I UAVs and K nodes, as arrays; a single mission has B = 1.

state = empty_state(1, space.uavs[1], len(space.nodes))
state.missions[:] = constants_of(space)
state.uavs[0, 0]["battery"], state.residual[0]
"""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from operator import index
from typing import NamedTuple

import numpy as np

from dess import streams
from dess.code.kernels import kernel
from dess.errors import InputError
from dess.scenario import EXTENSIONS, SAMPLED, Scenario, ScenarioSpace
from dess.sections import fleet, wind
from dess.sections.failures import MOST_PADS
from dess.sections.section import Section

NORTH, EAST, SOUTH, WEST, HOVER = range(5)
ACTION_NAMES = ("north", "east", "south", "west", "hover")
# Steps [cells] of the actions; y grows south.
STEP_X = np.array([0, 1, 0, -1, 0])
STEP_Y = np.array([-1, 0, 1, 0, 0])

# How the mission of a UAV ended; ACTIVE while it has not ended.
ACTIVE, QUOTA, BATTERY, TRUNCATED, LOST = range(5)
END_NAMES = ("active", "quota", "battery", "truncated", "lost")

# One mission: the constants of its scenario, then its progress.
MISSION = np.dtype(
    [
        ("seed", np.uint64),
        ("replication", np.int64),
        # world
        ("grid", np.int64),
        ("nodes", np.int64),
        ("zone_x", np.int64),
        ("zone_y", np.int64),
        ("zone_width", np.int64),
        ("zone_height", np.int64),
        ("pads", np.int64),
        ("forbid_swaps", np.int64),
        ("is_extended", np.int64),  # whether a section of the scenario is on
        # time
        ("communication_slots", np.int64),
        ("max_slots", np.int64),
        # fleet and energy
        ("uavs", np.int64),
        ("flying_time", np.int64),
        ("charge_start", np.int64),
        ("charge_complete", np.int64),
        ("charge_rate", np.int64),
        ("flight_cost", np.int64),
        ("quota", np.int64),
        # charging (dess.sections.charging)
        ("has_charging", np.int64),
        ("plans_waits", np.int64),  # whether the return guard allows for the wait for a pad
        ("lowest_battery_first", np.int64),
        ("power", np.int64),
        # failures (dess.sections.failures): probabilities per slot
        ("has_failures", np.int64),
        ("uav_rate", np.float64),
        ("uav_repair", np.float64),
        ("uav_data_lost", np.int64),
        ("pad_rate", np.float64),
        ("pad_repair", np.float64),
        ("node_rate", np.float64),
        ("node_repair", np.float64),
        ("node_data_lost", np.int64),
        # channel and data
        ("communication_slot_length", np.float64),
        ("shadowing_deviation", np.float64),
        # wind: its mean and its deviation from cell to cell, as pushes [% of battery per cell]
        ("wind_x", np.float64),
        ("wind_y", np.float64),
        ("wind_gusts", np.float64),
        ("wind_seed", np.uint64),
        ("wind_most", np.int64),  # the largest surcharge of a move [%], 0 without wind
        ("slowest", np.int64),  # the most slots that a UAV of the fleet takes for a cell
        ("initial_low", np.float64),
        ("initial_high", np.float64),
        ("arrival_rate", np.float64),
        # reward weights
        ("reward_data", np.float64),
        ("reward_overruled", np.float64),
        ("reward_depleted", np.float64),
        ("reward_charging", np.float64),
        ("reward_quota", np.float64),
        ("reward_step", np.float64),
        # sections
        ("continuous", np.int64),  # whether arrivals are
        ("age_measured", np.int64),  # in the slotted model
        ("age_reward", np.float64),
        # progress
        ("slot", np.int64),  # mission slots done
        ("active", np.int64),  # UAVs still active
        ("initial", np.float64),  # data units
        ("arrived", np.float64),
        ("collected", np.float64),
        ("slot_collected", np.float64),  # data units, in the present slot
        ("newest", np.float64),  # sum of the nodes' ``newest`` [slots]
        ("lost", np.float64),  # data units, by failures and full buffers
        ("uav_failures", np.int64),
        ("slots_grounded", np.int64),  # of UAVs under repair
        ("pad_requests", np.int64),  # how often UAVs have asked for a pad
        ("pads_out", np.int8, MOST_PADS),  # 1 for a pad out of order
    ],
    align=True,
)

# The same for scenarios without sections. It differs in the name of a field only, which tells the
# compiler to leave out the code of the sections (``dess.sections.section.extension``).
PLAIN_MISSION = np.dtype(
    [("is_plain", *field[1:]) if field[0] == "is_extended" else field for field in MISSION.descr],
    align=True,
)

# One UAV: its state and the outcome of the present slot.
UAV = np.dtype(
    [
        ("x", np.int64),
        ("y", np.int64),
        ("from_x", np.int64),  # cell at the start of the slot
        ("from_y", np.int64),
        ("battery", np.int64),
        ("communications", np.int64),  # communication slots counted toward the quota
        ("quota", np.int64),
        ("slots_per_cell", np.int64),  # that a move takes
        ("slots_left", np.int64),  # of its move, after the present one
        ("action", np.int64),  # chosen by the policy
        ("executed", np.int64),  # what the safety controller made of it
        ("end", np.int64),
        ("pad_request", np.int64),  # slot of the pending or granted pad request, -1 if none
        ("pad", np.int64),  # index of the pad held, where pads may fail
        ("slots_flying", np.int64),
        ("slots_charging", np.int64),
        ("slots_waiting", np.int64),  # for a pad
        ("overruled_by", np.int64),  # if overruled: the UAV in its way, -1 at the edge of the grid
        ("served", np.int64),  # node served in the present communication slot, -1 for none
        ("active", np.bool_),
        ("latch", np.bool_),  # charging latch iota
        ("charging", np.bool_),  # holds a pad
        ("grounded", np.bool_),  # under repair
        ("overruled", np.bool_),
        ("rate", np.float64),  # factor of the rate at which it collects data
        ("amount", np.float64),  # collected in the present communication slot
        ("snr", np.float64),  # of the node served [dB]
        ("collected", np.float64),  # in the mission
        ("reward", np.float64),  # of the present slot
        ("total_reward", np.float64),
    ],
    align=True,
)


# One sensor node, beyond its residual data.
SENSOR = np.dtype(
    [
        ("newest", np.float64),  # from when the newest data are that were collected [slots]
        ("silent", np.bool_),
        ("hidden", np.float64),  # its data while it is silent [data units]
    ],
    align=True,
)


class State(NamedTuple):
    """The state of B missions with up to I UAVs and K nodes.

    Attributes:
        missions: (B,) ``MISSION`` records.
        uavs: (B, I) ``UAV`` records.
        residual: (B, K) residual data [data units].
        sensors: (B, K) ``SENSOR`` records.
        teeth: (B, G) where ages are measured, the number of their teeth by length in communication
            slots (``dess.sections.age``); otherwise (B, 0).
    """

    missions: np.ndarray
    uavs: np.ndarray
    residual: np.ndarray
    sensors: np.ndarray
    teeth: np.ndarray


def empty_state(
    missions: int, uavs: int, nodes: int, lengths: int = 0, kind: np.dtype = MISSION
) -> State:
    """A state filled with zeros, for that many missions, UAVs per mission and nodes.

    ``lengths`` is the number of lengths that the teeth of ages can have (``teeth_lengths``), and
    ``kind`` is ``MISSION``, or ``PLAIN_MISSION`` for scenarios without sections.
    """
    return State(
        np.zeros(missions, kind),
        np.zeros((missions, uavs), UAV),
        np.zeros((missions, nodes)),
        np.zeros((missions, nodes), SENSOR),
        np.zeros((missions, lengths), np.int32),
    )


def teeth_lengths(spaces: Iterable[ScenarioSpace]) -> int:
    """How many lengths the teeth of ages can have in missions of these scenarios."""
    measured = (s for s in spaces if s.age.measured and not s.needs_events)
    return max((s.max_slots * s.communication_slots + 1 for s in measured), default=0)


def constants_of(scenario: ScenarioSpace) -> np.ndarray:
    """The constants of a scenario: (1,) ``MISSION``, or ``PLAIN_MISSION`` if it has no sections.

    Sampled parameters have the low end of their range; ``draw_parameters`` overwrites them.
    """
    return _constants_of(scenario).copy()


@lru_cache(maxsize=8)
def _constants_of(scenario: ScenarioSpace) -> np.ndarray:
    mission = np.zeros(1, MISSION)
    for field in MISSION.fields or ():
        if field in SAMPLED:
            mission[field] = getattr(scenario, field)[0]
        elif field != "nodes" and hasattr(scenario, field):
            name = "charging_pads" if field == "pads" else field
            mission[field] = getattr(scenario, name)
    mission["nodes"] = len(scenario.nodes)
    mission["continuous"] = scenario.needs_events
    mission["age_measured"] = scenario.age.measured and not scenario.needs_events
    mission["age_reward"] = scenario.age.reward
    for field, value in zip(
        ("zone_x", "zone_y", "zone_width", "zone_height"), scenario.zone, strict=True
    ):
        mission[field] = value
    mission["initial_low"], mission["initial_high"] = scenario.initial_data
    mission["communication_slot_length"] = scenario.slot_length / scenario.communication_slots
    mission["shadowing_deviation"] = np.sqrt(scenario.shadowing_variance)
    for name, constant in wind.constants(scenario.wind, scenario.grid).items():
        mission[name] = constant
    mission["slowest"] = fleet.slowest(scenario.fleet)
    for section in (getattr(scenario, name) for name in EXTENSIONS):
        if isinstance(section, Section):
            for field, value in section.constants().items():
                mission[field] = value
    return mission if scenario.is_extended else mission.view(PLAIN_MISSION)


def ranges_of(scenario: ScenarioSpace) -> np.ndarray:
    """The (4, 2) low and high ends of the sampled parameters, in the order of ``SAMPLED``."""
    return np.array([getattr(scenario, name) for name in SAMPLED], np.int64)


def types_of(scenario: ScenarioSpace, uavs: int | None = None) -> np.ndarray:
    """(I,) ``UAV_TYPE`` records; without ``uavs``, as many as the largest fleet of the scenario."""
    return fleet.types_of(scenario.fleet, scenario.quota, uavs or scenario.uavs[1])


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
        InputError: If one of them is out of range.
        TypeError: If one of them is not an integer.
    """
    seed, replication = index(seed), index(replication)
    if not 0 <= seed <= streams.MAX_SEED:
        raise InputError(f"seed: {seed} is out of range; allowed: 0..2**64-1")
    if not 0 <= replication <= streams.MAX_REPLICATION:
        raise InputError(f"replication: {replication} is out of range; allowed: 0..2**32-1")


def spaces_of(scenarios: Sequence[Scenario | ScenarioSpace]) -> list[ScenarioSpace]:
    """The scenarios as spaces; a single scenario becomes a space of one."""
    return [s if isinstance(s, ScenarioSpace) else ScenarioSpace.of(s) for s in scenarios]
