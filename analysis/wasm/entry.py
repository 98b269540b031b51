"""The entry points of the WebAssembly module: compiled functions over a table of arrays.

The module flies missions with the functions of the batch engine (``rules.launch``,
``heuristics.choose_action``, ``rules.run_slot``, ``record.write_record``); the loop around them is
here. ``dess.analysis.wasm.table`` says where its arrays lie.
"""

import numpy as np
from numba import carray, types

from dess.analysis.stats.sequences import (
    SEQUENCE,
    add_values,
    ends_of_what_was_seen,
    sequence_ends,
    start_sequence,
)
from dess.analysis.wasm.table import (
    AT,
    array1,
    array2,
    array3,
    array4,
    chart_in,
    network_in,
    pointer,
    reach_in,
    records_in,
    scratch_in,
    sea_in,
    starts_in,
    state_in,
    tables_in,
    world_in,
)
from dess.base.kernels import kernel
from dess.envs.observations.sets import fill_sea, fill_tables
from dess.model import rules
from dess.model.record import OPERATIONS, UAV_RECORD, write_record
from dess.model.state import MISSION, UAV
from dess.model.ways import FAR as _FARTHEST
from dess.physics.chart import FAR, fill_ways, neighbours_of, spread_costs
from dess.physics.energy import fill_move_costs
from dess.physics.landing import is_over
from dess.policies.choices import NETWORK as _NETWORK
from dess.policies.flight import fly
from dess.policies.heuristics import KINDS

_F8, _I8, _I4 = np.float64, np.int64, np.int32
# Compiled functions take names, not attributes, as types.
_MISSION, _UAV, _SEQUENCE = MISSION, UAV, SEQUENCE
_NO_UAV = np.zeros(1, UAV_RECORD)  # the record of one that a mission does not have
# The trained policy that the module has, and the numbers of all policies.
NETWORK = "generalist"
POLICIES = KINDS | {NETWORK: _NETWORK}
# The metrics of missions, in the order of the columns of ``values``: those of each mission, what
# extended scenarios measure (nan where one does not), and the cost (nan without prices).
METRICS = (
    *("success", "home", "collection_ratio", "collection_ratio_and_communication", "reward"),
    *(OPERATIONS.names or ()),
    "cost",
)
_MEASURED, _COST = 5, len(METRICS) - 1
# What ``prices`` has: prices and paid missions of ``study.prices.Costs``, the seconds of a slot,
# whether costs are those of a year, and the terms ``interest`` and ``worth`` by which a purchase is
# multiplied and divided. The price of a lost UAV is nan if it is what the UAV was bought for.
PRICES = (
    *("uav", "pad", "charge", "hour", "lost_uav", "missions", "pack", "pack_cycles"),
    *("seconds", "of_a_year", "interest", "worth"),
)
# The sums of ``totals``, for each metric over the missions that have it.
TOTALS = ("count", "sum", "squares", "least", "most")


@kernel
def prepare(table):
    """Fill the tables that follow from the sea.

    They are the ways between cells, the battery home, and what the network sees of the sea.
    """
    chart = chart_in(table)
    zones = chart.zones
    ways = chart.ways
    if len(ways) > 0:
        ways[:] = FAR
        fill_ways(zones, np.arange(zones.size), ways)
    mission = array1(table, AT.constants, _MISSION)[0]
    mission.pads = _count_pads(mission)  # the pads of several zones may have been changed
    moves = np.zeros((4, *zones.shape), np.int64)
    by_cell = moves.reshape((4, zones.size))
    neighbours = neighbours_of(zones)
    nearest = np.zeros(zones.size, np.int32)
    world = world_in(table)
    sea = sea_in(table)
    slots = world.means.shape[2]
    fill_sea(mission, world.mean_snr, slots, sea.rates, sea.constants)
    fill_tables(zones, world.nodes, tables_in(table))
    reach = array4(table, AT.reach, _I4)
    home = array4(table, AT.ways_home, _I4)[0]
    reach[:] = _FARTHEST
    home[:] = _FARTHEST
    parking = chart.parking[:, 1] * zones.shape[1] + chart.parking[:, 0]
    for slots in range(1, len(home) + 1):
        fill_move_costs(mission, slots, moves)
        if slots <= reach.shape[1]:
            for number in range(len(reach)):
                source = parking[number : number + 1]
                costs = reach[number, slots - 1].reshape(zones.size)
                spread_costs(neighbours, source, by_cell, False, _FARTHEST, costs, nearest)
        costs = home[slots - 1].reshape(zones.size)
        spread_costs(neighbours, parking, by_cell, False, _FARTHEST, costs, nearest)


