"""The results of a study in the forms of rliable and marl-eval, which compare algorithms."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from dess import InputError
from dess.analysis.answers.settings.points import points_in_words
from dess.analysis.metrics import METRICS, PRODUCT, metric_group
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.base.errors import unknown_name

RUNS = 10  # where no learner has several trainings


def rliable_scores(results: Results, metric: str = PRODUCT) -> dict[str, np.ndarray]:
    """The scores that ``rliable.library.get_interval_estimates`` and its other functions take.

    Args:
        results: The study.
        metric: A metric of missions. Those with values between 0 and 1 need no normalisation.

    Returns:
        For every algorithm the mean of the metric over the missions of each run, (runs, tasks).

    Raises:
        InputError: If there is no such metric, a policy has fewer missions than there are runs, or
            learners have different numbers of trainings.
    """
    metrics = metric_group("paper", "reward")
    if metric not in metrics:
        raise unknown_name("metric", f"{metric!r} is unknown", metric, metrics)
    algorithms = _policies_of_runs(results)
    points = range(len(results.store.manifest.points))
    runs = len(next(iter(algorithms.values())))
    cells = results.missions.groupby(["policy", "point"], sort=False)[metric]
    size = int(cells.size().min()) // runs
    if not size:
        raise InputError("missions", f"{cells.size().min()} for {runs} runs", "at least one")
    means = {
        cell: values.to_numpy(float)[: runs * size].reshape(runs, size).mean(axis=1)
        for cell, values in cells
    }
    return {
        name: np.array([[means[p, point][run] for point in points] for run, p in enumerate(flown)])
        for name, flown in algorithms.items()
    }


def marl_eval_data(results: Results, metrics: Sequence[str] = (*METRICS,)) -> dict[str, Any]:
    """The data that ``marl_eval.utils.data_processing_utils.data_process_pipeline`` takes.

    Its levels are the study, the task, the algorithm, the run and the step. A study evaluates
    policies that are ready, so there is one step, ``step_1``, at ``step_count`` 0, and
    ``absolute_metrics`` has the same values. Commas in names of algorithms, which marl-eval does
    not allow, become plus signs.

    Args:
        results: The study.
        metrics: Metrics of missions.

    Returns:
        Plain data that ``json.dump`` writes, with the mean of each metric over the missions of
        each run.

    Raises:
        InputError: If a learner has no complete runs, as ``rliable_scores`` needs them.
    """
    study = results.study.name
    scores = {metric: rliable_scores(results, metric) for metric in metrics}
    runs = {name: range(len(rows)) for name, rows in scores[metrics[0]].items()}

    def steps(name: str, run: int, task: int) -> dict[str, Any]:
        values = {metric: [float(scores[metric][name][run, task])] for metric in metrics}
        return {"step_1": {"step_count": 0, **values}, "absolute_metrics": values}

    return {
        study: {
            setting or study: {
                name.replace(",", "+"): {f"run_{r + 1}": steps(name, r, task) for r in runs[name]}
                for name in runs
            }
            for task, setting in enumerate(points_in_words(results))
        }
    }


def _policies_of_runs(results: Results) -> dict[str, list[str]]:
    """For every algorithm the policy of each run."""
    trained = trained_policies_by_learner(results)
    others = set(results.policies).difference(*trained.values())
    algorithms = trained | {policy: [policy] for policy in results.policies if policy in others}
    counts = {len(policies) for policies in algorithms.values()} - {1}
    if len(counts) > 1:
        raise InputError("trainings", str(sorted(counts)), "as many of every learner")
    runs = max(counts, default=RUNS)
    return {
        name: names if len(names) == runs else names * runs for name, names in algorithms.items()
    }
