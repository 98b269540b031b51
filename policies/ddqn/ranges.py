"""The ranges of what a checkpoint holds of missions and of the replay memory.

Compiled code uses cells, actions and counters as indices and does not check them, so values from a
file are checked once, when the file is read.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np

from dess.env.stepper import MissionStepper
from dess.observations import states as column
from dess.scenario import SAMPLED, ScenarioSpace
from dess.state import ACTION_NAMES, END_NAMES, State, constants_of, ranges_of, types_of

# What a mission has of its own; all other fields are constants of the scenario.
_PROGRESS = (
    *("replication", "slot", "active", "initial", "arrived", "collected", "slot_collected", "lost"),
    *("uav_failures", "slots_grounded", "pad_requests", "pads_out", "newest"),
)


def check_state(state: State, space: ScenarioSpace, stepper: MissionStepper) -> None:
    """Refuse missions that cannot be missions of the scenario.

    Args:
        state: The missions.
        space: The scenario from which they were drawn.
        stepper: The seed of the missions, and the next replication.

    Raises:
        ValueError: If a value is out of range.
    """
    missions, uavs = state.missions, state.uavs
    constants = constants_of(space)
    constants["seed"] = stepper.seed
    for name in sorted(set(constants.dtype.names or ()) - {*SAMPLED, *_PROGRESS}):
        if (missions[name] != constants[name]).any():
            raise ValueError(f"missions: {name} is not that of the scenario")
    edge, slots, fleet = max(space.size) - 1, space.max_slots, uavs.shape[1]
    is_there = np.arange(fleet) < missions["uavs"][:, None]
    types = np.broadcast_to(types_of(space, fleet), uavs.shape)
    for name in ("quota", "slots_per_cell", "rate"):
        if (uavs[name] != types[name])[is_there].any():
            raise ValueError(f"uavs: {name} is not that of the scenario")
    cells, actions = ("x", "y", "from_x", "from_y"), ("action", "executed")
    counters = ("slots_flying", "slots_charging", "slots_waiting")
    of_missions = dict(zip(SAMPLED, ranges_of(space).tolist(), strict=True)) | {
        "replication": (0, stepper.replication - 1),
        "slot": (0, slots),
        "pads_out": (0, 1),
    }
    of_uavs = {
        **dict.fromkeys(cells, (-1, edge)),
        **dict.fromkeys(actions, (0, len(ACTION_NAMES) - 1)),
        **dict.fromkeys(counters, (0, slots)),
        "battery": (0, 100),
        "communications": (0, int(types["quota"].max()) + space.communication_slots),
        "slots_left": (0, uavs["slots_per_cell"] - 1),
        "end": (0, len(END_NAMES) - 1),
        "pad_request": (-1, slots),
        "pad": (-1, space.charging_pads - 1),
        "zone": (-2, len(space.rectangles) - 1),
        "served": (-1, len(space.nodes) - 1),
    }
    truths = dict.fromkeys(("active", "latch", "charging", "grounded", "overruled"), (0, 1))
    allowed: list[tuple[np.ndarray, Any]] = [(missions, of_missions), (uavs, of_uavs | truths)]
    allowed.append((uavs[is_there], dict.fromkeys(cells, (0, edge))))
    for records, ranges in allowed:
        for name, (low, high) in ranges.items():
            # A truth value of a file may be any byte.
            values = records[name].view(np.uint8) if name in truths else records[name]
            if ((values < low) | (values > high)).any():
                raise ValueError(f"{name} is out of range")
    if (uavs["active"] & ~is_there).any() or (uavs["active"].sum(1) != missions["active"]).any():
        raise ValueError("missions: active UAVs that are not there")
    check_finite(missions)
    check_finite(uavs)
    if not (np.isfinite(state.residual) & (state.residual >= 0)).all():
        raise ValueError("missions: residual data out of range")


def check_replay(arrays: Mapping[str, np.ndarray], grid: int) -> None:
    """Refuse a replay memory whose cells, counters or actions are out of range.

    Args:
        arrays: The arrays of the memory.
        grid: Cells along one side of the grid.

    Raises:
        ValueError: If a value is out of range.
    """
    most = np.ones(column.UAV_COLUMNS, np.int64)  # truth values, but for:
    most[[column.X, column.Y]] = grid - 1
    most[column.BATTERY] = 100
    most[[column.NEEDED, column.HOME]] = np.iinfo(np.int16).max
    most[column.MASK] = 2 ** len(ACTION_NAMES) - 1
    highest_of = {"missions": 100, "uavs": most, "action": len(ACTION_NAMES) - 1}
    for name, highest in highest_of.items():
        if (arrays[name] < 0).any() or (arrays[name] > highest).any():
            raise ValueError(f"replay memory: {name} out of range")


def check_finite(records: np.ndarray) -> None:
    """Refuse records with a number that is not finite.

    Raises:
        ValueError: If there is one.
    """
    for name in records.dtype.names or ():
        if records[name].dtype.kind == "f" and not np.isfinite(records[name]).all():
            raise ValueError(f"{name} is not finite")
