"""A training as a folder: what is in it, and that nothing is lost when it is interrupted."""

import json
import os
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest
import torch

import policies
from dess import InputError
from dess.scenario import load_scenario
from policies.ddqn import session
from policies.ddqn.checkpoint import load_training
from policies.ddqn.config import CHECKPOINT
from policies.ddqn.description import CONFIG, MODEL
from policies.ddqn.replay import ReplayMemory
from policies.ddqn.session import CURVE, EVENTS, device_of, memory_of, train
from policies.ddqn.training import Training
from tests.analysis.small import files_of
from tests.policies.ddqn.tiny import CPU, PHASES, assert_same, story_of, tiny

SHORT = tiny(
    phases=[phase | {"ticks": 20} for phase in PHASES], learning_starts=20, evaluate_every=8
)

Progress = Callable[[Training, int], None]


@pytest.fixture(autouse=True)
def _no_tensorboard(monkeypatch: pytest.MonkeyPatch) -> None:
    """It takes its time; all works without."""
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)


@pytest.fixture(scope="module")
def whole() -> Training:
    """The short training in one go."""
    training = Training(SHORT, CPU)
    training.run(1000)
    return training


def _at(tick: int, act: Callable[[], Any]) -> Progress:
    """Do something after that tick."""

    def progress(training: Training, _: int) -> None:
        if training.tick == tick:
            act()

    return progress


def test_the_folder_of_a_training(whole: Training, tmp_path: Path) -> None:
    seen: list[tuple[int, int]] = []
    out = tmp_path / "runs" / "tiny"
    training = train(SHORT, out, progress=lambda t, done: seen.append((t.tick, done)))
    assert training.done
    assert_same(training, whole)
    assert seen == [(tick, 1) for tick in range(1, 41)]
    assert set(files_of(out)) == {CHECKPOINT, CONFIG, CURVE, MODEL}
    assert pq.read_table(out / CURVE).to_pylist() == [
        {name: row.get(name) for name in pq.read_schema(out / CURVE).names}
        for row in training.curve
    ]
    policy = policies.load(out)
    best = training.policy(training.best)
    weights = zip(policy.network.parameters(), best.network.parameters(), strict=True)  # type: ignore[attr-defined]
    assert all(torch.equal(ours, theirs) for ours, theirs in weights)
    assert json.loads((out / CONFIG).read_text("utf-8"))["name"] == "tiny"


def test_the_folder_has_a_policy_from_the_first_evaluation_on(tmp_path: Path) -> None:
    counts = []
    train(SHORT, tmp_path, progress=lambda *_: counts.append(len(files_of(tmp_path))))
    assert counts == [1] * 1 + [4] * 39


