"""The UAVs: what they ask for, what the safety controller makes of it, and what it costs."""

import math
from collections.abc import Mapping
from itertools import product
from types import SimpleNamespace
from typing import Any

from tests.dess.model.auditor.log import Log

Cell = tuple[int, int]
STEPS = ((0, -1), (1, 0), (0, 1), (-1, 0), (0, 0))  # north, east, south, west, hover
HOVER = 4
LARGEST_DEVIATE = 6.34  # of a gust, and of the shadowing, in standard deviations
# Counters of a UAV, and the slots that its move takes after the present one.
_ZEROS = ("communications", "slots_flying", "slots_charging", "slots_waiting", "slots_grounded")
_ZEROS += ("collected", "reward", "slots_left", "charge_slots", "charged", "remainder")
_ZEROS += ("largest_remainder",)


class Uav(SimpleNamespace):
    """What is known of a UAV.

    In gusts, the thousandths that it has spent of the next percent are ``remainder`` at least and
    ``largest_remainder`` at most. ``requested`` is the slot in which it asked for a pad, ``other``
    who overruled it in this slot: -1 for the edge of the grid or a no-fly cell.
    """

    def __init__(self, **known: Any):
        flags = dict.fromkeys(("latch", "charging", "grounded"), False)
        none = {"pad": -1, "requested": -1, "other": None, "end": "", "asked": HOVER}
        super().__init__(**dict.fromkeys(_ZEROS, 0), **flags, **none, **known)

    @property
    def cell(self) -> Cell:
        return self.x, self.y

    @property
    def waits(self) -> bool:
        return self.requested >= 0 and not self.charging

    @property
    def flies(self) -> bool:
        return not (self.end or self.charging or self.grounded)

    @property
    def has_filled(self) -> bool:
        return 0 < self.quota <= self.communications


def cells_of_zones(constants: Mapping[str, Any]) -> list[list[Cell]]:
    """The cells of each charging zone, the start zone first."""
    rectangles = [constants["zone"], *(zone["cells"] for zone in constants.get("zones", ()))]
    return [
        [*product(range(x, x + width), range(y, y + height))] for x, y, width, height in rectangles
    ]


