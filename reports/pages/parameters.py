"""The parameters of a notebook: the assignments of plain values in one of its cells.

values_of('missions = 500  # of every policy')                     # {'missions': 500}
with_values('missions = 500  # of every policy', {"missions": 40})  # keeps the comment
"""

import ast
import os
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from policies.registry import is_path


def values_of(source: str) -> dict[str, Any]:
    """The parameters that a cell assigns, with their values."""
    return {name: ast.literal_eval(value) for name, value in _assignments(source)}


def with_values(source: str, values: Mapping[str, Any]) -> str:
    """The source of a cell with other values for its parameters; comments and layout are kept.

    Args:
        source: The source of the cell.
        values: Values by name; names that the cell does not assign are ignored.
    """
    before = values_of(source)
    lines = source.encode().split(b"\n")  # columns of a syntax tree count bytes
    for name, node in reversed([*_assignments(source)]):
        if name in values and values[name] != before[name]:
            first, last = node.lineno - 1, (node.end_lineno or node.lineno) - 1
            head, tail = lines[first][: node.col_offset], lines[last][node.end_col_offset :]
            lines[first : last + 1] = [head + repr(values[name]).encode() + tail]
    return b"\n".join(lines).decode()


def with_paths(value: Any, write: Callable[[str], str]) -> Any:
    """The value of a parameter with its paths replaced, such as relative by absolute ones.

    A path is a word with a path separator, one that ends with ``.toml``, or a policy of a folder or
    a Python file. It may be a part of a team: with ``os.path.abspath``, ``greedy,mine`` becomes
    ``greedy,/home/me/mine``.
    """
    if isinstance(value, list):
        return [with_paths(item, write) for item in value]
    if not isinstance(value, str):
        return value
    return ",".join(
        write(word) if os.sep in word or word.endswith(".toml") or is_path(word) else word
        for word in value.split(",")
    )


def _assignments(source: str) -> Iterator[tuple[str, ast.expr]]:
    """The name and the value of every assignment, in the order of the source."""
    for node in ast.parse(source).body:
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
            yield node.targets[0].id, node.value
