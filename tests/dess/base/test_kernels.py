"""The cache of compiled functions: it must not outlive a change of what they inline."""

import subprocess
import sys
from pathlib import Path

import pytest
from numba import config

from dess.base.errors import InputError
from dess.base.kernels import kernel

CALLER = """
from dess.base.kernels import kernel
from callee import inner

@kernel
def outer(x):
    return inner(x)

if __name__ == "__main__":
    print(outer(1), "cached" if outer.stats.cache_hits else "compiled")
"""

CALLEE = """
from dess.base.kernels import kernel
from constant import ONE

@kernel
def inner(x):
    return x + ONE
"""


@pytest.mark.slow
@pytest.mark.brief
def test_a_kernel_is_compiled_anew_when_what_it_calls_has_changed(tmp_path, monkeypatch):
    """However it is reached; a comment is no change."""
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[3]))
    # Python itself misses a change within the second in which it wrote its bytecode.
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    sources = {"caller.py": CALLER, "callee.py": CALLEE, "constant.py": "ONE = 1\n"}
    commented = {name: f'"""Docs."""\n\n# A comment.\n{text}' for name, text in sources.items()}
    for changed, printed in [
        (sources, "2 compiled"),
        (commented, "2 cached"),
        ({"callee.py": CALLEE.replace("x + ONE", "x + 10")}, "11 compiled"),
        ({"callee.py": CALLEE, "constant.py": "ONE = 3\n"}, "4 compiled"),
    ]:
        for name, text in changed.items():
            (tmp_path / name).write_text(text)
        script = [sys.executable, "caller.py"]
        done = subprocess.run(script, cwd=tmp_path, capture_output=True, text=True, check=True)
        assert done.stdout.strip() == printed


NAMED = """
from dess.base.kernels import kernel

@kernel
def successor(x):
    return x + 1

successor(1)
(compiled,) = successor.overloads.values()
print(compiled.fndesc.mangled_name)
"""


@pytest.mark.slow
@pytest.mark.brief
def test_two_processes_name_compiled_functions_differently():
    """A process that loads both from the cache would run one of two with the same name twice."""
    names = {
        subprocess.run([sys.executable, "-c", NAMED], capture_output=True, text=True).stdout
        for _ in range(2)
    }
    assert len(names) == 2


def test_without_compilation_there_is_no_simulator(monkeypatch):
    monkeypatch.setattr(config, "DISABLE_JIT", 1)
    with pytest.raises(InputError, match="NUMBA_DISABLE_JIT: the simulator runs only compiled"):
        kernel(abs)


@kernel
def _next(number):
    return number + 1


@kernel
def _calls_with_numbers(number):
    return _next(1) + _next(2) + _next(number)


def test_a_number_in_a_call_does_not_compile_the_function_again():
    assert _calls_with_numbers(3) == 9
    _calls_with_numbers.recompile()  # the cache may have had it
    assert len(_next.signatures) == 1
