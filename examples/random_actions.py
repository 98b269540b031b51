"""Run one mission of the environment with random legal actions and print totals."""

import dess

env = dess.parallel_env(dess.load_scenario("paper"))
observations, _ = env.reset(seed=1)
rewards = dict.fromkeys(env.agents, 0.0)
while env.agents:
    masks = {agent: observations[agent]["action_mask"] for agent in env.agents}
    actions = {agent: env.action_space(agent).sample(mask) for agent, mask in masks.items()}
    observations, gained, *_ = env.step(actions)
    for agent, reward in gained.items():
        rewards[agent] += reward
record = env.record()
print(f"{record.slots} slots, {record.collected:.1f} of {record.initial:.1f} data units collected")
print(", ".join(f"{agent}: reward {reward:.1f}" for agent, reward in rewards.items()))
