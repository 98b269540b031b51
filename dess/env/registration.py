"""Registers ``dess/Paper-v0`` with Gymnasium as soon as Gymnasium is imported, but not before.

    import dess, gymnasium
    env = gymnasium.make_vec("dess/Paper-v0", num_envs=64)

Gymnasium is too large to be imported by everybody who imports ``dess``, as the command line does.
"""

import sys
from importlib.abc import MetaPathFinder
from importlib.machinery import ModuleSpec
from importlib.util import find_spec
from typing import Any

ID = "dess/Paper-v0"


def register() -> None:
    """Register the environment now if Gymnasium is imported, or else when it will be."""
    if "gymnasium" in sys.modules:
        _register()
    else:
        sys.meta_path.insert(0, _Registration())


def _register() -> None:
    import gymnasium

    if ID not in gymnasium.registry:
        gymnasium.register(
            ID, vector_entry_point="dess.env.vector:make_vec", kwargs={"scenario": "paper"}
        )


class _Registration(MetaPathFinder):
    """Finds Gymnasium as the other finders do, and registers the environment after its import."""

    def find_spec(self, fullname: str, path: Any, target: Any = None) -> ModuleSpec | None:
        if fullname != "gymnasium":
            return None
        sys.meta_path.remove(self)
        spec = find_spec(fullname)
        if spec and spec.loader:
            execute = spec.loader.exec_module

            def execute_and_register(module: Any) -> None:
                execute(module)
                _register()

            spec.loader.exec_module = execute_and_register  # type: ignore[method-assign]
        return spec
