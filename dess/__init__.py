"""Discrete-event simulation of UAV data harvesting with charging at sea.

Names load on first use, so that importing the package costs nothing.
"""

from importlib import import_module, metadata
from typing import Any

_HOME = {
    "InputError": "errors",
    "Scenario": "scenario",
    "ScenarioSpace": "scenario",
    "load_scenario": "scenario",
    "scenario_names": "scenario",
    "simulate": "mission",
    "simulate_batch": "batch",
    "parallel_env": "env.parallel",
    "batch_env": "env.batch",
}

__all__ = ["__version__", *_HOME]


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return metadata.version("dess")
    if name in _HOME:
        return getattr(import_module(f"dess.{_HOME[name]}"), name)
    raise AttributeError(f"module 'dess' has no attribute {name!r}")
