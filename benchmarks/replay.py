"""Policies that record actions and replay them: what a policy costs can be left out."""

import numpy as np

from dess.compiled import kernel
from dess.view import View


@kernel
def _look_up(missions, actions, rows_mission, rows_uav):
    chosen = np.empty(len(rows_mission), np.int8)
    for row in range(len(rows_mission)):
        mission = missions[rows_mission[row]]
        chosen[row] = actions[mission.replication, mission.slot, rows_uav[row]]
    return chosen


class Recorder:
    """Another policy, whose actions it writes down."""

    name = "recorder"

    def __init__(self, policy, missions: int, slots: int, uavs: int):
        self.policy, self.actions = policy, np.full((missions, slots, uavs), 4, np.int8)

    def act(self, view: View) -> np.ndarray:
        actions = self.policy.act(view)
        c = view.constants
        self.actions[c["replication"], c["slot"], view.uav] = actions
        return actions


class Replay:
    """A policy that costs nothing: recorded actions."""

    name = "replay"

    def __init__(self, actions: np.ndarray):
        self.actions = actions

    def act(self, view: View) -> np.ndarray:
        return _look_up(view.state.missions, self.actions, view.mission, view.uav)
