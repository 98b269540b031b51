"""Discrete-event simulation of UAV data harvesting with charging at sea.

    import dess, policies

    scenario = dess.load_scenario("paper", uavs=3)
    record = dess.simulate(scenario, policies.load("greedy"), seed=1)
    records = dess.simulate_batch(scenario, policies.load("greedy"), seed=1, replications=1000)
    records.missions["success"].mean()

Names are imported on first use, so that ``import dess`` is fast.
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
