"""Checkpoints: what is written comes back, and nothing else is read."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from dess import InputError
from policies.ddqn import tensors as files
from policies.ddqn.checkpoint import load_training, save_training
from policies.ddqn.config import CHECKPOINT
from policies.ddqn.description import MODEL
from policies.ddqn.trained import load_policy, save_policy
from policies.ddqn.training import Training
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
    assert line.startswith(f"{file}: damaged, or no safetensors file")


def test_no_checkpoint_is_named(training: Training, folder: Path) -> None:
    nothing = folder / CHECKPOINT
    assert _refusal(load_training, nothing, training.config, CPU) == f"{nothing}: no such file"
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
    assert line == f"{file}: format 3 is unknown; allowed: 2"


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
