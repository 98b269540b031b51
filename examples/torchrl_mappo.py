"""Train MAPPO with TorchRL: one policy for all UAVs, and a critic that sees what all of them see.

python examples/torchrl_mappo.py --slots 100000
dess evaluate --policy examples/torchrl_mappo.py:Mappo --policy greedy
"""

import argparse

import torch
from tensordict.nn import TensorDictModule
from torchrl.collectors import Collector
from torchrl.envs import PettingZooWrapper
from torchrl.modules import MLP, MaskedCategorical, MultiAgentMLP, ProbabilisticActor
from torchrl.objectives import ClipPPOLoss, ValueEstimators

import dess
from dess.policies.adapter import Adapter

WEIGHTS = "mappo.pt"
SEEN, LOGITS, MASK = ("uav", "observation"), ("uav", "logits"), ("uav", "action_mask")
NAMES = {"value": "state_value", "sample_log_prob": "log_prob"} | {
    name: name for name in ("action", "reward", "done", "terminated", "advantage", "value_target")
}


def network():
    """The policy: from the observation of a UAV to a value for each of its actions."""
    return MLP(out_features=5, num_cells=(128, 128))


def train(scenario, slots, per_batch=2000, seed=0):
    """Train for this number of mission slots; returns the network of the policy."""
    torch.manual_seed(seed)
    env = PettingZooWrapper(dess.parallel_env(scenario, seed, mask="info", ended="stay"))
    fleet, features = env.observation_spec[SEEN].shape
    policy = network()
    critic = MultiAgentMLP(features, 1, fleet, centralized=True, share_params=True)
    policy(env.reset()[SEEN])  # its first layer takes its size from the first observations
    actor = ProbabilisticActor(
        TensorDictModule(policy, [SEEN], [LOGITS]),
        in_keys={"logits": LOGITS, "mask": MASK},
        out_keys=[env.action_key],
        distribution_class=MaskedCategorical,
        return_log_prob=True,
        log_prob_key=("uav", "log_prob"),
    )
    values = TensorDictModule(critic, [SEEN], [("uav", "state_value")])
    loss = ClipPPOLoss(actor, values, normalize_advantage=True)
    loss.set_keys(**{key: ("uav", name) for key, name in NAMES.items()})
    loss.make_value_estimator(ValueEstimators.GAE, gamma=0.99, lmbda=0.95)
    optimizer = torch.optim.Adam(loss.parameters(), 3e-4)
    for batch in Collector(env, actor, frames_per_batch=per_batch, total_frames=slots):
        print(f"reward of a UAV per slot: {mean_reward(batch):.3f}")
        batch["next", "uav", "reward"] /= 100.0  # so that the critic's values are about 1
        with torch.no_grad():
            loss.value_estimator(batch, params=loss.critic_network_params)
        for rows in torch.cat([torch.randperm(len(batch)) for _ in range(4)]).split(250):
            losses = loss(batch[rows])
            sum(losses[f"loss_{part}"] for part in ("objective", "critic", "entropy")).backward()
            torch.nn.utils.clip_grad_norm_(loss.parameters(), 1.0)
            optimizer.step()
            optimizer.zero_grad()
    return policy


def mean_reward(batch):
    """The mean reward of a slot, without UAVs that have ended or that the fleet does not have."""
    acts = batch["uav", "info", "active"] > 0
    return batch["next", "uav", "reward"].squeeze(-1)[acts].mean()


class Mappo(Adapter):
    """The trained policy; it takes the best of the allowed actions."""

    def __init__(self, weights=WEIGHTS):
        self.network = network()
        self.network.load_state_dict(torch.load(weights))
        super().__init__("mappo", self.best, weights=weights)

    @torch.no_grad()
    def best(self, observations, masks):
        values = self.network(torch.as_tensor(observations))
        return values.masked_fill(~torch.as_tensor(masks), -torch.inf).argmax(1).numpy()


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--slots", type=int, default=100_000)
    trained = train(dess.load_scenario("paper"), parser.parse_args().slots)
    torch.save(trained.state_dict(), WEIGHTS)
