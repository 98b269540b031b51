"""How functions are compiled: one decorator, and a disk cache that knows when it is stale.

Numba keeps a compiled function as long as the file that defines it stays the same. Our functions
inline one another across files, so a cached engine would outlive a change of the rules. Here a
cached function is valid while the code of its module, and of all that this imports, is unchanged
(``dess.code.sources``): comments and line numbers make no difference.
"""

import inspect
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from numba import njit
from numba.core.caching import IndexDataCacheFile

from dess.code.sources import code_of, combined

_OPTIONS: dict[str, Any] = {"nogil": True, "error_model": "numpy"}


def kernel(function: Callable, **options: Any) -> Any:
    """Compile a function with numba, without Python and its lock, cached on disk.

    Where its module has no source, or no folder for the cache can be written, it is compiled anew
    in every process.
    """
    options = _OPTIONS | options
    stamp = _code_behind(function.__module__, inspect.getfile(function))
    try:
        compiled = njit(cache=bool(stamp), **options)(function)
    except RuntimeError:  # numba: no locator available
        return njit(**options)(function)
    if stamp:
        compiled._cache._cache_file = _cache_file(compiled._cache, stamp)
    return compiled


def _cache_file(cache: Any, stamp: str) -> IndexDataCacheFile:
    """The disk cache of a function for one state of the code; one of another state is emptied.

    Numba names its files after the line of the function, which a comment above it moves. It also
    reads an old index before it looks at its stamp, and fails where a type has moved since.
    """
    name = cache._impl.filename_base.replace(f"-{cache._impl._lineno}.", ".")
    file = IndexDataCacheFile(cache.cache_path, name, stamp)
    index = Path(file._index_path)
    if index.exists() and stamp.encode() not in index.read_bytes():
        file.flush()
    return file


def inlined(function: Callable) -> Any:
    """A ``kernel`` whose code goes into its compiled callers.

    A call between kernels costs reference counts of the arrays that it hands over: for the small
    functions of a mission slot more than their work.
    """
    return kernel(function, forceinline=True)


@lru_cache
def _code_behind(module: str, path: str) -> str:
    """A hash of the code that the functions of a module may call; empty if it has no source."""
    code = code_of(Path(path).stem if module == "__main__" else module)
    return combined(code) if code else ""
