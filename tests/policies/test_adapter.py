"""A function of observations and masks flies as a policy of dess."""

import numpy as np
import pytest

import dess
from dess import InputError, ScenarioSpace
from dess.analysis.results.provenance import team_of
from dess.envs.observations.observer import KINDS
from dess.policies.adapter import Adapter

QUICK = ScenarioSpace.of(uavs=[1, 3], flying_time=[5, 30], quota=60, max_slots=40)


def arbitrary(observations, masks) -> np.ndarray:
    """Actions that depend on all that a row observes; some are illegal."""
    parts = observations.values() if isinstance(observations, dict) else [observations]
    rows = [part.reshape(len(masks), -1).astype(np.float64) for part in (*parts, masks)]
    sums = sum((row * np.sin(np.arange(row.shape[1]) + 1)).sum(1) for row in rows)
    return (np.abs(sums) * 1e4).astype(np.int64) % 5


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("guarded", [False, True])
def test_missions_are_those_of_the_environment(kind, guarded):
    policy = Adapter("arbitrary", arbitrary, kind, guarded)
    expected = dess.simulate_batch(QUICK, policy, 3, 12)
    env = dess.vector_env(QUICK, 2, seed=3, observation=kind, guarded=guarded)
    observations, info = env.reset()
    finished, illegal = 0, 0
    while finished < 5:
        actions = arbitrary(observations, info["action_mask"])
        illegal += (~info["action_mask"][range(env.num_envs), actions]).sum()
        observations, *_, info = env.step(actions)
        for row in np.flatnonzero(info.get("_final_info", [])):
            mission, number = info["final_info"], info["final_info"]["replication"][row]
            assert mission["reward"][row] == expected.missions["reward"][number]
            assert mission["uav"]["battery"][row] == expected.uavs["battery"][number, row % 3]
            finished += 1
    assert illegal
    assert dess.simulate(QUICK, policy, 3, 4).metrics == expected.missions[4]


def test_missions_with_other_zones_are_observed_with_their_own():
    spaces = [ScenarioSpace.of(QUICK, zone=zone) for zone in ((0, 0, 3, 3), (5, 5, 2, 4))]
    policy = Adapter("arbitrary", arbitrary)
    mixed = dess.simulate_batch(spaces * 4, policy, 1, 8).missions
    for number, space in enumerate(spaces):
        alone = dess.simulate_batch(space, policy, 1, 8).missions
        assert np.array_equal(mixed[number::2], alone[number::2])


REFUSED = {
    "observation: 'pixels' is unknown": {"act": arbitrary, "observation": "pixels"},
    r"float64 of shape \(\d,\)": {"act": lambda observations, masks: np.zeros(len(masks))},
    r"int64 of shape \(1,\); .*integers of shape": {"act": lambda *_: np.zeros(1, np.int64)},
    "5 is not an action": {"act": lambda observations, masks: np.full(len(masks), 5)},
}


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_not_allowed_is_refused_with_one_line(line):
    with pytest.raises(InputError, match=line):
        dess.simulate_batch(QUICK, Adapter("bad", **REFUSED[line]), 1, 2)


def test_results_tell_the_weights_apart(tmp_path):
    weights, code = tmp_path / "weights.bin", tmp_path / "own_policy_with_weights.py"
    code.write_text(
        "from dess.policies.adapter import Adapter\n"
        "class Own(Adapter):\n"
        "    def __init__(self):\n"
        f"        super().__init__('own', None, weights={str(weights)!r})\n"
    )
    members = []
    for content in (b"old", b"new", b"old"):
        weights.write_bytes(content)
        members += team_of(f"{code}:Own", run_files=True).members
    old, new, again = members
    assert old == again != new
    assert old.weights != new.weights and old.code == new.code
    assert Adapter("none", arbitrary).weights == ""
    weights.unlink()
    with pytest.raises(InputError, match="weights.bin: no such file"):
        team_of(f"{code}:Own", run_files=True)
