"""Train PPO of stable-baselines3, which has no masks of actions, and fly some missions with it.

PPO learns from its rewards which actions are not allowed: the safety controller overrules a move
off the grid, so the UAV stays in its cell and loses a point. The actions of a UAV that charges, or
that has ended and waits for its team, are ignored. ``sb3_maskable_ppo.py`` uses the masks.
"""

import argparse

from stable_baselines3 import PPO
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecNormalize

import dess
from dess.envs.integrations.sb3 import SB3VecEnv

SCENARIO = dess.load_scenario("paper")  # each mission draws its fleet of 1 to 3 UAVs


def train(steps: int, missions: int = 64) -> PPO:
    """Train on at least so many agent steps, with the seed 1 for the missions too."""
    env = SB3VecEnv(dess.vector_env(SCENARIO, missions))
    scaled = VecNormalize(env, norm_obs=False)  # the rewards, which are between -300 and 100
    model = PPO("MlpPolicy", scaled, n_steps=32, batch_size=1024, n_epochs=4, seed=1)
    return model.learn(steps)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=1_000_000, help="agent steps of the training")
    model = train(parser.parse_args().steps)
    others = SB3VecEnv(dess.vector_env(SCENARIO, num_envs=50, seed=2))
    mean, deviation = evaluate_policy(model, others, n_eval_episodes=150)
    print(f"{model.num_timesteps:,} steps; reward of a UAV: {mean:.1f} (deviation {deviation:.1f})")
