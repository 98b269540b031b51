"""What a player knows of its mission, slot by slot, from the event log."""

from collections.abc import Iterator

import numpy as np
import pandas as pd

from analysis.figures.style import node_colours, uav_colours
from analysis.results.event_log import battery_levels, residual_data, uav_slots
from dess.errors import InputError
from dess.scenario import Scenario


class Mission:
    """What is known of a mission of T slots, I UAVs and K nodes.

    Attributes:
        slots: ``uav_slots`` of the log.
        levels: ``battery_levels`` of the log.
        residual: (T + 1, K) ``residual_data`` of the log.
        filled: (I,) whether the UAV filled its quota.
        fleet: (T + 1, I) arrays of what the UAVs are after every slot: ``x``, ``y``, ``battery``,
            ``node``, ``charging``, ``waiting``, and ``over`` if the UAV's mission has ended.
    """

    def __init__(self, log: pd.DataFrame, scenario: Scenario):
        _check(log, scenario)
        self.scenario = scenario
        self.slots, self.levels, self.residual = (
            uav_slots(log),
            battery_levels(log),
            residual_data(log),
        )
        self.end = len(self.residual) - 1
        self.filled = np.isin(range(scenario.uavs), log.loc[log["event"] == "quota_filled", "uav"])
        self.fleet = self._after_slots()
        self.pads = scenario.zone_cells if scenario.pads is None else scenario.pads
        self.uav_colours = uav_colours(scenario.uavs)
        self.node_colours = node_colours(len(scenario.nodes))

    def _after_slots(self) -> dict[str, np.ndarray]:
        table = self.slots.assign(time=self.slots["slot"] + 1).pivot(index="time", columns="uav")
        table = table.reindex(range(self.end + 1))
        first = self.slots.drop_duplicates("uav")
        levels = self.levels.pivot(index="time", columns="uav", values="battery")
        last = self.slots.groupby("uav")["slot"].max().to_numpy() + 1
        fleet = {
            "battery": levels.reindex(table.index).ffill().to_numpy(int),
            "node": table["node"].fillna(-1).to_numpy(int),
            "over": np.arange(self.end + 1)[:, None] >= last,
        }
        for axis in ("x", "y"):
            table.loc[0, axis] = first[f"from_{axis}"].to_numpy()
            fleet[axis] = table[axis].ffill().to_numpy(int)
        for state in ("charging", "waiting"):
            fleet[state] = table[state].eq(True).to_numpy()
        return fleet

    def rows(self, *names: str) -> Iterator[tuple[list, ...]]:
        """The named arrays of the fleet as lists, slot by slot."""
        return zip(*(self.fleet[name].tolist() for name in names), strict=True)


def _check(log: pd.DataFrame, scenario: Scenario) -> None:
    for edge in ("mission_start", "mission_end"):
        rows = log[log["event"] == edge]
        for what, count in (("uav", scenario.uavs), ("node", len(scenario.nodes))):
            found = sorted(rows.loc[rows[what] >= 0, what])
            if found != list(range(count)):
                raise InputError(
                    f"events: {edge} has {len(found)} rows of a {what}; "
                    f"allowed: one for each of the scenario's {count}"
                )
