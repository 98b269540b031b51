"""What figures of trainings show is what the trainings did."""

import numpy as np
import pandas as pd
import pytest

from analysis.answers import learning as ablation
from analysis.figures import learning as learning_figures
from analysis.metrics import METRICS
from tests.analysis.answers.test_learning import training

METRIC = "evaluation_collection_ratio_and_communication"
LABELS = {"one": "with", "two": "without"}
ENDS = {"one": [0.5, 0.6, 0.7], "two": [0.55, 0.9]}


@pytest.fixture(scope="module")
def table():
    """Three trainings of one variant, in two phases, and two of another."""
    parts = [
        training(name, seed, np.linspace(0.2, end, 4), before=2 * (name == "one"))
        for name, ends in ENDS.items()
        for seed, end in enumerate(ends)
    ]
    return pd.concat(parts, ignore_index=True).rename(columns={"evaluation_reward": METRIC})


@pytest.fixture(scope="module")
def panel(table):
    (ax,) = learning_figures.trainings(table, METRIC, LABELS).axes
    return ax


def test_fig_3_shows_every_training(table, panel):
    averages = ablation.smoothed(table, METRIC)
    expected = [own["value"].tolist() for _, own in averages.groupby(["variant", "seed", "phase"])]
    drawn = [line.get_ydata().tolist() for line in panel.lines if line.get_gid() is None]
    assert sorted(drawn) == sorted(expected)


def test_fig_3_tells_the_phases_and_the_trainings(table, panel):
    names = [text.get_text() for text in panel.figure.legends[0].get_texts()]
    assert names == ["with, n = 3", "without, n = 2"]
    (line,) = [line for line in panel.lines if line.get_gid() == "last phase"]
    assert set(line.get_xdata()) == {2000}
    assert panel.get_title(loc="left") == METRICS["collection_ratio_and_communication"]
    styles = [line.get_linestyle() for line in panel.lines if line.get_gid() is None]
    assert styles == [":", "-"] * 3 + ["--"] * 2
    panel.figure.draw_without_rendering()
    (slots,) = panel.child_axes  # the axis at the top
    assert slots.get_xlim() == pytest.approx([500e-6 * end for end in panel.get_xlim()])
    low, high = panel.get_ylim()
    assert ablation.smoothed(table, METRIC)["value"].between(low, high).all()


@pytest.fixture(scope="module")
def ended():
    """Final products: of three trainings, of one, and of two that came to nothing."""
    rows = [("base", 0.7), ("base", 0.8), ("base", 0.75), ("once", 0.6), ("lost", 0.0), ("lost", 0)]
    table = pd.DataFrame(rows, columns=["variant", "final_collection_ratio_and_communication"])
    return table.assign(seed=range(len(table)))


def test_the_ablation_shows_trainings_means_and_intervals(ended):
    metric = "final_collection_ratio_and_communication"
    table = ablation.ablation(ended, metric, "base")
    (ax,) = learning_figures.ablation(table, ended, metric, "base").axes
    dots = {a.get_gid(): a.get_offsets()[:, 0].tolist() for a in ax.collections if a.get_gid()}
    assert dots == {"base": [0.7, 0.8, 0.75], "once": [0.6]}
    (bar,) = ax.containers  # one training has no interval
    base = table.iloc[0]
    assert bar.lines[0].get_xdata() == pytest.approx([base["mean"]])
    ends = bar.lines[2][0].get_segments()[0][:, 0]
    assert ends == pytest.approx([base["low"], base["high"]])
    arrows = [line for line in ax.lines if line.get_gid() == "lost"]
    assert [arrow.get_marker() for arrow in arrows] == ["<"]
    left, right = ax.get_xlim()
    assert 0 < left < base["low"] < base["high"] < right
    notes = [text.get_text() for text in ax.texts]
    assert notes == ["75.0%, n = 3", "60.0%, n = 1", "0.0%, n = 2"]
    assert [label.get_text() for label in ax.get_yticklabels()] == ["base", "once", "lost"]
    (line,) = [line for line in ax.lines if line.get_gid() == "baseline"]
    assert set(line.get_xdata()) == {base["mean"]}


def test_a_course_is_a_line_per_value_in_the_panel_of_its_rows():
    table = pd.DataFrame(
        {"policy": ["a"] * 2 + ["b"] * 2, "slot": [0, 1] * 2, "panel": [1, 1, 2, 2]}
    )
    ends = dict.fromkeys(("mean", "low", "high"), [1.0, 0.5, 1.0, 0.0])
    drawing = learning_figures.courses(
        table.assign(panel=[1, 1, 2, 2], **ends), "policy", "%", {1: "One", 2: "Two"}
    )
    drawn = {ax.get_title(loc="left"): ax.lines[0].get_ydata().tolist() for ax in drawing.axes}
    assert drawn == {"One": [1.0, 0.5], "Two": [1.0, 0.0]}
