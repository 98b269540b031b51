"""Algorithm 1: its phases, its exploration, what it keeps, and that it can be stopped anywhere."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from dess.envs.observations.states import ACTIVE, CHARGING, compact_states, masks
from dess.model.record import empty_records
from dess.policies.learner import training as module
from dess.policies.learner.checkpoint import load_training, save_training
from dess.policies.learner.config import MISSION_SEED
from dess.policies.learner.dqn import DQNTraining
from dess.policies.learner.training import SELECT_BY, Training
from dess.scenario.scenario import ScenarioSpace
from tests.policies.learner.tiny import CPU, PHASES, assert_same, tiny, weights_of

# --- stopping and going on ---


def _stopped(training: Training, path: Path) -> Training:
    """The training as another process would go on with it."""
    save_training(path, training)
    torch.manual_seed(99)  # nothing may hang on what was drawn before
    return load_training(path, training.config, CPU)


def _trained(training: Training, ticks: int) -> Training:
    training.run_ticks(ticks)
    return training


@pytest.fixture(scope="module")
def whole():
    """The tiny training in one go."""
    return _trained(DQNTraining(tiny(), CPU), 1000)


@pytest.mark.parametrize(
    "stops",
    [(25, 79), pytest.param((0, 1, 10, 80, 81, 120, 159, 160), marks=pytest.mark.slow)],
)
def test_a_stopped_training_goes_on_as_if_nothing_had_been(stops, whole, tmp_path):
    training = DQNTraining(tiny(), CPU)
    for stop in stops:
        training.run_ticks(stop - training.tick)
        training = _stopped(training, tmp_path / "checkpoint")
        assert training.tick == stop
    assert_same(_trained(training, 1000), whole)
    assert training.done


@pytest.mark.parametrize(
    "changes",
    [
        {"average_rate": 1.0, "updates": 2, "precision": "bfloat16"},
        {"guard": False, "early_returns": 0.5, "hidden": [8, 16, 16]},
    ],
)
def test_so_do_others(changes, tmp_path):
    config = tiny(**changes, phases=[phase | {"ticks": 20} for phase in PHASES], evaluate_every=15)
    parts = _stopped(_trained(DQNTraining(config, CPU), 17), tmp_path / "checkpoint")
    assert_same(_trained(parts, 100), _trained(DQNTraining(config, CPU), 100))


def test_without_its_memory_a_stopped_training_fills_a_new_one(whole, tmp_path):
    config = tiny(checkpoint_replay=False)
    training = _trained(DQNTraining(config, CPU), 90)
    path, full = tmp_path / "checkpoint", tmp_path / "full"
    save_training(full, whole)
    resumed = _stopped(training, path)
    memory = sum(array.nbytes for array in training.replay.arrays.values())
    assert full.stat().st_size - path.stat().st_size > 0.9 * memory
    ours, theirs = weights_of(resumed), weights_of(training)
    assert all(torch.equal(value, theirs[name]) for name, value in ours.items())
    assert resumed.replay.count == 0
    resumed.run_ticks(1)
    assert resumed.replay.count == config.learning_starts + 1
    assert _trained(resumed, 1000).done


# --- phases ---


def test_the_first_phase_spends_no_battery():
    training = _trained(DQNTraining(tiny(low_battery_starts=0.0), CPU), 40)
    state = training.stepper.state
    active = state.uavs["active"]
    start = np.broadcast_to(state.missions["flying_time"][:, None], active.shape)
    assert state.uavs["slots_flying"][active].min() > 50
    assert (state.uavs["battery"] == start)[active].all()
    training.run_ticks(41)  # one in the second phase, after the random slots
    state = training.stepper.state
    flown = state.uavs["active"] & (state.uavs["slots_charging"] == 0)
    spent = state.missions["flying_time"][:, None] - state.uavs["battery"]
    assert (spent == state.uavs["slots_flying"])[flown].all()
    assert spent[flown].min() > 0


def test_a_phase_begins_with_missions_and_a_memory_of_its_own():
    training = _trained(DQNTraining(tiny(), CPU), 79)
    flown = training.stepper.replication
    assert training.phase.name == "harvest"
    assert training.replay.count == training.config.learning_starts + 79
    assert training.learner.optimizer.state_dict()["state"]
    training.run_ticks(1)
    assert training.phase.name == "battery"
    assert training.replay.count == 0
    assert not training.learner.optimizer.state_dict()["state"]
    missions = training.stepper.state.missions
    assert (missions["seed"] == MISSION_SEED + training.config.seed).all()
    assert missions["replication"].min() >= flown
    training.run_ticks(1)
    assert training.replay.count == training.config.learning_starts + 1


def _scripted(monkeypatch: pytest.MonkeyPatch, scores: list[float]) -> None:
    """Let the evaluations of selection give these scores; there is no early one."""
    left = iter(scores)

    def fly(space: ScenarioSpace, *_: Any) -> Any:
        records = empty_records(2, space.uavs[1])
        records.missions[SELECT_BY] = next(left)
        return records

    monkeypatch.setattr(module, "simulate_batch", fly)
    monkeypatch.setattr(Training, "_evaluate_early", lambda training: None)


@pytest.mark.parametrize(
    ("window", "scores", "best"),
    [
        (1, [0.2, 0.9, 0.1, 0.8], 1),
        (1, [0.2, 0.1, 0.0, 0.1], 0),
        (1, [0.5, 0.5, 0.5, 0.5], 0),
        (2, [0.9, 0.1, 0.6, 0.5], 3),  # means of two: 0.5, 0.35, 0.55
        (2, [0.9, 0.1, 0.3, 0.5], 1),
        (3, [0.9, 0.1, 0.4, 0.2], 2),
        (9, [0.9, 0.1, 0.4, 0.2], 3),  # too few for a mean: the latest
    ],
)
def test_the_second_phase_begins_with_the_best_weights_of_the_first(
    window, scores, best, monkeypatch
):
    _scripted(monkeypatch, [*scores, 0.0, 0.1])
    # Four evaluations: after 6, 12 and 18 ticks, and at the end of the phase.
    phases = [phase | {"ticks": 20} for phase in PHASES]
    training = DQNTraining(tiny(window=window, phases=phases, evaluate_every=6), CPU)
    guesses = [weights_of(_trained(training, 6)) for _ in range(3)]
    _trained(training, 2)
    assert [row["evaluation_" + SELECT_BY] for row in training.curve] == scores
    now = weights_of(training)
    # The last guess of the first phase is overwritten by the best: it can be told by elimination.
    origin = [
        all(torch.equal(g[f"average.{key}"], now[f"best.{key}"]) for key in training.best)
        for g in guesses
    ]
    assert origin == [number == best for number in range(3)]
    for key, value in training.best.items():
        for name in ("online", "target", "average"):
            assert torch.equal(now[f"{name}.{key}"], value)
    # What was best of the first phase has no say in the second.
    assert training.best_score is None
    training.run_ticks(4)
    assert training.curve[-1]["is_best"]
    assert training.best_score == 0.0


# --- exploration ---


def _noted(monkeypatch: pytest.MonkeyPatch, owner: Any, name: str) -> list[float]:
    """The last argument of every call of a method from now on."""
    noted, method = list[float](), getattr(owner, name)

    def note(*arguments: Any) -> Any:
        noted.append(arguments[-1])
        return method(*arguments)

    monkeypatch.setattr(owner, name, note)
    return noted


def test_rates_move_over_their_phase(monkeypatch):
    phases = [
        PHASES[0] | {"epsilon": [0.1, 0.1], "learning_rate": [1e-3, 1e-4]},
        PHASES[1] | {"epsilon": [0.5, 0.01], "epsilon_decay": 0.5, "learning_rate": [1e-4, 1e-4]},
    ]
    training = DQNTraining(tiny(phases=phases, evaluate_every=20), CPU)
    epsilons_used = _noted(monkeypatch, training, "_collect_slot")
    learned = _noted(monkeypatch, training.learner, "update_networks")
    training.run_ticks(1000)
    # The first phase starts at random, the second as it begins.
    falling = [0.5 - 0.49 * min(tick / 40, 1) for tick in range(80)]
    assert epsilons_used == pytest.approx([1.0] * 60 + [0.1] * 80 + [0.5] * 60 + falling)
    assert learned == pytest.approx([1e-3 - 9e-4 * tick / 80 for tick in range(80)] + [1e-4] * 80)
    rows = training.curve[1:]  # after the early one
    assert [row["tick"] for row in rows] == [20, 40, 60, 80, 100, 120, 140, 160]
    assert [row["phase"] for row in rows] == ["harvest"] * 4 + ["battery"] * 4
    epsilons = [0.1] * 4 + [0.5 - 0.49 / 2, 0.01, 0.01, 0.01]
    assert [row["epsilon"] for row in rows] == pytest.approx(epsilons)
    rates = [7.75e-4, 5.5e-4, 3.25e-4, 1e-4, 1e-4, 1e-4, 1e-4, 1e-4]
    assert [row["learning_rate"] for row in rows] == pytest.approx(rates)


def _acting(training: DQNTraining) -> tuple[Any, np.ndarray, np.ndarray]:
    """Compact states of the environments, and their UAVs that act, many times over."""
    stepper = training.stepper
    states = compact_states(stepper.state, stepper.world.chart, training.config.guard)
    missions, uavs = np.nonzero(states.uavs[..., ACTIVE] > states.uavs[..., CHARGING])
    return states, np.tile(missions, 2000), np.tile(uavs, 2000)


def _explorer(monkeypatch: pytest.MonkeyPatch, values: list[float], **phase: Any) -> DQNTraining:
    """A training whose network gives every UAV these values."""
    training = _trained(DQNTraining(tiny(phases=[PHASES[1] | phase]), CPU), 30)

    def give(_: Any, __: Any, rows: np.ndarray, ___: Any) -> torch.Tensor:
        return torch.tensor(values).expand(len(rows), 5)

    monkeypatch.setattr(training.learner, "action_values", give)
    return training


VALUES = [0.3, 0.1, 0.5, 0.2, 0.4]


@pytest.mark.parametrize("epsilon", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("temperature", [0.0, 0.25])
def test_actions_are_explored_as_told(epsilon, temperature, monkeypatch):
    training = _explorer(monkeypatch, VALUES, temperature=temperature)
    states, missions, uavs = _acting(training)
    allowed = masks(states, missions, uavs)
    actions = training._choose_exploring(states, missions, uavs, epsilon)
    assert allowed[np.arange(len(actions)), actions].all()
    values = np.where(allowed, VALUES, -np.inf)
    weights = np.exp(values / temperature) if temperature else np.eye(5)[values.argmax(1)]
    expected = epsilon * allowed / allowed.sum(1, keepdims=True)
    expected += (1 - epsilon) * weights / weights.sum(1, keepdims=True)
    for forms in np.unique(allowed, axis=0):
        alike = (allowed == forms).all(1)
        count = np.bincount(actions[alike], minlength=5)
        mean = expected[alike].sum(0)
        spread = np.sqrt(mean * (1 - mean / alike.sum()))
        assert (abs(count - mean) <= 5 * spread).all()


def _reserves(early_returns: float) -> np.ndarray:
    """Battery above C_S of the UAVs that begin to charge, in a training that does not explore."""
    phase = {"name": "one", "ticks": 75, "epsilon": [0.0, 0.0]}
    settings = {"num_envs": 40, "learning_starts": 4, "low_battery_starts": 0.0}
    settings |= {"evaluate_every": 100}
    training = DQNTraining(tiny(**settings, early_returns=early_returns, phases=[phase]), CPU)
    missions, uavs, *_ = training.stepper.state
    begun = []
    for _ in range(74):
        before = uavs["battery"] - missions["charge_start"][:, None]
        flying = uavs["active"] & ~uavs["charging"]
        training.run_ticks(1)
        begun += before[flying & uavs["charging"]].tolist()
    return np.array(begun)


def test_early_returns_come_home_as_soon_as_they_may_charge():
    early, late = _reserves(1.0), _reserves(0.0)
    assert len(early) > len(late) > 0
    assert early.max() <= 0  # as the rules have it
    assert np.median(early) >= -2 and np.median(late) <= -10


# --- missions that start low ---


def test_low_starts_are_low_latched_and_near_their_quota():
    training = DQNTraining(tiny(low_battery_starts=1.0, num_envs=200), CPU)
    missions, uavs, residual, *_ = training.stepper.state
    present = uavs["active"]
    start = np.broadcast_to(missions["charge_start"][:, None], present.shape)
    assert (uavs["battery"] <= start)[present].all()
    assert uavs["battery"][present].min() == 5
    assert (uavs["battery"] == start)[present].any()
    assert uavs["latch"][present].all()
    assert not uavs["battery"][~present].any()
    lowest = np.where(present, uavs["battery"], 100).min(1)
    assert (uavs["battery"].max(1) == lowest).all()  # they have flown together
    flown = missions["flying_time"][:, None] - uavs["battery"]
    filled = np.minimum(4 * flown, missions["quota"][:, None] - 1)
    assert (uavs["communications"] == filled)[present].all()
    x, y, width, height = training.space.zone
    assert ((uavs["x"] >= x) & (uavs["x"] < x + width))[present].all()
    assert ((uavs["y"] >= y) & (uavs["y"] < y + height))[present].all()
    # Of the nodes any share is empty; the others are as they were.
    assert residual[residual > 0].min() >= training.space.initial_data[0]
    shares = (residual == 0).mean(1)
    assert shares.mean() == pytest.approx(0.5, abs=5 * np.sqrt(1 / 12 / 200))
    assert shares.min() < 0.1 and shares.max() > 0.9


# --- curves ---


def test_the_curve_tells_how_the_training_stands(whole):
    config = whole.config
    assert all(row["updates"] == row["tick"] for row in whole.curve)
    # A mission has three UAVs at most, and a last row in which nobody acts.
    slots = whole.curve[-1]["uav_slots"]
    assert slots == whole.uav_slots
    flown = (config.ticks + 2 * config.learning_starts) * config.num_envs
    assert flown < slots < 3 * flown
    for row in whole.curve:
        assert row["loss"] > 0
        assert row["gradient_norm"] > 0
        assert 0 <= row["evaluation_" + SELECT_BY] <= row["evaluation_collection_ratio"] <= 1
    ended = [row for row in whole.curve if "training_success" in row]
    assert 0 < len(ended) < len(whole.curve)  # now and then no mission ends
    assert all(0 <= row["training_success"] <= 1 for row in ended)
