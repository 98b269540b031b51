"""Docstrings name only what there is, and their examples run.

Every name in backquotes is found in the sources, and so is every function that an example calls.
Examples with ``>>>`` are run, and print what they say.
"""

import ast
import builtins
import doctest
import keyword
import re
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any

import numpy as np
import pytest

import dess
from dess.scenario.scenario import Scenario
from tests.test_architecture import LIBRARY, SOURCES, TEXTS

NAME = re.compile(r"``([A-Za-z_]\w*)(?:\([^`]*\))?``")
# What a phrase says is made by a function, or returned by one.
MADE = re.compile(r"(?:[Rr]ows?|[Rr]esults?) of ``([a-z]\w*)``|as ``([a-z]\w*)`` returns")
DOTTED = re.compile(r"``([A-Za-z_]\w+(?:\.[A-Za-z_]\w*)+)(?:\(\))?``")
FILES = {"css", "html", "json", "md", "py", "safetensors", "toml"}  # endings of names of files
# What is not ours, and that none of our modules imports.
FOREIGN = {"TimeLimit", "dask", "marl_eval", "rliable"}
# Names of other libraries and of the system, which the sources have in docstrings alone.
OTHERS = {"ActionMaskingTorchRLModule", "NextStep", "ParallelPettingZooEnv", "SameStep", "fastmath"}
OTHERS |= {"MaskablePPO", "PPOConfig"}
OTHERS |= {"age_h", "lots", "nohup", "parallel_collection", "set_options", "tqdm"}
ENDS = ("_low", "_high")  # of the names of columns with the ends of intervals
# What examples may use beside the names of their module.
AT_HAND: dict[str, Any] = {"dess": dess, "load_scenario": dess.load_scenario, "np": np}


def quoted(tree: ast.Module) -> Iterator[str]:
    """The dotted names in backquotes of the docstrings of a module."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant):
            yield from DOTTED.findall(str(node.value.value))


def docstrings(tree: ast.AST) -> Iterator[tuple[ast.AST, str]]:
    """The texts that stand alone in a module, each with what it stands in."""
    for node in ast.walk(tree):
        for inside in ast.iter_child_nodes(node):
            if isinstance(inside, ast.Expr) and isinstance(inside.value, ast.Constant):
                yield node, str(inside.value.value)


def arguments_of(node: ast.AST) -> set[str]:
    """The arguments of a function, or of the methods of a class."""
    return {argument.arg for argument in ast.walk(node) if isinstance(argument, ast.arg)}


@cache
def made_names() -> set[str]:
    """The names of all functions and classes, and of what modules and classes bind."""
    bound: set[str] = set()
    for module, tree in LIBRARY.items():
        bound |= bound_in(module).keys()
        for node in ast.walk(tree):
            if isinstance(node, ast.FunctionDef):
                bound.add(node.name)
            elif isinstance(node, ast.ClassDef):
                bound |= {node.name} | {*dict(_bound(node.body))}
    return bound


@cache
def all_names() -> set[str]:
    """What a single name in a docstring may be: of code, or a word of a text of the code."""
    names = made_names() | {*dir(builtins), *keyword.kwlist, *Scenario.model_fields} | OTHERS
    for module, tree in SOURCES.items():
        names |= {*module.split(".")}
        texts = {id(node.value) for node in ast.walk(tree) if isinstance(node, ast.Expr)}
        for node in ast.walk(tree):
            if isinstance(node, ast.Attribute):
                names.add(node.attr)
            elif isinstance(node, ast.keyword):
                names.add(str(node.arg))
            elif isinstance(node, ast.Constant) and id(node) not in texts:
                names |= {*re.findall(r"\w+", str(node.value))}
    return names


def calls_in(text: str) -> Iterator[str]:
    """The functions that the lines of a text call by a plain name, if they are lines of code."""
    for line in text.splitlines():
        try:
            nodes = [*ast.walk(ast.parse(line.strip().removeprefix(">>> ").removeprefix("... ")))]
        except SyntaxError:  # prose
            continue
        calls = [node.func for node in nodes if isinstance(node, ast.Call)]
        yield from (call.id for call in calls if isinstance(call, ast.Name))


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
def test_what_docstrings_name_is_in_the_code(module):
    """A local name of a function may be named in its own docstring only if it is an argument."""
    texts = [*docstrings(SOURCES[module])]
    in_prose = {
        name
        for node, text in texts
        for name in {*NAME.findall(text)} - all_names() - arguments_of(node)
        if not name.endswith(ENDS)
    }
    assert not in_prose
    made = [pair for _, text in texts for pair in MADE.findall(text)]
    assert not {first or second for first, second in made} - made_names()
    called = {name for _, text in texts for name in calls_in(text)}
    assert not called - made_names() - foreign() - {*dir(builtins)} - OTHERS
    gone = sorted({name for name in quoted(SOURCES[module]) if not is_found(name, module)})
    assert not gone


EXAMPLES = [module for module in LIBRARY if ">>> " in TEXTS[module]]


@pytest.mark.parametrize("module", EXAMPLES)
def test_examples_print_what_they_say(module, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(builtins, "_", None, raising=False)  # examples leave their last value
    loaded = import_module(module)
    found = doctest.testmod(loaded, extraglobs=AT_HAND, optionflags=doctest.NORMALIZE_WHITESPACE)
    assert found.attempted and not found.failed


def test_stale_examples_are_found():
    assert [*calls_in("Some prose.\n\n    value = improve(mission, 3)\n")] == ["improve"]
    assert MADE.findall("Rows of ``transfers``, as ``stacked`` returns them")
    assert not {"transfers", "stacked", "improve"} & made_names()


def test_a_name_that_is_gone_is_found():
    assert not is_found("stats.paired.compare", "dess.analysis.tables")
    assert not is_found("Chart.nothing", "dess.analysis.tables")
    assert is_found("stats.differences.compare", "dess.analysis.tables")
    assert is_found("np.mean", "dess.analysis.tables")
