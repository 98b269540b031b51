"""The observation ``sets`` in plain Python: one number after the other, as trained weights know it.

Weights are trained on these very numbers, so the order of the sums and the places where a number is
rounded to float32 are those of version 1 of the encoder.
"""

from collections import namedtuple
from collections.abc import Iterable
from functools import cache
from math import exp, hypot, log, log2, log10
from typing import Any

import numpy as np

from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates
from dess.model.state import HOVER, STEP_X, STEP_Y
from dess.scenario.scenario import ScenarioSpace
from tests.drawn import Cell, reached

SCALES, NORMS, FARTHEST = (1.5, 4.0, 12.0), (1.0, 2.5, 8.0), 255
Uav = namedtuple("Uav", "x y battery needed active latch charging must_charge home mask")
Line = list[Any]
f32 = np.float32
frozen = cache(frozenset)  # the same object for the same cells, by which ``reached`` finds its ways


def arrays_of(space: ScenarioSpace, states: CompactStates, b: int, i: int) -> list[np.ndarray]:
    """The eight arrays of UAV ``i`` in mission ``b``."""
    seen = Seen(space, states, b, i)
    arrays = [np.array(seen.own(), f32), np.array([seen.action(a) for a in range(5)], f32)]
    for size, members in (
        (24, [seen.node(k) for k in range(len(space.nodes))]),
        (17, [seen.mate(mate) for mate in seen.others]),
        (11, [seen.zone(number) for number in range(len(seen.zones))]),
    ):
        arrays.append(np.array([line for line, _ in members], f32).reshape(-1, size))
        arrays.append(np.array([moves for _, moves in members], f32).reshape(-1, 9).T)
    return arrays


def team_of(states: CompactStates, b: int) -> list[Uav]:
    """The UAVs of mission ``b``."""
    places = [getattr(column, name.upper()) for name in Uav._fields]
    return [Uav(*row) for row in states.uavs[b][:, places].tolist()]


def clip(value: Any, low: float, high: float) -> Any:
    """The value, or the bound that it exceeds."""
    return min(max(value, low), high)


def total(values: Iterable[Any]) -> Any:
    """The sum, rounded to float32 after each value."""
    return sum(values, f32(0))


def near(way: int, scale: float, norm: float = 1.0) -> Any:
    """The nearness of what is that many cells away."""
    return f32(exp(-min(way, FARTHEST) / scale) / norm)


def straight(dx: int, dy: int) -> Line:
    """The share of the straight line that is along each of the four moves."""
    part = float(f32(1 / max(abs(dx) + abs(dy), 1)))
    return [-dy * part, dx * part, dy * part, -dx * part]


