"""What the build of a distribution checks first: that the folders beside ``dess`` are there."""

from pathlib import Path
from typing import Any

from hatchling.builders.hooks.plugin.interface import BuildHookInterface

FOLDERS = ("dess", "policies", "analysis", "reports")


class FoldersHook(BuildHookInterface):
    """Refuses to build a part of the package, as from a copy of the folder ``dess`` alone."""

    def initialize(self, version: str, build_data: dict[str, Any]) -> None:
        """Check the source tree before anything is written.

        Raises:
            SystemExit: If a folder of the package is missing.
        """
        missing = [name for name in FOLDERS if not Path(self.root, name, "__init__.py").is_file()]
        if missing:
            raise SystemExit(
                f"dess: {self.root} has no {' and no '.join(missing)}; allowed: the whole "
                f"repository, which has the folders {', '.join(FOLDERS)}"
            )
