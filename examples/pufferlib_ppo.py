"""Train PPO's loss on PufferLib's native environment, with its policy and sampling."""

import argparse

import torch
from pufferlib.cleanrl import Policy

import dess
from dess.envs.integrations.pufferlib import HarvestPufferEnv, MaskedPolicy


def train(env: HarvestPufferEnv, steps: int, seed: int = 0, gamma: float = 0.99) -> Policy:
    """The policy after about ``steps`` rows: batches of 16 slots, four passes over each."""
    torch.manual_seed(seed)
    policy = Policy(MaskedPolicy(env))
    adam = torch.optim.Adam(policy.parameters(), lr=1e-3)
    env.reset(seed)
    for _ in range(max(1, steps // (16 * env.num_agents))):
        slots = []
        for _ in range(16):
            seen, acts = torch.tensor(env.observations), torch.tensor(env.masks)
            with torch.no_grad():
                action, logprob, _, value = policy(seen)
            env.step(action.numpy())
            over = torch.tensor(env.terminals | env.truncations).float()
            slots.append((seen, acts, action, logprob, value, torch.tensor(env.rewards), over))
        later = policy.get_value(torch.tensor(env.observations)).detach()
        returns, gain = [], later * torch.tensor(env.masks)  # a UAV that has ended gains no more
        for *_, reward, over in reversed(slots):
            gain = reward + gamma * (1 - over) * gain
            returns.insert(0, gain)
        parts = (torch.cat(part) for part in zip(*slots, strict=True))
        seen, acts, action, old, value, *_ = parts
        gain = torch.cat(returns)
        advantage = (gain - value)[acts] / (gain - value)[acts].std()
        for _ in range(4):
            _, logprob, entropy, value = policy(seen[acts], action[acts])
            ratio = (logprob - old[acts]).exp()
            clipped = torch.minimum(ratio * advantage, ratio.clamp(0.8, 1.2) * advantage)
            loss = (value - gain[acts]).pow(2).mean() / 2 - clipped.mean() - entropy.mean() / 100
            adam.zero_grad()
            loss.backward()
            adam.step()
    return policy


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=100_000, help="slots of all UAVs together")
    train(HarvestPufferEnv(dess.load_scenario("paper"), num_envs=32), parser.parse_args().steps)
