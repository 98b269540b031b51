"""The observation for any sea: sets of nodes, teammates and zones, seen from one UAV.

    sea = sea_of(constants_of(space)[0], world_of(space))
    own, actions, *sets = Sets(sea).encode(states, missions, uavs)

There is no absolute cell and no index of a node, a teammate or a zone: everything is told by ways
from the UAV, and by which actions make them shorter. So the network that reads it works for any
grid and any number of nodes, teammates and zones. If a sea is mirrored or rotated, only the order
of the four moves changes.
"""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from dess.base.elementary import exp_of_each, log, log10
from dess.base.kernels import inlined, kernel
from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates
from dess.model.channel import World, efficiency
from dess.model.state import HOVER, STEP_X, STEP_Y, mission_part
from dess.physics.chart import Chart, is_open, spread

OWN, NODE, MATE, ZONE, ACTION = 30, 24, 17, 11, 14
# Per node, teammate and zone: for each of the four moves whether it makes the way there shorter,
# and the share of the straight line there that it is along, from -1 to 1; last, that it exists.
MOVES = 9
# The nearness of a cell is exp(-way / scale), for each scale [cells].
SCALES = np.array([1.5, 4.0, 12.0])
_NORMS = np.array([1.0, 2.5, 8.0], np.float32)  # by which sums of data x nearness are divided
# By which the nearness changes if the way is one cell shorter, and longer.
_FACTORS = np.stack([exp_of_each(1 / SCALES), exp_of_each(-1 / SCALES)]).astype(np.float32)
_FARTHEST = 255  # [cells]; all longer ways count as this one
# Euclidean distances [cells] at which the rate tells what the channel is like.
_PROBES = (1.0, 3.0, 8.0)


# What ``sea_of`` reads of a mission.
SEA_PART = mission_part(
    *("zone_pads", "initial_low", "initial_high", "arrival_rate", "charge_rate"),
    *("charge_slots", "communication_slot_length"),
    *("max_rate", "steps", "step_snr", "step_rate"),
)


class Sea(NamedTuple):
    """What all missions on a sea share, as far as the observation needs it.

    Attributes:
        chart: The zones, the no-fly cells and the ways.
        nodes: (K, 2) cells of the nodes.
        pads: (C,) charging pads of the zones.
        unit: Data that a quarter of the nodes have less than at the start [data units]: what data
            are divided by.
        rates: (L,) units that a UAV collects in a slot, by the distance in cells.
        constants: (5,) the rates at the probes, the data that arrive at a node in 40 slots, and the
            battery gained in a charging slot, all scaled.
    """

    chart: Chart
    nodes: np.ndarray
    pads: np.ndarray
    unit: np.float32
    rates: np.ndarray
    constants: np.ndarray


