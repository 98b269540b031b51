"""Checkpoints: what is written comes back, and nothing else is read."""

import json
import os
import random
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from dess import InputError
from dess.errors import printable
from dess.state import MISSION, UAV
from policies.ddqn import tensors as files
from policies.ddqn.checkpoint import load_training, save_training
from policies.ddqn.config import CHECKPOINT
from policies.ddqn.description import MODEL
from policies.ddqn.trained import load_policy, save_policy
from policies.ddqn.training import METRICS, Training
from tests.analysis.small import files_of, write_scenario
from tests.policies.ddqn.tiny import CPU, PHASES, assert_same, tiny


@pytest.fixture
def training() -> Training:
    """A training that has just begun."""
    training = Training(tiny(learning_starts=5, phases=[PHASES[1] | {"ticks": 3}]), CPU)
    training.run(2)
    return training


@pytest.fixture
def folder(training: Training, tmp_path: Path) -> Path:
    """The folder of its policy."""
    path = tmp_path / "policy"
    save_policy(path, training.learner.online.state_dict(), training.config, training.space)
    return path


@pytest.fixture
def file(training: Training, tmp_path: Path) -> Path:
    """The file of its checkpoint."""
    path = tmp_path / CHECKPOINT
    save_training(path, training)
    return path


def _refusal(load: Callable[..., Any], *arguments: Any) -> str:
    """The one line with which loading is refused."""
    with pytest.raises(InputError) as error:
        load(*arguments)
    line = str(error.value)
    assert "\n" not in line
    return line


class _Bomb:
    """Leaves a trace when it is unpickled."""

    def __init__(self, path: Path):
        self.path = path

    def __reduce__(self) -> Any:
        return Path.touch, (self.path,)


def test_a_pickle_is_refused_and_not_run(folder: Path, file: Path, tmp_path: Path) -> None:
    trace = tmp_path / "trace"
    for path in (folder / MODEL, file):
        torch.save({"value.bias": torch.zeros(1), "bomb": _Bomb(trace)}, path)
    assert str(folder / MODEL) in _refusal(load_policy, folder)
    assert str(file) in _refusal(load_training, file, tiny(), CPU)
    assert not trace.exists()
    torch.load(file.rename(tmp_path / "pickle"), weights_only=False)
    assert trace.exists()  # it would have


def test_a_training_comes_back_as_it_was(training: Training, file: Path) -> None:
    assert_same(load_training(file, training.config, CPU), training)
    assert files_of(file.parent).keys() == {CHECKPOINT}


@pytest.mark.parametrize("share", [0.0, 0.01, 0.5, 0.999])
def test_a_truncated_checkpoint_is_refused(share: float, training: Training, file: Path) -> None:
    content = file.read_bytes()
    file.write_bytes(content[: int(share * len(content))])
    line = _refusal(load_training, file, training.config, CPU)
    assert line.startswith(f"{file}: damaged: ")


def test_no_checkpoint_is_named(training: Training, folder: Path) -> None:
    nothing = folder / CHECKPOINT
    assert (
        _refusal(load_training, nothing, training.config, CPU)
        == f"{nothing}: no such file; allowed: a file of a training"
    )
    policy = folder / MODEL
    line = _refusal(load_training, policy, training.config, CPU)
    assert line.startswith(f"{policy}: no checkpoint of a training")


def test_the_checkpoint_of_another_config_is_refused(training: Training, file: Path) -> None:
    other = training.config.model_copy(update={"seed": 2, "discount": 0.5})
    line = _refusal(load_training, file, other, CPU)
    assert line == (
        f"{file}: of another config (seed, discount differ); allowed: the one it began with"
    )


def _header_of(file: Path) -> dict[str, Any]:
    with safe_open(file, "pt") as opened:
        return json.loads(opened.metadata()["dess"])


