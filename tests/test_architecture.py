"""The house: imports only go downwards, the command line loads nothing heavy, all is documented."""

import ast
import json
import subprocess
import sys
from collections.abc import Iterator
from graphlib import CycleError, TopologicalSorter
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
FLOORS = ("dess", "policies", "analysis", "reports")  # from the ground up
# What a floor must not import, besides the floors above it.
REFUSED = {"dess": {"torch", "pandas"}, "policies": {"pandas"}}
# What a plain `dess --help` must not wait for.
HEAVY = {"torch", "numba", "pandas", "scipy", "matplotlib"}


def module_name(path: Path) -> str:
    """The dotted name of a source file."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


SOURCES = {
    module_name(path): ast.parse(path.read_text("utf-8"), str(path))
    for floor in FLOORS
    for path in sorted((ROOT / floor).rglob("*.py"))
}
# Notebooks document themselves in their cells.
LIBRARY = {name: tree for name, tree in SOURCES.items() if ".notebooks." not in name}


def imports_of(name: str) -> set[str]:
    """The modules that a module imports, anywhere in it; its own package's in full."""
    found = set()
    for node in ast.walk(SOURCES[name]):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{name}:{node.lineno}: a relative import"
            modules = {f"{node.module}.{alias.name}" for alias in node.names}
            found |= {m if m in SOURCES else str(node.module) for m in modules}
    return found


def public(tree: ast.Module | ast.ClassDef) -> Iterator[ast.ClassDef | ast.FunctionDef]:
    """The public classes and functions of a module, and the public methods of these classes."""
    for node in tree.body:
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and not node.name.startswith("_"):
            yield node
            if isinstance(node, ast.ClassDef):
                yield from public(node)


def test_every_floor_has_sources() -> None:
    assert {name.split(".")[0] for name in LIBRARY} == set(FLOORS)


@pytest.mark.parametrize("floor", FLOORS)
def test_imports_only_go_downwards(floor: str) -> None:
    refused = {*FLOORS[FLOORS.index(floor) + 1 :], *REFUSED.get(floor, ())}
    climbing = {
        f"{name} imports {imported}"
        for name in SOURCES
        if name.split(".")[0] == floor
        for imported in imports_of(name)
        if imported.split(".")[0] in refused
    }
    assert not climbing


def test_no_modules_import_each_other() -> None:
    graph = {name: imports_of(name) & set(SOURCES) for name in SOURCES}
    try:
        TopologicalSorter(graph).prepare()
    except CycleError as error:
        pytest.fail(f"a cycle of imports: {' -> '.join(error.args[1])}")


def test_the_command_line_loads_nothing_heavy() -> None:
    script = "import json, sys, reports.cli; print(json.dumps(sorted(sys.modules)))"
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    assert not HEAVY & {name.split(".")[0] for name in json.loads(done.stdout)}


@pytest.mark.parametrize("name", LIBRARY)
def test_what_is_public_is_documented(name: str) -> None:
    tree = LIBRARY[name]
    assert ast.get_docstring(tree), "the module has no docstring"
    silent = [f"{node.name}:{node.lineno}" for node in public(tree) if not ast.get_docstring(node)]
    assert not silent
