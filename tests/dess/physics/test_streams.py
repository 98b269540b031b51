"""Randomness: the generator against its published vectors, the deviates against scipy."""

import numpy as np
import pytest
from scipy import special, stats

from dess.physics import streams

EDGES = [0, 1, 2, 3, 2**31 - 1, 2**31, 2**31 + 1, 2**32 - 3, 2**32 - 2, 2**32 - 1]

# Random123, kat_vectors: philox4x32 with 10 rounds; counter, key, words.
KNOWN_ANSWERS = [
    "00000000 00000000 00000000 00000000 00000000 00000000 6627e8d5 e169c58d bc57ac4c 9b00dbd8",
    "ffffffff ffffffff ffffffff ffffffff ffffffff ffffffff 408f276d 41c83b0e a20bc7c6 6d5451fd",
    "243f6a88 85a308d3 13198a2e 03707344 a4093822 299f31d0 d16cfe09 94fdcceb 5001e420 24126ea1",
]


@pytest.mark.parametrize("answer", KNOWN_ANSWERS)
def test_philox_gives_the_published_answers(answer):
    words = [np.uint64(int(word, 16)) for word in answer.split()]
    assert list(streams.philox(*words[:6])) == words[6:]


def test_a_block_is_philox_of_its_coordinates():
    seed, replication, stream, substream, slot, index = 2**64 - 2, 2**32 - 3, 4, 2**24 - 5, 6, 7
    counter = [index, slot, (stream << 24) + substream, replication]
    key = [seed % 2**32, seed // 2**32]
    expected = streams.philox(*(np.uint64(word) for word in counter + key))
    assert streams.block(np.uint64(seed), replication, stream, substream, slot, index) == expected


def test_normal_in_the_tails_is_exact_bounded_and_symmetric():
    # Both sides of the switch between the approximations, |q| = 0.425, and the outermost words.
    switches = [int(p * 2**32) + step for p in (0.075, 0.925) for step in (-1, 0, 1)]
    words = EDGES + switches + [2**exponent for exponent in range(2, 32)]
    for word in words:
        z = streams.normal(np.uint64(word))
        assert z == pytest.approx(special.ndtri((word + 0.5) / 2**32), rel=1e-13)
        assert abs(z) <= streams.MAX_NORMAL
        assert streams.normal(np.uint64(2**32 - 1 - word)) == -z
    assert streams.normal(np.uint64(2**32 - 1)) > streams.MAX_NORMAL - 0.01


@pytest.mark.parametrize("rate", [0.02, 1.0, 7.5, 100.0])
def test_poisson_matches_scipy(rate):
    words = np.concatenate([EDGES, np.linspace(0, 2**32 - 1, 2000)]).astype(np.uint64)
    counts = [streams.poisson(word, rate) for word in words]
    np.testing.assert_array_equal(counts, stats.poisson.ppf((words + 0.5) / 2**32, rate))
