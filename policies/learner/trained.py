"""A trained policy as a folder: ``model.safetensors`` (the weights) and ``config.json``.

``config.json`` describes the weights (``dess.policies.learner.config``) and has their checksum.
Files of arrays may come from anybody, and are checked before a network takes them.
"""

import copy
import hashlib
import json
import logging
from collections.abc import Mapping, Sequence
from contextlib import suppress
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import load, save, save_file

from dess.base.errors import InputError, shown
from dess.base.files.reading import Missing, checked, read_bytes
from dess.base.files.writing import replacing, write_file
from dess.envs.observations.maps import POOL, Maps
from dess.envs.observations.sets import Sets
from dess.envs.observations.states import Layout, layout_of
from dess.envs.observations.vector import Vector
from dess.policies import network
from dess.policies.learner.config import (
    CONFIG,
    FORMAT,
    MODEL,
    Description,
    LayoutTable,
    Run,
    TrainingConfig,
    config_names,
    field_ranges,
    learner_identifier,
    read_description,
    resume_command,
)
from dess.policies.learner.policy import LearnedPolicy
from dess.policies.network import Weights
from dess.scenario.scenario import ScenarioSpace

Arrays = dict[str, np.ndarray]


def write_arrays(path: Path, arrays: Weights, metadata: dict[str, str]) -> None:
    """Write arrays into a file, completely or not at all.

    Args:
        path: The file.
        arrays: The arrays.
        metadata: One text by name. With more than one, their order in the file would be random.

    Raises:
        InputError: If it cannot be written.
    """
    with replacing(path) as temporary:
        try:
            save_file(_make_contiguous(arrays), temporary, metadata)
        except SafetensorError as error:
            raise InputError(path, f"cannot be written: {error}", "another path") from None


def read_arrays(path: Path, limit: int) -> tuple[Arrays, dict[str, str]]:
    """The arrays of a file of at most ``limit`` bytes, and its metadata.

    Raises:
        InputError: If it does not exist, is too large or is no such file.
    """
    try:
        with safe_open(checked(path, limit, "a file of a training"), "np") as file:
            names = file.keys()
            return {name: file.get_tensor(name) for name in names}, file.metadata() or {}
    except InputError:
        raise
    except (OSError, SafetensorError, ValueError, TypeError) as error:
        raise describe_damage(path, error) from None


def describe_damage(path: Path, error: Exception) -> InputError:
    """What is said about a file that cannot be read."""
    problem = str(error)
    if isinstance(error, KeyError):
        problem = f"numbers of the type {error}"
    return InputError(path, f"damaged: {problem}", "a safetensors file")


def hash_arrays(content: Any, arrays: Weights) -> str:
    """A SHA-256 of plain values and of named arrays."""
    hashed = hashlib.sha256(json.dumps(content).encode())
    for name, value in sorted(_make_contiguous(arrays).items()):
        hashed.update(name.encode() + b"\0")
        hashed.update(value.reshape(-1).view(np.uint8).data)
    return hashed.hexdigest()


def array_without_memory(shape: Sequence[int], dtype: Any = np.float32) -> np.ndarray:
    """An array of a form, without its memory."""
    return np.broadcast_to(np.zeros((), dtype), shape)


def require_same_forms(arrays: Weights, wanted: Weights, where: str) -> None:
    """Refuse arrays whose names, types or shapes are not the wanted ones, or that are not finite.

    Args:
        arrays: The arrays.
        wanted: Arrays of the right form; their values do not matter.
        where: The file of the arrays.

    Raises:
        InputError: If an array is missing, one too many, of another form, or not finite.
    """
    for name in sorted(arrays.keys() ^ wanted.keys()):
        problem = "is missing" if name in wanted else "is one too many"
        raise InputError(where, f"{shown(name)} {problem}", "the tensors of the config")
    for name, value in wanted.items():
        actual, allowed = (f"{array.dtype} {[*array.shape]}" for array in (arrays[name], value))
        if actual != allowed:
            raise InputError(where, f"{name} is {actual}", f"{allowed}, as the config says")
        if not _is_sound(arrays[name]):
            raise InputError(where, f"{name} has impossible values", "finite numbers")


