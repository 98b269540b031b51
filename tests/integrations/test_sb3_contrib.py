"""sb3-contrib: MaskablePPO on the rows of ``vector_env``, and its policy as one of dess."""

import runpy
from pathlib import Path

import numpy as np
import pytest

import dess
from dess import InputError, ScenarioSpace, policies
from dess.model.state import HOVER

sb3_contrib = pytest.importorskip("sb3_contrib")
masking = pytest.importorskip("sb3_contrib.common.maskable.utils")
sb3 = pytest.importorskip("dess.envs.integrations.sb3")

EXAMPLE = Path(__file__).parents[2] / "examples" / "sb3_maskable_ppo.py"
FLEET = ScenarioSpace.of(uavs=3, flying_time=[5, 30], quota=60, max_slots=25)
MISSIONS, ROWS = 4, 12


def test_contract(tmp_path, monkeypatch):
    """Its actions are allowed, UAVs that have ended hover, and the example is a policy."""
    env, waits = sb3.SB3VecEnv(dess.vector_env(FLEET, MISSIONS)), 0
    model = sb3_contrib.MaskablePPO("MlpPolicy", env, n_steps=8, batch_size=8, seed=1)
    env.seed(1)
    observations, forbidden = env.reset(), 0
    assert masking.is_masking_supported(env)
    for _ in range(60):
        masks, active = masking.get_action_masks(env), env.env.state.uavs["active"].ravel()
        actions, _ = model.predict(observations, action_masks=masks)
        observations, rewards, *_ = env.step(actions)
        assert masks[range(ROWS), actions].all()
        assert (masks[~active] == np.eye(5, dtype=bool)[HOVER]).all()
        assert not rewards[~active].any()
        waits, forbidden = waits + (~active).sum(), forbidden + (~masks[active]).sum()
    assert waits and forbidden

    monkeypatch.chdir(tmp_path)
    model = runpy.run_path(str(EXAMPLE))["train"](minutes=0, missions=4)
    assert (model.num_timesteps, model._n_updates) == (32 * 12, 4)
    policy, paper = policies.load(f"{EXAMPLE}:MaskablePPOPolicy"), dess.load_scenario("paper")
    records = dess.simulate_batch(paper, policy, 0, 5)
    assert dess.simulate(paper, policy, 0, 3).metrics == records.missions[3]
    model.learn(1)
    model.save("maskable_ppo.zip")
    assert policies.load(f"{EXAMPLE}:MaskablePPOPolicy").weights != policy.weights
    Path("maskable_ppo.zip").unlink()
    with pytest.raises(InputError, match="cannot be loaded: FileNotFoundError"):
        policies.load(f"{EXAMPLE}:MaskablePPOPolicy")
