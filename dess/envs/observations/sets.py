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

from dess.base.elementary import exp, exp_of_each, log
from dess.base.kernels import inlined, kernel
from dess.envs.observations import states as column
from dess.envs.observations.states import CompactStates
from dess.model.channel import World, efficiency
from dess.model.state import HOVER, STEP_X, STEP_Y, mission_part
from dess.physics.chart import FAR, NO_FLY, is_open, neighbours_of, spread_costs

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
# Distances [cells] at which the rate tells what the channel is like.
_PROBES = (1, 3, 8)
UNIT = 5  # the place of the unit of data in ``Sea.constants``
_PER_LN10 = 1.0 / 2.302585092994046  # ln 10


# What ``sea_of`` reads of a mission.
SEA_PART = mission_part(
    *("zone_pads", "initial_low", "initial_high", "arrival_rate", "charge_rate"),
    *("charge_slots", "communication_slot_length"),
    *("max_rate", "steps", "step_snr", "step_rate"),
)


class Sea(NamedTuple):
    """What all missions on a sea share, as far as the observation needs it.

    Attributes:
        zones: (H, W) as in ``Chart``.
        nodes: (K, 2) cells of the nodes.
        pads: (C,) charging pads of the zones.
        rates: (L,) units that a UAV collects in a slot, by the distance in cells.
        constants: (6,) the rates at the probes, the data that arrive at a node in 40 slots, and the
            battery gained in a charging slot, all scaled; then the data that a quarter of the nodes
            have less than at the start [data units], by which data are divided.
    """

    zones: np.ndarray
    nodes: np.ndarray
    pads: np.ndarray
    rates: np.ndarray
    constants: np.ndarray


def sea_of(mission: np.void, world: World) -> Sea:
    """The sea of a mission.

    Args:
        mission: ``MISSION`` record, or the ``SEA_PART`` of one; missions of a world with equal
            parts share a sea.
        world: Its nodes and tables.
    """
    distances = len(world.mean_snr)
    zones = world.chart.zones
    pads = mission["zone_pads"][: len(world.chart.sizes)].copy()
    sea = Sea(zones, world.nodes, pads, np.empty(distances, np.float32), np.empty(6, np.float32))
    fill_sea(mission, world.mean_snr, world.means.shape[2], sea.rates, sea.constants)
    return sea


@kernel
def fill_sea(mission, mean_snr, slots, rates, constants):
    """Write the rates and the constants of a sea.

    Args:
        mission: As ``sea_of``.
        mean_snr: As in ``World``.
        slots: The communication slots of a mission slot.
        rates, constants: As in ``Sea``.
    """
    low = np.float64(mission.initial_low)
    high = np.float64(mission.initial_high)
    arriving = 40 * np.float64(mission.arrival_rate)
    unit = max(0.75 * low + 0.25 * high, arriving, 1e-3)
    length = mission.communication_slot_length * slots
    step = (mean_snr.shape[1] - 1) // (len(mean_snr) - 1)
    for cells in range(len(rates)):
        rates[cells] = length * efficiency(mission, mean_snr[0, step * cells]) / unit
    for probe in range(len(_PROBES)):
        cells = min(_PROBES[probe], len(rates) - 1)
        rate = length * efficiency(mission, mean_snr[0, step * cells]) / unit
        constants[probe] = log(rate + 1e-3) * _PER_LN10
    constants[3] = arriving / unit
    constants[4] = mission.charge_rate / mission.charge_slots / 10
    constants[UNIT] = unit


class Tables(NamedTuple):
    """What follows from the zones, the no-fly cells and the nodes of a sea.

    Attributes:
        ways: (H * W, K) cells from each cell to each node, as int16.
        zone_ways: (H * W, C) cells from each cell to the nearest cell of each zone, as int16.
        home: (H * W,) the least of these.
        node_home: (K,) the same from each node.
        around: (K, 3 * K) the nearness of nodes to each other, scale by scale, divided by
            ``_NORMS``, without that of a node to itself.
        near: (_FARTHEST + 1, 4) the nearness by the way; the last column is 0.
        shares, parts: (``_FARTHEST`` + H + W,) one divided by a number + 1, and by a number.
    """

    ways: np.ndarray
    zone_ways: np.ndarray
    home: np.ndarray
    node_home: np.ndarray
    around: np.ndarray
    near: np.ndarray
    shares: np.ndarray
    parts: np.ndarray


def empty_tables(size: tuple[int, int], nodes: int, zones: int) -> Tables:
    """Tables for ``fill_tables`` of a sea of H rows and W columns, with nodes and zones."""
    cells = size[0] * size[1]
    numbers = _FARTHEST + size[0] + size[1]
    i2, f4 = np.int16, np.float32
    whole = (np.empty(shape, i2) for shape in ((cells, nodes), (cells, zones), cells, nodes))
    shapes = ((nodes, 3 * nodes), (_FARTHEST + 1, 4), numbers, numbers)
    return Tables(*whole, *(np.empty(shape, f4) for shape in shapes))


