"""A training that takes next to no time."""

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import tomli_w
import torch

from dess import InputError
from dess.policies.learner.config import TrainingConfig, validate_config
from dess.policies.learner.training import Training

CPU = torch.device("cpu")
PHASES: list[dict[str, Any]] = [
    {"name": "harvest", "ticks": 80, "battery": False},
    {"name": "battery", "ticks": 80, "epsilon": [0.5, 0.01], "epsilon_decay": 0.5},
]
BRIEF: dict[str, Any] = {
    **{"name": "tiny", "batch": 32, "average_rate": 0.01},
    **{"evaluate_every": 25, "evaluation_missions": 4, "window": 2},
}
TINY: dict[str, Any] = BRIEF | {
    "hidden": [16, 16],
    "num_envs": 8,
    "learning_starts": 60,
    "replay": 80,
    "n_step": 3,
    "low_battery_starts": 0.2,
    "phases": PHASES,
}
# A training for any sea.
ON_SEAS: dict[str, Any] = BRIEF | {
    **{"observation": "sets", "hidden": [8, 8, 8], "num_envs": 2, "learning_starts": 4},
    **{"seas": ["scattered:1001..1002", "clustered:1002"], "seas_per_tick": 2, "updates": 2},
    "set": {"quota": 160},
    **{"evaluate_every": 5, "phases": [{"name": "improvement", "ticks": 8, "temperature": 0.1}]},
}


def tiny(**changes: Any) -> TrainingConfig:
    """The config of the tiny training, with other values."""
    return validate_config(TINY | changes, "tiny")


def tiny_on_seas(**changes: Any) -> TrainingConfig:
    """The config of the tiny training for any sea, with other values."""
    return validate_config(ON_SEAS | changes, "tiny")


def write_config(folder: Path, **changes: Any) -> Path:
    """The config of the tiny training as a TOML file."""
    path = folder / "tiny.toml"
    path.write_text(tomli_w.dumps(TINY | changes), "utf-8")
    return path


@contextmanager
def one_thread() -> Iterator[None]:
    """Let torch compute in one thread: small sums in always the same order."""
    before = torch.get_num_threads()
    torch.set_num_threads(1)
    yield
    torch.set_num_threads(before)


def weights_of(training: Training) -> dict[str, torch.Tensor]:
    """A copy of all weights of a training: those of its networks, and the best."""
    networks = {name: of.state_dict() for name, of in training.learner.networks.items()}
    networks["best"] = training.best
    return {
        f"{name}.{key}": value.clone()
        for name, network in networks.items()
        for key, value in network.items()
    }


def story_of(training: Training) -> list[dict[str, Any]]:
    """The curve of a training but for the time that it took."""
    return [{k: v for k, v in row.items() if k != "seconds"} for row in training.curve]


def assert_same(one: Training, other: Training) -> None:
    """Assert that two trainings stand at the same place, bit for bit."""
    assert (one.tick, one.updates, one.uav_slots) == (other.tick, other.updates, other.uav_slots)
    assert one.generator.bit_generator.state == other.generator.bit_generator.state
    assert story_of(one) == story_of(other)
    theirs = weights_of(other)
    for name, value in weights_of(one).items():
        assert torch.equal(value, theirs.pop(name)), name
    assert not theirs


def refusal_of(load: Callable[..., Any], *arguments: Any, **options: Any) -> str:
    """The one line with which something is refused."""
    with pytest.raises(InputError) as error:
        load(*arguments, **options)
    line = str(error.value)
    assert line.isprintable() and len(line) < 1000  # the console cuts it
    return line


class Killed(BaseException):
    """The process is killed here."""


def kill_after(monkeypatch: pytest.MonkeyPatch, files: int) -> None:
    """Kill the process when it puts the next file after so many in its place."""
    left, replace = iter(range(files)), os.replace

    def dying(*paths: Any) -> None:
        if next(left, None) is None:
            raise Killed
        replace(*paths)

    monkeypatch.setattr(os, "replace", dying)
