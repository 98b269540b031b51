"""The environments under their names in Gymnasium, for who has imported ``dess``.

import dess, gymnasium                                  # in any order
gymnasium.make("dess/Paper-v0")                         # one UAV
gymnasium.make_vec("dess/Paper-v0", 64, scenario="bay")  # many missions, with their fleets

Gymnasium 1 finds names by imports alone, and no longer by the entry points of packages.
"""

import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from types import ModuleType
from typing import Any


def register() -> None:
    """Register the environments: now, or as soon as Gymnasium, which takes time, is imported."""
    if sys.modules.get("gymnasium"):
        _register()
    else:
        sys.meta_path.insert(0, _WhenImported())


def _register() -> None:
    import gymnasium

    gymnasium.register(
        "dess/Paper-v0",
        entry_point="dess.envs.single:single_env",
        vector_entry_point="dess.envs.vector:vector_env",
        kwargs={"scenario": "paper"},
    )


class _WhenImported(MetaPathFinder):
    """Finds nothing itself; it lets the import of Gymnasium end with the registration."""

    def find_spec(self, name: str, path: Any = None, target: Any = None) -> ModuleSpec | None:
        if name != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(name)
        if spec and spec.loader:
            load = spec.loader.exec_module

            def load_and_register(module: ModuleType) -> None:
                load(module)
                _register()

            spec.loader.exec_module = load_and_register  # type: ignore[method-assign]
        return spec
