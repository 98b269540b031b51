"""Rules that exist only inside compiled functions, so that tests can call them one by one."""

import numpy as np

from dess import rules
from dess.code.kernels import kernel
from dess.observations import guard
from dess.sea.chart import FAR, distance, is_open


@kernel
def resolve(mission, uavs, chart):
    rules.resolve(mission, uavs, chart)


@kernel
def move(mission, uavs, chart):
    rules.resolve(mission, uavs, chart)
    rules.grant_pads(mission, uavs)
    rules.spend(mission, uavs)


@kernel
def arrive(mission, residual, arrivals):
    rules.arrive(mission, residual, arrivals)


@kernel
def settle(mission, uavs):
    rules.settle(mission, uavs)


@kernel
def advance(
    mission, uavs, residual, sensors, teeth, arrivals,
    nodes, mean_snr, order, means, chart, batches, search,
):  # fmt: skip
    rules.advance(
        mission, uavs, residual, sensors, teeth, arrivals,
        nodes, mean_snr, order, means, chart, batches, search,
    )  # fmt: skip


@kernel
def must_charge(mission, u, data):
    return guard.must_charge(mission, u, data)


@kernel
def waiting_time(mission, uavs, i, chart):
    return guard.waiting_time(mission, uavs, i, chart)


@kernel
def distances(chart, x, y, to):
    """Shortest ways from cells, which may be closed, to cells."""
    found = np.full(len(x), FAR)
    for row in range(len(x)):
        if is_open(chart, x[row], y[row]):
            found[row] = distance(chart, x[row], y[row], to[row, 0], to[row, 1])
    return found
