"""What ended the mission of each UAV that did not fill its quota, as sentences of facts.

    causes(record.events.columns(), scenario)  # ["UAV 2 ran empty after 61 slots at (2, 22), ..."]

What a sentence counts, it counts from the UAV's last charge on, or from the start of the mission.
"""

import pandas as pd

from analysis import numbers
from analysis.results.event_log import Events, battery_levels, uav_slots
from dess.scenario import Scenario
from dess.sea.chart import spread
from dess.sections.fleet import type_of


def causes(events: Events, scenario: Scenario, first: int = 1) -> list[str]:
    """A sentence per UAV that did not fill its quota, without a full stop.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The scenario of the mission.
        first: The number of the first UAV, as in what stands beside the sentences.
    """
    log = pd.DataFrame(events)
    filled = set(log.loc[log["event"] == "quota_filled", "uav"])
    slots, levels = uav_slots(log), battery_levels(log)
    # The battery before each slot: that at its start.
    starts = levels.rename(columns={"time": "slot", "battery": "before"})
    slots = slots.merge(starts, on=["uav", "slot"])
    unfilled = (uav for uav in range(scenario.uavs) if uav not in filled)
    return [_cause(log, slots, scenario, uav, first) for uav in unfilled]


def _cause(log: pd.DataFrame, slots: pd.DataFrame, scenario: Scenario, uav: int, first: int) -> str:
    own, flown = log[log["uav"] == uav], slots[slots["uav"] == uav]
    kind, last = type_of(scenario.fleet, uav), flown.iloc[-1]
    quota, after = kind.quota or scenario.quota, int(last["slot"]) + 1
    to_go = f"{quota - (own['event'] == 'communication').sum()} of {quota}"
    to_go, name = f"with {to_go} communication slots to go", f"UAV {first + uav}"
    cell = f"after {after} slots at ({last['x']}, {last['y']})"
    if not (own["event"] == "battery_empty").any():
        if after == scenario.max_slots:
            return f"{name} was still active at the horizon of {after} slots, {to_go}"
        return f"{name} was lost to a failure {cell}, {to_go}"
    zones, parking, *_ = scenario.chart
    home = spread(zones, parking)[0].reshape(zones.shape)
    away = home[last["y"], last["x"]]
    where = f"{numbers.counted(away, 'cell')} from the nearest zone" if away else "in a zone"
    facts = [f"{name} ran empty {cell}, {where}, {to_go}"]
    if flown["charging"].any():
        flown = flown[flown["slot"] > flown["slot"][flown["charging"]].max()]
    cells = home[flown["from_y"], flown["from_x"]]
    covers = flown["before"] > cells * kind.slots_per_cell * scenario.flight_cost
    if away and covers.any():
        row, way = flown[covers].iloc[-1], numbers.counted(cells[covers][-1], "cell")
        facts.append(
            f"its battery last covered the way to a zone after {row['slot']} slots, with "
            f"{row['before']} % for {way}"
        )
    spent = (flown["before"] - flown["battery"] - scenario.flight_cost).clip(lower=0)
    if spent.any():
        facts.append(f"the wind cost {spent.sum()} %")
    waited, charging = flown[flown["waiting"]], slots[slots["charging"]]
    for zone, rows in waited.groupby(zones[waited["y"], waited["x"]]):
        there = charging["slot"].isin(rows["slot"]) & (zones[charging["y"], charging["x"]] == zone)
        busy = f", while {_names(charging['uav'][there], first)} charged there"
        x, y, *_ = scenario.rectangles[zone]
        facts.append(
            f"it waited {numbers.counted(len(rows), 'slot')} for a pad of the zone at ({x}, {y}), "
            f"which has {scenario.zone_pads[zone]}{busy if there.any() else ''}"
        )
    overruled = own[(own["event"] == "collision") & (own["other"] >= 0)]
    overruled = overruled["other"][overruled["time"] >= flown["slot"].min()]
    if len(overruled):
        times = numbers.counted(len(overruled), "time")
        facts.append(f"it was overruled {times}, by {_names(overruled, first)}")
    return "; ".join(facts)


def _names(uavs: pd.Series, first: int) -> str:
    """Several UAVs as ``UAVs 1 and 3``."""
    shown = [str(first + uav) for uav in sorted(set(uavs))]
    return f"UAV{'s' * (len(shown) > 1)} {numbers.words(shown)}"
