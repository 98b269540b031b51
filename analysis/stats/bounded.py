"""The confidence interval of a mean of values from 0 to 1, such as shares and collection ratios.

A policy that fails one mission in a thousand shows no failure in most samples of 300 missions, and
Student's t, which knows no more than the spread of the sample, then has an interval that is far too
narrow. So one value of 0 and one of 1 are added to the sample before Student's t is taken, as
A. Agresti and B. Caffo (The American Statistician 54 (2000) 280-288) add one success and one
failure to a sample of outcomes, and D. G. Bonett and R. M. Price (Statistical Methods in Medical
Research 21 (2012) 449-466) to paired outcomes: any value of the sample may turn out as low as 0, or
as high as 1. The result has four properties that Student's t lacks: it lies in [0, 1], has a
positive length for every sample, holds the mean of the sample, and covers the mean where failures
are rare, few, or all that there is (measured in ``tests/analysis/test_coverage.py``).

A difference of two policies gets one value for a mission in which A alone does well, and one for a
mission in which B alone does (``rare_differences``).

The betting interval of I. Waudby-Smith and A. Ramdas (Journal of the Royal Statistical Society B 86
(2024) 1-27) has a guarantee for every distribution, for which it is longer by a third to three
times; and it depends on the order of the missions. This one depends on the mean, the variance and
the number of the values alone.

Studies import this module, so it does without ``scipy.stats``, which takes long to load.
"""

from typing import Any

import numpy as np
from scipy.special import ndtri, stdtrit

from analysis.names import BOUNDED, REWARD, SHARES
from dess.scenario import ScenarioSpace

LEVEL = 0.95
# What a failure costs: the reward of a filled quota is not earned, that of an empty battery is.
_FIELDS = ScenarioSpace.model_fields
FAILURE_COST = _FIELDS["reward_quota"].default - _FIELDS["reward_depleted"].default


def bounded_ends(mean: Any, variance: Any, n: Any, level: float = LEVEL) -> tuple[Any, Any]:
    """The ends of the confidence intervals of means of values from 0 to 1.

    At levels other than 95 %, not one 0 and one 1 are added but ``ndtri((1 + level) / 2)**2 / 4``
    of each (0.96 at 95 %, 1.66 at 99 %): the more certain the interval, the rarer the values that
    it must allow for.

    Args:
        mean: (...) means of the samples.
        variance: (...) mean squared deviations of the samples from these means.
        n: (...) numbers of values, above 0; not whole where it is an effective number.
        level: Confidence level.

    Returns:
        (...) lower and (...) upper ends, with 0 <= low <= mean <= high <= 1 and low < high.
    """
    added = float(ndtri((1 + level) / 2) ** 2 / 4)
    size = n + 2 * added
    centre = (n * mean + added) / size
    squares = n * (variance + (mean - centre) ** 2) + added * (centre**2 + (1 - centre) ** 2)
    half = stdtrit(size - 1, (1 + level) / 2) * np.sqrt(squares / (size - 1) / size)
    low, high = np.maximum(centre - half, 0.0), np.minimum(centre + half, 1.0)
    return np.minimum(low, mean), np.maximum(high, mean)


def rare_differences(metric: str, a: Any, b: Any) -> tuple[Any, Any] | None:
    """The differences A - B of missions in which only one of two policies does well.

    For outcomes, they are 1 and -1. Of a metric from 0 to 1, one value falls to 0 or rises to 1,
    and the other one stays at its mean: what goes further counts. A reward changes by the cost of
    a failure.

    Args:
        metric: The metric.
        a: (...) means of A.
        b: (...) means of B.

    Returns:
        The (...) highest and the (...) lowest differences; None if they are not known.
    """
    if metric in SHARES:
        return 0 * (a - b) + 1, 0 * (a - b) - 1
    if metric in BOUNDED:
        return np.maximum(a, 1 - b), -np.maximum(b, 1 - a)
    if metric == REWARD:
        return a - b + FAILURE_COST, a - b - FAILURE_COST
    return None
