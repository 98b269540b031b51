"""The network in integers: the plain one, in any instructions, in any batch; nothing is clipped."""

from functools import cache

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba import njit
from numba.core.registry import cpu_target

from dess.base import vectors
from dess.envs.observations.sets import Sets, sea_of
from dess.envs.observations.states import MASK, compact_states
from dess.model.batch import simulate_batch
from dess.model.channel import world_of
from dess.model.state import constants_of
from dess.physics.chart import NO_FLY
from dess.policies.dense import choose, dense_forms, filled_widths
from dess.policies.integers import HIDDEN, Integers, decide
from dess.policies.learner.calibration import DRAWN, drawn_sheet
from dess.policies.learner.trained import load_policy
from dess.policies.network import DuelingNetwork, SetNetwork, weight_shapes
from dess.policies.quantization import quantize, quantize_dense
from dess.policies.registry import TRAINED
from dess.scenario.scenario import ScenarioSpace, load_scenario
from tests.dess.envs.observations.any_teams import any_teams
from tests.dess.model.flights import assert_same_alone, first_view
from tests.drawn import seeds, spaces
from tests.policies.plain_integers import PlainDense, PlainIntegers

FORMS = ("avx2", "sse2", "plain")


@cache
def _integers() -> Integers:
    """The integers of random weights."""
    generator = np.random.default_rng(1)
    forms = weight_shapes(SetNetwork.layer_sizes(Sets.shapes, HIDDEN))
    weights = {
        name: (generator.uniform(-1, 1, form) / np.sqrt(form[-1])).astype(np.float32)
        for name, form in forms.items()
    }
    first = first_view(load_scenario("bay"), 3)
    states = compact_states(first.state, first.world.chart, True)
    encoder = _encoder(load_scenario("bay"))
    return quantize(weights, [encoder.encode(states, first.mission, first.uav)])


def _encoder(space: ScenarioSpace) -> Sets:
    return Sets(sea_of(constants_of(space)[0], world_of(space)))


@settings(max_examples=25)
@given(st.data())
def test_actions_are_those_of_the_plain_network(data):
    space = data.draw(spaces())
    cells = np.argwhere(space.chart.zones.T != NO_FLY).tolist()
    states, uav = data.draw(any_teams(cells, len(space.nodes), 20))
    encoder = _encoder(space)
    missions = np.arange(len(states.missions))
    uavs = np.full_like(missions, uav)
    actions = np.empty(len(missions), np.int64)
    decide(states, missions, uavs, encoder.sea, encoder.tables, _integers(), actions)
    allowed = states.uavs[:, uav, MASK, None] >> np.arange(5) & 1
    values = PlainIntegers(_integers())(*encoder.encode(states, missions, uavs)).values
    assert (actions == np.where(allowed, values, -(2**60)).argmax(1)).all()


@settings(max_examples=25)
@given(st.integers(1, 40), st.lists(st.integers(1, 300), min_size=1, max_size=3), seeds)
def test_actions_are_those_of_the_plain_dense_network(inputs, hidden, seed):
    generator = np.random.default_rng(seed)
    forms = weight_shapes(DuelingNetwork.layer_sizes([(inputs,)], hidden))
    weights = {
        name: generator.normal(size=form).astype(np.float32) / np.float32(np.sqrt(form[-1]))
        for name, form in forms.items()
    }
    vectors = generator.normal(size=(30, inputs)).astype(np.float32)
    integers = quantize_dense(weights, [(vectors[:20],)])
    for name, form in dense_forms(inputs, hidden).items():
        assert getattr(integers, name).shape == form.shape
    masks = generator.integers(1, 32, 30)
    actions = np.empty(30, np.int64)
    choose(vectors, masks, np.array(filled_widths(inputs, hidden)), integers, actions)
    values = PlainDense(integers, inputs, hidden)(vectors).values
    allowed = masks[:, None] >> np.arange(5) & 1
    assert (actions == np.where(allowed, values, -(2**60)).argmax(1)).all()
    in_floats = DuelingNetwork(weights, np.float64)(vectors[:20].astype(np.float64))
    given_away = in_floats.max(1) - in_floats[np.arange(20), values[:20].argmax(1)]
    assert (given_away <= 0.02 * np.abs(in_floats).max()).all()


def _best_form() -> str:
    """The form for the processor of these tests."""
    for form in FORMS[:2]:
        if vectors.FORMS[form] == vectors.instructions_of(cpu_target.target_context):
            return form
    return "plain"


