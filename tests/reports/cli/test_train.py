"""``dess train``: what it writes, what it refuses, and that Ctrl-C loses nothing."""

import json
import re
import signal
import sys
from pathlib import Path

import pytest
import tomli_w
import torch

from dess import policies
from dess.base.files import memory
from dess.policies.learner import session
from dess.policies.learner.checkpoint import load_training
from dess.policies.learner.config import load_config
from dess.policies.learner.dqn import DQNTraining
from dess.policies.learner.ppo import ProximalTraining
from dess.reports.cli import train
from tests.analysis.small import files_of
from tests.policies.learner.tiny import (
    CPU,
    ON_SEAS,
    PHASES,
    TINY,
    assert_same,
    one_thread,
    write_config,
)

SHORT = {
    "phases": [phase | {"ticks": 10} for phase in PHASES],
    "learning_starts": 20,
    "evaluate_every": 5,
}


@pytest.fixture(autouse=True, scope="module")
def _one_thread():
    with one_thread():
        yield


@pytest.fixture
def dess(dess, tmp_path, monkeypatch):
    """Runs the command in a folder with a config: exit code, stdout, stderr."""
    write_config(tmp_path, **SHORT)
    # TensorBoard takes its time; all works without.
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    return dess


def test_a_training_leaves_a_policy_that_flies(dess, tmp_path):
    code, out, err = dess("train", "tiny.toml", "--out", "runs/tiny", "--device", "cpu")
    assert code == 0
    assert out.startswith("runs/tiny: 20 updates, ")
    assert "best product 0." in out
    assert "replay memory: " in err
    assert "curves: tensorboard --logdir runs/tiny/tensorboard\n" in err
    names = [
        "checkpoint.safetensors",
        "config.json",
        "integers.safetensors",
        "model.safetensors",
        "training.parquet",
    ]
    assert list(files_of(tmp_path / "runs" / "tiny")) == names
    assert policies.load("runs/tiny").name == "tiny"

    code, out, _ = dess("evaluate", "--policy", "runs/tiny", "--missions", 5, "--json")
    assert code == 0
    (row,) = json.loads(out)
    assert (row["policy"], row["missions"]) == ("runs/tiny", 5)
    assert 0 <= row["collection_ratio"]["mean"] <= 1
    arguments = ("--policy", "runs/tiny,greedy", "--set", "uavs=2", "--json")
    code, out, _ = dess("simulate", *arguments)
    assert code == 0
    assert len(json.loads(out)["uavs"]) == 2


def test_the_seed_can_be_set(dess):
    assert dess("train", "tiny.toml", "--out", "a", "--seed", 5)[0] == 0
    assert dess("train", "tiny.toml", "--out", "b")[0] == 0
    weights = [policies.load(name).weights for name in ("a", "b")]
    assert weights[0] != weights[1]


# Arguments, and what the line on stderr must name.
BAD = {
    "train tiny.toml --out out --device cuda": ["no CUDA device", "auto, cpu"],
    "evaluate --policy begun": [
        "begun is a training that has no weights yet",
        "again with --resume",
    ],
}


@pytest.mark.parametrize("arguments", BAD)
def test_bad_input_gets_one_line_and_changes_nothing(
    arguments, dess, refusal, tmp_path, monkeypatch
):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    (tmp_path / "begun").mkdir()
    (tmp_path / "begun" / "checkpoint.safetensors").write_text("")
    line = refusal(*arguments.split(" "))
    for part in BAD[arguments]:
        assert part in line


def test_a_training_that_diverges_ends_with_one_line(dess, tmp_path):
    write_config(tmp_path, **SHORT, loss="mse", reward_scale=1e6, gradient_norm=1e6)
    large = ("--set", "reward_data=1e9", "--set", "initial_data=1e9")
    code, out, err = dess("train", "tiny.toml", "--out", "out", *large)
    assert (code, out) == (1, "")
    line = err.splitlines()[-1]
    assert line.startswith("dess: error: the training diverged: its ")
    assert "Traceback" not in err
    assert "Warning" not in err


def test_a_large_training_has_to_be_confirmed(dess, monkeypatch):
    monkeypatch.setattr(memory, "available_memory", lambda: 10**6)
    code, out, err = dess("train", "tiny.toml", "--out", "out")
    assert (code, out) == (2, "")
    assert err.startswith("dess: error: training tiny: about 0.0 GiB of memory, ")
    assert err.endswith(" or --yes\n")
    assert not Path("out").exists()
    assert dess("train", "tiny.toml", "--out", "out", "--yes")[0] == 0


BEGUN = "any sea, begun with a policy"
KINDS = {"double DQN": (), "any sea": (), BEGUN: ("--from", "begun")}
ENDS = [("double DQN", False), ("double DQN", True)]
ENDS += [pytest.param("any sea", True, marks=[pytest.mark.slow, pytest.mark.brief])]
ENDS += [pytest.param(BEGUN, True, marks=pytest.mark.slow)]


@pytest.mark.parametrize(("kind", "is_long"), ENDS)
def test_ctrl_c_keeps_all_ticks_or_all_before_a_long_one(
    kind, is_long, dess, tmp_path, monkeypatch
):
    settings = TINY | SHORT if kind == "double DQN" else ON_SEAS
    (tmp_path / "tiny.toml").write_text(tomli_w.dumps(settings), "utf-8")
    arguments = ("train", "tiny.toml", "--device", "cpu", *KINDS[kind], "--out")
    if "--from" in arguments:
        assert dess("train", "tiny.toml", "--device", "cpu", "--seed", 7, "--out", "begun")[0] == 0
    assert dess(*arguments, "undisturbed")[0] == 0
    learn = DQNTraining._learn_in_tick if kind == "double DQN" else ProximalTraining._learn_in_tick

    def interrupted(training, share):
        learn(training, share)
        if training.tick == 6:  # on seas, too, all networks learn by then
            signal.raise_signal(signal.SIGINT)
            while is_long:  # until the tick is given up
                pass

    with monkeypatch.context() as patch:
        if is_long:
            patch.setattr(session, "TICK_END", 0.0)
        patch.setattr(DQNTraining, "_learn_in_tick", interrupted)
        patch.setattr(ProximalTraining, "_learn_in_tick", interrupted)
        code, out, err = dess(*arguments, "out")
    assert (code, out) == (130, "")
    config = load_config("tiny.toml")
    stopped = load_training(tmp_path / "out" / "checkpoint.safetensors", config, CPU)
    assert stopped.tick == (6 if is_long else 7)
    assert policies.load("out").name == "tiny"
    assert ("the last checkpoint is kept" if is_long else "at tick 7 of ") in err
    assert "continue with dess train tiny.toml --out out " in err
    assert not [name for name in files_of(tmp_path) if name.endswith(".tmp")]
    assert dess(*arguments, "out", "--resume")[0] == 0
    paths = [tmp_path / name / "checkpoint.safetensors" for name in ("out", "undisturbed")]
    assert_same(*(load_training(path, config, CPU) for path in paths))


def test_a_training_says_how_long_it_will_take_here(dess, monkeypatch):
    monkeypatch.setattr(train, "MEASURED", 0.0)
    _, _, err = dess("train", "tiny.toml", "--out", "out")
    assert re.search(r"on this machine: [\d.]+ m?s a tick, about \d+ seconds to go\n", err)
