"""Failures and repairs: when they happen is taken from the log, and must be possible."""

from collections.abc import Mapping
from typing import Any

from tests.dess.model.auditor.log import Log
from tests.dess.model.auditor.nodes import Nodes
from tests.dess.model.auditor.pads import Pads
from tests.dess.model.auditor.uavs import Fleet


class Failures:
    """What fails and is repaired at the ends of slots."""

    def __init__(
        self, log: Log, constants: Mapping[str, Any], fleet: Fleet, pads: Pads, nodes: Nodes
    ):
        self.log, self.fleet, self.pads, self.nodes = log, fleet, pads, nodes
        self.section, self.of_uavs = constants.get("failures", {}), 0

    def replay(self) -> None:
        """Replay the failures and repairs of a slot."""
        if not self.section:
            return
        for i, _ in self.fleet.active:
            self._replay_uav(i)
        failed = [i for pad in range(self.pads.number) for i in self._replay_pad(pad)]
        self._replay_nodes()
        for i in sorted(failed):
            self.fleet.take("charge_end", self.log.slot, i)
            self.pads.ask(i)
        if (packets := self.nodes.packets) is not None and self.nodes.loses:
            for k in sorted(self.nodes.silent):
                for number in [*packets.waiting[k]]:
                    self.nodes.lost += packets.lose(number, self.log.slot)

    def _happens(self, kind: str, is_out: bool, zone: int = 0, **index: int) -> bool:
        """Whether the log says that something fails, or is repaired if it is out of order."""
        mean, rate = self.section[f"{kind}_repair"], self.section[f"{kind}_rate"]
        mean = [*self.section.get(f"{kind}_repairs", ()), *[mean] * 8][zone]
        rate = [*self.section.get(f"{kind}_rates", ()), *[rate] * 8][zone]
        chance = (1 / mean if mean else 0.0) if is_out else rate
        event = f"{kind}_repair" if is_out else f"{kind}_failure"
        happens = self.log.next_is(self.log.slot, event, **index)
        self.log.require(chance > 0 or not happens, f"{event}: it cannot happen")
        self.log.require(chance < 1 or happens, f"{event}: it must happen")
        return happens

    def _replay_uav(self, i: int) -> None:
        u, slot = self.fleet.uavs[i], self.log.slot
        on_ground = u.charging or self.fleet.stands(u)
        if on_ground or not self._happens("uav", u.grounded, uav=i):
            return
        if u.grounded:
            u.grounded = False
            self.fleet.take("uav_repair", slot, i)
            return
        self.of_uavs += 1
        u.slots_left = 0
        self.fleet.take("uav_failure", slot, i)
        u.grounded = self.section["uav_repair"] > 0
        if u.grounded:
            return
        u.end = "lost"
        if self.section["uav_data"] == "lost" and u.collected > 0:
            self.fleet.take("data_lost", slot, i, value=u.collected)
            self.nodes.lost += u.collected
            u.collected = 0.0

    def _replay_pad(self, pad: int) -> list[int]:
        """Replay a pad; return the UAV whose pad has failed."""
        is_out = pad in self.pads.out
        zone = next(zone for zone, pads in enumerate(self.pads.zones) if pad in pads)
        if not self._happens("pad", is_out, zone, value=pad):
            return []
        self.log.take("pad_repair" if is_out else "pad_failure", self.log.slot, value=pad)
        self.pads.out ^= {pad}
        failed = [i for i, u in enumerate(self.fleet.uavs) if u.charging and u.pad == pad]
        for i in failed:
            self.fleet.uavs[i].charging = False
        return failed

    def _replay_nodes(self) -> None:
        """Replay the nodes; what a silent node has is hidden or lost."""
        nodes, slot = self.nodes, self.log.slot
        for k in range(len(nodes.cells)):
            is_silent = k in nodes.silent
            if self._happens("node", is_silent, node=k):
                nodes.silent ^= {k}
                if is_silent:
                    nodes.residual[k] += nodes.hidden[k]
                    nodes.hidden[k] = 0.0
                event = "node_repair" if is_silent else "node_failure"
                nodes.take(event, slot, k, value=nodes.residual[k])
        for k in sorted(nodes.silent):
            amount, nodes.residual[k] = nodes.residual[k], 0.0
            if not nodes.loses:
                nodes.hidden[k] += amount
            elif nodes.packets is None and amount > 0:
                nodes.take("data_lost", slot, k, value=amount)
                nodes.lost += amount
