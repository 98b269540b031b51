"""``python -m reports``: the ``dess`` command."""

import os
import sys

# ``python -m`` puts the working directory, which may be a results folder, first on the path.
if sys.path[0] == os.getcwd() != os.path.dirname(os.path.dirname(os.path.abspath(__file__))):
    del sys.path[0]

from reports.cli import main

if __name__ == "__main__":
    sys.exit(main())