def sea_of(mission: np.void, world: World) -> Sea:
    """The sea of a mission.

    Args:
        mission: ``MISSION`` record, or the ``SEA_PART`` of one; missions of a world with equal
            parts share a sea.
        world: Its nodes and tables.
    """
    length = float(mission["communication_slot_length"] * world.means.shape[2])
    snr = world.mean_snr[0, :: (world.mean_snr.shape[1] - 1) // (len(world.mean_snr) - 1)]
    low, high, arriving = (mission[n] for n in ("initial_low", "initial_high", "arrival_rate"))
    unit = max(0.75 * low + 0.25 * high, 40 * arriving, 1e-3)
    rates = length * _efficiencies_at(mission, snr.copy()) / unit
    probes = np.interp(_PROBES, np.arange(len(rates)), rates)
    charging = mission["charge_rate"] / mission["charge_slots"]
    others = [40 * arriving / unit, charging / 10]
    return Sea(
        world.chart,
        world.nodes.copy(),
        mission["zone_pads"][: len(world.chart.sizes)].copy(),
        np.float32(unit),
        rates.astype(np.float32),
        np.array([*log10(probes + 1e-3), *others], np.float32),
    )


@kernel
def _efficiencies_at(mission, snr):
    """(L,) spectral efficiencies [bit/s/Hz] at mean SNRs [dB]."""
    efficiencies = np.empty(len(snr))
    for number in range(len(snr)):
        efficiencies[number] = efficiency(mission, snr[number])
    return efficiencies


class _Tables(NamedTuple):
    """What follows from a sea.

    Attributes:
        ways: (H * W, K) cells from each cell to each node.
        zone_ways: (H * W, C) cells from each cell to the nearest cell of each zone.
        home: (H * W,) the least of these.
        node_home: (K,) the same from each node.
        around: (K, 3, K) the nearness of nodes to each other, divided by ``_NORMS``, without that
            of a node to itself.
        near: (_FARTHEST + 1, 4) the nearness by the way; the last column is 0.
        shares, parts: One divided by a number + 1, and by a number.
    """

    ways: np.ndarray
    zone_ways: np.ndarray
    home: np.ndarray
    node_home: np.ndarray
    around: np.ndarray
    near: np.ndarray
    shares: np.ndarray
    parts: np.ndarray


@lru_cache(maxsize=16)
def _tables(zones: bytes, shape: tuple[int, int], cells: bytes) -> _Tables:
    chart = np.frombuffer(zones, np.int8).reshape(shape)
    nodes = np.frombuffer(cells, np.int64).reshape(-1, 2)
    ways = np.stack([spread(chart, node[None])[0] for node in nodes], 1)
    rectangles = [np.argwhere(chart == zone)[:, ::-1] for zone in range(chart.max() + 1)]
    zone_ways = np.stack([spread(chart, rectangle)[0] for rectangle in rectangles], 1)
    ways = np.minimum(ways, _FARTHEST)
    zone_ways = np.minimum(zone_ways, _FARTHEST)
    nearness = exp_of_each(-np.arange(_FARTHEST + 1)[:, None] / SCALES)
    near = np.pad(nearness, ((0, 0), (0, 1)))
    places = nodes @ [1, shape[1]]
    around = near[ways[places], :3].transpose(1, 2, 0) / _NORMS[:, None]
    around *= (1 - np.eye(len(nodes)))[:, None]
    home = zone_ways.min(1)
    numbers = np.arange(sum(shape) + _FARTHEST)
    shares = 1 / (numbers + 1)
    parts = 1 / np.maximum(numbers, 1)
    floats = (np.ascontiguousarray(a, np.float32) for a in (around, near, shares, parts))
    return _Tables(ways, zone_ways, home, home[places], *floats)


class Sets:
    """The observation of one UAV as sets.

    Attributes:
        sea: The sea.
        shapes: The shapes of its arrays per row; those of the class itself have empty sets.
    """

    version = 1  # of the encoding; weights trained with another version cannot be used
    shapes: tuple[tuple[int, ...], ...] = (
        *((OWN,), (5, ACTION), (0, NODE), (MOVES, 0)),
        *((0, MATE), (MOVES, 0), (0, ZONE), (MOVES, 0)),
    )

    def __init__(self, sea: Sea, uavs: int = 1):
        self.sea = sea
        self._tables = _tables(
            sea.chart.zones.tobytes(), sea.chart.zones.shape, sea.nodes.tobytes()
        )
        self.shapes = ((OWN,), (5, ACTION), *self._set_shapes(uavs - 1))

    def _set_shapes(self, mates: int) -> tuple[tuple[int, int], ...]:
        sizes = {NODE: len(self.sea.nodes), MATE: mates, ZONE: len(self.sea.pads)}
        return sum((((size, part), (MOVES, size)) for part, size in sizes.items()), ())

    def encode(
        self, states: CompactStates, missions: np.ndarray, uavs: np.ndarray
    ) -> tuple[np.ndarray, ...]:
        """The observations of UAV ``uavs[r]`` in state ``missions[r]``, as float32.

        Where ``uavs[r]`` is -1, they are zeros.

        Returns:
            (R, 30) the own state and (R, 5, 14) actions; then, for nodes, for teammates (of which
            those that have ended are zeros) and for zones, (R, N, columns) a row for each and
            (R, 9, N) which moves lead there.
        """
        shapes = *self.shapes[:2], *self._set_shapes(states.uavs.shape[1] - 1)
        out = tuple(np.zeros((len(missions), *shape), np.float32) for shape in shapes)
        _encode(states, missions, uavs, self.sea, self._tables, out)
        return out


@kernel
def _encode(states, rows_mission, rows_uav, sea, tables, out):
    count = len(sea.nodes)
    columns = sea.chart.zones.shape[1]
    places = np.empty(5, np.int64)
    opens = np.empty(5, np.bool_)
    data = np.empty(count, np.float32)
    units = np.float32(1.0) / sea.unit
    memory = (
        np.empty((7, count), np.float32),
        np.empty(count, np.int16),
        np.empty((5, 8), np.float32),
    )
    for row in range(len(rows_mission)):
        b = rows_mission[row]
        i = rows_uav[row]
        if i < 0:
            continue
        mission = states.missions[b]
        team = states.uavs[b]
        residual = states.residual[b]
        x = np.int64(team[i, column.X])
        y = np.int64(team[i, column.Y])
        for action in range(5):
            to_x = x + STEP_X[action]
            to_y = y + STEP_Y[action]
            opens[action] = is_open(sea.chart.zones, to_x, to_y)
            places[action] = to_y * columns + to_x if opens[action] else y * columns + x
        total = np.float32(0.0)
        for k in range(count):
            data[k] = residual[k] * units
            total += data[k]
        mean = total / np.float32(count)
        _own(mission, team, i, sea, mean, total, out[0][row])
        _nodes(team, i, data, sea, tables, places, mean, memory, out[2][row], out[3][row])
        _actions(team, i, data, sea, tables, places, opens, mean, memory[2], out[1][row])
        _mates(team, i, columns, tables, out[4][row], out[5][row])
        _zones(team, i, sea, tables, places, columns, out[6][row], out[7][row])


@inlined
def _nodes(team, i, data, sea, tables, places, mean, memory, lines, moves):
    """Write the nodes; leave the sums of data times nearness, by move and of all, in memory."""
    me = team[i]
    cells = sea.nodes
    columns = sea.chart.zones.shape[1]
    count = len(data)
    by_node, least, sums = memory
    free, crowd, near_0, near_1, near_2, beyond_1, beyond_2 = by_node
    ways_from_here = tables.ways[places[HOVER]]
    x = np.int64(me[column.X])
    y = np.int64(me[column.Y])
    least[:] = 1000
    by_node[1:] = 0.0
    for j in range(len(team)):
        if j != i and team[j, column.ACTIVE] and not team[j, column.CHARGING]:
            ways_of_mate = tables.ways[team[j, column.Y] * columns + team[j, column.X]]
            for k in range(count):
                least[k] = min(least[k], ways_of_mate[k])
                crowd[k] += tables.near[ways_of_mate[k], 1]
    for k in range(count):
        mine = tables.near[ways_from_here[k], 1] + np.float32(1e-9)
        crowd[k] = mine / (mine + crowd[k])
        free[k] = data[k] * crowd[k]
    for j in range(count):
        if data[j] > 0.0:
            around = tables.around[j]
            full = data[j]
            share = free[j]
            for k in range(count):
                near_0[k] += share * around[0, k]
                near_1[k] += share * around[1, k]
                near_2[k] += share * around[2, k]
                beyond_1[k] += full * around[1, k]
                beyond_2[k] += full * around[2, k]
    needed = np.int64(me[column.NEEDED])
    battery = np.int64(me[column.BATTERY])
    own_home = np.int64(tables.home[places[HOVER]])
    must_charge = me[column.MUST_CHARGE] > 0
    per_slot = np.float32(1.0) / (needed + 1)
    per_mean = np.float32(0.4) / (mean + np.float32(0.01))
    sums[:] = 0.0
    for k in range(count):
        line = lines[k]
        way = np.int64(ways_from_here[k])
        units = data[k]
        home = np.int64(tables.node_home[k])
        lead = np.int64(least[k]) - way
        spare = needed - way
        if must_charge:
            spare = battery - 1 - home - way
        dx = cells[k, 0] - x
        dy = cells[k, 1] - y
        near = tables.near[way]
        line[0] = 1.0
        line[1] = min(units, np.float32(4.0))
        line[2] = min(data[k] * per_mean, np.float32(2.0))
        line[3] = data[k] > 0.0
        line[4] = np.float32(min(way, 60)) * np.float32(1 / 30)
        line[5] = near[0]
        line[6] = near[1]
        line[7] = near[2]
        line[8] = _share(lead, 10)
        line[9] = _share(lead, 2)
        line[10] = crowd[k]
        line[11] = np.float32(min(home, 60)) * np.float32(1 / 30)
        line[12] = _share(spare, 20)
        line[13] = _share(spare, 4)
        for part in range(5):
            line[14 + part] = by_node[2 + part, k]
        line[19] = min(np.float32(way) * per_slot, np.float32(3.0))
        line[20] = line[1] * near[1]
        line[21] = min(_rate(sea.rates, dx * dx + dy * dy), np.float32(2.0))
        line[22] = np.float32(min(abs(dx), abs(dy))) * tables.shares[way]
        line[23] = _share(home - own_home, 20)
        for move in range(4):
            nearer = np.float32(tables.ways[places[move], k] < ways_from_here[k])
            moves[move, k] = nearer
            full = nearer * data[k]
            share = nearer * free[k]
            for s in range(4):
                sums[move, s] += full * near[s]
                sums[move, 4 + s] += share * near[s]
        for s in range(4):
            sums[HOVER, s] += data[k] * near[s]
            sums[HOVER, 4 + s] += free[k] * near[s]
        moves[8, k] = 1.0
        length = abs(dx) + abs(dy)
        if length > 0:
            east = dx * tables.parts[length]
            south = dy * tables.parts[length]
            moves[4, k] = -south
            moves[5, k] = east
            moves[6, k] = south
            moves[7, k] = -east


@inlined
def _share(number, most):
    """A number as a share of the most that counts, within -1..1."""
    return np.float32(min(max(number, -most), most)) * np.float32(1.0 / most)


@inlined
def _rate(rates, square):
    """The units of data that a UAV collects in a slot at a distance, given as its square."""
    distance = np.sqrt(np.float32(square))
    below = min(np.int64(distance), len(rates) - 2)
    part = min(distance - np.float32(below), np.float32(1.0))
    return rates[below] + part * (rates[below + 1] - rates[below])


@inlined
def _own(mission, team, i, sea, mean, total, line):
    """Write the UAV's own state and what it is to know of the sea."""
    me = team[i]
    active = 0
    needs = 0
    others = 0
    for j in range(len(team)):
        if team[j, column.ACTIVE]:
            active += 1
            needs += team[j, column.NEEDED]
            if j != i and team[j, column.MUST_CHARGE]:
                others += 1
    battery = np.int64(me[column.BATTERY])
    needed = np.int64(me[column.NEEDED])
    home = np.int64(me[column.HOME])
    start = np.int64(mission[column.CHARGE_START])
    complete = np.int64(mission[column.CHARGE_COMPLETE])
    slack = battery - 1 - home
    slots = np.float32(max(needs, 1))
    line[0] = battery / 100.0
    line[1] = min(needed, 300) / 100.0
    line[2] = me[column.LATCH]
    line[3] = me[column.MUST_CHARGE]
    line[4] = start / 100.0
    line[5] = complete / 100.0
    line[6] = home / 30.0
    line[7] = min(slack, 50) / 50.0
    line[8] = min(max(slack, 0), 8) / 8.0
    line[9] = (battery - start) / 50.0
    line[10] = min(max(battery - start, -5), 10) / 10.0
    line[11] = min(max(needed - complete, -20), 60) / 40.0
    line[12] = min(needed, 10) / 10.0
    line[13] = min(max(needed - battery, -20), 60) / 40.0
    line[14] = min(active - 1, 8) / 4.0
    line[15] = active == 1
    line[16] = min(mean, np.float32(4.0))
    line[17] = min(total / slots * np.float32(2.5), np.float32(5.0))
    line[18] = log(np.float64(len(sea.nodes))) / 4.0
    line[19] = others / np.float32(4.0)
    line[20] = min(len(sea.pads), 4) / 4.0
    line[21] = min(max(start - home, -20), 40) / 40.0
    line[22] = min(len(sea.nodes) / slots, np.float32(3.0))
    line[23] = min(needed, 40) / 40.0
    for number in range(5):
        line[24 + number] = sea.constants[number]
    line[29] = 1.0


@inlined
def _mates(team, i, columns, tables, lines, moves):
    """Write the active teammates of UAV ``i``, seen from it."""
    me = team[i]
    number = 0
    for j in range(len(team)):
        if j == i:
            continue
        mate = team[j]
        line = lines[number]
        number += 1
        if not mate[column.ACTIVE]:
            continue
        dx = np.int64(mate[column.X]) - me[column.X]
        dy = np.int64(mate[column.Y]) - me[column.Y]
        way = abs(dx) + abs(dy)
        battery = np.int64(mate[column.BATTERY])
        needed = np.int64(mate[column.NEEDED])
        home = np.int64(mate[column.HOME])
        slack = battery - 1 - home
        line[0] = 1.0
        line[1] = min(way, 60) / 30.0
        line[2] = way <= 1
        line[3] = way <= 2
        line[4] = tables.near[min(way, _FARTHEST), 1]
        line[5] = tables.near[min(way, _FARTHEST), 2]
        line[6] = battery / 100.0
        line[7] = min(needed, 300) / 100.0
        line[8] = mate[column.CHARGING]
        line[9] = mate[column.MUST_CHARGE]
        line[10] = mate[column.LATCH]
        line[11] = home / 30.0
        line[12] = min(slack, 50) / 50.0
        line[13] = (battery - me[column.BATTERY]) / 50.0
        line[14] = battery < me[column.BATTERY]
        line[15] = (needed - me[column.NEEDED]) / 50.0
        line[16] = home == 0
        to = moves[:, number - 1]
        to[0] = dy < 0
        to[1] = dx > 0
        to[2] = dy > 0
        to[3] = dx < 0
        to[8] = 1.0
        if way > 0:
            east = dx * tables.parts[way]
            south = dy * tables.parts[way]
            to[4] = -south
            to[5] = east
            to[6] = south
            to[7] = -east


@inlined
def _zones(team, i, sea, tables, places, columns, lines, moves):
    """Write the charging zones, seen from UAV ``i``."""
    me = team[i]
    ways_from_here = tables.zone_ways[places[HOVER]]
    nearest = tables.home[places[HOVER]]
    for zone in range(len(sea.pads)):
        line = lines[zone]
        way = np.int64(ways_from_here[zone])
        charging = waiting = coming = 0
        for j in range(len(team)):
            mate = team[j]
            if j != i and mate[column.ACTIVE]:
                place = mate[column.Y] * columns + mate[column.X]
                ways = tables.zone_ways[place]
                if ways[zone] == 0:
                    charging += mate[column.CHARGING]
                    waiting += mate[column.LATCH] and not mate[column.CHARGING]
                coming += mate[column.MUST_CHARGE] and ways[zone] == tables.home[place]
        slack = np.int64(me[column.BATTERY]) - 1 - way
        line[0] = 1.0
        line[1] = min(way, 60) / 30.0
        line[2] = tables.near[way, 0]
        line[3] = tables.near[way, 1]
        line[4] = way == nearest
        line[5] = way == 0
        line[6] = min(sea.pads[zone] - charging - waiting, 4) / 4.0
        line[7] = min(sea.pads[zone], 8) / 4.0
        line[8] = coming / 4.0
        line[9] = min(slack, 50) / 50.0
        line[10] = min(max(slack, -8), 8) / 8.0
        for move in range(4):
            moves[move, zone] = tables.zone_ways[places[move], zone] < way
        moves[8, zone] = 1.0


@inlined
def _actions(team, i, data, sea, tables, places, opens, mean, sums, lines):
    """Write per action what is known of the cell it leads to."""
    me = team[i]
    cells = sea.nodes
    columns = sea.chart.zones.shape[1]
    for action in range(5):
        line = lines[action]
        place = places[action]
        x = place % columns
        y = place // columns
        line[0] = action == HOVER
        line[1] = me[column.MASK] >> action & 1
        line[2] = opens[action]
        line[3] = sea.chart.zones[y, x] >= 0
        for j in range(len(team)):
            if j != i and team[j, column.ACTIVE]:
                way = abs(team[j, column.X] - x) + abs(team[j, column.Y] - y)
                if way <= 1:
                    line[4] += np.float32(1.0 if way == 0 else 0.3)
        for s in range(3):
            # What a move comes nearer to, it is nearer to by one cell; from all else it is farther.
            more, less = np.float32(1.0), np.float32(1.0)
            if action != HOVER and opens[action]:
                more, less = _FACTORS[0, s], _FACTORS[1, s]
            for part in range(2):
                nearer, all_ = sums[action, 4 * part + s], sums[HOVER, 4 * part + s]
                line[5 + 3 * part + s] = (less * all_ + (more - less) * nearer) / _NORMS[s]
        square = 1_000_000
        served = -1
        for k in range(len(cells)):
            dx = cells[k, 0] - x
            dy = cells[k, 1] - y
            distance = dx * dx + dy * dy
            if data[k] > 0.0 and (
                distance < square or (distance == square and data[k] > data[served])
            ):
                square = distance
                served = k
        if served >= 0:
            rate = _rate(sea.rates, square)
            line[11] = min(rate, np.float32(2.0))
            line[12] = min(rate, data[served])
            line[13] = min(
                data[served] / (mean + np.float32(0.01)) * np.float32(0.4), np.float32(2.0)
            )
