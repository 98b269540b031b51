"""Event logs of missions as arrays, and what they say of the end of a UAV."""

from collections.abc import Mapping
from typing import Any, TypeAlias

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.physics.chart import spread
from dess.physics.fleet import type_of
from dess.scenario.scenario import Scenario

_ROUNDING = 1e-9  # less than this is no part of a packet [data units]

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
    table["node"] = _is_served(log, table)
    table["moved"] = (table["x"] != table["from_x"]) | (table["y"] != table["from_y"])
    table["charging"] = _is_between(log, table, "charge_start", "charge_end")
    table["waiting"] = _is_waiting(log, table)
    table["grounded"] = _is_between(log, table, "uav_failure", "uav_repair")
    return table


def battery_levels(events: Events) -> pd.DataFrame:
    """Battery [%] of every UAV at every slot's start and at its end: ``uav, time, battery``."""
    log = pd.DataFrame(events)
    moves = log[log["event"] == "move"]
    states = pd.concat([_of_uavs(log, "mission_start"), moves.assign(time=moves["time"] + 1)])
    levels = states[["uav", "time", "value"]].rename(columns={"value": "battery"})
    levels = levels.astype({"time": int, "battery": int})
    return levels.sort_values(["uav", "time"], ignore_index=True)


def battery_from_full(battery: Any, scenario: Scenario, uav: int) -> Any:
    """What a UAV shows of its own battery [%], which in the model begins above the reserve.

    Args:
        battery: The battery in the model [%], a number or an array.
        scenario: The scenario of the mission.
        uav: The number of the UAV, from 0.
    """
    if not scenario.data_sheet.is_on:
        return battery
    full = scenario.data_sheet.fields()["charge_complete"]
    usable = scenario.battery_of_type(type_of(scenario.fleet, uav)) or full
    return 100 - full + battery * (full / usable)


def residual_data(events: Events) -> pd.DataFrame:
    """Residual data [data units] at every mission slot's start (rows) and node (columns).

    The last row is the end of the mission. What rounding leaves of the data of packets is 0.
    """
    log = pd.DataFrame(events)
    flows = _node_flows(log)
    times = range(mission_length(log) + 1)
    data = _data_held(flows).groupby([np.ceil(flows["time"]).astype(int), flows["node"]]).last()
    table = data.unstack().reindex(index=times).ffill()
    table = table.where(table > _ROUNDING, 0.0)
    return table.rename_axis(index="time", columns="node")


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
        falls = falls[newest > before]
        newest = newest[newest > before]
    else:
        flows = _node_flows(log)
        falls = flows[(flows["event"] == "communication") & (_data_held(flows) == 0.0)]
        newest = falls["time"]
    return falls[["time", "node"]].assign(newest=newest).reset_index(drop=True)


def ages_of_nodes(events: Events) -> pd.DataFrame:
    """Age of information [slots] at every mission slot's start (rows) and node (columns).

    The last row is the end of the mission.
    """
    log = pd.DataFrame(events)
    falls = age_falls(events)
    nodes = log.loc[(log["event"] == "mission_start") & (log["node"] >= 0), "node"].to_numpy()
    times = np.arange(mission_length(log) + 1)
    newest = falls["newest"].groupby([np.ceil(falls["time"]).astype(int), falls["node"]]).max()
    table = newest.unstack().reindex(index=times, columns=nodes).ffill().fillna(0.0)
    return table.rsub(times, axis=0).rename_axis(index="time", columns="node")


def mean_age(events: Events) -> pd.DataFrame:
    """The corners of the sawtooth of the mean age of all nodes: ``time``, ``age`` [slots].

    Between corners the age grows by 1 per slot; at a fall there are two, before and after it.
    """
    log = pd.DataFrame(events)
    falls = age_falls(events)
    nodes = ((log["event"] == "mission_start") & (log["node"] >= 0)).sum()
    before = falls.groupby("node")["newest"].shift(fill_value=0.0)
    gains = (falls["newest"] - before).groupby(falls["time"]).sum().cumsum() / nodes
    newest = np.concatenate([[0.0, 0.0], np.repeat(gains.to_numpy(), 2)])
    times = np.concatenate(
        [[0.0], np.repeat(gains.index.to_numpy(float), 2), [mission_length(log)]]
    )
    return pd.DataFrame({"time": times, "age": times - newest})


