"""IQM with intervals and performance profiles of policies, by rliable, from the results of a study.

dess study run fig5 --policy ddqn --policy ddqn-2 --policy ddqn-3 --policy greedy --out results/fig5
python examples/rliable_iqm.py results/fig5 profiles.png
"""

import sys

import numpy as np
from rliable import library, metrics, plot_utils

from dess import analysis

SHARES = np.linspace(0, 1, 51)  # of the best score


def iqm(scores: dict[str, np.ndarray], reps: int = 2000) -> dict[str, np.ndarray]:
    """The interquartile mean of every algorithm with the ends of its 95 % interval."""
    points, ends = library.get_interval_estimates(
        scores,
        lambda runs: np.array([metrics.aggregate_iqm(runs)]),
        reps=reps,
        random_state=np.random.RandomState(0),
    )
    return {name: np.array([points[name][0], *ends[name][:, 0]]) for name in scores}


def profiles(scores: dict[str, np.ndarray], file: str, reps: int = 2000) -> None:
    """Draw the share of runs and tasks with more than a score, over the score."""
    shares, bands = library.create_performance_profile(scores, SHARES, reps=reps)
    axes = plot_utils.plot_performance_profiles(
        shares, SHARES, bands, xlabel="Product", legend=True
    )
    axes.figure.savefig(file, bbox_inches="tight")


if __name__ == "__main__":
    scores = analysis.rliable_scores(analysis.load_results(sys.argv[1]))
    for name, (mean, low, high) in iqm(scores).items():
        print(f"{name}: {mean:.3f} [{low:.3f}, {high:.3f}]")
    profiles(scores, sys.argv[2])
