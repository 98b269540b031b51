"""CleanRL is a collection of single files; the example is one in its style, for ``vector_env``."""

import runpy
from pathlib import Path
from types import SimpleNamespace

import pytest

import dess
from dess import ScenarioSpace
from dess.policies.adapter import Adapter

torch = pytest.importorskip("torch")

EXAMPLE = SimpleNamespace(
    **runpy.run_path(str(Path(__file__).parents[2] / "examples" / "cleanrl_ppo.py"))
)
QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], quota=60, max_slots=25)
FLEET = ScenarioSpace.of(QUICK, uavs=3)
MISSIONS, ROWS = 4, 12


def test_contract(monkeypatch):
    """The loop learns from allowed actions of UAVs that act, and its network is a policy."""
    learned = []

    def loss(network, *parts):
        learned.append(parts)
        return EXAMPLE.loss(network, *parts)

    monkeypatch.setitem(EXAMPLE.train.__globals__, "loss", loss)
    network = EXAMPLE.train(steps=1, scenario=FLEET, missions=MISSIONS, seed=3)
    seen, masks, actions, *_ = (torch.cat(part) for part in zip(*learned, strict=True))
    assert seen.any(1).all()  # a row that waits observes zeros
    assert len(seen) > EXAMPLE.EPOCHS * EXAMPLE.SLOTS * MISSIONS
    assert len(seen) < EXAMPLE.EPOCHS * EXAMPLE.SLOTS * ROWS
    assert set(actions.tolist()) == {0, 1, 2, 3, 4}
    assert masks[range(len(actions)), actions].all() and not masks.all()

    @torch.no_grad()
    def act(observations, masks):
        return EXAMPLE.evaluated(network, *map(torch.tensor, (observations, masks)))[0].mode

    policy = Adapter("ppo", act, guarded=True)
    records = dess.simulate_batch(QUICK, policy, 2, 5)
    assert dess.simulate(QUICK, policy, 2, 4).metrics == records.missions[4]
