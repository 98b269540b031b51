"""The model once more, as plainly as it can be said: model.md line by line, slow, in Python.

The tests compare the engines with it. It shares the random words (``dess.streams``) with them and
nothing else: no tables, no pruning, no compiled rules, its own queue for the pads.
"""

from collections import deque
from dataclasses import dataclass, field

import numpy as np
from scipy import special, stats

from dess import streams
from dess.scenario import Scenario

STEPS = {0: (0, -1), 1: (1, 0), 2: (0, 1), 3: (-1, 0), 4: (0, 0)}
HOVER = 4


@dataclass
class Uav:
    """One UAV and what its mission adds up to."""

    index: int
    cell: tuple[int, int]
    battery: int
    previous: tuple[int, int] = (-1, -1)
    asked: int = HOVER
    overruled: bool = False
    latch: bool = False
    charging: bool = False
    end: str = "active"
    communications: int = 0
    slots_flying: int = 0
    slots_charging: int = 0
    slots_waiting: int = 0
    collected: float = 0.0
    reward: float = 0.0

    @property
    def active(self) -> bool:
        return self.end == "active"


@dataclass
class Reference:
    """One mission of a scenario in which the UAVs ask for the given actions.

    Attributes:
        scenario: The scenario; its shadowing must not tie nodes (variance above 0).
        seed: Seed of the study.
        replication: Number of the replication.
        asked: Action by slot and UAV.
    """

    scenario: Scenario
    seed: int
    replication: int
    asked: dict[tuple[int, int], int]
    slot: int = 0
    arrived: float = 0.0
    queue: deque = field(default_factory=deque)

    def __post_init__(self) -> None:
        s = self.scenario
        self.nodes = np.array(s.nodes) * s.cell_size
        low, high = s.initial_data
        draws = [self._uniform(streams.INITIAL_DATA, 0, k // 4, k % 4) for k in range(len(s.nodes))]
        self.residual = low + (high - low) * np.array(draws)
        self.initial = self.residual.sum()
        x, y, width, height = s.zone
        free = [(x + a, y + b) for b in range(height) for a in range(width)]
        self.uavs = []
        for i in range(s.uavs):
            # The word picks one of the cells not yet taken, which stand from i on.
            word = self._word(streams.START, 0, i, 0)
            pick = i + word * (len(free) - i) // 2**32
            free[i], free[pick] = free[pick], free[i]
            self.uavs.append(Uav(i, free[i], s.flying_time))

    def run(self) -> "Reference":
        """Fly until no UAV is active."""
        while any(u.active for u in self.uavs):
            self._slot()
        return self

    def _word(self, stream: int, substream: int, index: int, word: int) -> int:
        slot = 0 if stream in (streams.START, streams.INITIAL_DATA) else self.slot
        seed = np.uint64(self.seed)
        return int(streams.block(seed, self.replication, stream, substream, slot, index)[word])

    def _uniform(self, stream: int, substream: int, index: int, word: int) -> float:
        return (self._word(stream, substream, index, word) + 0.5) / 2**32

    def _slot(self) -> None:
        active = [u for u in self.uavs if u.active]
        for u in active:  # the latch, on the battery at the start of the slot
            if u.battery <= self.scenario.charge_start:
                u.latch = True
            if u.battery >= self.scenario.charge_complete:
                u.latch = False
        self._act(active)
        self._charge(active)
        served = 0.0
        for n in range(1, self.scenario.communication_slots + 1):
            for u in active:
                served += self._communicate(u, n)
        for k in range(len(self.residual)):
            word = self._uniform(streams.ARRIVAL, 0, k // 4, k % 4)
            packets = stats.poisson.ppf(word, self.scenario.arrival_rate)
            self.residual[k] += packets
            self.arrived += packets
        self.slot += 1
        self._settle(active, served)

    def _act(self, active: list[Uav]) -> None:
        s = self.scenario
        goal = {}
        for u in active:
            u.asked = HOVER if u.charging else self.asked[self.slot, u.index]
            u.previous, u.overruled = u.cell, False
            dx, dy = STEPS[u.asked]
            goal[u.index] = (u.cell[0] + dx, u.cell[1] + dy)

        def blocked(u: Uav) -> bool:
            target = goal[u.index]
            if target == u.cell:
                return False
            if not all(0 <= coordinate < s.grid for coordinate in target):
                return True
            others = [o for o in active if o is not u]
            swap = any(goal[o.index] == u.cell and target == o.cell for o in others)
            return target in [goal[o.index] for o in others] or (s.forbid_swaps and swap)

        while cancelled := [u for u in active if blocked(u)]:
            for u in cancelled:
                goal[u.index], u.overruled = u.cell, True
        for u in active:
            u.cell = goal[u.index]

    def _charge(self, active: list[Uav]) -> None:
        s = self.scenario
        x, y, width, height = s.zone
        for u in active:
            in_zone = x <= u.cell[0] < x + width and y <= u.cell[1] < y + height
            willing = in_zone and u.latch and u.asked == HOVER
            if not willing and u in self.queue:
                self.queue.remove(u)
            elif willing and not u.charging and u not in self.queue:
                self.queue.append(u)
        pads = width * height if s.pads is None else s.pads
        while self.queue and sum(u.charging for u in active) < pads:
            self.queue.popleft().charging = True
        for u in active:
            if u.charging:
                u.battery = min(u.battery + s.charge_rate, s.charge_complete)
                u.slots_charging += 1
            else:
                u.battery -= s.flight_cost
                u.slots_flying += 1
                u.slots_waiting += u in self.queue

    def _communicate(self, u: Uav, n: int) -> float:
        s = self.scenario
        if u.charging or not (self.residual > 0).any():
            return 0.0
        m = s.communication_slots
        start, end = np.array(u.previous) * s.cell_size, np.array(u.cell) * s.cell_size
        across = self.nodes - (start + n / m * (end - start))
        distance = np.sqrt((across**2).sum(1) + s.altitude**2)
        edge = np.sqrt(2) / 2 * s.grid * s.cell_size
        substream, word = ((n - 1) // 4) * 2**16 + u.index, (n - 1) % 4
        draws = [
            self._uniform(streams.SHADOWING, substream, k, word) for k in range(len(self.nodes))
        ]
        eta = np.sqrt(s.shadowing_variance) * special.ndtri(draws)
        snr = 10 ** (s.edge_snr / 10) * (distance / edge) ** -s.path_loss_exponent
        snr = np.where(self.residual > 0, snr * 10 ** (eta / 10), -1.0)
        best = int(np.argmax(snr))
        rate = s.slot_length / m * np.log2(1 + snr[best])
        amount = min(rate, self.residual[best])
        self.residual[best] -= amount
        u.communications += 1
        u.collected += amount
        return amount

    def _settle(self, active: list[Uav], served: float) -> None:
        s = self.scenario
        for u in active:
            u.reward += s.reward_data * served + s.reward_step
            u.reward += s.reward_overruled * u.overruled + s.reward_charging * u.charging
            if u.communications >= s.quota:
                u.end = "quota"
                u.reward += s.reward_quota
            elif u.battery == 0:
                u.end = "battery"
                u.reward += s.reward_depleted
            elif self.slot == s.max_slots:
                u.end = "truncated"
            if u.battery == s.charge_complete or not u.active:
                u.charging = False
            if not u.active and u in self.queue:
                self.queue.remove(u)
