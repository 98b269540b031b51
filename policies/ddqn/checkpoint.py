"""Checkpoints: one file, ``checkpoint.safetensors``, from which a training continues exactly.

The file has all arrays of the training and, in its header as JSON, everything else with a checksum
of both. It may come from anybody: what it holds is compared with what the config allows before it
is copied into the training: compiled code uses cells, actions and counters as indices and does not
check them. Nothing is unpickled.
"""

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
import torch
from pydantic import Field, create_model

from dess.env.stepper import MissionStepper
from dess.errors import InputError
from dess.files.documents import Document
from dess.files.parsing import parse_json
from dess.observations import states as column
from dess.record import MISSION_RECORD
from dess.scenario import SAMPLED, ScenarioSpace
from dess.state import ACTION_NAMES, END_NAMES, State, constants_of, ranges_of, types_of
from policies.ddqn import tensors
from policies.ddqn.config import CHECKPOINT, TrainingConfig
from policies.ddqn.description import Name, Number, Sha256
from policies.ddqn.proximal import training_of
from policies.ddqn.tensors import Tensors, array_of, bytes_of, part
from policies.ddqn.trained import require_version
from policies.ddqn.training import METRICS, Training

FORMAT = 2
# Room for the header of a checkpoint; safetensors allows 100 MB.
HEADER_LIMIT = 10**8

_WHOLE = "a checkpoint as dess train has written it"

Amount = Annotated[float, Field(ge=0.0)]


class Progress(Document):
    """What ``Training.progress`` returns."""

    tick: Number
    updates: Number
    uav_slots: Number
    seconds: Amount
    phase_index: Number
    phase_start: Number
    scores: list[float]
    best_score: float | None


class _Row(Document):
    tick: Number
    phase: Name
    uav_slots: Number
    updates: Number
    seconds: Amount
    epsilon: float
    learning_rate: float
    moving_average: float
    is_best: bool
    loss: float | None = None
    value: float | None = None
    gradient_norm: float | None = None


