"""All random numbers, each as a pure function of what it is drawn for.

Every random draw of the model is a function of ``(seed, replication, stream, slot, sub-slot, UAV,
node)``. The function is the counter-based generator Philox 4x32-10 (J. K. Salmon et al., Parallel
random numbers: as easy as 1, 2, 3, SC'11). No state is kept between draws. Therefore a replication
gives the same mission alone and in any study, two policies meet common random numbers in the same
replication, and a draw that is not needed need not be made.

    words = block(np.uint64(seed), replication, ARRIVAL, 0, slot, node // 4)
    count = poisson(words[node % 4], 0.02)

One Philox block is four 32-bit words. The seed is the key. The four counter words are ``index``,
``slot``, ``stream`` together with its substream, and ``replication``.
"""

import math

import numpy as np

from dess.base.elementary import exp, log
from dess.base.kernels import kernel

# The stream is the purpose of a draw. Different streams never share a counter value.
PARAMETERS = 0  # the sampled parameters of a mission's scenario
START = 1  # start cells
INITIAL_DATA = 2  # initial data per node
SHADOWING = 3  # shadow fading per UAV, node and communication slot
ARRIVAL = 4  # new data per node and mission slot
POLICY = 5  # a policy's own randomness
PLAN = 8  # the search of a planner
ARRIVAL_TIME = 7  # candidates of arrivals in continuous time, per node
WIND = 6  # gusts per cell; the seed is that of the wind
UAV_FAILURE = 10  # failures and repairs per UAV and mission slot
PAD_FAILURE = 11  # the same per charging pad
NODE_FAILURE = 12  # the same per node
SEA = 13  # the geometry of a generated sea
YEAR = 14  # the order of the years of a series of weather

MAX_SEED = 2**64 - 1
MAX_REPLICATION = 2**32 - 1

CENTRAL = 0.425  # where AS 241 changes from its central to its tail approximation
MAX_NORMAL = 6.34  # a bound: normal(2**32 - 1) is 6.33796

_MASK = np.uint64(0xFFFFFFFF)
_SHIFT = np.uint64(32)
_MULTIPLIER_0 = np.uint64(0xD2511F53)
_MULTIPLIER_1 = np.uint64(0xCD9E8D57)
_WEYL_0 = np.uint64(0x9E3779B9)
_WEYL_1 = np.uint64(0xBB67AE85)


@kernel
def philox(c0, c1, c2, c3, k0, k1):
    """Philox 4x32-10: compute four random 32-bit words from a counter and a key.

    Args:
        c0, c1, c2, c3: Counter words, ``uint64`` below 2**32.
        k0, k1: Key words, ``uint64`` below 2**32.

    Returns:
        Four ``uint64`` below 2**32.
    """
    for _ in range(10):
        p0 = _MULTIPLIER_0 * c0
        p1 = _MULTIPLIER_1 * c2
        c0 = (p1 >> _SHIFT) ^ c1 ^ k0
        c1 = p1 & _MASK
        c2 = (p0 >> _SHIFT) ^ c3 ^ k1
        c3 = p0 & _MASK
        k0 = (k0 + _WEYL_0) & _MASK
        k1 = (k1 + _WEYL_1) & _MASK
    return c0, c1, c2, c3


@kernel
def block(seed, replication, stream, substream, slot, index):
    """Compute the four random 32-bit words of one block of draws.

    Args:
        seed: Seed of the study, ``uint64``.
        replication: Number of the replication, below 2**32.
        stream: Purpose of the draw, one of this module's stream constants.
        substream: Part of the stream (UAV and group of communication slots), below 2**24.
        slot: Mission slot, below 2**32.
        index: Index of a node, or of a group of four nodes, below 2**32.

    Returns:
        Four ``uint64`` below 2**32.
    """
    key = np.uint64(seed)
    return philox(
        np.uint64(index),
        np.uint64(slot),
        (np.uint64(stream) << np.uint64(24)) | np.uint64(substream),
        np.uint64(replication),
        key & _MASK,
        key >> _SHIFT,
    )


