"""A policy that records actions and one that repeats them, to measure the engine alone."""

import numpy as np

from dess.base.kernels import kernel
from dess.model.view import View


@kernel
def _look_up(missions, actions, rows_mission, rows_uav):
    chosen = np.empty(len(rows_mission), np.int8)
    for row in range(len(rows_mission)):
        mission = missions[rows_mission[row]]
        chosen[row] = actions[mission.replication, mission.slot, rows_uav[row]]
    return chosen


class Recorder:
    """Another policy, with a record of its actions."""

    name = "recorder"

    def __init__(self, policy, missions: int, slots: int, uavs: int):
        self.policy, self.actions = policy, np.full((missions, slots, uavs), 4, np.int8)

    def act(self, view: View) -> np.ndarray:
        actions = self.policy.act(view)
        c = view.constants
        self.actions[c["replication"], c["slot"], view.uav] = actions
        return actions


class Recorded:
    """Recorded actions as a policy, which takes next to no time."""

    name = "recorded"

    def __init__(self, actions: np.ndarray):
        self.actions = actions

    def act(self, view: View) -> np.ndarray:
        return _look_up(view.state.missions, self.actions, view.mission, view.uav)
