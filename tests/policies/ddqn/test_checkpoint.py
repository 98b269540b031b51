"""Files of the learner: what is written comes back, and nothing else is read."""

import copy
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
from safetensors import safe_open
from safetensors.torch import load_file, save_file

from dess import InputError
from dess.batch import simulate_batch
from dess.scenario import load_scenario
from policies.ddqn import tensors as files_of_tensors
from policies.ddqn.checkpoint import load_training, save_training
from policies.ddqn.config import CHECKPOINT
from policies.ddqn.description import CONFIG, MODEL
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


# --- trained policies ---


@pytest.mark.parametrize(
    "changes",
    [
        {},
        {"guard": False},
        {"precision": "bfloat16"},
        {"observation": "nodes"},
        {"observation": "maps"},
    ],
    ids=["vector", "free", "bfloat16", "nodes", "maps"],
)
def test_a_policy_comes_back_as_it_was(changes: dict[str, Any], tmp_path: Path) -> None:
    training = Training(tiny(**changes), CPU)
    weights = training.learner.online.state_dict()
    save_policy(tmp_path / "new" / "policy", weights, training.config, training.space)
    assert sorted(files_of(tmp_path / "new" / "policy")) == [CONFIG, MODEL]
    loaded, saved = load_policy(tmp_path / "new" / "policy"), training.policy(weights)
    assert (loaded.name, loaded.guarded) == ("tiny", training.config.guard)
    for part in loaded.layout._fields:
        assert np.array_equal(getattr(loaded.layout, part), getattr(saved.layout, part))
    saved.exact = copy.deepcopy(saved.network).double()  # as the loaded one has it
    missions = 2 if training.config.observation == "maps" else 10
    flights = [simulate_batch(training.space, policy, 71, missions) for policy in (loaded, saved)]
    assert flights[0].missions.tobytes() == flights[1].missions.tobytes()
    assert flights[0].uavs.tobytes() == flights[1].uavs.tobytes()


def test_weights_have_a_hash(training: Training, folder: Path) -> None:
    weights = {name: value.clone() for name, value in training.learner.online.state_dict().items()}
    first = load_policy(folder).weights
    assert len(bytes.fromhex(first)) == 32
    save_policy(folder, weights, training.config, training.space)
    assert load_policy(folder).weights == first
    weights["value.bias"] += 1e-3
    save_policy(folder, weights, training.config, training.space)
    assert load_policy(folder).weights != first


def test_a_policy_needs_no_scenario_file(tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path)
    training = Training(tiny(scenario=str(scenario)), CPU)
    save_policy(tmp_path / "policy", training.best, training.config, training.space)
    scenario.unlink()
    assert load_policy(tmp_path / "policy").layout.grid == 8


def _shape(tensors: dict[str, torch.Tensor]) -> None:
    tensors["value.bias"] = torch.zeros(2)


def _precision(tensors: dict[str, torch.Tensor]) -> None:
    tensors["value.bias"] = tensors["value.bias"].to(torch.bfloat16)


def _missing(tensors: dict[str, torch.Tensor]) -> None:
    del tensors["value.bias"]


def _extra(tensors: dict[str, torch.Tensor]) -> None:
    tensors["value.slope"] = torch.zeros(1)


@pytest.mark.parametrize(
    ("damage", "complaint"),
    [
        (_shape, r"value\.bias is float32 \[2\]; allowed: float32 \[1\]"),
        (_precision, r"value\.bias is bfloat16 \[1\]; allowed: float32 \[1\]"),
        (_missing, r"value\.bias is missing"),
        (_extra, r"value\.slope is one too many"),
    ],
)
def test_other_weights_are_refused(
    damage: Callable[[dict[str, torch.Tensor]], None], complaint: str, folder: Path
) -> None:
    tensors = load_file(folder / MODEL)
    damage(tensors)
    save_file(tensors, folder / MODEL)
    with pytest.raises(InputError, match=f"^{folder / MODEL}: {complaint}"):
        load_policy(folder)


def test_the_weights_of_another_config_are_refused(training: Training, folder: Path) -> None:
    other = Training(tiny(hidden=[16, 8]), CPU)
    weights = folder / MODEL
    kept = weights.read_bytes()
    save_policy(folder, other.best, other.config, other.space)
    weights.write_bytes(kept)
    assert _refusal(load_policy, folder).startswith(f"{weights}: ")


@pytest.mark.parametrize("content", [b"", b"{}", b"PK\x03\x04" + bytes(100), bytes(100)])
def test_a_foreign_file_is_refused(content: bytes, folder: Path) -> None:
    (folder / MODEL).write_bytes(content)
    assert _refusal(load_policy, folder).startswith(f"{folder / MODEL}: damaged, or no safetensors")


@pytest.mark.parametrize("share", [0.01, 0.5, 0.999])
def test_a_truncated_file_is_refused(share: float, folder: Path) -> None:
    content = (folder / MODEL).read_bytes()
    (folder / MODEL).write_bytes(content[: int(share * len(content))])
    assert _refusal(load_policy, folder).startswith(f"{folder / MODEL}: damaged, or no safetensors")


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


