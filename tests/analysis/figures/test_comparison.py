"""What figures of a comparison show is in their tables."""

import numpy as np
import pandas as pd
import pytest

from dess.analysis.ask import what_if
from dess.analysis.figures import comparison
from dess.analysis.metrics import BOUND, METRICS, PRODUCT
from tests.analysis.answers.test_comparison import drawn_interval
from tests.analysis.small import asked

POLICIES = ["random", "greedy"]


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return asked(tmp_path_factory.mktemp("what-if"), 5).results


def test_figures_show_the_means_and_the_gains(results):
    table, answers = what_if.means(results), what_if.answers(results)
    sides = ["baseline\nuavs 2\npads 6", "variation\nuavs 6\npads 1"]
    for metric in METRICS:
        (ax,) = comparison.means(table, metric, sides).axes
        ticks = [tick.get_text() for tick in ax.get_xticklabels()]
        assert ticks == sides
        for bar, policy in zip(ax.containers, POLICIES, strict=True):
            own = table[(table["metric"] == metric) & (table["policy"] == policy)]
            assert bar.lines[0].get_ydata() == pytest.approx(own["mean"])
            assert drawn_interval(bar, 1) == pytest.approx(own[["low", "high"]].to_numpy())
    (ax,) = comparison.gains(answers).axes
    for bar, policy in zip(ax.containers, POLICIES, strict=True):
        own = answers[answers["policy"] == policy].set_index("metric").loc[[*METRICS]]
        assert bar.lines[0].get_ydata() == pytest.approx(own["difference"])
        assert drawn_interval(bar, 1) == pytest.approx(own[["low", "high"]].to_numpy())


def test_the_spread_is_the_share_of_missions_up_to_a_difference():
    gaps = {
        "ours": pd.Series([0.0, 0.1, -0.5, 0.1]),
        "theirs": pd.Series(np.linspace(-0.02, 0.04, 100)),
    }
    above, below = comparison.spread(gaps).axes
    for ax in (above, below):
        for line, own in zip(ax.lines, gaps.values(), strict=False):
            for x, share in list(zip(line.get_xdata(), line.get_ydata(), strict=True))[1:]:
                assert share <= (own <= x).mean()
            assert line.get_ydata()[0] == 0 and line.get_ydata()[-1] == 1
    assert below.get_xlim()[0] > above.get_xlim()[0]

    comparison.spread({"ours": pd.Series([0.0, 0.0])}).canvas.draw()


def test_a_panel_per_fleet_shows_products_and_the_bound() -> None:
    fleets = [(uavs, policy) for uavs in (1, 2) for policy in ("one", "two")]
    table = pd.DataFrame(fleets, columns=["uavs", "policy"])
    for metric, least in ((PRODUCT, 0.1), (BOUND, 0.4)):
        table[metric] = np.linspace(least, least + 0.1, len(table))
        table[f"{metric}_low"], table[f"{metric}_high"] = table[metric] - 0.02, table[metric] + 0.01
    figure = comparison.gaps(table)
    for ax, (_, rows) in zip(figure.axes, table.groupby("uavs"), strict=True):
        bars = [bar.lines[0].get_xdata()[0] for bar in ax.containers]
        assert bars == pytest.approx(rows[PRODUCT])
        (bound,) = (line for line in ax.lines if line.get_label() == "upper bound")
        assert bound.get_xdata()[0] == rows[BOUND].iloc[0]
        assert [label.get_text() for label in ax.get_yticklabels()] == ["one", "two"]
    assert figure.axes[1].get_title(loc="left").startswith("2 UAVs: bound")
