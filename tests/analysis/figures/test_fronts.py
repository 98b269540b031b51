"""Fronts go through what is not dominated; the front of costs is tested with its question."""

import pandas as pd

from analysis.figures import fronts


def test_the_front_goes_through_policies_that_are_not_dominated() -> None:
    table = pd.DataFrame(
        {"policy": ["a", "b", "c"], "seconds": [1e-5, 1e-4, 1e-3], "mean": [0.5, 0.4, 0.9]}
        | {"low": 0.3, "high": 0.95, "on_front": [True, False, True]}
    )
    (ax,) = fronts.decision_times(table).axes
    (line,) = (line for line in ax.lines if line.get_label() == "Pareto front")
    assert (list(line.get_xdata()), list(line.get_ydata())) == ([1e-5, 1e-3], [0.5, 0.9])
    assert len(ax.containers) == 3
