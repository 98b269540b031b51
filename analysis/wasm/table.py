"""The arrays of the WebAssembly module, and the tuples of the engine that are made of them.

They lie where the caller of the module has put them: ``table`` has five int64 for each of
``ARRAYS``, an address and up to four sizes. ``dess.analysis.wasm.image`` makes the arrays of a
scenario.
"""

from collections import namedtuple
from typing import Any

import numpy as np
from numba import carray, types
from numba.core import cgutils
from numba.extending import intrinsic

from dess.analysis.stats.sequences import SEQUENCE
from dess.base.kernels import kernel
from dess.envs.observations.sets import Sea, Tables
from dess.envs.observations.states import MISSION_COLUMNS, UAV_COLUMNS, CompactStates
from dess.model.channel import BATCH, Scratch, World
from dess.model.record import MISSION_RECORD, NODE_RECORD, OPERATIONS, UAV_RECORD, Records
from dess.model.state import MISSION, SENSOR, UAV, Starts, State
from dess.physics.chart import Chart
from dess.policies.flight import Network
from dess.policies.integers import Integers

_F8, _I8, _I4, _I2, _I1 = np.float64, np.int64, np.int32, np.int16, np.int8
_F4 = np.float32
_B1 = np.bool_

# The arrays by name: the type of their entries and the number of their axes. B is the number of
# missions of a call, I that of UAVs, K that of nodes; there is the state of one mission. MISSION is
# right for scenarios without sections, too: they give the same records with it.
ARRAYS: dict[str, tuple[Any, int]] = {
    "missions": (MISSION, 1),
    "uavs": (UAV, 2),
    "residual": (_F8, 2),
    "sensors": (SENSOR, 2),
    "peaks": (_I4, 2),
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
    "weights": (_I2, 1),  # of ``Integers``, the network of ``NETWORK``
    "biases": (_I4, 1),
    "shifts": (_I4, 1),
    "scales": (_F4, 1),
    "rates_by_distance": (_F4, 1),  # of ``Sea``, what the network sees
    "sea_constants": (_F4, 1),
    "node_ways": (_I2, 2),  # of its ``Tables``
    "zone_ways": (_I2, 2),
    "home": (_I2, 1),
    "node_home": (_I2, 1),
    "around": (_F4, 2),
    "near": (_F4, 2),
    "shares": (_F4, 1),
    "parts": (_F4, 1),
    "policies": (_I8, 1),  # (I,) the policy of each UAV
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
AT = namedtuple("_At", ARRAYS)(*range(0, WORDS * len(ARRAYS), WORDS))
# Compiled functions take names, not attributes, as types.
_BATCH, _MISSION, _SENSOR, _UAV = BATCH, MISSION, SENSOR, UAV
_MISSION_RECORD, _UAV_RECORD, _OPERATIONS = MISSION_RECORD, UAV_RECORD, OPERATIONS
_NODE_RECORD = NODE_RECORD


@intrinsic
def pointer(typingctx: Any, address: Any) -> Any:
    """The pointer to an address."""

    def generate(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return builder.inttoptr(args[0], cgutils.voidptr_t)

    return types.voidptr(types.int64), generate


@kernel
def array1(table, at, dtype):
    """The array with one axis that begins at a place of the table."""
    return carray(pointer(table[at]), (table[at + 1],), dtype)


@kernel
def array2(table, at, dtype):
    """The array with two axes that begins at a place of the table."""
    return carray(pointer(table[at]), (table[at + 1], table[at + 2]), dtype)


@kernel
def array3(table, at, dtype):
    """The array with three axes that begins at a place of the table."""
    shape = (table[at + 1], table[at + 2], table[at + 3])
    return carray(pointer(table[at]), shape, dtype)


@kernel
def array4(table, at, dtype):
    """The array with four axes that begins at a place of the table."""
    shape = (table[at + 1], table[at + 2], table[at + 3], table[at + 4])
    return carray(pointer(table[at]), shape, dtype)


@kernel
def state_in(table):
    """The ``State`` of one mission."""
    return State(
        array1(table, AT.missions, _MISSION),
        array2(table, AT.uavs, _UAV),
        array2(table, AT.residual, _F8),
        array2(table, AT.sensors, _SENSOR),
        array2(table, AT.peaks, _I4),
    )


@kernel
def starts_in(table):
    """The ``Starts`` of the scenario."""
    return Starts(
        array1(table, AT.constants, _MISSION),
        array3(table, AT.ranges, _I8),
        array2(table, AT.types, _UAV),
        array3(table, AT.data, _F8),
        array2(table, AT.rates, _F8),
        array2(table, AT.ages, _F8),
        array2(table, AT.silent, _B1),
    )


@kernel
def chart_in(table):
    """The ``Chart`` of the sea."""
    return Chart(
        array2(table, AT.zones, _I1),
        array2(table, AT.parking, _I8),
        array1(table, AT.sizes, _I8),
        array2(table, AT.nearest, _I4),
        array2(table, AT.ways, _I2),
        None,  # grids on which not all cells have a row of ways need more memory than a page has
    )


@kernel
def world_in(table):
    """The ``World`` of the sea."""
    return World(
        array2(table, AT.nodes, _I8),
        array2(table, AT.mean_snr, _F8),
        array2(table, AT.order, _I2),
        array3(table, AT.means, _F8),
        chart_in(table),
    )


@kernel
def scratch_in(table):
    """The ``Scratch`` of a slot."""
    return Scratch(
        array2(table, AT.batches, _BATCH),
        array2(table, AT.search, _I8),
        array1(table, AT.arrivals, _F8),
    )


@kernel
def records_in(table):
    """The ``Records`` of the missions of a call."""
    return Records(
        array1(table, AT.mission_records, _MISSION_RECORD),
        array2(table, AT.uav_records, _UAV_RECORD),
        array1(table, AT.operations, _OPERATIONS),
        array2(table, AT.node_records, _NODE_RECORD),
    )


@kernel
def reach_in(table):
    """As ``Ways.reach``: one table, or none where every slot takes one percent."""
    at = AT.reach
    shape = (table[at + 1], table[at + 2], table[at + 3], table[at + 4])
    return carray(pointer(table[at]), (min(shape[0], 1), *shape), _I4)


@kernel
def integers_in(table):
    """The ``Integers`` of the network."""
    return Integers(
        array1(table, AT.weights, _I2),
        array1(table, AT.biases, _I4),
        array1(table, AT.shifts, _I4),
        array1(table, AT.scales, _F4),
    )


@kernel
def sea_in(table):
    """The ``Sea`` that the network sees."""
    mission = array1(table, AT.constants, _MISSION)[0]
    pads = np.empty(len(array1(table, AT.sizes, _I8)), np.int64)
    for zone in range(len(pads)):
        pads[zone] = mission.zone_pads[zone]
    return Sea(
        array2(table, AT.zones, _I1),
        array2(table, AT.nodes, _I8),
        pads,
        array1(table, AT.rates_by_distance, _F4),
        array1(table, AT.sea_constants, _F4),
    )


@kernel
def tables_in(table):
    """The ``Tables`` of this sea."""
    return Tables(
        array2(table, AT.node_ways, _I2),
        array2(table, AT.zone_ways, _I2),
        array1(table, AT.home, _I2),
        array1(table, AT.node_home, _I2),
        array2(table, AT.around, _F4),
        array2(table, AT.near, _F4),
        array1(table, AT.shares, _F4),
        array1(table, AT.parts, _F4),
    )


@kernel
def network_in(table):
    """The ``Network``, and room for what it sees of a mission."""
    return Network(
        integers_in(table),
        sea_in(table),
        tables_in(table),
        CompactStates(
            np.zeros((1, MISSION_COLUMNS), np.int16),
            np.zeros((1, table[AT.uavs + 2], UAV_COLUMNS), np.int16),
            np.zeros((1, table[AT.residual + 2]), np.float32),
        ),
    )
