"""The policy: the best allowed action, the same in either engine, and at home only."""

from typing import Any

import numpy as np
import pytest
from hypothesis import event, given, settings
from hypothesis import strategies as st

from dess.envs.observations.sets import Sets, sea_of
from dess.envs.observations.states import ACTIVE, Layout, compact_states, layout_of
from dess.envs.observations.vector import Vector
from dess.envs.stepper import MissionStepper
from dess.model.batch import simulate_batch
from dess.model.channel import world_of
from dess.model.guard import guard
from dess.model.mission import simulate
from dess.model.state import constants_of
from dess.policies.learner.policy import FloatNetwork, LearnedPolicy
from dess.policies.network import DuelingNetwork, SetNetwork, Sizes, weight_shapes
from dess.scenario.scenario import ScenarioSpace, load_scenario
from tests.dess.model.flights import assert_same_alone, cells_of
from tests.drawn import PLAIN_SEA, Checked, Recorder, Wanderer, replications, seeds, spaces
from tests.policies.learner.tiny import refusal_of

PAPER = load_scenario("paper")


def _weights(layers: Sizes, seed: int = 1) -> dict[str, np.ndarray]:
    """Random weights, of the size that a training begins with."""
    generator = np.random.default_rng(seed)
    return {
        name: (generator.uniform(-1, 1, form) / np.sqrt(form[-1])).astype(np.float32)
        for name, form in weight_shapes(layers).items()
    }


def _random(layout: Layout, guarded: bool = True, seed: int = 1) -> LearnedPolicy:
    """A policy of random weights."""
    vector = Vector(layout)
    weights = _weights(DuelingNetwork.layer_sizes(vector.shapes, [32, 32]), seed)
    network = FloatNetwork(DuelingNetwork, weights)
    return LearnedPolicy("random weights", vector, network, guarded, layout)


class _Fixed:
    """Gives every UAV the same values."""

    rows = 10

    def __init__(self, weights: dict[str, np.ndarray], dtype: Any):
        self.values = weights["values"].astype(dtype)

    def __call__(self, vector: np.ndarray) -> np.ndarray:
        return np.tile(self.values, (len(vector), 1))


def _fixed(values: list[float], space: ScenarioSpace, guarded: bool = False) -> LearnedPolicy:
    layout, weights = layout_of(space), {"values": np.array(values)}
    network = FloatNetwork(_Fixed, weights)
    return LearnedPolicy("fixed", Vector(layout), network, guarded, layout)


@settings(max_examples=10)
@given(spaces(**PLAIN_SEA), st.booleans(), seeds, replications)
def test_what_is_not_allowed_is_never_chosen(space, guarded, seed, replication):
    layout = layout_of(space)
    allowed = guard if guarded else lambda view: view.legal
    team = [Checked(_random(layout, guarded, weights), allowed) for weights in (1, 2)]
    record = simulate(space, team[: space.uavs[1]], seed, replication)
    event(f"charged {(record.uavs['slots_charging'] > 0).any()}")


@pytest.mark.parametrize("guarded", [True, False])
def test_both_engines_give_the_same_records(guarded):
    recorder = Recorder(_random(layout_of(PAPER), guarded))
    simulate(PAPER, recorder, 61)
    assert len(set(recorder.asked.values())) > 1  # the network does tell situations apart
    policy = recorder.policy
    assert_same_alone(PAPER, policy, 61, range(6), batch_size=4)
    assert_same_alone(PAPER, [policy, Wanderer()], 62, range(3), batch_size=3)


def _path(values: list[float], slots: int) -> list[tuple[float, float]]:
    """The cells of a lone UAV that starts at (2, 2) on a grid of 4, slot by slot."""
    space = ScenarioSpace.of(
        grid=4, zone=[2, 2, 1, 1], nodes=[[0, 0]], uavs=1, max_slots=slots, initial_data=1e6
    )
    return cells_of(simulate(space, _fixed(values, space), events=True))


