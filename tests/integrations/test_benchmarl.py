"""BenchMARL: ``HarvestTask``, and ``examples/benchmarl_mappo.py``.

The environments of a task are those of TorchRL.
"""

import json
import runpy
from pathlib import Path

import pytest

import dess

pytest.importorskip("benchmarl")

from benchmarl.experiment.callback import Callback  # noqa: E402

from dess.envs.integrations.benchmarl import HarvestTask  # noqa: E402
from dess.model.state import ACTIVE  # noqa: E402

EXAMPLE = Path(__file__).parents[2] / "examples" / "benchmarl_mappo.py"
SHORT = dess.load_scenario("paper", max_slots=12)


@pytest.mark.parametrize("algorithm", ["mappo", "iql"])
def test_contract(tmp_path, monkeypatch, algorithm):
    """Environments fly missions of their own; the example chooses only what the mask allows."""
    make = HarvestTask("paper", {"scenario": SHORT}).get_env_fun(2, False, 1, "cpu")
    one, other = (make().reset()["uav", "observation"] for _ in range(2))
    assert not one.equal(other)

    monkeypatch.chdir(tmp_path)
    run = runpy.run_path(str(EXAMPLE))["experiment"](SHORT, algorithm, 96, tmp_path / "out", 48, 0)
    run.run()
    results = json.loads((run.folder_name / f"{run.name}.json").read_text())
    (steps,) = results["dess"]["paper"][algorithm].values()
    assert run.total_frames == 96 and len(steps["step_0"]["return"]) == 4
    assert set(run.action_mask_spec["uav"].keys()) == {"action_mask"} and "state" in run.state_spec
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    mission = run.test_env.rollout(50, run.policy)["uav"]
    assert mission["action_mask"].gather(-1, mission["action"].unsqueeze(-1)).all()


class Keep(Callback):
    """Keeps what BenchMARL has collected and evaluated last."""

    def on_batch_collected(self, batch):
        self.after = batch["next"].clone()

    def on_evaluation_end(self, rollouts):
        self.rollouts = [rollout.clone() for rollout in rollouts]


def test_means_leave_out_uavs_that_a_smaller_fleet_lacks(tmp_path):
    """In training and evaluation; BenchMARL's own mean counts them as 0."""
    run = runpy.run_path(str(EXAMPLE))["experiment"](SHORT, "mappo", 96, tmp_path / "out", 48, 0)
    kept = Keep()
    run.callbacks.append(kept)
    logged = {}
    log = run.logger.log
    run.logger.log = lambda values, step: (logged.update(values), log(values, step=step))
    run.run()
    flown, absent = [], []
    for rollout in kept.rollouts:
        fleet = int((rollout["uav", "info", "active"][0] > 0).sum())
        returns = rollout["next", "uav", "reward"].sum(0).squeeze(-1).tolist()
        flown += returns[:fleet]
        absent += returns[fleet:]
    assert flown and absent and not any(absent)
    own = logged["eval/reward/episode_reward_mean"]
    assert own == pytest.approx(sum(flown) / len(flown + absent), rel=1e-4)
    of_fleet = logged["eval/reward/episode_reward_of_fleet_mean"]
    assert of_fleet == pytest.approx(sum(flown) / len(flown), rel=1e-4)
    over = kept.after["done"].squeeze(-1)
    returns = kept.after["uav", "episode_reward"].squeeze(-1)[over]
    has = kept.after["uav", "info", "end"][over] != ACTIVE
    assert 0 < has.sum() < has.numel()
    found = logged["collection/reward/episode_reward_of_fleet_mean"]
    assert found == pytest.approx(returns[has].mean().item(), rel=1e-4)
