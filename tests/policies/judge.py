"""A judge of lost UAVs: could a UAV whose battery ran empty have lived?

    python -m tests.policies.judge clustered:900307 any 2600 2 'uavs=[3,5]' pads=3

For each UAV of the mission whose battery ran empty, the judge goes back 40 slots, or to the slot
after it last charged. From there it tries all moves of this UAV, slot by slot, with the rules of
the simulator. Its teammates do what they did in the mission: a branch in which one of them is not
in the cell in which it was, or does not charge as it did, is dropped. So the UAV may neither block
a teammate nor take a pad that a teammate had. A UAV lives if it begins to charge, fills its quota,
or flies until the horizon ``max_slots``.

Branches in which the cell, the battery, the latch, the place in the queue and the move in progress
are the same are merged; the one with most communications counted toward the quota stays. What
data the merged branches left at the nodes may differ, which can only matter for a way to live that
fills the quota.
"""

import sys
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from dess.env.stepper import MissionStepper
from dess.scenario import Scenario, ScenarioSpace
from dess.state import BATTERY, QUOTA, TRUNCATED, State
from dess.view import decide, team_of
from tests import compiled

SLOTS = 40  # how far back a way to live is searched
CHUNK = 4096  # branches that are advanced together, for memory
LETTERS = np.array([*"NESW."])
# Branches that agree in these fields of the UAV, and in nothing else, are merged.
SAME = ("x", "y", "battery", "latch", "pad_request", "pad", "slots_left", "executed", "grounded")


class Finding(NamedTuple):
    """What the judge found of a UAV whose battery ran empty.

    Attributes:
        uav: The index of the UAV.
        slot: The slot in which its battery ran empty.
        cell: The cell in which it did.
        since: The first slot of the search.
        latest: The last slot from which a way to live existed, None if there was none.
        moves: The moves from ``latest`` on, as letters; ``.`` is Hover.
        how: How the UAV lives with these moves.
    """

    uav: int
    slot: int
    cell: tuple[int, int]
    since: int
    latest: int | None = None
    moves: str = ""
    how: str = ""

    def __str__(self) -> str:
        lost = f"UAV {self.uav} ran empty in slot {self.slot} at {self.cell}"
        if self.latest is None:
            return f"{lost}; no way to live from slot {self.since} on was found"
        return f"{lost}; from slot {self.latest} on, {self.moves} would have saved it: {self.how}"


