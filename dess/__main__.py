"""``python -m dess``: the command that the distribution installs under the name ``dess``."""

import sys
from importlib.metadata import distribution

if __name__ == "__main__":
    # Found by its name: this package must not import the floors above it.
    (command,) = distribution("dess").entry_points.select(group="console_scripts", name="dess")
    sys.exit(command.load()())
