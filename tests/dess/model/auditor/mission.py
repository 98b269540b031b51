"""The auditor: it replays a mission slot by slot, and computes its record."""

from collections.abc import Mapping, Sequence
from typing import Any

from tests.dess.model.auditor.failures import Failures
from tests.dess.model.auditor.log import Log, Row
from tests.dess.model.auditor.nodes import Nodes
from tests.dess.model.auditor.pads import EVENTS, Pads
from tests.dess.model.auditor.uavs import Fleet, Uav

FILLED = ("quota", "landed")  # how the mission of a UAV ends well
PARAMETERS = ("seed", "replication", "flying_time", "charge_start", "charge_complete")


def audit(columns: Mapping[str, Sequence[Any]], constants: Mapping[str, Any]) -> dict[str, Any]:
    """Replay a mission from its log; return its metrics and those of its UAVs.

    Args:
        columns: The columns of the log.
        constants: The fields of the scenario; of its sections those that are on.

    Returns:
        ``metrics`` of the record, ``measured`` beyond the paper's, and for each of ``uavs`` and
        ``nodes`` what is known of it.

    Raises:
        WrongLogError: If a row is not what the model makes of the rows before it.
    """
    rows = [Row(*values) for values in zip(*(columns[n] for n in Row._fields), strict=True)]
    auditor = _Auditor(Log(rows), constants)
    auditor.replay()
    uavs = [vars(u) for u in auditor.fleet.uavs]
    return {
        "metrics": auditor.metrics(),
        "measured": auditor.measured(),
        "uavs": uavs,
        "nodes": auditor.nodes.records(),
    }


class _Auditor:
    def __init__(self, log: Log, constants: Mapping[str, Any]):
        self.log, self.c = log, constants
        self.fleet = Fleet(log, constants)
        self.pads = Pads(log, constants, self.fleet)
        self.nodes = Nodes(log, constants, self.fleet)
        self.failures = Failures(log, constants, self.fleet, self.pads, self.nodes)
        self.parameters: dict[str, int] = {}

    def replay(self) -> None:
        self._begin()
        shortest = 0 if self.c["quota"] else self.c["max_slots"]
        while self.fleet.active or self.log.slot < shortest:
            self._replay_slot()
        if self.fleet.costs:
            for i, u in enumerate(self.fleet.uavs):
                found = int(self.log.next_row.value)
                is_possible = u.remainder <= found <= u.largest_remainder
                self.log.require(is_possible, "the remainder of a battery")
                self.fleet.take("remainder", self.log.slot, i, value=found)
        for i in range(len(self.fleet.uavs)):
            self.fleet.take("mission_end", self.log.slot, i)
        self.nodes.end()
        self.log.require(self.log.place == len(self.log.rows), "rows after the end")

    def _begin(self) -> None:
        self.fleet.begin()
        self.nodes.begin()
        for name in PARAMETERS:
            value = self.log.next_row.value
            self.log.take(f"mission_{name}", 0.0, value=value)
            self.parameters[name] = int(value)
        self.fleet.check_batteries(self.parameters["flying_time"])
        self.pads.start = self.parameters["charge_start"]
        self.pads.complete = self.parameters["charge_complete"]
        for u in self.fleet.uavs:
            self.pads.update_latch(u)

    def _replay_slot(self) -> None:
        log, active, begin = self.log, self.fleet.active, self.log.place
        while log.next_is(log.slot, *EVENTS):  # they depend on the moves, which come after
            log.place += 1
        self.fleet.read_moves()
        after, log.place = log.place, begin
        self.pads.replay()
        self.pads.charge()
        self.fleet.spend()
        self.fleet.take_moves()
        log.require(log.place == after, "the zone or the moves have other rows")
        slots = range(1, self.c["communication_slots"] + 1)
        data = sum(map(self.nodes.communicate, slots))
        log.slot += 1
        self.nodes.arrive()
        for i, u in active:
            self._settle(i, u, data)
        self.failures.replay()

    def _settle(self, i: int, u: Uav, data: float) -> None:
        c, charged, slot = self.c, u.charging, self.log.slot
        is_last = slot >= c["max_slots"]
        if c.get("landing"):
            on_ground = charged or self.fleet.stands(u)
            if on_ground and (u.has_filled or (u.quota == 0 and is_last)):
                u.end = "landed"
        elif u.communications >= u.quota:
            u.end = "quota"
        if not u.end and (u.battery <= 0 or is_last):
            u.end = "battery" if u.battery <= 0 else "truncated"
        u.reward += c["reward_data"] * data + c["reward_step"]
        u.reward += c["reward_overruled"] * (u.other is not None) + c["reward_charging"] * charged
        u.reward += c["reward_quota"] * (u.end in FILLED)
        u.reward += c["reward_depleted"] * (u.end == "battery")
        u.reward += c.get("age", {}).get("reward", 0.0) * self.nodes.ages.mean_at(slot)
        if charged and (u.battery >= self.pads.limit_of(u) or u.end):
            u.charging, u.requested = False, -1
            self.fleet.take("charge_end", slot, i)
        if u.end == "quota":
            self.fleet.take("quota_filled", slot, i, value=u.communications)
        if u.end == "battery":
            self.fleet.take("battery_empty", slot, i)
        if u.end == "landed":
            self.fleet.take("landing", slot, i)
        self.pads.update_latch(u)

    def _sum(self, name: str) -> Any:
        return sum(getattr(u, name) for u in self.fleet.uavs)

    def metrics(self) -> dict[str, Any]:
        """The paper's metrics."""
        nodes, collected = self.nodes, self._sum("collected")
        total = nodes.initial + nodes.arrived
        success = int(all(u.end in FILLED for u in self.fleet.uavs))
        home = int(all(map(self.fleet.is_home, self.fleet.uavs)))
        ratio = min(max(collected / total, 0.0), 1.0) if total > 0 else 1.0
        return self.parameters | {
            **{"uavs": len(self.fleet.uavs), "slots": self.log.slot, "success": success},
            "uav_slots": self._sum("slots_flying") + self._sum("slots_charging"),
            **{"initial": nodes.initial, "arrived": nodes.arrived, "collected": collected},
            **{"residual": sum(nodes.residual), "reward": self._sum("reward")},
            **{"collection_ratio": ratio, "home": home},
            "collection_ratio_and_communication": ratio * success,
        }

    def measured(self) -> dict[str, float]:
        """What the record has beyond the paper's metrics, by the sections that are on."""
        found: dict[str, float] = {}
        packets, slots = self.nodes.packets, self.log.slot
        if self.c.get("age", {}).get("measured"):
            found |= self.nodes.ages.metrics()
        if packets is not None:
            found |= packets.metrics()
        if packets is not None or "failures" in self.c:
            found["lost"] = self.nodes.lost
        if "failures" in self.c:
            grounded = self._sum("slots_grounded")
            found |= {"failures": self.failures.of_uavs, "slots_grounded": grounded}
        if "charging" in self.c:
            waited, requests = self._sum("slots_waiting"), self.pads.requests
            found["queue"] = waited / slots
            if requests:
                found["waiting"] = waited / requests
            found["pad_requests"] = requests
            found["utilisation"] = self._sum("slots_charging") / (self.pads.number * slots)
        return found
