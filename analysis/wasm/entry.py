"""The entry points of the WebAssembly module: compiled functions over a table of arrays.

The module flies missions with the functions of the batch engine (``rules.launch``,
``heuristics.choose_action``, ``rules.run_slot``, ``record.write_record``); the loop around them is
here. Its arrays lie where its caller has put them: ``table`` has five int64 for each of ``ARRAYS``,
an address and up to four sizes. ``dess.analysis.wasm.image`` makes the arrays of a scenario.
"""

from collections import namedtuple
from typing import Any

import numpy as np
from numba import carray, types
from numba.core import cgutils
from numba.extending import intrinsic

from dess.analysis.stats.sequences import (
    SEQUENCE,
    add_values,
    ends_of_what_was_seen,
    sequence_ends,
    start_sequence,
)
from dess.base.kernels import kernel
from dess.model import rules
from dess.model.channel import BATCH, Scratch, World
from dess.model.guard.parking import parking_memory
from dess.model.record import (
    MISSION_RECORD,
    NODE_RECORD,
    OPERATIONS,
    UAV_RECORD,
    Records,
    write_record,
)
from dess.model.state import MISSION, SENSOR, UAV, Starts, State
from dess.model.ways import FAR as _FARTHEST
from dess.physics.chart import FAR, Chart, fill_ways, neighbours_of, spread_costs
from dess.physics.energy import fill_move_costs
from dess.physics.landing import is_over
from dess.policies.heuristics import UNGUARDED, choose_action, choose_at_random

_F8, _I8, _I4, _I2, _I1 = np.float64, np.int64, np.int32, np.int16, np.int8
_B1 = np.bool_
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

# The arrays by name: the type of their entries and the number of their axes. B is the number of
# missions of a call, I that of UAVs, K that of nodes; there is the state of one mission. MISSION is
# right for scenarios without sections, too: they give the same records with it.
ARRAYS: dict[str, tuple[Any, int]] = {
    "missions": (MISSION, 1),
    "uavs": (UAV, 2),
    "residual": (_F8, 2),
    "sensors": (SENSOR, 2),
    "teeth": (_I4, 2),
    "constants": (MISSION, 1),  # from here on those of ``Starts``
    "ranges": (_I8, 3),
    "types": (UAV, 2),
    "data": (_F8, 3),
    "rates": (_F8, 2),
    "ages": (_F8, 2),
    "silent": (_B1, 2),
    "nodes": (_I8, 2),  # of ``World``
    "mean_snr": (_F8, 2),
    "order": (_I2, 2),
    "means": (_F8, 3),
    "zones": (_I1, 2),  # of ``Chart``
    "parking": (_I8, 2),
    "sizes": (_I8, 1),
    "nearest": (_I4, 2),
    "ways": (_I2, 2),
    "batches": (BATCH, 2),  # of ``Scratch``
    "search": (_I8, 2),
    "arrivals": (_F8, 1),
    "reach": (_I4, 4),  # the tables of ``Ways.reach`` and ``Ways.home`` for its only energy
    "ways_home": (_I4, 4),
    "circuit": (_I8, 1),  # of ``tour``
    "policies": (_I8, 1),  # (I,) the policy of each UAV
    "actions": (_I8, 1),  # (I,) what a UAV has decided in this slot, -1 if it was not asked
    "mission_records": (MISSION_RECORD, 1),  # of ``Records``
    "uav_records": (UAV_RECORD, 2),
    "operations": (OPERATIONS, 1),
    "node_records": (NODE_RECORD, 2),  # none: no page shows them
    "prices": (_F8, 1),
    "uav_prices": (_F8, 1),  # (I,) of UAVs whose types have prices, nan for those of ``prices``
    "full_packs": (_F8, 1),  # (I,) the full battery of each UAV, its reserve included [%]
    "factors": (_F8, 1),  # of the metrics, where their unit is that of a data sheet
    "values": (_F8, 2),  # (B, METRICS)
    "baseline": (_F8, 2),  # (B, METRICS) values of other missions with the same replications
    "totals": (_F8, 2),  # (METRICS, TOTALS)
    # (METRICS, 4) the least and the largest value, by how much a failure changes a value of which
    # these are not known, and the error of the ends.
    "bounds": (_F8, 2),
    "sequences": (SEQUENCE, 1),  # (METRICS,) the confidence sequences of the means
    # (METRICS, 4) the ends of the intervals of the means, then those of what was seen.
    "ends": (_F8, 2),
}
WORDS = 5  # of the table for each array
_AT = namedtuple("_At", ARRAYS)(*range(0, WORDS * len(ARRAYS), WORDS))
_NO_UAV = np.zeros(1, UAV_RECORD)  # the record of one that a mission does not have
# Compiled functions take names, not attributes, as types.
_BATCH, _MISSION, _SENSOR, _UAV = BATCH, MISSION, SENSOR, UAV
_MISSION_RECORD, _UAV_RECORD, _OPERATIONS = MISSION_RECORD, UAV_RECORD, OPERATIONS
_NODE_RECORD = NODE_RECORD
_SEQUENCE = SEQUENCE


