"""A training session in a folder: checkpoint, learning curves and the best policy so far.

training = train(load_config("quick"), Path("runs/quick"))
training = train(load_config("quick"), Path("runs/quick"), resume=True)
policy = dess.policies.load("runs/quick")       # from the first evaluation or interruption on
"""

import os
import signal
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from importlib.metadata import version
from math import ceil
from pathlib import Path
from typing import Any, NamedTuple

import pyarrow as pa
import torch

from dess.base.errors import InputError, shown
from dess.base.files.locks import locked
from dess.base.files.memory import check_memory
from dess.base.files.reading import paths_in
from dess.base.files.tables import write_table
from dess.base.files.writing import check_folder, writable
from dess.base.signals import ENDING, SOON, is_fragile, send_to_main_thread
from dess.envs.observations.observer import encoder_of
from dess.model.batch import BATCH_SIZE
from dess.model.record import MISSION_RECORD
from dess.model.state import MISSION, UAV
from dess.policies.learner.calibration import calibrate
from dess.policies.learner.checkpoint import load_training, new_training, save_training
from dess.policies.learner.config import CHECKPOINT, TrainingConfig
from dess.policies.learner.description import MODEL
from dess.policies.learner.dqn import ReplayMemory
from dess.policies.learner.network import count_units, make_network, to_arrays
from dess.policies.learner.trained import (
    has_integers,
    load_teacher,
    make_observation,
    read_weights,
    save_integers,
    save_policy,
)
from dess.policies.learner.training import Training
from dess.scenario.scenario import ScenarioSpace

CURVE, EVENTS, LOCK = "training.parquet", "tensorboard", ".lock"
CHECKPOINT_EVERY = 240.0  # seconds between checkpoints
TICK_END = 1.0  # seconds that a tick has to end after a signal

# Weights times rows of a batch up to which a network is small: one thread computes it fastest.
SMALL = 100_000_000

# What is said if another process trains into the folder, and what is allowed then.
_BUSY = ("in use by another training", "another --out, or wait for its end")

# Bytes of the losses of an update, as tensors.
_LOSS = 2000

# Columns of the curve, by the tags under which TensorBoard shows them.
_TAGS = {name: "losses" for name in ("loss", "gradient_norm", "value")}


def choose_device(name: str) -> torch.device:
    """The device ``auto`` (CUDA if available), ``cpu`` or ``cuda``.

    Raises:
        InputError: If the name is unknown, or ``cuda`` is not available.
    """
    if name not in ("auto", "cpu", "cuda"):
        raise InputError("device", f"{name!r} is unknown", "auto, cpu, cuda")
    if name == "cuda" and not torch.cuda.is_available():
        raise InputError("device", "torch finds no CUDA device here", "auto, cpu")
    return torch.device("cuda" if name != "cpu" and torch.cuda.is_available() else "cpu")


class Sizes(NamedTuple):
    """About the memory that a training takes.

    Attributes:
        missions: Of the replay memory or, without one, of the states of a tick [bytes].
        total: Of all, most of it for what a checkpoint holds [bytes].
    """

    missions: int
    total: int


def estimate_sizes(config: TrainingConfig) -> Sizes:
    """The memory that a training takes.

    A checkpoint is written from a copy, so what it holds counts twice.
    """
    spaces = config.mission_spaces()
    has_replay = config.algorithm == "dqn"

    def memory(space: ScenarioSpace) -> int:
        # Missions with charging last about twice as long as it takes to fill the quota.
        needed = ceil(space.quota / space.communication_slots) or space.max_slots
        flown = min(2 * needed, space.max_slots)
        slots = flown
        if has_replay:
            slots = config.replay
        missions = config.num_envs
        missions *= config.seas_per_tick
        return ReplayMemory.count_bytes(slots, missions, space.uavs[1], len(space.nodes))

    missions = max(map(memory, spaces))
    fleet, nodes = (max(n) for n in zip(*((s.uavs[1], len(s.nodes)) for s in spaces), strict=True))
    largest = max(spaces, key=lambda space: len(space.nodes))
    with torch.device("meta"):  # the sizes of the network, without its memory
        network = make_network(config, make_observation(config, spaces[0])[1].shapes)
    shapes = encoder_of(config.observation, largest).shapes
    weights = sum(weight.numel() for weight in network.parameters())
    rows = max(2 * config.batch, config.num_envs * fleet, BATCH_SIZE * fleet)
    row = 3 * count_units(network, shapes)  # outputs, their gradients, the later state
    state = MISSION.itemsize + fleet * UAV.itemsize + 8 * nodes
    evaluation = config.evaluation_missions * (MISSION_RECORD.itemsize + fleet * 8 * 8)
    losses = _LOSS * config.updates * min(config.evaluate_every, config.ticks)
    state_bytes = 6 * 4 * weights + len(spaces) * config.num_envs * state
    state_bytes = 2 * state_bytes + missions
    if config.checkpoint_replay and has_replay:
        state_bytes += missions
    return Sizes(missions, state_bytes + 4 * weights + 4 * rows * row + evaluation + losses)


