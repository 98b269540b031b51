"""The consequences: what one mission slot does to one mission.

Compiled functions on one mission's arrays, shared by both engines: no engine, no random generator
object, no globals. A slot is, in this order (Section III-C): ``resolve`` (the UAVs act, the
safety controller resolves), the grant of charging pads (the engine's: a SimPy resource, or
``grant_pads``), ``spend`` (energy), ``communicate`` for each communication slot, ``arrive`` (new
data) and ``settle`` (rewards and operational status).
"""

import math

import numpy as np

from dess import channel, streams
from dess.compiled import inlined, kernel
from dess.state import (
    ACTIVE,
    BATTERY,
    HOVER,
    QUOTA,
    STEP_X,
    STEP_Y,
    TRUNCATED,
    draw_parameters,
)


@kernel
def launch(mission, ranges, uavs, residual):
    """Start a mission: parameters, start cells and initial data, all drawn.

    Args:
        mission: ``MISSION`` record with its seed, replication and constants set.
        ranges: (4, 2) ranges of the sampled parameters.
        uavs: (I,) ``UAV`` records, overwritten.
        residual: (K,) residual data [data units], overwritten.
    """
    draw_parameters(mission, ranges)
    mission.slot = 0
    mission.active = mission.uavs
    mission.arrived = mission.collected = mission.slot_collected = 0.0
    _launch_uavs(mission, uavs)
    mission.initial = 0.0
    spread = mission.initial_high - mission.initial_low
    for k in range(mission.nodes):
        if k % 4 == 0:
            words = streams.block(
                mission.seed, mission.replication, streams.INITIAL_DATA, 0, 0, k // 4
            )
        residual[k] = mission.initial_low + spread * streams.uniform(words[k % 4])
        mission.initial += residual[k]


@kernel
def _launch_uavs(mission, uavs):
    """Distinct start cells of the zone, drawn one after another from those that are left."""
    cells = mission.zone_width * mission.zone_height
    left = np.arange(cells)
    for i in range(len(uavs)):
        u = uavs[i]
        u.active = i < mission.uavs
        u.end = ACTIVE
        u.latch = u.charging = u.overruled = False
        u.battery = mission.flying_time if u.active else 0
        u.communications = u.slots_flying = u.slots_charging = u.slots_waiting = 0
        u.action = u.executed = HOVER
        u.pad_request = u.served = -1
        u.amount = u.collected = u.reward = u.total_reward = 0.0
        u.x = u.y = u.from_x = u.from_y = -1
        if u.active:
            words = streams.block(mission.seed, mission.replication, streams.START, 0, 0, i)
            pick = streams.integer(words[0], i, cells - 1)
            left[i], left[pick] = left[pick], left[i]
            u.x = u.from_x = mission.zone_x + left[i] % mission.zone_width
            u.y = u.from_y = mission.zone_y + left[i] // mission.zone_width
            _judge_latch(mission, u)  # slot 0 is judged like any other


@inlined
def _judge_latch(mission, u):
    """Charging latch iota (eq. 3), judged on the battery at the start of a slot."""
    if u.battery <= mission.charge_start:
        u.latch = True
    if u.battery >= mission.charge_complete:
        u.latch = False


@inlined
def resolve(mission, uavs):
    """Safety controller (eq. 2, 5; Section III-B): move all active UAVs at once.

    A move off the grid becomes Hover. So does every move into a cell that another active UAV will
    occupy, until nothing changes. The result does not depend on the numbering of the UAVs.
    """
    count = mission.uavs
    for i in range(count):
        u = uavs[i]
        u.from_x, u.from_y = u.x, u.y
        u.overruled = False
        if not u.active:
            continue
        if u.charging:
            u.action = HOVER
        u.executed = u.action
        u.x += STEP_X[u.action]
        u.y += STEP_Y[u.action]
        if not (0 <= u.x < mission.grid and 0 <= u.y < mission.grid):
            _cancel(u)
    if count == 1:
        return
    changed = True
    while changed:
        changed = False
        # Mark first, cancel after: a round judges all moves on the same picture.
        for i in range(count):
            u = uavs[i]
            if u.active and u.executed != HOVER:
                for j in range(count):
                    if j != i and uavs[j].active and _collide(mission, u, uavs[j]):
                        u.overruled = True
        for i in range(count):
            u = uavs[i]
            if u.active and u.overruled and u.executed != HOVER:
                _cancel(u)
                changed = True


@inlined
def _collide(mission, u, other):
    """Whether the move of ``u`` must be cancelled because of ``other``."""
    if u.x == other.x and u.y == other.y:
        return True
    return (
        mission.forbid_swaps != 0
        and other.executed != HOVER
        and u.x == other.from_x
        and u.y == other.from_y
        and other.x == u.from_x
        and other.y == u.from_y
    )


@inlined
def _cancel(u):
    u.x, u.y = u.from_x, u.from_y
    u.executed = HOVER
    u.overruled = True


@inlined
def may_charge(mission, u):
    """Charging condition (eq. 4): active, in the zone, latched, hovering of its own will.

    A move that the safety controller cancelled is no wish to charge.
    """
    return (
        u.active
        and u.latch
        and u.action == HOVER
        and mission.zone_x <= u.x < mission.zone_x + mission.zone_width
        and mission.zone_y <= u.y < mission.zone_y + mission.zone_height
    )