def _forged(
    file: Path, tensors: dict[str, torch.Tensor | None] | None = None, **header: Any
) -> None:
    """Change tensors (None: leave out) and the header of a checkpoint, and its checksum with them.

    So it is what somebody makes who wants to be believed, not what a damaged disk makes.
    """
    values = load_file(file) | (tensors or {})
    kept = {name: value for name, value in values.items() if value is not None}
    new = {k: v for k, v in (_header_of(file) | header).items() if k != "sha256"}
    new["sha256"] = files.digest(new, {n: v for n, v in kept.items() if v.dtype != torch.bfloat16})
    save_file(kept, file, {"dess": json.dumps(new)})


def test_the_checkpoint_of_another_version_is_refused(training: Training, file: Path) -> None:
    _forged(file)
    assert_same(load_training(file, training.config, CPU), training)  # nothing changed
    _forged(file, format=3, config="another form")
    line = _refusal(load_training, file, training.config, CPU)
    assert line == f"{file}: has format 3, not 2; allowed: 2"


@pytest.mark.parametrize(
    "tensors",
    [
        {"online.value.bias": None},
        {"average.value.bias": torch.zeros(3)},
        {"best.value.bias": torch.zeros(1, dtype=torch.float64)},
        {"target.other": torch.zeros(1)},
        {"stepper.uavs": None},
        {"stepper.uavs": torch.zeros(7, dtype=torch.uint8)},
        {"replay.reward": None},
        {"replay.reward": torch.zeros(3, 3)},
        {"random.torch": None},
        {"random.torch": torch.zeros(3)},
        {"optimizer.x": torch.zeros(1)},
        {"losses.loss": torch.zeros(9)},
    ],
    ids=str,
)
def test_a_damaged_checkpoint_is_refused(
    tensors: dict[str, torch.Tensor | None], training: Training, file: Path
) -> None:
    _forged(file, tensors)
    assert _refusal(load_training, file, training.config, CPU).startswith(f"{file}: ")


@pytest.mark.parametrize(
    "header",
    [{"progress": {}}, {"random": {}}, {"stepper": [1]}, {"stepper": [-1, 0]}, {"config": {}}],
    ids=str,
)
def test_a_damaged_header_is_refused(
    header: dict[str, Any], training: Training, file: Path
) -> None:
    _forged(file, **header)
    assert _refusal(load_training, file, training.config, CPU).startswith(f"{file}: ")


def _progress(**changes: Any) -> Callable[[Path], None]:
    """Changes the progress of a checkpoint."""
    return lambda file: _forged(file, progress=_header_of(file)["progress"] | changes)


ROW = {
    **{"tick": 1, "phase": "battery", "uav_slots": 9, "updates": 1, "seconds": 0.1},
    **{"epsilon": 0.5, "learning_rate": 1e-3, "moving_average": 0.5, "is_best": True},
    **{f"evaluation_{name}": 0.5 for name in METRICS},
}


def _row(**changes: Any) -> Callable[[Path], None]:
    """Adds a row to the curve; None leaves a column out."""
    row = {key: value for key, value in (ROW | changes).items() if value is not None}
    return lambda file: _forged(file, curve=[row])


def _header(**changes: Any) -> Callable[[Path], None]:
    return lambda file: _forged(file, **changes)


def _random(**changes: Any) -> Callable[[Path], None]:
    return lambda file: _forged(file, random=_header_of(file)["random"] | changes)


def _value(name: str, value: Any, index: Any = 0) -> Callable[[Path], None]:
    """Changes a number of a tensor."""

    def change(file: Path) -> None:
        tensor = load_file(file)[name]
        tensor[index] = value
        _forged(file, {name: tensor})

    return change


def _record(name: str, field: str, value: Any, dtype: np.dtype) -> Callable[[Path], None]:
    """Changes a field of the first record of a tensor that holds records."""

    def change(file: Path) -> None:
        records = load_file(file)[name].numpy().view(dtype)
        records[:1][field] = value
        _forged(file, {name: files.bytes_of(records)})

    return change


def _truth(name: str) -> Callable[[Path], None]:
    """Makes a truth value neither 0 nor 1."""

    def change(file: Path) -> None:
        tensor = load_file(file)[name]
        tensor.view(torch.uint8)[0] = 7
        _forged(file, {name: tensor})

    return change


