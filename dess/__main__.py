"""The command ``dess``, also as ``python -m dess``."""

import gc
import os
import sys
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

FOLDERS = ("policies", "analysis", "reports")  # beside this one in the repository


def main() -> int:
    """Run the command; the exit code."""
    if missing := [name for name in FOLDERS if find_spec(f"dess.{name}") is None]:
        print(
            f"dess: {Path(__file__).parent} is a part of the package, without "
            f"{' and '.join(missing)}; allowed: an installation with pip, or the whole repository",
            file=sys.stderr,
        )
        return 2
    gc.set_threshold(50_000, 20, 50)  # what a command imports stays: to search it takes a tenth
    # The products of learned policies are small: threads of NumPy would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Found by its name: this floor must not import the floors above it.
    return import_module("dess.reports.cli").main()


if __name__ == "__main__":
    # ``python -m`` puts the working directory, which may be a results folder, first on the path.
    if sys.path[0] == os.getcwd() != str(Path(__file__).absolute().parents[1]):
        del sys.path[0]
    sys.exit(main())
