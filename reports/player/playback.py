"""The state of a mission after every mission slot, computed from its event log for a player."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from analysis.figures.style import node_colours, uav_colours
from analysis.results.event_log import ages, battery_levels, mean_age, residual_data, uav_slots
from dess import InputError
from dess.scenario import Scenario


class Playback:
    """A mission of T slots, I UAVs and K nodes, slot by slot.

    Attributes:
        slots: ``uav_slots`` of the log.
        levels: ``battery_levels`` of the log.
        residual: (T + 1, K) ``residual_data`` of the log.
        ages: (T + 1, K) ``ages`` of the log, empty unless the scenario measures them.
        mean_age: ``mean_age`` of the log, empty likewise.
        filled: (I,) whether the UAV filled its quota.
        fleet: (T + 1, I) arrays, the state of the UAVs after every slot: ``x``, ``y``, ``battery``,
            ``node`` (served, -1 without), ``charging``, ``waiting``, and ``over`` if the UAV's
            mission has ended.
    """

    def __init__(self, log: pd.DataFrame, scenario: Scenario):
        _check(log, scenario)
        self.scenario = scenario
        self.slots, self.levels, self.residual = (
            table(log) for table in (uav_slots, battery_levels, residual_data)
        )
        self.measures_age = scenario.age.measured
        self.ages, self.mean_age = (
            table(log) if self.measures_age else pd.DataFrame() for table in (ages, mean_age)
        )
        self.end = len(self.residual) - 1
        self.filled = np.isin(range(scenario.uavs), log.loc[log["event"] == "quota_filled", "uav"])
        self.fleet = self._fleet()
        self.pads = scenario.charging_pads
        self.uav_colours = uav_colours(scenario.uavs)
        self.node_colours = node_colours(len(scenario.nodes))

    def _fleet(self) -> dict[str, np.ndarray]:
        first = self.slots.groupby("uav", as_index=False).first()
        full = self.levels.groupby("uav")["battery"].first().to_numpy()
        absent = {"node": -1, "charging": False, "waiting": False}
        start = first.assign(slot=-1, x=first["from_x"], y=first["from_y"], battery=full, **absent)
        table = pd.concat([start, self.slots]).pivot(index="slot", columns="uav")
        table = table.reindex(range(-1, self.end))
        active = table["x"].notna()
        fleet = {name: table[name].ffill().to_numpy(int) for name in ("x", "y", "battery")}
        for name, value in absent.items():
            fleet[name] = table[name].where(active, value).to_numpy(type(value))
        return fleet | {"over": ~active.shift(-1, fill_value=False).to_numpy(bool)}

    def rows(self, *names: str) -> Iterator[tuple[list, ...]]:
        """The named arrays of the fleet as lists, slot by slot."""
        return zip(*(self.fleet[name].tolist() for name in names), strict=True)


def _check(log: pd.DataFrame, scenario: Scenario) -> None:
    for edge in ("mission_start", "mission_end"):
        rows = log[log["event"] == edge]
        for what, count in (("uav", scenario.uavs), ("node", len(scenario.nodes))):
            numbers = sorted(rows.loc[rows[what] >= 0, what])
            if numbers != list(range(count)):
                raise InputError(
                    f"events: {edge} has {len(numbers)} rows of a {what}; "
                    f"allowed: one for each of the scenario's {count}"
                )
