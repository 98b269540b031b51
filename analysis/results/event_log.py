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
        without; ``moved``, ``charging``, ``waiting`` (for a pad), ``grounded`` (under repair).
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
    table["charging"] = _between(log, table, "charge_start", "charge_end")
    table["waiting"] = _waiting(log, table)
    table["grounded"] = _between(log, table, "uav_failure", "uav_repair")
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
    flows = _node_flows(log)
    times = range(duration(log) + 1)
    changes = flows["change"].groupby([np.ceil(flows["time"]).astype(int), flows["node"]]).sum()
    table = changes.unstack(fill_value=0.0).reindex(index=times, fill_value=0.0)
    return table.cumsum().rename_axis(index="time", columns="node")


def age_falls(events: Events) -> pd.DataFrame:
    """When the ages of nodes fell, in order: ``time``, ``node``, ``newest``.

    From this time on, the newest data collected from the node are those generated at ``newest``:
    of packets, the time stamp of the newest that was delivered; otherwise the time itself, at which
    the node was emptied.
    """
    log = pd.DataFrame(events)
    if (log["packet"] >= 0).any():
        falls = log[log["event"] == "delivery"]
        newest = falls["generated"].groupby(falls["node"]).cummax()
        before = newest.groupby(falls["node"]).shift(fill_value=0.0)
        falls, newest = falls[newest > before], newest[newest > before]
    else:
        flows = _node_flows(log)
        # Summed in the order of the simulation, which finds a node empty where exactly 0 is left.
        left = flows["change"].groupby(flows["node"]).transform(lambda c: np.cumsum(c.to_numpy()))
        falls = flows[(flows["event"] == "communication") & (left == 0.0)]
        newest = falls["time"]
    return falls[["time", "node"]].assign(newest=newest).reset_index(drop=True)


def ages(events: Events) -> pd.DataFrame:
    """Age of information [slots] at every mission slot's start (rows) and node (columns).

    The last row is the end of the mission.
    """
    log, falls = pd.DataFrame(events), age_falls(events)
    nodes = log.loc[(log["event"] == "mission_start") & (log["node"] >= 0), "node"].to_numpy()
    times = np.arange(duration(log) + 1)
    newest = falls["newest"].groupby([np.ceil(falls["time"]).astype(int), falls["node"]]).max()
    table = newest.unstack().reindex(index=times, columns=nodes).ffill().fillna(0.0)
    return table.rsub(times, axis=0).rename_axis(index="time", columns="node")


def mean_age(events: Events) -> pd.DataFrame:
    """The corners of the sawtooth of the mean age of all nodes: ``time``, ``age`` [slots].

    Between corners the age grows by 1 per slot; at a fall there are two, before and after it.
    """
    log, falls = pd.DataFrame(events), age_falls(events)
    nodes = ((log["event"] == "mission_start") & (log["node"] >= 0)).sum()
    before = falls.groupby("node")["newest"].shift(fill_value=0.0)
    gains = (falls["newest"] - before).groupby(falls["time"]).sum().cumsum() / nodes
    newest = np.concatenate([[0.0, 0.0], np.repeat(gains.to_numpy(), 2)])
    times = np.concatenate([[0.0], np.repeat(gains.index.to_numpy(float), 2), [duration(log)]])
    return pd.DataFrame({"time": times, "age": times - newest})


def duration(events: Events) -> int:
    """The length of the mission [mission slots]."""
    log = pd.DataFrame(events)
    return int(log.loc[log["event"] == "mission_end", "time"].max())


def _node_flows(log: pd.DataFrame) -> pd.DataFrame:
    """The rows of the initial data and of all that changes the data of nodes, with ``change``."""
    gains, losses = ("mission_start", "arrival"), ("communication", "data_lost", "loss")
    flows = log[log["event"].isin(gains + losses) & (log["node"] >= 0)]
    return flows.assign(change=flows["value"].where(flows["event"].isin(gains), -flows["value"]))


def _of_uavs(log: pd.DataFrame, event: str) -> pd.DataFrame:
    return log[(log["event"] == event) & (log["uav"] >= 0)]


def _served(log: pd.DataFrame, table: pd.DataFrame) -> np.ndarray:
    served = log[log["event"] == "communication"]
    slot = (np.ceil(served["time"]).astype(int) - 1).rename("slot")
    count = served.groupby(["uav", slot, "node"])["time"].agg(["size", "max"]).reset_index()
    best = count.sort_values(["size", "max"]).drop_duplicates(["uav", "slot"], keep="last")
    node = table.merge(best[["uav", "slot", "node"]], on=["uav", "slot"], how="left")["node"]
    return node.fillna(-1).astype(int).to_numpy()


def _between(log: pd.DataFrame, table: pd.DataFrame, start: str, end: str) -> np.ndarray:
    """Whether a slot of a UAV is one from an event ``start`` on to before the next ``end``."""
    steps = {start: 1, end: -1}
    edges = log[log["event"].isin(steps)]
    between = np.zeros(len(table), int)
    for uav, time, event in zip(edges["uav"], edges["time"], edges["event"], strict=True):
        between[(table["uav"] == uav) & (table["slot"] >= time)] += steps[event]
    return between > 0


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
