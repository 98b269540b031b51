"""BenchMARL: ``HarvestTask``, and ``examples/benchmarl_mappo.py``.

The environments of a task are those of TorchRL.
"""

import json
import runpy
from pathlib import Path

import pytest

import dess

pytest.importorskip("benchmarl")

from dess.envs.integrations.benchmarl import HarvestTask  # noqa: E402

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
