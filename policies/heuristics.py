"""Heuristic policies: random, nearest, greedy, tour and age under the guard, random without it."""

from collections.abc import Sequence

import numpy as np

from dess.base.kernels import kernel
from dess.model.channel import Scratch, World
from dess.model.guard.parking import parking_memory
from dess.model.rules import data_left
from dess.model.state import State
from dess.model.view import View
from dess.policies.choices import (
    AGE,
    GREEDY,
    NEAREST,
    NO_CIRCUIT,
    RANDOM,
    TOUR,
    UNGUARDED,
    choose_action,
    plan_circuit,
)
from dess.policies.flight import fly

_TO_THE_END = 2**62  # more slots than any mission has


def _fly_mission(
    team: Sequence["_Heuristic"],
    state: State,
    b: int,
    world: World,
    scratch: Scratch,
    reach: np.ndarray | None,
) -> None:
    """Fly mission ``b`` of a state to its end, with a team of heuristics."""
    kinds = [policy.kind for policy in team]
    policies = np.resize(np.array(kinds), state.uavs.shape[1])
    fly(state, b, world, scratch, reach, _circuit_of(kinds, world), policies, None, _TO_THE_END)


def _circuit_of(kinds: Sequence[int], world: World) -> np.ndarray:
    """The circuit of ``tour``, if one of the policies is that."""
    if TOUR in kinds:
        return plan_circuit(world.nodes, world.chart)
    return NO_CIRCUIT


class _Heuristic:
    """A policy whose rule is a compiled function."""

    name: str
    kind: int

    def act(self, view: View) -> np.ndarray:
        """Choose the (R,) actions for the rows of the view."""
        state = view.state
        chart = view.world.chart
        circuit = _circuit_of([self.kind], view.world)
        return _choose_actions(
            self.kind, state.missions, state.uavs, state.residual, state.sensors, view.world.nodes,
            circuit, chart, view.ways.reach, view.mission, view.uav,
        )  # fmt: skip

    act.fly = _fly_mission  # type: ignore[attr-defined]


class RandomUnguarded(_Heuristic):
    """Choose as ``random`` does, but without the return guard: it shows what the guard is worth."""

    name = "random-unguarded"
    kind = UNGUARDED


class Random(_Heuristic):
    """Choose a safe action at random, from a random stream that only policies use."""

    name = "random"
    kind = RANDOM


class Nearest(_Heuristic):
    """Fly to the nearest node that is worth a visit."""

    name = "nearest"
    kind = NEAREST


class Greedy(_Heuristic):
    """Fly to the node with the most residual data per slot of distance.

    A node counts less if a teammate is nearer to it.
    """

    name = "greedy"
    kind = GREEDY


class Tour(_Heuristic):
    """Follow a fixed circuit through the nodes, split into equal parts, one for each UAV.

    With a quota, a UAV goes on to the next node when it has all the data of one. Without a quota,
    data come in as long as the mission lasts. Then a UAV goes on to the node of its own part that
    was emptied the longest ago, as soon as a communication slot has emptied the present one, or has
    left less in it than has come in at the next one meanwhile.
    """

    name = "tour"
    kind = TOUR


class Age(_Heuristic):
    """Fly to the node with the highest age of information per slot of distance.

    The nodes that can be visited after it count too, with a tenth of their age per slot of distance
    on the way over that node. Nodes without data are not visited, since nothing newer could be
    collected. A node counts less if a teammate is nearer to it.
    """

    name = "age"
    kind = AGE


# The numbers of the policies by their names.
KINDS = {
    policy.name: policy.kind for policy in (RandomUnguarded, Random, Nearest, Greedy, Tour, Age)
}


@kernel
def _choose_actions(
    kind, missions, uavs, residual, sensors, nodes, circuit, chart, reach, rows_mission, rows_uav
):
    actions = np.empty(len(rows_mission), np.int64)
    memory = parking_memory(chart, uavs.shape[1])
    last = -1
    left = 0.0
    for row in range(len(rows_mission)):
        b = rows_mission[row]
        i = rows_uav[row]
        if b != last:
            last = b
            left = data_left(missions[b], residual[b])
        actions[row] = choose_action(
            kind, missions[b], uavs[b], i, residual[b], left, sensors[b], nodes, circuit, chart,
            reach, memory,
        )  # fmt: skip
    return actions
