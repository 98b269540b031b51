"""Files of the learner: trained policies, and checkpoints of trainings; none needs unpickling.

A policy is a folder with ``model.safetensors`` (the weights) and ``config.json`` (their
description). A checkpoint is one file, ``checkpoint.safetensors``, with all arrays of a training
and, in its header as JSON, everything else.
"""

import copy
import hashlib
import json
import logging
from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from dess.errors import InputError
from dess.files import replacing, writable
from dess.record import MISSION_RECORD
from dess.scenario import ScenarioSpace
from policies.ddqn.config import (
    TrainingConfig,
    config_names,
    config_of,
    learner_of,
    resume_command,
)
from policies.ddqn.observations.states import Layout, layout_of
from policies.ddqn.policy import DDQN
from policies.ddqn.training import OBSERVATIONS, Training, build

FORMAT = 1
MODEL, CONFIG = "model.safetensors", "config.json"

Tensors = dict[str, torch.Tensor]


def save_policy(
    folder: Path,
    weights: Mapping[str, torch.Tensor],
    config: TrainingConfig,
    space: ScenarioSpace,
    run: Mapping[str, Any] | None = None,
) -> None:
    """Write a trained policy into a folder: the weights, then their description.

    Args:
        folder: The folder.
        weights: The weights of the network.
        config: The settings of the training.
        space: The scenario space of the training.
        run: Information about the training for readers; ``load_policy`` ignores it.
    """
    folder.mkdir(parents=True, exist_ok=True)
    tensors = {name: value.detach().cpu().contiguous() for name, value in weights.items()}
    replace(folder / MODEL, lambda path: save_file(tensors, path, {"format": str(FORMAT)}))
    content = {
        "format": FORMAT,
        "name": config.name,
        "observation_version": OBSERVATIONS[config.observation].version,
        "layout": _layout_values(layout_of(space)),
        "training": config.model_dump(mode="json"),
        "run": dict(run or {}),
    }
    text = json.dumps(content, indent=2) + "\n"
    replace(folder / CONFIG, lambda path: path.write_text(text, "utf-8"))


def load_policy(folder: Path) -> DDQN:
    """Load a policy that ``save_policy`` wrote.

    If the best two values are nearly equal, they are computed in double precision, so that an
    action does not depend on the number of rows that are decided together.

    Raises:
        InputError: If a file is missing, damaged, of another version or of another shape.
    """
    where = folder / CONFIG
    try:
        content = json.loads(where.read_text("utf-8"))
        version = content["format"]
        if version == FORMAT:
            layout, training = _layout(content["layout"]), content["training"]
    except (OSError, ValueError, KeyError, TypeError) as error:
        raise InputError(f"{where}: no readable description of a policy: {error!r}") from None
    if version != FORMAT:
        raise InputError(f"{where}: format {version!r} is unknown; allowed: {FORMAT}")
    config = config_of(training, str(where))
    observation, network = build(config, layout)
    _require_version(content.get("observation_version"), observation, where)
    tensors, _ = _read(folder / MODEL)
    _require_weights(tensors, network.state_dict(), folder / MODEL)
    network.load_state_dict(tensors)
    policy = DDQN(config.name, observation, network, config.guard, layout)
    policy.exact = copy.deepcopy(network).double()
    policy.learner = learner_of(config)
    policy.weights = _digest(tensors, [config.observation, config.guard, content["layout"]])
    ticks = content.get("run", {}).get("ticks", config.ticks)
    if ticks < config.ticks:
        name = config.name if config.name in config_names() else "CONFIG"
        _log_once(
            f"{folder}: this training is not finished ({ticks:,} of {config.ticks:,} ticks); the "
            "policy acts with the weights that it has so far; continue with "
            + resume_command(config, name, folder)
        )
    return policy


