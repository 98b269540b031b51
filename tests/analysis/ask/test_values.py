import numpy as np
import pytest

from analysis.ask.sweep import values_of
from dess import InputError

# Field, what is given, and the values that this is.
GIVEN = [
    ("uavs", 3, (3,)),
    ("uavs", range(2, 6), (2, 3, 4, 5)),
    ("uavs", [[1, 3]], ([1, 3],)),
    ("uavs", np.array([2, 4]), (2, 4)),
    ("arrival_rate", np.array([0.01, 0.02]), (0.01, 0.02)),
    ("forbid_swaps", [False, True], (False, True)),
    ("initial_data", [5, 20], ([5, 20],)),
    ("initial_data", np.array([5, 20]), (5, 20)),
    ("initial_data", [[5, 7.5], [7.5, 10]], ([5, 7.5], [7.5, 10])),
    ("zone", [[26, 2, 4, 4], [0, 0, 2, 2]], ([26, 2, 4, 4], [0, 0, 2, 2])),
    ("nodes", [[1, 2], [3, 4]], ([[1, 2], [3, 4]],)),
    ("nodes", [[[1, 2]], [[3, 4]]], ([[1, 2]], [[3, 4]])),
]


@pytest.mark.parametrize(("field", "given", "values"), GIVEN)
def test_one_value_is_fixed_and_several_are_swept(field, given, values):
    found = values_of(field, given)
    assert found == values
    assert [type(value) for value in found] == [type(value) for value in values]


@pytest.mark.parametrize(
    ("given", "line"),
    [
        ([], "uavs: has no values; allowed: 1 to 100,000"),
        (range(0, 10**30, 3), "uavs: has 333,333,333,333,333,333,333,333,333,334 values"),
        (range(10**30, 0, -(10**10)), "uavs: has 100,000,000,000,000,000,000 values"),
    ],
)
def test_values_that_are_none(given, line):
    with pytest.raises(InputError, match=line):
        values_of("uavs", given)