class Replay:
    """A mission simulated again: the state before each slot, with the actions decided in it."""

    def __init__(
        self, scenario: Scenario | ScenarioSpace, policy: Any, seed: int, replication: int
    ):
        self.stepper = stepper = MissionStepper(scenario, 1, seed)
        team = team_of(policy, [stepper.space])
        stepper.start_at(seed, replication)
        stepper.launch(stepper.indices)
        self.states: list[State] = []
        while stepper.state.missions[0]["active"]:
            decide(team, stepper.state, stepper.world)
            self.states.append(_copied(stepper.state))
            stepper.step(stepper.state.uavs["action"])
        self.states.append(_copied(stepper.state))
        chart = stepper.world.chart
        rows, columns = chart.zones.shape
        y, x = (axis.ravel() for axis in np.mgrid[:rows, :columns])
        nearest = chart.parking[np.maximum(chart.nearest[y, x], 0)]
        self._home = compiled.distances(chart, x, y, nearest).reshape(rows, columns)

    def uav(self, slot: int, i: int) -> Any:
        """The record of a UAV before a slot."""
        return self.states[slot].uavs[0, i]

    def judge(self, i: int) -> Finding:
        """Search the last slots of a UAV whose battery ran empty for a way to live."""
        end = next(t for t, s in enumerate(self.states) if s.uavs[0, i]["end"] == BATTERY) - 1
        sessions = [int(state.uavs[0, i]["slots_charging"]) for state in self.states]
        charged = [t + 1 for t in range(end) if sessions[t + 1] > sessions[t]]
        since = max([end + 1 - SLOTS, 0, *charged[-1:]])
        cell = (int(self.uav(end + 1, i)["x"]), int(self.uav(end + 1, i)["y"]))
        for slot in range(end, since - 1, -1):
            if way := self._way(i, slot):
                return Finding(i, end, cell, since, slot, *way)
        return Finding(i, end, cell, since)

    def _way(self, i: int, start: int) -> tuple[str, str] | None:
        """Moves of a UAV from a slot on with which it lives, and how, or None."""
        state = _copied(self.states[start])
        charged, steps = state.uavs[0, i]["slots_charging"], []
        for slot in range(start, int(state.missions[0]["max_slots"])):
            parents, actions, state = self._branches(state, i, slot)
            steps.append((parents, actions))
            own = state.uavs[:, i]
            for how, lives in (
                ("charges", own["slots_charging"] > charged),
                ("has filled its quota", own["end"] == QUOTA),
                ("has reached the horizon", own["end"] == TRUNCATED),
            ):
                if lives.any():
                    return _moves(steps, int(lives.argmax())), f"in slot {slot} it {how}"
            kept = self._kept(state, i)
            if not len(kept):
                return None
            steps[-1] = (parents[kept], actions[kept])
            state = _some(state, kept)
        return None

    def _branches(self, state: State, i: int, slot: int) -> tuple[np.ndarray, np.ndarray, State]:
        """All branches after a slot: the branch each comes from, the UAV's action, the state.

        Teammates that did what they did in the mission have the records that they had in it.
        """
        before, after = (self._team(t) for t in (slot, slot + 1))
        others = np.arange(len(before)) != i
        before = before.copy()
        # What a teammate asked for and did not get does not make it ask for a pad.
        before["latch"] &= ~before["overruled"]
        parts = []
        for first in range(0, len(state.missions), CHUNK):
            parents = np.repeat(np.arange(first, min(first + CHUNK, len(state.missions))), 5)
            part, actions = _some(state, parents), np.tile(np.arange(5), len(parents) // 5)
            part.uavs[:, others] = before[others]
            asked = np.tile(after["executed"], (len(parents), 1))
            asked[:, i] = actions
            self.stepper.state = part
            self.stepper.step(asked)
            same = np.ones(len(parents), bool)
            for name in ("x", "y", "slots_charging"):
                differs = (part.uavs[name] != after[name]) & others & before["active"]
                same &= ~differs.any(1)
            same &= ~(part.uavs[:, i]["end"] == BATTERY)
            part.uavs[:, others] = after[others]
            part.missions["active"] = 1 + (after["active"] & others).sum()
            same = np.nonzero(same)[0]
            parts.append((parents[same], actions[same], _some(part, same)))
        parents, actions, states = zip(*parts, strict=True)
        joined = State(*(np.concatenate(arrays) for arrays in zip(*states, strict=True)))
        return np.concatenate(parents), np.concatenate(actions), joined

    def _team(self, slot: int) -> np.ndarray:
        """The records of the team before a slot; after the mission, as at its end."""
        return self.states[min(slot, len(self.states) - 1)].uavs[0]

    def _kept(self, state: State, i: int) -> np.ndarray:
        """The branches to go on with: one of each kind, of those that may still live."""
        own, missions = state.uavs[:, i], state.missions
        order = np.nonzero(self._hopeful(own, missions))[0]
        order = order[np.argsort(-own["communications"][order], kind="stable")]
        if not len(order):
            return order
        keys = np.stack([own[name][order].astype(np.int64) for name in SAME], 1)
        return np.sort(order[np.unique(keys, axis=0, return_index=True)[1]])

    def _hopeful(self, own: np.ndarray, missions: np.ndarray) -> np.ndarray:
        """Whether the battery may last to a zone, for the quota, or until the horizon."""
        cost = missions["flight_cost"]
        if missions["has_failures"].any() or not cost.all():
            return own["active"].copy()
        slots = -(-own["battery"] // cost)
        reaches = slots > self._home[own["y"], own["x"]]
        most = own["communications"] + slots * missions["communication_slots"]
        lasts = missions["slot"] + slots >= missions["max_slots"]
        return own["active"] & (reaches | (most >= own["quota"]) | lasts)


def _copied(state: State) -> State:
    return State(*(array.copy() for array in state))


def _some(state: State, branches: np.ndarray) -> State:
    return State(*(array[branches] for array in state))


def _moves(steps: list[tuple[np.ndarray, np.ndarray]], branch: int) -> str:
    """The moves that lead to a branch of the last step."""
    moves = []
    for parents, actions in reversed(steps):
        moves.append(LETTERS[actions[branch]])
        branch = parents[branch]
    return "".join(reversed(moves))


def judged(
    scenario: Scenario | ScenarioSpace, policy: Any, seed: int, replication: int
) -> list[Finding]:
    """What the judge finds of each UAV of a mission whose battery ran empty."""
    replay = Replay(scenario, policy, seed, replication)
    return [
        replay.judge(int(i)) for i in np.nonzero(replay.states[-1].uavs[0]["end"] == BATTERY)[0]
    ]


def main(arguments: Sequence[str]) -> None:
    """Judge the mission that the command line names: SEA POLICY SEED REPLICATION KEY=VALUE..."""
    from dess.policies.registry import load
    from dess.reports.cli.options import load_space

    sea, policy, seed, replication, *settings = arguments
    space = ScenarioSpace.of(load_space(sea, settings))
    findings = judged(space, load(policy), int(seed), int(replication))
    print(*findings or ["no battery ran empty"], sep="\n")


if __name__ == "__main__":
    main(sys.argv[1:])
