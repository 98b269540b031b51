"""Hash the code that the behaviour of a module depends on: the module and all that it imports.

Results and compiled functions are kept on disk, and are valid as long as the code that made them is
unchanged. The hash of a module is taken of its syntax tree. So every statement counts, whereas
comments, docstrings, layout and line numbers do not. Imports, also those inside functions, are read
from the source; no module is executed. A module that is loaded by its name (``import_module``) is
not found this way and does not count.

    >>> sorted(code_of("dess.base.kernels"))
    ['dess.base.descriptions', 'dess.base.errors', 'dess.base.kernels', 'dess.base.sources']
"""

import ast
import sys
from collections.abc import Iterable, Iterator, Mapping
from functools import cache, lru_cache
from hashlib import sha256
from importlib.machinery import PathFinder
from pathlib import Path
from typing import Any, TypeAlias

# Imports of other distributions are not followed: their versions identify their code.
OURS = {"dess"}


def code_of(*modules: str) -> dict[str, str]:
    """Hashes of the code of modules and of all that they import, by the name of the module.

    Imports are followed inside the packages of ``OURS`` and inside the packages of the modules
    themselves; from a module outside of any package, to the modules in the same folder. A package
    counts only where something is imported from its ``__init__.py`` itself. The result is empty if
    the modules have no source file.
    """
    packages = OURS | {module.partition(".")[0] for module in modules}
    folders = {path.parent for path in map(path_of, modules) if path}
    hashes: dict[str, str] = {}
    waiting = [*modules]
    while waiting:
        module = waiting.pop()
        path = path_of(module)
        within = module.partition(".")[0] in packages or (path and path.parent in folders)
        if path and within and module not in hashes:
            hashes[module], imports = read(path, module)
            waiting += imports
    return dict(sorted(hashes.items()))


def combined(hashes: Mapping[str, str]) -> str:
    """Combine several hashes into one."""
    return sha256(repr(sorted(hashes.items())).encode()).hexdigest()


@lru_cache
def read(path: Path, module: str) -> tuple[str, tuple[str, ...]]:
    """A hash of the syntax tree of a module, and the names of all modules that it may import.

    Names of functions and classes are among them, since the source alone does not tell these from
    modules.
    """
    tree = ast.parse(path.read_bytes())
    package = module
    if path.name != "__init__.py":
        package = module.rpartition(".")[0]
    statements: list[_Import] = []
    outline = outline_of(tree, statements)
    imports = tuple(dict.fromkeys(_imports(statements, package)))
    return sha256(outline.encode()).hexdigest(), imports


_Import: TypeAlias = ast.Import | ast.ImportFrom
_IMPORTS = {ast.Import, ast.ImportFrom}
_DOCUMENTED = {ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef}


def outline_of(part: Any, imports: list[_Import]) -> str:
    """A part of a syntax tree as text, without positions, docstrings, contexts and empty fields.

    Empty fields differ between versions of Python. The context of a name (whether it is read or
    written) follows from its place in the tree.

    Args:
        part: A node, a list of nodes, or a value in a node.
        imports: Takes the imports of the part. Every process that simulates reads the sources, so
            they are gone through once.
    """
    if isinstance(part, list):
        return f"[{', '.join([outline_of(node, imports) for node in part])}]"
    if not isinstance(part, ast.AST):
        return repr(part)
    node: Any = part
    kind = type(node)
    if kind in _IMPORTS:
        imports.append(node)
    elif kind in _DOCUMENTED and ast.get_docstring(node, clean=False) is not None:
        del node.body[0]
    fields = []
    for name in kind._fields:
        value = getattr(node, name, None)
        if value is not None and value != [] and name != "ctx":
            fields.append(f"{name}={outline_of(value, imports)}")
    return f"{kind.__name__}({', '.join(fields)})"


def _imports(statements: Iterable[_Import], package: str) -> Iterator[str]:
    """The modules that a source may import; for ``from a import b``, both ``a.b`` and ``a``."""
    for node in statements:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
            continue
        parents = package.split(".")
        above = []
        if node.level:
            above = parents[: len(parents) - node.level + 1]
        base = ".".join([*above, *([node.module] if node.module else [])])
        members = [f"{base}.{alias.name}" for alias in node.names]
        yield from (name for name in members if path_of(name))
        if not all(map(path_of, members)):
            yield base


@cache
def path_of(module: str) -> Path | None:
    """The source file of a module, looked for once, or None; its packages are not imported."""
    spec = None
    places = None
    names = module.split(".")
    for end in range(len(names)):
        spec = PathFinder.find_spec(".".join(names[: end + 1]), places)
        if spec is None:
            return None
        imported = sys.modules.get(".".join(names[: end + 1]))  # may have added a folder
        places = getattr(imported, "__path__", None) or spec.submodule_search_locations or []
    origin = None
    if spec:
        origin = spec.origin
    if origin and origin.endswith(".py"):
        return Path(origin)
    return None
