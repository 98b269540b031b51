"""Gymnasium finds the environment after ``import dess``, which does not import Gymnasium."""

import subprocess
import sys

import pytest

MAKE = "assert gymnasium.make_vec('dess/Paper-v0', num_envs=2).missions == 2"


def run(script: str) -> None:
    """Run a script in a new interpreter."""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr


@pytest.mark.parametrize(
    "imports",
    [
        "import dess; import gymnasium",
        "import gymnasium; import dess",
        "import dess, dess.env.vector; from gymnasium import spaces; import gymnasium",
        "import gymnasium, dess, importlib; importlib.reload(dess)",
    ],
)
def test_gymnasium_finds_it_in_either_order_of_imports(imports: str) -> None:
    run(f"{imports}; {MAKE}")


def test_gymnasium_is_not_imported_with_the_package() -> None:
    run("import dess, sys; assert not {'gymnasium', 'numpy', 'numba'} & {*sys.modules}")


def test_without_gymnasium_the_import_fails_as_usual() -> None:
    hidden = "sys.path[:] = [p for p in sys.path if 'site-packages' not in p]"
    script = "try: import gymnasium\nexcept ModuleNotFoundError as e: print(e.name)\nelse: exit(1)"
    run(f"import dess, sys; {hidden}\n{script}")