def save_training(path: Path, training: Training) -> None:
    """Write a checkpoint from which a training continues as if it had not been interrupted."""
    learner = training.learner
    tensors: Tensors = {"random.torch": torch.get_rng_state()}
    tensors["early"] = torch.from_numpy(training.early)
    for name, network in _networks(training).items():
        tensors |= {f"{name}.{key}": value for key, value in network.items()}
    for index, state in learner.optimizer.state_dict()["state"].items():
        tensors |= {f"optimizer.{index}.{key}": value for key, value in state.items()}
    for name, array in training.stepper.state._asdict().items():
        tensors[f"stepper.{name}"] = _bytes(array)
    if training.config.checkpoint_replay:
        for name, array in training.replay.arrays.items():
            tensors[f"replay.{name}"] = torch.from_numpy(array)
    if training.finished:
        tensors["finished"] = _bytes(np.concatenate(training.finished))
    for name in training.losses[0] if training.losses else ():
        tensors[f"losses.{name}"] = torch.stack([loss[name] for loss in training.losses])
    header = {
        "format": FORMAT,
        "config": training.config.model_dump(mode="json"),
        "scenario": training.space.model_dump(mode="json"),
        "observation_version": training.observation.version,
        "progress": training.progress(),
        "random": training.generator.bit_generator.state,
        "stepper": [training.stepper.seed, training.stepper.replication],
        "replay": training.replay.count if training.config.checkpoint_replay else None,
        "curve": training.curve,
    }
    tensors = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    replace(path, lambda new: save_file(tensors, new, {"dess": json.dumps(header)}))


def load_training(path: Path, config: TrainingConfig, device: torch.device) -> Training:
    """Load a training from a checkpoint that ``save_training`` wrote.

    If the checkpoint has no replay memory, the present policy fills it again.

    Raises:
        InputError: If the file is missing, damaged, of another version or of another config.
    """
    tensors, metadata = _read(path)
    try:
        header = json.loads(metadata["dess"])
        version, saved = header["format"], header.get("config", {})
    except (KeyError, ValueError, TypeError, AttributeError) as error:
        raise InputError(f"{path}: no checkpoint of a training: {error!r}") from None
    if version != FORMAT:
        raise InputError(f"{path}: format {version!r} is unknown; allowed: {FORMAT}")
    training = Training(config, device)
    settings = config.model_dump(mode="json") | {"scenario": training.space.model_dump(mode="json")}
    saved = config_of(saved, str(path)).model_dump(mode="json")
    saved |= {"scenario": header.get("scenario")}
    if different := [key for key in settings if settings[key] != saved[key]]:
        raise InputError(
            f"{path}: of another config ({', '.join(different)} differ); "
            "allowed: the one it began with"
        )
    _require_version(header.get("observation_version"), training.observation, path)
    for name, network in _networks(training).items():
        _require_weights(_part(tensors, name), network, path)
    try:
        _restore(training, tensors, header)
    except (LookupError, ValueError, TypeError, RuntimeError) as error:
        raise InputError(f"{path}: damaged, or of another scenario: {error!r}") from None
    return training


def _restore(training: Training, tensors: Tensors, header: dict[str, Any]) -> None:
    """Restore the state of a saved training in a new training."""
    training.restore(header["progress"])
    learner = training.learner
    with torch.no_grad():
        for name, network in _networks(training).items():
            for key, value in _part(tensors, name).items():
                network[key].copy_(value)
    states: dict[int, Tensors] = {}
    for key, value in _part(tensors, "optimizer").items():
        index, _, field = key.partition(".")
        states.setdefault(int(index), {})[field] = value
    groups = learner.optimizer.state_dict()["param_groups"]
    learner.optimizer.load_state_dict({"state": states, "param_groups": groups})
    training.stepper.start_at(*header["stepper"])
    training.early[...] = tensors["early"].numpy()
    parts = _part(tensors, "stepper")
    for name, array in training.stepper.state._asdict().items():
        array[...] = _array(parts[name], array.dtype).reshape(array.shape)
    if header["replay"] is not None:
        training.replay.count = header["replay"]
        parts = _part(tensors, "replay")
        for name, array in training.replay.arrays.items():
            array[...] = parts[name].numpy()
    if "finished" in tensors:
        training.finished = [_array(tensors["finished"], MISSION_RECORD)]
    losses = {key: value.to(training.device) for key, value in _part(tensors, "losses").items()}
    for values in zip(*losses.values(), strict=True):
        training.losses.append(dict(zip(losses, values, strict=True)))
    training.curve = header["curve"]
    training.generator.bit_generator.state = header["random"]
    torch.set_rng_state(tensors["random.torch"])


