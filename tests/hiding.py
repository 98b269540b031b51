"""Libraries that are not installed, as far as an interpreter can tell."""

import sys
from collections.abc import Collection
from importlib.machinery import PathFinder


def hide(packages: Collection[str]) -> None:
    """Let no module of these packages be found from now on."""

    class Hiding(PathFinder):
        @classmethod
        def find_spec(cls, fullname, path=None, target=None):
            hidden = fullname.partition(".")[0] in packages
            return None if hidden else super().find_spec(fullname, path, target)

    sys.meta_path[sys.meta_path.index(PathFinder)] = Hiding
