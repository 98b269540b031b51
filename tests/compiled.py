"""Rules that exist only inside compiled functions, so that tests can call them one by one."""

from dess import rules
from dess.code.kernels import kernel
from dess.observations import guard


@kernel
def resolve(mission, uavs, chart):
    rules.resolve(mission, uavs, chart)


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