@inlined
def grant_pads(mission, uavs):
    """Grant free charging pads, first come first served, ties in the order of the UAVs.

    The compiled twin of the SimPy resource: who meets the charging condition asks for a pad or goes
    on asking, who no longer meets it leaves the queue, who has a pad keeps it until charged.
    """
    free = mission.pads
    waiting = 0
    for i in range(mission.uavs):
        u = uavs[i]
        if u.charging:
            free -= 1
        elif not may_charge(mission, u):
            u.pad_request = -1
        else:
            waiting += 1
            if u.pad_request < 0:
                u.pad_request = mission.slot
    for _ in range(min(free, waiting)):
        first = -1
        for i in range(mission.uavs):
            u = uavs[i]
            waits = u.pad_request >= 0 and not u.charging
            if waits and (first < 0 or u.pad_request < uavs[first].pad_request):
                first = i
        uavs[first].charging = True


@inlined
def spend(mission, uavs):
    """Energy of one slot (eq. 8): a charging slot gains, any other active slot costs."""
    for i in range(mission.uavs):
        u = uavs[i]
        if not u.active:
            continue
        if u.charging:
            u.battery = min(u.battery + mission.charge_rate, mission.charge_complete)
            u.slots_charging += 1
        else:
            u.battery -= mission.flight_cost
            u.slots_flying += 1
            if u.pad_request >= 0:
                u.slots_waiting += 1
    mission.slot_collected = 0.0


@inlined
def communicate(
    mission, uavs, residual, nodes, path_loss, order, means, batches, search, n
):  # fmt: skip
    """Communication slot ``n`` = 1..m: each flying UAV serves its best node (eq. 9-11).

    UAVs are served in index order; each takes ``min(R, D_k)`` of the node with the highest SNR
    among those with residual data, the lowest index on a tie. What was served stands in ``served``
    and ``amount`` of each UAV. After the mission's arrays come those of ``World`` and ``Scratch``.
    """
    for i in range(mission.uavs):
        u = uavs[i]
        u.served = -1
        if not u.active or u.charging:
            continue
        if (n - 1) % channel.GROUP == 0:
            channel.open_group(mission, i, u, nodes, path_loss, order, means, search)
        snr, node = channel.best_node(mission, i, residual, order, means, batches, search, n)
        if node < 0:
            continue
        amount = min(channel.rate(mission, snr), residual[node])
        residual[node] -= amount
        u.served = node
        u.amount = amount
        u.collected += amount
        u.communications += 1
        mission.slot_collected += amount


@inlined
def arrive(mission, residual, arrivals):
    """New data of one slot (eq. 12): Poisson packets per node, left in ``arrivals``."""
    none = math.exp(-mission.arrival_rate)
    for k in range(0, mission.nodes, 4):
        words = streams.block(
            mission.seed, mission.replication, streams.ARRIVAL, 0, mission.slot, k // 4
        )
        for j in range(min(4, mission.nodes - k)):
            arrivals[k + j] = 0
            if streams.uniform(words[j]) > none:
                arrivals[k + j] = streams.poisson(words[j], mission.arrival_rate)
                residual[k + j] += arrivals[k + j]
                mission.arrived += arrivals[k + j]


@inlined
def reward_terms(mission, u, charged):
    """The parts of the reward of an active UAV's slot (eq. 14-18), once its ``end`` is known.

    Args:
        mission: ``MISSION`` record.
        u: ``UAV`` record.
        charged: Whether it charged in the slot.

    Returns:
        The terms for data, step, overruled, charging, quota and depleted, to be added in order.
    """
    return (
        mission.reward_data * mission.slot_collected,
        mission.reward_step,
        mission.reward_overruled if u.overruled else 0.0,
        mission.reward_charging if charged else 0.0,
        mission.reward_quota if u.end == QUOTA else 0.0,
        mission.reward_depleted if u.end == BATTERY else 0.0,
    )


@inlined
def settle(mission, uavs):
    """Rewards (eq. 14-18) and operational status (eq. 6, 7) at the end of a slot."""
    mission.collected += mission.slot_collected
    mission.slot += 1
    for i in range(mission.uavs):
        u = uavs[i]
        u.reward = 0.0
        if not u.active:
            continue
        if u.communications >= mission.quota:
            u.end = QUOTA
        elif u.battery <= 0:
            u.end = BATTERY
        elif mission.slot >= mission.max_slots:
            u.end = TRUNCATED
        for term in reward_terms(mission, u, u.charging):
            u.reward += term
        u.total_reward += u.reward
        if u.end != ACTIVE:
            u.active = False
            mission.active -= 1
        if u.battery >= mission.charge_complete or not u.active:
            u.charging = False
            u.pad_request = -1
        _judge_latch(mission, u)


@kernel
def advance(
    mission, uavs, residual, arrivals, nodes, path_loss, order, means, batches, search
):  # fmt: skip
    """One whole mission slot, the actions being entered; the order of Section III-C."""
    resolve(mission, uavs)
    grant_pads(mission, uavs)
    spend(mission, uavs)
    for n in range(1, mission.communication_slots + 1):
        communicate(
            mission, uavs, residual, nodes, path_loss, order, means, batches, search, n
        )  # fmt: skip
    arrive(mission, residual, arrivals)
    settle(mission, uavs)
