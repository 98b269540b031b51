"""What figures of parameters show is in their tables."""

import numpy as np
import pandas as pd
import pytest

from analysis.figures import parameters
from analysis.names import METRICS
from analysis.study.design import NOISE
from tests.analysis.questions.test_main_effects import pairs_of

VALUES = {"initial_data": ["5–7.5", "7.5–10", "10–12.5"], "uavs": ["1", "2"]}
CHANGES = {"mine": pairs_of([0.1, -0.2]), "other": pairs_of([0.05, 0.01])}
POLICIES = ["third", "mine", "other"]


@pytest.fixture(scope="module")
def table():
    """Means with numbers of their own in every row."""
    rows = [
        (field, value, position, policy, metric)
        for field, values in VALUES.items()
        for position, value in enumerate(values)
        for policy in CHANGES
        for metric in METRICS
    ]
    frame = pd.DataFrame(rows, columns=["field", "value", "position", "policy", "metric"])
    mean = np.linspace(0.3, 0.9, len(frame))
    return frame.assign(mean=mean, low=mean - 0.03, high=mean + 0.01, n=100)


@pytest.fixture(scope="module")
def panels(table):
    changes = CHANGES
    return parameters.effect(table, "initial_data", changes, POLICIES).axes


def segments(bar):
    """(N, 2) the ends of the error bars."""
    return np.array([segment[:, 1] for segment in bar.lines[2][0].get_segments()])


def test_a_panel_per_metric_shows_means_and_intervals(table, panels):
    rows = table[table["field"] == "initial_data"]
    for ax, (metric, name) in zip(panels, METRICS.items(), strict=False):
        assert ax.get_title(loc="left") == name
        for bar, policy in zip(ax.containers, CHANGES, strict=True):
            means = rows[(rows["metric"] == metric) & (rows["policy"] == policy)]
            assert bar.lines[0].get_ydata() == pytest.approx(means["mean"])
            assert [round(x) for x in bar.lines[0].get_xdata()] == means["position"].tolist()
            assert segments(bar) == pytest.approx(means[["low", "high"]].to_numpy())


def test_the_last_panel_shows_the_changes_from_the_first_value(panels):
    for bar, pairs in zip(panels[-1].containers, CHANGES.values(), strict=True):
        steps = pairs[pairs["first"] == 0]
        assert bar.lines[0].get_ydata() == pytest.approx([0, *steps["difference"]])
        ends = [[0, 0], *steps[["low", "high"]].to_numpy()]
        assert segments(bar) == pytest.approx(np.array(ends))
    assert "5–7.5" in panels[-1].get_title(loc="left")


def test_values_are_named_and_ranges_are_ranges(panels):
    ticks = [label.get_text() for label in panels[-1].get_xticklabels()]
    assert ticks == VALUES["initial_data"]
    assert panels[-1].get_xlabel() == "Initial data per node [data units]"


def test_metrics_have_the_same_axes_for_all_parameters(table, panels):
    changes = {policy: pairs_of([0.5]) for policy in CHANGES}
    others = parameters.effect(table, "uavs", changes, POLICIES).axes
    for first, second, metric in zip(panels[:3], others[:3], METRICS, strict=True):
        assert first.get_ylim() == second.get_ylim()
        rows = table[table["metric"] == metric]
        assert first.get_ylim()[0] < rows["low"].min() < rows["high"].max() < first.get_ylim()[1]
    assert others[-1].get_xlabel() == "Number of UAVs"


def test_a_policy_keeps_its_colour_whoever_else_is_drawn(table, panels):
    alone = table[table["policy"] == "other"]
    changes = {"other": CHANGES["other"]}
    other = parameters.effect(alone, "initial_data", changes, POLICIES).axes[0]
    (mine,) = other.containers
    assert mine.lines[0].get_color() == panels[0].containers[1].lines[0].get_color()


@pytest.fixture
def indices():
    first = np.array([0.6, -0.02, 0.1])
    total = np.array([0.8, 0.03, 0.2])
    ends = {f"{n}_{e}": v + s for n, v in (("first", first), ("total", total))
            for e, s in (("low", -0.05), ("high", 0.07))}  # fmt: skip
    names = ["uavs", "charge_start", NOISE]
    return pd.DataFrame({"parameter": names, "first": first, "total": total, **ends})


def test_sensitivities_are_bars_with_intervals(indices):
    (ax,) = parameters.sensitivity(indices, "mine").axes
    bars = [c for c in ax.containers if hasattr(c, "patches")]
    for bar, index in zip(bars, ("first", "total"), strict=True):
        assert [patch.get_width() for patch in bar.patches] == pytest.approx(indices[index])
    drawn = np.concatenate([np.array(a.get_segments())[:, :, 0] for a in ax.collections])
    expected = [indices[[f"{i}_low", f"{i}_high"]].to_numpy() for i in ("first", "total")]
    assert drawn == pytest.approx(np.concatenate(expected))
    names = [label.get_text().replace("\n", " ") for label in ax.get_yticklabels()]
    assert names == ["UAVs", "$C_S$", "noise of the replication"]
    assert ax.get_ylim() == (2.5, -0.5)  # the first on top