def require_weights(weights: Weights, wanted: Weights, where: str) -> None:
    """Refuse weights of other forms, or with which the sums of a network could overflow.

    The largest sums of the networks that come with dess are below 200.

    Raises:
        InputError: As ``require_same_forms``, or if the absolute weights of an output have a sum of
            more than ``MOST_SUM``.
    """
    require_same_forms(weights, wanted, where)
    for name, array in weights.items():
        sums = np.abs(array.astype(np.float64)).reshape(len(array), -1).sum(axis=1)
        if sums.max() > MOST_SUM:
            problem = f"{name} has weights whose sum is {sums.max():.3g}"
            raise InputError(where, problem, f"sums of at most {MOST_SUM:,}, which cannot overflow")


def arrays_under(arrays: Weights, name: str) -> Arrays:
    """The arrays whose names begin with ``name.``, without that prefix."""
    prefix = name + "."
    return {
        key.removeprefix(prefix): value for key, value in arrays.items() if key.startswith(prefix)
    }


def to_bytes(array: np.ndarray) -> np.ndarray:
    """The bytes of an array, which may be structured; those between its fields are 0."""
    if array.dtype.names:
        whole, array = array, np.zeros(array.shape, array.dtype)
        for name in whole.dtype.names or ():
            array[name] = whole[name]
    return np.frombuffer(array.tobytes(), np.uint8)