def mission_length(events: Events) -> int:
    """The length of the mission [mission slots]."""
    log = pd.DataFrame(events)
    return int(log.loc[log["event"] == "mission_end", "time"].max())


def _node_flows(log: pd.DataFrame) -> pd.DataFrame:
    """The rows of the initial data and of all that changes the data of nodes, with ``change``."""
    gains = ("mission_start", "arrival")
    losses = ("communication", "data_lost", "loss")
    flows = log[log["event"].isin(gains + losses) & (log["node"] >= 0)]
    return flows.assign(change=flows["value"].where(flows["event"].isin(gains), -flows["value"]))


def _data_held(flows: pd.DataFrame) -> pd.Series:
    """What each node holds after every row of ``_node_flows`` [data units].

    Summed in the order of the simulation, which finds a node empty where exactly 0 is left.
    """
    return flows["change"].groupby(flows["node"]).transform(lambda c: np.cumsum(c.to_numpy()))


def _of_uavs(log: pd.DataFrame, event: str) -> pd.DataFrame:
    return log[(log["event"] == event) & (log["uav"] >= 0)]


def _is_served(log: pd.DataFrame, table: pd.DataFrame) -> np.ndarray:
    served = log[log["event"] == "communication"]
    slot = (np.ceil(served["time"]).astype(int) - 1).rename("slot")
    count = served.groupby(["uav", slot, "node"])["time"].agg(["size", "max"]).reset_index()
    best = count.sort_values(["size", "max"]).drop_duplicates(["uav", "slot"], keep="last")
    node = table.merge(best[["uav", "slot", "node"]], on=["uav", "slot"], how="left")["node"]
    return node.fillna(-1).astype(int).to_numpy()


def _is_between(log: pd.DataFrame, table: pd.DataFrame, start: str, end: str) -> np.ndarray:
    """Whether a slot of a UAV is one from an event ``start`` on to before the next ``end``."""
    steps = {start: 1, end: -1}
    edges = log[log["event"].isin(steps)]
    between = np.zeros(len(table), int)
    for uav, time, event in zip(edges["uav"], edges["time"], edges["event"], strict=True):
        between[(table["uav"] == uav) & (table["slot"] >= time)] += steps[event]
    return between > 0


def _is_waiting(log: pd.DataFrame, table: pd.DataFrame) -> np.ndarray:
    """A UAV waits from its ``charge_request`` on until it charges, moves off or tries to."""
    overruled = slots_of(log, "collision")
    requested = slots_of(log, "charge_request")
    waiting = np.zeros(len(table), bool)
    queued = False
    keys = zip(table["uav"], table["slot"], table["moved"], table["charging"], strict=True)
    for row, (uav, slot, moved, charging) in enumerate(keys):
        stays = queued and slot > 0 and not moved and (uav, slot) not in overruled
        queued = not charging and ((uav, slot) in requested or stays)
        waiting[row] = queued
    return waiting


def slots_of(log: pd.DataFrame, event: str) -> set[tuple[int, int]]:
    """UAV and slot of every event of a kind."""
    rows = log[log["event"] == event]
    return set(zip(rows["uav"], rows["time"].astype(int), strict=True))


