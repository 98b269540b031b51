"""Folders of trained policies: what is written comes back, and nothing else is read."""

import hashlib
import json
import random
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors.torch import load_file, save_file

from dess.model.batch import simulate_batch
from dess.policies.learner import trained
from dess.policies.learner.description import CONFIG, MODEL, read_description
from dess.policies.learner.dqn import DQNTraining
from dess.policies.learner.trained import INTEGERS, load_policy, load_teacher, save_policy
from dess.policies.registry import TRAINED
from tests.analysis.small import files_of
from tests.policies.learner.tiny import CPU, Killed, kill_after, refusal_of, tiny


@pytest.fixture
def folder(training, tmp_path):
    """The folder of its policy."""
    path = tmp_path / "policy"
    save_policy(path, training.learner.online.state_dict(), training.config, training.space)
    return path


def test_a_policy_knows_the_ranges_of_its_training(folder, training):
    ranges, space = read_description(folder).ranges, training.space
    assert ranges["uavs"] == [*space.uavs] and ranges["quota"] == [space.quota, space.quota]
    assert ranges == training.ranges


def _refusal(folder: Path) -> str:
    """The one line with which a policy is refused."""
    return refusal_of(load_policy, folder)


def _described(folder: Path, **changes: Any) -> None:
    """Change the description of a policy; None leaves a key out."""
    content = json.loads((folder / CONFIG).read_text("utf-8")) | changes
    kept = {key: value for key, value in content.items() if value is not None}
    (folder / CONFIG).write_text(json.dumps(kept), "utf-8")


def _forged(folder: Path, tensors: dict[str, torch.Tensor]) -> None:
    """Write other weights with their checksum, as somebody does who wants to be believed."""
    save_file(tensors, folder / MODEL)
    _described(folder, model_sha256=[hashlib.sha256((folder / MODEL).read_bytes()).hexdigest()])


KINDS: list[dict[str, Any]] = [{}, {"guard": False, "precision": "bfloat16"}]
KINDS += [{"observation": "maps"}]


@pytest.mark.parametrize("changes", KINDS, ids=str)
def test_a_policy_comes_back_as_it_was(changes, tmp_path):
    training = DQNTraining(tiny(**changes), CPU)
    weights = training.learner.online.state_dict()
    save_policy(tmp_path / "new" / "policy", weights, training.config, training.space)
    assert sorted(files_of(tmp_path / "new" / "policy")) == [CONFIG, MODEL]
    loaded, saved = load_policy(tmp_path / "new" / "policy"), training.make_policy(weights)
    assert (loaded.name, loaded.guarded) == ("tiny", training.config.guard)
    for part in loaded.layout._fields:
        assert np.array_equal(getattr(loaded.layout, part), getattr(saved.layout, part))
    missions = 2 if training.config.observation == "maps" else 10
    flights = [simulate_batch(training.space, policy, 71, missions) for policy in (loaded, saved)]
    assert flights[0].missions.tobytes() == flights[1].missions.tobytes()
    assert flights[0].uavs.tobytes() == flights[1].uavs.tobytes()


ROUNDED, NAN = torch.zeros(1, dtype=torch.bfloat16), torch.full((5,), torch.nan)
HUGE = torch.tensor([0.0, 3e38, 0.0, 0.0, 0.0])
WHOLE = torch.zeros(1, dtype=torch.int64)
DAMAGE: dict[str, tuple[str, torch.Tensor | None]] = {
    "value.bias is float32 [2]; allowed: float32 [1]": ("value.bias", torch.zeros(2)),
    "value.bias is int64 [1]; allowed: float32 [1]": ("value.bias", WHOLE),
    "damaged: numbers of the type 'BF16'; allowed: a safetensors file": ("value.bias", ROUNDED),
    "'value.bias' is missing": ("value.bias", None),
    "'value.slope' is one too many": ("value.slope", torch.zeros(1)),
    "advantage.bias has impossible values; allowed: finite numbers": ("advantage.bias", NAN),
    "advantage.bias has weights whose sum is 3e+38; allowed: sums of at most 100,000, which": (
        "advantage.bias",
        HUGE,
    ),
}


