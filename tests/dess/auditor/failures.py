"""Failures and repairs: when they happen is taken from the log, and must be possible."""

from collections.abc import Mapping
from typing import Any

from tests.dess.auditor.log import Log
from tests.dess.auditor.nodes import Nodes
from tests.dess.auditor.pads import Pads
from tests.dess.auditor.uavs import Fleet


class Failures:
    """What fails and is repaired at the ends of slots."""

    def __init__(
        self, log: Log, constants: Mapping[str, Any], fleet: Fleet, pads: Pads, nodes: Nodes
    ):
        self.log, self.fleet, self.pads, self.nodes = log, fleet, pads, nodes
        self.section = constants.get("failures")
        self.of_uavs = 0

    def replay(self) -> None:
        """Replay the failures and repairs of a slot."""
        if self.section is None:
            return
        for i, _ in self.fleet.active:
            self._replay_uav(i)
        failed = self._replay_pads()
        self._replay_nodes()
        for i in failed:
            self.fleet.take("charge_end", self.log.slot, i)
            self.pads.ask(i)
        self._lose_packets()

    def _happens(self, kind: str, is_out: bool, **index: int) -> bool:
        """Whether the log says that something fails, or is repaired if it is out of order."""
        assert self.section is not None
        mean, rate = self.section[f"{kind}_repair"], self.section[f"{kind}_rate"]
        chance = (1 / mean if mean else 0.0) if is_out else rate
        event = f"{kind}_repair" if is_out else f"{kind}_failure"
        happens = self.log.next_is(self.log.slot, event, **index)
        self.log.require(chance > 0 or not happens, f"{event}: it cannot happen")
        self.log.require(chance < 1 or happens, f"{event}: it must happen")
        return happens

    def _replay_uav(self, i: int) -> None:
        assert self.section is not None
        u = self.fleet.uavs[i]
        if u.charging or not self._happens("uav", u.grounded, uav=i):
            return
        if u.grounded:
            u.grounded = False
            self.fleet.take("uav_repair", self.log.slot, i)
            return
        self.of_uavs += 1
        u.slots_left = 0
        self.fleet.take("uav_failure", self.log.slot, i)
        if self.section["uav_repair"]:
            u.grounded = True
            return
        u.end = "lost"
        if self.section["uav_data"] == "lost" and u.collected > 0:
            self.fleet.take("data_lost", self.log.slot, i, value=u.collected)
            self.nodes.lost += u.collected
            u.collected = 0.0

    def _replay_pads(self) -> list[int]:
        """Replay the pads; return the UAVs whose pads have failed."""
        failed = []
        for pad in range(self.pads.number):
            is_out = pad in self.pads.out
            if not self._happens("pad", is_out, value=pad):
                continue
            self.log.take("pad_repair" if is_out else "pad_failure", self.log.slot, value=pad)
            self.pads.out ^= {pad}
            for i, u in enumerate(self.fleet.uavs):
                if u.charging and u.pad == pad:
                    u.charging = False
                    failed.append(i)
        return sorted(failed)

    def _replay_nodes(self) -> None:
        """Replay the nodes; what a silent node has is hidden or lost."""
        nodes, slot = self.nodes, self.log.slot
        for k in range(len(nodes.cells)):
            is_silent = k in nodes.silent
            if not self._happens("node", is_silent, node=k):
                continue
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
            elif nodes.buffers is None and amount > 0:
                nodes.take("data_lost", slot, k, value=amount)
                nodes.lost += amount

    def _lose_packets(self) -> None:
        """Lose the packets of silent nodes, if their data are lost."""
        nodes = self.nodes
        if nodes.buffers is not None and nodes.loses:
            for k in sorted(nodes.silent):
                for number in list(nodes.buffers.waiting[k]):
                    nodes.lost += nodes.buffers.lose(number, self.log.slot)
