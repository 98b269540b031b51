"""The rules of the model: what one mission slot does to one mission.

The module holds compiled functions that change the arrays of one mission in place. Both engines and
the environments call these functions, which use no random generator object and no global state.
``run_slot`` runs a slot in the order of Section III-C, and the SimPy engine has a process for each
part of it:

    resolve(mission, uavs, zones)        # moves, safety controller
    grant_pads(mission, uavs)            # the SimPy engine has a PriorityResource instead
    spend(mission, uavs)                 # energy
    channel.open_slot(mission, uavs, ...)
    communicate(mission, uavs, ..., n)   # for each communication slot n = 1..m
    arrive(mission, residual, ...)       # new data
    settle(mission, uavs)                # rewards, operational status
    strike_if_on(mission, uavs, ...)     # failures and repairs of UAVs, pads and nodes

With ``quota = 0`` a mission lasts until ``max_slots``: after its last UAV has ended, only the last
three go on (see ``advance_without_uavs``).
"""

from dess.base.elementary import exp
from dess.base.kernels import inlined, kernel, shared_kernel
from dess.model import channel
from dess.model.state import (
    ACTIVE,
    BATTERY,
    HOVER,
    LANDED,
    LOST,
    QUOTA,
    STEP_X,
    STEP_Y,
    TRUNCATED,
    draw_parameters,
)
from dess.physics import age, fleet, streams
from dess.physics.arrivals import draw_messages, has_messages
from dess.physics.charging import charge_limit, gain, is_before, limit_battery, share_power
from dess.physics.chart import is_open
from dess.physics.energy import has_costs, spend_slot
from dess.physics.failures import hide_data, strike_if_on, take_pad, working_pads
from dess.physics.landing import flies, has_finished, is_over, lands, next_latch, stands
from dess.physics.radio import is_below_steps
from dess.physics.section import for_sections

ROUNDING = 1e-9  # a rest of data below this share of what a UAV has just collected is none


@kernel
def launch(state, b, starts, number, replication):
    """Start a mission: draw its parameters, start cells and initial data.

    Args:
        state: ``State``; what it has of mission ``b`` is overwritten.
        b: The place of the mission in the state.
        starts: ``Starts`` of the scenarios.
        number: The number of its scenario.
        replication: The number of its replication.
    """
    state.missions[b] = starts.constants[number]
    mission, residual, sensors = state.missions[b], state.residual[b], state.sensors[b]
    mission.replication = replication
    draw_parameters(mission, starts.ranges[number])
    mission.active = mission.uavs
    state.peaks[b] = 0
    _launch_uavs(mission, starts.uavs[number], state.uavs[b])
    for k in range(mission.nodes):
        low, high = starts.data[number, k]
        if k % 4 == 0:
            words = streams.block(
                mission.seed, mission.replication, streams.INITIAL_DATA, 0, 0, k // 4
            )
        residual[k] = low + (high - low) * streams.uniform(words[k % 4])
        sensors[k].newest = sensors[k].hidden = 0.0
        sensors[k].silent = False
        sensors[k].rate = starts.rates[number, k]
        _launch_idle_node(mission, sensors[k], residual, k, starts.ages[number, k])
        mission.initial += residual[k]
        _launch_node(mission, sensors[k], residual, k, starts.silent[number, k])


@for_sections
def _launch_idle_node(mission, sensor, residual, k, age_before):
    """Let the data of a node be what it has collected before the mission, and of that age.

    Where that is a Poisson number of messages, it is drawn in the place of its mean. Ages are
    rounded to communication slots, since peaks are counted by them.
    """
    if mission.idle > 0.0:
        mean = sensor.rate * mission.idle
        residual[k] += draw_idle_data(mission, mean, k) - mean
    sensor.newest = 0.0 - age.starting_age(mission, age_before + mission.idle)
    mission.newest += sensor.newest


@inlined
def draw_idle_data(mission, mean, k):
    """The data that node ``k`` has collected while it was idle; ``mean`` are those on average."""
    words = streams.block(mission.seed, mission.replication, streams.INITIAL_DATA, 1, 0, k)
    return draw_messages(mission, mean, words[0])


@for_sections
def _launch_node(mission, sensor, residual, k, is_silent):
    """Begin to count the data and the age of a node."""
    sensor.initial = residual[k]
    sensor.arrived = sensor.collected = sensor.late = 0.0
    sensor.age_area = 0.0 - sensor.newest * sensor.newest / 2.0
    sensor.silent = is_silent
    if is_silent:
        hide_data(mission, residual, sensor, k)


