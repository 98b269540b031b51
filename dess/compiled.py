"""How functions are compiled: one decorator, and a disk cache that knows when it is stale.

Numba keeps a compiled function as long as the file that defines it stays the same. Our functions
inline one another across files, so a cached engine would outlive a change of the rules. Here a
cached function is valid only while all sources of its package and of ``dess`` are unchanged.
"""

import hashlib
import inspect
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

from numba import njit


def kernel(function: Callable) -> Any:
    """Compile a function with numba, without Python and its lock, cached on disk.

    Where no folder for the cache can be written, it is compiled anew in every process.
    """
    try:
        compiled = njit(cache=True, nogil=True)(function)
    except RuntimeError:  # numba: no locator available
        return njit(nogil=True)(function)
    folder = Path(inspect.getfile(function)).parent
    compiled._cache._cache_file._source_stamp = _digest(Path(__file__).parent) + _digest(folder)
    return compiled


@lru_cache
def _digest(folder: Path) -> str:
    """A hash of the Python sources directly in a folder."""
    sources = hashlib.sha256()
    for path in sorted(folder.glob("*.py")):
        sources.update(path.name.encode() + b"\0" + path.read_bytes() + b"\0")
    return sources.hexdigest()


def is_cached(compiled: Any) -> bool:
    """Whether a compiled function is at hand, in memory or in the disk cache."""
    cache = getattr(compiled._cache, "_cache_file", None)
    return bool(compiled.signatures) or (cache is not None and bool(cache._load_index()))
