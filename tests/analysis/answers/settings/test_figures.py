"""Fronts go through what is not dominated; the front of costs is tested with its question."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from dess.analysis.answers.policies.decision_times import plot_decision_times
from dess.analysis.answers.settings.effects import average_over_others
from dess.analysis.answers.settings.figures import (
    MOST_PANELS,
    draw_curves,
    draw_heat_map,
    evenly_spaced,
)
from dess.analysis.metrics import SUCCESS
from dess.analysis.stats.verdict import SEEN_WORSE
from tests.analysis.small import grid


@pytest.fixture(scope="module")
def results(studied):
    """Numbers at uneven distances, ranges, and a third field."""
    values = {"quota": [20, 40, 100], "initial_data": [[5, 7], 10], "uavs": [1, 2]}
    return studied(design=grid(**values), missions=6)


def curves(ax):
    """Of every curve: its places, its means and the ends of its bars."""
    for bar in ax.containers:
        (line, _, (ends,)) = bar.lines
        yield line.get_xdata(), line.get_ydata(), np.array([e[:, 1] for e in ends.get_segments()])


def test_curves_are_the_means_with_intervals_at_their_places(results):
    (ax,) = draw_curves(results, "quota", metric=SUCCESS).figure.axes
    table = average_over_others(results, ["quota"], SUCCESS)
    for policy, (x, y, ends) in zip(results.policies, curves(ax), strict=True):
        own = table[table["policy"] == policy]
        assert x == pytest.approx([20, 40, 100], abs=3)
        assert y == pytest.approx(own["mean"])
        assert ends == pytest.approx(own[["low", "high"]].to_numpy())
    assert ax.get_xlabel() == "Communication quota [communication slots]"


@pytest.mark.parametrize("facet", [None, "uavs"])
def test_a_heat_map_frames_what_may_be_the_best_and_marks_the_best(results, facet):
    fields = ["initial_data", "quota", *([facet] if facet else [])]
    drawing, _, caption, data = draw_heat_map(
        results, "quota", "initial_data", policy="random", facet=facet
    )
    table = average_over_others(results, fields, policy="random")
    assert data["mean"].tolist() == table["mean"].tolist()
    assert ("Cells are averaged over number of UAVs. " in caption) == (facet is None)
    panels = [ax for ax in drawing.axes if ax.collections and ax.get_label() != "<colorbar>"]
    shown = np.concatenate([np.ravel(ax.collections[0].get_array()) for ax in panels])
    assert sorted(shown) == pytest.approx(sorted(table["mean"]))
    lines = [p.get_linestyle() for ax in panels for p in ax.patches if isinstance(p, Rectangle)]
    assert lines.count("-") == table["tied"].sum() > 0
    assert lines.count(":") == (table["standing"] == SEEN_WORSE).sum() > 0
    assert "Dotted frames: cells that are worse in what was seen" in caption
    ((star, panel),) = [(line, ax) for ax in panels for line in ax.lines]
    means = panel.collections[0].get_array()
    best = means[int(star.get_ydata()[0]), int(star.get_xdata()[0])]
    assert best == table["mean"].max()
    texts = [text.get_text() for ax in panels for text in ax.texts]
    assert sorted(texts) == sorted(f"{100 * mean:.1f}" for mean in table["mean"])


def test_the_colours_of_shares_end_at_100_percent_and_the_numbers_are_readable(results):
    certain = replace(results, missions=results.missions.assign(success=1))
    figure = draw_heat_map(certain, "quota", "initial_data", "success", "random").figure
    bar = next(ax for ax in figure.axes if ax.get_label() == "<colorbar>")
    assert bar.get_ylim() == (0.9, 1.0)
    # White on the darkest blue.
    assert {text.get_color() for text in figure.axes[0].texts} == {"white"}


def test_of_costs_the_lowest_cell_is_marked(results):
    missions = results.missions
    priced = replace(results, missions=missions.assign(cost=1e4 * missions["uavs"]))
    ax = draw_heat_map(priced, "uavs", "quota", "cost").figure.axes[0]
    assert ax.lines[0].get_xdata()[0] == 0.5  # the smaller fleet
    assert {text.get_text() for text in ax.texts} == {"10,000", "20,000"}


def test_many_values_have_panels_that_are_spread_evenly():
    assert evenly_spaced([1, 2, 3]) == [1, 2, 3]
    some = evenly_spaced([*range(100)])
    assert (len(some), some[0], some[-1]) == (MOST_PANELS, 0, 99)


def test_the_front_goes_through_policies_that_are_not_dominated():
    table = pd.DataFrame(
        {"policy": ["a", "b", "c"], "seconds": [1e-5, 1e-4, 1e-3], "mean": [0.5, 0.4, 0.9]}
        | {"low": 0.3, "high": 0.95, "on_front": [True, False, True]}
    )
    (ax,) = plot_decision_times(table).axes
    (line,) = (line for line in ax.lines if line.get_label() == "Pareto front")
    assert (list(line.get_xdata()), list(line.get_ydata())) == ([1e-5, 1e-3], [0.5, 0.9])
    assert len(ax.containers) == 3