@kernel
def _launch_uavs(mission, types, uavs):
    """Put the active UAVs on distinct cells of the start zone, drawn at random.

    One that has a cell in ``Starts.uavs`` begins there, with its battery.
    """
    for i in range(len(uavs)):
        uavs[i] = types[i]
        u = uavs[i]
        u.active = i < mission.uavs
        if not u.active:
            u.battery = 0
            continue
        if u.battery == 0 and u.x < 0:
            u.battery = mission.flying_time
        limit_battery(mission, u)
        if u.x < 0:
            cell = _start_cell(mission, i)
            u.x = mission.zone_x + cell % mission.zone_width
            u.y = mission.zone_y + cell // mission.zone_width
            u.zone = 0
        u.from_x, u.from_y = u.x, u.y
        _update_latch(mission, u)  # a UAV may start at or below C_S


@inlined
def _start_cell(mission, i):
    """The number of the start cell of UAV ``i`` in its zone, drawn without replacement.

    UAV i takes the cell at its place of a list of all cells, and the cell at place i of the list
    takes that place. Since all draws can be repeated, there need be no such list.
    """
    place = _start_place(mission, i)
    for j in range(i - 1, -1, -1):
        if _start_place(mission, j) == place:
            place = j
    return place


@inlined
def _start_place(mission, i):
    words = streams.block(mission.seed, mission.replication, streams.START, 0, 0, i)
    return streams.integer(words[0], i, mission.zone_width * mission.zone_height - 1)


@inlined
def _update_latch(mission, u):
    """Set or clear the charging latch iota (eq. 3) by the battery at the start of a slot."""
    complete = charge_limit(mission, u)
    u.latch = next_latch(mission, u.latch, complete, u.battery, u.quota, u.communications)


@inlined
def resolve(mission, uavs, zones):
    """Safety controller (eq. 2, 5; Section III-B): move all active UAVs at the same time.

    A move off the grid or into a no-fly cell becomes Hover, and so does a move into a cell that
    another active UAV will occupy. A cancelled move can block the move of another UAV, so the check
    is repeated until no move is cancelled. The result does not depend on the numbering of the UAVs.
    A UAV in the middle of a move flies on; the cell that it flies to is its own.
    """
    count = mission.uavs
    for i in range(count):
        u = uavs[i]
        if u.active and fleet.continue_move(u):
            continue
        u.from_x, u.from_y = u.x, u.y
        u.overruled = False
        if not u.active:
            continue
        if u.charging or u.grounded:
            u.action = HOVER
        u.executed = u.action
        u.slots_left = u.slots_per_cell - 1 if u.executed != HOVER else 0
        u.x += STEP_X[u.action]
        u.y += STEP_Y[u.action]
        if not is_open(zones, u.x, u.y):
            _cancel(u)
            u.overruled_by = -1
    changed = count > 1
    while changed:
        changed = False
        # Mark all collisions first, then cancel, so that the order of the UAVs does not matter.
        for i in range(count):
            u = uavs[i]
            if u.active and u.executed != HOVER and fleet.begins_move(u):
                for j in range(count):
                    if j != i and uavs[j].active and _collide(mission, u, uavs[j]):
                        if not u.overruled:
                            u.overruled_by = j
                        u.overruled = True
        for i in range(count):
            u = uavs[i]
            if u.active and u.overruled and u.executed != HOVER:
                _cancel(u)
                changed = True
    for i in range(count):
        if uavs[i].active:
            uavs[i].zone = zones[uavs[i].y, uavs[i].x]


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
    u.slots_left = 0
    u.overruled = True


@inlined
def may_act(u):
    """Whether a UAV is asked for an action: it flies, and is not in the middle of a move."""
    return flies(u) and u.slots_left == 0


@inlined
def legal_moves(zones, u):
    """The actions that keep a UAV on the grid and out of no-fly cells, a bit for each."""
    legal = 0
    for action in range(5):
        if is_open(zones, u.x + STEP_X[action], u.y + STEP_Y[action]):
            legal |= 1 << action
    return legal


@inlined
def may_charge(mission, u):
    """Whether a UAV meets the charging condition (eq. 4).

    The UAV flies, is in a zone, has its charging latch set, and its policy chose Hover. A move
    that the safety controller turned into Hover does not start charging.
    """
    is_ready = u.active and not u.grounded and u.latch
    return is_ready and u.action == HOVER and u.zone >= 0


