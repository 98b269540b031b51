"""Figures of policies show the means and intervals of their table."""

from typing import Any

import numpy as np
import pandas as pd
import pytest

from analysis.figures import policies
from analysis.names import METRICS


def summary(by: dict[str, list[Any]]) -> pd.DataFrame:
    """Rows as of ``analysis.summary``, with different numbers."""
    rows = pd.DataFrame(by).merge(pd.DataFrame({"metric": list(METRICS)}), how="cross")
    mean = np.linspace(0.2, 0.8, len(rows))
    return rows.assign(mean=mean, low=mean - 0.03, high=mean + 0.01, n=100)


@pytest.mark.parametrize("metric", METRICS)
def test_performance_shows_means_intervals_and_the_printed_figure(metric: str) -> None:
    table = summary({"policy": ["one", "two", "three"]})
    (ax,) = policies.performance(table, metric, 0.55).axes
    rows = table[table["metric"] == metric]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["one", "two", "three"]
    for bar, (_, row) in zip(ax.containers, rows.iterrows(), strict=True):
        assert bar.lines[0].get_xdata() == pytest.approx([row["mean"]])
        (arm,) = bar.lines[2]
        assert arm.get_segments()[0][:, 0] == pytest.approx([row["low"], row["high"]])
    (printed,) = (line for line in ax.lines if line.get_label() == "paper 55.0%")
    assert list(printed.get_xdata()) == [0.55, 0.55]
    assert ax.get_title(loc="left") == METRICS[metric]
    assert [note.get_text() for note in ax.texts] == [f"{mean:.1%}" for mean in rows["mean"]]
    assert ax.get_ylim()[0] > ax.get_ylim()[1]  # the first on top


def test_by_fleet_shows_a_curve_per_policy_and_the_printed_ones() -> None:
    table = summary({"policy": ["one"] * 3 + ["two"] * 3, "uavs": [1, 2, 3] * 2})
    (ax,) = policies.by_fleet(table, "success", {3: 0.9, 1: 0.5}).axes
    rows = table[table["metric"] == "success"]
    assert len(ax.containers) == 2
    for bar, (_, means) in zip(ax.containers, rows.groupby("policy", sort=False), strict=True):
        assert bar.lines[0].get_ydata() == pytest.approx(means["mean"])
        assert [round(x) for x in bar.lines[0].get_xdata()] == [1, 2, 3]
    (printed,) = (line for line in ax.lines if line.get_label() == "paper")
    assert (list(printed.get_xdata()), list(printed.get_ydata())) == ([1, 3], [0.5, 0.9])