def train(
    config: TrainingConfig,
    out: Path,
    *,
    resume: bool = False,
    device: str = "auto",
    accept_size: bool = False,
    start: str = "",
    announce: Callable[[int], None] | None = None,
    progress: Callable[[Training, int], None] | None = None,
) -> Training:
    """Train into a folder, or resume the training in it.

    Ctrl-C, SIGTERM and SIGHUP end the session after the present tick. The returned training is then
    not ``done``, and the folder has everything to resume it exactly. A tick that takes longer than
    a second is given up; the folder then has all ticks before it. The folder is locked until the
    end of the session.

    A small network is computed in one thread. The variable OMP_NUM_THREADS sets how many threads
    torch takes for any network.

    Args:
        config: The settings.
        out: The folder.
        resume: Whether to resume the training in the folder.
        device: ``auto``, ``cpu`` or ``cuda``.
        accept_size: Whether to train even if that takes more memory than is available.
        start: The folder of a trained policy whose weights a new training begins with; one that is
            resumed goes on with its own.
        announce: Called before any large allocation with the memory of the missions [bytes].
        progress: Called after each tick with the training and the ticks since the last call.

    Returns:
        The training at the end of the session.

    Raises:
        DivergenceError: If the loss is no finite number any more; the best policy so far is kept.
        KeyboardInterrupt: If a signal ends the session in the middle of a tick.
        InputError: If ``resume`` is not set and the folder has any files; if it is set and the
            folder has no training, or one of another config; if another process trains into the
            folder; if the folder cannot be written; if the machine's memory is too small.
    """
    path = out / CHECKPOINT
    place = choose_device(device)
    _check_folder(out, resume)
    sizes = estimate_sizes(config)
    if not accept_size:
        allowed = "a smaller network, replay memory or batch, fewer environments, or --yes"
        check_memory(f"training {config.name}", sizes.total, allowed)
    with locked(out / LOCK, *_BUSY):
        _check_folder(out, resume)  # again, as another training may have ended in the meantime
        if announce:
            announce(sizes.missions)
        try:
            if resume:
                training = load_training(path, config, place, sizes.total)
            else:
                training = new_training(config, place)
                if start:
                    training.begin_with(read_weights(Path(start)))
                save_training(path, training)
        except (MemoryError, RuntimeError) as error:
            if isinstance(error, RuntimeError) and "alloc" not in str(error):
                raise  # torch has no error of its own for memory
            raise InputError(
                f"training {config.name}",
                f"about {sizes.total / 2**30:.1f} GiB of memory are too much for this machine",
                "fewer environments or slots",
            ) from error
        with _limit_threads(training):
            _run_training(training, out, progress)
    return training


@contextmanager
def _limit_threads(training: Training) -> Iterator[None]:
    """Compute a small network in one thread, unless OMP_NUM_THREADS says in how many.

    More threads wait for each other longer than they compute, above all beside other work.
    """
    network = training.learner.networks["online"]
    weights = sum(weight.numel() for weight in network.parameters())
    before = torch.get_num_threads()
    if weights * training.config.batch <= SMALL and "OMP_NUM_THREADS" not in os.environ:
        torch.set_num_threads(1)
    try:
        yield
    finally:
        torch.set_num_threads(before)


def _run_training(
    training: Training, out: Path, progress: Callable[[Training, int], None] | None
) -> None:
    """Train until the end or a signal; save a checkpoint now and then, and every better policy.

    At the end, what is already saved of the last tick is not saved again: of large networks, that
    takes as long as a tick.
    """
    with _log_to_tensorboard(out / EVENTS, training) as show, _watch_for_signal() as stopped:
        # the last ticks without and with an evaluation
        saved = time.monotonic()
        saved_tick = results_tick = -1
        took = [0.0, 0.0]
        while not training.done and not stopped():
            rows = len(training.curve)
            evaluates = _is_evaluation_due(training)
            began = time.monotonic()
            training.run_ticks(1)
            now = time.monotonic()
            took[evaluates] = now - began
            # A signal does not wait for the end of a tick that takes long.
            is_due = now - saved > CHECKPOINT_EVERY or took[_is_evaluation_due(training)] > TICK_END
            if is_due:
                save_training(out / CHECKPOINT, training)
                saved = now
                saved_tick = training.tick
            if len(training.curve) > rows:
                show(training.curve[-1])
            if is_due or len(training.curve) > rows:
                _save_results(out, training)
                results_tick = training.tick
            if progress:
                progress(training, 1)
    if saved_tick != training.tick:
        save_training(out / CHECKPOINT, training)
    if results_tick != training.tick:
        _save_results(out, training)
    if training.done and has_integers(training.config):
        save_integers(out, calibrate(*load_teacher(out)))


