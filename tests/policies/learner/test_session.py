"""A training as a folder: what is in it, and that nothing is lost when it is interrupted."""

import json
import os
import signal
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest
import torch
from numba.core import serialize

from dess import policies
from dess.base.signals import ENDING
from dess.policies.learner import session
from dess.policies.learner.arrays import hash_arrays
from dess.policies.learner.checkpoint import load_training
from dess.policies.learner.config import CHECKPOINT, load_config
from dess.policies.learner.description import CONFIG, MODEL
from dess.policies.learner.dqn import DQNTraining
from dess.policies.learner.network import make_network, to_arrays
from dess.policies.learner.session import CURVE, LOCK, choose_device, train
from dess.policies.learner.trained import INTEGERS, make_observation, read_weights
from dess.policies.learner.training import DivergenceError, Training
from tests.analysis.small import files_of
from tests.policies.learner.tiny import (
    CPU,
    PHASES,
    Killed,
    assert_same,
    kill_after,
    refusal_of,
    tiny,
)

SHORT = tiny(
    phases=[phase | {"ticks": 20} for phase in PHASES], learning_starts=20, evaluate_every=8
)

Progress = Callable[[Training, int], None]


@pytest.fixture(autouse=True)
def _no_tensorboard(monkeypatch):
    """It takes its time; all works without."""
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)


@pytest.fixture(scope="module")
def whole():
    """The short training in one go."""
    training = DQNTraining(SHORT, CPU)
    training.run_ticks(1000)
    return training


def _at(tick: int, act: Callable[[], Any]) -> Progress:
    """Do something after that tick."""

    def progress(training: Training, _: int) -> None:
        if training.tick == tick:
            act()

    return progress


@pytest.mark.parametrize("stops_at", [None, 7])
def test_nothing_is_saved_twice_at_the_end(stops_at, tmp_path, monkeypatch):
    """Where each tick is followed by a checkpoint, the last one is; also after a signal."""
    monkeypatch.setattr(session, "CHECKPOINT_EVERY", -1.0)
    ticks: dict[str, list[int]] = {"save_training": [], "_save_results": []}
    for name in ticks:
        save = getattr(session, name)

        def counted(out, training, save=save, name=name):
            ticks[name].append(training.tick)
            save(out, training)

        monkeypatch.setattr(session, name, counted)
    progress = None
    if stops_at:
        progress = _at(stops_at, lambda: signal.raise_signal(signal.SIGINT))
    training = train(SHORT, tmp_path / "out", progress=progress)
    assert training.tick == (stops_at or 40)
    assert ticks["save_training"] == [*range(training.tick + 1)]
    assert ticks["_save_results"] == [*range(1, training.tick + 1)]
    again = load_training(tmp_path / "out" / CHECKPOINT, SHORT, CPU)
    assert_same(again, training)


def test_the_folder_of_a_training(whole, tmp_path):
    seen: list[tuple[int, int]] = []
    out = tmp_path / "runs" / "tiny"
    training = train(SHORT, out, progress=lambda t, done: seen.append((t.tick, done)))
    assert training.done
    assert_same(training, whole)
    assert seen == [(tick, 1) for tick in range(1, 41)]
    assert set(files_of(out)) == {CHECKPOINT, CONFIG, CURVE, INTEGERS, MODEL}
    names = pq.read_schema(out / CURVE).names
    rows = [{name: row.get(name) for name in names} for row in training.curve]
    assert pq.read_table(out / CURVE).to_pylist() == rows
    written, best = read_weights(out), to_arrays(training.best)
    assert hash_arrays("", written) == hash_arrays("", best)
    assert json.loads((out / CONFIG).read_text("utf-8"))["name"] == "tiny"


@pytest.mark.parametrize(
    ("variable", "small", "threads"),
    [(None, session.SMALL, 1), ("2", session.SMALL, 2), (None, 0, 2)],
    ids=["small", "told", "large"],
)
def test_a_small_network_takes_one_thread(tmp_path, monkeypatch, variable, small, threads):
    """The two threads of before stand for those that torch takes by itself."""
    monkeypatch.delenv("OMP_NUM_THREADS")
    if variable:
        monkeypatch.setenv("OMP_NUM_THREADS", variable)
    monkeypatch.setattr(session, "SMALL", small)
    before = torch.get_num_threads()
    torch.set_num_threads(2)
    seen: list[int] = []

    def stop(_: Training, __: int) -> None:
        seen.append(torch.get_num_threads())
        signal.raise_signal(signal.SIGINT)

    train(SHORT, tmp_path, progress=stop)
    after = torch.get_num_threads()
    torch.set_num_threads(before)
    assert (seen, after) == ([threads], 2)
    assert json.loads((tmp_path / CONFIG).read_text("utf-8"))["run"]["threads"] == threads


