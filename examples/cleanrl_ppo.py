"""PPO in a single file, in the style of CleanRL, on the rows of ``vector_env``.

A row is a UAV, and all rows share one network. It learns from the slots in which a UAV has acted
(``info["acted"]``), so not from rows that wait for the end of their mission. What follows the own
end of a UAV is worth nothing to it (``info["active"]``).
"""

import argparse

import torch
from torch import nn
from torch.distributions import Categorical

import dess
from policies.adapter import Adapter

SCENARIO = dess.load_scenario("paper")  # each mission draws its fleet of 1 to 3 UAVs
SLOTS, EPOCHS, BATCH, RATE, DISCOUNT, LAMBDA, CLIP = 32, 4, 1024, 1e-3, 0.99, 0.95, 0.2
SCALE = 0.05  # of the rewards, which are between -300 and 100


def evaluated(network, seen, mask) -> tuple[Categorical, torch.Tensor]:
    """The distribution of the allowed actions, and the value, for each row."""
    logits, value = network(seen).split([5, 1], -1)
    return Categorical(logits=torch.where(mask, logits, -1e9)), value[:, 0]


def advantages(rewards, goes_on, values, value) -> torch.Tensor:
    """Generalised advantage estimates (T, R); ``value`` (R,) is that of the next observation."""
    found, later = torch.empty_like(rewards), 0.0
    for t in reversed(range(len(rewards))):
        error = rewards[t] + DISCOUNT * goes_on[t] * value - values[t]
        found[t] = later = error + DISCOUNT * LAMBDA * goes_on[t] * later
        value = values[t]
    return found


def loss(network, seen, mask, action, log_chance, advantage, target) -> torch.Tensor:
    """The clipped loss of PPO plus the loss of the values."""
    chances, value = evaluated(network, seen, mask)
    ratio = (chances.log_prob(action) - log_chance).exp()
    advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage)
    return 0.5 * (value - target).square().mean() - gain.mean()


def train(steps: int, scenario=SCENARIO, missions: int = 64, seed: int = 1) -> nn.Module:
    """Train on at least so many rows; returns the network of five actions and the value."""
    torch.manual_seed(seed)
    env = dess.vector_env(scenario, missions, seed, guarded=True)
    hidden = nn.Linear(*env.single_observation_space.shape, 128), nn.Tanh()
    network = nn.Sequential(*hidden, nn.Linear(128, 128), nn.Tanh(), nn.Linear(128, 6))
    optimizer = torch.optim.Adam(network.parameters(), RATE)
    observation, info = env.reset()
    for _ in range(0, steps, SLOTS * env.num_envs):
        slots = []
        for _ in range(SLOTS):
            seen, mask = torch.tensor(observation), torch.tensor(info["action_mask"])
            with torch.no_grad():
                chances, value = evaluated(network, seen, mask)
            action = chances.sample()
            observation, reward, terminated, truncated, info = env.step(action.numpy())
            over = terminated | truncated
            arrays = info["acted"], SCALE * reward, info["active"] & ~over
            outcome = (torch.tensor(array, dtype=torch.float32) for array in arrays)
            slots.append((seen, mask, action, chances.log_prob(action), value, *outcome))
        *learned, values, acted, rewards, goes_on = map(torch.stack, zip(*slots, strict=True))
        with torch.no_grad():
            _, value = evaluated(network, torch.tensor(observation), mask)
        found = advantages(rewards, goes_on, values, value)
        learned = [part[acted > 0] for part in (*learned, found, found + values)]
        for _ in range(EPOCHS):
            for batch in torch.randperm(len(learned[0])).split(BATCH):
                optimizer.zero_grad()
                loss(network, *(part[batch] for part in learned)).backward()
                optimizer.step()
    return network


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=1_000_000, help="rows of the training")
    network = train(parser.parse_args().steps)

    @torch.no_grad()
    def act(observations, masks):
        return evaluated(network, *map(torch.tensor, (observations, masks)))[0].mode.numpy()

    records = dess.simulate_batch(SCENARIO, Adapter("ppo", act, guarded=True), 2, 100).missions
    print(f"collection ratio of 100 missions: {records['collection_ratio'].mean():.3f}")
