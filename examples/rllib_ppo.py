"""Train one PPO policy for all UAVs with RLlib, with its module for action masks."""

import argparse

import ray
from ray.rllib.algorithms.ppo import PPO, PPOConfig
from ray.rllib.core.rl_module.rl_module import RLModuleSpec
from ray.rllib.examples.rl_modules.classes.action_masking_rlm import ActionMaskingTorchRLModule

import dess
from dess.envs.integrations.rllib import HarvestMultiAgentEnv


def learner(scenario: str, batch: int, seed: int = 0, **design: object) -> PPO:
    """A PPO learner that samples ``batch`` slots of missions for each update."""
    config = (
        PPOConfig()
        .environment(
            HarvestMultiAgentEnv, env_config={"scenario": dess.load_scenario(scenario, **design)}
        )
        .env_runners(num_env_runners=0)  # in this process; more of them sample side by side
        .multi_agent(policies={"uav"}, policy_mapping_fn=lambda agent, episode: "uav")
        .rl_module(rl_module_spec=RLModuleSpec(module_class=ActionMaskingTorchRLModule))
        .training(train_batch_size_per_learner=batch, minibatch_size=batch // 4, num_epochs=4)
        .debugging(seed=seed)
    )
    return config.build_algo()


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=20_000, help="slots of missions")
    steps = parser.parse_args().steps
    ray.init(num_cpus=1, include_dashboard=False)
    algorithm = learner("paper", batch=min(steps, 2000))
    for _ in range(max(1, steps // 2000)):
        result = algorithm.train()["env_runners"]
        print(f"{result['num_episodes']} missions, return {result['episode_return_mean']:.1f}")
    algorithm.stop()
    ray.shutdown()