def test_which_networks_are_small():
    def rows(name: str) -> int:
        config = load_config(name)
        shapes = make_observation(config, config.mission_spaces()[0])[1].shapes
        weights = make_network(config, shapes).parameters()
        return sum(weight.numel() for weight in weights) * config.batch

    is_small = {name: rows(name) <= session.SMALL for name in ("quick", "ddqn", "ddqn-paper")}
    assert is_small == {"quick": True, "ddqn": True, "ddqn-paper": False}


STOPS = [(signal.SIGINT, 5), (signal.SIGTERM, 20), (signal.SIGHUP, 33)]


@pytest.mark.parametrize(("number", "tick"), STOPS)
def test_a_signal_ends_it_after_the_tick_and_it_can_go_on(number, tick, whole, tmp_path):
    handlers = [signal.getsignal(kind) for kind in ENDING]
    stop = _at(tick, lambda: signal.raise_signal(number))
    training = train(SHORT, tmp_path, progress=stop)
    assert (training.tick, training.done) == (tick, False)
    assert [signal.getsignal(kind) for kind in ENDING] == handlers
    assert not [name for name in os.listdir(tmp_path) if name.endswith(".tmp")]
    resumed = train(SHORT, tmp_path, resume=True)
    assert_same(resumed, whole)
    ticks = pq.read_table(tmp_path / CURVE)["tick"].to_pylist()
    assert ticks == [row["tick"] for row in whole.curve]


def test_a_training_that_was_interrupted_is_a_policy_that_says_so(tmp_path, caplog):
    stop = _at(1, lambda: signal.raise_signal(signal.SIGINT))
    training = train(SHORT, tmp_path, progress=stop)
    assert not training.curve
    assert set(files_of(tmp_path)) == {CHECKPOINT, CONFIG, MODEL}
    policies.load(tmp_path)
    policies.load(tmp_path)
    [record] = caplog.records  # it is said once
    line = f"{tmp_path}: this training is not finished (1 of 40 ticks); "
    assert record.getMessage().startswith(line)
    assert record.getMessage().endswith(f"dess train CONFIG --out {tmp_path} --resume")
    train(SHORT, tmp_path, resume=True)
    caplog.clear()
    policies.load(tmp_path)
    assert not caplog.records


def _twice() -> None:
    signal.raise_signal(signal.SIGINT)
    signal.raise_signal(signal.SIGINT)


def test_a_second_signal_ends_it_at_once(whole, tmp_path):
    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        train(SHORT, tmp_path, progress=_at(7, _twice))
    assert signal.getsignal(signal.SIGINT) == before
    assert_same(train(SHORT, tmp_path, resume=True), whole)  # from the last checkpoint


def test_a_second_signal_waits_while_compiled_code_calls_python(tmp_path, monkeypatch):
    class Signalling(dict):
        def __getitem__(self, key):
            _twice()
            return "object"

    unpickled: list[str] = []
    waits: list[float] = []

    def call():
        with monkeypatch.context() as patches:
            patches.setattr(serialize, "_unpickled_memo", Signalling())
            unpickled.append(serialize._numba_unpickle(0, b"", b""))  # as what boxes an array does
        begin = time.monotonic()
        try:
            threading.Event().wait(60)
        finally:
            waits.append(time.monotonic() - begin)

    with pytest.raises(KeyboardInterrupt):
        train(SHORT, tmp_path, progress=_at(7, call))
    assert unpickled == ["object"]
    assert len(waits) == 1 and waits[0] < 60, "the signal did not end the wait"


