"""The nodes: new data, communications, and what becomes of the data."""

import math
from collections.abc import Mapping
from typing import Any

from tests.dess.model.auditor.log import Log
from tests.dess.model.auditor.packets import Ages, Packets
from tests.dess.model.auditor.uavs import LARGEST_DEVIATE, Fleet, Uav

ROUNDING = 1e-9  # of data [data units]


def count_of(constants: Mapping[str, Any]) -> int:
    """The number of nodes."""
    return len(constants["nodes"])


class Nodes:
    """The data of the nodes [data units].

    Attributes:
        residual: What UAVs can collect, for each node.
        hidden: What a node has while it is silent.
        silent: The nodes that are silent.
    """

    def __init__(self, log: Log, constants: Mapping[str, Any], fleet: Fleet):
        self.log, self.c, self.fleet = log, constants, fleet
        self.cells: list[tuple[int, int]] = [(x, y) for x, y in constants["nodes"]]
        self.residual: list[float] = []
        self.hidden, self.silent = [0.0] * len(self.cells), set[int]()
        self.initial = self.arrived = self.lost = 0.0
        self.begun: list[float] = []  # the initial data of each node
        self.gained, self.taken = [0.0] * len(self.cells), [0.0] * len(self.cells)
        # What a mission begins with that is not the first one: how long nodes were idle before it,
        # their data then, and their ages.
        before = constants.get("before", {})
        self.idle: float = before.get("idle", 0.0)
        self.left: list[float] | None = before.get("data")
        m = constants["communication_slots"]
        ages = before.get("ages", [0.0] * count_of(constants))
        self.ages = Ages([round((age + self.idle) * m) / m for age in ages])
        self.loses = constants.get("failures", {}).get("node_data") == "lost"
        arrivals = constants.get("arrivals", {"process": "slotted"})
        count = len(self.cells)
        merged = arrivals.get("merged") or [1] * count
        self.rates = arrivals.get("rates") or [constants["arrival_rate"] * n for n in merged]
        low, high = constants["initial_data"]
        own = [(data, data) for data in arrivals.get("initial", ())]
        self.ranges = own or [(low * n, high * n) for n in merged]
        self.message = arrivals.get("message") or 1.0
        off = {"range": 0.0, "max_rate": 0.0, "anchor": 0.0, "steps": (), "duty_cycle": 1.0}
        self.radio = constants.get("radio", off)
        is_continuous = arrivals["process"] == "continuous"
        self.packets = Packets(log, arrivals, self.cells) if is_continuous else None

    def take(self, event: str, time: float, k: int, **expected: Any) -> Any:
        """The next row, which must be of a node."""
        x, y = self.cells[k]
        return self.log.take(event, time, node=k, x=x, y=y, **expected)

    def begin(self) -> None:
        """Take the initial data from the log."""
        for k, (low, high) in enumerate(self.ranges):
            amount, packet = self.log.next_row.value, {}
            if self.packets is not None and amount > 0:
                packet = {"packet": len(self.packets.all), "generated": 0.0}
                self.packets.store(k, 0.0, amount)
            self.take("mission_start", 0.0, k, value=amount, **packet)
            if self.left is not None:
                low = high = self.left[k]
            collected = amount - low
            if self.idle:
                is_right = collected < ROUNDING or self._is_made(
                    collected, self.rates[k] * self.idle
                )
            else:
                is_right = low <= amount <= high
            self.log.require(is_right, "initial data out of range")
            self.residual.append(amount)
        self.initial = sum(self.residual)
        self.begun = [*self.residual]

    def end(self) -> None:
        """Take the data that are left over from the log."""
        for k in range(len(self.cells)):
            self.residual[k] += self.hidden[k]
            self.take("mission_end", self.log.slot, k, value=self.residual[k])
        self.ages.finish(self.log.slot)

    def records(self) -> list[dict[str, float]]:
        """What the record has of every node of a mission that has ended."""
        end = self.log.slot
        return [
            {
                "initial": self.begun[k],
                "arrived": self.gained[k],
                "collected": self.taken[k],
                "residual": self.residual[k],
                "age": self.ages.areas[k] / end,
                "age_at_end": end - self.ages.newest[k],
            }
            for k in range(len(self.cells))
        ]

    # --- communications ---

    def communicate(self, n: int) -> float:
        """Replay a communication slot; return the data that all UAVs have collected in it."""
        time, served = self.log.slot + n / self.c["communication_slots"], []
        if self.packets is not None:
            self._packets_arrive(self.packets, time)
        for i, u in enumerate(self.fleet.uavs):
            serves = u.flies and not self.fleet.stands(u)
            if serves and self._in_range(u, n) and not self._is_too_far(i, n, time):
                served.append((i, self._serve(i, n, time)))
        if self.packets is not None:
            self._deliver(self.packets, served)
        return sum(row.value for _, row in served)

    def _place(self, u: Uav, n: int) -> tuple[float, float]:
        m, slots = self.c["communication_slots"], u.slots_per_cell
        share = ((slots - 1 - u.slots_left) * m + n) / (slots * m)  # of its move, behind it
        return u.from_x + (u.x - u.from_x) * share, u.from_y + (u.y - u.from_y) * share

    def _in_range(self, u: Uav, n: int) -> list[int]:
        """The nodes with data that a UAV can serve in a communication slot."""
        place, reach = self._place(u, n), self.radio["range"] or math.inf
        far = (self._distance(*place, k) for k in range(len(self.cells)))
        return [k for k, d in enumerate(far) if d <= reach and self.residual[k] > 0]

    def _is_too_far(self, i: int, n: int, time: float) -> bool:
        """Whether a UAV serves no node although some have data: all are below the lowest step."""
        row = self.log.next_row
        is_served = row.event == "communication" and (row.time, row.uav) == (time, i)
        if is_served or not self.radio["steps"]:
            return False
        u = self.fleet.uavs[i]
        place = self._place(u, n)
        best = max(self._mean_snr(place, k) for k in self._in_range(u, n))
        can_be_low = best - self._largest_shadowing() < self.radio["steps"][0][0]
        self.log.require(can_be_low, "no node is served")
        return True

    def _serve(self, i: int, n: int, time: float) -> Any:
        u, m, log = self.fleet.uavs[i], self.c["communication_slots"], self.log
        x, y = self._place(u, n)
        k, value = log.next_row.node, log.next_row.value
        row = self.fleet.take("communication", time, i, x=x, y=y, node=k, value=value)
        self._check_snr(row, self._in_range(u, n))
        length = self.c["slot_length"] / m * self.radio["duty_cycle"]
        amount = min(length * self._efficiency(row.snr) * u.rate, self.residual[k])
        log.require(math.isclose(value, amount, rel_tol=1e-9), "its SNR has another rate")
        self.residual[k] -= value
        self.taken[k] += value
        log.require(self.residual[k] >= 0, "more data than the node has")
        if self.residual[k] == 0 and self.packets is None:
            self.ages.fall(k, time, time)
        u.collected += value
        u.communications += 1
        if self.c.get("landing") and u.communications == u.quota:
            self.fleet.take("quota_filled", time, i, value=u.communications)
        return row

    def _efficiency(self, snr: float) -> float:
        if not self.radio["steps"]:
            shannon = math.log1p(10 ** (snr / 10)) / math.log(2)
            return min(shannon, self.radio["max_rate"] or math.inf)
        reached = [efficiency for least, efficiency in self.radio["steps"] if least <= snr]
        self.log.require(len(reached) > 0, "served below the lowest step")
        return max(reached)

    def _check_snr(self, row: Any, nodes: list[int]) -> None:
        """The node must be one of these, and may have the highest SNR, given their shadowing."""
        reach = self._largest_shadowing()
        mean = {k: self._mean_snr((row.x, row.y), k) for k in nodes}
        self.log.require(row.node in mean, "a node without data, or out of range")
        self.log.require(abs(row.snr - mean[row.node]) <= reach, "an SNR that its node cannot have")
        self.log.require(row.snr >= max(mean.values()) - reach, "another node has a higher SNR")

    def _largest_shadowing(self) -> float:
        return LARGEST_DEVIATE * math.sqrt(self.c["shadowing_variance"]) + 1e-9

    def _distance(self, from_x: float, from_y: float, k: int) -> float:
        c, (x, y) = self.c, self.cells[k]
        return math.hypot(c["cell_size"] * math.hypot(from_x - x, from_y - y), c["altitude"])

    def _mean_snr(self, place: tuple[float, float], k: int) -> float:
        c, distance = self.c, self._distance(*place, k)
        edge = math.hypot(c["grid"], c.get("rows") or c["grid"]) / 2 * c["cell_size"]
        edge = self.radio["anchor"] or edge
        return c["edge_snr"] - 10 * c["path_loss_exponent"] * math.log10(distance / edge)

    def _deliver(self, packets: Packets, served: list[tuple[int, Any]]) -> None:
        """Take what the UAVs have collected in a communication slot from the packets."""
        for i, row in served:
            self._collect(packets, i, row, row.value)
        for i, row in served:  # the data of a node and of its packets are rounded in other orders
            if not packets.waiting[row.node]:
                self.residual[row.node] = 0.0
            elif self.residual[row.node] == 0.0:
                self._collect(packets, i, row, math.inf)

    def _collect(self, packets: Packets, i: int, row: Any, amount: float) -> None:
        battery = self.fleet.uavs[i].battery
        for packet in packets.serve(row.node, row.time, amount, i, battery):
            self.ages.fall(row.node, row.time, packet.generated)

    # --- new data ---

    def arrive(self) -> None:
        """Take the new data at the end of a slot from the log."""
        last = -1
        while self.packets is None and self.log.next_is(self.log.slot, "arrival"):
            amount, k = self.log.next_row.value, self.log.next_row.node
            self.log.require(last < k < len(self.cells), "an arrival out of order")
            self.take("arrival", self.log.slot, k, value=amount)
            self.log.require(self._is_made(amount, self.rates[k]), "no number of messages")
            self.residual[k] += amount
            self.gained[k] += amount
            self.arrived += amount
            last = k

    def _is_made(self, amount: float, rate: float) -> bool:
        """Whether a node can make that much in a slot: whole messages, or of many its rate."""
        if self.c.get("arrivals", {}).get("message") and rate / self.message > 50:
            return math.isclose(amount, rate)
        count = amount / self.message
        return rate > 0 and count > 0.5 and math.isclose(count, round(count))

    def _packets_arrive(self, packets: Packets, until: float) -> None:
        """Take the packets that arrive before a communication slot from the log."""
        now = until - 1 / self.c["communication_slots"] - 1e-9
        while (row := self.log.next_row).event == "arrival" and row.time < until:
            time, k, number = row.time, row.node, len(packets.all)
            self.log.require(now <= time and 0 <= k < len(self.cells), "an arrival out of order")
            self.take("arrival", time, k, value=self.message, packet=number, generated=time)
            packets.check_rate(k, time, self.rates[k])
            now, gained = time, self.message
            self.arrived += self.message
            self.gained[k] += self.message
            lost = packets.store(k, time, self.message)
            lost = number if k in self.silent and self.loses else lost
            if lost >= 0:
                amount = packets.lose(lost, time)
                self.lost += amount
                gained -= amount
            (self.hidden if k in self.silent else self.residual)[k] += gained
