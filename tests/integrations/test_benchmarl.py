"""BenchMARL: ``HarvestTask``, and ``examples/benchmarl_mappo.py``.

The environments of a task are those of TorchRL, and so are most of the checks.
"""

import json
import runpy
from pathlib import Path

import pytest

pytest.importorskip("benchmarl")

from dess.integrations.benchmarl import HarvestTask  # noqa: E402
from tests.integrations.test_torchrl import (  # noqa: E402
    SHORT,
    test_agents_that_end,
    test_step,
    torch,
)

__all__ = ["test_agents_that_end", "test_step"]
EXAMPLE = Path(__file__).parents[2] / "examples" / "benchmarl_mappo.py"


@pytest.fixture
def make():
    """Makes the environment for a scenario and a seed."""

    def made(scenario, seed=1):
        return HarvestTask("paper", {"scenario": scenario}).get_env_fun(1, False, seed, "cpu")()

    return made


def trained(out, algorithm, seed=0):
    """An experiment that has run two iterations, and the returns of its evaluation."""
    run = runpy.run_path(str(EXAMPLE))["experiment"](SHORT, algorithm, 96, out, 48, seed)
    run.run()
    results = json.loads((run.folder_name / f"{run.name}.json").read_text())
    (steps,) = results["dess"]["paper"][algorithm].values()
    return run, steps["step_0"]["return"]


@pytest.mark.parametrize("algorithm", ["mappo", "iql"])
def test_training_step(tmp_path, monkeypatch, algorithm):
    monkeypatch.chdir(tmp_path)
    run, returns = trained(tmp_path / "out", algorithm)
    assert run.total_frames == 96 and len(returns) == 4
    assert set(run.action_mask_spec["uav"].keys()) == {"action_mask"} and "state" in run.state_spec
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    mission = run.test_env.rollout(50, run.policy)["uav"]
    assert mission["action_mask"].gather(-1, mission["action"].unsqueeze(-1)).all()


def test_environments_of_an_experiment_fly_different_missions():
    make_one = HarvestTask("paper", {"scenario": SHORT}).get_env_fun(2, False, 1, "cpu")
    one, other = (make_one().reset()["uav", "observation"] for _ in range(2))
    assert not torch.equal(one, other)