def test_it_is_saved_every_now_and_then(whole, tmp_path, monkeypatch):
    def fail() -> None:
        raise RuntimeError("the power failed")

    for path, seconds, tick in ((tmp_path / "often", -1.0, 13), (tmp_path / "seldom", 1e9, 0)):
        monkeypatch.setattr(session, "CHECKPOINT_EVERY", seconds)
        with pytest.raises(RuntimeError):
            train(SHORT, path, progress=_at(13, fail))
        assert load_training(path / CHECKPOINT, SHORT, CPU).tick == tick
        assert_same(train(SHORT, path, resume=True), whole)


def _refusal(out: Path, **arguments: Any) -> str:
    """The line with which a folder is refused; it stays as it is."""
    before = files_of(out)
    line = refusal_of(train, SHORT, out, **arguments)
    assert files_of(out) == before
    return line


def test_folders_are_not_overwritten(tmp_path):
    out = tmp_path / "out"
    train(SHORT, out)
    assert _refusal(out) == f"{out}: holds a training; allowed: --resume, or another folder"
    (out / CHECKPOINT).unlink()
    assert _refusal(out) == f"{out}: holds a policy; allowed: another folder"
    line = f"{out / CHECKPOINT}: no such file; allowed: the folder of a training"
    assert _refusal(out, resume=True) == line
    for name in ("manifest.json", ".bashrc", "missions/a.parquet"):
        other, top = tmp_path / name.replace("/", "-"), name.partition("/")[0]
        (other / name).parent.mkdir(parents=True)
        (other / name).touch()
        line = f"{other}: holds other files, such as '{top}'; allowed: a new or empty folder"
        assert _refusal(other) == line


def test_one_folder_has_one_training_at_a_time(tmp_path):
    lines = []
    line = f"{tmp_path}: in use by another training; allowed: another --out, or wait for its end"

    intrude = _at(9, lambda: lines.append(_refusal(tmp_path, resume=True)))
    train(SHORT, tmp_path, progress=intrude)
    assert lines == [line]
    train(SHORT, tmp_path, resume=True)  # the first one has released the folder


def _recorded(out: Path) -> dict[str, Any]:
    """All that a training has written but for wall times."""
    description = json.loads((out / CONFIG).read_text("utf-8"))
    del description["run"]["seconds"]
    return {
        CONFIG: description,
        CURVE: pq.read_table(out / CURVE).drop_columns(["seconds"]).to_pydict(),
        MODEL: (out / MODEL).read_bytes(),
        "files": sorted(name for name in os.listdir(out) if name != LOCK),
    }


@pytest.mark.parametrize("every", [pytest.param(1, marks=pytest.mark.slow), 9])
def test_a_kill_before_any_file_is_written_loses_nothing(every, tmp_path, monkeypatch):
    """The process is killed before the first file, the second, and so on, or some of them."""
    config = tiny(
        phases=[phase | {"ticks": 3} for phase in PHASES], learning_starts=10, evaluate_every=4
    )
    monkeypatch.setattr(session, "CHECKPOINT_EVERY", -1.0)  # at every tick
    whole = train(config, tmp_path / "whole")
    expected = _recorded(tmp_path / "whole")
    for steps in range(0, 1000, every):
        out = tmp_path / str(steps)
        try:
            with monkeypatch.context() as patch:
                kill_after(patch, steps)
                train(config, out)
            break
        except Killed:
            pass
        if (out / CONFIG).exists() and (out / MODEL).exists():
            policies.load(out)  # at any time
        assert_same(train(config, out, resume=(out / CHECKPOINT).exists()), whole)
        assert _recorded(out) == expected
    assert steps > 20


def test_a_training_that_diverges_ends_and_keeps_the_best_policy(tmp_path):
    before = {}

    def spoil(training: Training, _: int) -> None:
        if training.tick == 13:
            before.update(files_of(tmp_path))
            with torch.no_grad():
                next(training.learner.online.parameters()).fill_(torch.nan)

    with pytest.raises(DivergenceError, match="^the training diverged: its loss is nan; the best"):
        train(SHORT, tmp_path, progress=spoil)
    assert files_of(tmp_path) == before
    assert MODEL in before
    policies.load(tmp_path)
    train(SHORT, tmp_path, resume=True)


def test_without_cuda_there_is_the_cpu(monkeypatch):
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert choose_device("auto") == CPU
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert choose_device("auto").type == choose_device("cuda").type == "cuda"
    assert choose_device("cpu") == CPU
