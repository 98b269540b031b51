"""Checkpoints: one file, ``checkpoint.safetensors``, from which a training continues exactly.

The file has all arrays of the training and, in its header as JSON, everything else with a checksum
of both. It may come from anybody: compiled code does not check its indices, such as cells and
actions, so they are compared with what the scenario has. Nothing is unpickled.
"""

import json
from collections.abc import Mapping
from math import ceil
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import torch
from pydantic import Field, create_model

from dess.base.errors import InputError
from dess.base.files.documents import Document, Sha256
from dess.base.files.reading import parse_json
from dess.envs.observations import states as column
from dess.model.record import MISSION_RECORD
from dess.model.state import ACTION_NAMES, END_NAMES, State, constants_of, types_of
from dess.policies.learner.arrays import (
    Arrays,
    array_without_memory,
    arrays_under,
    from_bytes,
    hash_arrays,
    read_arrays,
    require_same_forms,
    to_bytes,
    write_arrays,
)
from dess.policies.learner.config import CHECKPOINT, Name, TrainingConfig
from dess.policies.learner.description import Number
from dess.policies.learner.dqn import DQNTraining
from dess.policies.learner.network import to_arrays, to_tensors
from dess.policies.learner.ppo import ProximalTraining
from dess.policies.learner.trained import require_version
from dess.policies.learner.training import EVALUATED_METRICS, Training
from dess.scenario.fields import SAMPLED
from dess.scenario.scenario import ScenarioSpace

FORMAT = 2
# Room for the header of a checkpoint; safetensors allows 100 MB.
HEADER_LIMIT = 10**8

_WHOLE = "a checkpoint as dess train has written it"


class Progress(Document):
    """The attributes of a training that are plain values, but for the curve."""

    tick: Number
    updates: Number
    uav_slots: Number
    seconds: float
    phase_index: Number
    phase_start: Number
    scores: list[float]
    best_score: float | None


_OF_ROWS: dict[str, Any] = {
    **dict.fromkeys(("tick", "uav_slots", "updates"), Number),
    **dict.fromkeys(("seconds", "epsilon", "learning_rate", "moving_average"), float),
    **{"phase": Name, "is_best": bool},
    **{f"evaluation_{name}": float for name in EVALUATED_METRICS},
}
_OF_LATER_ROWS = (
    "loss",
    "value",
    "gradient_norm",
    *(f"training_{name}" for name in EVALUATED_METRICS),
)

# A row of the curve: the metrics of an evaluation and, if there are any since the last one, of
# updates and of missions that have ended.
Row: Any = create_model(
    "Row",
    __base__=Document,
    **{name: (kind, ...) for name, kind in _OF_ROWS.items()},
    **dict.fromkeys(_OF_LATER_ROWS, (float | None, None)),
)  # type: ignore[call-overload]


class Header(Document):
    """The header of a checkpoint, without its checksum."""

    format: Literal[2] = Field(description="version of the file")
    config: TrainingConfig = Field(description="settings of the training")
    scenario: dict[str, Any] = Field(description="fields of the scenario")
    observation_version: Number = Field(description="version of the encoding of observations")
    progress: Progress = Field(description="progress of the training")
    random: dict[str, Any] = Field(description="state of numpy's generator, which checks it")
    stepper: Annotated[list[Number], Field(max_length=2)] = Field(
        description="seed and next replication of the missions in progress, if there are any"
    )
    replay: Number | None = Field(description="slots that were added to the replay memory")
    curve: list[Row] = Field(description="rows of the learning curve")
    sha256: Sha256 = Field(description="checksum of all else")


def new_training(config: TrainingConfig, device: torch.device) -> Training:
    """A new training, by the algorithm of its config."""
    if config.algorithm == "dqn":
        return DQNTraining(config, device)
    return ProximalTraining(config, device)


def save_training(path: Path, training: Training) -> None:
    """Write a checkpoint from which a training continues as if it had not been interrupted.

    Raises:
        InputError: If it cannot be written.
    """
    values = _common_arrays(training)
    for optimizer, of_optimizer in training.learner.optimizers.items():
        for index, state in of_optimizer.state_dict()["state"].items():
            values |= to_arrays({f"{optimizer}.{index}.{key}": state[key] for key in state})
    if training.finished:
        values["finished"] = to_bytes(np.concatenate(training.finished))
    if training.losses:
        for name in training.losses[0]:
            losses = torch.stack([loss[name] for loss in training.losses])
            values |= to_arrays({f"losses.{name}": losses})
    header = {
        "format": FORMAT,
        "config": training.config.model_dump(mode="json"),
        "scenario": training.space.model_dump(mode="json"),
        "observation_version": training.observation.version,
        "progress": {name: getattr(training, name) for name in Progress.model_fields},
        "random": training.generator.bit_generator.state,
        "stepper": [],
        "replay": None,
        "curve": training.curve,
    }
    if isinstance(training, DQNTraining):
        header["stepper"] = [training.stepper.seed, training.stepper.replication]
        if training.config.checkpoint_replay:
            header["replay"] = training.replay.count
    header["sha256"] = hash_arrays(header, values)
    write_arrays(path, values, {"dess": json.dumps(header)})


