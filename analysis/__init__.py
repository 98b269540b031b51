"""Studies: define them, run them, store their results, and analyse the results.

Names are imported on first use, so that ``import analysis`` is fast.
"""

from importlib import import_module
from typing import Any

_HOME = {
    "Study": "study.study",
    "load_study": "study.study",
    "study_names": "study.study",
    "run_study": "execution.runner",
    "evaluate": "execution.runner",
    "Results": "results.tables",
    "load_results": "results.tables",
    "resimulate": "results.resimulate",
    "summary": "stats.intervals",
    "distribution": "stats.distribution",
    "bootstrap_interval": "stats.bootstrap",
    "compare": "stats.paired",
    "compare_learners": "stats.learners",
    "sweep": "sweeps.sweep",
    "what_if": "sweeps.what_if",
}

__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"analysis.{_HOME[name]}"), name)
    raise AttributeError(f"module 'analysis' has no attribute {name!r}")
