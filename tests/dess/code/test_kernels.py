"""The cache of compiled functions: it must not outlive a change of what they inline."""

import subprocess
import sys
from pathlib import Path

import pytest
from numba import config

from dess.code.kernels import kernel
from dess.errors import InputError

CALLER = """
from dess.code.kernels import kernel
from callee import inner

@kernel
def outer(x):
    return inner(x)

if __name__ == "__main__":
    print(outer(1), "cached" if outer.stats.cache_hits else "compiled")
"""

CALLEE = """
from dess.code.kernels import kernel

@kernel
def inner(x):
    return x + {}
"""


def _run(folder: Path) -> str:
    script = [sys.executable, "caller.py"]
    done = subprocess.run(script, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[3]))
    # Python itself misses a change within the second in which it wrote its bytecode.
    monkeypatch.setenv("PYTHONDONTWRITEBYTECODE", "1")
    (tmp_path / "caller.py").write_text(CALLER)
    (tmp_path / "callee.py").write_text(CALLEE.format(1))
    assert _run(tmp_path) == "2 compiled"
    return tmp_path


def test_a_kernel_is_compiled_anew_when_what_it_calls_has_changed(folder: Path) -> None:
    assert _run(folder) == "2 cached"
    (folder / "callee.py").write_text(CALLEE.format(10))
    assert _run(folder) == "11 compiled"


def test_a_comment_compiles_nothing_anew(folder: Path) -> None:
    for name in ("caller.py", "callee.py"):
        path = folder / name
        path.write_text(f'"""A docstring."""\n\n# A comment.\n\n{path.read_text()}')
    assert _run(folder) == "2 cached"


def test_a_module_beside_the_script_counts_however_it_is_reached(folder: Path) -> None:
    (folder / "constant.py").write_text("ONE = 1\n")
    callee = "from constant import ONE\n" + CALLEE.format("ONE")
    (folder / "callee.py").write_text(callee)
    assert _run(folder) == "2 compiled"
    (folder / "constant.py").write_text("ONE = 3\n")
    assert _run(folder) == "4 compiled"


def test_without_compilation_there_is_no_simulator(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(config, "DISABLE_JIT", 1)
    with pytest.raises(InputError, match="NUMBA_DISABLE_JIT: the simulator runs only compiled"):
        kernel(abs)
