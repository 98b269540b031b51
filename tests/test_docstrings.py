"""Docstrings name only what there is: every dotted name in backquotes is found in the sources."""

import ast
import re
from collections.abc import Iterator
from functools import cache

import pytest

from dess.scenario.scenario import Scenario
from tests.test_architecture import LIBRARY, SOURCES

DOTTED = re.compile(r"``([A-Za-z_]\w+(?:\.[A-Za-z_]\w*)+)(?:\(\))?``")
FILES = {"css", "html", "json", "md", "py", "safetensors", "toml"}  # endings of names of files
# What is not ours, and that none of our modules imports.
FOREIGN = {"TimeLimit", "dask", "marl_eval", "rliable"}


def quoted(tree: ast.Module) -> Iterator[str]:
    """The dotted names in backquotes of the docstrings of a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield from DOTTED.findall(str(node.value.value))


@cache
def bound_in(module: str) -> dict[str, ast.AST]:
    """The names that a module, or the body of a class, binds, with what binds them."""
    return dict(_bound(SOURCES[module].body))


def _bound(statements: list[ast.stmt]) -> Iterator[tuple[str, ast.AST]]:
    for node in statements:
        if isinstance(node, ast.ClassDef | ast.FunctionDef):
            yield node.name, node
        elif isinstance(node, ast.Import | ast.ImportFrom):
            yield from ((alias.asname or alias.name, node) for alias in node.names)
        elif isinstance(node, ast.Assign | ast.AnnAssign | ast.AugAssign):
            yield from (
                (target.id, node)
                for target in ast.walk(node)
                if isinstance(target, ast.Name) and isinstance(target.ctx, ast.Store)
            )
        elif isinstance(node, ast.If | ast.Try | ast.With):
            yield from _bound([*node.body, *getattr(node, "orelse", [])])


@cache
def classes(name: str) -> tuple[ast.ClassDef, ...]:
    """The classes of this name in any module, and of ``log`` those whose names end in ``Log``."""
    nodes = [node for module in SOURCES for node in bound_in(module).values()]
    return tuple(
        node
        for node in nodes
        if isinstance(node, ast.ClassDef)
        if node.name == name or (name.islower() and node.name.endswith(name.capitalize()))
    )


@cache
def foreign() -> set[str]:
    """The names that our modules import from others, without those of our own modules."""
    names = set(FOREIGN)
    for tree in SOURCES.values():
        for node in ast.walk(tree):
            if isinstance(node, ast.Import):
                names |= {alias.asname or alias.name.partition(".")[0] for alias in node.names}
            elif isinstance(node, ast.ImportFrom) and not str(node.module).startswith("dess"):
                names |= {str(node.module).partition(".")[0], *(a.name for a in node.names)}
    return names - {name.rpartition(".")[2] for name in SOURCES}


def has(node: ast.ClassDef, attribute: str) -> bool:
    """Whether a class, or one of its bases, has an attribute; also one that a method sets."""
    bases = [base for of in node.bases if isinstance(of, ast.Name) for base in classes(of.id)]
    stored = {of.attr for of in ast.walk(node) if isinstance(of, ast.Attribute)}
    own = stored | {*dict(_bound(node.body))}
    return bool({attribute, "__getattr__"} & own) or any(has(base, attribute) for base in bases)


def is_argument(name: str, module: str) -> bool:
    """Whether it is an attribute of an argument of a function of the module.

    Of an argument without a type, any attribute may be meant.
    """
    first, attribute = name.split(".")[:2]
    arguments = [node for node in ast.walk(SOURCES[module]) if isinstance(node, ast.arg)]
    for argument in arguments:
        if argument.arg == first:
            types = {node.id for node in ast.walk(argument) if isinstance(node, ast.Name)}
            ours = [node for of in types for node in classes(of)]
            if any(has(node, attribute) for node in ours) or not types - {"Any"}:
                return True
    return False


def is_found(name: str, module: str) -> bool:
    """Whether a dotted name in a docstring of a module is there, or is no name of ours.

    It may be a module, what a module holds, a field of a section of the scenario, or an attribute
    of an argument or of an object with the name of its class.
    """
    first, *_, last = name.split(".")
    if last in FILES or first in foreign() | {*Scenario.model_fields}:
        return True
    owner, _, attribute = name.rpartition(".")
    objects = classes(owner) if owner == first else ()
    homes = [m for m in SOURCES if m == owner or m.endswith(f".{owner}")]
    return (
        is_argument(name, module)
        or any(m == name or m.endswith(f".{name}") for m in SOURCES)
        or any(attribute in bound_in(home) for home in homes)
        or any(has(node, attribute) for node in objects)
    )


@pytest.mark.parametrize("module", LIBRARY)
def test_docstrings_name_what_there_is(module):
    gone = sorted({name for name in quoted(SOURCES[module]) if not is_found(name, module)})
    assert not gone


def test_a_name_that_is_gone_is_found():
    assert not is_found("stats.paired.compare", "dess.analysis.tables")
    assert not is_found("Chart.nothing", "dess.analysis.tables")
    assert is_found("stats.differences.compare", "dess.analysis.tables")
    assert is_found("np.mean", "dess.analysis.tables")