def _extra(name: str) -> Callable[[Path], None]:
    return lambda file: _forged(file, {name: torch.zeros(1)})


FORGED: dict[str, Callable[[Path], None]] = {
    "tick -5": _progress(tick=-5, updates=-5),
    "tick 10^18": _progress(tick=10**18),
    "tick of no integer": _progress(tick=2.0),
    "updates": _progress(updates=3),
    "uav_slots": _progress(uav_slots=-1),
    "seconds": _progress(seconds=-1.0),
    "infinite seconds": _progress(seconds=float("inf")),
    "phase_index": _progress(phase_index=7),
    "phase_index -1": _progress(phase_index=-1),
    "phase_start": _progress(phase_start=1),
    "scores": _progress(scores=[0.5] * 1000),
    "best_score": _progress(best_score=0.5),
    "nan score": _progress(best_score=float("nan")),
    "replay -1": _header(replay=-1),
    "replay above the capacity": _header(replay=10**12),
    "no replay": _header(replay=None),
    "seed": _header(stepper=[3, 8]),
    "replication": _header(stepper=[500_000_001, 2**40]),
    "generator": _random(bit_generator="MT19937"),
    "state of the generator": _random(state={"state": 2**200, "inc": 1}),
    "uinteger": _random(uinteger=2**40),
    "scenario": _header(scenario={"grid": 5}),
    "curve": _header(curve=[{"tick": 1}]),
    "curve of text": _row(loss="small"),
    "curve without a metric": _row(evaluation_success=None),
    "curve with nan": _row(evaluation_reward=float("nan")),
    "curve from the future": _row(tick=10**6),
    "curve with another column": _row(evaluation_beauty=1.0),
    "name of a phase": _row(phase="a\nb"),
    "unknown key": _header(pickle="gASV"),
    "weight": _value("online.hidden.0.weight", np.nan, (0, 0)),
    "best weight": _value("best.value.bias", np.inf),
    "moment": _value("optimizer.0.exp_avg", np.nan, (0, 0)),
    "loss": _value("losses.loss", np.nan),
    "reward": _value("replay.reward", np.inf, (0, 0)),
    "cell in the replay memory": _value("replay.uavs", 30_000, (0, 0, 0)),
    "negative cell in the replay memory": _value("replay.uavs", -1, (0, 0, 1)),
    "mask in the replay memory": _value("replay.uavs", 64, (0, 0, 9)),
    "action in the replay memory": _value("replay.action", 9, (0, 0)),
    "charge_start in the replay memory": _value("replay.missions", 30_000, (0, 0)),
    "truth value in the replay memory": _truth("replay.acted"),
    "truth value": _truth("early"),
    "optimizer of a weight that is not there": _extra("optimizer.99999999.exp_avg"),
    "optimizer of no weight": _extra("optimizer.x.step"),
    "tensor of an odd name": _extra("\U0001f4a3\n"),
    "x": _record("stepper.uavs", "x", 10**6, UAV),
    "y": _record("stepper.uavs", "y", -1, UAV),
    "from_x": _record("stepper.uavs", "from_x", 32, UAV),
    "battery": _record("stepper.uavs", "battery", 10**12, UAV),
    "executed": _record("stepper.uavs", "executed", 77, UAV),
    "end": _record("stepper.uavs", "end", 5, UAV),
    "served": _record("stepper.uavs", "served", 25, UAV),
    "pad_request": _record("stepper.uavs", "pad_request", 10**6, UAV),
    "active UAV": _record("stepper.uavs", "active", False, UAV),
    "collected": _record("stepper.uavs", "collected", np.nan, UAV),
    "grid of a mission": _record("stepper.missions", "grid", 10**9, MISSION),
    "nodes of a mission": _record("stepper.missions", "nodes", 10**6, MISSION),
    "UAVs of a mission": _record("stepper.missions", "uavs", 64, MISSION),
    "active UAVs of a mission": _record("stepper.missions", "active", 9, MISSION),
    "slot of a mission": _record("stepper.missions", "slot", -1, MISSION),
    "replication of a mission": _record("stepper.missions", "replication", 8, MISSION),
    "data of a mission": _record("stepper.missions", "arrived", np.inf, MISSION),
    "residual data": _record("stepper.residual", "data", -1.0, np.dtype([("data", float)])),
}


