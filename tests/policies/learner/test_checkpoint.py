"""Checkpoints: what is written comes back, and nothing else is read."""

import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.numpy import load_file, save_file

from dess import InputError
from dess.model.state import MISSION, PLAIN_SENSOR, UAV
from dess.policies.learner.arrays import hash_arrays, to_bytes
from dess.policies.learner.checkpoint import load_training, save_training
from dess.policies.learner.config import CHECKPOINT
from dess.policies.learner.description import MODEL
from dess.policies.learner.dqn import DQNTraining
from dess.policies.learner.trained import load_policy, save_policy
from tests.analysis.small import write_scenario
from tests.policies.learner.tiny import CPU, assert_same, refusal_of, tiny


@pytest.fixture
def file(training, tmp_path):
    """The file of its checkpoint."""
    path = tmp_path / CHECKPOINT
    save_training(path, training)
    return path


class _Bomb:
    """Leaves a trace when it is unpickled."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self.path,)


def test_a_pickle_is_refused_and_not_run(training, file, tmp_path):
    trace, policy = tmp_path / "trace", tmp_path / "policy"
    save_policy(policy, training.best, training.config, training.space)
    for path in (policy / MODEL, file):
        torch.save({"value.bias": torch.zeros(1), "bomb": _Bomb(trace)}, path)
    assert str(policy / MODEL) in refusal_of(load_policy, policy)
    assert str(file) in refusal_of(load_training, file, tiny(), CPU)
    assert not trace.exists()
    torch.load(file.rename(tmp_path / "pickle"), weights_only=False)
    assert trace.exists()  # it would have


def test_the_checkpoint_of_another_config_is_refused(training, file):
    other = training.config.model_copy(update={"seed": 2, "discount": 0.5})
    line = refusal_of(load_training, file, other, CPU)
    assert line == (
        f"{file}: of another config (seed, discount differ); allowed: the one it began with"
    )


def _forged(file: Path, tensors: dict[str, np.ndarray | None] | None = None, **header: Any) -> None:
    """Change tensors (None: leave out) and the header of a checkpoint, and its checksum with them.

    So it is what somebody makes who wants to be believed, not what a damaged disk makes.
    """
    values = load_file(file) | (tensors or {})
    kept = {name: value for name, value in values.items() if value is not None}
    with safe_open(file, "np") as opened:
        new = json.loads(opened.metadata()["dess"]) | header
    del new["sha256"]
    new["sha256"] = hash_arrays(new, kept)
    save_file(kept, file, {"dess": json.dumps(new)})


def test_the_checkpoint_of_another_version_is_refused(training, file):
    _forged(file)
    assert_same(load_training(file, training.config, CPU), training)  # nothing changed
    _forged(file, format=3, config="another form")
    line = refusal_of(load_training, file, training.config, CPU)
    assert line == f"{file}: has format 3, not 2; allowed: 2"


# What stands in the place of a tensor; None: it is left out.
TENSORS: dict[str, np.ndarray | None] = {
    "online.value.bias": None,
    "average.value.bias": np.zeros(3, np.float32),
    "stepper.uavs": np.zeros(7, np.uint8),
    "optimizer.99999999.exp_avg": np.zeros(1, np.float32),
    "losses.loss": np.zeros(9, np.float32),
    "\U0001f4a3\n": np.zeros(1, np.float32),
}
# A tensor, where in it, and the index that stands there then.
CELLS = [("replay.uavs", (0, 0, 0), 30_000), ("replay.uavs", (0, 0, 1), -1)]
CELLS += [("replay.action", (0, 0), 9)]
# Bytes that stand for truths, but are neither 0 nor 1 then.
TRUTHS = {"replay.acted": 0, "early": 0, "stepper.uavs": UAV.fields["latch"][1]}  # type: ignore[index]
# Fields of the first record of a tensor that holds records; an age is an index, too.
UAVS = {"x": 10**6, "y": -1, "from_x": 32, "executed": 77, "end": 6, "served": 25, "slots_left": 1}
UAVS |= {"pad": 10**6, "zone": 9, "slots_per_cell": 100}
RECORDS: dict[str, tuple[np.dtype, dict[str, Any]]] = {
    "stepper.uavs": (UAV, UAVS),
    "stepper.missions": (MISSION, {"grid": 10**9, "nodes": 10**6, "uavs": 64, "slot": -1}),
    "stepper.sensors": (PLAIN_SENSOR, {"newest": -1e9}),
}


def _forgeries(file: Path) -> Iterator[tuple[str, np.ndarray | None]]:
    """What is forged of a checkpoint: the name of a tensor, and what stands in its place."""
    whole = load_file(file)
    yield from TENSORS.items()
    for name, place, value in CELLS:
        tensor = whole[name].copy()
        tensor[place] = value
        yield name, tensor
    for name, place in TRUTHS.items():
        tensor = whole[name].copy()
        tensor.view(np.uint8).reshape(-1)[place] = 7
        yield name, tensor
    for name, (dtype, fields) in RECORDS.items():
        for field, value in fields.items():
            records = whole[name].copy().view(dtype)
            records[:1][field] = value
            yield name, to_bytes(records)


def test_a_checkpoint_has_no_bytes_of_undefined_memory(training):
    padded = np.dtype([("flag", np.bool_), ("value", np.float64)], align=True)
    records = np.frombuffer(bytearray(b"\xff" * padded.itemsize * 2), padded)
    for name in padded.names:
        records[name] = 0
    assert records.tobytes().strip(b"\0")  # what lies between the fields
    assert not to_bytes(records).any()


def test_an_index_that_the_scenario_has_not_is_refused(training, file):
    content = file.read_bytes()
    for name, tensor in list(_forgeries(file)):
        file.write_bytes(content)
        _forged(file, {name: tensor})
        line = refusal_of(load_training, file, training.config, CPU)
        assert line.startswith(f"{file}: ")
        assert "checksum" not in line  # somebody who wants to be believed has a right one


def test_damage_changes_nothing_that_is_used(training, file):
    content = file.read_bytes()
    header = 8 + int.from_bytes(content[:8], "little")
    generator = random.Random(2)
    parts = range(8, header), range(header, len(content))
    positions = [*range(8), *(place for part in parts for place in generator.sample(part, 60))]
    refused = 0
    for position in positions:
        changed = bytearray(content)
        changed[position] ^= 1 << generator.randrange(8)
        file.write_bytes(changed)
        try:
            loaded = load_training(file, training.config, CPU)
        except InputError as error:
            refused += 1
            assert str(error).startswith(f"{file}: ")
        else:  # a blank that fills up the header, for example
            assert_same(loaded, training)
            assert position < header
    assert refused >= 120
    for share in (0.0, 0.01, 0.5, 0.999):
        file.write_bytes(content[: int(share * len(content))])
        line = refusal_of(load_training, file, training.config, CPU)
        assert line.startswith(f"{file}: damaged: ")


def test_the_checkpoint_of_a_scenario_that_has_changed_is_refused(tmp_path):
    scenario = write_scenario(tmp_path)
    training = DQNTraining(tiny(scenario=str(scenario), learning_starts=5), CPU)
    training.run_ticks(1)
    save_training(tmp_path / CHECKPOINT, training)
    write_scenario(tmp_path, nodes=[[1, 1], [2, 2]])
    refusal_of(load_training, tmp_path / CHECKPOINT, training.config, CPU)
