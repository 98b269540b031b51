"""What ended the mission of each UAV that did not fill its quota, as sentences of facts.

    causes(record.events.columns(), scenario)  # ["UAV 2 ran empty after 61 slots at (2, 22), ..."]

What a sentence counts, it counts from the UAV's last charge on, or from the start of the mission.
"""

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.results.event_log import Events, battery_levels, duration, uav_slots
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
    own = log[log["uav"] == uav]
    flown = slots[slots["uav"] == uav]
    end, last = duration(log), flown.iloc[-1]
    after, cell = int(last["slot"]) + 1, f"({last['x']}, {last['y']})"
    quota = type_of(scenario.fleet, uav).quota or scenario.quota
    left = quota - (own["event"] == "communication").sum()
    to_go = f"with {left} of {quota} communication slots to go"
    name = f"UAV {first + uav}"
    if not (own["event"] == "battery_empty").any():
        if after == end == scenario.max_slots:
            return f"{name} was still active at the horizon of {end} slots, {to_go}"
        return f"{name} was lost to a failure after {after} slots at {cell}, {to_go}"
    home = spread(scenario.chart.zones, scenario.chart.parking)[0].reshape(scenario.size[::-1])
    away = int(home[last["y"], last["x"]])
    where = f"{_count(away, 'cell')} from the nearest zone" if away else "in a zone"
    facts = [f"{name} ran empty after {after} slots at {cell}, {where}, {to_go}"]
    since = flown[flown["slot"] > flown["slot"].where(flown["charging"]).max()]
    since = flown if since.empty else since
    facts += _way(since, scenario, uav, home) if away else []
    facts += _waits(slots, since, scenario, first)
    overruled = own[(own["event"] == "collision") & (own["other"] >= 0)]
    overruled = overruled[overruled["time"] >= since["slot"].min()]
    if len(overruled):
        times = _count(len(overruled), "time")
        facts.append(f"it was overruled {times}, by {_names(overruled['other'], first)}")
    return "; ".join(facts)


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'s' * (number != 1)}"


def _names(uavs: pd.Series, first: int) -> str:
    """Several UAVs as ``UAVs 1 and 3``."""
    shown = [str(first + uav) for uav in sorted(set(uavs))]
    return f"UAV{'s' * (len(shown) > 1)} {numbers.words(shown)}"


def _way(since: pd.DataFrame, scenario: Scenario, uav: int, home: np.ndarray) -> list[str]:
    """When the battery last covered the way to a zone, and what the wind cost."""
    slots_per_cell = type_of(scenario.fleet, uav).slots_per_cell
    cells = home[since["from_y"], since["from_x"]]
    covers = since[since["before"] > cells * slots_per_cell * scenario.flight_cost]
    facts = []
    if len(covers):
        row = covers.iloc[-1]
        way = _count(int(home[row["from_y"], row["from_x"]]), "cell")
        facts.append(
            f"its battery last covered the way to a zone after {row['slot']} slots, with "
            f"{row['before']} % for {way}"
        )
    spent = (since["before"] - since["battery"] - scenario.flight_cost)[~since["grounded"]]
    if wind := int(spent.clip(lower=0).sum()):
        facts.append(f"the wind cost {wind} %")
    return facts


def _waits(slots: pd.DataFrame, since: pd.DataFrame, scenario: Scenario, first: int) -> list[str]:
    """How long it waited for the pads of each zone, and who had them."""
    zones, facts = scenario.chart.zones, []
    waited = since[since["waiting"]]
    for zone, rows in waited.groupby(zones[waited["y"], waited["x"]]):
        busy = slots[slots["charging"] & slots["slot"].isin(rows["slot"])]
        busy = busy[zones[busy["y"], busy["x"]] == zone]
        x, y, *_ = scenario.rectangles[zone]
        during = f", while {_names(busy['uav'], first)} charged there" if len(busy) else ""
        facts.append(
            f"it waited {_count(len(rows), 'slot')} for a pad of the zone at ({x}, {y}), which "
            f"has {scenario.zone_pads[zone]}{during}"
        )
    return facts