@kernel
def play(table, first, count, launches, slots):
    """Fly missions, and write the record of each that is over.

    Args:
        table: The table of arrays.
        first: The replication of the first mission, whose record is in row 0.
        count: The number of missions, one after the other.
        launches: Whether they begin; otherwise the mission of the state goes on.
        slots: The most slots that each flies now.

    Returns:
        How many missions are over.
    """
    state = state_in(table)
    starts = starts_in(table)
    world = world_in(table)
    scratch = scratch_in(table)
    records = records_in(table)
    reach = reach_in(table)
    ways = array4(table, AT.ways_home, _I4)
    circuit = array1(table, AT.circuit, _I8)
    policies = array1(table, AT.policies, _I8)
    network = network_in(table)
    mission = state.missions[0]
    over = 0
    for row in range(count):
        if launches:
            rules.launch(state, 0, starts, 0, first + row)
        fly(state, 0, world, scratch, reach, circuit, policies, network, slots)
        if is_over(mission):
            over += 1
            for i in range(mission.uavs, state.uavs.shape[1]):
                records.uavs[row, i] = _NO_UAV[0]
            write_record(state, 0, ways, records, row)
    return over


@kernel
def measure(table, count):
    """Write the metrics of the first ``count`` records into ``values``."""
    missions, uavs, _, _ = records_in(table)
    shape = (len(missions), _COST - _MEASURED)
    operations = carray(pointer(table[AT.operations]), shape, _F8)
    mission = array1(table, AT.constants, _MISSION)[0]
    types = array2(table, AT.types, _UAV)[0]
    values = array2(table, AT.values, _F8)
    factors = array1(table, AT.factors, _F8)
    prices = array1(table, AT.prices, _F8)
    uav_prices = array1(table, AT.uav_prices, _F8)
    packs = array1(table, AT.full_packs, _F8)
    pads = _count_pads(mission)
    for row in range(count):
        record = missions[row]
        values[row, 0] = record.success
        values[row, 1] = record.home
        values[row, 2] = record.collection_ratio
        values[row, 3] = record.collection_ratio_and_communication
        values[row, 4] = record.reward
        for column in range(_MEASURED, _COST):
            values[row, column] = operations[row, column - _MEASURED]
        values[row, _COST] = np.nan
        if len(prices) > 0:
            values[row, _COST] = _cost(prices, uav_prices, packs, pads, types, record, uavs[row])
        for column in range(values.shape[1]):
            values[row, column] *= factors[column]


@kernel
def _count_pads(mission):
    """The charging pads of all zones."""
    pads = 0
    for zone in range(len(mission.zone_pads)):
        pads += mission.zone_pads[zone]
    return pads


@kernel
def _cost(prices, uav_prices, packs, pads, types, record, uavs):
    """The cost of a mission, summed up from the parts of ``dess.analysis.study.prices``."""
    charge = prices[2]
    hour = prices[3]
    missions = prices[5]
    pack = prices[6]
    pack_cycles = prices[7]
    seconds = prices[8]
    is_of_a_year = prices[9] > 0
    charged = 0
    emptied = 0.0
    losses = 0.0
    for i in range(record.uavs):
        if is_of_a_year:  # the recharge after the mission is paid for, too
            spent = _spent_battery(types[i], record, uavs[i])
            charged += spent
            emptied += spent / packs[i]
        else:
            charged += uavs[i].charged
        losses += uavs[i].down * _price_of_loss(prices, uav_prices, i)
    cost = _purchase(prices, uav_prices, pads, record.uavs)
    if is_of_a_year:
        cost += missions * pack * emptied / pack_cycles
    cost += missions * charge * charged / 100
    cost += missions * hour * (record.slots * seconds / 3600)
    return cost + missions * losses


@kernel
def _spent_battery(kind, record, uav):
    """The battery that a UAV has spent in the air [%], as ``prices.spent_battery``."""
    start = record.flying_time
    if kind.battery > 0:
        start = kind.battery
    limit = np.int64(kind.charge_complete)
    if limit > 0:
        start = min(start, limit)
    return start + uav.charged - uav.battery


@kernel
def _purchase(prices, uav_prices, pads, uavs):
    """What UAVs and pads cost when they are bought, or in each of the years of an annuity."""
    pad = prices[1]
    price_of_uavs = 0.0
    for i in range(uavs):
        price_of_uavs += _price_of_uav(prices, uav_prices, i)
    return (price_of_uavs + pad * pads) * prices[10] / prices[11]


