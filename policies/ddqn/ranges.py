"""The ranges of what a checkpoint holds of missions and of the replay memory.

Compiled code uses cells, actions and counters as indices and does not check them, so values from a
file are checked once, when the file is read.
"""

from collections.abc import Mapping

import numpy as np

from dess.env.stepper import MissionStepper
from dess.observations.states import (
    BATTERY,
    HOME,
    MASK,
    NEEDED,
    UAV_COLUMNS,
    X,
    Y,
)
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
    for name, (low, high) in zip(SAMPLED, ranges_of(space), strict=True):
        _require(missions, name, low, high)
    _require(missions, "replication", 0, stepper.replication - 1)
    _require(missions, "slot", 0, space.max_slots)
    _require(missions, "pads_out", 0, 1)
    edge, slots = space.grid - 1, space.max_slots
    is_there = np.arange(uavs.shape[1]) < missions["uavs"][:, None]
    for name in ("x", "y", "from_x", "from_y"):
        _require(uavs, name, -1, edge)
        _require(uavs[is_there], name, 0, edge)
    _require(uavs, "battery", 0, 100)
    types = np.broadcast_to(types_of(space, uavs.shape[1]), uavs.shape)
    for name in ("quota", "slots_per_cell", "rate"):
        if (uavs[name] != types[name])[is_there].any():
            raise ValueError(f"uavs: {name} is not that of the scenario")
    _require(uavs, "communications", 0, int(types["quota"].max()) + space.communication_slots)
    if not ((uavs["slots_left"] >= 0) & (uavs["slots_left"] < uavs["slots_per_cell"])).all():
        raise ValueError("uavs: slots_left is out of range")
    for name in ("action", "executed"):
        _require(uavs, name, 0, len(ACTION_NAMES) - 1)
    _require(uavs, "end", 0, len(END_NAMES) - 1)
    _require(uavs, "pad_request", -1, slots)
    _require(uavs, "pad", -1, space.charging_pads - 1)
    _require(uavs, "served", -1, len(space.nodes) - 1)
    for name in ("slots_flying", "slots_charging", "slots_waiting"):
        _require(uavs, name, 0, slots)
    for name in ("active", "latch", "charging", "grounded", "overruled"):
        _require(uavs.view(_as_bytes(uavs.dtype)), name, 0, 1)
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
    most = np.ones(UAV_COLUMNS, np.int64)  # truth values, but for:
    most[[X, Y]] = grid - 1
    most[[BATTERY, NEEDED, HOME]] = 100, np.iinfo(np.int16).max, np.iinfo(np.int16).max
    most[MASK] = 2 ** len(ACTION_NAMES) - 1
    for name, highest in (("missions", 100), ("uavs", most), ("action", len(ACTION_NAMES) - 1)):
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


def _require(records: np.ndarray, name: str, low: int, high: int) -> None:
    values = records[name]
    if values.size and not low <= values.min() <= values.max() <= high:
        raise ValueError(f"{name} is out of range; allowed: {low}..{high}")


def _as_bytes(dtype: np.dtype) -> np.dtype:
    """The type with truth values as bytes, which may have any value in a file."""
    fields = {name: (kind, offset) for name, (kind, offset, *_) in (dtype.fields or {}).items()}
    formats = [np.dtype(np.uint8) if kind.kind == "b" else kind for kind, _ in fields.values()]
    offsets = [offset for _, offset in fields.values()]
    return np.dtype(
        {
            "names": [*fields],
            "formats": formats,
            "offsets": offsets,
            "itemsize": dtype.itemsize,
        }
    )
