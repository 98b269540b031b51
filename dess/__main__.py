"""The command ``dess``, also as ``python -m dess``."""

import gc
import os
import sys
from importlib import import_module
from pathlib import Path

from dess.base.errors import InputError
from dess.base.floors import check_floors


def main() -> int:
    """Run the command; the exit code."""
    try:
        check_floors()
    except InputError as error:
        print(f"dess: {error}", file=sys.stderr)
        return 2
    gc.set_threshold(50_000, 20, 50)  # what a command imports stays: to search it takes a tenth
    # The products of learned policies are small: threads of NumPy would only wait for each other.
    os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
    # Found by its name: this floor must not import the floors above it.
    code = import_module("dess.reports.cli").main()
    gc.freeze()  # at its end, Python would search all that was imported for most of a second
    return int(code)


if __name__ == "__main__":
    # ``python -m`` puts the working directory, which may be a results folder, first on the path.
    if sys.path[0] == os.getcwd() != str(Path(__file__).absolute().parents[1]):
        del sys.path[0]
    sys.exit(main())
