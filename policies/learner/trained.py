"""A trained policy as a folder: ``model.safetensors`` (the weights) and ``config.json``.

``config.json`` describes the weights (``dess.policies.learner.config``) and has their checksum.
Files of arrays may come from anybody, and are checked before a network takes them.
"""

import copy
import hashlib
import json
import logging
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import load, save, save_file
from torch import nn

from dess.errors import InputError, shown
from dess.files.reading import Missing, checked, read_bytes
from dess.files.writing import replacing, write_file
from dess.observations.maps import POOL
from dess.observations.observer import ENCODERS
from dess.observations.sets import Sets
from dess.observations.states import Layout, layout_of
from dess.policies.learner.config import (
    CONFIG,
    FORMAT,
    MODEL,
    Description,
    LayoutTable,
    Run,
    TrainingConfig,
    config_names,
    learner_of,
    ranges_of,
    read_description,
    resume_command,
)
from dess.policies.learner.network import NARROWEST, DuelingNetwork, PaperNetwork, SetNetwork
from dess.policies.learner.policy import LearnedPolicy
from dess.scenario import ScenarioSpace

Tensors = dict[str, torch.Tensor]


def write_tensors(
    path: Path, tensors: Mapping[str, torch.Tensor], metadata: dict[str, str]
) -> None:
    """Write tensors into a file, completely or not at all.

    Args:
        path: The file.
        tensors: The tensors, on any device.
        metadata: One text by name. With more than one, their order in the file would be random.

    Raises:
        InputError: If it cannot be written.
    """
    plain = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    with replacing(path) as temporary:
        try:
            save_file(plain, temporary, metadata)
        except SafetensorError as error:
            raise InputError(f"{path}: cannot be written: {error}; allowed: another path") from None


def read_tensors(path: Path, limit: int) -> tuple[Tensors, dict[str, str]]:
    """The tensors of a file of at most ``limit`` bytes, and its metadata.

    Raises:
        InputError: If it does not exist, is too large or is no such file.
    """
    try:
        with safe_open(checked(path, limit, "a file of a training"), "pt") as file:
            names = file.keys()
            return {name: file.get_tensor(name) for name in names}, file.metadata() or {}
    except InputError:
        raise
    except (OSError, SafetensorError, ValueError) as error:
        raise damaged(path, error) from None


def damaged(path: Path, error: Exception) -> InputError:
    """What is said about a file that cannot be read."""
    return InputError(f"{path}: damaged: {error}; allowed: a safetensors file")


def digest(content: Any, tensors: Mapping[str, torch.Tensor]) -> str:
    """A SHA-256 of plain values and of named tensors."""
    hashed = hashlib.sha256(json.dumps(content).encode())
    for name in sorted(tensors):
        hashed.update(name.encode() + b"\0")
        content = tensors[name].detach().cpu().contiguous().reshape(-1)
        hashed.update(content.view(torch.uint8).numpy().data)
    return hashed.hexdigest()


def require_forms(
    tensors: Mapping[str, torch.Tensor], wanted: Mapping[str, torch.Tensor], where: str
) -> None:
    """Refuse tensors whose names, types or shapes are not the wanted ones, or that are not finite.

    Args:
        tensors: The tensors.
        wanted: Tensors of the right form; their values do not matter.
        where: The file of the tensors.

    Raises:
        InputError: If a tensor is missing, one too many, of another form, or not finite.
    """
    for name in sorted(tensors.keys() ^ wanted.keys()):
        problem = "is missing" if name in wanted else "is one too many"
        raise InputError(f"{where}: {shown(name)} {problem}; allowed: the tensors of the config")
    for name, value in wanted.items():
        actual, allowed = _form(tensors[name]), _form(value)
        if actual != allowed:
            raise InputError(f"{where}: {name} is {actual}; allowed: {allowed}, as the config says")
        if not _is_sound(tensors[name]):
            raise InputError(f"{where}: {name} has impossible values; allowed: finite numbers")


def part(tensors: Mapping[str, torch.Tensor], name: str) -> Tensors:
    """The tensors whose names begin with ``name.``, without that prefix."""
    prefix = name + "."
    return {
        key.removeprefix(prefix): value for key, value in tensors.items() if key.startswith(prefix)
    }


def bytes_of(array: np.ndarray) -> torch.Tensor:
    """The bytes of an array, which may be structured; those between its fields are 0."""
    if array.dtype.names:
        whole, array = array, np.zeros(array.shape, array.dtype)
        for name in whole.dtype.names or ():
            array[name] = whole[name]
    return torch.from_numpy(np.frombuffer(array.tobytes(), np.uint8).copy())


def array_of(content: torch.Tensor, dtype: np.dtype) -> np.ndarray:
    """The (N,) array of a type that ``bytes_of`` made the bytes of."""
    return np.frombuffer(content.numpy().tobytes(), dtype).copy()


def _form(tensor: torch.Tensor) -> str:
    """The type and shape of a tensor, like ``float32 [5, 16]``."""
    return f"{str(tensor.dtype).removeprefix('torch.')} {list(tensor.shape)}"


def _is_sound(tensor: torch.Tensor) -> bool:
    """Whether all numbers are finite, and all truth values 0 or 1."""
    if tensor.dtype == torch.bool:
        return bool((tensor.contiguous().view(torch.uint8) <= 1).all())
    return bool(torch.isfinite(tensor).all()) if tensor.is_floating_point() else True


# The largest file of weights that is read [bytes]; the largest network of a config is half of it.
MODEL_LIMIT = 2**30


