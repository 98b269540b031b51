"""The nodes: new data, communications, and what becomes of the data."""

import math
from collections.abc import Mapping
from typing import Any

from tests.dess.auditor.ages import Ages
from tests.dess.auditor.buffers import Buffers
from tests.dess.auditor.log import Log, Row
from tests.dess.auditor.uavs import Fleet

LARGEST_DEVIATE = 6.34  # of the shadowing, in standard deviations


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
        self.ages = Ages(len(self.cells))
        self.loses = constants.get("failures", {}).get("node_data") == "lost"
        arrivals = constants.get("arrivals", {"process": "slotted"})
        is_continuous = arrivals["process"] == "continuous"
        self.buffers = Buffers(log, arrivals, self.cells) if is_continuous else None

    def take(self, event: str, time: float, k: int, **expected: Any) -> Row:
        """The next row, which must be of a node."""
        x, y = self.cells[k]
        return self.log.take(event, time, node=k, x=x, y=y, **expected)

    def begin(self) -> None:
        """Take the initial data from the log."""
        low, high = self.c["initial_data"]
        for k in range(len(self.cells)):
            amount = self.log.next_row.value
            packet: dict[str, Any] = {}
            if self.buffers is not None and amount > 0:
                self.buffers.store(k, 0.0, amount)
                packet = {"packet": len(self.buffers.packets) - 1, "generated": 0.0}
            self.take("mission_start", 0.0, k, value=amount, **packet)
            self.log.require(low <= amount <= high, "initial data out of range")
            self.residual.append(amount)
        self.initial = sum(self.residual)

    def end(self) -> None:
        """Take the data that are left over from the log."""
        for k in range(len(self.cells)):
            self.residual[k] += self.hidden[k]
            self.take("mission_end", self.log.slot, k, value=self.residual[k])

    # --- communications ---

    def communicate(self, n: int) -> float:
        """Replay a communication slot; return the data that all UAVs have collected in it."""
        time, served = self.log.slot + n / self.c["communication_slots"], []
        if self.buffers is not None:
            self._packets_arrive(time)
        for i, u in enumerate(self.fleet.uavs):
            if u.flies and any(data > 0 for data in self.residual):
                served.append((i, self._serve(i, n, time)))
        if self.buffers is not None:
            self._deliver(self.buffers, served)
        return sum(row.value for _, row in served)

    def _serve(self, i: int, n: int, time: float) -> Row:
        u, m = self.fleet.uavs[i], self.c["communication_slots"]
        share = u.share_of_move(n, m)
        x, y = u.from_x + (u.x - u.from_x) * share, u.from_y + (u.y - u.from_y) * share
        chosen = {"node": self.log.next_row.node, "value": self.log.next_row.value}
        row = self.fleet.take("communication", time, i, x=x, y=y, **chosen)
        self._check_snr(row)
        rate = self.c["slot_length"] / m * math.log1p(10 ** (row.snr / 10)) / math.log(2)
        amount = min(rate * u.rate, self.residual[row.node])
        self.log.require(math.isclose(row.value, amount, rel_tol=1e-9), "its SNR has another rate")
        self.residual[row.node] -= row.value
        self.log.require(self.residual[row.node] >= 0, "more data than the node has")
        if self.residual[row.node] == 0 and self.buffers is None:
            self.ages.fall(row.node, time, time)
        u.collected += row.value
        u.communications += 1
        return row

    def _check_snr(self, row: Row) -> None:
        """The node must have data and may have the highest SNR of all, given their shadowing."""
        reach = LARGEST_DEVIATE * math.sqrt(self.c["shadowing_variance"]) + 1e-9
        with_data = [k for k, data in enumerate(self.residual) if data > 0]
        self.log.require(row.node in with_data, "a node without data")
        mean = {k: self._mean_snr(row.x, row.y, self.cells[k]) for k in with_data}
        self.log.require(abs(row.snr - mean[row.node]) <= reach, "an SNR that its node cannot have")
        self.log.require(row.snr >= max(mean.values()) - reach, "another node has a higher SNR")

    def _mean_snr(self, x: float, y: float, node: tuple[int, int]) -> float:
        c = self.c
        horizontal = c["cell_size"] * math.hypot(x - node[0], y - node[1])
        edge = math.sqrt(2) / 2 * c["grid"] * c["cell_size"]
        distance = math.hypot(horizontal, c["altitude"])
        return c["edge_snr"] - 10 * c["path_loss_exponent"] * math.log10(distance / edge)

    def _deliver(self, buffers: Buffers, served: list[tuple[int, Row]]) -> None:
        """Take what the UAVs have collected in a communication slot from the packets."""
        for i, row in served:
            self._collect(buffers, i, row, row.value)
        for i, row in served:  # the data of a node and of its packets are rounded in other orders
            if not buffers.waiting[row.node]:
                self.residual[row.node] = 0.0
            elif self.residual[row.node] == 0.0:
                self._collect(buffers, i, row, math.inf)

    def _collect(self, buffers: Buffers, i: int, row: Row, amount: float) -> None:
        battery = self.fleet.uavs[i].battery
        for number in buffers.serve(row.node, row.time, amount, i, battery):
            self.ages.fall(row.node, row.time, buffers.packets[number].generated)

    # --- new data ---

    def arrive(self) -> None:
        """Take the new data at the end of a slot from the log."""
        last = -1
        while self.buffers is None and self.log.next_is(self.log.slot, "arrival"):
            amount, k = self.log.next_row.value, self.log.next_row.node
            self.log.require(last < k < len(self.cells), "an arrival out of order")
            self.take("arrival", self.log.slot, k, value=amount)
            is_count = amount >= 1 and amount == int(amount)
            self.log.require(is_count and self.c["arrival_rate"] > 0, "no number of packets")
            self.residual[k] += amount
            self.arrived += amount
            last = k

    def _packets_arrive(self, until: float) -> None:
        """Take the packets that arrive before a communication slot from the log."""
        buffers, now = self.buffers, until - 1 / self.c["communication_slots"] - 1e-9
        assert buffers is not None
        while self.log.next_row.event == "arrival" and self.log.next_row.time < until:
            time, k = self.log.next_row.time, self.log.next_row.node
            self.log.require(now <= time and 0 <= k < len(self.cells), "an arrival out of order")
            number, now = len(buffers.packets), time
            self.take("arrival", time, k, value=1.0, packet=number, generated=time)
            buffers.check_rate(k, time, self.c["arrival_rate"])
            self.arrived += 1.0
            lost = buffers.store(k, time, 1.0)
            if k in self.silent and self.loses:
                lost = number
            gained = 1.0
            if lost >= 0:
                amount = buffers.lose(lost, time)
                self.lost += amount
                gained -= amount
            (self.hidden if k in self.silent else self.residual)[k] += gained