class Fleet:
    """The UAVs of a mission."""

    def __init__(self, log: Log, constants: Mapping[str, Any]):
        self.log, self.c, self.uavs = log, constants, list[Uav]()
        self.zones = cells_of_zones(constants)
        size = constants["grid"], constants.get("rows") or constants["grid"]
        self.open = {*product(*map(range, size))} - {(x, y) for x, y in constants.get("no_fly", ())}
        wind = constants.get("wind", {"strength": 0.0, "direction": 0.0, "gusts": 0.0})
        comes_from, strength = math.radians(wind["direction"]), wind["strength"]
        x, y = -strength * math.sin(comes_from), strength * math.cos(comes_from)
        moves, pushes = wind.get("moves", (0.0,) * 4), (y, -x, -y, x)
        self.pushes = {s: a + b for s, a, b in zip(STEPS, moves, pushes, strict=False)}
        self.gusts = LARGEST_DEVIATE * wind["gusts"]
        self.costs = constants.get("consumption", {}).get("slots", ())
        if any((strength, wind["gusts"], *moves)):
            self.costs = [[*self._costs_of_moves(0.0, s), 1000] for s in range(1, 9)]
        # What moves into cells may cost at the least and at the most, by what has been seen: the
        # field does not change in a mission.
        self.seen: dict[tuple[int, ...], tuple[int, int]] = {}

    def _costs_of_moves(self, gust: float, slots: int) -> list[int]:
        """What a slot of each move takes [% / 1000], with so much of a gust against it [%]."""
        against = [max(self.pushes[step] + gust, 0.0) / slots for step in STEPS[:HOVER]]
        return [1000 + math.ceil(1000 * push - 1e-6) for push in against]

    @property
    def active(self) -> list[tuple[int, Uav]]:
        return [(i, u) for i, u in enumerate(self.uavs) if not u.end]

    def take(self, event: str, time: float, i: int, **expected: Any) -> Any:
        """The next row, which must be of a UAV at its cell and with its battery."""
        u = self.uavs[i]
        values = {"uav": i, "x": u.x, "y": u.y, "battery": u.battery, "value": u.battery}
        return self.log.take(event, time, **(values | expected))

    def zone_of(self, u: Uav) -> int:
        """The number of the charging zone that a UAV is in, or -1."""
        return next((zone for zone, cells in enumerate(self.zones) if u.cell in cells), -1)

    def stands(self, u: Uav) -> bool:
        """Whether a UAV stands on the ground, on no pad: there hovering costs nothing."""
        hovers = u.cell == (u.from_x, u.from_y)
        return bool(self.c.get("landing") and u.flies and hovers and self.zone_of(u) >= 0)

    def way_home(self, u: Uav) -> int:
        """The battery of the shortest way to a zone; the wind of cells not visited is not known."""
        if self.costs:
            return self._dear_way_home(u)
        cells = {cell for zone in self.zones for cell in zone}
        way, edge, seen = 0, {u.cell}, {u.cell}
        while not edge & cells:
            near = {(x + dx, y + dy) for x, y in edge for dx, dy in STEPS}
            way, edge = way + 1, (near & self.open) - seen
            seen |= edge
        return self.c["flight_cost"] * (way * u.slots_per_cell + u.slots_left)

    def _dear_way_home(self, u: Uav) -> int:
        """The battery [% / 1000] of the cheapest way, where slots have costs of their own."""
        cells, ways = {cell for zone in self.zones for cell in zone}, {u.cell: 0}
        costs = self.costs[u.slots_per_cell - 1]
        changed = True
        while changed:
            changed = False
            for (x, y), way in [*ways.items()]:
                for (dx, dy), cost in zip(STEPS[:HOVER], costs, strict=False):
                    to, further = (x + dx, y + dy), way + u.slots_per_cell * cost
                    if to in self.open and further < ways.get(to, math.inf):
                        ways[to], changed = further, True
        step = STEPS.index((u.x - u.from_x, u.y - u.from_y))
        left = u.slots_left * costs[step] if u.slots_left else 0
        return self.c["flight_cost"] * (min(ways.get(cell, math.inf) for cell in cells) + left)

    def is_home(self, u: Uav) -> bool:
        """Whether a UAV has ended with the battery for its way home."""
        is_down = u.end in ("battery", "lost") or (u.grounded and self.zone_of(u) < 0)
        if self.costs:
            return not is_down and 1000 * u.battery - u.remainder >= self.way_home(u)
        return not is_down and u.battery >= self.way_home(u)

    def type_of(self, i: int) -> Mapping[str, Any]:
        plain = {"slots_per_cell": 1, "quota": None, "rate": 1.0, "flying_time": None}
        types = self.c.get("fleet") or [plain]
        return types[i % len(types)]

    def begin(self) -> None:
        """Take the start cells from the log."""
        while (row := self.log.next_row).uav >= 0:
            i = len(self.uavs)
            known = {name: self.type_of(i)[name] for name in ("slots_per_cell", "rate")}
            known["quota"] = self.type_of(i)["quota"] or self.c["quota"]
            # A full battery, and what a charging slot adds; None for those of the mission.
            known |= {name: self.type_of(i).get(name) for name in ("full", "charge_rate")}
            x, y = int(row.x), int(row.y)
            self.uavs.append(Uav(x=x, y=y, from_x=x, from_y=y, battery=row.battery, **known))
            self.take("mission_start", 0.0, i)
            is_first = "uavs" not in self.c.get("before", {})
            zones = self.zones[:1] if is_first else self.zones
            self.log.require(any((x, y) in zone for zone in zones), "a UAV starts outside the zone")
        cells = {u.cell for u in self.uavs}
        self.log.require(len(cells) == len(self.uavs), "a cell with two UAVs")

    def check_batteries(self, flying_time: int) -> None:
        """Check the batteries at the start."""
        if "uavs" in (before := self.c.get("before", {})):
            for u, (battery, remainder) in zip(self.uavs, before["uavs"], strict=True):
                self.log.require(u.battery == battery, "a battery is not what was left")
                u.remainder = u.largest_remainder = remainder
            return
        for i, u in enumerate(self.uavs):
            full = self.type_of(i)["flying_time"] or flying_time
            if u.full:
                full = min(full, u.full)
            self.log.require(u.battery == full, "a battery is not full")

    # --- moves ---

    def read_moves(self) -> None:
        """Read what the UAVs asked for, and decide as the safety controller."""
        log, targets, moving = self.log, dict[int, Cell](), []
        for i, u in self.active:
            u.other, over = None, None
            if log.next_is(log.slot, "collision"):
                over, log.place = log.next_row, log.place + 1
            log.require(log.next_is(log.slot, "move"), f"move of UAV {i} expected")
            row, log.place = log.next_row, log.place + 1
            step = row.x - u.x, row.y - u.y
            log.require(step in STEPS, "a UAV moves by one cell")
            asked = int(over.value) if over else STEPS.index(step)
            must_stay = u.charging or u.grounded or u.slots_left > 0
            log.require(asked == HOVER or not must_stay, "a UAV moves that may not")
            u.logged_battery, targets[i] = row.battery, u.cell
            if u.slots_left > 0:  # it flies on
                u.slots_left -= 1
                continue
            u.from_x, u.from_y, u.asked = u.x, u.y, asked
            targets[i] = u.x + STEPS[asked][0], u.y + STEPS[asked][1]
            moving.append(u)
        self._resolve(targets)
        for u in moving:
            u.slots_left = u.slots_per_cell - 1 if u.cell != (u.from_x, u.from_y) else 0

    def _resolve(self, targets: dict[int, Cell]) -> None:
        """The safety controller: cancel moves until no UAV is in the way of another."""
        cancelled = {i: -1 for i, cell in targets.items() if cell not in self.open}
        while True:
            for i, other in cancelled.items():
                targets[i], self.uavs[i].other = self.uavs[i].cell, other
            cancelled = {i: j for i in targets if (j := self._in_the_way(i, targets)) >= 0}
            if not cancelled:
                break
        for i, (x, y) in targets.items():
            self.uavs[i].x, self.uavs[i].y = x, y

    def _in_the_way(self, i: int, targets: dict[int, Cell]) -> int:
        """The first UAV in the way of the move of UAV ``i``, or -1."""
        here = self.uavs[i].cell
        for j in targets:
            is_left = targets[i] == self.uavs[j].cell and targets[j] == here
            swap = self.c["forbid_swaps"] and is_left
            if j != i and targets[i] != here and (targets[j] == targets[i] or swap):
                return j
        return -1

    def spend(self) -> None:
        """Let the UAVs that fly lose battery."""
        for _, u in self.active:
            u.slots_grounded += u.grounded
            u.slots_waiting += u.waits
            if u.flies and not self.stands(u):
                u.slots_flying += 1
                if self.gusts and self.c["flight_cost"]:
                    self._spend_in_gusts(u)
                elif self.costs:
                    self._spend_thousandths(u)
                else:
                    u.battery -= self.c["flight_cost"]

    def _spend_thousandths(self, u: Uav) -> None:
        """Let a UAV lose what its slot costs; whole percents leave the battery."""
        step = STEPS.index((u.x - u.from_x, u.y - u.from_y))
        spent = u.remainder + self.c["flight_cost"] * self.costs[u.slots_per_cell - 1][step]
        u.battery = max(u.battery - spent // 1000, 0)
        u.remainder = u.largest_remainder = spent % 1000

    def _spend_in_gusts(self, u: Uav) -> None:
        """Let a UAV lose what the log has, which its cell may cost, and always the same."""
        step, slots = (u.x - u.from_x, u.y - u.from_y), u.slots_per_cell
        action = STEPS.index(step)
        least = most = self.costs[slots - 1][action]
        if action != HOVER:
            least = self._costs_of_moves(-self.gusts, slots)[action]
            most = self._costs_of_moves(self.gusts, slots)[action]
        if u.logged_battery == 0:  # the battery need not have sufficed
            is_possible = u.largest_remainder + most >= 1000 * u.battery
            self.log.require(is_possible, "the wind cannot cost that much")
            u.battery, u.remainder, u.largest_remainder = 0, 0, 999
            return
        percent = 1000 * (u.battery - u.logged_battery)
        low = max(least, percent - u.largest_remainder)
        high = min(most, percent + 999 - u.remainder)
        self.log.require(low <= high, "the wind cannot cost that")
        if action != HOVER:
            known = self.seen.get((*u.cell, *step, slots), (low, high))
            low, high = max(low, known[0]), min(high, known[1])
            self.log.require(low <= high, "the wind has changed")
            self.seen[(*u.cell, *step, slots)] = low, high
            opposite = self.seen.get((*u.cell, -step[0], -step[1], slots), (0, 0))
            across = any(self.c.get("wind", {}).get("moves", ()))  # a wind from the side costs both
            is_one = low <= 1000 or opposite[0] <= 1000 or across
            self.log.require(is_one, "wind from both sides")
        u.battery = u.logged_battery
        u.remainder = max(u.remainder + low - percent, 0)
        u.largest_remainder = min(u.largest_remainder + high - percent, 999)

    def take_moves(self) -> None:
        """Take the rows of the moves, which must be as they have been decided."""
        for i, u in self.active:
            if u.other is not None:
                self.take("collision", self.log.slot, i, value=u.asked, other=u.other)
            self.take("move", self.log.slot, i)
