"""Discrete-event simulation of UAV data harvesting with charging at sea.

    >>> import dess
    >>> scenario = dess.load_scenario("paper", uavs=3)
    >>> record = dess.simulate(scenario, "greedy", seed=1)
    >>> records = dess.simulate_batch(scenario, "greedy", seed=1, replications=100)
    >>> float(records.missions["success"].mean())
    1.0

Names are imported on first use, so that ``import dess`` is fast.
"""

from importlib import import_module, metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from dess.base.floors import import_floor

if TYPE_CHECKING:  # for editors and mypy; a test compares it with _HOME
    from dess.api import simulate as simulate
    from dess.api import simulate_batch as simulate_batch
    from dess.base.errors import InputError as InputError
    from dess.envs.parallel import parallel_env as parallel_env
    from dess.envs.single import single_env as single_env
    from dess.envs.vector import vector_env as vector_env
    from dess.scenario.scenario import Scenario as Scenario
    from dess.scenario.scenario import ScenarioSpace as ScenarioSpace
    from dess.scenario.scenario import load_scenario as load_scenario
    from dess.scenario.scenario import scenario_names as scenario_names

_HOME = {
    "InputError": "base.errors",
    "Scenario": "scenario.scenario",
    "ScenarioSpace": "scenario.scenario",
    "load_scenario": "scenario.scenario",
    "scenario_names": "scenario.scenario",
    "simulate": "api",
    "simulate_batch": "api",
    "parallel_env": "envs.parallel",
    "single_env": "envs.single",
    "vector_env": "envs.vector",
}

_FLOORS = ("policies", "analysis")  # see ``dess.base.floors``

__all__ = ["__version__", *_HOME, *_FLOORS]

# In a checkout, dess/policies, dess/analysis and dess/reports are links to the folders beside dess.
# An archive that was unpacked without links has text files in their places.
if not Path(__file__).with_name("reports").is_dir():
    __path__.append(str(Path(__file__).parents[1]))


def __getattr__(name: str) -> Any:
    if name == "__version__":
        return metadata.version("dess")
    if name in _FLOORS:
        return import_floor(name)
    if name in _HOME:
        return getattr(import_module(f"dess.{_HOME[name]}"), name)
    raise AttributeError(f"module 'dess' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__]
