"""The results of a study as the scores of runs that rliable and marl-eval read.

scores = rliable_scores(results)            # {"ddqn": array of runs x tasks, "greedy": ...}
text = json.dumps(marl_eval_data(results))

A task is a design point. An algorithm is a learner with all its trainings, or another policy. A run
is a block of missions, the same block for every algorithm. If learners have several trainings,
there are as many runs, and run r of a learner is its training r on block r. So runs have neither a
training nor a mission in common, as the bootstrap of both libraries assumes. The runs of all other
policies differ in the missions only: their intervals are about this policy, or this checkpoint.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from analysis.names import MEANS, METRICS, PRODUCT, SHARES
from analysis.questions.summary import learners, settings
from analysis.results.tables import Results
from dess.errors import InputError, one_of

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
    if metric not in (*SHARES, *MEANS):
        raise InputError(f"metric: {metric!r} is unknown{one_of(metric, [*SHARES, *MEANS])}")
    algorithms, points = _policies_of_runs(results), range(len(results.store.manifest.points))
    runs = len(next(iter(algorithms.values())))
    cells = results.missions.groupby(["policy", "point"], sort=False)[metric]
    size = int(cells.size().min()) // runs
    if not size:
        raise InputError(f"missions: {cells.size().min()} for {runs} runs; allowed: at least one")
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
        InputError: As for ``rliable_scores``.
    """
    study = results.store.manifest.study["name"]
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
            for task, setting in enumerate(settings(results))
        }
    }


def _policies_of_runs(results: Results) -> dict[str, list[str]]:
    """For every algorithm the policy of each run."""
    trained = learners(results)
    others = set(results.policies).difference(*trained.values())
    algorithms = trained | {policy: [policy] for policy in results.policies if policy in others}
    counts = {len(policies) for policies in algorithms.values()} - {1}
    if len(counts) > 1:
        raise InputError(f"trainings: {sorted(counts)}; allowed: as many of every learner")
    runs = max(counts, default=RUNS)
    return {name: of if len(of) == runs else of * runs for name, of in algorithms.items()}
