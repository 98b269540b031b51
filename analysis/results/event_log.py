"""The event log of a mission as tables per mission slot, for figures and reports.

    slots = uav_slots(results.events("greedy", point=0, replication=0))
    slots.groupby("uav")["charging"].sum()  # slots that each UAV charged

``events`` is everywhere a data frame, or the columns, of ``dess.record.EventLog``.
"""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

Events: TypeAlias = pd.DataFrame | Mapping[str, Any]


def uav_slots(events: Events) -> pd.DataFrame:
    """What every active UAV did in every mission slot.

    Returns:
        One row per UAV and slot, in that order: ``uav``, ``slot``; ``from_x, from_y`` and ``x, y``,
        the cells before and after the action; ``battery`` [%] at the end of the slot; ``node``, the
        one served in most of the slot's communication slots (the last of them on a tie), -1
        without; ``moved``, ``charging``, ``waiting`` (for a pad).
    """
    log = pd.DataFrame(events)
    moves = log[log["event"] == "move"].astype({"time": int, "x": int, "y": int, "value": int})
    names = {"time": "slot", "value": "battery"}
    table = moves[["uav", "time", "x", "y", "value"]].rename(columns=names)
    table = table.sort_values(["uav", "slot"], ignore_index=True)
    start = _of_uavs(log, "mission_start").set_index("uav")
    for axis in ("x", "y"):
        first = table["uav"].map(start[axis])
        before = table.groupby("uav")[axis].shift().fillna(first).astype(int)
        table.insert(2, f"from_{axis}", before)
    table["node"] = _served(log, table)
    table["moved"] = (table["x"] != table["from_x"]) | (table["y"] != table["from_y"])
    table["charging"] = _charging(log, table)
    table["waiting"] = _waiting(log, table)
    return table


def battery_levels(events: Events) -> pd.DataFrame:
    """Battery [%] of every UAV at every slot's start and at its end: ``uav, time, battery``."""
    log = pd.DataFrame(events)
    moves = log[log["event"] == "move"]
    states = pd.concat([_of_uavs(log, "mission_start"), moves.assign(time=moves["time"] + 1)])
    levels = states[["uav", "time", "value"]].rename(columns={"value": "battery"})
    levels = levels.astype({"time": int, "battery": int})
    return levels.sort_values(["uav", "time"], ignore_index=True)


def residual_data(events: Events) -> pd.DataFrame:
    """Residual data [data units] at every mission slot's start (rows) and node (columns).

    The last row is the end of the mission.
    """
    log = pd.DataFrame(events)
    start = log[(log["event"] == "mission_start") & (log["node"] >= 0)]
    flowing = log["event"].isin(["arrival", "communication", "data_lost", "loss"])
    flows = log[flowing & (log["node"] >= 0)]
    change = flows["value"].where(flows["event"] == "arrival", -flows["value"])
    times, nodes = range(duration(log) + 1), start["node"].to_numpy()
    changes = change.groupby([np.ceil(flows["time"]).astype(int), flows["node"]]).sum()
    table = changes.unstack(fill_value=0.0).reindex(index=times, columns=nodes, fill_value=0.0)
    table = table.cumsum() + start["value"].to_numpy()
    return table.rename_axis(index="time", columns="node")


def duration(events: Events) -> int:
    """The length of the mission [mission slots]."""
    log = pd.DataFrame(events)
    return int(log.loc[log["event"] == "mission_end", "time"].max())


def _of_uavs(log: pd.DataFrame, event: str) -> pd.DataFrame:
    return log[(log["event"] == event) & (log["uav"] >= 0)]


def _served(log: pd.DataFrame, table: pd.DataFrame) -> np.ndarray:
    served = log[log["event"] == "communication"]
    slot = (np.ceil(served["time"]).astype(int) - 1).rename("slot")
    count = served.groupby(["uav", slot, "node"])["time"].agg(["size", "max"]).reset_index()
    best = count.sort_values(["size", "max"]).drop_duplicates(["uav", "slot"], keep="last")
    node = table.merge(best[["uav", "slot", "node"]], on=["uav", "slot"], how="left")["node"]
    return node.fillna(-1).astype(int).to_numpy()


def _charging(log: pd.DataFrame, table: pd.DataFrame) -> np.ndarray:
    """A session holds the slots from its ``charge_start`` to before its ``charge_end``."""
    steps = {"charge_start": 1, "charge_end": -1}
    edges = log[log["event"].isin(steps)]
    charging = np.zeros(len(table), int)
    for uav, time, event in zip(edges["uav"], edges["time"], edges["event"], strict=True):
        charging[(table["uav"] == uav) & (table["slot"] >= time)] += steps[event]
    return charging > 0


def _waiting(log: pd.DataFrame, table: pd.DataFrame) -> np.ndarray:
    """A UAV waits from its ``charge_request`` on until it charges, moves off or tries to."""
    overruled, requested = _slots_of(log, "collision"), _slots_of(log, "charge_request")
    waiting, queued = np.zeros(len(table), bool), False
    keys = zip(table["uav"], table["slot"], table["moved"], table["charging"], strict=True)
    for row, (uav, slot, moved, charging) in enumerate(keys):
        stays = queued and slot > 0 and not moved and (uav, slot) not in overruled
        queued = not charging and ((uav, slot) in requested or stays)
        waiting[row] = queued
    return waiting


def _slots_of(log: pd.DataFrame, event: str) -> set[tuple[int, int]]:
    """UAV and slot of every event of a kind."""
    rows = log[log["event"] == event]
    return set(zip(rows["uav"], rows["time"].astype(int), strict=True))