def load_training(
    path: Path, config: TrainingConfig, device: torch.device, limit: int | None = None
) -> Training:
    """Load a training from a checkpoint that ``save_training`` wrote.

    If the checkpoint has no replay memory, the present policy fills it again.

    Args:
        path: The checkpoint.
        config: The settings of the training.
        device: The device of the training.
        limit: The largest size of the arrays [bytes].

    Raises:
        InputError: If the file is missing, damaged, of another version or of another config.
    """
    if limit is None:
        limit = 2**36
    values, metadata = read_arrays(path, HEADER_LIMIT + limit)
    if "dess" not in metadata:
        raise InputError(path, "no checkpoint of a training", f"{CHECKPOINT} of one")
    header = Header.parse(metadata["dess"], str(path), fixed={"format": FORMAT})
    raw = parse_json(metadata["dess"], str(path))
    training = new_training(config, device)
    settings = config.model_dump(mode="json") | {"scenario": training.space.model_dump(mode="json")}
    saved = header.config.model_dump(mode="json") | {"scenario": header.scenario}
    if different := [key for key in settings if settings[key] != saved[key]]:
        raise InputError(
            path, f"of another config ({', '.join(different)} differ)", "the one it began with"
        )
    require_version(header.observation_version, training.observation, path)
    if hash_arrays({k: v for k, v in raw.items() if k != "sha256"}, values) != header.sha256:
        raise InputError(path, "damaged: its content has not the checksum of its header", _WHOLE)
    try:
        training.enter_phase(header.progress.phase_index)
        for name, value in raw["progress"].items():
            setattr(training, name, value)
        finished = len(values.get("finished", ())) // MISSION_RECORD.itemsize
        require_same_forms(values, _expected_arrays(training, finished), str(path))
        _restore_training(training, values, raw)
    except (LookupError, ValueError, TypeError, RuntimeError, OverflowError) as error:
        problem = str(error)
        if isinstance(error, InputError):
            problem = error.problem
        raise InputError(path, f"damaged, or of another scenario: {problem}", _WHOLE) from None
    return training


def _restore_training(training: Training, values: Arrays, header: dict[str, Any]) -> None:
    """Restore the state of a saved training in a new training that is in the same phase."""
    with torch.no_grad():
        for name, network in _network_arrays(training).items():
            for key, value in to_tensors(arrays_under(values, name)).items():
                network[key].copy_(value)
    for optimizer, of_optimizer in training.learner.optimizers.items():
        states: dict[int, dict[str, torch.Tensor]] = {}
        for key, value in to_tensors(arrays_under(values, optimizer)).items():
            index, _, field = key.partition(".")
            states.setdefault(int(index), {})[field] = value
        groups = of_optimizer.state_dict()["param_groups"]
        of_optimizer.load_state_dict({"state": states, "param_groups": groups})
    if isinstance(training, DQNTraining):
        training.stepper.start_at(*header["stepper"])
        for name, array in _mission_arrays(training).items():
            restored = values[name]
            if name.startswith("stepper."):
                restored = from_bytes(restored, array.dtype)
            array[...] = restored.reshape(array.shape)
        _check_state(training.stepper.state, training.stepper.space)
        if training.config.checkpoint_replay:
            training.replay.count = int(header["replay"])
            _check_replay(training.replay.arrays, max(training.space.size))
    if "finished" in values:
        training.finished = [from_bytes(values["finished"], MISSION_RECORD)]
    losses = to_tensors(arrays_under(values, "losses"), training.device)
    for row in zip(*losses.values(), strict=True):
        training.losses.append(dict(zip(losses, row, strict=True)))
    training.curve = header["curve"]
    training.generator.bit_generator.state = header["random"]
    torch.set_rng_state(torch.tensor(values["random.torch"]))


def _expected_arrays(training: Training, finished: int) -> Arrays:
    """Arrays of the forms that a checkpoint of a training has at its tick.

    Args:
        training: The training, with its progress restored.
        finished: The number of missions that ended since the last evaluation.
    """
    config = training.config
    forms = _common_arrays(training)
    for optimizer, of_optimizer in training.learner.optimizers.items():
        if training.tick - training.phase_start <= training.learner.ticks_before_step(optimizer):
            continue
        for index, weight in enumerate(of_optimizer.param_groups[0]["params"]):
            forms[f"{optimizer}.{index}.step"] = array_without_memory(())
            for name in ("exp_avg", "exp_avg_sq"):
                forms[f"{optimizer}.{index}.{name}"] = array_without_memory(weight.shape)
    last = training.tick - training.tick % config.evaluate_every
    updates = (training.tick - max(last, training.phase_start)) * config.updates
    if updates and not training.done:
        for name in ("loss", "value", "gradient_norm"):
            forms[f"losses.{name}"] = array_without_memory((updates,))
    if finished:
        forms["finished"] = array_without_memory((finished * MISSION_RECORD.itemsize,), np.uint8)
    return forms