@pytest.mark.parametrize("form", FORMS)
def test_every_form_of_instructions_gives_the_same_numbers(form, monkeypatch):
    if FORMS.index(form) < FORMS.index(_best_form()):
        pytest.skip("this processor has no such instructions")
    monkeypatch.setattr(vectors, "instructions_of", lambda _: vectors.FORMS[form])
    layer, pool = vectors.layer(2, 16), vectors.pool(32)

    @njit
    def run(values, weights, bias, listed, factors, out, sums, best):
        layer(out, values, weights, bias, listed, len(listed), 13, -vectors.MOST)
        layer(sums, values, weights, bias, listed, len(listed), 0, 0)
        pool(best, weights, factors, listed, len(listed))

    generator = np.random.default_rng(1)
    most = vectors.MOST
    values = generator.integers(-most, most, (2, 40)).astype(np.int16)
    weights = generator.integers(-(2**12), 2**12, (20, 16, 2)).astype(np.int16)
    bias = generator.integers(-(2**25), 2**25, 16).astype(np.int32)
    listed = np.array([0, 3, 4, 19], np.int32)
    factors = generator.integers(-(2**15), 2**15, 20).astype(np.int16)
    out, sums = np.empty((2, 16), np.int16), np.empty((2, 16), np.int32)
    best = np.empty(32, np.int16)
    run(values, weights, bias, listed, factors, out, sums, best)
    pairs = values.reshape(2, 20, 1, 2)[:, listed].astype(np.int64)
    expected = (pairs * weights[listed]).sum((1, 3)) + bias
    assert (sums == expected).all()
    assert (out == (expected >> 13).clip(-most, most)).all()
    rows = weights.reshape(20, 32)[listed].astype(np.int64) * factors[listed, None]
    assert (best == ((rows + 2**14) >> 15).max(0).clip(0)).all()


def test_features_choose_the_form():
    assert vectors.form_of("x86_64-unknown-linux-gnu", "+sse2,+avx,-avx2") == "sse2"
    assert vectors.form_of("x86_64-unknown-linux-gnu", "+avx2,+fma") == "avx2"
    assert vectors.form_of("aarch64-apple-darwin", "") == "plain"
    assert vectors.form_of("wasm32-unknown-unknown", "+avx2") == "wasm"


@pytest.mark.parametrize(
    ("name", "seas"), [("generalist", ("paper", "jade-bight")), ("ddqn", ("paper",))]
)
def test_missions_are_the_same_in_any_batch_in_threads_and_in_both_engines(name, seas):
    policy = load_policy(TRAINED / name)
    assert policy.integers is not None
    for name in seas:
        space = load_scenario(name)
        assert_same_alone(space, policy, 63, range(2), batch_size=2)
        records = [
            simulate_batch(space, policy, 64, 5, batch_size=size, workers=workers)
            for size, workers in ((1, 1), (64, 2), (256, 1))
        ]
        for parts in zip(*records, strict=True):
            assert len({part.tobytes() for part in parts}) == 1


class _Watch:
    """Flies as a policy, and counts its activations that are clipped."""

    name = "watch"

    def __init__(self, policy, plain) -> None:
        self.policy = policy
        self.plain = plain
        self.clipped = self.activations = self.slots = 0

    def act(self, view):
        self.slots += 1
        if self.slots % 10 == 0:
            states = compact_states(view.state, view.world.chart, True, view.ways)
            for rows, encoder in self.policy.rows_by_sea(view):
                parts = encoder.encode(states, view.mission[rows], view.uav[rows])
                result = self.plain(*parts)
                self.clipped += sum(result.clipped.values())
                self.activations += result.activations
        return self.policy.act(view)


def test_next_to_no_activation_is_clipped_in_missions_of_sheets():
    """Neither for a lone UAV, nor on a sheet that no calibration has seen."""
    policy = load_policy(TRAINED / "generalist")
    watch = _Watch(policy, PlainIntegers(policy.integers))
    for uavs in (1, 3):
        simulate_batch(load_scenario("jade-bight", uavs=uavs), watch, 20261214, 2)
    simulate_batch(drawn_sheet(DRAWN + 1), watch, 20261214, 2)
    assert watch.activations > 1_000_000
    assert watch.clipped <= watch.activations / 100_000


def test_next_to_no_activation_is_clipped_in_missions_of_one_layout():
    """Neither in larger fleets than those of the training, nor with another quota."""
    policy = load_policy(TRAINED / "ddqn")
    watch = _Watch(policy, PlainDense(policy.integers, *policy.observation.shapes[0], [256, 256]))
    for changes in ({}, {"uavs": 1}, {"uavs": 6, "quota": 600}):
        simulate_batch(load_scenario("paper", **changes), watch, 20261214, 20)
    assert watch.activations > 1_000_000
    assert watch.clipped <= watch.activations / 100_000