@kernel
def blocks(seed, replication, stream, substream, slot, indices, words, count):
    """Compute the blocks of many indices at once.

    The compiler makes vector code of the loop if ``count`` is a multiple of eight.

    Args:
        seed: Seed of the study, ``uint64``.
        replication: Number of the replication, below 2**32.
        stream: Purpose of the draw, one of this module's stream constants.
        substream: Part of the stream (UAV and group of communication slots), below 2**24.
        slot: Mission slot, below 2**32.
        indices: (R,) indices.
        words: (4, R) the words of each index, overwritten.
        count: How many of the indices to compute, from the first on.
    """
    key = np.uint64(seed)
    low = key & _MASK
    high = key >> _SHIFT
    c1 = np.uint64(slot)
    c3 = np.uint64(replication)
    c2 = (np.uint64(stream) << np.uint64(24)) | np.uint64(substream)
    for r in range(count):
        w0, w1, w2, w3 = philox(np.uint64(indices[r]), c1, c2, c3, low, high)
        words[0, r] = w0
        words[1, r] = w1
        words[2, r] = w2
        words[3, r] = w3


@kernel
def uniform(word):
    """A uniform number in the open interval (0, 1), computed from a 32-bit word."""
    return (np.float64(word) + 0.5) * 2.0**-32


@kernel
def integer(word, low, high):
    """A uniform integer in ``low..high``, both included, computed from a 32-bit word.

    The probabilities differ by at most 2**-32.
    """
    span = np.uint64(high - low + 1)
    return low + np.int64((np.uint64(word) * span) >> _SHIFT)


@kernel
def poisson(word, rate):
    """A Poisson deviate, computed from a 32-bit word by inversion.

    Args:
        word: 32-bit word.
        rate: Mean, at most 100.

    Returns:
        A non-negative integer.
    """
    u = uniform(word)
    count = 0
    term = exp(-rate)
    total = term
    while u > total and term > 0.0:
        count += 1
        term *= rate / count
        total += term
    return count


@kernel
def central_normal(q):
    """The standard normal quantile of probability ``0.5 + q`` for ``abs(q) <= CENTRAL``.

    The function has no branches, so that the compiler can vectorise it.
    """
    r = 0.180625 - q * q
    numerator = (
        ((((((2.5090809287301226727e3 * r + 3.3430575583588128105e4) * r
        + 6.7265770927008700853e4) * r + 4.5921953931549871457e4) * r
        + 1.3731693765509461125e4) * r + 1.9715909503065514427e3) * r
        + 1.3314166789178437745e2) * r + 3.3871328727963666080e0
    )  # fmt: skip
    denominator = (
        ((((((5.2264952788528545610e3 * r + 2.8729085735721942674e4) * r
        + 3.9307895800092710610e4) * r + 2.1213794301586595867e4) * r
        + 5.3941960214247511077e3) * r + 6.8718700749205790830e2) * r
        + 4.2313330701600911252e1) * r + 1.0
    )  # fmt: skip
    return q * numerator / denominator


@kernel
def normal_or_bound(word):
    """The normal deviate of a word if it is central, otherwise an upper bound of it.

    The function has no branches, so that the compiler can vectorise it.
    """
    q = uniform(word) - 0.5
    bound = MAX_NORMAL
    bound = 3.72 if q < 0.4999 else bound
    bound = 2.33 if q < 0.49 else bound
    bound = -1.43 if q < 0.0 else bound
    z = central_normal(q)
    return z if abs(q) <= CENTRAL else bound


@kernel
def is_central(word):
    """Whether the deviate of a word is central, so that ``normal_or_bound`` is exact."""
    return abs(uniform(word) - 0.5) <= CENTRAL


@kernel
def normal(word):
    """A standard normal deviate, computed from a 32-bit word by inversion.

    The algorithm is AS 241, PPND16 (M. J. Wichura, Applied Statistics 1988), with a relative error
    of about 1e-16. Its third branch, for tail probabilities below 1e-11, is left out because no
    32-bit word leads there. The result increases with the word and is bounded:
    ``abs(normal(word)) <= MAX_NORMAL``.
    """
    q = uniform(word) - 0.5
    if abs(q) <= CENTRAL:
        return central_normal(q)
    r = math.sqrt(-log(0.5 - abs(q)))
    r -= 1.6
    numerator = (
        ((((((7.74545014278341407640e-4 * r + 2.27238449892691845833e-2) * r
        + 2.41780725177450611770e-1) * r + 1.27045825245236838258e0) * r
        + 3.64784832476320460504e0) * r + 5.76949722146069140550e0) * r
        + 4.63033784615654529590e0) * r + 1.42343711074968357734e0
    )  # fmt: skip
    denominator = (
        ((((((1.05075007164441684324e-9 * r + 5.475938084995344946e-4) * r
        + 1.51986665636164571966e-2) * r + 1.48103976427480074590e-1) * r
        + 6.89767334985100004550e-1) * r + 1.67638483018380384940e0) * r
        + 2.05319162663775882187e0) * r + 1.0
    )  # fmt: skip
    z = numerator / denominator
    return z if q > 0.0 else -z
