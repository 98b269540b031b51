"""The values of a field in a sweep: one value is fixed, several are swept.

    values_of("uavs", range(2, 6))  # (2, 3, 4, 5)
    values_of("initial_data", [5, 20])  # ((5, 20),): one range from which every mission draws
    values_of("initial_data", [[5, 10], [10, 20]])  # ((5, 10), (10, 20))

A list, tuple, range or array means several values, unless it can be one value of the field itself:
two numbers for ``initial_data``, four for ``zone``, cells for ``nodes``. For a field that missions
draw at random, such as ``uavs``, a range is written inside a list: ``uavs=[[1, 3]]``.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from analysis.study.design import MAX_SIZE
from dess import InputError

_LENGTHS = {"initial_data": 2, "zone": 4}  # of fields whose value is a list of numbers


def values_of(field: str, given: Any) -> tuple[Any, ...]:
    """The values of a field, as a tuple.

    Args:
        field: The field.
        given: A value, or a list, tuple, range or array of values.

    Raises:
        InputError: If there is none, or there are too many.
    """
    if _is_value(field, given):
        return (_plain(given),)
    return listed(field, given)


def listed(field: str, given: Sequence[Any] | np.ndarray) -> tuple[Any, ...]:
    """One or several values of a field, in the types of TOML.

    Raises:
        InputError: If there is none, or there are too many.
    """
    count = _count(given)
    if not 0 < count <= MAX_SIZE:
        counted = f"{count:,}" if count else "no"
        raise InputError(f"{field}: has {counted} values; allowed: 1 to {MAX_SIZE:,}")
    return tuple(_plain(value) for value in given)


def _count(given: Sequence[Any] | np.ndarray) -> int:
    """The number of values; ``len`` fails for ranges of more than 2^63."""
    if isinstance(given, range):
        return max(0, -((given.start - given.stop) // given.step))
    return len(given)


def _is_value(field: str, given: Any) -> bool:
    """Whether ``given`` is one value of the field, and not several values."""
    if isinstance(given, np.ndarray):
        return given.ndim == 0
    if not isinstance(given, Sequence) or isinstance(given, str):
        return True
    if isinstance(given, range):
        return False
    if field == "nodes":
        return all(map(_is_cell, given)) and len(given) > 0
    return len(given) == _LENGTHS.get(field) and all(map(_is_number, given))


def _is_cell(item: Any) -> bool:
    return isinstance(item, list | tuple) and len(item) == 2 and all(map(_is_number, item))


def _is_number(item: Any) -> bool:
    return isinstance(item, int | float | np.number)


def _plain(value: Any) -> Any:
    """A value in the types of TOML, without numpy types and tuples."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    return [_plain(item) for item in value] if isinstance(value, list | tuple) else value
