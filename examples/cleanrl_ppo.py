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

PAPER = dess.load_scenario("paper")  # each mission draws its fleet of 1 to 3 UAVs
SLOTS, EPOCHS, BATCH, RATE, DISCOUNT, LAMBDA, CLIP = 32, 4, 1024, 1e-3, 0.99, 0.95, 0.2
SCALE = 0.05  # of the rewards, which are between -300 and 100


def evaluated(network, seen, mask) -> tuple[Categorical, torch.Tensor]:
    """The distribution of the allowed actions, and the value, for each row."""
    logits, value = network(seen).split([5, 1], -1)
    return Categorical(logits=torch.where(mask, logits, -1e9)), value[:, 0]


def advantages(rewards, goes_on, values) -> torch.Tensor:
    """Generalised advantage estimates of all slots (T, R) but the last, which has 0."""
    found = torch.zeros_like(values)
    for t in reversed(range(len(values) - 1)):
        error = rewards[t] + DISCOUNT * goes_on[t] * values[t + 1] - values[t]
        found[t] = error + DISCOUNT * LAMBDA * goes_on[t] * found[t + 1]
    return found


def loss(network, seen, mask, action, log_chance, advantage, target) -> torch.Tensor:
    """The clipped loss of PPO plus the loss of the values."""
    chances, value = evaluated(network, seen, mask)
    ratio = (chances.log_prob(action) - log_chance).exp()
    advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    gain = torch.min(ratio * advantage, ratio.clamp(1 - CLIP, 1 + CLIP) * advantage)
    return 0.5 * (value - target).square().mean() - gain.mean()


def train(steps: int, scenario=PAPER, missions: int = 64, seed: int = 1) -> nn.Module:
    """Train on at least so many rows; returns the network of five actions and the value."""
    torch.manual_seed(seed)
    env = dess.vector_env(scenario, missions, seed, guarded=True)
    hidden = nn.Linear(*env.single_observation_space.shape, 128), nn.Tanh()
    network = nn.Sequential(*hidden, nn.Linear(128, 128), nn.Tanh(), nn.Linear(128, 6))
    optimizer = torch.optim.Adam(network.parameters(), RATE)
    (observation, info), slots = env.reset(), []
    for row in range(0, steps, SLOTS * env.num_envs):
        slots = slots[-1:]  # the last one, of which only the value has been used
        while len(slots) <= SLOTS:
            seen, mask = torch.tensor(observation), torch.tensor(info["action_mask"])
            with torch.no_grad():
                chances, value = evaluated(network, seen, mask)
            action = chances.sample()
            observation, reward, terminated, truncated, info = env.step(action.numpy())
            goes_on = info["active"] & ~(terminated | truncated)
            outcome = map(torch.tensor, (SCALE * reward, goes_on, info["acted"]))
            slots.append((seen, mask, action, chances.log_prob(action), value, *outcome))
        *learned, values, rewards, goes_on, acted = map(torch.stack, zip(*slots, strict=True))
        found = advantages(rewards, goes_on, values)
        acted[-1] = False
        learned = [part[acted] for part in (*learned, found, found + values)]
        print(f"{row:,} rows: mean reward {rewards[acted].mean() / SCALE:.2f}")
        for _ in range(EPOCHS):
            for batch in torch.randperm(len(learned[0])).split(BATCH):
                optimizer.zero_grad()
                loss(network, *(part[batch] for part in learned)).backward()
                optimizer.step()
    return network


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=1_000_000, help="rows of the training")
    train(parser.parse_args().steps)
