"""Compile functions with numba, and keep them in a cache on disk that is valid for this code.

Numba's own cache keeps a compiled function as long as the file that defines it is unchanged. The
functions of this project are inlined into functions of other files, so a cached batch engine would
still be used after a change of ``rules.py``. Here a cached function is valid as long as the code of
its module, and of all modules that this module imports, is unchanged (``dess.base.sources``).
Changes of comments and line numbers do not count.
"""

import gc
import inspect
import secrets
from collections.abc import Callable
from functools import lru_cache, partial
from itertools import count
from pathlib import Path
from typing import Any

from numba import config, njit
from numba.core.bytecode import FunctionIdentity
from numba.core.caching import IndexDataCacheFile
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags
from numba.core.types import unliteral
from numba.extending import overload

from dess.base.errors import InputError
from dess.base.sources import code_of, combined

# The names of compiled functions have numbers, which numba counts from 1 in each process. Functions
# that two processes have compiled for different types could have one name, and a process that loads
# both from the cache would run one of them for both.
FunctionIdentity._unique_ids = count(secrets.randbits(40))


class _Code(JITCodeLibrary):
    """The code of a compiled function, optimized as a whole and not function by function."""

    def _optimize_functions(self, ll_module: Any) -> None:
        ll_module.data_layout = self._codegen._data_layout


class _Flags(Flags):
    """The options of a compilation; numba compares them at every call that it compiles.

    It compares the values of all options, which takes a tenth of the time. Those that have been set
    are enough.
    """

    __slots__ = ()

    def __hash__(self) -> int:
        return len(self._values)

    def __eq__(self, other: object) -> bool:
        if isinstance(other, _Flags):
            return bool(self._values == other._values)
        return bool(super().__eq__(other))


class _Compiler(Compiler):
    """Numba's compiler without garbage collections, which would free little and take a tenth."""

    library: type[JITCodeLibrary] = _Code

    def __init__(
        self,
        typing: Any,
        target: Any,
        library: Any,
        args: Any,
        result: Any,
        flags: Flags,
        names: Any,
    ):
        super().__init__(typing, target, library, args, result, _Flags(flags), names)

    def _compile_core(self) -> Any:
        state, was_enabled = self.state, gc.isenabled()
        state.library = self.library(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        gc.disable()
        try:
            return super()._compile_core()
        finally:
            if was_enabled:
                gc.enable()


# Without a value of its own, a function would take over ``_nrt`` from the function that calls it.
# Wrappers for C would take time to compile, and nothing calls them.
_OPTIONS: dict[str, Any] = {
    **{"nogil": True, "error_model": "numpy", "_nrt": True, "no_cfunc_wrapper": True},
    "pipeline_class": _Compiler,
}


def kernel(function: Callable, **options: Any) -> Any:
    """Compile a function with numba to code that does not hold Python's global lock.

    An inlined function that calls it takes its code in, too: numba hands the option on.

    The compiled function is cached on disk. If its module has no source file, or no folder for the
    cache can be written, it is compiled again in every process.

    Args:
        function: The function.
        **options: Options of numba beside those of all kernels.

    Raises:
        InputError: If the environment does not let numba compile.
    """
    options = _OPTIONS | options
    if config.DISABLE_JIT:  # type: ignore[attr-defined]
        raise InputError("NUMBA_DISABLE_JIT", "the simulator runs only compiled", "unset it")
    stamp = _code_behind(function.__module__, inspect.getfile(function))
    try:
        compiled = njit(cache=bool(stamp), **options)(function)
    except RuntimeError:  # numba has found no folder for its cache ("no locator available")
        return njit(**options)(function)
    compiled.get_call_template = partial(_without_literals, compiled.get_call_template)
    if stamp:
        compiled._cache._cache_file = _cache_file(compiled._cache, stamp)
    return compiled


def _without_literals(template: Callable, args: Any, kws: Any) -> Any:
    """The types with which a compiled function calls another: a number in the code is any number.

    Otherwise, the function would be compiled once more for each number that calls of it contain.
    """
    return template([*map(unliteral, args)], {name: unliteral(kws[name]) for name in kws})


def _cache_file(cache: Any, stamp: str) -> IndexDataCacheFile:
    """The disk cache of a function for the present code; a cache made by other code is emptied.

    Numba puts the line number of the function into the name of the cache file, which changes with
    every comment above the function, so the number is removed here. Numba also reads an old index
    before it compares the stamps, and that fails if a type has moved to another module; so an index
    with another stamp is deleted first.
    """
    name = cache._impl.filename_base.replace(f"-{cache._impl._lineno}.", ".")
    file = IndexDataCacheFile(cache.cache_path, name, stamp)
    index = Path(file._index_path)
    if index.exists() and stamp.encode() not in index.read_bytes():
        file.flush()
    return file


def inlined(function: Callable, choose: Callable | None = None) -> Any:
    """Let compiled functions call a function; its code is inlined into theirs.

    The function must neither create nor return arrays, since its code does not count references to
    arrays. For the small functions of a mission slot, counting would take longer than the functions
    themselves. For Python, the function is not compiled.

    Args:
        function: The function.
        choose: Returns, for the types of the arguments, the function to compile in its place.
    """
    options: Any = _OPTIONS | {"forceinline": True, "_nrt": False, "pipeline_class": _LinkedOnly}
    overload(function, jit_options=options, strict=False)(choose or (lambda *args: function))
    return function


def shared_kernel(function: Callable) -> Any:
    """Let compiled functions call a function that is too large to be inlined.

    Each function that Python calls has one copy of it, which all calls inside of it share, and
    which is compiled with it. Unlike an inlined function, it may create and return arrays. For
    Python, it is not compiled either.

    Args:
        function: The function.
    """
    options: Any = _OPTIONS | {"forceinline": False, "pipeline_class": _LinkedOnly}
    overload(function, jit_options=options, strict=False)(lambda *args: function)
    return function


class _Linked(_Code):
    """The code of an inlined or shared function, optimized and emitted with those that call it.

    On its own nothing would run it, and both would take half of the time of a first run.
    """

    @property
    def codegen(self) -> "_Linked":
        return self

    def set_env(self, name: str, env: Any) -> None:
        """What Python would need to call the function."""

    def get_pointer_to_function(self, name: str) -> int:
        return 0

    def _optimize_final_module(self) -> None:
        pass

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._finalized = True


class _LinkedOnly(_Compiler):
    """The compiler of inlined and of shared functions."""

    library = _Linked


@lru_cache
def _code_behind(module: str, path: str) -> str:
    """A hash of the code that the functions of a module may call; empty without a source file."""
    code = code_of(Path(path).stem if module == "__main__" else module)
    return combined(code) if code else ""
