"""The interval of the worst node holds whichever node it is."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest

from dess.analysis.metric_ranges import metric_for_length, metric_in_missions
from dess.analysis.metrics import LEAST, NODE_AGES, NODE_RATIOS, OLDEST, metric_of
from dess.analysis.stats.intervals import (
    Moments,
    bounded_interval,
    interval_of,
)
from dess.analysis.stats.weights import by_replication
from dess.analysis.stats.worst_node import moments_of_worst_node, worst_of_nodes

NODES = 25


def equal_nodes(rng, n):
    """All nodes are the worst: the least of their means is too low."""
    return rng.beta(2, 2, (n, NODES)), 0.5


def a_variable_node(rng, n):
    """The worst node varies much; all others are a little better, and hardly vary."""
    values = rng.beta(2120, 1880, (n, NODES))
    values[:, 3] = rng.random(n) < 0.5
    return values, 0.5


def a_seldom_forgotten_node(rng, n):
    """In 4 % of the missions nothing is collected of a node that has the best ratio in others."""
    values = 0.99 - 0.02 * rng.random((n, NODES))
    values[:, 7] = rng.random(n) >= 0.04
    return values, 0.96


def coverage(draw, metric, n, trials):
    """How often the interval of the worst node, and that of the one that did worst, hold it."""
    rng = np.random.default_rng([n, trials])
    held = np.zeros((trials, 2), bool)
    for trial in range(trials):
        values, mean = draw(rng, n)
        if metric.less_is_better:
            values, mean = metric.most * (1 - values), metric.most * (1 - mean)
        worst = values.mean(axis=0)
        did_worst = worst.argmax() if metric.less_is_better else worst.argmin()
        found = interval_of(metric, worst_of_nodes(values, metric))
        alone = interval_of(replace(metric, among=1), values[:, did_worst])
        assert found.mean == pytest.approx(worst[did_worst])
        held[trial] = [low <= mean <= high for _, low, high in (found, alone)]
    return held.mean(axis=0)


@pytest.mark.parametrize("column", [LEAST, OLDEST])
@pytest.mark.parametrize("draw", [equal_nodes, a_variable_node, a_seldom_forgotten_node])
def test_the_interval_of_the_worst_node_holds_its_mean(draw, column):
    metric = replace(metric_for_length(column, 400, None), among=NODES)
    for n in (10, 50, 100):
        held, _ = coverage(draw, metric, n, 200)
        assert held >= 0.93


def test_the_interval_of_the_node_that_did_worst_does_not():
    metric = replace(metric_of(LEAST), among=NODES)
    assert coverage(equal_nodes, metric, 100, 200)[1] < 0.7
    assert coverage(a_variable_node, metric, 100, 200)[1] < 0.8


def test_the_ends_are_those_of_all_nodes_together():
    """The lower end is the lowest of all nodes, at a level of 1 - 5 % / 2."""
    values = np.array([[0.4, 0.5], [0.5, 0.9], [0.45, 0.1], [0.4, 0.55]])
    metric = replace(metric_of(LEAST), among=2)
    found = interval_of(metric, worst_of_nodes(values, metric))
    ends = [bounded_interval(of_node, 0.975) for of_node in values.T]
    assert ends[1].low < ends[0].low
    assert found.mean == pytest.approx(0.4375)
    assert found.low == pytest.approx(ends[1].low, abs=0.04)
    assert found.high >= ends[0].high
    of_nodes = [Moments.of(of_node) for of_node in values.T]
    assert moments_of_worst_node(of_nodes, metric).interval(metric) == pytest.approx(found)


def test_means_of_missions_are_those_of_the_node_that_is_worst_over_all():
    """Not the mean of what is the least in each mission, and in every group its own node."""
    ratios = [[0.2, 0.4], [0.6, 0.3], [0.9, 0.1], [0.9, 0.2]]
    missions = pd.DataFrame({"point": [0, 0, 1, 1], "replication": [0, 1, 0, 1]})
    missions[NODE_RATIOS] = ratios
    missions[NODE_AGES] = [[5.0, 9.0], [7.0, 1.0], [2.0, 4.0], [3.0, 5.0]]
    for metric, expected in ((LEAST, [0.35, 0.15]), (OLDEST, [6.0, 4.5])):
        wide = by_replication(missions, metric, "point")
        assert wide.mean().tolist() == pytest.approx(expected)
        assert metric_in_missions(missions, metric).among == 2
