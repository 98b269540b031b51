"""A hash of compiled functions: of their code, and of all that this names.

The functions are not compiled for it. Their syntax trees count, without docstrings, comments and
layout; of what they name, compiled functions of dess count in the same way, numbers and arrays by
their values, record types by their fields, and all else by its name. So descriptions and messages
that are not part of compiled code change nothing.
"""

import ast
import builtins
import inspect
import textwrap
from collections.abc import Iterator, Mapping
from hashlib import sha256
from typing import Any

import numpy as np

from dess.base.sources import outline_of


def hash_functions(entries: Mapping[str, tuple[Any, tuple]]) -> str:
    """The hash of functions and of all functions that they may call.

    Args:
        entries: The compiled functions, with the types of their arguments, by name.
    """
    lines = [f"{name} {types}" for name, (_, types) in sorted(entries.items())]
    waiting = [_plain(function) for function, _ in entries.values()]
    seen = set()
    while waiting:
        function = waiting.pop()
        if function in seen:
            continue
        seen.add(function)
        name = f"{function.__module__}.{function.__qualname__}"
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        lines.append(f"{name} {outline_of(tree, [])}")
        for what, value in _named(tree, function):
            lines.append(f"{name}: {what} {_describe(value)}")
            if inspect.isfunction(called := _plain(value)) and _is_ours(called):
                waiting.append(called)
    return sha256("\n".join(sorted({*lines})).encode()).hexdigest()


def _plain(value: Any) -> Any:
    """The function of Python that is behind a compiled one or an intrinsic of numba."""
    return getattr(value, "py_func", getattr(value, "_defn", value))


def _is_ours(function: Any) -> bool:
    return function.__module__.partition(".")[0] == "dess"


def _named(tree: ast.Module, function: Any) -> Iterator[tuple[str, Any]]:
    """What a function names beside its decorators, also of modules and records."""
    names = inspect.getclosurevars(function)
    known = {**vars(builtins), **function.__globals__, **names.nonlocals}
    tree.body[0].decorator_list.clear()  # type: ignore[attr-defined]
    for node in ast.walk(tree):
        if isinstance(node, ast.Name | ast.Attribute):
            path = ast.unparse(node).split(".")
            if not all(map(str.isidentifier, path)) or path[0] not in known:
                continue
            value = known[path[0]]
            for part in path[1:]:
                value = getattr(value, part, None)
            yield ".".join(path), value


def _describe(value: Any) -> str:
    if isinstance(value, np.ndarray):
        return f"{_describe(value.dtype)} {value.shape} {value.tobytes().hex()}"
    if isinstance(value, np.dtype):
        return f"{value.itemsize} {value.fields or value.str}"
    if isinstance(value, bool | int | float | str | tuple | np.generic):
        return repr(value)
    return f"{getattr(value, '_fields', '')}{getattr(value, '__qualname__', type(value).__name__)}"
