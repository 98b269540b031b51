"""An auditor of event logs: it replays a mission from its log, and fails where the log is wrong.

It knows only the page ``docs/concepts/model.md`` and the constants of the scenario, and imports
nothing of dess. What the log decides is taken from it: start cells, initial data, the actions that
the UAVs asked for, the SNR of the nodes that were served, and the new data. All else is computed
anew and compared with the log, row by row.

    report = audit(record.events.columns(), scenario.model_dump())
    report["metrics"]["collected"], report["uavs"][0]["battery"]
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

STEPS = ((0, -1), (1, 0), (0, 1), (-1, 0), (0, 0))  # north, east, south, west, hover
HOVER = 4
LARGEST_DEVIATE = 6.34  # of the shadowing, in standard deviations
ZONE_EVENTS = ("charge_request", "charge_withdrawal", "charge_start")
PARAMETERS = ("seed", "replication", "flying_time", "charge_start", "charge_complete")


class WrongLogError(Exception):
    """The log is not that of a mission of the model."""


class Row(NamedTuple):
    """A row of the log."""

    time: float
    event: str
    uav: int
    node: int
    value: float
    x: float
    y: float
    battery: int
    other: int
    snr: float
    packet: int
    generated: float


@dataclass
class Uav:
    """What is known of a UAV."""

    x: int
    y: int
    battery: int
    from_x: int = 0
    from_y: int = 0
    asked: int = HOVER
    latch: bool = False
    charging: bool = False
    requested: int = -1  # the slot in which it asked for a pad
    other: int | None = None  # who overruled it in this slot: -1 for the edge of the grid
    end: str = ""
    communications: int = 0
    slots_flying: int = 0
    slots_charging: int = 0
    slots_waiting: int = 0
    collected: float = 0.0
    reward: float = 0.0

    @property
    def waits(self) -> bool:
        return self.requested >= 0 and not self.charging


def audit(columns: Mapping[str, Sequence[Any]], constants: Mapping[str, Any]) -> dict[str, Any]:
    """Replay a mission from its log; return its metrics and those of its UAVs.

    Args:
        columns: The columns of the log.
        constants: The fields of the scenario without its sections.

    Raises:
        WrongLogError: If a row is not what the model makes of the rows before it.
    """
    rows = [Row(*values) for values in zip(*(columns[n] for n in Row._fields), strict=True)]
    return _Auditor(rows, constants).report()


class _Auditor:
    def __init__(self, rows: list[Row], constants: Mapping[str, Any]):
        self.rows, self.place, self.c = rows, 0, constants
        self.nodes = constants["nodes"]
        self.slot, self.arrived = 0, 0.0
        self.uavs: list[Uav] = []
        self.residual: list[float] = []
        self.parameters: dict[str, int] = {}

    def report(self) -> dict[str, Any]:
        self._begin()
        while any(not u.end for u in self.uavs):
            self._replay_slot()
        self._end()
        return {"metrics": self._metrics(), "uavs": [vars(u) for u in self.uavs]}

    # --- rows ---

    def require(self, holds: bool, problem: str) -> None:
        if not holds:
            raise WrongLogError(f"row {self.place - 1}, slot {self.slot}: {problem}")

    @property
    def next_row(self) -> Row:
        self.require(self.place < len(self.rows), "the log ends too early")
        return self.rows[self.place]

    def next_is(self, time: float, *events: str) -> bool:
        """Whether the next row has this time and one of these events."""
        rows = self.rows[self.place : self.place + 1]
        return any(row.time == time and row.event in events for row in rows)

    def take(self, event: str, time: float, **expected: Any) -> Row:
        """The next row, which must be this event and have the expected values."""
        is_next = self.next_is(time, event)
        self.place += 1
        self.require(is_next, f"{event} at {time} expected")
        row = self.rows[self.place - 1]
        defaults = {"uav": -1, "node": -1, "battery": -1, "other": -1, "packet": -1}
        for name, value in (defaults | expected).items():
            self.require(getattr(row, name) == value, f"{event}: {name} must be {value}")
        self.require(math.isnan(row.snr) == (event != "communication"), f"{event}: its snr")
        self.require(math.isnan(row.generated), f"{event}: its generated")
        return row

    def take_of_uav(self, event: str, time: float, i: int, **expected: Any) -> Row:
        """The next row, which must be of a UAV at its cell and with its battery."""
        u = self.uavs[i]
        values = {"uav": i, "x": u.x, "y": u.y, "battery": u.battery, "value": u.battery}
        return self.take(event, time, **(values | expected))

    # --- begin and end ---

    def _begin(self) -> None:
        zone_x, zone_y, width, height = self.c["zone"]
        while self.next_row.uav >= 0:
            row = self.take("mission_start", 0.0, uav=len(self.uavs), battery=self.next_row.battery)
            self.require(row.value == row.battery, "the battery has two values")
            self.uavs.append(Uav(int(row.x), int(row.y), row.battery))
            inside = zone_x <= row.x < zone_x + width and zone_y <= row.y < zone_y + height
            self.require(inside, "a UAV starts outside the zone")
        self.require(len({(u.x, u.y) for u in self.uavs}) == len(self.uavs), "a cell with two UAVs")
        low, high = self.c["initial_data"]
        for k, (x, y) in enumerate(self.nodes):
            row = self.take("mission_start", 0.0, node=k, x=x, y=y)
            self.require(low <= row.value <= high, "initial data out of range")
            self.residual.append(row.value)
        self.initial = sum(self.residual)
        for name in PARAMETERS:
            self.parameters[name] = int(self.take(f"mission_{name}", 0.0, x=-1, y=-1).value)
        for u in self.uavs:
            self.require(u.battery == self.parameters["flying_time"], "a battery is not full")
            self._update_latch(u)

    def _end(self) -> None:
        for i in range(len(self.uavs)):
            self.take_of_uav("mission_end", self.slot, i)
        for k, (x, y) in enumerate(self.nodes):
            self.take("mission_end", self.slot, node=k, x=x, y=y, value=self.residual[k])
        self.require(self.place == len(self.rows), "rows after the end")

    def _metrics(self) -> dict[str, Any]:
        total = self.initial + self.arrived
        success = int(all(u.end == "quota" for u in self.uavs))
        collected = sum(u.collected for u in self.uavs)
        ratio = min(collected / total, 1.0) if total > 0 else 1.0
        return self.parameters | {
            "uavs": len(self.uavs),
            "slots": self.slot,
            "uav_slots": sum(u.slots_flying + u.slots_charging for u in self.uavs),
            "success": success,
            "initial": self.initial,
            "arrived": self.arrived,
            "collected": collected,
            "residual": sum(self.residual),
            "collection_ratio": ratio,
            "collection_ratio_and_communication": ratio * success,
            "reward": sum(u.reward for u in self.uavs),
        }

    # --- a slot ---

    def _replay_slot(self) -> None:
        active = [u for u in self.uavs if not u.end]
        begin = self.place
        while self.next_is(self.slot, *ZONE_EVENTS):  # they depend on the moves, which come after
            self.place += 1
        self._read_moves()
        after, self.place = self.place, begin
        self._replay_zone()
        for u in active:
            self._spend(u)
        self._replay_moves()
        self.require(self.place == after, "the zone or the moves have other rows")
        before = sum(u.collected for u in self.uavs)
        for n in range(1, self.c["communication_slots"] + 1):
            self._replay_communications(n)
        data = sum(u.collected for u in self.uavs) - before
        self.slot += 1
        self._replay_arrivals()
        for i, u in enumerate(self.uavs):
            if u in active:
                self._settle(i, u, data)

    def _read_moves(self) -> None:
        """Read what the UAVs asked for, and decide as the safety controller."""
        targets = {}
        for i, u in enumerate(self.uavs):
            if u.end:
                continue
            u.from_x, u.from_y, u.other, over = u.x, u.y, None, None
            if self.next_is(self.slot, "collision"):
                over, self.place = self.next_row, self.place + 1
            self.require(self.next_is(self.slot, "move"), f"move of UAV {i} expected")
            row, self.place = self.next_row, self.place + 1
            step = (row.x - u.x, row.y - u.y)
            self.require(step in STEPS, "a UAV moves by one cell")
            u.asked = int(over.value) if over else STEPS.index((int(step[0]), int(step[1])))
            self.require(u.asked == HOVER or not u.charging, "a charging UAV hovers")
            targets[i] = (u.x + STEPS[u.asked][0], u.y + STEPS[u.asked][1])
        self._resolve(targets)

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

    def _replay_zone(self) -> None:
        zone_x, zone_y, width, height = self.c["zone"]
        for i, u in enumerate(self.uavs):
            inside = 0 <= u.x - zone_x < width and 0 <= u.y - zone_y < height
            may_charge = not u.end and u.latch and u.asked == HOVER and inside
            if may_charge and u.requested < 0:
                u.requested = self.slot
                self.take_of_uav("charge_request", self.slot, i)
            elif not may_charge and u.requested >= 0:
                u.requested = -1
                self.take_of_uav("charge_withdrawal", self.slot, i)
        pads = self.c["pads"] or width * height
        free = pads - sum(u.charging for u in self.uavs)
        queue = [(u.requested, i) for i, u in enumerate(self.uavs) if u.waits]
        for _, i in sorted(queue)[:free]:
            self.uavs[i].charging = True
            self.take_of_uav("charge_start", self.slot, i)

    def _spend(self, u: Uav) -> None:
        if u.charging:
            u.battery = min(u.battery + self.c["charge_rate"], self.parameters["charge_complete"])
            u.slots_charging += 1
        else:
            u.battery -= self.c["flight_cost"]
            u.slots_flying += 1
            u.slots_waiting += u.waits

    def _replay_moves(self) -> None:
        for i, u in enumerate(self.uavs):
            if not u.end:
                if u.other is not None:
                    self.take_of_uav("collision", self.slot, i, value=u.asked, other=u.other)
                self.take_of_uav("move", self.slot, i)

    def _replay_communications(self, n: int) -> None:
        m = self.c["communication_slots"]
        for i, u in enumerate(self.uavs):
            if u.end or u.charging or not any(data > 0 for data in self.residual):
                continue
            x, y = u.from_x + (u.x - u.from_x) * n / m, u.from_y + (u.y - u.from_y) * n / m
            chosen = {"node": self.next_row.node, "value": self.next_row.value}
            row = self.take_of_uav("communication", self.slot + n / m, i, x=x, y=y, **chosen)
            self._check_snr(row)
            rate = self.c["slot_length"] / m * math.log1p(10 ** (row.snr / 10)) / math.log(2)
            amount = min(rate, self.residual[row.node])
            self.require(math.isclose(row.value, amount, rel_tol=1e-9), "its SNR has another rate")
            self.residual[row.node] -= row.value
            self.require(self.residual[row.node] >= 0, "more data than the node has")
            u.collected += row.value
            u.communications += 1

    def _check_snr(self, row: Row) -> None:
        """The node must have data and may have the highest SNR of all, given their shadowing."""
        reach = LARGEST_DEVIATE * math.sqrt(self.c["shadowing_variance"]) + 1e-9
        with_data = [k for k, data in enumerate(self.residual) if data > 0]
        self.require(row.node in with_data, "a node without data")
        mean = {k: self._mean_snr(row.x, row.y, self.nodes[k]) for k in with_data}
        self.require(abs(row.snr - mean[row.node]) <= reach, "an SNR that its node cannot have")
        self.require(row.snr >= max(mean.values()) - reach, "another node has a higher SNR")

    def _mean_snr(self, x: float, y: float, node: tuple[int, int]) -> float:
        c = self.c
        horizontal = c["cell_size"] * math.hypot(x - node[0], y - node[1])
        edge = math.sqrt(2) / 2 * c["grid"] * c["cell_size"]
        distance = math.hypot(horizontal, c["altitude"])
        return c["edge_snr"] - 10 * c["path_loss_exponent"] * math.log10(distance / edge)

    def _replay_arrivals(self) -> None:
        last = -1
        while self.next_is(self.slot, "arrival"):
            k = self.next_row.node
            self.require(last < k < len(self.nodes), "an arrival out of order")
            row = self.take("arrival", self.slot, node=k, x=self.nodes[k][0], y=self.nodes[k][1])
            is_count = row.value >= 1 and row.value == int(row.value)
            self.require(is_count and self.c["arrival_rate"] > 0, "no number of packets")
            self.residual[k] += row.value
            self.arrived += row.value
            last = k

    def _settle(self, i: int, u: Uav, data: float) -> None:
        c, charged, full = self.c, u.charging, self.parameters["charge_complete"]
        if u.communications >= c["quota"]:
            u.end = "quota"
        elif u.battery <= 0:
            u.end = "battery"
        elif self.slot >= c["max_slots"]:
            u.end = "truncated"
        u.reward += c["reward_data"] * data + c["reward_step"]
        u.reward += c["reward_overruled"] * (u.other is not None) + c["reward_charging"] * charged
        u.reward += c["reward_quota"] * (u.end == "quota")
        u.reward += c["reward_depleted"] * (u.end == "battery")
        if charged and (u.battery >= full or u.end):
            u.charging, u.requested = False, -1
            self.take_of_uav("charge_end", self.slot, i)
        if u.end == "quota":
            self.take_of_uav("quota_filled", self.slot, i, value=u.communications)
        if u.end == "battery":
            self.take_of_uav("battery_empty", self.slot, i)
        self._update_latch(u)

    def _update_latch(self, u: Uav) -> None:
        if u.battery <= self.parameters["charge_start"]:
            u.latch = True
        if u.battery >= self.parameters["charge_complete"]:
            u.latch = False