@intrinsic
def _pointer(typingctx: Any, address: Any) -> Any:
    """The pointer to an address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@kernel
def _array1(table, at, dtype):
    return carray(_pointer(table[at]), (table[at + 1],), dtype)


@kernel
def _array2(table, at, dtype):
    return carray(_pointer(table[at]), (table[at + 1], table[at + 2]), dtype)


@kernel
def _array3(table, at, dtype):
    shape = (table[at + 1], table[at + 2], table[at + 3])
    return carray(_pointer(table[at]), shape, dtype)


@kernel
def _array4(table, at, dtype):
    shape = (table[at + 1], table[at + 2], table[at + 3], table[at + 4])
    return carray(_pointer(table[at]), shape, dtype)


@kernel
def _state(table):
    return State(
        _array1(table, _AT.missions, _MISSION),
        _array2(table, _AT.uavs, _UAV),
        _array2(table, _AT.residual, _F8),
        _array2(table, _AT.sensors, _SENSOR),
        _array2(table, _AT.teeth, _I4),
    )


@kernel
def _starts(table):
    return Starts(
        _array1(table, _AT.constants, _MISSION),
        _array3(table, _AT.ranges, _I8),
        _array2(table, _AT.types, _UAV),
        _array3(table, _AT.data, _F8),
        _array2(table, _AT.rates, _F8),
        _array2(table, _AT.ages, _F8),
        _array2(table, _AT.silent, _B1),
    )


@kernel
def _chart(table):
    return Chart(
        _array2(table, _AT.zones, _I1),
        _array2(table, _AT.parking, _I8),
        _array1(table, _AT.sizes, _I8),
        _array2(table, _AT.nearest, _I4),
        _array2(table, _AT.ways, _I2),
        None,  # grids on which not all cells have a row of ways need more memory than a page has
    )


@kernel
def _world(table):
    return World(
        _array2(table, _AT.nodes, _I8),
        _array2(table, _AT.mean_snr, _F8),
        _array2(table, _AT.order, _I2),
        _array3(table, _AT.means, _F8),
        _chart(table),
    )


@kernel
def _scratch(table):
    return Scratch(
        _array2(table, _AT.batches, _BATCH),
        _array2(table, _AT.search, _I8),
        _array1(table, _AT.arrivals, _F8),
    )


@kernel
def _records(table):
    return Records(
        _array1(table, _AT.mission_records, _MISSION_RECORD),
        _array2(table, _AT.uav_records, _UAV_RECORD),
        _array1(table, _AT.operations, _OPERATIONS),
        _array2(table, _AT.node_records, _NODE_RECORD),
    )


@kernel
def _reach(table):
    """As ``Ways.reach``: one table, or none where every slot takes one percent."""
    at = _AT.reach
    shape = (table[at + 1], table[at + 2], table[at + 3], table[at + 4])
    return carray(_pointer(table[at]), (min(shape[0], 1), *shape), _I4)


@kernel
def prepare(table):
    """Fill the tables that follow from the sea: the ways between cells, and the battery home."""
    chart = _chart(table)
    zones = chart.zones
    ways = chart.ways
    if len(ways) > 0:
        ways[:] = FAR
        fill_ways(zones, np.arange(zones.size), ways)
    mission = _array1(table, _AT.constants, _MISSION)[0]
    mission.pads = _count_pads(mission)  # the pads of several zones may have been changed
    moves = np.zeros((4, *zones.shape), np.int64)
    by_cell = moves.reshape((4, zones.size))
    neighbours = neighbours_of(zones)
    nearest = np.zeros(zones.size, np.int32)
    reach = _array4(table, _AT.reach, _I4)
    home = _array4(table, _AT.ways_home, _I4)[0]
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
    state = _state(table)
    starts = _starts(table)
    world = _world(table)
    scratch = _scratch(table)
    records = _records(table)
    nodes = world.nodes
    chart = world.chart
    reach = _reach(table)
    ways = _array4(table, _AT.ways_home, _I4)
    circuit = _array1(table, _AT.circuit, _I8)
    policies = _array1(table, _AT.policies, _I8)
    actions = _array1(table, _AT.actions, _I8)
    memory = parking_memory(chart, len(actions))
    mission = state.missions[0]
    team = state.uavs[0]
    data = state.residual[0]
    sensors = state.sensors[0]
    over = 0
    for row in range(count):
        if launches:
            rules.launch(state, 0, starts, 0, first + row)
        left = slots
        while left > 0 and not is_over(mission):
            left -= 1
            data_left = rules.data_left(mission, data)
            for i in range(mission.uavs):
                actions[i] = -1
                if not rules.may_act(team[i]):
                    continue
                if policies[i] == UNGUARDED:
                    legal = rules.legal_moves(chart.zones, team[i])
                    actions[i] = choose_at_random(mission, team, i, legal, chart.sizes)
                else:
                    actions[i] = choose_action(
                        policies[i], mission, team, i, data, data_left, sensors, nodes, circuit,
                        chart, reach, memory,
                    )  # fmt: skip
            for i in range(mission.uavs):  # all have decided before any action is written
                if actions[i] >= 0:
                    team[i].action = actions[i]
            rules.run_slot(state, 0, world, scratch)
        if is_over(mission):
            over += 1
            for i in range(mission.uavs, len(team)):
                records.uavs[row, i] = _NO_UAV[0]
            write_record(state, 0, ways, records, row)
    return over


@kernel
def measure(table, count):
    """Write the metrics of the first ``count`` records into ``values``."""
    missions, uavs, _, _ = _records(table)
    shape = (len(missions), _COST - _MEASURED)
    operations = carray(_pointer(table[_AT.operations]), shape, _F8)
    mission = _array1(table, _AT.constants, _MISSION)[0]
    types = _array2(table, _AT.types, _UAV)[0]
    values = _array2(table, _AT.values, _F8)
    factors = _array1(table, _AT.factors, _F8)
    prices = _array1(table, _AT.prices, _F8)
    uav_prices = _array1(table, _AT.uav_prices, _F8)
    packs = _array1(table, _AT.full_packs, _F8)
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
    prices = _array1(table, _AT.prices, _F8)
    if len(prices) == 0:
        return
    mission = _array1(table, _AT.constants, _MISSION)[0]
    smallest = _array3(table, _AT.ranges, _I8)[0, 0, 0]
    largest = _array3(table, _AT.ranges, _I8)[0, 0, 1]
    hour = prices[3]
    missions = prices[5]
    seconds = prices[8]
    uav_prices = _array1(table, _AT.uav_prices, _F8)
    losses = 0.0
    for i in range(largest):
        losses += _price_of_loss(prices, uav_prices, i)
    bounds[_COST, 0] = _purchase(prices, uav_prices, _count_pads(mission), smallest)
    hours = mission.max_slots * seconds / 3600
    bounds[_COST, 2] = missions * (losses + hour * hours)


@kernel
def subtract(table, count):
    """Take ``baseline`` from the first ``count`` rows of ``values``."""
    values = _array2(table, _AT.values, _F8)
    baseline = _array2(table, _AT.baseline, _F8)
    for row in range(count):
        for column in range(values.shape[1]):
            values[row, column] -= baseline[row, column]


@kernel
def begin(table, is_difference):
    """Begin the totals and the confidence sequences, of metrics or of their differences.

    What is known of costs follows from the prices, which a reader of a page may have changed. The
    differences of two settings have the bounds of both, which the caller writes.
    """
    totals = _array2(table, _AT.totals, _F8)
    bounds = _array2(table, _AT.bounds, _F8)
    sequences = _array1(table, _AT.sequences, _SEQUENCE)
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
    values = _array2(table, _AT.values, _F8)
    totals = _array2(table, _AT.totals, _F8)
    ends = _array2(table, _AT.ends, _F8)
    sequences = _array1(table, _AT.sequences, _SEQUENCE)
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