@kernel
def fill_tables(zones, nodes, tables):
    """Write the tables of a sea.

    Args:
        zones: (H, W) as in ``Chart``.
        nodes: (K, 2) cells of the nodes.
        tables: The tables.
    """
    neighbours = neighbours_of(zones)
    columns = zones.shape[1]
    lengths = np.empty(zones.size, np.int16)
    nearest = np.zeros(zones.size, np.int32)
    places = nodes[:, 1] * columns + nodes[:, 0]
    numbers = np.arange(zones.size)
    for k in range(len(nodes)):
        lengths[:] = FAR
        if zones[nodes[k, 1], nodes[k, 0]] != NO_FLY:
            spread_costs(neighbours, places[k : k + 1], None, True, FAR, lengths, nearest)
        for cell in range(zones.size):
            tables.ways[cell, k] = min(lengths[cell], _FARTHEST)
    tables.home[:] = _FARTHEST
    for zone in range(tables.zone_ways.shape[1]):
        lengths[:] = FAR
        cells_of_zone = numbers[zones.ravel() == zone]
        spread_costs(neighbours, cells_of_zone, None, True, FAR, lengths, nearest)
        for cell in range(zones.size):
            tables.zone_ways[cell, zone] = min(lengths[cell], _FARTHEST)
            tables.home[cell] = min(tables.home[cell], tables.zone_ways[cell, zone])
    for k in range(len(nodes)):
        tables.node_home[k] = tables.home[places[k]]
    nearness = np.empty((_FARTHEST + 1, len(SCALES)))
    for way in range(len(nearness)):
        for s in range(len(SCALES)):
            nearness[way, s] = exp(-way / SCALES[s])
            tables.near[way, s] = nearness[way, s]
        tables.near[way, len(SCALES)] = 0
    for j in range(len(nodes)):
        for s in range(len(SCALES)):
            for k in range(len(nodes)):
                around = nearness[tables.ways[places[k], j], s] / _NORMS[s]
                if k == j:
                    around = 0.0
                tables.around[j, s * len(nodes) + k] = around
    for number in range(len(tables.shares)):
        tables.shares[number] = 1 / (number + 1)
        tables.parts[number] = 1 / max(number, 1)


@lru_cache(maxsize=16)
def _tables(zones: bytes, shape: tuple[int, int], cells: bytes) -> Tables:
    chart = np.frombuffer(zones, np.int8).reshape(shape)
    nodes = np.frombuffer(cells, np.int64).reshape(-1, 2)
    tables = empty_tables(shape, len(nodes), int(chart.max()) + 1)
    fill_tables(chart, nodes, tables)
    return tables


class Sets:
    """The observation of one UAV as sets.

    Attributes:
        sea: The sea.
        tables: Its tables.
        shapes: The shapes of its arrays per row; those of the class itself have empty sets.
    """

    version = 1  # of the encoding; weights trained with another version cannot be used
    shapes: tuple[tuple[int, ...], ...] = (
        *((OWN,), (5, ACTION), (0, NODE), (MOVES, 0)),
        *((0, MATE), (MOVES, 0), (0, ZONE), (MOVES, 0)),
    )

    def __init__(self, sea: Sea, uavs: int = 1):
        self.sea = sea
        self.tables = _tables(sea.zones.tobytes(), sea.zones.shape, sea.nodes.tobytes())
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
        _encode(states, missions, uavs, self.sea, self.tables, out)
        return out


@kernel
def _encode(states, rows_mission, rows_uav, sea, tables, out):
    memory = memory_of(sea)
    for row in range(len(rows_mission)):
        if rows_uav[row] >= 0:
            parts = Parts(
                out[0][row], out[1][row], out[2][row], out[3][row],
                out[4][row], out[5][row], out[6][row], out[7][row],
            )  # fmt: skip
            observe(states, rows_mission[row], rows_uav[row], sea, tables, memory, parts)


class Parts(NamedTuple):
    """The observation of one UAV, for N nodes, I - 1 teammates and C zones, all as float32.

    Attributes:
        own: (30,) the own state.
        actions: (5, 14) the actions.
        nodes, mates, zones: (N, 24), (I - 1, 17) and (C, 11) a row for each.
        node_moves, mate_moves, zone_moves: (9, N), (9, I - 1) and (9, C) which moves lead there.
    """

    own: np.ndarray
    actions: np.ndarray
    nodes: np.ndarray
    node_moves: np.ndarray
    mates: np.ndarray
    mate_moves: np.ndarray
    zones: np.ndarray
    zone_moves: np.ndarray


