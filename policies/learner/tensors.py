"""Named tensors in files (safetensors): written atomically, and checked before they are used."""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from dess.errors import InputError, shown
from dess.files.reading import checked
from dess.files.writing import replacing

Tensors = dict[str, torch.Tensor]


def write(path: Path, tensors: Mapping[str, torch.Tensor], metadata: dict[str, str]) -> None:
    """Write tensors into a file, completely or not at all.

    Args:
        path: The file.
        tensors: The tensors, on any device.
        metadata: One text by name. With more than one, their order in the file would be random.

    Raises:
        InputError: If it cannot be written.
    """
    plain = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    with replacing(path) as temporary:
        try:
            save_file(plain, temporary, metadata)
        except SafetensorError as error:
            raise InputError(f"{path}: cannot be written: {error}; allowed: another path") from None


def read(path: Path, limit: int) -> tuple[Tensors, dict[str, str]]:
    """The tensors of a file of at most ``limit`` bytes, and its metadata.

    Raises:
        InputError: If it does not exist, is too large or is no such file.
    """
    try:
        with safe_open(checked(path, limit, "a file of a training"), "pt") as file:
            names = file.keys()
            return {name: file.get_tensor(name) for name in names}, file.metadata() or {}
    except InputError:
        raise
    except (OSError, SafetensorError, ValueError) as error:
        raise damaged(path, error) from None


def damaged(path: Path, error: Exception) -> InputError:
    """What is said about a file that cannot be read."""
    return InputError(f"{path}: damaged: {error}; allowed: a safetensors file")


def digest(content: Any, tensors: Mapping[str, torch.Tensor]) -> str:
    """A SHA-256 of plain values and of named tensors."""
    hashed = hashlib.sha256(json.dumps(content).encode())
    for name in sorted(tensors):
        hashed.update(name.encode() + b"\0")
        content = tensors[name].detach().cpu().contiguous().reshape(-1)
        hashed.update(content.view(torch.uint8).numpy().data)
    return hashed.hexdigest()


def require_forms(
    tensors: Mapping[str, torch.Tensor], wanted: Mapping[str, torch.Tensor], where: str
) -> None:
    """Refuse tensors whose names, types or shapes are not the wanted ones, or that are not finite.

    Args:
        tensors: The tensors.
        wanted: Tensors of the right form; their values do not matter.
        where: The file of the tensors.

    Raises:
        InputError: If a tensor is missing, one too many, of another form, or not finite.
    """
    for name in sorted(tensors.keys() ^ wanted.keys()):
        problem = "is missing" if name in wanted else "is one too many"
        raise InputError(f"{where}: {shown(name)} {problem}; allowed: the tensors of the config")
    for name, value in wanted.items():
        actual, allowed = _form(tensors[name]), _form(value)
        if actual != allowed:
            raise InputError(f"{where}: {name} is {actual}; allowed: {allowed}, as the config says")
        if not _is_sound(tensors[name]):
            raise InputError(f"{where}: {name} has impossible values; allowed: finite numbers")


def part(tensors: Mapping[str, torch.Tensor], name: str) -> Tensors:
    """The tensors whose names begin with ``name.``, without that prefix."""
    prefix = name + "."
    return {
        key.removeprefix(prefix): value for key, value in tensors.items() if key.startswith(prefix)
    }


def bytes_of(array: np.ndarray) -> torch.Tensor:
    """The bytes of an array, which may be structured; those between its fields are 0."""
    if array.dtype.names:
        whole, array = array, np.zeros(array.shape, array.dtype)
        for name in whole.dtype.names or ():
            array[name] = whole[name]
    return torch.from_numpy(np.frombuffer(array.tobytes(), np.uint8).copy())


def array_of(content: torch.Tensor, dtype: np.dtype) -> np.ndarray:
    """The (N,) array of a type that ``bytes_of`` made the bytes of."""
    return np.frombuffer(content.numpy().tobytes(), dtype).copy()


def _form(tensor: torch.Tensor) -> str:
    """The type and shape of a tensor, like ``float32 [5, 16]``."""
    return f"{str(tensor.dtype).removeprefix('torch.')} {list(tensor.shape)}"


def _is_sound(tensor: torch.Tensor) -> bool:
    """Whether all numbers are finite, and all truth values 0 or 1."""
    if tensor.dtype == torch.bool:
        return bool((tensor.contiguous().view(torch.uint8) <= 1).all())
    return bool(torch.isfinite(tensor).all()) if tensor.is_floating_point() else True
