"""The replay memory: n-step returns through the ends of missions, and what may be drawn."""

from typing import NamedTuple

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from dess.envs.observations.states import empty_states
from dess.policies.learner.dqn import Batch, ReplayMemory

SLOT, ENVIRONMENT = 0, 1  # what the columns of the missions hold here


class Log(NamedTuple):
    """What happened in T slots of N environments of I UAVs: arrays (T, N, I)."""

    action: np.ndarray
    reward: np.ndarray
    acted: np.ndarray
    terminated: np.ndarray
    truncated: np.ndarray

    def memory(self, capacity: int) -> ReplayMemory:
        """A memory to which all of it was added; the states tell their slot and environment."""
        slots, num_envs, uavs = self.action.shape
        memory = ReplayMemory(capacity, num_envs, uavs, 1)
        for slot in range(slots):
            states = empty_states(num_envs, uavs, 1)
            states.missions[:, SLOT], states.missions[:, ENVIRONMENT] = slot, np.arange(num_envs)
            memory.add_slot(states, *(part[slot] for part in self))
        return memory

    def transition(
        self, slot: int, environment: int, uav: int, n_step: int, discount: float
    ) -> tuple[float, float, int]:
        """The n-step return from a slot on, the factor of the later value and its slot."""
        total, factor = 0.0, 1.0
        for n in range(slot, slot + n_step):
            if self.truncated[n, environment, uav]:
                return total, factor, n
            total += factor * self.reward[n, environment, uav]
            factor *= discount
            if self.terminated[n, environment, uav]:
                return total, 0.0, n + 1
        return total, factor, slot + n_step


def _lone(slots: int, **changed: bool) -> Log:
    """The log of one UAV in one environment, whose mission does not end."""
    shape = (slots, 1, 1)
    flags = {"acted": True, "terminated": False, "truncated": False} | changed
    return Log(np.zeros(shape, int), np.ones(shape), *(np.full(shape, f) for f in flags.values()))


def _drawn(memory: ReplayMemory, size: int, n_step: int, discount: float = 0.5) -> Batch:
    return memory.draw_batch(size, n_step, discount, np.random.default_rng(1))


# --- against plain Python ---


@st.composite
def _logs(draw: st.DrawFn) -> tuple[Log, int, int]:
    """Missions one after another in every environment; n, and a capacity that fits."""
    n_step, num_envs, uavs = (draw(st.integers(1, most)) for most in (5, 3, 3))
    slots = draw(st.integers(n_step + 2, 30))
    capacity = draw(st.integers(n_step + 2, 35))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    shape = (slots, num_envs, uavs)
    acted, terminated, truncated = (np.zeros(shape, np.bool_) for _ in range(3))
    for environment in range(num_envs):
        slot = 0
        while slot < slots:
            lengths = rng.integers(1, 8, rng.integers(1, uavs + 1))  # of the UAVs of a mission
            for uav, length in enumerate(lengths):
                acted[slot : slot + length, environment, uav] = True
                if slot + length <= slots:
                    ends = terminated if rng.random() < 0.7 else truncated
                    ends[slot + length - 1, environment, uav] = True
            slot += int(lengths.max()) + 1  # nobody acts in the last row
    log = Log(rng.integers(0, 5, shape), rng.normal(size=shape), acted, terminated, truncated)
    return log, n_step, capacity


@given(_logs(), st.floats(0.1, 1.0))
def test_all_that_can_be_drawn_is_drawn_and_right(world, discount):
    log, n_step, capacity = world
    slots, num_envs, uavs = log.action.shape
    oldest = max(0, slots - capacity)
    assume((log.acted & ~log.truncated)[oldest : slots - n_step].any())
    eligible = {
        (slot, environment, uav)
        for slot, environment, uav in np.argwhere(log.acted & ~log.truncated).tolist()
        if oldest <= slot < slots - n_step
    }
    batch = _drawn(log.memory(capacity), 30 * slots * num_envs * uavs, n_step, discount)
    assert batch.state.residual.shape == (capacity * num_envs, 1)
    places = np.column_stack([batch.state.missions[batch.rows], batch.uav])
    assert {(s, environment, uav) for s, environment, uav in places.tolist()} == eligible
    for row, (slot, environment, uav) in enumerate(places.tolist()):
        total, factor, later = log.transition(slot, environment, uav, n_step, discount)
        assert batch.reward[row] == pytest.approx(total, rel=1e-5, abs=1e-5)
        assert batch.discount[row] == pytest.approx(factor)
        assert batch.state.missions[batch.later[row]].tolist() == [later, environment]
        assert batch.action[row] == log.action[slot, environment, uav]


def test_too_few_slots_are_refused():
    for slots in range(4):
        with pytest.raises(ValueError, match=f"{slots} slots in memory"):
            _drawn(_lone(slots).memory(10), 8, 3)
    assert len(_drawn(_lone(4).memory(10), 8, 3).reward) == 8
    with pytest.raises(ValueError, match="9 slots in memory"):  # of which three are left
        _drawn(_lone(9).memory(3), 8, 3)
    with pytest.raises(ValueError, match="has a transition"):
        _drawn(_lone(6, truncated=True).memory(6), 4, 2)


@pytest.mark.parametrize(("capacity", "num_envs", "uavs", "nodes"), [(1, 1, 1, 1), (50, 8, 3, 25)])
def test_its_size_is_known_before_it_is_made(capacity, num_envs, uavs, nodes):
    memory = ReplayMemory(capacity, num_envs, uavs, nodes)
    taken = sum(array.nbytes for array in memory.arrays.values())
    assert ReplayMemory.count_bytes(capacity, num_envs, uavs, nodes) == taken
