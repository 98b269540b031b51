"""Train MADDPG with AgileRL, whose tournament keeps the better of a population of two."""

import argparse

import torch
from agilerl.algorithms import MADDPG
from agilerl.components import ReplayBuffer
from agilerl.hpo.mutation import Mutations
from agilerl.hpo.tournament import TournamentSelection
from agilerl.training.train_multi_agent_off_policy import train_multi_agent_off_policy
from agilerl.vector import PzDummyVecEnv

import dess
from dess.envs.parallel import HarvestEnv


def train(env: HarvestEnv, steps: int, seed: int = 0) -> list[MADDPG]:
    """The population after ``steps`` mission slots; the UAVs share an actor, for they share a name.

    Args:
        env: An environment with ``mask="info"``, where AgileRL reads it, and ``ended="stay"``.
        steps: Mission slots in all.
        seed: Seed of the networks and of the missions.
    """
    torch.manual_seed(seed)
    env.reset(seed=seed)
    spaces = [[of(agent) for agent in env.possible_agents]
              for of in (env.observation_space, env.action_space)]  # fmt: skip
    population = [
        MADDPG(*spaces, agent_ids=env.possible_agents, index=i, batch_size=64, learn_step=32)
        for i in range(2)
    ]
    population, _ = train_multi_agent_off_policy(
        PzDummyVecEnv(env), "dess", "MADDPG", population, ReplayBuffer(max_size=10_000),
        max_steps=steps // 2, evo_steps=max(steps // 8, 64), verbose=False,
        selection_strategy=TournamentSelection(2, elitism=True, population_size=2),
        mutation=Mutations(0.4, 0, 0, 0.2, 0, 0.4, rand_seed=seed),
    )  # fmt: skip
    return population


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=20_000, help="mission slots")
    env = dess.parallel_env(dess.load_scenario("paper"), mask="info", ended="stay")
    for agent in train(env, parser.parse_args().steps):
        print(f"candidate {agent.index}: fitness {agent.fitness}")