def _common_arrays(training: Training) -> Arrays:
    """The arrays that every checkpoint of a training has, by name."""
    arrays = to_arrays({"random.torch": torch.get_rng_state()})
    for name, network in _network_arrays(training).items():
        arrays |= to_arrays({f"{name}.{key}": value for key, value in network.items()})
    for name, array in _mission_arrays(training).items():
        if name.startswith("stepper."):
            array = to_bytes(array)
        arrays[name] = array
    return arrays


def _mission_arrays(training: Training) -> dict[str, np.ndarray]:
    """The arrays of the missions in progress and of the replay memory, if a training has them."""
    if not isinstance(training, DQNTraining):
        return {}
    arrays = {"early": training.early}
    arrays |= {f"stepper.{k}": array for k, array in training.stepper.state._asdict().items()}
    if training.config.checkpoint_replay:
        arrays |= {f"replay.{k}": array for k, array in training.replay.arrays.items()}
    return arrays


def _network_arrays(training: Training) -> dict[str, dict[str, torch.Tensor]]:
    """The weights of all networks of a training, by name."""
    networks = {name: state_of.state_dict() for name, state_of in training.learner.networks.items()}
    return networks | {"best": training.best}


# What a mission has of its own; all other fields are constants of the scenario.
_OF_MISSIONS = (
    *("seed", "replication", "slot", "active", "initial", "arrived", "collected", "lost"),
    *("slot_collected", "uav_failures", "slots_grounded", "pad_requests", "pads_out", "newest"),
)


def _check_state(state: State, space: ScenarioSpace) -> None:
    """Refuse missions whose sizes and indices are not those of the scenario.

    Args:
        state: The missions.
        space: The scenario from which they were drawn.

    Raises:
        ValueError: If a value is out of range.
    """
    missions, uavs = state.missions, state.uavs
    constants = constants_of(space)
    fleet = uavs.shape[1]
    for name in sorted(set(constants.dtype.names or ()) - {*SAMPLED, *_OF_MISSIONS}):
        if (missions[name] != constants[name]).any():
            raise ValueError(f"missions: {name} is not that of the scenario")
    is_there = np.arange(fleet) < missions["uavs"][:, None]
    edge = max(space.size) - 1
    slots = space.max_slots
    kinds = types_of(space, fleet)
    cells = ("x", "y", "from_x", "from_y")
    actions = ("action", "executed")
    truths = dict.fromkeys(("active", "latch", "charging", "grounded", "overruled"), (0, 1))
    of_uavs = {
        **dict.fromkeys(cells, (-1, edge)),
        **dict.fromkeys(actions, (0, len(ACTION_NAMES) - 1)),
        "slots_per_cell": (1, kinds["slots_per_cell"].max()),
        "slots_left": (0, uavs["slots_per_cell"] - 1),
        "end": (0, len(END_NAMES) - 1),
        "pad": (-1, space.charging_pads - 1),
        "zone": (-2, len(space.rectangles) - 1),
        "served": (-1, len(space.nodes) - 1),
    }
    for name in ("charge_rate", "rate_slots"):  # a divisor
        if (uavs[name] != kinds[name]).any():
            raise ValueError(f"uavs: {name} is not that of the scenario")
    allowed: list[tuple[np.ndarray, dict[str, tuple[int, Any]]]] = [
        (missions, {"uavs": (1, fleet), "slot": (0, slots)}),
        (uavs, of_uavs | truths),
        (uavs[is_there], dict.fromkeys(cells, (0, edge))),
        # Ages are indices of peaks.
        (state.sensors, {"newest": (-ceil(space.idle_slots), missions["slot"][:, None])}),
    ]
    for records, ranges in allowed:
        for name, (low, high) in ranges.items():
            values = records[name]
            if name in truths:  # in a file, any byte may stand for one
                values = values.view(np.uint8)
            if not ((values >= low) & (values <= high)).all():
                raise ValueError(f"{name} is out of range")


def _check_replay(arrays: Mapping[str, np.ndarray], grid: int) -> None:
    """Refuse a replay memory whose cells or actions are out of range.

    Args:
        arrays: The arrays of the memory.
        grid: Cells along one side of the grid.

    Raises:
        ValueError: If a value is out of range.
    """
    cells = arrays["uavs"][..., [column.X, column.Y]]
    actions = arrays["action"]
    for values, count in ((cells, grid), (actions, len(ACTION_NAMES))):
        if (values < 0).any() or (values >= count).any():
            raise ValueError("replay memory: a cell or an action is out of range")