# A row of the curve: the metrics of an evaluation and, once missions have ended, of the training.
Row: Any = create_model(
    "Row",
    __base__=_Row,
    **{f"evaluation_{name}": (float, ...) for name in METRICS},
    **{f"training_{name}": (float | None, None) for name in METRICS},
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


def save_training(path: Path, training: Training) -> None:
    """Write a checkpoint from which a training continues as if it had not been interrupted.

    Raises:
        InputError: If it cannot be written.
    """
    values = _arrays(training)
    for optimizer, of_optimizer in training.learner.optimizers().items():
        for index, state in of_optimizer.state_dict()["state"].items():
            values |= {f"{optimizer}.{index}.{key}": value for key, value in state.items()}
    if training.finished:
        values["finished"] = bytes_of(np.concatenate(training.finished))
    for name in training.losses[0] if training.losses else ():
        values[f"losses.{name}"] = torch.stack([loss[name] for loss in training.losses])
    header = {
        "format": FORMAT,
        "config": training.config.model_dump(mode="json"),
        "scenario": training.space.model_dump(mode="json"),
        "observation_version": training.observation.version,
        "progress": training.progress(),
        "random": training.generator.bit_generator.state,
        "stepper": [
            n for sea in training.seas for n in (sea.stepper.seed, sea.stepper.replication)
        ],
        "replay": _slots_held(training, [sea.replay.count for sea in training.seas]),
        "curve": training.curve,
    }
    header["sha256"] = tensors.digest(header, values)
    tensors.write(path, values, {"dess": json.dumps(header)})


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
    values, metadata = tensors.read(path, HEADER_LIMIT + (2**36 if limit is None else limit))
    if "dess" not in metadata:
        raise InputError(f"{path}: no checkpoint of a training; allowed: {CHECKPOINT} of one")
    header = Header.parse(metadata["dess"], str(path), fixed={"format": FORMAT})
    raw = parse_json(metadata["dess"], str(path))
    training = training_of(config, device)
    settings = config.model_dump(mode="json") | {"scenario": training.space.model_dump(mode="json")}
    held = header.config.model_dump(mode="json") | {"scenario": header.scenario}
    if different := [key for key in settings if settings[key] != held[key]]:
        raise InputError(
            f"{path}: of another config ({', '.join(different)} differ); "
            "allowed: the one it began with"
        )
    require_version(header.observation_version, training.observation, path)
    _check_progress(header, training, path)
    training.restore(raw["progress"])
    finished = len(values.get("finished", ())) // MISSION_RECORD.itemsize
    tensors.require_forms(values, _forms(training, finished), str(path))
    if tensors.digest({k: v for k, v in raw.items() if k != "sha256"}, values) != header.sha256:
        raise InputError(
            f"{path}: damaged: its content has not the checksum of its header; allowed: {_WHOLE}"
        )
    try:
        _restore(training, values, raw)
    except (LookupError, ValueError, TypeError, RuntimeError, OverflowError) as error:
        problem = str(error).partition("; allowed:")[0]
        raise InputError(
            f"{path}: damaged, or of another scenario: {problem}; allowed: {_WHOLE}"
        ) from None
    return training


def _check_progress(header: Header, training: Training, path: Path) -> None:
    """Refuse counters that a training of this config never has together."""
    config, now = training.config, header.progress
    starts = np.cumsum([0, *(phase.ticks for phase in config.phases)]).tolist()
    index = min(now.phase_index, len(config.phases) - 1)
    begun, end = starts[index], starts[index + 1]
    evaluations = now.tick // config.evaluate_every - begun // config.evaluate_every
    evaluations += now.tick == config.ticks and now.tick % config.evaluate_every > 0
    slots = now.tick - begun + (config.learning_starts if now.tick > begun else 0)
    right = {
        "phase_index": now.phase_index == index,
        "phase_start": now.phase_start == begun,
        "tick": begun <= now.tick < end or now.tick == end == config.ticks,
        "updates": now.updates == now.tick * config.updates,
        "scores": len(now.scores) == min(evaluations, config.window),
        "best_score": (now.best_score is None) == (evaluations == 0),
        "curve": all(row.tick <= now.tick for row in header.curve)
        and len(header.curve) >= evaluations,
        "replay": header.replay == _slots_held(training, [slots]),
        "stepper": len(header.stepper) == 2 * len(training.seas)
        and all(
            seed == sea.stepper.seed and replication < 2**32
            for sea, (seed, replication) in zip(training.seas, [header.stepper], strict=False)
        ),
    }
    for name in (name for name, is_right in right.items() if not is_right):
        raise InputError(f"{path}: {name} does not fit the config; allowed: an undamaged file")


def _restore(training: Training, values: Tensors, header: dict[str, Any]) -> None:
    """Restore the state of a saved training in a new training that is in the same phase."""
    learner = training.learner
    with torch.no_grad():
        for name, network in _networks(training).items():
            for key, value in part(values, name).items():
                network[key].copy_(value)
    for optimizer, of_optimizer in learner.optimizers().items():
        states: dict[int, Tensors] = {}
        for key, value in part(values, optimizer).items():
            index, _, field = key.partition(".")
            states.setdefault(int(index), {})[field] = value
        groups = of_optimizer.state_dict()["param_groups"]
        of_optimizer.load_state_dict({"state": states, "param_groups": groups})
    for sea in training.seas:
        sea.stepper.start_at(*header["stepper"])
        sea.early[...] = values["early"].numpy()
        stored_state = part(values, "stepper")
        for name, array in sea.stepper.state._asdict().items():
            array[...] = array_of(stored_state[name], array.dtype).reshape(array.shape)
        _check_state(sea.stepper.state, sea.space, sea.stepper)
        if training.config.checkpoint_replay:
            sea.replay.count = header["replay"]
            stored_replay = part(values, "replay")
            for name, array in sea.replay.arrays.items():
                array[...] = stored_replay[name].numpy()
            _check_replay(sea.replay.arrays, max(sea.space.size))
    if "finished" in values:
        training.finished = [array_of(values["finished"], MISSION_RECORD)]
        _check_finite(training.finished[0])
    losses = {key: value.to(training.device) for key, value in part(values, "losses").items()}
    for row in zip(*losses.values(), strict=True):
        training.losses.append(dict(zip(losses, row, strict=True)))
    training.curve = header["curve"]
    training.generator.bit_generator.state = header["random"]
    torch.set_rng_state(values["random.torch"])


def _forms(training: Training, finished: int) -> Tensors:
    """Tensors of the forms that a checkpoint of a training has at its tick.

    Args:
        training: The training, with its progress restored.
        finished: The number of missions that ended since the last evaluation.
    """
    config, forms = training.config, _arrays(training)
    for optimizer, of_optimizer in training.learner.optimizers().items():
        if training.tick - training.phase_start <= training.learner.waits(optimizer):
            continue
        for index, weight in enumerate(of_optimizer.param_groups[0]["params"]):
            forms[f"{optimizer}.{index}.step"] = torch.empty((), device="meta")
            for name in ("exp_avg", "exp_avg_sq"):
                forms[f"{optimizer}.{index}.{name}"] = torch.empty(weight.shape, device="meta")
    last = training.tick - training.tick % config.evaluate_every
    updates = (training.tick - max(last, training.phase_start)) * config.updates
    if updates and not training.done:
        for name in ("loss", "value", "gradient_norm"):
            forms[f"losses.{name}"] = torch.empty(updates, device="meta")
    if finished:
        forms["finished"] = torch.empty(
            finished * MISSION_RECORD.itemsize, dtype=torch.uint8, device="meta"
        )
    return forms


def _arrays(training: Training) -> Tensors:
    """The arrays that every checkpoint of a training has, by name."""
    arrays: Tensors = {"random.torch": torch.get_rng_state()}
    for name, network in _networks(training).items():
        arrays |= {f"{name}.{key}": value for key, value in network.items()}
    for sea in training.seas:
        arrays["early"] = torch.from_numpy(sea.early)
        for name, array in sea.stepper.state._asdict().items():
            arrays[f"stepper.{name}"] = bytes_of(array)
        if training.config.checkpoint_replay:
            for name, array in sea.replay.arrays.items():
                arrays[f"replay.{name}"] = torch.from_numpy(array)
    return arrays


def _slots_held(training: Training, slots: list[int]) -> int | None:
    """What a header says of a replay memory to which so many slots were added."""
    return slots[0] if training.seas and training.config.checkpoint_replay else None


def _networks(training: Training) -> dict[str, Tensors]:
    """The weights of all networks of a training, by name."""
    networks = {name: of.state_dict() for name, of in training.learner.networks().items()}
    return networks | {"best": training.best}


# What a mission has of its own; all other fields are constants of the scenario.
_OF_MISSIONS = (
    *("replication", "slot", "active", "initial", "arrived", "collected", "slot_collected", "lost"),
    *("uav_failures", "slots_grounded", "pad_requests", "pads_out", "newest"),
)


def _check_state(state: State, space: ScenarioSpace, stepper: MissionStepper) -> None:
    """Refuse missions that cannot be missions of the scenario.

    Args:
        state: The missions.
        space: The scenario from which they were drawn.
        stepper: The seed of the missions, and the next replication.

    Raises:
        ValueError: If a value is out of range.
    """
    missions, uavs = state.missions, state.uavs
    constants = constants_of(space)
    constants["seed"] = stepper.seed
    for name in sorted(set(constants.dtype.names or ()) - {*SAMPLED, *_OF_MISSIONS}):
        if (missions[name] != constants[name]).any():
            raise ValueError(f"missions: {name} is not that of the scenario")
    edge, slots, fleet = max(space.size) - 1, space.max_slots, uavs.shape[1]
    is_there = np.arange(fleet) < missions["uavs"][:, None]
    types = np.broadcast_to(types_of(space, fleet), uavs.shape)
    for name in ("quota", "slots_per_cell", "rate"):
        if (uavs[name] != types[name])[is_there].any():
            raise ValueError(f"uavs: {name} is not that of the scenario")
    cells, actions = ("x", "y", "from_x", "from_y"), ("action", "executed")
    counters = ("slots_flying", "slots_charging", "slots_waiting")
    of_missions = dict(zip(SAMPLED, ranges_of(space).tolist(), strict=True)) | {
        "replication": (0, stepper.replication - 1),
        "slot": (0, slots),
        "pads_out": (0, 1),
    }
    of_uavs = {
        **dict.fromkeys(cells, (-1, edge)),
        **dict.fromkeys(actions, (0, len(ACTION_NAMES) - 1)),
        **dict.fromkeys(counters, (0, slots)),
        "battery": (0, 100),
        "communications": (0, int(types["quota"].max()) + space.communication_slots),
        "slots_left": (0, uavs["slots_per_cell"] - 1),
        "end": (0, len(END_NAMES) - 1),
        "pad_request": (-1, slots),
        "pad": (-1, space.charging_pads - 1),
        "zone": (-2, len(space.rectangles) - 1),
        "served": (-1, len(space.nodes) - 1),
    }
    truths = dict.fromkeys(("active", "latch", "charging", "grounded", "overruled"), (0, 1))
    allowed: list[tuple[np.ndarray, Any]] = [(missions, of_missions), (uavs, of_uavs | truths)]
    allowed.append((uavs[is_there], dict.fromkeys(cells, (0, edge))))
    for records, ranges in allowed:
        for name, (low, high) in ranges.items():
            # A truth value of a file may be any byte.
            values = records[name].view(np.uint8) if name in truths else records[name]
            if ((values < low) | (values > high)).any():
                raise ValueError(f"{name} is out of range")
    if (uavs["active"] & ~is_there).any() or (uavs["active"].sum(1) != missions["active"]).any():
        raise ValueError("missions: active UAVs that are not there")
    _check_finite(missions)
    _check_finite(uavs)
    if not (np.isfinite(state.residual) & (state.residual >= 0)).all():
        raise ValueError("missions: residual data out of range")


def _check_replay(arrays: Mapping[str, np.ndarray], grid: int) -> None:
    """Refuse a replay memory whose cells, counters or actions are out of range.

    Args:
        arrays: The arrays of the memory.
        grid: Cells along one side of the grid.

    Raises:
        ValueError: If a value is out of range.
    """
    most = np.ones(column.UAV_COLUMNS, np.int64)  # truth values, but for:
    most[[column.X, column.Y]] = grid - 1
    most[column.BATTERY] = 100
    most[[column.NEEDED, column.HOME]] = np.iinfo(np.int16).max
    most[column.MASK] = 2 ** len(ACTION_NAMES) - 1
    highest_of = {"missions": 100, "uavs": most, "action": len(ACTION_NAMES) - 1}
    for name, highest in highest_of.items():
        if (arrays[name] < 0).any() or (arrays[name] > highest).any():
            raise ValueError(f"replay memory: {name} out of range")


def _check_finite(records: np.ndarray) -> None:
    """Refuse records with a number that is not finite.

    Raises:
        ValueError: If there is one.
    """
    for name in records.dtype.names or ():
        if records[name].dtype.kind == "f" and not np.isfinite(records[name]).all():
            raise ValueError(f"{name} is not finite")