class Memory(NamedTuple):
    """What ``observe`` computes on the way.

    Attributes:
        places: (5,) the cells that the actions lead to.
        opens: (5,) whether the actions are possible.
        data: (K,) the data of the nodes, in units of the sea.
        free, crowd: (K,) the share of the data, and of a node, that teammates leave.
        around: (5, K) the nearness of other data: of what is free by scale, then of all by the
            last two scales.
        least: (K,) the way from the nearest teammate.
        sums: (5, 8) the sums of data times nearness, by move and of all.
    """

    places: np.ndarray
    opens: np.ndarray
    data: np.ndarray
    free: np.ndarray
    crowd: np.ndarray
    around: np.ndarray
    least: np.ndarray
    sums: np.ndarray


@kernel
def memory_of(sea):
    """The memory of ``observe`` for a sea."""
    count = len(sea.nodes)
    f4 = np.float32
    return Memory(
        np.empty(5, np.int64),
        np.empty(5, np.bool_),
        np.empty(count, f4),
        np.empty(count, f4),
        np.empty(count, f4),
        np.empty(5 * count, f4),
        np.empty(count, np.int16),
        np.empty((5, 8), f4),
    )


@inlined
def observe(states, b, i, sea, tables, memory, parts):
    """Write what UAV ``i`` of mission ``b`` observes, all of it.

    Args:
        states: ``CompactStates``.
        b, i: The mission and the UAV.
        sea, tables: The ``Sea`` and its ``Tables``.
        memory: The ``Memory``.
        parts: The ``Parts``.
    """
    columns = sea.zones.shape[1]
    places = memory.places
    opens = memory.opens
    data = memory.data
    mission = states.missions[b]
    team = states.uavs[b]
    residual = states.residual[b]
    x = np.int64(team[i, column.X])
    y = np.int64(team[i, column.Y])
    for action in range(5):
        to_x = x + STEP_X[action]
        to_y = y + STEP_Y[action]
        opens[action] = is_open(sea.zones, to_x, to_y)
        places[action] = to_y * columns + to_x if opens[action] else y * columns + x
    units = np.float32(1.0) / sea.constants[UNIT]
    total = np.float32(0.0)
    for k in range(len(data)):
        data[k] = residual[k] * units
        total += data[k]
    mean = total / np.float32(len(data))
    _own(mission, team, i, sea, mean, total, parts.own)
    _nodes(team, i, data, sea, tables, places, mean, memory, parts.nodes, parts.node_moves)
    _actions(team, i, data, sea, tables, places, opens, mean, memory.sums, parts.actions)
    _mates(team, i, columns, tables, parts.mates, parts.mate_moves)
    _zones(team, i, sea, tables, places, columns, parts.zones, parts.zone_moves)


@inlined
def _nodes(team, i, data, sea, tables, places, mean, memory, lines, moves):
    """Write the nodes; leave the sums of data times nearness, by move and of all, in memory."""
    me = team[i]
    cells = sea.nodes
    columns = sea.zones.shape[1]
    count = len(data)
    free = memory.free
    crowd = memory.crowd
    around = memory.around
    least = memory.least
    sums = memory.sums
    ways_from_here = tables.ways[places[HOVER]]
    x = np.int64(me[column.X])
    y = np.int64(me[column.Y])
    least[:] = 1000
    crowd[:] = 0.0
    around[:] = 0.0
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
    of_free = around[: 3 * count]
    of_all = around[3 * count :]
    # With one input and one output in each loop, the compiler makes vectors of it.
    for j in range(count):
        if data[j] > 0.0:
            full = data[j]
            share = free[j]
            near_j = tables.around[j]
            near_j_far = near_j[count:]
            for k in range(len(of_free)):
                of_free[k] += share * near_j[k]
            for k in range(len(of_all)):
                of_all[k] += full * near_j_far[k]
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
            line[14 + part] = around[part * count + k]
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
        for part in range(4, 8):
            moves[part, k] = 0.0
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
        to = moves[:, number]
        number += 1
        line[:] = 0.0
        to[:] = 0.0
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
            moves[4 + move, zone] = 0.0
        moves[8, zone] = 1.0


@inlined
def _actions(team, i, data, sea, tables, places, opens, mean, sums, lines):
    """Write per action what is known of the cell it leads to."""
    me = team[i]
    cells = sea.nodes
    columns = sea.zones.shape[1]
    for action in range(5):
        line = lines[action]
        place = places[action]
        x = place % columns
        y = place // columns
        line[0] = action == HOVER
        line[1] = me[column.MASK] >> action & 1
        line[2] = opens[action]
        line[3] = sea.zones[y, x] >= 0
        line[4] = 0.0
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
        line[11:] = 0.0
        if served >= 0:
            rate = _rate(sea.rates, square)
            line[11] = min(rate, np.float32(2.0))
            line[12] = min(rate, data[served])
            line[13] = min(
                data[served] / (mean + np.float32(0.01)) * np.float32(0.4), np.float32(2.0)
            )
