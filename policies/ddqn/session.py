"""A training session in a folder: checkpoint, learning curves and the best policy so far.

training = train(load_config("quick"), Path("runs/quick"))
training = train(load_config("quick"), Path("runs/quick"), resume=True)
policy = policies.load("runs/quick")       # from the first evaluation or interruption on
"""

import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
import torch

import dess
from dess.errors import InputError
from dess.files import writable
from policies.ddqn.checkpoint import (
    MODEL,
    load_training,
    replace,
    save_policy,
    save_training,
)
from policies.ddqn.config import CHECKPOINT, TrainingConfig
from policies.ddqn.replay import ReplayMemory
from policies.ddqn.training import Training

CURVE, EVENTS = "training.parquet", "tensorboard"
CHECKPOINT_EVERY = 240.0  # seconds between checkpoints

# Columns of the curve, by the tags under which TensorBoard shows them.
_TAGS = {name: "losses" for name in ("loss", "gradient_norm", "value")}


def device_of(name: str) -> torch.device:
    """The device ``auto`` (CUDA if available), ``cpu`` or ``cuda``.

    Raises:
        InputError: If the name is unknown, or ``cuda`` is not available.
    """
    if name not in ("auto", "cpu", "cuda"):
        raise InputError(f"device: {name!r} is unknown; allowed: auto, cpu, cuda")
    if name == "cuda" and not torch.cuda.is_available():
        raise InputError("device: torch finds no CUDA device here; allowed: auto, cpu")
    return torch.device("cuda" if name != "cpu" and torch.cuda.is_available() else "cpu")


def memory_of(config: TrainingConfig) -> int:
    """The size of the replay memory for a config [bytes]."""
    space = config.space
    return ReplayMemory.bytes_for(config.replay, config.num_envs, space.uavs[1], len(space.nodes))


def train(
    config: TrainingConfig,
    out: Path,
    *,
    resume: bool = False,
    device: str = "auto",
    announce: Callable[[int], None] | None = None,
    progress: Callable[[Training, int], None] | None = None,
) -> Training:
    """Train into a folder, or resume the training in it.

    Ctrl-C and SIGTERM end the session after the present tick. The returned training is then not
    ``done``, and the folder has everything to resume it exactly.

    Args:
        config: The settings.
        out: The folder.
        resume: Whether to resume the training in the folder.
        device: ``auto``, ``cpu`` or ``cuda``.
        announce: Called before any large allocation with the size of the replay memory [bytes].
        progress: Called after each tick with the training and the ticks since the last call.

    Returns:
        The training at the end of the session.

    Raises:
        InputError: If ``resume`` is not set and the folder has a training or a policy; if it is set
            and the folder has no training, or one of another config; if the folder cannot be
            written; if the machine's memory is too small.
    """
    path, place = out / CHECKPOINT, device_of(device)
    if path.exists() and not resume:
        raise InputError(f"{out}: holds a training; allowed: --resume, or another folder")
    if not path.exists() and resume:
        raise InputError(f"{path}: no such file; allowed: the folder of a training")
    if (out / MODEL).exists() and not resume:
        raise InputError(f"{out}: holds a policy; allowed: another folder")
    if announce:
        announce(memory_of(config))
    try:
        training = load_training(path, config, place) if resume else Training(config, place)
    except MemoryError as error:
        raise InputError(
            f"replay: the memory takes {memory_of(config) / 2**30:.1f} GiB, too much for this "
            "machine; allowed: fewer environments or slots"
        ) from error
    if not resume:
        with writable(out):
            out.mkdir(parents=True, exist_ok=True)
        save_training(path, training)
    with _stop_signal() as stopped, _tensorboard(out / EVENTS, training) as show:
        saved = time.monotonic()
        while not training.done and not stopped():
            rows = len(training.curve)
            training.run(1)
            if len(training.curve) > rows:
                show(training.curve[-1])
                _save_results(out, training)
            if time.monotonic() - saved > CHECKPOINT_EVERY:
                save_training(path, training)
                saved = time.monotonic()
            if progress:
                progress(training, 1)
        save_training(path, training)
    _save_results(out, training)
    return training


def _save_results(out: Path, training: Training) -> None:
    """Write the policy so far, and the learning curves from the first evaluation on."""
    cuda = training.device.type == "cuda"
    run = {
        "dess": dess.__version__,
        "torch": torch.__version__,
        "device": torch.cuda.get_device_name(training.device) if cuda else "cpu",
        "threads": torch.get_num_threads(),
        "ticks": training.tick,
        "updates": training.updates,
        "uav_slots": training.uav_slots,
        "seconds": round(training.seconds),
        "selection_score": training.best_score,
    }
    save_policy(out, training.kept, training.config, training.space, run)
    if not training.curve:
        return
    names = dict.fromkeys(name for row in training.curve for name in row)
    table = pa.table({name: [row.get(name) for row in training.curve] for name in names})
    replace(out / CURVE, lambda new: pq.write_table(table, new))


@contextmanager
def _stop_signal() -> Iterator[Callable[[], bool]]:
    """Let SIGINT and SIGTERM stop the session after the tick; a second signal stops it at once."""
    received: list[int] = []

    def receive(number: int, frame: Any) -> None:
        received.append(number)
        if len(received) > 1:
            raise KeyboardInterrupt

    numbers = (signal.SIGINT, signal.SIGTERM)
    handlers = {number: signal.signal(number, receive) for number in numbers}
    try:
        yield lambda: bool(received)
    finally:
        for number, handler in handlers.items():
            signal.signal(number, handler)


@contextmanager
def _tensorboard(folder: Path, training: Training) -> Iterator[Callable[[dict[str, Any]], None]]:
    """Write the rows of the curve for TensorBoard, if it is installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        yield lambda row: None
        return
    with SummaryWriter(str(folder), purge_step=training.tick + 1) as writer:

        def show(row: dict[str, Any]) -> None:
            for name, value in row.items():
                kind, _, metric = name.partition("_")
                if kind in ("evaluation", "training"):
                    writer.add_scalar(f"{kind}/{metric}", value, row["tick"])
                elif isinstance(value, float):
                    writer.add_scalar(f"{_TAGS.get(name, 'charts')}/{name}", value, row["tick"])

        yield show
