"""CleanRL is a collection of single files; the example is one in its style, for ``vector_env``."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import pytest

import dess
from dess import ScenarioSpace
from policies.adapter import Adapter

torch = pytest.importorskip("torch")

EXAMPLE = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "examples" / "cleanrl_ppo.py"))
)
QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], quota=60, max_slots=25)
FLEET = ScenarioSpace.of(QUICK, uavs=3)
MISSIONS, ROWS = 4, 12


@pytest.fixture
def batches(monkeypatch: pytest.MonkeyPatch) -> list[tuple]:
    """What the loop has learned from: the arguments of its loss, for each batch."""
    learned = []

    def loss(network, *parts):
        learned.append(parts)
        return EXAMPLE.loss(network, *parts)

    monkeypatch.setitem(EXAMPLE.train.__globals__, "loss", loss)
    return learned


def trained(**options):
    """The network after one update."""
    return EXAMPLE.train(**{"steps": 1, "scenario": QUICK, "missions": MISSIONS} | options)


def played(network, scenario: ScenarioSpace, slots: int):
    """The actions of a network in an environment, with what the environment returns."""
    env = dess.vector_env(scenario, MISSIONS, seed=1, guarded=True)
    observation, info = env.reset()
    for _ in range(slots):
        mask = info["action_mask"].copy()
        chances, _ = EXAMPLE.evaluated(network, *map(torch.tensor, (observation, mask)))
        action = chances.sample().numpy()
        observation, reward, terminated, truncated, info = env.step(action)
        yield mask, chances.probs.detach().numpy(), action, reward, terminated | truncated, info


def test_agents_that_end(batches: list[tuple]) -> None:
    network = trained(scenario=FLEET)
    seen, masks, taken, *_ = together(batches)
    assert masks[range(len(taken)), taken].all() and not masks.all()
    assert seen.any(1).all()  # a row that waits observes zeros
    assert len(seen) < EXAMPLE.EPOCHS * EXAMPLE.SLOTS * ROWS
    waits = 0
    for mask, chances, action, *_, info in played(network, FLEET, 60):
        assert not chances[~mask].any() and mask[range(ROWS), action].all()
        waits += (~info["active"]).sum()
    assert waits
    # What comes after the end of a UAV does not change what it has learned before.
    rewards, values = torch.rand(5, ROWS), torch.rand(5, ROWS)
    goes_on = torch.arange(5)[:, None] != 2
    found = EXAMPLE.advantages(rewards, goes_on, values)
    rewards[3:], values[3:] = 100.0, 50.0
    again = EXAMPLE.advantages(rewards, goes_on, values)
    assert torch.equal(found[:3], again[:3]) and not torch.equal(found[3:], again[3:])
    assert torch.equal(found[2], (rewards - values)[2])


def test_training_step() -> None:
    once, twice = trained(seed=3), trained(seed=3, steps=EXAMPLE.SLOTS * ROWS + 1)
    assert not same(once, twice)

    @torch.no_grad()
    def act(observations, masks):
        return EXAMPLE.evaluated(once, *map(torch.tensor, (observations, masks)))[0].mode

    policy = Adapter("ppo", act, guarded=True)
    records = dess.simulate_batch(QUICK, policy, 2, 5)
    assert dess.simulate(QUICK, policy, 2, 4).metrics == records.missions[4]


def same(one, other) -> bool:
    """Whether two networks have the same weights."""
    return all(map(torch.equal, one.parameters(), other.parameters()))


def together(batches: list[tuple]) -> list:
    """The rows of all batches."""
    return [torch.cat(part) for part in zip(*batches, strict=True)]
