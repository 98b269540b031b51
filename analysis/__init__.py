"""Studies: define them, run them, store their results, and analyse the results.

Names are imported on first use, so that ``import dess.analysis`` is fast.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:  # for editors and mypy; a test compares it with _HOME
    from dess.analysis.answers.training.exports import marl_eval_data as marl_eval_data
    from dess.analysis.answers.training.exports import rliable_scores as rliable_scores
    from dess.analysis.ask.answer import sweep as sweep
    from dess.analysis.ask.answer import what_if as what_if
    from dess.analysis.execution.evaluation import evaluate as evaluate
    from dess.analysis.execution.runner import run_study as run_study
    from dess.analysis.results.resimulate import resimulate as resimulate
    from dess.analysis.results.tables import Results as Results
    from dess.analysis.results.tables import load_results as load_results
    from dess.analysis.stats.bootstrap import bootstrap_interval as bootstrap_interval
    from dess.analysis.stats.differences import compare as compare
    from dess.analysis.stats.distribution import distribution as distribution
    from dess.analysis.stats.groups import summary as summary
    from dess.analysis.stats.learners import compare_learners as compare_learners
    from dess.analysis.study.files import load_study as load_study
    from dess.analysis.study.files import study_names as study_names
    from dess.analysis.study.study import Study as Study

_HOME = {
    "Study": "study.study",
    "load_study": "study.files",
    "study_names": "study.files",
    "run_study": "execution.runner",
    "evaluate": "execution.evaluation",
    "Results": "results.tables",
    "load_results": "results.tables",
    "resimulate": "results.resimulate",
    "rliable_scores": "answers.training.exports",
    "marl_eval_data": "answers.training.exports",
    "summary": "stats.groups",
    "distribution": "stats.distribution",
    "bootstrap_interval": "stats.bootstrap",
    "compare": "stats.differences",
    "compare_learners": "stats.learners",
    "sweep": "ask.answer",
    "what_if": "ask.answer",
}

__all__ = [*_HOME]


def __getattr__(name: str) -> Any:
    if name in _HOME:
        return getattr(import_module(f"dess.analysis.{_HOME[name]}"), name)
    raise AttributeError(f"module 'dess.analysis' has no attribute {name!r}")


def __dir__() -> list[str]:
    return [*__all__]
