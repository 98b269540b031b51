"""The cache of compiled functions: it must not outlive a change of what they inline."""

import subprocess
import sys
from pathlib import Path

CALLER = """
from dess.compiled import kernel
from callee import inner

@kernel
def outer(x):
    return inner(x)

if __name__ == "__main__":
    print(outer(1), "cached" if outer.stats.cache_hits else "compiled")
"""

CALLEE = """
from dess.compiled import kernel

@kernel
def inner(x):
    return x + {}
"""


def _run(folder: Path) -> str:
    script = [sys.executable, "caller.py"]
    done = subprocess.run(script, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_a_kernel_is_compiled_anew_when_what_it_calls_has_changed(
    tmp_path: Path, monkeypatch
) -> None:
    monkeypatch.setenv("PYTHONPATH", str(Path(__file__).parents[2]))
    (tmp_path / "caller.py").write_text(CALLER)
    (tmp_path / "callee.py").write_text(CALLEE.format(1))
    assert _run(tmp_path) == "2 compiled"
    assert _run(tmp_path) == "2 cached"
    (tmp_path / "callee.py").write_text(CALLEE.format(10))
    assert _run(tmp_path) == "11 compiled"