@lru_cache
def _log_once(line: str) -> None:
    """Log a line for the user; every process loads a policy many times."""
    logging.getLogger(__name__).warning(line)


def _digest(tensors: Tensors, use: list[Any]) -> str:
    """A hash of the weights and of the settings ``use`` with which they are used."""
    digest = hashlib.sha256(json.dumps(use).encode())
    for name in sorted(tensors):
        digest.update(name.encode() + b"\0" + tensors[name].numpy().tobytes())
    return digest.hexdigest()


def _networks(training: Training) -> dict[str, Tensors]:
    """The weights of all networks of a training, by name."""
    learner = training.learner
    networks = {"online": learner.online.state_dict(), "target": learner.target.state_dict()}
    if learner.average is not None:
        networks["average"] = learner.average.state_dict()
    return networks | {"best": training.best}


def _read(path: Path) -> tuple[Tensors, dict[str, str]]:
    """The tensors of a file, and its metadata."""
    try:
        with safe_open(path, "pt") as file:
            names = file.keys()
            return {name: file.get_tensor(name) for name in names}, file.metadata() or {}
    except FileNotFoundError:
        raise InputError(f"{path}: no such file") from None
    except (OSError, SafetensorError) as error:
        raise InputError(f"{path}: damaged, or no safetensors file: {error}") from None


def _require_weights(tensors: Tensors, wanted: Tensors, path: Path) -> None:
    """Raise an error if the tensors are not weights of the network."""
    for name in sorted(tensors.keys() ^ wanted.keys()):
        problem = "is missing" if name in wanted else "is one too many"
        raise InputError(f"{path}: {name} {problem}; allowed: the weights of the config's network")
    for name, value in wanted.items():
        actual, allowed = _form(tensors[name]), _form(value)
        if actual != allowed:
            raise InputError(f"{path}: {name} is {actual}; allowed: {allowed}, as the config says")


def _require_version(version: Any, observation: Any, path: Path) -> None:
    """Raise an error if the weights were trained on another version of the observation."""
    if version != observation.version:
        raise InputError(f"{path}: observation version {version!r}; allowed: {observation.version}")


def _form(tensor: torch.Tensor) -> str:
    """The type and shape of a tensor, like ``float32 [5, 16]``."""
    return f"{str(tensor.dtype).removeprefix('torch.')} {list(tensor.shape)}"


def _part(tensors: Tensors, name: str) -> Tensors:
    """The tensors whose names begin with ``name.``, without that prefix."""
    prefix = name + "."
    return {
        key.removeprefix(prefix): value for key, value in tensors.items() if key.startswith(prefix)
    }


def _bytes(array: np.ndarray) -> torch.Tensor:
    """The bytes of an array, which may be structured."""
    return torch.from_numpy(np.frombuffer(array.tobytes(), np.uint8).copy())


def _array(content: torch.Tensor, dtype: np.dtype) -> np.ndarray:
    return np.frombuffer(content.numpy().tobytes(), dtype).copy()


def _layout_values(layout: Layout) -> dict[str, Any]:
    return {
        "grid": layout.grid,
        "zone": layout.zone.tolist(),
        "nodes": layout.nodes.tolist(),
    }


def _layout(values: dict[str, Any]) -> Layout:
    return layout_of(ScenarioSpace.of(uavs=1, **values))  # validates the values


def replace(path: Path, write: Callable[[Path], Any]) -> None:
    """Write a file of a training atomically.

    Raises:
        InputError: If it cannot be written.
    """
    with replacing(path) as temporary, writable(path):
        try:
            write(temporary)
        except SafetensorError as error:
            raise OSError(error) from None
