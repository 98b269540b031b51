"""A lower bound of the time of any engine: the random draws that missions need.

A deviate is needed if its node could still be the best, given that deviates are bounded. A block is
needed if one of its words is.
"""

import math

import numpy as np

from dess.base.kernels import kernel
from dess.model import channel, rules
from dess.model.channel import empty_scratch, world_of
from dess.model.state import starts_of, state_of
from dess.physics import streams
from dess.scenario.scenario import ScenarioSpace


def needed_draws(
    scenario: ScenarioSpace, actions: np.ndarray, seed: int, missions: int
) -> tuple[int, int]:
    """Blocks and normal deviates that missions need.

    Args:
        scenario: Their scenario space.
        actions: (missions, slots, I) the actions of the UAVs.
        seed: Their seed.
        missions: Replications 0, 1, ....
    """
    state = state_of([scenario], 1)
    blocks = deviates = 0
    for replication in range(missions):
        rules.launch(state, 0, starts_of([scenario], seed), 0, replication)
        scratch = empty_scratch(scenario.uavs[1], len(scenario.nodes))
        counts = _count(state, world_of(scenario), scratch, actions[replication])
        blocks, deviates = blocks + counts[0], deviates + counts[1]
    return blocks, deviates


@kernel
def _count(state, world, scratch, actions):
    """Simulate one mission and count."""
    mission, uavs, residual = state.missions[0], state.uavs[0], state.residual[0]
    sensors, peaks = state.sensors[0], state.peaks[0]
    nodes, mean_snr, order, means, chart = world
    batches, search, _ = scratch
    reach = mission.shadowing_deviation * streams.MAX_NORMAL
    blocks = deviates = 0
    while mission.active > 0:
        for i in range(mission.uavs):
            uavs[i].action = actions[mission.slot, i]
        rules.resolve(mission, uavs, chart.zones)
        rules.grant_pads(mission, uavs)
        rules.spend(mission, uavs)
        channel.open_slot(mission, uavs, nodes, mean_snr, order, means, chart.zones, search)
        needed = np.zeros((mission.uavs, len(nodes)), np.bool_)
        for n in range(1, mission.communication_slots + 1):
            before = residual.copy()
            rules.communicate(
                mission, uavs, residual, sensors, peaks, order, means, batches, search, n
            )  # fmt: skip
            for i in range(mission.uavs):
                if not uavs[i].active or uavs[i].charging or uavs[i].served < 0:
                    continue
                best = channel.best_node(mission, i, before, order, means, batches, search, n)[0]
                before[uavs[i].served] -= uavs[i].amount
                row = search[i, channel.ROW]
                for rank in range(len(nodes)):
                    k = order[row, rank]
                    if before[k] > 0.0 and means[row, rank, n - 1] + reach >= best:
                        deviates += 1
                        needed[i, k] = True
        blocks += needed.sum() + math.ceil(len(nodes) / 4)
        rules.arrive(mission, residual, sensors, scratch)
        rules.settle(mission, uavs)
    return blocks, deviates


@kernel
def draw(blocks, deviates):
    """Draw that many blocks and transform that many words, one at a time."""
    total = 0.0
    left = deviates
    for index in range(blocks):
        words = streams.block(np.uint64(1), 0, streams.SHADOWING, 0, 0, index)
        for word in range(min(4, left)):
            total += streams.normal(words[word])
        left -= min(4, left)
    return total