def test_the_curve_has_the_columns_of_all_its_rows(tmp_path: Path) -> None:
    # At first no mission has ended: the first rows say nothing of the missions of training.
    config = tiny(low_battery_starts=0.0)
    training = train(config, tmp_path)
    first, last = training.curve[0], training.curve[-1]
    assert set(first) < set().union(*training.curve)
    table = pq.read_table(tmp_path / CURVE)
    assert set(table.column_names) == set().union(*training.curve)
    assert table["tick"].to_pylist()[-1] == last["tick"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("tick", [5, 20, 33])
def test_a_signal_ends_it_after_the_tick_and_it_can_go_on(
    number: signal.Signals, tick: int, whole: Training, tmp_path: Path
) -> None:
    handlers = [signal.getsignal(kind) for kind in (signal.SIGINT, signal.SIGTERM)]
    stop = _at(tick, lambda: signal.raise_signal(number))
    training = train(SHORT, tmp_path, progress=stop)
    assert (training.tick, training.done) == (tick, False)
    assert [signal.getsignal(kind) for kind in (signal.SIGINT, signal.SIGTERM)] == handlers
    assert not [name for name in files_of(tmp_path) if name.endswith(".new")]
    resumed = train(SHORT, tmp_path, resume=True)
    assert_same(resumed, whole)
    assert pq.read_table(tmp_path / CURVE)["tick"].to_pylist() == [
        row["tick"] for row in whole.curve
    ]


def test_a_training_that_was_interrupted_is_a_policy_that_says_so(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
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


def test_a_training_without_weights_is_no_policy(tmp_path: Path) -> None:
    train(SHORT, tmp_path)
    (tmp_path / CONFIG).unlink()
    with pytest.raises(InputError, match="is a training that has no weights yet; continue it with"):
        policies.load(tmp_path)


def test_the_second_signal_ends_it_at_once(whole: Training, tmp_path: Path) -> None:
    def stop() -> None:
        signal.raise_signal(signal.SIGINT)
        signal.raise_signal(signal.SIGINT)

    before = signal.getsignal(signal.SIGINT)
    with pytest.raises(KeyboardInterrupt):
        train(SHORT, tmp_path, progress=_at(7, stop))
    assert signal.getsignal(signal.SIGINT) == before
    assert_same(train(SHORT, tmp_path, resume=True), whole)  # from the last checkpoint


def test_it_is_saved_every_now_and_then(
    whole: Training, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail() -> None:
        raise RuntimeError("the power failed")

    for path, seconds, tick in ((tmp_path / "often", -1.0, 13), (tmp_path / "seldom", 1e9, 0)):
        monkeypatch.setattr(session, "CHECKPOINT_EVERY", seconds)
        with pytest.raises(RuntimeError):
            train(SHORT, path, progress=_at(13, fail))
        assert load_training(path / CHECKPOINT, SHORT, CPU).tick == tick
        assert_same(train(SHORT, path, resume=True), whole)


def test_what_is_done_stays_as_it_is(tmp_path: Path) -> None:
    done = train(SHORT, tmp_path)
    before = files_of(tmp_path)
    again = train(SHORT, tmp_path, resume=True)
    assert_same(again, done)
    assert again.seconds == done.seconds
    assert files_of(tmp_path) == before


def _refusal(out: Path, **arguments: Any) -> str:
    """The line with which a folder is refused; it stays as it is."""
    before = files_of(out.parent)
    with pytest.raises(InputError) as error:
        train(arguments.pop("config", SHORT), out, **arguments)
    assert files_of(out.parent) == before
    assert "\n" not in str(error.value)
    return str(error.value)


def test_folders_are_not_overwritten(tmp_path: Path) -> None:
    out = tmp_path / "out"
    train(SHORT, out)
    assert _refusal(out) == f"{out}: holds a training; allowed: --resume, or another folder"
    other = SHORT.model_copy(update={"seed": 5})
    assert "another config (seed differ)" in _refusal(out, config=other, resume=True)
    (out / CHECKPOINT).unlink()
    assert _refusal(out) == f"{out}: holds a policy; allowed: another folder"
    line = f"{out / CHECKPOINT}: no such file; allowed: the folder of a training"
    assert _refusal(out, resume=True) == line
    assert "no such file" in _refusal(tmp_path / "nothing", resume=True)


def test_a_folder_that_cannot_be_is_named(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    for out in (tmp_path / "file", tmp_path / "file" / "out"):
        line = _refusal(out)
        assert line.startswith(f"{out}: cannot be written: ")
        assert "allowed" in line


def test_devices() -> None:
    assert device_of("cpu") == CPU
    with pytest.raises(InputError, match="device: 'tpu' is unknown; allowed: auto, cpu, cuda"):
        device_of("tpu")


def test_without_cuda_there_is_the_cpu(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(torch.cuda, "is_available", lambda: False)
    assert device_of("auto") == CPU
    with pytest.raises(InputError, match="no CUDA device here; allowed: auto, cpu"):
        device_of("cuda")
    monkeypatch.setattr(torch.cuda, "is_available", lambda: True)
    assert device_of("auto").type == device_of("cuda").type == "cuda"
    assert device_of("cpu") == CPU


@pytest.mark.skipif(not torch.cuda.is_available(), reason="needs CUDA")
def test_on_cuda_it_goes_on_as_well(tmp_path: Path) -> None:
    stop = _at(13, lambda: signal.raise_signal(signal.SIGINT))
    training = train(SHORT, tmp_path, device="cuda", progress=stop)
    assert training.tick == 13
    resumed = train(SHORT, tmp_path, device="cuda", resume=True)
    assert resumed.done
    assert next(resumed.learner.online.parameters()).is_cuda
    undisturbed = train(SHORT, tmp_path / "undisturbed", device="cuda")
    for row, other in zip(story_of(resumed), story_of(undisturbed), strict=True):
        assert row["loss"] == pytest.approx(other["loss"], rel=0.05)


def test_the_memory_that_it_takes_is_known_before() -> None:
    training = Training(SHORT, CPU)
    arrays = training.replay.arrays.values()
    assert memory_of(SHORT) == sum(array.nbytes for array in arrays)
    paper = load_scenario("paper")
    assert memory_of(SHORT) == ReplayMemory.bytes_for(80, 8, paper.uavs[1], len(paper.nodes))


def test_tensorboard_shows_the_curve(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("tensorboard")
    from tensorboard.backend.event_processing import (  # type: ignore[import-untyped]
        event_accumulator,
    )

    monkeypatch.delitem(sys.modules, "torch.utils.tensorboard")
    stop = _at(20, lambda: os.kill(os.getpid(), signal.SIGINT))
    train(SHORT, tmp_path, progress=stop)
    training = train(SHORT, tmp_path, resume=True)
    shown = event_accumulator.EventAccumulator(str(tmp_path / EVENTS)).Reload()
    tags = {
        "evaluation/collection_ratio_and_communication": (
            "evaluation_collection_ratio_and_communication"
        ),
        "losses/loss": "loss",
        "charts/epsilon": "epsilon",
    }
    for tag, column in tags.items():
        points = shown.Scalars(tag)
        assert [point.step for point in points] == [row["tick"] for row in training.curve]
        values = [row[column] for row in training.curve]
        assert np.allclose([point.value for point in points], values)