@pytest.mark.parametrize("complaint", DAMAGE)
def test_other_weights_are_refused(complaint, folder):
    name, tensor = DAMAGE[complaint]
    tensors = load_file(folder / MODEL)
    tensors.pop(name, None)
    _forged(folder, tensors if tensor is None else tensors | {name: tensor})
    assert _refusal(folder).startswith(f"{folder / MODEL}: {complaint}")
    _described(folder, model_sha256=None)  # as before dess 0.3
    assert _refusal(folder).startswith(f"{folder / MODEL}: {complaint}")


CONTENTS = {
    "{": "not valid JSON: ",
    '{"format": 2}': "has format 2, not 1; allowed: 1",
}
# A key of the description, its value, and the complaint.
WRONG: list[tuple[str, Any, str]] = [
    ("layout", {"grid": 16, "zone": [26, 2, 4, 4], "nodes": [[1, 1]]}, "does not lie on the 16 x"),
    ("observation_version", 2, "observation version 2; allowed: 1"),
    ("model_sha256", ["0" * 64], "damaged: it has not the checksum in config.json"),
]


def test_a_wrong_description_is_refused(folder):
    whole = (folder / CONFIG).read_text("utf-8")
    for content, complaint in CONTENTS.items():
        (folder / CONFIG).write_text(content, "utf-8")
        assert _refusal(folder).startswith(f"{folder / CONFIG}: {complaint}")
    for key, value, complaint in WRONG:
        (folder / CONFIG).write_text(whole, "utf-8")
        _described(folder, **{key: value})
        line = _refusal(folder)
        assert line.startswith(f"{folder}/") and complaint in line


# --- damage ---


def test_a_flipped_byte_is_refused(folder):
    content = (folder / MODEL).read_bytes()
    generator = random.Random(1)
    for position in [*range(8), *generator.sample(range(8, len(content)), 60)]:
        changed = bytearray(content)
        changed[position] ^= 1 << generator.randrange(8)
        (folder / MODEL).write_bytes(changed)
        assert _refusal(folder).startswith(f"{folder / MODEL}: damaged")
    (folder / MODEL).write_bytes(content)
    load_policy(folder)


def test_a_kill_while_it_is_replaced_leaves_a_policy(training, folder, monkeypatch):
    old = load_policy(folder).weights
    before = files_of(folder)
    weights = {name: value + 1e-3 for name, value in training.best.items()}
    seen = []
    for files in range(3):
        for name, content in before.items():
            (folder / name).write_bytes(content)
        with monkeypatch.context() as patch:
            kill_after(patch, files)
            with pytest.raises(Killed):
                save_policy(folder, weights, training.config, training.space)
        seen.append(load_policy(folder).weights == old)
    # Not yet begun; the description has both checksums; the weights are new as well.
    assert seen == [True, True, False]
    save_policy(folder, weights, training.config, training.space)
    assert json.loads((folder / CONFIG).read_text("utf-8"))["model_sha256"] == [
        hashlib.sha256((folder / MODEL).read_bytes()).hexdigest()
    ]


def test_a_policy_that_is_replaced_while_it_is_read_is_read_again(training, folder, monkeypatch):
    weights = {name: value + 1e-3 for name, value in training.best.items()}
    reading = trained.read_description
    waiting = [True]

    def late(path: Path) -> Any:
        description = reading(path)
        if waiting:
            waiting.clear()
            save_policy(folder, weights, training.config, training.space)
        return description

    old = load_policy(folder).weights
    monkeypatch.setattr(trained, "read_description", late)
    assert load_policy(folder).weights != old


def test_integers_that_are_damaged_or_of_other_weights_are_not_used(tmp_path, caplog):
    folder = tmp_path / "generalist"
    shutil.copytree(TRAINED / "generalist", folder)
    assert load_policy(folder).weights == load_policy(TRAINED / "generalist").weights
    path = folder / INTEGERS
    content = path.read_bytes()
    in_floats = load_teacher(folder)[0].weights
    assert in_floats != load_policy(folder).weights and not caplog.messages
    for position in (len(content) // 2, len(content) - 1):
        path.write_bytes(
            content[:position] + bytes([content[position] ^ 1]) + content[position + 1 :]
        )
        assert load_policy(folder).weights == in_floats
    assert "there are no integers of these weights" in caplog.text
    path.write_bytes(content[:-1])
    assert refusal_of(load_policy, folder).startswith(f"{path}: damaged")
