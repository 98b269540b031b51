"""Named arrays, their files (safetensors), and what is refused of them.

Files may come from anybody, and are checked before a network takes them.
"""

import hashlib
import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from safetensors import SafetensorError, safe_open
from safetensors.numpy import save_file

from dess.base.errors import InputError, shown
from dess.base.files.reading import checked
from dess.base.files.writing import replacing
from dess.policies.network import Weights

Arrays = dict[str, np.ndarray]
# Sums of single precision, 3e38 at most, stay finite behind seven layers with sums up to this one.
MOST_SUM = 100_000


def write_arrays(path: Path, arrays: Weights, metadata: dict[str, str]) -> None:
    """Write arrays into a file, completely or not at all.

    Args:
        path: The file.
        arrays: The arrays.
        metadata: One text by name. With more than one, their order in the file would be random.

    Raises:
        InputError: If it cannot be written.
    """
    with replacing(path) as temporary:
        try:
            save_file(make_contiguous(arrays), temporary, metadata)
        except SafetensorError as error:
            raise InputError(path, f"cannot be written: {error}", "another path") from None


def read_arrays(path: Path, limit: int) -> tuple[Arrays, dict[str, str]]:
    """The arrays of a file of at most ``limit`` bytes, and its metadata.

    Raises:
        InputError: If it does not exist, is too large or is no such file.
    """
    try:
        with safe_open(checked(path, limit, "a file of a training"), "np") as file:
            names = file.keys()
            return {name: file.get_tensor(name) for name in names}, file.metadata() or {}
    except InputError:
        raise
    except (OSError, SafetensorError, ValueError, TypeError) as error:
        raise describe_damage(path, error) from None


def describe_damage(path: Path, error: Exception) -> InputError:
    """What is said about a file that cannot be read."""
    problem = str(error)
    if isinstance(error, KeyError):
        problem = f"numbers of the type {error}"
    return InputError(path, f"damaged: {problem}", "a safetensors file")


def hash_arrays(content: Any, arrays: Weights) -> str:
    """A SHA-256 of plain values and of named arrays."""
    hashed = hashlib.sha256(json.dumps(content).encode())
    for name, value in sorted(make_contiguous(arrays).items()):
        hashed.update(name.encode() + b"\0")
        hashed.update(value.reshape(-1).view(np.uint8).data)
    return hashed.hexdigest()


def array_without_memory(shape: Sequence[int], dtype: Any = np.float32) -> np.ndarray:
    """An array of a form, without its memory."""
    return np.broadcast_to(np.zeros((), dtype), shape)


def require_same_forms(arrays: Weights, wanted: Weights, where: str) -> None:
    """Refuse arrays whose names, types or shapes are not the wanted ones, or that are not finite.

    Args:
        arrays: The arrays.
        wanted: Arrays of the right form; their values do not matter.
        where: The file of the arrays.

    Raises:
        InputError: If an array is missing, one too many, of another form, or not finite.
    """
    for name in sorted(arrays.keys() ^ wanted.keys()):
        problem = "is missing" if name in wanted else "is one too many"
        raise InputError(where, f"{shown(name)} {problem}", "the tensors of the config")
    for name, value in wanted.items():
        actual, allowed = (f"{array.dtype} {[*array.shape]}" for array in (arrays[name], value))
        if actual != allowed:
            raise InputError(where, f"{name} is {actual}", f"{allowed}, as the config says")
        if not _is_sound(arrays[name]):
            raise InputError(where, f"{name} has impossible values", "finite numbers")


def require_weights(weights: Weights, wanted: Weights, where: str) -> None:
    """Refuse weights of other forms, or with which the sums of a network could overflow.

    The largest sums of the networks that come with dess are below 200.

    Raises:
        InputError: As ``require_same_forms``, or if the absolute weights of an output have a sum of
            more than ``MOST_SUM``.
    """
    require_same_forms(weights, wanted, where)
    for name, array in weights.items():
        sums = np.abs(array.astype(np.float64)).reshape(len(array), -1).sum(axis=1)
        if sums.max() > MOST_SUM:
            problem = f"{name} has weights whose sum is {sums.max():.3g}"
            raise InputError(where, problem, f"sums of at most {MOST_SUM:,}, which cannot overflow")


def arrays_under(arrays: Weights, name: str) -> Arrays:
    """The arrays whose names begin with ``name.``, without that prefix."""
    prefix = name + "."
    return {
        key.removeprefix(prefix): value for key, value in arrays.items() if key.startswith(prefix)
    }


def to_bytes(array: np.ndarray) -> np.ndarray:
    """The bytes of an array, which may be structured; those between its fields are 0."""
    if array.dtype.names:
        whole, array = array, np.zeros(array.shape, array.dtype)
        for name in whole.dtype.names or ():
            array[name] = whole[name]
    return np.frombuffer(array.tobytes(), np.uint8)


def from_bytes(content: np.ndarray, dtype: np.dtype) -> np.ndarray:
    """The (N,) array of a type that ``to_bytes`` made the bytes of."""
    return np.frombuffer(content.tobytes(), dtype).copy()


def make_contiguous(arrays: Weights) -> Arrays:
    """The arrays with their values in the order of C, as files have them."""
    return {name: np.asarray(value, order="C") for name, value in arrays.items()}


def _is_sound(array: np.ndarray) -> bool:
    """Whether all numbers are finite, and all truth values 0 or 1."""
    if array.dtype == np.bool_:
        return bool((array.view(np.uint8) <= 1).all())
    return bool(np.isfinite(array).all())
