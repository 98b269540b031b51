"""The networks have the paper's layers, and value alike in either precision, trained or acting."""

import numpy as np
import pytest
import torch
from torch import Tensor, nn

from dess.envs.observations.sets import ACTION, MATE, MOVES, NODE, OWN, ZONE, Sets
from dess.policies import network as acting
from dess.policies.learner.network import DuelingNetwork, PaperNetwork, SetNetwork, to_arrays

SHAPES = ((4, 17, 17), (4, 21, 21), (1,))


def _maps(rows: int) -> list[Tensor]:
    generator = torch.Generator().manual_seed(1)
    return [torch.rand(rows, *shape, generator=generator) for shape in SHAPES]


@pytest.mark.parametrize("paper", [True, False])
def test_bfloat16_is_near_float32(paper):
    torch.manual_seed(4)

    def make(precision: torch.dtype) -> nn.Module:
        if paper:
            return PaperNetwork(SHAPES, precision)
        return DuelingNetwork(30, [64, 64], precision)

    exact, rounded = make(torch.float32), make(torch.bfloat16)
    rounded.load_state_dict(exact.state_dict())
    inputs = _maps(16) if paper else [torch.rand(16, 30)]
    expected, values = exact(*inputs), rounded(*inputs)
    assert values.dtype == torch.float32
    torch.testing.assert_close(values, expected, atol=0.01, rtol=0)
    assert not torch.equal(values, expected)  # bfloat16 it was

    values.square().mean().backward()
    for parameter in rounded.parameters():
        assert parameter.dtype == torch.float32
        assert parameter.grad is not None and parameter.grad.dtype == torch.float32


def _sets(mates: int) -> tuple[tuple[int, ...], ...]:
    """Shapes of a row on a sea with seven nodes, so many teammates and two zones."""
    nodes, zones = ((7, NODE), (MOVES, 7)), ((2, ZONE), (MOVES, 2))
    return (OWN,), (5, ACTION), *nodes, (mates, MATE), (MOVES, mates), *zones


KINDS = [
    (PaperNetwork(SHAPES), acting.PaperNetwork, SHAPES, ()),
    (DuelingNetwork(30, [16]), acting.DuelingNetwork, ((30,),), [16]),
    (DuelingNetwork(242, [512, 512]), acting.DuelingNetwork, ((242,),), [512, 512]),
    *(
        (SetNetwork(Sets.shapes, [32, 16, 128]), acting.SetNetwork, shapes, [32, 16, 128])
        for shapes in map(_sets, (2, 0))
    ),
]


@pytest.mark.parametrize(("trained", "kind", "shapes", "hidden"), KINDS)
@pytest.mark.parametrize("rows", [1, 70])
def test_a_policy_acts_with_the_values_of_the_network_that_is_trained(
    trained, kind, shapes, hidden, rows
):
    generator, weights = np.random.default_rng(rows), to_arrays(trained.state_dict())
    forms = {name: value.shape for name, value in weights.items()}
    assert acting.weight_shapes(kind.layer_sizes(shapes, hidden)) == forms
    inputs = [generator.uniform(-1, 1, (rows, *shape)) for shape in shapes]
    inputs[0][generator.random(inputs[0].shape) < 0.5] = 0  # as most cells of a map are
    for dtype, off in ((np.float32, 1e-5), (np.float64, 1e-12)):
        parts = [part.astype(dtype) for part in inputs]
        with torch.no_grad():
            values = trained.to(torch.from_numpy(parts[0]).dtype)(*map(torch.from_numpy, parts))
        np.testing.assert_allclose(kind(weights, dtype)(*parts), values, rtol=0, atol=off)
        assert values.std(1).min() > 1e-4