def build(config: TrainingConfig, space: ScenarioSpace) -> tuple[Layout | None, Any, nn.Module]:
    """What a policy of a config is made of, for missions of a scenario.

    Returns:
        The layout that it learns, None if it learns to fly on any sea; the encoder of its
        observations, or the kind of it for any sea; and a new network.

    Raises:
        InputError: If the observation cannot be made of the scenario.
    """
    precision = getattr(torch, config.precision)
    if config.algorithm == "ppo":
        return None, Sets, SetNetwork(Sets.shapes, config.hidden, precision)
    layout = layout_of(space)
    if config.observation == "maps" and (2 * layout.grid - 1) // POOL < NARROWEST:
        raise InputError(
            f"observation: a grid of {layout.grid} is too small for maps; allowed: vector, sets"
        )
    observation = ENCODERS[config.observation](layout)
    if config.observation == "maps":
        return layout, observation, PaperNetwork(observation.shapes, precision)
    return layout, observation, DuelingNetwork(observation.shapes[0][0], config.hidden, precision)


def save_policy(
    folder: Path,
    weights: Mapping[str, torch.Tensor],
    config: TrainingConfig,
    space: ScenarioSpace,
    run: Mapping[str, Any] | None = None,
    ranges: dict[str, list[float]] | None = None,
) -> None:
    """Write a trained policy into a folder: the weights and their description.

    A process that is killed at any moment leaves a policy that can be loaded: while the weights are
    replaced, the description has the checksums of both the old and the new ones.

    Args:
        folder: The folder.
        weights: The weights of the network.
        config: The settings of the training.
        space: The scenario space of the training.
        run: Information about the training for readers; ``load_policy`` ignores it.
        ranges: ``ranges_of`` the scenarios of the training, if these are more than the space.

    Raises:
        InputError: If a file cannot be written.
    """
    layout = None if config.algorithm == "ppo" else layout_of(space)
    description = Description(
        format=FORMAT,
        name=config.name,
        observation_version=ENCODERS[config.observation].version,
        layout=layout
        and LayoutTable(grid=layout.grid, zone=layout.zone.tolist(), nodes=layout.nodes.tolist()),
        training=config,
        ranges=ranges or ranges_of([space]),
        run=Run(**(run or {})),
    )
    values = {name: value.detach().cpu().contiguous() for name, value in weights.items()}
    content = save(values, {"format": str(FORMAT)})
    sums = [_sha256(content)]
    with suppress(Missing):
        held = _sha256(read_bytes(folder / MODEL, MODEL_LIMIT))
        write_file(folder / CONFIG, _text(description, [*dict.fromkeys([*sums, held])]))
    write_file(folder / MODEL, content)
    write_file(folder / CONFIG, _text(description, sums))


def load_policy(folder: Path) -> LearnedPolicy:
    """Load a policy that ``save_policy`` wrote.

    If the best two values are nearly equal, they are computed in double precision, so that an
    action does not depend on the number of rows that are decided together.

    Policies of dess 0.2 have no checksum. They are loaded as well if all weights are finite.

    Raises:
        InputError: If a file is missing, damaged, of another version or of another shape.
    """
    path, description = folder / MODEL, read_description(folder)
    content = read_bytes(path, MODEL_LIMIT, "the folder of a trained policy")
    sums = description.model_sha256
    if sums is not None and _sha256(content) not in sums:
        if read_description(folder) != description:  # a training has just replaced both files
            return load_policy(folder)
        raise InputError(
            f"{path}: damaged: it has not the checksum in {CONFIG}; allowed: the file it was made "
            "with"
        )
    return copy.copy(_policy(folder, content, description.model_dump_json()))


@lru_cache(maxsize=4)
def _policy(folder: Path, content: bytes, text: str) -> LearnedPolicy:
    """The policy of these weights and their description; every process loads one many times."""
    path, where = folder / MODEL, folder / CONFIG
    description = Description.model_validate_json(text)
    config = description.training
    values = description.layout and description.layout.model_dump()
    try:
        with torch.device("meta"):  # the forms of the weights, without their memory
            space = ScenarioSpace.of(uavs=1, **(values or {}))
            layout, observation, network = build(config, space)
    except InputError as error:
        raise InputError(f"{where}: {error}") from None
    require_version(description.observation_version, observation, where)
    weights = _weights_in(content, path)
    require_forms(weights, network.state_dict(), str(path))
    network = network.to_empty(device="cpu")
    network.load_state_dict(weights)
    policy = LearnedPolicy(config.name, observation, network, config.guard, layout)
    policy.exact = copy.deepcopy(network).double()
    policy.learner = learner_of(config)
    policy.weights = digest([config.observation, config.guard, values], weights)
    ticks = description.run.ticks
    if ticks is not None and ticks < config.ticks:
        name = config.name if config.name in config_names() else "CONFIG"
        _log_once(
            f"{folder}: this training is not finished ({ticks:,} of {config.ticks:,} ticks); the "
            "policy acts with the weights that it has so far; continue with "
            + resume_command(config, name, folder)
        )
    return policy


def require_version(version: int, observation: Any, path: Path) -> None:
    """Refuse weights that were trained on another version of the observation.

    Raises:
        InputError: If they were.
    """
    if version != observation.version:
        raise InputError(f"{path}: observation version {version!r}; allowed: {observation.version}")


def _weights_in(content: bytes, path: Path) -> Tensors:
    try:
        return load(content)
    except (SafetensorError, ValueError) as error:
        raise damaged(path, error) from None


def _text(description: Description, sums: list[str]) -> str:
    content = description.model_dump(mode="json") | {"model_sha256": sums}
    content["run"] = description.run.model_dump(exclude_unset=True)
    return json.dumps(content, indent=2) + "\n"


def _sha256(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


@lru_cache
def _log_once(line: str) -> None:
    """Log a line for the user; every process loads a policy many times."""
    logging.getLogger(__name__).warning(line)