class Seen:
    """What one UAV sees."""

    def __init__(self, space: ScenarioSpace, states: CompactStates, b: int, i: int):
        self.space, self.nodes, self.no_fly = space, space.nodes, frozen(space.no_fly)
        team = team_of(states, b)
        self.me, self.others = team[i], team[:i] + team[i + 1 :]
        self.mates = [mate for mate in self.others if mate.active]
        self.fliers = [(mate.x, mate.y) for mate in self.mates if not mate.charging]
        self.start = int(states.missions[b, column.CHARGE_START])
        self.complete = int(states.missions[b, column.CHARGE_COMPLETE])
        self.zones = [
            [(x + n % width, y + n // width) for n in range(width * height)]
            for x, y, width, height in space.rectangles
        ]
        self.here = self.me.x, self.me.y
        steps = zip(STEP_X.tolist(), STEP_Y.tolist(), strict=True)
        self.ends = [self.end(self.me.x + dx, self.me.y + dy) for dx, dy in steps]
        (low, high), arriving = space.initial_data, space.arrival_rate
        self.unit = max(0.75 * low + 0.25 * high, 40 * arriving, 1e-3)
        self.data = [residual * (f32(1) / f32(self.unit)) for residual in states.residual[b]]
        self.mean = total(self.data) / f32(len(self.data))
        self.shares = [self.share(node) for node in self.nodes]
        self.free = [units * share for units, share in zip(self.data, self.shares, strict=True)]
        rates = [self.rate_at(cells) for cells in range(max(space.size))]
        self.rates = [f32(rate) for rate in rates]
        self.sea = [log10(rates[min(cells, len(rates) - 1)] + 1e-3) for cells in (1, 3, 8)]
        self.sea += [40 * arriving / self.unit, space.charge_rate / 10]

    def end(self, x: int, y: int) -> Cell:
        """Where a step to a cell ends: there, or here if the cell is not open."""
        on_grid = 0 <= x < self.space.size[0] and 0 <= y < self.space.size[1]
        return (x, y) if on_grid and (x, y) not in self.no_fly else self.here

    def way(self, start: Cell, *ends: Cell) -> int:
        """Cells on the way to the nearest of some cells."""
        maps = (reached(end, *self.space.size, self.no_fly) for end in ends)
        return min(FARTHEST, *(ways.get(start, FARTHEST) for ways in maps))

    def zone_ways(self, start: Cell) -> list[int]:
        """Cells on the way to each charging zone."""
        return [self.way(start, *cells) for cells in self.zones]

    def share(self, node: Cell) -> Any:
        """The UAV's share of the nearness of all that fly to a node."""
        mine = near(self.way(self.here, node), 4.0) + f32(1e-9)
        return mine / (mine + total(near(self.way(flier, node), 4.0) for flier in self.fliers))

    def rate_at(self, cells: int) -> float:
        """The data that a UAV collects in a slot at a distance in whole cells."""
        space, edge = self.space, self.space.cell_size * hypot(*self.space.size) / 2
        loss = log10(hypot(space.cell_size * cells, space.altitude) / edge)
        snr = space.edge_snr - 10 * space.path_loss_exponent * loss
        return space.slot_length * log2(1 + 10 ** (snr / 10)) / self.unit

    def rate(self, square: int) -> Any:
        """The same at any distance, given as its square, by interpolation."""
        distance = np.sqrt(f32(square))
        below = min(int(distance), len(self.rates) - 2)
        low, high = self.rates[below : below + 2]
        return low + min(distance - f32(below), f32(1)) * (high - low)

    def own(self) -> Line:
        """The UAV's own state and what it knows of the sea."""
        me, start, nodes = self.me, self.start, len(self.nodes)
        slack, needs = me.battery - 1 - me.home, me.needed + sum(m.needed for m in self.mates)
        return [
            *(me.battery / 100, min(me.needed, 300) / 100, me.latch, me.must_charge),
            *(start / 100, self.complete / 100, me.home / 30),
            *(min(slack, 50) / 50, clip(slack, 0, 8) / 8),
            *((me.battery - start) / 50, clip(me.battery - start, -5, 10) / 10),
            *(clip(me.needed - self.complete, -20, 60) / 40, min(me.needed, 10) / 10),
            *(clip(me.needed - me.battery, -20, 60) / 40, min(len(self.mates), 8) / 4),
            *(not self.mates, min(self.mean, 4)),
            min(total(self.data) / f32(max(needs, 1)) * f32(2.5), 5),
            *(f32(log(nodes)) / 4, sum(mate.must_charge for mate in self.mates) / 4),
            *(min(len(self.zones), 4) / 4, clip(start - me.home, -20, 40) / 40),
            *(min(nodes / max(needs, 1), 3), min(me.needed, 40) / 40, *self.sea, 1),
        ]

    def action(self, action: int) -> Line:
        """What is known of the cell that an action leads to."""
        x, y = self.ends[action]
        moves, is_hover = (x, y) != self.here, action == HOVER
        apart = [abs(mate.x - x) + abs(mate.y - y) for mate in self.mates]
        line = [is_hover, self.me.mask >> action & 1, is_hover or moves]
        line += [any((x, y) in cells for cells in self.zones)]
        line += [total(f32(0.3 if way else 1) for way in apart if way <= 1)]
        ways = [(self.way(self.here, node), self.way((x, y), node)) for node in self.nodes]
        # The way to each node counts as one cell shorter after a move, or as one cell longer.
        for values in (self.data, self.free):
            for scale, norm in zip(SCALES, NORMS, strict=True):
                more, less = (f32(exp(cells / scale) if moves else 1) for cells in (1, -1))
                terms = [v * near(old, scale) for v, (old, _) in zip(values, ways, strict=True)]
                nearer = total(t for t, (old, new) in zip(terms, ways, strict=True) if new < old)
                line.append((less * total(terms) + (more - less) * nearer) / f32(norm))
        squares = [(to_x - x) ** 2 + (to_y - y) ** 2 for to_x, to_y in self.nodes]
        full = [(s, -units) for s, units in zip(squares, self.data, strict=True) if units > 0]
        if not full:
            return [*line, 0, 0, 0]
        rate, units = self.rate(min(full)[0]), -min(full)[1]
        part = units / (self.mean + f32(0.01)) * f32(0.4)
        return [*line, min(rate, 2), min(rate, units), min(part, 2)]

    def node(self, k: int) -> tuple[Line, Line]:
        """A node, and which moves lead there."""
        me, node, units = self.me, self.nodes[k], self.data[k]
        dx, dy, way = node[0] - me.x, node[1] - me.y, self.way(self.here, node)
        home, own_home = min(self.zone_ways(node)), min(self.zone_ways(self.here))
        lead = min((self.way(flier, node) for flier in self.fliers), default=1000) - way
        spare = (me.battery - 1 - home if me.must_charge else me.needed) - way
        ways = [(j, self.way(other, node)) for j, other in enumerate(self.nodes) if j != k]
        parts = [(self.free, 0), (self.free, 1), (self.free, 2), (self.data, 1), (self.data, 2)]
        line = [
            *(1, min(units, 4), min(units * (f32(0.4) / (self.mean + f32(0.01))), 2), units > 0),
            *(f32(min(way, 60)) * f32(1 / 30), *(near(way, scale) for scale in SCALES)),
            *(f32(clip(lead, -10, 10)) * f32(0.1), f32(clip(lead, -2, 2)) * f32(0.5)),
            *(self.shares[k], f32(min(home, 60)) * f32(1 / 30)),
            *(f32(clip(spare, -20, 20)) * f32(0.05), f32(clip(spare, -4, 4)) * f32(0.25)),
            *(total(v[j] * near(n, SCALES[s], NORMS[s]) for j, n in ways) for v, s in parts),
            *(min(way * (1 / (me.needed + 1)), 3), min(units, f32(4)) * near(way, 4.0)),
            *(
                min(self.rate(dx * dx + dy * dy), 2),
                f32(min(abs(dx), abs(dy))) * f32(1 / (way + 1)),
            ),
            f32(clip(home - own_home, -20, 20)) * f32(0.05),
        ]
        nearer = [self.way(end, node) < way for end in self.ends[:HOVER]]
        return line, [*nearer, *straight(dx, dy), 1]

    def mate(self, mate: Uav) -> tuple[Line, Line]:
        """A teammate, and which moves lead there; zeros if it has ended."""
        if not mate.active:
            return [0] * 17, [0] * 9
        dx, dy, battery = mate.x - self.me.x, mate.y - self.me.y, mate.battery
        way = abs(dx) + abs(dy)
        line = [
            *(1, min(way, 60) / 30, way <= 1, way <= 2, near(way, 4.0), near(way, 12.0)),
            *(battery / 100, min(mate.needed, 300) / 100, mate.charging, mate.must_charge),
            *(mate.latch, mate.home / 30, min(battery - 1 - mate.home, 50) / 50),
            *((battery - self.me.battery) / 50, battery < self.me.battery),
            *((mate.needed - self.me.needed) / 50, mate.home == 0),
        ]
        return line, [dy < 0, dx > 0, dy > 0, dx < 0, *straight(dx, dy), 1]

    def zone(self, number: int) -> tuple[Line, Line]:
        """A charging zone, and which moves lead there."""
        ways, pads = self.zone_ways(self.here), self.space.zone_pads[number]
        way, slack = ways[number], self.me.battery - 1 - ways[number]
        to = [(mate, self.zone_ways((mate.x, mate.y))) for mate in self.mates]
        taken = sum(w[number] == 0 and (mate.charging or mate.latch) for mate, w in to)
        coming = sum(w[number] == min(w) and mate.must_charge for mate, w in to)
        line = [
            *(1, min(way, 60) / 30, near(way, 1.5), near(way, 4.0), way == min(ways), way == 0),
            *(min(pads - taken, 4) / 4, min(pads, 8) / 4, coming / 4),
            *(min(slack, 50) / 50, clip(slack, -8, 8) / 8),
        ]
        nearer = [self.zone_ways(end)[number] < way for end in self.ends[:HOVER]]
        return line, [*nearer, 0, 0, 0, 0, 1]
