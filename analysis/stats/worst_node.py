"""The worst of several nodes: values whose interval holds whichever node it is."""

from collections.abc import Sequence

import numpy as np

from dess.analysis.metrics import Metric, metric_of
from dess.analysis.stats.intervals import Moments
from dess.analysis.stats.kinds import LEVEL, Sample, ends_of_means, skewness_of


def worst_node(means: np.ndarray, metric: str | Metric) -> int:
    """The node whose mean is the worst; the first one of several."""
    if metric_of(metric).less_is_better:
        return int(np.argmax(means))
    return int(np.argmin(means))


def worst_and_spread(
    means: np.ndarray, ends: np.ndarray, metric: str | Metric
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The worst node, and how wide the interval of its mean has to be: see ``worst_of_nodes``.

    Args:
        means: (..., K) means of the nodes.
        ends: (..., K, 2) ends of intervals that hold for all nodes together; nan if unknown.
        metric: The metric.

    Returns:
        (...) the worst node, (...) the node whose interval has the worst end, and (...) by which
        factor the deviations of the latter give an interval of the worst mean with that end.
    """
    if metric_of(metric).less_is_better:
        worst = np.argmax(means, axis=-1)
        ends_of_nodes = np.nan_to_num(ends[..., 1], nan=-np.inf)
        farthest = np.argmax(ends_of_nodes, axis=-1)
    else:
        worst = np.argmin(means, axis=-1)
        ends_of_nodes = np.nan_to_num(ends[..., 0], nan=np.inf)
        farthest = np.argmin(ends_of_nodes, axis=-1)
    end = _of_node(ends_of_nodes, farthest)
    width = _of_node(means, farthest) - end
    is_known = np.isfinite(width) & (width != 0)
    distance = np.where(is_known, _of_node(means, worst) - end, 1.0)
    return worst, np.where(is_known, farthest, worst), distance / np.where(is_known, width, 1.0)


def _of_node(values: np.ndarray, node: np.ndarray) -> np.ndarray:
    """The (...) values of one node each, of (..., K) values."""
    return np.take_along_axis(values, np.expand_dims(node, -1), axis=-1)[..., 0]


def worst_of_nodes(by_node: np.ndarray, metric: Metric) -> np.ndarray:
    """Values whose mean is that of the worst node, and whose interval holds whichever it is.

    The own interval of the node that did worst would be too narrow, since another one, whose values
    vary more, may be the worst. So the lower end of a ratio (the upper one of an age) is to be the
    lowest of all nodes, of intervals that hold for all nodes together (``Metric.level_of_each``):
    these values deviate from their mean as those of the node with this end, by as much less as its
    mean is higher.

    Why it holds, for a ratio: with the probability asked for, the interval of every node has its
    true mean. Then the lower end here is not above that of the node that is truly the worst, which
    is below its mean. The upper end is not below the own one of the node that did worst, which is
    above its true mean, and no true mean is below the worst.

    Args:
        by_node: (n, K) values of n missions at K nodes.
        metric: The metric, of K nodes.

    Returns:
        (n,) the values.
    """
    means = by_node.mean(axis=0)
    deviations = by_node - means
    cubes = (deviations**3).sum(axis=0)
    skewness = skewness_of((deviations**2).sum(axis=0), cubes, len(by_node))
    sample = Sample(means, by_node.var(axis=0), skewness, len(by_node))
    ends = np.transpose(ends_of_means(metric, sample, metric.level_of_each(LEVEL)))
    worst, farthest, scale = worst_and_spread(means, ends, metric)
    return means[worst] + scale * (by_node[:, farthest] - means[farthest])


def moments_of_worst_node(nodes: Sequence[Moments], metric: str | Metric) -> Moments:
    """The moments of the linearised values of ``worst_of_nodes``.

    Args:
        nodes: The moments of the metric at each node.
        metric: The metric, of as many nodes.
    """
    means = np.array([node.mean for node in nodes])
    ends = np.array([node.interval(metric)[1:] for node in nodes])
    worst, farthest, wider = worst_and_spread(means, ends, metric)
    chosen = nodes[int(farthest)]
    mean = float(means[worst])
    scale = float(wider)
    return Moments(
        n=chosen.n,
        total=mean * chosen.n,
        squares=chosen.squares * scale**2,
        cubes=chosen.cubes * scale**3,
        least=mean + scale * (chosen.least - chosen.mean),
        most=mean + scale * (chosen.most - chosen.mean),
    )