def causes_of_failure(events: Events, scenario: Scenario) -> list[str]:
    """A sentence per UAV that did not fill its quota, or did not land, without a full stop.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
        scenario: The scenario of the mission.
    """
    log = pd.DataFrame(events)
    if scenario.landing:
        end = "landing"
    else:
        end = "quota_filled"
    ended = set(log.loc[log["event"] == end, "uav"])
    slots = uav_slots(log)
    levels = battery_levels(log)
    # The battery before each slot: that at its start.
    starts = levels.rename(columns={"time": "slot", "battery": "before"})
    slots = slots.merge(starts, on=["uav", "slot"])
    failed = (uav for uav in range(scenario.uavs) if uav not in ended)
    return [_cause_of_uav(log, slots, scenario, uav) for uav in failed]


def _cause_of_uav(log: pd.DataFrame, slots: pd.DataFrame, scenario: Scenario, uav: int) -> str:
    rows_of_uav = log[log["uav"] == uav]
    flown = slots[slots["uav"] == uav]
    kind = type_of(scenario.fleet, uav)
    last = flown.iloc[-1]
    quota = kind.quota or scenario.quota
    after = int(last["slot"]) + 1
    to_go = f"{max(quota - (rows_of_uav['event'] == 'communication').sum(), 0)} of {quota}"
    if quota:
        to_go = f"with {to_go} communication slots to go"
    else:
        to_go = "without having landed"
    name = f"UAV {uav + 1}"
    cell = f"after {after} slots at ({last['x']}, {last['y']})"
    if not (rows_of_uav["event"] == "battery_empty").any():
        if after == scenario.max_slots:
            return f"{name} was still active at the horizon of {after} slots, {to_go}"
        return f"{name} was lost to a failure {cell}, {to_go}"
    zones, parking, *_ = scenario.chart
    home = spread(zones, parking)[0].reshape(zones.shape)
    away = home[last["y"], last["x"]]
    if away:
        where = f"{numbers.format_count(away, 'cell')} from the nearest zone"
    else:
        where = "in a zone"
    facts = [f"{name} ran empty {cell}, {where}, {to_go}"]
    if flown["charging"].any():
        flown = flown[flown["slot"] > flown["slot"][flown["charging"]].max()]
    cells = home[flown["from_y"], flown["from_x"]]
    covers = flown["before"] > cells * kind.slots_per_cell * scenario.flight_cost
    if away and covers.any():
        row = flown[covers].iloc[-1]
        way = numbers.format_count(cells[covers][-1], "cell")
        facts.append(
            f"its battery last covered the way to a zone after {row['slot']} slots, with "
            f"{row['before']} % for {way}"
        )
    spent = (flown["before"] - flown["battery"] - scenario.flight_cost).clip(lower=0)
    if spent.any():
        facts.append(f"the wind cost {spent.sum()} %")
    waited = flown[flown["waiting"]]
    charging = slots[slots["charging"]]
    for zone, rows in waited.groupby(zones[waited["y"], waited["x"]]):
        in_zone = charging["slot"].isin(rows["slot"]) & (
            zones[charging["y"], charging["x"]] == zone
        )
        busy = f", while {_uavs_in_words(charging['uav'][in_zone])} charged there"
        x, y, *_ = scenario.rectangles[zone]
        facts.append(
            f"it waited {numbers.format_count(len(rows), 'slot')} for a pad of the zone at ({x}, "
            f"{y}), which has {scenario.zone_pads[zone]}{busy if in_zone.any() else ''}"
        )
    overruled = rows_of_uav[(rows_of_uav["event"] == "collision") & (rows_of_uav["other"] >= 0)]
    overruled = overruled["other"][overruled["time"] >= flown["slot"].min()]
    if len(overruled):
        times = numbers.format_count(len(overruled), "time")
        facts.append(f"it was overruled {times}, by {_uavs_in_words(overruled)}")
    return "; ".join(facts)


def _uavs_in_words(uavs: pd.Series) -> str:
    """Several UAVs as ``UAVs 1 and 3``, counted from 1."""
    shown = [str(uav + 1) for uav in sorted(set(uavs))]
    if len(shown) == 1:
        return f"UAV {shown[0]}"
    return f"UAVs {numbers.join_words(shown)}"