def from_bytes(content: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """The (N,) array of a type that ``to_bytes`` made the bytes of."""
    return np.frombuffer(content.tobytes(), dtype).copy()


def _make_contiguous(arrays: Weights) -> Arrays:
    return {name: np.asarray(value, order="C") for name, value in arrays.items()}


def _is_sound(array: np.ndarray) -> bool:
    """Whether all numbers are finite, and all truth values 0 or 1."""
    if array.dtype == np.bool_:
        return bool((array.view(np.uint8) <= 1).all())
    return bool(np.isfinite(array).all())


# Sums of single precision, 3e38 at most, stay finite behind seven layers with sums up to this one.
MOST_SUM = 100_000

# The largest file of weights that is read [bytes]; the largest network of a config is half of it.
MODEL_LIMIT = 2**30


# The encoder and the network of each kind of observation.
_KINDS: dict[str, tuple[Any, Any]] = {
    "maps": (Maps, network.PaperNetwork),
    "vector": (Vector, network.DuelingNetwork),
    "sets": (Sets, network.SetNetwork),
}


def make_observation(config: TrainingConfig, space: ScenarioSpace) -> tuple[Layout | None, Any]:
    """What a policy of a config sees of missions of a scenario.

    Returns:
        The layout that it learns, None if it learns to fly on any sea; and the encoder of its
        observations, or the kind of it for any sea.

    Raises:
        InputError: If the observation cannot be made of the scenario.
    """
    if config.algorithm == "ppo":
        return None, Sets
    layout = layout_of(space)
    if config.observation == "maps" and (2 * layout.grid - 1) // POOL < network.NARROWEST:
        raise InputError(
            "observation", f"a grid of {layout.grid} is too small for maps", "vector, sets"
        )
    return layout, _KINDS[config.observation][0](layout)


def expected_weights(config: TrainingConfig, observation: Any) -> Arrays:
    """Arrays of the forms of the weights of a config's network, without their memory."""
    layers = _KINDS[config.observation][1].layer_sizes(observation.shapes, config.hidden)
    return {
        name: array_without_memory(shape) for name, shape in network.weight_shapes(layers).items()
    }


def make_policy(
    config: TrainingConfig, layout: Layout | None, observation: Any, weights: Weights
) -> LearnedPolicy:
    """The policy of a config with these weights."""
    acting = _KINDS[config.observation][1]
    return LearnedPolicy(config.name, observation, acting, weights, config.guard, layout)


def save_policy(
    folder: Path,
    weights: Weights,
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
        ranges: ``field_ranges`` of the scenarios, if these are more than the space.

    Raises:
        InputError: If a file cannot be written.
    """
    layout = None if config.algorithm == "ppo" else layout_of(space)
    description = Description(
        format=FORMAT,
        name=config.name,
        observation_version=_KINDS[config.observation][0].version,
        layout=layout
        and LayoutTable(grid=layout.grid, zone=layout.zone.tolist(), nodes=layout.nodes.tolist()),
        training=config,
        ranges=ranges or field_ranges([space]),
        run=Run(**(run or {})),
    )
    content = save(_make_contiguous(weights), {"format": str(FORMAT)})
    sums = [_hash_content(content)]
    with suppress(Missing):
        sum_before = _hash_content(read_bytes(folder / MODEL, MODEL_LIMIT))
        write_file(
            folder / CONFIG, _write_description(description, [*dict.fromkeys([*sums, sum_before])])
        )
    write_file(folder / MODEL, content)
    write_file(folder / CONFIG, _write_description(description, sums))


def load_policy(folder: Path) -> LearnedPolicy:
    """Load a policy that ``save_policy`` wrote.

    If the best two values are nearly equal, they are computed in double precision, so that an
    action does not depend on the number of rows that are decided together.

    Policies of dess 0.2 have no checksum. They are loaded as well if all weights are finite.

    Raises:
        InputError: If a file is missing, damaged, of another version or of another shape.
    """
    content, description = _read_folder(folder)
    return copy.copy(_make_cached_policy(folder, content, description.model_dump_json()))


def read_weights(folder: Path) -> Arrays:
    """The weights that ``save_policy`` wrote.

    Raises:
        InputError: If a file is missing or damaged.
    """
    return _parse_weights(_read_folder(folder)[0], folder / MODEL)


def _read_folder(folder: Path) -> tuple[bytes, Description]:
    """The content of the file of weights, and its description."""
    path = folder / MODEL
    description = read_description(folder)
    content = read_bytes(path, MODEL_LIMIT, "the folder of a trained policy")
    sums = description.model_sha256
    if sums is not None and _hash_content(content) not in sums:
        if read_description(folder) != description:  # a training has just replaced both files
            return _read_folder(folder)
        raise InputError(
            path, f"damaged: it has not the checksum in {CONFIG}", "the file it was made with"
        )
    return content, description


@lru_cache(maxsize=4)
def _make_cached_policy(folder: Path, content: bytes, text: str) -> LearnedPolicy:
    """The policy of these weights and their description; every process loads one many times."""
    path = folder / MODEL
    where = folder / CONFIG
    description = Description.model_validate_json(text)
    config = description.training
    values = description.layout and description.layout.model_dump()
    try:
        layout, observation = make_observation(config, ScenarioSpace.of(uavs=1, **(values or {})))
    except InputError as error:
        raise error.within(where) from None
    require_version(description.observation_version, observation, where)
    weights = _parse_weights(content, path)
    require_weights(weights, expected_weights(config, observation), str(path))
    policy = make_policy(config, layout, observation, weights)
    policy.learner = learner_identifier(config)
    policy.weights = hash_arrays([config.observation, config.guard, values], weights)
    ticks = description.run.ticks
    if ticks is not None and ticks < config.ticks:
        name = config.name
        if name not in config_names():
            name = "CONFIG"
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
        raise InputError(path, f"observation version {version!r}", str(observation.version))


def _parse_weights(content: bytes, path: Path) -> Arrays:
    try:
        return load(content)
    except (SafetensorError, ValueError, KeyError) as error:
        raise describe_damage(path, error) from None


def _write_description(description: Description, sums: list[str]) -> str:
    content = description.model_dump(mode="json") | {"model_sha256": sums}
    content["run"] = description.run.model_dump(exclude_unset=True)
    return json.dumps(content, indent=2) + "\n"


def _hash_content(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


@lru_cache
def _log_once(line: str) -> None:
    """Log a line for the user; every process loads a policy many times."""
    logging.getLogger(__name__).warning(line)
