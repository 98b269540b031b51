"""The state of a mission after every mission slot, computed from its event log for a player."""

from typing import Any

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis.figures.style import node_colours, uav_colours
from dess.analysis.results.event_log import (
    Events,
    ages,
    battery_levels,
    mean_age,
    residual_data,
    uav_slots,
)
from dess.scenario import Scenario

TRAIL = 12  # number of last moves that are drawn behind a UAV


class Playback:
    """A mission of T slots, I UAVs and K nodes, slot by slot.

    Attributes:
        end: T.
        residual: (T + 1, K) residual data [data units] at the start of every slot and at the end.
        fleet: (T + 1, I) arrays, the state of the UAVs after every slot: ``x``, ``y``, ``battery``,
            ``node`` (served, -1 without), ``charging``, ``waiting``, and ``over`` if the UAV's
            mission has ended.
    """

    def __init__(self, events: Events, scenario: Scenario):
        """Compute the states.

        Raises:
            InputError: If the log is not that of a complete mission of this scenario.
        """
        self._log, self.scenario = pd.DataFrame(events), scenario
        _check(self._log, scenario)
        # Residual data may be -1e-16.
        self.residual = residual_data(self._log).clip(lower=0).to_numpy()
        self.end = len(self.residual) - 1
        self.fleet = self._fleet()
        self.uav_colours = uav_colours(scenario.uavs)
        self.node_colours = node_colours(len(scenario.nodes))

    def _fleet(self) -> dict[str, np.ndarray]:
        slots, levels = uav_slots(self._log), battery_levels(self._log)
        first = slots.groupby("uav", as_index=False).first()
        full = levels.groupby("uav")["battery"].first().to_numpy()
        absent = {"node": -1, "charging": False, "waiting": False}
        start = first.assign(slot=-1, x=first["from_x"], y=first["from_y"], battery=full, **absent)
        table = pd.concat([start, slots]).pivot(index="slot", columns="uav")
        table = table.reindex(range(-1, self.end))
        active = table["x"].notna()
        fleet = {name: table[name].ffill().to_numpy(int) for name in ("x", "y", "battery")}
        for name, value in absent.items():
            fleet[name] = table[name].where(active, value).to_numpy(type(value))
        return fleet | {"over": ~active.shift(-1, fill_value=False).to_numpy(bool)}

    def status(self, slot: int) -> str:
        """The residual data and the pads in use after a slot, in words."""
        charging, waiting = (self.fleet[state][slot].sum() for state in ("charging", "waiting"))
        pads = self.scenario.charging_pads
        queue = f", {waiting} waiting" if waiting else ""
        used = f"{charging} of {pads} pad{'s' * (pads != 1)} in use{queue}"
        return (
            f"slot {slot} of {self.end} · {self.residual[slot].sum():.1f} data units left · {used}"
        )

    @property
    def data(self) -> dict[str, Any]:
        """All that a player in a page shows, as JSON; lists of states are in the order of slots."""
        scenario, log = self.scenario, self._log
        filled = log.loc[log["event"] == "quota_filled", "uav"]
        aged = scenario.age.measured
        return {
            **{"size": scenario.size, "zones": scenario.rectangles},
            **{"nodes": scenario.nodes, "names": scenario.names, "noFly": scenario.no_fly},
            "thresholds": {"C_S": scenario.charge_start, "C_C": scenario.charge_complete},
            "colours": {"uavs": self.uav_colours, "nodes": self.node_colours},
            "pads": scenario.charging_pads,
            "trail": TRAIL,
            "filled": np.isin(range(scenario.uavs), filled).tolist(),
            "fleet": {name: (1 * values).tolist() for name, values in self.fleet.items()},
            "residual": self.residual.round(2).tolist(),
            "status": [self.status(slot) for slot in range(self.end + 1)],
            "ages": ages(log).round(2).to_numpy().tolist() if aged else None,
            "meanAge": mean_age(log).round(2).to_numpy().tolist() if aged else None,
        }


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
