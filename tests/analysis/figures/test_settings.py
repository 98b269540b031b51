"""Figures of settings show means with intervals, the best cell and those that may be as good."""

from dataclasses import replace

import numpy as np
import pandas as pd
import pytest
from matplotlib.patches import Rectangle

from analysis import run_study
from analysis.figures import settings as figures
from analysis.figures import style
from analysis.names import METRICS, PRODUCT, SUCCESS
from analysis.questions import settings
from dess import InputError
from tests.analysis.small import grid, small_study


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    """Numbers at uneven distances, ranges, and a third field."""
    folder = tmp_path_factory.mktemp("grid")
    values = {"quota": [20, 40, 100], "initial_data": [[5, 7], 10], "uavs": [1, 2]}
    return run_study(small_study(folder, design=grid(**values), missions=6), folder / "out")


def curves(ax):
    """Of every curve: its places, its means and the ends of its bars."""
    for bar in ax.containers:
        (line, _, (ends,)) = bar.lines
        yield line.get_xdata(), line.get_ydata(), np.array([e[:, 1] for e in ends.get_segments()])


def test_curves_are_the_means_with_intervals_at_their_places(results):
    (ax,) = figures.plot(results, "quota", metric=SUCCESS).axes
    table = settings.averaged(results, ["quota"], SUCCESS)
    for policy, (x, y, ends) in zip(results.policies, curves(ax), strict=True):
        own = table[table["policy"] == policy]
        assert x == pytest.approx([20, 40, 100], abs=3)
        assert y == pytest.approx(own["mean"])
        assert ends == pytest.approx(own[["low", "high"]].to_numpy())
    assert ax.get_xlabel() == "Communication quota [communication slots]"


def test_a_second_field_has_a_curve_per_value_and_policies_have_panels(results):
    drawing = figures.plot(results, "initial_data", hue="uavs")
    table = settings.averaged(results, ["initial_data", "uavs"])
    assert [ax.get_title(loc="left") for ax in drawing.axes] == results.policies
    for ax, policy in zip(drawing.axes, results.policies, strict=True):
        for uavs, (_, y, _) in zip((1, 2), curves(ax), strict=True):
            own = table[(table["policy"] == policy) & (table["uavs"] == uavs)]
            assert y == pytest.approx(own["mean"])
    assert [t.get_text() for t in drawing.axes[-1].get_xticklabels()] == ["5–7", "10"]
    assert len(figures.plot(results, "uavs", hue="quota", policy="random").axes) == 1


def test_names_of_near_values_are_turned_so_that_they_do_not_touch():
    rates = [0, 0.001, 0.002, 0.005, 0.01]
    for values, angle in ((rates, 30), ([1, 2, 3, 10], 0)):
        rows = pd.DataFrame({"rate": values, "policy": "greedy", "mean": 0.5, "low": 0.4})
        looks = figures.graded(["greedy"])
        with style.panels(3) as (figure, ax):
            figures.curves(rows.assign(high=0.6), "rate", looks, values, ax)
        assert [t.get_rotation() for t in ax.get_xticklabels()] == [angle] * len(values)
        figure.draw_without_rendering()
        boxes = [t.get_tightbbox() for t in ax.get_xticklabels()]
        if not angle:
            assert all(a.x1 < b.x0 for a, b in zip(boxes, boxes[1:], strict=False))


@pytest.mark.parametrize("facet", [None, "uavs"])
def test_a_heat_map_frames_what_may_be_the_best_and_marks_the_best(results, facet):
    fields = ["initial_data", "quota", *([facet] if facet else [])]
    drawing = figures.heat_map(results, "quota", "initial_data", policy="random", facet=facet)
    table = settings.averaged(results, fields, policy="random")
    panels = [ax for ax in drawing.axes if ax.collections and ax.get_label() != "<colorbar>"]
    shown = np.concatenate([np.ravel(ax.collections[0].get_array()) for ax in panels])
    assert sorted(shown) == pytest.approx(sorted(table["mean"]))
    frames = sum(isinstance(patch, Rectangle) for ax in panels for patch in ax.patches)
    assert frames == table["tied"].sum() > 0
    ((star, panel),) = [(line, ax) for ax in panels for line in ax.lines]
    means = panel.collections[0].get_array()
    best = means[int(star.get_ydata()[0]), int(star.get_xdata()[0])]
    assert best == table["mean"].max()
    texts = [text.get_text() for ax in panels for text in ax.texts]
    assert sorted(texts) == sorted(f"{100 * mean:.1f}" for mean in table["mean"])


def test_of_costs_the_lowest_cell_is_marked(results):
    missions = results.missions
    priced = replace(results, missions=missions.assign(cost=1e4 * missions["uavs"]))
    ax = figures.heat_map(priced, "uavs", "quota", "cost").axes[0]
    assert ax.lines[0].get_xdata()[0] == 0.5  # the smaller fleet
    assert {text.get_text() for text in ax.texts} == {"10,000", "20,000"}


def test_a_cell_without_missions_stays_empty(tmp_path):
    rows = [{"uavs": 1, "quota": 20}, {"uavs": 2, "quota": 40}]
    study = small_study(tmp_path, design={"kind": "table", "rows": rows}, missions=4)
    ax = figures.heat_map(run_study(study, tmp_path / "out"), "uavs", "quota").axes[0]
    assert np.isnan(np.asarray(ax.collections[0].get_array(), float)).sum() == 2
    assert len(ax.texts) == 2


def test_main_effects_have_a_panel_per_field_the_widest_first(results):
    drawing = figures.main_effects(results)
    effects = settings.main_effects(results)
    order = settings.by_influence(effects)
    panels = [ax for ax in drawing.axes if ax.get_visible()]
    assert len(panels) == 3
    for ax, field in zip(panels, order, strict=True):
        for policy, (_, y, _) in zip(results.policies, curves(ax), strict=True):
            own = effects[(effects["field"] == field) & (effects["policy"] == policy)]
            assert y == pytest.approx(own["mean"])


def test_every_design_point_is_a_dot(results):
    table = settings.ranked(results)
    for ax in [ax for ax in figures.scatter(results).axes if ax.get_visible()]:
        for dots, policy in zip(ax.collections, table["policy"].unique(), strict=True):
            means = np.asarray(dots.get_offsets())[:, 1]
            assert means == pytest.approx(table[table["policy"] == policy][PRODUCT])


def test_a_distribution_is_the_share_of_missions(results):
    (ax,) = figures.distribution(results.missions).axes
    for line, policy in zip(ax.lines, results.policies, strict=True):
        values = results.missions[results.missions["policy"] == policy][PRODUCT]
        heights = dict(zip(*(list(data)[1:] for data in line.get_data()), strict=True))
        assert heights == pytest.approx({value: (values <= value).mean() for value in values})


def test_many_values_have_panels_that_are_spread_evenly():
    assert figures.shown([1, 2, 3]) == [1, 2, 3]
    some = figures.shown([*range(100)])
    assert (len(some), some[0], some[-1]) == (figures.MOST_PANELS, 0, 99)


def test_an_unknown_field_is_refused(results):
    with pytest.raises(InputError, match="pads: has not several values in the study; allowed: qu"):
        figures.plot(results, "pads")


@pytest.mark.parametrize("metric", [*METRICS, "reward"])
def test_all_metrics_can_be_drawn(results, metric):
    figures.heat_map(results, "quota", "uavs", metric).canvas.draw()
