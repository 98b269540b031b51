"""A trained policy as a folder: ``model.safetensors`` (the weights) and ``config.json``.

``config.json`` describes the weights (``dess.policies.learner.description``) and has their
checksum. A policy of vectors or of sets acts with ``integers.safetensors``, which was made of these
weights (``dess.policies.learner.calibration``) and has a checksum of both.
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
from safetensors import SafetensorError
from safetensors.numpy import load, save

from dess.base.errors import InputError
from dess.base.files.reading import Missing, read_bytes
from dess.base.files.writing import write_file
from dess.envs.observations.maps import POOL, Maps
from dess.envs.observations.sets import Sets
from dess.envs.observations.states import Layout, layout_of
from dess.envs.observations.vector import Vector
from dess.policies import network
from dess.policies.dense import dense_forms
from dess.policies.integers import HIDDEN, Integers, check_integers, integer_forms
from dess.policies.learner.arrays import (
    Arrays,
    array_without_memory,
    describe_damage,
    hash_arrays,
    make_contiguous,
    require_same_forms,
    require_weights,
)
from dess.policies.learner.config import (
    TrainingConfig,
    config_names,
    learner_identifier,
    resume_command,
)
from dess.policies.learner.description import (
    CONFIG,
    FORMAT,
    MODEL,
    Description,
    LayoutTable,
    Run,
    field_ranges,
    read_description,
)
from dess.policies.learner.policy import (
    DenseIntegerNetwork,
    FloatNetwork,
    IntegerNetwork,
    LearnedPolicy,
)
from dess.policies.network import Weights
from dess.scenario.scenario import ScenarioSpace

INTEGERS = "integers.safetensors"
INTEGER_KINDS = f"vector, or sets with hidden {HIDDEN}"  # that ``has_integers``
_SUM = "sha256"  # the array with the checksum of integers and of the weights they are made of
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
    """The policy of a config that acts with these float weights."""
    acting = FloatNetwork(_KINDS[config.observation][1], weights)
    return LearnedPolicy(config.name, observation, acting, config.guard, layout)


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
    content = save(make_contiguous(weights), {"format": str(FORMAT)})
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
    integers = b""
    with suppress(Missing):
        integers = read_bytes(folder / INTEGERS, MODEL_LIMIT)
    described = description.model_dump_json()
    return copy.copy(_make_cached_policy(folder, content, described, integers))


def load_teacher(folder: Path) -> tuple[LearnedPolicy, Arrays, TrainingConfig]:
    """A trained policy that acts with its float weights, the weights, and its config.

    Raises:
        InputError: As ``load_policy``.
    """
    content, description = _read_folder(folder)
    described = description.model_dump_json()
    policy = copy.copy(_make_cached_policy(folder, content, described, None))
    return policy, _parse_weights(content, folder / MODEL), description.training


def has_integers(config: TrainingConfig) -> bool:
    """Whether a policy of a config can act in integers."""
    if config.observation == "sets":
        return tuple(config.hidden) == HIDDEN
    return config.observation == "vector"


def _integer_forms(config: TrainingConfig, observation: Any) -> Arrays:
    """Arrays of the forms of the integers of a config's network."""
    if config.observation == "sets":
        return integer_forms()
    ((inputs,),) = observation.shapes
    return dense_forms(inputs, config.hidden)


def _integer_network(config: TrainingConfig, observation: Any, integers: Integers) -> Any:
    """The network of a config that acts with these integers."""
    if config.observation == "sets":
        return IntegerNetwork(integers)
    ((inputs,),) = observation.shapes
    return DenseIntegerNetwork(integers, inputs, config.hidden)


def save_integers(folder: Path, integers: Integers) -> None:
    """Write the integers of the weights that a folder has.

    Raises:
        InputError: If the file cannot be written.
    """
    arrays = integers._asdict()
    arrays[_SUM] = _sum_of(arrays, read_bytes(folder / MODEL, MODEL_LIMIT))
    write_file(folder / INTEGERS, save(make_contiguous(arrays)))


def _parse_integers(content: bytes, model: bytes, forms: Arrays, path: Path) -> Integers | None:
    """The integers in the content of a file; None without the checksum for these weights.

    Raises:
        InputError: If it is no file of integers.
    """
    try:
        arrays = load(content)
    except (SafetensorError, ValueError, KeyError) as error:
        raise describe_damage(path, error) from None
    require_same_forms(arrays, forms | {_SUM: np.empty(32, np.uint8)}, str(path))
    expected = arrays.pop(_SUM)
    if not np.array_equal(expected, _sum_of(arrays, model)):
        return None
    integers = Integers(**arrays)
    check_integers(integers, path)
    return integers


def _sum_of(integers: Arrays, model: bytes) -> np.ndarray:
    """The checksum of integers and of the file of weights that they are made of, as an array."""
    return np.frombuffer(bytes.fromhex(hash_arrays(_hash_content(model), integers)), np.uint8)


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
def _make_cached_policy(
    folder: Path, content: bytes, text: str, integers: bytes | None
) -> LearnedPolicy:
    """The policy of these weights and their description; every process loads one many times.

    Args:
        folder: The folder, for messages.
        content: The file of weights.
        text: The description.
        integers: The file of integers, empty if there is none; None to act in floats.
    """
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
    parsed = None
    if integers and has_integers(config):
        forms = _integer_forms(config, observation)
        parsed = _parse_integers(integers, content, forms, folder / INTEGERS)
    if parsed:
        acting = parsed._asdict()
        chosen = _integer_network(config, observation, parsed)
        policy = LearnedPolicy(config.name, observation, chosen, config.guard, layout)
    else:
        acting = weights
        policy = make_policy(config, layout, observation, weights)
    policy.learner = learner_identifier(config)
    policy.weights = hash_arrays([config.observation, config.guard, values], acting)
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
    elif integers is not None and has_integers(config) and not parsed:
        _log_once(
            f"{folder}: there are no integers of these weights, so the policy acts in floats, more "
            f"slowly; make them with python -m dess.policies.learner.calibration {folder}"
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
