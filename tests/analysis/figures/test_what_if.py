"""Figures of a question show the means, the paired differences and their distribution."""

import numpy as np
import pandas as pd
import pytest

from analysis.figures import what_if as figures
from analysis.names import METRICS
from analysis.questions.what_if import answer as what_if_answer
from analysis.questions.what_if.question import VARIATION
from tests.analysis.small import asked

POLICIES = ["random", "greedy"]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return asked(tmp_path_factory.mktemp("what-if"), 5)


def drawn_interval(bar, axis):
    """(N, 2) the ends of error bars."""
    return np.array([segment[:, axis] for segment in bar.lines[2][0].get_segments()])


def test_figures_show_the_means_and_the_gains(results):
    table, answers = what_if_answer.means(results), what_if_answer.answers(results)
    settings = (["uavs 2", "pads 6"], ["uavs 6", "pads 1"])
    for metric in METRICS:
        (ax,) = figures.means(table, metric, settings).axes
        ticks = [tick.get_text() for tick in ax.get_xticklabels()]
        assert ticks == ["baseline\nuavs 2\npads 6", "variation\nuavs 6\npads 1"]
        for bar, policy in zip(ax.containers, POLICIES, strict=True):
            own = table[(table["metric"] == metric) & (table["policy"] == policy)]
            assert bar.lines[0].get_ydata() == pytest.approx(own["mean"])
            assert drawn_interval(bar, 1) == pytest.approx(own[["low", "high"]].to_numpy())
    (ax,) = figures.gains(answers).axes
    for bar, policy in zip(ax.containers, POLICIES, strict=True):
        own = answers[answers["policy"] == policy].set_index("metric").loc[[*METRICS]]
        assert bar.lines[0].get_xdata() == pytest.approx(own["difference"])
        assert drawn_interval(bar, 0) == pytest.approx(own[["low", "high"]].to_numpy())


def test_a_measure_of_a_section_is_drawn_for_the_side_that_has_it(tmp_path):
    results = asked(tmp_path, 4, settings={"age.measured": True}, policies=["greedy"])
    table = what_if_answer.means(results)
    (ax,) = figures.means(table, "age", (["age.measured no"], ["age.measured yes"])).axes
    assert ax.get_title(loc="left") == "Age of information [mission slots]"
    ((bar,), age) = ax.containers, results.missions["age"].mean()
    assert bar.lines[0].get_ydata() == pytest.approx([age])
    assert bar.lines[0].get_xdata() == pytest.approx([VARIATION], abs=0.05)


def test_the_spread_is_the_share_of_missions_up_to_a_difference():
    gaps = {
        "ours": pd.Series([0.0, 0.1, -0.5, 0.1]),
        "theirs": pd.Series(np.linspace(-0.02, 0.04, 100)),
    }
    above, below = figures.spread(gaps).axes
    for ax in (above, below):
        for line, own in zip(ax.lines, gaps.values(), strict=False):
            for x, share in list(zip(line.get_xdata(), line.get_ydata(), strict=True))[1:]:
                assert share <= (own <= x).mean()
            assert line.get_ydata()[0] == 0 and line.get_ydata()[-1] == 1
    assert below.get_xlim()[0] > above.get_xlim()[0]


def test_figures_of_missions_all_alike_are_drawn():
    figures.spread({"ours": pd.Series([0.0, 0.0])}).canvas.draw()