def test_it_takes_the_allowed_action_of_the_highest_value():
    # North; at the northern edge east; in the corner south; and so on.
    path = [(2, 1), (2, 0), (3, 0), (3, 1), (3, 0), (3, 1)]
    assert _path([5, 4, 3, 2, 1], 6) == path
    assert _path([1, 2, 3, 4, 5], 3) == [(2, 2)] * 3


def test_rounding_decides_nothing():
    assert _path([1 - 1e-12, 1, 1 + 1e-12, 1, 1], 2) == [(2, 1), (2, 0)]
    assert _path([1 - 1e-6, 1, 1 + 1e-6, 1, 1], 1) == [(2, 3)]


AWAY = [
    ({"grid": 40}, "grid 32, not 40"),
    ({"zone": [25, 2, 4, 4]}, "zone_x 26, not 25"),
    ({"zone": [26, 3, 4, 4]}, "zone_y 2, not 3"),
    ({"zone": [26, 2, 3, 4]}, "zone_width 4, not 3"),
    ({"zone": [26, 2, 4, 5]}, "zone_height 4, not 5"),
    ({"nodes": PAPER.nodes[1:]}, "other nodes"),
    ({"nodes": PAPER.nodes[::-1]}, "other nodes"),
]


@pytest.mark.parametrize("fly", [simulate, simulate_batch])
def test_away_from_home_it_refuses(fly):
    policy = _random(layout_of(PAPER))
    for changes, problem in AWAY:
        line = refusal_of(fly, load_scenario("paper", **changes), policy)
        assert line.startswith(f"policy random weights: has learned {problem}")
        assert "; allowed: " in line


# --- on any sea ---


LAYERS = SetNetwork.layer_sizes(Sets.shapes, [16, 8, 16])


def _any(seed: int = 1) -> LearnedPolicy:
    """A policy of random weights that decides on any sea."""
    network = FloatNetwork(SetNetwork, _weights(LAYERS, seed))
    return LearnedPolicy("generalist", Sets, network, True, None)


@settings(max_examples=8)
@given(spaces(), seeds, st.integers(1, 5))
def test_on_any_sea_a_mission_does_not_depend_on_those_beside_it(space, seed, batch_size):
    assert_same_alone(space, _any(), seed, range(5), batch_size=batch_size)


def test_missions_with_other_fleets_pads_and_data_beside_it_change_nothing():
    """A smaller fleet has fewer rows of teammates; pads and data are part of what is observed."""
    kinds = [
        load_scenario("paper", **fields)
        for fields in ({"uavs": 1}, {"uavs": 3, "pads": 1}, {"uavs": 6, "initial_data": 2.0})
    ]
    scenarios, policy = kinds * 2, _any()
    records = simulate_batch(scenarios, policy, 7, len(scenarios))
    for number, scenario in enumerate(scenarios):
        alone = simulate_batch(scenario, policy, 7, [number])
        assert alone.missions[0].tobytes() == records.missions[number].tobytes()


@settings(max_examples=20)
@given(spaces(), st.integers(0, 3))
def test_on_any_sea_values_turn_with_it(space, seed):
    """The value of a move is that of the mirrored move on the mirrored sea."""
    network = SetNetwork(_weights(LAYERS, seed), np.float32)
    sets = Sets(sea_of(constants_of(space)[0], world_of(space)))
    stepper = MissionStepper(space, 3, seed)
    stepper.launch(stepper.indices)
    states = compact_states(stepper.state, space.chart, True)
    # Contiguous arrays, as policies have them: for others, all would be compiled once more.
    missions, uavs = map(np.ascontiguousarray, np.nonzero(states.uavs[..., ACTIVE]))
    parts = sets.encode(states, missions, uavs)
    turned, moves = [*parts], [0, 3, 2, 1, 4, 7, 6, 5, 8]
    for number in (1, 3, 5, 7):
        turned[number] = np.ascontiguousarray(parts[number][:, moves[: parts[number].shape[1]]])
    values = network(*parts)
    np.testing.assert_allclose(network(*turned), values[:, moves[:5]], atol=1e-5)