@inlined
def grant_pads(mission, uavs):
    """Grant the free pads of each zone in the order of ``is_before``; on a tie, of the indices.

    This is the compiled equivalent of the SimPy resource. A UAV that meets the charging condition
    requests a pad or stays in the queue. A UAV that no longer meets it leaves the queue. A UAV that
    has a pad keeps it until it is charged.
    """
    for zone in range(mission.zones):
        free = working_pads(mission, zone)
        waiting = 0
        for i in range(mission.uavs):
            u = uavs[i]
            if u.charging:
                free -= u.zone == zone
            elif not may_charge(mission, u):
                u.pad_request = -1
            elif u.zone == zone:
                waiting += 1
                if u.pad_request < 0:
                    u.pad_request = mission.slot
                    mission.pad_requests += 1
        for _ in range(min(free, waiting)):
            first = -1
            for i in range(mission.uavs):
                u = uavs[i]
                waits = u.pad_request >= 0 and not u.charging and u.zone == zone
                if waits and (first < 0 or is_before(mission, u, uavs[first])):
                    first = i
            start_charging(mission, uavs, first)


@inlined
def start_charging(mission, uavs, i):
    """Give a free pad to UAV ``i``."""
    take_pad(mission, uavs, uavs[i])
    uavs[i].charging = True
    uavs[i].charge_slots = 0


@inlined
def spend(mission, uavs):
    """Update the batteries for one slot (eq. 8): charging UAVs gain, flying UAVs lose."""
    limited = share_power(mission, uavs)
    for i in range(mission.uavs):
        u = uavs[i]
        if not u.active:
            continue
        if u.charging:
            u.charge_slots += 1
            if not limited:
                added = gain(mission, u, u.charge_slots)
                added = min(added, charge_limit(mission, u) - u.battery)
                u.battery += added
                u.charged += added
            u.slots_charging += 1
        elif u.grounded:
            mission.slots_grounded += 1
        else:
            if not stands(mission, u):
                _spend_in_the_air(mission, u)
                u.slots_flying += 1
            if u.pad_request >= 0:
                u.slots_waiting += 1
    mission.slot_collected = 0.0


@inlined
def _spend_in_the_air(mission, u):
    """Take the battery for a slot in the air."""
    if has_costs(mission):
        spend_slot(mission, u)
    else:
        u.battery -= mission.flight_cost


@inlined
def communicate(
    mission, uavs, residual, sensors, peaks, order, means, batches, search, n
):  # fmt: skip
    """Run communication slot ``n`` = 1..m: each flying UAV serves its best node (eq. 9-11).

    UAVs are served in index order; each takes ``min(R, D_k)`` of the node with the highest SNR
    among those with residual data, the lowest index on a tie, unless this SNR is below the lowest
    step of the rate. ``served`` and ``amount`` of each UAV are set. The arguments after ``peaks``
    are arrays of ``World`` and ``Scratch``; ``channel.open_slot`` must have begun the mission slot.
    """
    for i in range(mission.uavs):
        u = uavs[i]
        u.served = -1
        if not flies(u) or stands(mission, u):
            continue
        if (n - 1) % channel.GROUP == 0 or mission.continuous != 0:
            channel.open_group(i, search)
        snr, node = channel.best_node(mission, i, residual, order, means, batches, search, n)
        if node < 0 or is_below_steps(mission, snr):
            continue
        amount = min(channel.rate(mission, snr) * u.rate, residual[node])
        if _leaves_rounding(mission, residual[node], amount):
            amount = residual[node]
        residual[node] -= amount
        _count_collected(mission, sensors[node], amount)
        if residual[node] == 0.0:
            age.empty(mission, sensors[node], peaks, n)
        u.served = node
        u.amount = amount
        u.snr = snr
        u.collected += amount
        u.communications += 1
        mission.slot_collected += amount


@for_sections
def _count_collected(mission, sensor, amount):
    sensor.collected += amount


@for_sections
def _leaves_rounding(mission, data, amount):
    """Whether what an amount leaves of the data is due to rounding, as three times 0.3 does of 0.9.

    This happens where rates have steps or a largest value. Without sections it has no chance.
    """
    return data - amount < ROUNDING * amount


@kernel
def _communicate_all(mission, uavs, residual, sensors, peaks, order, means, batches, search):
    """Run all communication slots. Within ``run_slot``, registers would be short."""
    for n in range(1, mission.communication_slots + 1):
        communicate(mission, uavs, residual, sensors, peaks, order, means, batches, search, n)


