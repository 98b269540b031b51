import pytest

from dess.policies.learner.dqn import DQNTraining
from tests.policies.learner.tiny import CPU, PHASES, one_thread, tiny


@pytest.fixture(autouse=True, scope="module")
def _one_thread():
    with one_thread():
        yield


@pytest.fixture(scope="module")
def training():
    """A training that has just begun."""
    training = DQNTraining(tiny(learning_starts=5, phases=[PHASES[1] | {"ticks": 3}]), CPU)
    training.run_ticks(2)
    return training
