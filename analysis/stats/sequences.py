"""Confidence sequences: intervals of means that hold however often somebody looks at them.

An interval for a fixed number of missions covers too seldom if its reader watches it grow narrower
and stops when it pleases. A confidence sequence covers the mean at all numbers of missions at once
with probability 1 - error, so it may be watched. For 100 to 600 missions it is 1.3 to 1.8 times as
wide as the interval of a mean for a fixed number, and 2.4 to 3.2 times as that of a paired
difference.

Values with known bounds have the betting sequence of Waudby-Smith and Ramdas (Estimating means of
bounded random variables by betting, JRSS B 86, 2024). It bets against every possible mean of a grid
(``betting``). This is exact at any number of values. The stakes are those that the paper calls
aGRAPA: nearly the ones with which the capital would have grown fastest so far.

Values without bounds have an asymptotic sequence (Waudby-Smith, Arbour, Sinha, Kennedy and Ramdas,
Time-uniform central limit theory and asymptotic confidence sequences, Annals of Statistics 52,
2024, Theorem 2.2), which takes means of many missions as nearly normal. That is wrong where rare
missions fail and none of these has been seen; so where it is known by how much a failure changes
the values, their variance is that with two failures more, one upwards and one downwards.

The functions are compiled, and use only arithmetic that every machine does in the same way.
"""

import math

import numpy as np

from dess.analysis.stats.betting import settle
from dess.base.elementary import log
from dess.base.kernels import kernel

# The range of the values is divided into this number of equal parts. Intervals end between them.
PARTS = 1000
# A bet never stakes more than this share of the capital.
_MOST_STAKED = 0.5
# The number of values at which an asymptotic sequence is about as narrow as it can be.
_NARROWEST_AT = 1000
# The number of values that an asymptotic sequence needs before it rules anything out.
_ENOUGH = 30

SEQUENCE = np.dtype(
    [
        ("error", float),  # the probability that the sequence fails to cover the mean at some time
        ("least", float),  # what values can be
        ("most", float),
        ("failure", float),  # by how much a rare failure changes a value without bounds, or 0
        ("values", np.int64),  # the number of values so far
        ("mean", float),  # of the values so far
        ("squares", float),  # the sum of their squared deviations from the mean
        # Of the values in 0..1, and of one of 1/2 more: their sum, and the sum of the squared
        # deviations of each from the mean of those before it, and 1/4.
        ("sum", float),
        ("spread", float),
        # The part of the range in which the interval begins, and the part before which it ends.
        ("first", np.int64),
        ("last", np.int64),
        # The capital of the bets that the mean is more, and that it is less, than the lower end of
        # each part.
        ("for_more", float, (PARTS,)),
        ("for_less", float, (PARTS,)),
    ]
)


@kernel
def start_sequence(sequence, least, most, failure, error):
    """Make a sequence one without values.

    Args:
        sequence: (1,) ``SEQUENCE``, for ``add_values`` and ``sequence_ends``.
        least: The smallest value that there can be, or ``-inf``.
        most: The largest one, or ``inf``.
        failure: By how much a rare failure changes a value without bounds; 0 if that is not known.
        error: The probability that the sequence fails to cover the mean at some time.
    """
    s = sequence[0]
    s.error = error
    s.least = least
    s.most = most
    s.failure = failure
    s.values = 0
    s.mean = 0.0
    s.squares = 0.0
    s.sum = 0.5
    s.spread = 0.25
    s.first = 0
    s.last = PARTS
    for part in range(PARTS):
        s.for_more[part] = 1.0
        s.for_less[part] = 1.0


@kernel
def add_values(sequence, values):
    """Add values in their order. The interval depends on this order, and not on when it is read.

    Args:
        sequence: (1,) ``SEQUENCE``.
        values: (n,) values within the bounds of the sequence; a nan is passed over.
    """
    s = sequence[0]
    is_bounded = s.most - s.least < math.inf
    for value in values:
        if math.isnan(value):
            continue
        s.values += 1
        deviation = value - s.mean
        s.mean += deviation / s.values
        s.squares += deviation * (value - s.mean)
        if is_bounded:
            _bet(s, (value - s.least) / (s.most - s.least))


@kernel
def _bet(s, value):
    """Settle the bets on a value from 0 to 1, and rule out the means against which they have won.

    The stakes follow from the values before. Half of the capital is bet on either side, so that a
    mean is ruled out when one of the halves has grown to 1 / error.
    """
    mean = s.sum / s.values
    variance = s.spread / s.values
    for part in range(max(s.first, 1), s.last):
        tested = part / PARTS
        distance = mean - tested
        stake = distance / (variance + distance * distance)
        if stake > 0.0:
            stake = min(stake, _MOST_STAKED / tested)
            s.for_more[part] = settle(s.for_more[part], stake, value, tested)
        else:
            stake = min(-stake, _MOST_STAKED / (1.0 - tested))
            s.for_less[part] = settle(s.for_less[part], -stake, value, tested)
    s.sum += value
    deviation = value - s.sum / (s.values + 1)
    s.spread += deviation * deviation
    limit = 2.0 / s.error
    for part in range(s.last - 1, s.first, -1):
        if s.for_more[part] >= limit:
            s.first = part
            break
    for part in range(s.first + 1, s.last):
        if s.for_less[part] >= limit:
            s.last = part
            break


@kernel
def sequence_ends(sequence):
    """The lower and the upper end of the interval of the mean, so far.

    Args:
        sequence: (1,) ``SEQUENCE``.
    """
    s = sequence[0]
    if s.most - s.least < math.inf:
        range_of_values = s.most - s.least
        low = s.least + range_of_values * s.first / PARTS
        high = s.least + range_of_values * s.last / PARTS
        return low, high
    return _asymptotic_ends(s, s.failure)


@kernel
def ends_of_what_was_seen(sequence):
    """The ends of the interval that allows for no failure but those among the values.

    It is the asymptotic sequence, also of values with bounds: what Student's interval is for a
    fixed number of values.

    Args:
        sequence: (1,) ``SEQUENCE``.
    """
    return _asymptotic_ends(sequence[0], 0.0)


@kernel
def _asymptotic_ends(s, failure):
    """The ends of the asymptotic interval, with one failure upwards and one downwards more."""
    if s.values < _ENOUGH:
        return s.least, s.most
    # The square of rho of the theorem, with which it is about narrowest at that number of values.
    surprise = -2.0 * log(s.error)
    rho_squared = (surprise + log(surprise) + 1.0) / _NARROWEST_AT
    growth = s.values * rho_squared + 1.0
    variance = (s.squares + 2.0 * failure * failure) / (s.values - 1)
    factor = 2.0 * growth / (s.values * s.values * rho_squared)
    half = math.sqrt(variance * factor * log(math.sqrt(growth) / s.error))
    return max(s.least, s.mean - half), min(s.most, s.mean + half)