@kernel
def arrive(mission, residual, sensors, scratch):
    """Add the new data of one slot (eq. 12): a Poisson number of messages per node.

    A message is a data unit, unless the scenario has another size.

    Args:
        mission: ``MISSION`` record.
        residual: (K,) residual data [data units], increased.
        sensors: (K,) ``SENSOR`` records.
        scratch: ``Scratch``; its ``arrivals`` are overwritten.
    """
    if mission.continuous != 0:  # then they are events of their own (dess.model.packets)
        return
    rate = mission.arrival_rate
    probability_of_none = exp(-rate)
    arrivals = scratch.arrivals
    batch = scratch.batches[0, 0]
    for k in range(mission.nodes):
        block = k // 4 % len(batch.node)
        if k % 4 == 0 and block == 0:
            for ahead in range(len(batch.node)):
                batch.node[ahead] = k // 4 + ahead
            streams.blocks(
                mission.seed, mission.replication, streams.ARRIVAL, 0, mission.slot,
                batch.node, batch.words, scratch.search[0, channel.WIDTH],
            )  # fmt: skip
        word = batch.words[k % 4, block]
        arrivals[k] = 0.0
        if _has_own_rates(mission):
            rate = sensors[k].rate
            probability_of_none = exp(-rate)
        if has_messages(mission):
            arrivals[k] = draw_messages(mission, sensors[k].rate, word)
        elif streams.uniform(word) > probability_of_none:
            arrivals[k] = streams.poisson(word, rate)
        if arrivals[k] > 0.0:
            residual[k] += arrivals[k]
            mission.arrived += arrivals[k]
            _count_arrived(mission, sensors[k], arrivals[k])


@for_sections
def _count_arrived(mission, sensor, amount):
    sensor.arrived += amount


@for_sections
def _has_own_rates(mission):
    """Whether nodes have arrival rates of their own."""
    return mission.own_rates


@inlined
def reward_terms(mission, u, charged):
    """The reward terms of an active UAV in one slot (eq. 14-18); its ``end`` must be up to date.

    Args:
        mission: ``MISSION`` record.
        u: ``UAV`` record.
        charged: Whether the UAV charged in the slot.

    Returns:
        The terms data, step, overruled, charging, quota, depleted and age, to be summed in this
        order.
    """
    return (
        mission.reward_data * mission.slot_collected,
        mission.reward_step,
        mission.reward_overruled if u.overruled else 0.0,
        mission.reward_charging if charged else 0.0,
        mission.reward_quota if u.end == QUOTA or u.end == LANDED else 0.0,
        mission.reward_depleted if u.end == BATTERY else 0.0,
        mission.age_reward * age.mean_age(mission),
    )


@inlined
def settle(mission, uavs):
    """Set rewards (eq. 14-18) and operational status (eq. 6, 7) at the end of a slot."""
    mission.collected += mission.slot_collected
    mission.slot += 1
    for i in range(mission.uavs):
        u = uavs[i]
        u.reward = 0.0
        if not u.active:
            continue
        is_on_ground = u.charging or stands(mission, u)
        if has_finished(mission, mission.slot, is_on_ground, u.quota, u.communications):
            u.end = LANDED if lands(mission) else QUOTA
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
        if u.battery >= charge_limit(mission, u) or not u.active:
            u.charging = False
            u.pad_request = -1
        _update_latch(mission, u)


@inlined
def data_left(mission, residual):
    """The residual data of all nodes together [data units]."""
    total = 0.0
    for k in range(mission.nodes):
        total += residual[k]
    return total


@inlined
def run_slot(state, b, world, scratch):
    """Run a slot of mission ``b`` with the actions in its UAVs, in the order of Section III-C.

    After its last UAV has ended, the slot has no UAVs.

    Args:
        state: ``State``.
        b: The place of the mission in it.
        world: ``World``.
        scratch: ``Scratch``.
    """
    # The functions that are not inlined take few arrays: each costs time.
    mission, uavs, residual = state.missions[b], state.uavs[b], state.residual[b]
    sensors, peaks = state.sensors[b], state.peaks[b]
    nodes, mean_snr, order, means, chart = world
    batches, search, _ = scratch
    if advance_without_uavs(mission, uavs, residual, sensors, scratch):
        return
    resolve(mission, uavs, chart.zones)
    grant_pads(mission, uavs)
    spend(mission, uavs)
    channel.open_slot(mission, uavs, nodes, mean_snr, order, means, chart.zones, search)
    _communicate_all(mission, uavs, residual, sensors, peaks, order, means, batches, search)
    arrive(mission, residual, sensors, scratch)
    settle(mission, uavs)
    strike_if_on(mission, uavs, residual, sensors, LOST)


@for_sections
def advance_without_uavs(mission, uavs, residual, sensors, scratch):
    """Run a slot of a mission that waits for its horizon; return whether it does (``is_over``)."""
    if mission.active > 0 or is_over(mission):
        return False
    _advance_without_uavs(mission, uavs, residual, sensors, scratch)
    return True


@shared_kernel
def _advance_without_uavs(mission, uavs, residual, sensors, scratch):
    """New data arrive, and pads and nodes fail and are repaired; nothing else happens."""
    mission.slot_collected = 0.0
    arrive(mission, residual, sensors, scratch)
    mission.slot += 1
    strike_if_on(mission, uavs, residual, sensors, LOST)
