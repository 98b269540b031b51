"""Rules that exist only inside compiled functions, so that tests can call them one by one."""

from dess import rules
from dess.code.kernels import kernel
from dess.observations import guard


@kernel
def resolve(mission, uavs):
    rules.resolve(mission, uavs)


@kernel
def move(mission, uavs):
    rules.resolve(mission, uavs)
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
    nodes, mean_snr, order, means, batches, search,
):  # fmt: skip
    rules.advance(
        mission, uavs, residual, sensors, teeth, arrivals,
        nodes, mean_snr, order, means, batches, search,
    )  # fmt: skip


@kernel
def must_charge(mission, u, data):
    return guard.must_charge(mission, u, data)


@kernel
def waiting_time(mission, uavs, i):
    return guard.waiting_time(mission, uavs, i)