@pytest.mark.parametrize("kind", FORGED)
def test_a_forged_checkpoint_is_refused(kind: str, training: Training, file: Path) -> None:
    FORGED[kind](file)
    line = _refusal(load_training, file, training.config, CPU)
    assert line.startswith(f"{file}: ")
    assert "checksum" not in line  # somebody who wants to be believed has a right one
    assert printable(line) == line


def test_what_is_not_changed_is_not_refused(training: Training, file: Path) -> None:
    _row()(file)
    assert load_training(file, training.config, CPU).curve == [ROW]
    _progress(uav_slots=5)(file)
    assert load_training(file, training.config, CPU).uav_slots == 5


def test_truth_values_of_missions_are_checked(training: Training, file: Path) -> None:
    records = load_file(file)["stepper.uavs"].numpy()
    records[UAV.fields["latch"][1]] = 7  # type: ignore[index]
    _forged(file, {"stepper.uavs": torch.from_numpy(records)})
    line = _refusal(load_training, file, training.config, CPU)
    assert ": latch is out of range; allowed: a checkpoint" in line


def test_a_flipped_byte_changes_nothing_that_is_used(training: Training, file: Path) -> None:
    content = file.read_bytes()
    header = 8 + int.from_bytes(content[:8], "little")
    generator = random.Random(2)
    positions = [
        *range(8),
        *generator.sample(range(8, header), 60),
        *generator.sample(range(header, len(content)), 60),
    ]
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
    file.write_bytes(content)
    assert_same(load_training(file, training.config, CPU), training)


@pytest.mark.parametrize("kind", ["pipe", "device", "folder", "large"])
def test_only_a_regular_file_is_read(kind: str, training: Training, tmp_path: Path) -> None:
    path = tmp_path / CHECKPOINT
    if kind == "pipe":
        os.mkfifo(path)
    elif kind == "device":
        path.symlink_to("/dev/zero")
    elif kind == "folder":
        path.mkdir()
    else:
        with path.open("wb") as file:
            file.truncate(2**40)
    line = _refusal(load_training, path, training.config, CPU)
    assert line.startswith(f"{path}: ")


def test_the_checkpoint_of_a_scenario_that_has_changed_is_refused(tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path)
    training = Training(tiny(scenario=str(scenario), learning_starts=5), CPU)
    training.run(1)
    save_training(tmp_path / CHECKPOINT, training)
    write_scenario(tmp_path, nodes=[[1, 1], [2, 2]])
    _refusal(load_training, tmp_path / CHECKPOINT, training.config, CPU)


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_a_failed_write_leaves_the_old_files(
    error: BaseException,
    training: Training,
    folder: Path,
    file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail_to_save(tensors: Any, path: Path, *_: Any) -> None:
        path.touch()
        raise error

    def fail_to_write(path: Path, content: bytes) -> None:
        path.touch()
        raise error

    before = files_of(file.parent)
    monkeypatch.setattr(files, "save_file", fail_to_save)
    monkeypatch.setattr(Path, "write_bytes", fail_to_write)
    training.run(1)
    raised = InputError if isinstance(error, OSError) else KeyboardInterrupt
    with pytest.raises(raised):
        save_training(file, training)
    with pytest.raises(raised):
        save_policy(folder, training.best, training.config, training.space)
    assert files_of(file.parent) == before


def test_where_nothing_can_be_written_it_says_so(training: Training, tmp_path: Path) -> None:
    line = _refusal(save_training, tmp_path / "none" / CHECKPOINT, training)
    assert line.startswith(f"{tmp_path / 'none' / CHECKPOINT}: cannot be written: ")