def _is_evaluation_due(training: Training) -> bool:
    """Whether the next tick ends with an evaluation."""
    return (training.tick + 1) % training.config.evaluate_every == 0


def _check_folder(out: Path, resume: bool) -> None:
    """Refuse a folder that has no training to resume, or one that is not empty for a new training.

    Raises:
        InputError: If it cannot be the folder of the training, or cannot be written.
    """
    check_folder(out)
    names = {path.name for path in paths_in(out)}
    if resume and CHECKPOINT not in names:
        raise InputError(out / CHECKPOINT, "no such file", "the folder of a training")
    if resume:
        return
    if CHECKPOINT in names:
        raise InputError(out, "holds a training", "--resume, or another folder")
    if MODEL in names:
        raise InputError(out, "holds a policy", "another folder")
    # A run that was killed before its first checkpoint may have left its lock and a temporary file.
    if others := sorted(n for n in names if n != LOCK and not n.endswith(".tmp")):
        raise InputError(
            out, f"holds other files, such as {shown(others[0])}", "a new or empty folder"
        )


def _save_results(out: Path, training: Training) -> None:
    """Write the policy so far, and the learning curves from the first evaluation on."""
    cuda = training.device.type == "cuda"
    run = {
        "dess": version("dess"),
        "torch": torch.__version__,
        "device": torch.cuda.get_device_name(training.device) if cuda else "cpu",
        "threads": torch.get_num_threads(),
        "ticks": training.tick,
        "updates": training.updates,
        "uav_slots": training.uav_slots,
        "seconds": round(training.seconds),
        "selection_score": training.best_score,
    }
    save_policy(
        out, to_arrays(training.kept), training.config, training.space, run, training.ranges
    )
    if not training.curve:
        return
    names = dict.fromkeys(name for row in training.curve for name in row)
    columns = {name: [row.get(name) for row in training.curve] for name in names}
    write_table(out / CURVE, pa.table(columns))


@contextmanager
def _watch_for_signal() -> Iterator[Callable[[], bool]]:
    """Let a signal stop the session after the tick; a second signal stops it at once.

    A tick that compiles or evaluates may take long: then the first signal is sent once more. The
    second one waits while compiled code or its compiler calls Python, where it might crash the
    process. A signal that is ignored, as SIGHUP under ``nohup``, stays ignored.
    """
    received: list[int] = []
    again: list[threading.Timer] = []

    def send_again(number: int, seconds: float) -> None:
        timer = threading.Timer(seconds, send_to_main_thread, [number])
        timer.daemon = True
        timer.start()
        again.append(timer)

    def receive(number: int, frame: Any) -> None:
        received.append(number)
        if len(received) == 1:
            send_again(number, TICK_END)
        elif is_fragile(frame):
            send_again(number, SOON)
        else:
            raise KeyboardInterrupt

    numbers = [n for n in ENDING if signal.getsignal(n) not in (signal.SIG_IGN, None)]
    handlers = {number: signal.signal(number, receive) for number in numbers}
    try:
        yield lambda: bool(received)
    except SystemError:  # as numba reports an interruption
        if len(received) > 1:
            raise KeyboardInterrupt from None
        raise
    finally:
        for timer in again:
            timer.cancel()
        for number, handler in handlers.items():
            signal.signal(number, handler)


@contextmanager
def _log_to_tensorboard(
    folder: Path, training: Training
) -> Iterator[Callable[[dict[str, Any]], None]]:
    """Write the rows of the curve for TensorBoard, if it is installed."""
    try:
        from torch.utils.tensorboard import SummaryWriter
    except ImportError:
        yield lambda row: None
        return
    with writable(folder), SummaryWriter(str(folder), purge_step=training.tick + 1) as writer:

        def show(row: dict[str, Any]) -> None:
            for name, value in row.items():
                kind, _, metric = name.partition("_")
                if kind in ("evaluation", "training"):
                    writer.add_scalar(f"{kind}/{metric}", value, row["tick"])
                elif isinstance(value, float):
                    writer.add_scalar(f"{_TAGS.get(name, 'charts')}/{name}", value, row["tick"])

        yield show
