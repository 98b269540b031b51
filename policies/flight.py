"""The compiled loop of a mission whose policies are compiled functions.

    fly(state, b, world, scratch, reach, circuit, policies, network, slots)

Python decides nothing in it, so that a slot of a lone mission takes as long as one of a batch. The
windows of a year fly so (``dess.model.years``), and the missions of a page (``analysis.wasm``).
"""

from typing import NamedTuple

import numpy as np

from dess.base.kernels import kernel
from dess.envs.observations.sets import Sea, Tables
from dess.envs.observations.states import CompactStates, active_rows, fill_states
from dess.model import rules
from dess.model.guard.moves import guide
from dess.model.guard.parking import parking_memory
from dess.physics.landing import is_over
from dess.policies.choices import NETWORK, choose_action
from dess.policies.integers import Integers, decide

_NOT_ASKED = -1


class Network(NamedTuple):
    """A network in integers, and what it sees of a mission.

    Attributes:
        integers: Its weights.
        sea, tables: The sea, and what follows from it.
        seen: The compact states of one mission.
    """

    integers: Integers
    sea: Sea
    tables: Tables
    seen: CompactStates


@kernel
def fly(state, b, world, scratch, reach, circuit, policies, network, slots):
    """Fly a mission until it is over, or for so many slots.

    Args:
        state: ``State`` of missions.
        b: The number of the mission in it.
        world, scratch: ``World`` and ``Scratch``.
        reach: As ``Ways.reach``.
        circuit: (K,) as ``choices.plan_circuit``, or ``NO_CIRCUIT``.
        policies: (I,) the number of the policy of each UAV.
        network: The ``Network`` of the policy ``NETWORK``, or None.
        slots: The most slots.
    """
    mission = state.missions[b]
    team = state.uavs[b]
    data = state.residual[b]
    sensors = state.sensors[b]
    chart = world.chart
    memory = parking_memory(chart, len(team))
    actions = np.empty(len(team), np.int64)
    of_network = np.empty(len(team), np.int64)
    has_network = (policies == NETWORK).any()
    while slots > 0 and not is_over(mission):
        slots -= 1
        left = rules.data_left(mission, data)
        if network is not None and has_network:
            _ask_network(network, state, chart, reach, of_network)
        for i in range(mission.uavs):
            actions[i] = _NOT_ASKED
            if not rules.may_act(team[i]):
                continue
            if network is not None and policies[i] == NETWORK:
                actions[i] = of_network[i]
            else:
                actions[i] = choose_action(
                    policies[i], mission, team, i, data, left, sensors, world.nodes, circuit,
                    chart, reach, memory,
                )  # fmt: skip
        for i in range(mission.uavs):  # all have decided before any action is written
            if actions[i] != _NOT_ASKED:
                team[i].action = actions[i]
        rules.run_slot(state, b, world, scratch)


@kernel
def _ask_network(network, state, chart, reach, actions):
    """Write what the network decides for each UAV of the only mission of a state."""
    missions, uavs, residual = state.missions, state.uavs, state.residual
    seen = network.seen
    rows_mission, rows_uav = active_rows(missions, uavs)
    charge, home, safe = guide(missions, uavs, residual, rows_mission, rows_uav, chart, reach, True)
    seen.uavs[:] = 0
    fill_states(
        missions, uavs, residual, True, chart, reach, charge, home, safe,
        seen.missions, seen.uavs, seen.residual,
    )  # fmt: skip
    fleet = missions[0].uavs
    the_mission = np.zeros(fleet, np.int64)
    decide(
        seen, the_mission, np.arange(fleet), network.sea, network.tables, network.integers, actions
    )
