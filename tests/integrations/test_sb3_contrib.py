"""sb3-contrib: MaskablePPO on the rows of ``vector_env``, and its policy as one of dess."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
import policies
from dess import InputError, ScenarioSpace
from dess.state import HOVER

sb3_contrib = pytest.importorskip("sb3_contrib")
masking = pytest.importorskip("sb3_contrib.common.maskable.utils")
sb3 = pytest.importorskip("dess.integrations.sb3")

EXAMPLE = Path(__file__).parents[2] / "examples" / "sb3_maskable_ppo.py"
QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], quota=60, max_slots=25)
FLEET = ScenarioSpace.of(QUICK, uavs=3)
MISSIONS, ROWS = 4, 12


def harvest(scenario=QUICK, **options):
    """A small environment."""
    return sb3.SB3VecEnv(dess.vector_env(scenario, MISSIONS, **options))


def flown(env, steps: int, seed: int = 1) -> list[tuple]:
    """The masks, active rows, actions and outcomes of an untrained network, step by step."""
    model = sb3_contrib.MaskablePPO("MlpPolicy", env, n_steps=8, batch_size=8, seed=seed)
    env.seed(seed)
    observations, story = env.reset(), []
    for _ in range(steps):
        masks, active = masking.get_action_masks(env), env.env.state.uavs["active"].ravel()
        actions, _ = model.predict(observations, action_masks=masks)
        observations, *outcome = env.step(actions)
        story.append((masks, active, actions, observations, *outcome))
    return story


def test_agents_that_end() -> None:
    waits = 0
    for masks, active, actions, _, rewards, *_ in flown(harvest(FLEET), 60):
        assert (masks[~active] == np.eye(5, dtype=bool)[HOVER]).all()
        assert (actions[~active] == HOVER).all()
        assert not rewards[~active].any()
        assert masks[range(ROWS), actions].all()
        waits += (~active).sum()
    assert waits


@pytest.fixture(scope="module")
def trained(tmp_path_factory):
    """The example after one update, and the folder with its file."""
    folder = tmp_path_factory.mktemp("trained")
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(folder)
        return runpy.run_path(str(EXAMPLE))["train"](minutes=0, missions=4), folder


def test_training_step(trained, monkeypatch: pytest.MonkeyPatch) -> None:
    model, folder = trained
    assert model.num_timesteps == 32 * 12
    assert model._n_updates == 4
    monkeypatch.chdir(folder)
    policy = policies.load(f"{EXAMPLE}:MaskablePPOPolicy")
    paper = dess.load_scenario("paper")
    records = dess.simulate_batch(paper, policy, 0, 5)
    assert dess.simulate(paper, policy, 0, 3).metrics == records.missions[3]
    model.learn(1)
    model.save("maskable_ppo.zip")
    assert policies.load(f"{EXAMPLE}:MaskablePPOPolicy").weights != policy.weights
    Path("maskable_ppo.zip").unlink()
    with pytest.raises(InputError, match="cannot be loaded: FileNotFoundError"):
        policies.load(f"{EXAMPLE}:MaskablePPOPolicy")