@kernel
def _price_of_uav(prices, uav_prices, i):
    """What UAV ``i`` costs: the price of its type, if it has one."""
    if len(uav_prices) > 0 and not np.isnan(uav_prices[i]):
        return uav_prices[i]
    return prices[0]


@kernel
def _price_of_loss(prices, uav_prices, i):
    """What the loss of UAV ``i`` costs: its own price, where there is no price of a lost UAV."""
    lost_uav = prices[4]
    if np.isnan(lost_uav):
        return _price_of_uav(prices, uav_prices, i)
    return lost_uav


@kernel
def _bound_costs(table, bounds):
    """Write what is known of costs: the purchase of the smallest fleet, and what a loss costs.

    All UAVs of the largest fleet are lost, and the mission lasts until its horizon.
    """
    prices = array1(table, AT.prices, _F8)
    if len(prices) == 0:
        return
    mission = array1(table, AT.constants, _MISSION)[0]
    smallest = array3(table, AT.ranges, _I8)[0, 0, 0]
    largest = array3(table, AT.ranges, _I8)[0, 0, 1]
    hour = prices[3]
    missions = prices[5]
    seconds = prices[8]
    uav_prices = array1(table, AT.uav_prices, _F8)
    losses = 0.0
    for i in range(largest):
        losses += _price_of_loss(prices, uav_prices, i)
    bounds[_COST, 0] = _purchase(prices, uav_prices, _count_pads(mission), smallest)
    hours = mission.max_slots * seconds / 3600
    bounds[_COST, 2] = missions * (losses + hour * hours)


@kernel
def subtract(table, count):
    """Take ``baseline`` from the first ``count`` rows of ``values``."""
    values = array2(table, AT.values, _F8)
    baseline = array2(table, AT.baseline, _F8)
    for row in range(count):
        for column in range(values.shape[1]):
            values[row, column] -= baseline[row, column]


@kernel
def begin(table, is_difference):
    """Begin the totals and the confidence sequences, of metrics or of their differences.

    What is known of costs follows from the prices, which a reader of a page may have changed. The
    differences of two settings have the bounds of both, which the caller writes.
    """
    totals = array2(table, AT.totals, _F8)
    bounds = array2(table, AT.bounds, _F8)
    sequences = array1(table, AT.sequences, _SEQUENCE)
    if not is_difference:
        _bound_costs(table, bounds)
    for column in range(len(bounds)):
        for number in range(totals.shape[1]):
            totals[column, number] = 0.0
        least = bounds[column, 0]
        most = bounds[column, 1]
        if is_difference:
            most = most - least
            least = -most
        failure = bounds[column, 2]
        error = bounds[column, 3]
        start_sequence(sequences[column : column + 1], least, most, failure, error)


@kernel
def add(table, count):
    """Add the first ``count`` rows of ``values``, in their order.

    They count in ``totals`` and in the confidence sequences, whose intervals are written to
    ``ends``.
    """
    values = array2(table, AT.values, _F8)
    totals = array2(table, AT.totals, _F8)
    ends = array2(table, AT.ends, _F8)
    sequences = array1(table, AT.sequences, _SEQUENCE)
    for column in range(values.shape[1]):
        sequence = sequences[column : column + 1]
        add_values(sequence, values[:count, column])
        ends[column, 0], ends[column, 1] = sequence_ends(sequence)
        ends[column, 2], ends[column, 3] = ends_of_what_was_seen(sequence)
    for row in range(count):
        for column in range(values.shape[1]):
            value = values[row, column]
            if np.isnan(value):
                continue
            total = totals[column]
            if total[0] == 0 or value < total[3]:
                total[3] = value
            if total[0] == 0 or value > total[4]:
                total[4] = value
            total[0] += 1
            total[1] += value
            total[2] += value * value


_TABLE = types.CPointer(types.int64)
# What the module has, by name: the compiled function and the types of its arguments.
ENTRIES = {
    "prepare": (prepare, (_TABLE,)),
    "play": (play, (_TABLE, types.int64, types.int64, types.boolean, types.int64)),
    "measure": (measure, (_TABLE, types.int64)),
    "subtract": (subtract, (_TABLE, types.int64)),
    "begin": (begin, (_TABLE, types.boolean)),
    "add": (add, (_TABLE, types.int64)),
}
