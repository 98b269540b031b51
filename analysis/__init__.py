"""Studies: what to run, running it, keeping it, and what the numbers say.

Names load on first use, so that importing the package costs nothing.
"""

from importlib import import_module
from typing import Any

_HOME = {
    "Study": "study",
    "load_study": "study",
    "study_names": "study",
    "run_study": "runner",
    "evaluate": "runner",
    "Results": "results",
    "load_results": "results",
    "fly": "replay",
    "summary": "statistics",
    "distribution": "statistics",
    "bootstrap_interval": "statistics",
    "compare": "comparison",
    "compare_learners": "comparison",
}

__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"analysis.{_HOME[name]}"), name)
    raise AttributeError(f"module 'analysis' has no attribute {name!r}")
