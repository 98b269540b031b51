"""Speed of learning: ticks of the shipped configs, on one core and, if it is there, on CUDA."""

from collections.abc import Iterator

import pytest
import torch

from benchmarks.conftest import MISSIONS, SEED
from dess import load_scenario, policies, simulate_batch
from dess.policies.learner.checkpoint import new_training
from dess.policies.learner.config import config_names, load_config

DEVICES = ["cpu", *(["cuda"] if torch.cuda.is_available() else [])]


@pytest.fixture(autouse=True)
def _one_thread() -> Iterator[None]:
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


@pytest.mark.parametrize("device", DEVICES)
@pytest.mark.parametrize("name", config_names())
def test_ticks(benchmark, name: str, device: str) -> None:
    """A slot of all environments and one update, 20 of them per round; a whole tick for any sea."""
    config = load_config(name)
    training = new_training(config, torch.device(device))
    ticks = 20 if config.algorithm == "dqn" else 1
    if benchmark.enabled:  # otherwise one round shows that it runs
        training.run_ticks(ticks)
    benchmark.pedantic(training.run_ticks, args=(ticks,), rounds=10)


def test_decisions_of_ddqn(benchmark) -> None:
    """Missions of the learned policy, on one core."""
    scenario, policy = load_scenario("paper"), policies.load("ddqn")
    simulate_batch(scenario, policy, SEED, 10)
    records = benchmark.pedantic(
        simulate_batch, args=(scenario, policy, SEED, MISSIONS // 2), rounds=3
    )
    benchmark.extra_info["uav_slots"] = int(records.missions["uav_slots"].sum())
