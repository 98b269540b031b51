"""A mission played slot by slot in a page, with buttons, a slider or the keyboard.

A page contains ``player_script()`` once, before its first ``make_player``; then it needs no
network. What is drawn is in ``templates/player.js``.

    display(player_script())
    display(make_player([Shown(log, scenario, "One UAV")], "player-1"))

Without JavaScript, and on paper, a player is a map with the paths of the UAVs.
"""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from IPython.display import HTML

from dess import InputError
from dess.analysis.figures import style
from dess.analysis.figures.style import node_colours, uav_colours
from dess.analysis.metrics import DRAWN_UNITS, choose_units, format_length, size_of
from dess.analysis.numbers import format_count
from dess.analysis.results import event_log
from dess.reports.pages.parts import Part, make_figures
from dess.reports.pages.templates import load_template
from dess.scenario.scenario import Scenario

# The events that a player jumps to, in words; of a pad, the text has no number.
JUMPS = {
    "charge_start": "UAV {} starts to charge",
    "charge_end": "UAV {} stops charging",
    "quota_filled": "UAV {} has filled its quota",
    "landing": "UAV {} has landed",
    "battery_empty": "the battery of UAV {} is empty",
    "uav_failure": "UAV {} fails",
    "uav_repair": "UAV {} can fly again",
    "pad_failure": "a charging pad fails",
    "pad_repair": "a charging pad can be used again",
    "node_failure": "node {} falls silent",
    "node_repair": "node {} answers again",
}
AT_START = {"charge_start"}  # events at the start of a slot; the state after it shows them


class Shown(NamedTuple):
    """A mission that a player shows.

    Attributes:
        events: The event log (a data frame, or the columns, of ``dess.model.events.EventLog``).
        scenario: The scenario of the mission.
        title: The text above the map.
        choice: The text of the mission where several can be chosen from.
    """

    events: event_log.Events
    scenario: Scenario
    title: str = ""
    choice: str = ""


class Playback:
    """A mission of T slots, I UAVs and K nodes, slot by slot.

    Attributes:
        end: T.
        residual: (T + 1, K) residual data [data units] at the start of every slot and at the end.
        fleet: (T + 1, I) arrays, the state of the UAVs after every slot: ``x``, ``y``, ``battery``,
            ``node`` (served, -1 without), ``charging``, ``waiting``, and ``over`` if the UAV's
            mission has ended.
    """

    def __init__(self, events: event_log.Events, scenario: Scenario):
        """Compute the states.

        Raises:
            InputError: If the log is not that of a complete mission of this scenario.
        """
        self._log = pd.DataFrame(events)
        self.scenario = scenario
        _check_log(self._log, scenario)
        self.residual = event_log.residual_data(self._log).to_numpy()
        self.end = len(self.residual) - 1
        self.fleet = self._replay_fleet()
        self.uav_colours = uav_colours(scenario.uavs)
        self.node_colours = node_colours(len(scenario.nodes))

    def _replay_fleet(self) -> dict[str, np.ndarray]:
        slots = event_log.uav_slots(self._log)
        levels = event_log.battery_levels(self._log)
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

    def describe_slot(self, slot: int) -> str:
        """The residual data and the pads in use after a slot, in words."""
        charging, waiting = (self.fleet[state][slot].sum() for state in ("charging", "waiting"))
        pads = self.scenario.charging_pads
        used = f"{charging} of {format_count(pads, 'pad')} in use"
        if waiting:
            used += f", {waiting} waiting"
        left = self.residual[slot].sum()
        units = self.scenario.units
        if units:
            now = format_length(slot, units)
            end = format_length(self.end, units)
            data = size_of(DRAWN_UNITS["data"], units)
            return f"{now} of {end} · {left * data:,.3g} MB left · {used}"
        return f"slot {slot} of {self.end} · {left:.1f} data units left · {used}"

    def find_jumps(self) -> Iterator[tuple[int, str]]:
        """The slots at which something notable is seen, in their order, and what it is in words."""
        by_slot: dict[int, list[str]] = {}
        log = self._log[self._log["event"].isin([*JUMPS])]
        for row in log.itertuples():
            slot = int(row.time) + (row.event in AT_START)
            by_slot.setdefault(slot, []).append(JUMPS[row.event].format(self._name_of_row(row)))
        for slot in sorted(by_slot):
            yield slot, ", ".join(by_slot[slot])

    def _name_of_row(self, row: Any) -> str | int:
        """The number of the UAV of an event, or the name of its node."""
        if row.uav >= 0:
            return int(row.uav) + 1
        names = self.scenario.names
        if names:
            return names[int(row.node)]
        return int(row.node)

    @property
    def unit(self) -> float:
        """The length of a 32nd of the longer side of the map [cells], by which marks are scaled."""
        return max(self.scenario.size) / 32

    @property
    def radii(self) -> list[tuple[float, float]]:
        """For every node the radii of its most and of its last data on the map [cells]."""
        largest = max(self.residual.max(), 1e-9)
        data = np.column_stack([self.residual.max(axis=0), self.residual[-1]])
        radii = 0.8 * self.unit * np.sqrt(data / largest)
        return [(most, last) for most, last in radii.round(2).tolist()]

    @property
    def paths(self) -> list[list[tuple[int, int]]]:
        """For every UAV the corners of its path, from its start to where its mission ended."""
        return [_find_corners(self.fleet["x"][:, uav], self.fleet["y"][:, uav])
                for uav in range(self.scenario.uavs)]  # fmt: skip

    @property
    def data(self) -> dict[str, Any]:
        """All that a player in a page shows, as JSON; lists of states are in the order of slots."""
        scenario, log = self.scenario, self._log
        end = "quota_filled"
        if scenario.landing:
            end = "landing"
        filled = log.loc[log["event"] == end, "uav"]
        ages = mean_age = None
        if scenario.age.measured:
            ages = event_log.ages_of_nodes(log).round(2).to_numpy().tolist()
            mean_age = event_log.mean_age(log).round(2).to_numpy().tolist()
        return {
            "size": scenario.size,
            "zones": scenario.rectangles,
            "nodes": scenario.nodes,
            "names": scenario.names,
            "noFly": scenario.no_fly,
            "thresholds": {"C_S": scenario.charge_start, "C_C": scenario.charge_complete},
            "colours": {"uavs": self.uav_colours, "nodes": self.node_colours},
            "pads": scenario.charging_pads,
            "trail": style.TRAIL,
            "units": choose_units(scenario.units),
            "filled": np.isin(range(scenario.uavs), filled).tolist(),
            "fleet": {name: (1 * values).tolist() for name, values in self.fleet.items()},
            "residual": self.residual.round(2).tolist(),
            "status": [self.describe_slot(slot) for slot in range(self.end + 1)],
            "events": [*self.find_jumps()],
            "ages": ages,
            "meanAge": mean_age,
        }


