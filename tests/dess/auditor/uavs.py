"""The UAVs: what they ask for, what the safety controller makes of it, and what it costs."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from tests.dess.auditor.log import Log, Row
from tests.dess.auditor.wind import Wind

STEPS = ((0, -1), (1, 0), (0, 1), (-1, 0), (0, 0))  # north, east, south, west, hover
HOVER = 4


@dataclass
class Uav:
    """What is known of a UAV."""

    x: int
    y: int
    battery: int
    quota: int
    slots_per_cell: int = 1
    rate: float = 1.0
    from_x: int = 0
    from_y: int = 0
    asked: int = HOVER
    slots_left: int = 0  # of its move, after the present slot
    logged_battery: int = 0  # at the end of the present slot, as the log has it
    latch: bool = False
    charging: bool = False
    grounded: bool = False
    pad: int = -1
    requested: int = -1  # the slot in which it asked for a pad
    other: int | None = None  # who overruled it in this slot: -1 for the edge of the grid
    end: str = ""
    communications: int = 0
    slots_flying: int = 0
    slots_charging: int = 0
    slots_waiting: int = 0
    slots_grounded: int = 0
    collected: float = 0.0
    reward: float = 0.0

    @property
    def waits(self) -> bool:
        return self.requested >= 0 and not self.charging

    @property
    def flies(self) -> bool:
        return not (self.end or self.charging or self.grounded)

    def share_of_move(self, n: int, m: int) -> float:
        """The share of its move that is behind it at communication slot ``n`` of ``m``."""
        slots = self.slots_per_cell
        return ((slots - 1 - self.slots_left) * m + n) / (slots * m)


class Fleet:
    """The UAVs of a mission."""

    def __init__(self, log: Log, constants: Mapping[str, Any]):
        self.log, self.c, self.wind = log, constants, Wind(log, constants)
        self.uavs: list[Uav] = []

    @property
    def active(self) -> list[tuple[int, Uav]]:
        return [(i, u) for i, u in enumerate(self.uavs) if not u.end]

    def take(self, event: str, time: float, i: int, **expected: Any) -> Row:
        """The next row, which must be of a UAV at its cell and with its battery."""
        u = self.uavs[i]
        values = {"uav": i, "x": u.x, "y": u.y, "battery": u.battery, "value": u.battery}
        return self.log.take(event, time, **(values | expected))

    def begin(self) -> None:
        """Take the start cells from the log."""
        log, (zone_x, zone_y, width, height) = self.log, self.c["zone"]
        types = self.c.get("fleet") or [{"slots_per_cell": 1, "quota": None, "rate": 1.0}]
        while log.next_row.uav >= 0:
            row, kind = log.next_row, types[len(self.uavs) % len(types)]
            where = int(row.x), int(row.y)
            quota = kind["quota"] or self.c["quota"]
            u = Uav(*where, row.battery, quota, kind["slots_per_cell"], kind["rate"])
            self.uavs.append(u)
            self.take("mission_start", 0.0, len(self.uavs) - 1)
            inside = zone_x <= row.x < zone_x + width and zone_y <= row.y < zone_y + height
            log.require(inside, "a UAV starts outside the zone")
        log.require(len({(u.x, u.y) for u in self.uavs}) == len(self.uavs), "a cell with two UAVs")

    def check_batteries(self, flying_time: int) -> None:
        """Check the batteries at the start."""
        types = self.c.get("fleet") or [{"flying_time": None}]
        for i, u in enumerate(self.uavs):
            full = types[i % len(types)]["flying_time"] or flying_time
            self.log.require(u.battery == full, "a battery is not full")

    # --- moves ---

    def read_moves(self) -> None:
        """Read what the UAVs asked for, and decide as the safety controller."""
        targets, moving = {}, set()
        for i, u in self.active:
            u.other, over = None, None
            if self.log.next_is(self.log.slot, "collision"):
                over, self.log.place = self.log.next_row, self.log.place + 1
            self.log.require(self.log.next_is(self.log.slot, "move"), f"move of UAV {i} expected")
            row, self.log.place = self.log.next_row, self.log.place + 1
            step = (row.x - u.x, row.y - u.y)
            self.log.require(step in STEPS, "a UAV moves by one cell")
            asked = int(over.value) if over else STEPS.index((int(step[0]), int(step[1])))
            must_stay = u.charging or u.grounded or u.slots_left > 0
            self.log.require(asked == HOVER or not must_stay, "a UAV moves that may not")
            u.logged_battery = row.battery
            if u.slots_left > 0:  # it flies on
                u.slots_left -= 1
                targets[i] = (u.x, u.y)
                continue
            u.from_x, u.from_y, u.asked = u.x, u.y, asked
            targets[i] = (u.x + STEPS[asked][0], u.y + STEPS[asked][1])
            moving.add(i)
        self._resolve(targets)
        for i in moving:
            u = self.uavs[i]
            u.slots_left = u.slots_per_cell - 1 if (u.x, u.y) != (u.from_x, u.from_y) else 0

    def _resolve(self, targets: dict[int, tuple[int, int]]) -> None:
        """The safety controller: cancel moves until no UAV is in the way of another."""

        def cancel(i: int, other: int) -> None:
            targets[i], self.uavs[i].other = (self.uavs[i].x, self.uavs[i].y), other

        for i, (x, y) in list(targets.items()):
            if not (0 <= x < self.c["grid"] and 0 <= y < self.c["grid"]):
                cancel(i, -1)
        while cancelled := {i: j for i in targets if (j := self._in_the_way(i, targets)) >= 0}:
            for i, j in cancelled.items():
                cancel(i, j)
        for i, (x, y) in targets.items():
            self.uavs[i].x, self.uavs[i].y = x, y

    def _in_the_way(self, i: int, targets: dict[int, tuple[int, int]]) -> int:
        """The first UAV in the way of the move of UAV ``i``, or -1."""
        here = (self.uavs[i].x, self.uavs[i].y)
        if targets[i] == here:
            return -1
        for j in targets:
            cell = (self.uavs[j].x, self.uavs[j].y)
            swap = self.c["forbid_swaps"] and targets[i] == cell and targets[j] == here
            if j != i and (targets[j] == targets[i] or swap):
                return j
        return -1

    def spend(self) -> None:
        """Let the UAVs that fly lose battery."""
        for _, u in self.active:
            u.slots_grounded += u.grounded
            if u.flies:
                u.slots_flying += 1
                u.slots_waiting += u.waits
                u.battery -= self.c["flight_cost"]
                step = u.x - u.from_x, u.y - u.from_y
                if step != (0, 0) and u.slots_left == u.slots_per_cell - 1 and u.battery > 0:
                    u.battery = self.wind.battery_after(u.battery, u.logged_battery, u.x, u.y, step)

    def take_moves(self) -> None:
        """Take the rows of the moves, which must be as they have been decided."""
        for i, u in self.active:
            if u.other is not None:
                self.take("collision", self.log.slot, i, value=u.asked, other=u.other)
            self.take("move", self.log.slot, i)