@pytest.mark.parametrize("name", [CONFIG, MODEL])
def test_a_missing_file_is_named(name: str, folder: Path) -> None:
    (folder / name).unlink()
    assert _refusal(load_policy, folder).startswith(f"{folder / name}: ")


CONTENTS: dict[str, Any] = {
    "{": "no readable description of a policy",
    "[]": "no readable description of a policy",
    "3": "no readable description of a policy",
    "{}": "no readable description of a policy: KeyError('format')",
    '{"format": 1}': "no readable description of a policy: KeyError('layout')",
    '{"format": 2}': "format 2 is unknown; allowed: 1",
    '{"format": "1"}': "format '1' is unknown; allowed: 1",
}


@pytest.mark.parametrize("content", CONTENTS)
def test_a_damaged_description_is_refused(content: str, folder: Path) -> None:
    (folder / CONFIG).write_text(content, "utf-8")
    assert _refusal(load_policy, folder).startswith(f"{folder / CONFIG}: {CONTENTS[content]}")


@pytest.mark.parametrize(
    ("part", "key", "value", "complaint"),
    [
        ("layout", "grid", "wide", "grid: "),
        ("layout", "grid", 16, "zone: [26, 2, 4, 4] does not lie on the 16 x 16 grid"),
        ("layout", "zone", [26, 2, 4], "zone"),
        ("layout", "nodes", [[1, 2, 3]], "nodes"),
        ("layout", "nodes", "none", "nodes"),
        ("layout", "uavs", 3, "uavs"),
        ("layout", "nodez", [], "nodez: unknown key"),
        ("training", "hidden", "wide", "hidden: "),
        ("training", "speed", 3, "speed: unknown key"),
        ("training", "observation", "radar", "observation: "),
    ],
)
def test_a_wrong_description_is_refused(
    part: str, key: str, value: Any, complaint: str, folder: Path
) -> None:
    content = json.loads((folder / CONFIG).read_text("utf-8"))
    content[part][key] = value
    (folder / CONFIG).write_text(json.dumps(content), "utf-8")
    line = _refusal(load_policy, folder)
    assert line.startswith(f"{folder / CONFIG}: ")
    assert complaint in line


# --- trainings under way ---


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


def _rewritten(
    file: Path, tensors: dict[str, torch.Tensor | None] | None = None, **header: Any
) -> None:
    """Change tensors (None: leave out) and the header of a checkpoint."""
    with safe_open(file, "pt") as opened:
        old = json.loads(opened.metadata()["dess"])
    values = load_file(file) | (tensors or {})
    kept = {name: value for name, value in values.items() if value is not None}
    save_file(kept, file, {"dess": json.dumps(old | header)})


def test_the_checkpoint_of_another_version_is_refused(training: Training, file: Path) -> None:
    _rewritten(file)
    assert_same(load_training(file, training.config, CPU), training)  # nothing changed
    _rewritten(file, format=2, config="another form")
    line = _refusal(load_training, file, training.config, CPU)
    assert line == f"{file}: format 2 is unknown; allowed: 1"


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
    _rewritten(file, tensors)
    assert _refusal(load_training, file, training.config, CPU).startswith(f"{file}: ")


@pytest.mark.parametrize(
    "header",
    [{"progress": {}}, {"random": {}}, {"stepper": [1]}, {"stepper": [-1, 0]}, {"config": {}}],
    ids=str,
)
def test_a_damaged_header_is_refused(
    header: dict[str, Any], training: Training, file: Path
) -> None:
    _rewritten(file, **header)
    assert _refusal(load_training, file, training.config, CPU).startswith(f"{file}: ")


def test_the_checkpoint_of_a_scenario_that_has_changed_is_refused(tmp_path: Path) -> None:
    scenario = write_scenario(tmp_path)
    training = Training(tiny(scenario=str(scenario), learning_starts=5), CPU)
    training.run(1)
    save_training(tmp_path / CHECKPOINT, training)
    write_scenario(tmp_path, nodes=[[1, 1], [2, 2]])
    _refusal(load_training, tmp_path / CHECKPOINT, training.config, CPU)


# --- writing ---


@pytest.mark.parametrize("error", [OSError("disk full"), KeyboardInterrupt()])
def test_a_failed_write_leaves_the_old_files(
    error: BaseException,
    training: Training,
    folder: Path,
    file: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fail(tensors: Any, path: Path, *_: Any) -> None:
        path.write_bytes(b"half of it")
        raise error

    before = files_of(file.parent)
    monkeypatch.setattr(checkpoint, "save_file", fail)
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


def test_the_layout_is_that_of_the_scenario(training: Training, folder: Path) -> None:
    paper = load_scenario("paper")
    layout = json.loads((folder / CONFIG).read_text("utf-8"))["layout"]
    assert layout == {
        "grid": paper.grid,
        "zone": list(paper.zone),
        "nodes": [list(node) for node in paper.nodes],
    }