def _find_corners(x: np.ndarray, y: np.ndarray) -> list[tuple[int, int]]:
    """The cells at which a path begins, turns and ends."""
    cells = np.column_stack([x, y])
    moves = np.diff(cells, axis=0)
    cells = cells[np.r_[True, moves.any(axis=1)]]
    moves = moves[moves.any(axis=1)]
    turns = np.array([True])
    if len(moves):
        turns = np.r_[True, (moves[1:] != moves[:-1]).any(axis=1), True]
    return [(int(x), int(y)) for x, y in cells[turns]]


def _check_log(log: pd.DataFrame, scenario: Scenario) -> None:
    for edge in ("mission_start", "mission_end"):
        rows = log[log["event"] == edge]
        for what, count in (("uav", scenario.uavs), ("node", len(scenario.nodes))):
            numbers = sorted(rows.loc[rows[what] >= 0, what])
            if numbers != list(range(count)):
                raise InputError(
                    "events",
                    f"{edge} has {len(numbers)} rows of a {what}",
                    f"one for each of the scenario's {count}",
                )


READING = (
    "A disc shows the data left at a node, and its ring the most that it ever had. A numbered dot "
    "is a UAV, with its last moves and a line to the node that it serves most; it turns pale when "
    "its mission is over. A full square is a UAV that charges, an empty one a UAV that waits for a "
    "pad. A tick means that the quota was filled, or that the UAV has landed. A click in the "
    "panels goes to another slot, and one on the map tells about a UAV or a node. Space plays and "
    "pauses; the arrows, Home and End change the slot; Page Up and Page Down go to the previous "
    "and the next event: a charge, an end, a failure."
)

AGE_READING = (
    " The age of a node is the time since its newest collected data were generated; where data "
    "have no time stamps, it is the time since the node was last emptied. The length of a stem is "
    "the age of its node."
)


def explain_player(scenario: Scenario) -> str:
    """How to read the player of a mission of this scenario."""
    if scenario.age.measured:
        return READING + AGE_READING
    return READING


def player_script() -> HTML:
    """The script of all players, which a page needs once, before its players."""
    return HTML(f"<script>{load_template('player.js').render(style=style)}</script>")


def join_players(players: Iterable[Part]) -> Part:
    """Several players side by side, which show the same slot."""
    return make_figures([player.values["figures"][0] for player in players], "gallery together")


def make_player(missions: Sequence[Shown], name: str, caption: str = "") -> Part:
    """A player: a mission can be chosen, played, paused and shown slot by slot.

    Args:
        missions: The missions, of which the first is shown at first.
        name: The id of the player, unique in its page: letters, digits and hyphens.
        caption: The text below the figure; ``READING`` explains how to read it.

    Raises:
        InputError: If a log is not that of a complete mission of its scenario.
    """
    playbacks = [Playback(shown.events, shown.scenario) for shown in missions]
    texts = [{"title": shown.title, "choice": shown.choice} for shown in missions]
    data = [played.data | text for played, text in zip(playbacks, texts, strict=True)]
    drawn = load_template("player.html").render(
        name=name, missions=data, first=playbacks[0], style=style
    )
    return make_figures([{"name": name, "player": drawn, "caption": caption}])
