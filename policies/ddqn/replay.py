"""The replay memory, shared by all UAVs: compact states in the order of time.

The memory is a ring buffer of T slots x N environments. Row t of an environment has the state
before the slot, and the action and reward of each UAV. The state after n slots is in row t + n, so
every state is stored only once, for every n. Each mission has a last row after its end, in which no
UAV acts.
"""

from typing import Any, NamedTuple

import numpy as np

from dess.code.kernels import kernel
from dess.errors import InputError
from dess.observations.states import CompactStates, empty_states


class Batch(NamedTuple):
    """A minibatch of B n-step transitions.

    Attributes:
        state: The compact states of the memory.
        rows: (B,) indices in ``state`` of the states in which the UAVs acted.
        later: (B,) indices in ``state`` of the states after n slots, or at the end of the UAV's
            mission.
        uav: (B,) index of the UAV.
        action: (B,) action of the UAV.
        reward: (B,) float32, discounted sum of the UAV's rewards until the later state.
        discount: (B,) float32, factor of the later state's value; 0 if the UAV terminated.
    """

    state: CompactStates
    rows: np.ndarray
    later: np.ndarray
    uav: np.ndarray
    action: np.ndarray
    reward: np.ndarray
    discount: np.ndarray


class ReplayMemory:
    """A ring buffer of the last T slots of N environments.

    Attributes:
        capacity: T [mission slots per environment].
        count: Number of slots added so far; the last ``capacity`` of them are stored.
        arrays: The arrays of the memory, by name.
    """

    def __init__(self, capacity: int, num_envs: int, uavs: int, nodes: int):
        self.capacity, self.num_envs, self.uavs = capacity, num_envs, uavs
        self.count = 0
        self._states = empty_states(capacity * num_envs, uavs, nodes)
        kinds: dict[str, type] = {"action": np.int8, "reward": np.float32}
        kinds |= dict.fromkeys(("acted", "terminated", "truncated"), np.bool_)
        shape = (capacity * num_envs, uavs)
        outcomes: dict[str, Any] = {name: np.zeros(shape, kind) for name, kind in kinds.items()}
        self.arrays = self._states._asdict() | outcomes

    @staticmethod
    def bytes_for(capacity: int, num_envs: int, uavs: int, nodes: int) -> int:
        """The size of such a memory [bytes]."""
        one = ReplayMemory(1, 1, uavs, nodes)
        return capacity * num_envs * sum(array.nbytes for array in one.arrays.values())

    def add(self, states: CompactStates, *outcome: np.ndarray) -> None:
        """Add one slot of all environments.

        Args:
            states: The states before the slot.
            *outcome: (N, I) arrays: actions, rewards, and which UAVs acted, terminated and were
                truncated.
        """
        first = self.count % self.capacity * self.num_envs
        here = slice(first, first + self.num_envs)
        with np.errstate(over="ignore"):  # an infinite reward ends the training with a message
            for ring, new in zip(self.arrays.values(), (*states, *outcome), strict=True):
                ring[here] = new
        self.count += 1

    def sample(
        self, size: int, n_step: int, discount: float, generator: np.random.Generator
    ) -> Batch:
        """Draw transitions uniformly, with replacement, among those whose later state is stored.

        The last slot of a truncated mission is excluded.

        Args:
            size: Number of transitions (B).
            n_step: n of the n-step return.
            discount: Discount factor gamma per slot.
            generator: Random generator of the draw.

        Raises:
            InputError: If fewer than ``n_step + 1`` slots have been added, or hardly any of them
                holds a transition.
        """
        newest = self.count - 1
        oldest = max(0, self.count - self.capacity)
        if newest - oldest < n_step:
            raise InputError(
                f"replay: {self.count} slots in memory are too few for {n_step}-step returns; "
                "allowed: more than n_step"
            )
        rows: list[np.ndarray] = []
        uavs: list[np.ndarray] = []
        missing = size
        while missing > 0:
            slot = generator.integers(oldest, newest - n_step + 1, 2 * missing + 16)
            row = slot % self.capacity * self.num_envs + generator.integers(
                0, self.num_envs, len(slot)
            )
            uav = generator.integers(0, self.uavs, len(slot))
            good = self.arrays["acted"][row, uav] & ~self.arrays["truncated"][row, uav]
            keep = np.nonzero(good)[0][:missing]
            if not len(keep) and len(rows) > 1000:
                raise InputError(
                    "replay: hardly any slot of the memory has a transition; allowed: a scenario "
                    "whose missions last more than a slot"
                )
            rows.append(row[keep])
            uavs.append(uav[keep])
            missing -= len(keep)
        row, uav = np.concatenate(rows), np.concatenate(uavs)
        later, reward = np.empty(size, np.int64), np.empty(size, np.float32)
        factor = np.empty(size, np.float32)
        known = (self.arrays[name] for name in ("reward", "terminated", "truncated"))
        _returns(row, uav, n_step, discount, self.num_envs, *known, later, reward, factor)
        action = self.arrays["action"][row, uav].astype(np.int64)
        return Batch(self._states, row, later, uav, action, reward, factor)


@kernel
def _returns(
    rows, uavs, n_step, discount, num_envs, rewards, terminated, truncated, later, total, factor
):
    """Compute n-step returns, which end when the UAV's mission ends.

    Truncation does not count as termination: the return then ends before the truncated slot, with
    the value of the last state in which the UAV chose an action.
    """
    size = len(rewards)
    for b in range(len(rows)):
        row, i = rows[b], uavs[b]
        value, weight = 0.0, 1.0
        for _ in range(n_step):
            if truncated[row, i] or weight == 0.0:
                break
            value += weight * rewards[row, i]
            weight = 0.0 if terminated[row, i] else weight * discount
            row = (row + num_envs) % size
        later[b], total[b], factor[b] = row, value, weight
