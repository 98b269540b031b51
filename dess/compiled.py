"""How functions are compiled: one decorator, and a disk cache that knows when it is stale.

Numba keeps a compiled function as long as the file that defines it stays the same. Our functions
inline one another across files, so a cached engine would outlive a change of the rules. Here a
cached function is valid only while all sources of its package, of the packages around that and of
``dess`` are unchanged.
"""

import hashlib
import inspect
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from numba import njit


def kernel(function: Callable, **options: Any) -> Any:
    """Compile a function with numba, without Python and its lock, cached on disk.

    Where no folder for the cache can be written, it is compiled anew in every process.
    """
    try:
        compiled = njit(cache=True, nogil=True, error_model="numpy", **options)(function)
    except RuntimeError:  # numba: no locator available
        return njit(nogil=True, error_model="numpy", **options)(function)
    folders = [Path(__file__).parent, *_packages(Path(inspect.getfile(function)))]
    _keep_fresh(compiled._cache._cache_file, "".join(map(_digest, folders)))
    return compiled


def _keep_fresh(cache: Any, stamp: str) -> None:
    """Make a disk cache valid for one state of the sources, and empty one of another state.

    Numba reads an old index before it looks at its stamp, and fails where a type has moved since.
    """
    cache._source_stamp = stamp
    index = Path(cache._index_path)
    if index.exists() and stamp.encode() not in index.read_bytes():
        cache.flush()


def inlined(function: Callable) -> Any:
    """A ``kernel`` whose code goes into its compiled callers.

    A call between kernels costs reference counts of the arrays that it hands over: for the small
    functions of a mission slot more than their work.
    """
    return kernel(function, forceinline=True)


def _packages(path: Path) -> list[Path]:
    """The folder of a source file and those of the packages around it."""
    folders = [path.parent]
    while (folders[-1].parent / "__init__.py").exists():
        folders.append(folders[-1].parent)
    return folders


@lru_cache
def _digest(folder: Path) -> str:
    """A hash of the Python sources directly in a folder."""
    sources = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        sources.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return sources.hexdigest()
