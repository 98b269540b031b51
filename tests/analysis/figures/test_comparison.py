"""What figures of a comparison show is in their tables."""

import numpy as np
import pandas as pd
import pytest

from analysis.answers import comparison as regions
from analysis.answers.comparison import AHEAD, BEHIND, Pair
from analysis.ask import answer
from analysis.figures import comparison
from analysis.figures.comparison import COLOURS
from analysis.names import BOUND, GAP, METRICS, PARAMETERS, PRODUCT
from analysis.stats.verdict import INCONCLUSIVE
from tests.analysis.answers.test_comparison import missions_of
from tests.analysis.small import asked

PAIR, POLICIES = Pair("ours", "theirs", 1), ["random", "greedy"]


def drawn_interval(bar, axis):
    """(N, 2) the ends of error bars."""
    return np.array([segment[:, axis] for segment in bar.lines[2][0].get_segments()])


@pytest.fixture(scope="module")
def missions():
    """Ahead with one UAV, level with two, behind with three."""
    return missions_of(lambda t: 0.05 * (2 - t["uavs"]))


@pytest.fixture(scope="module")
def table(missions):
    return regions.along(missions)


def test_a_dot_per_bin_with_its_interval_and_its_verdict(table):
    (ax,) = comparison.lead(table, "uavs", 0.012).axes
    rows = table[table["field"] == "uavs"]
    for bar, (verdict, own) in zip(ax.containers, rows.groupby("verdict"), strict=True):
        dot = bar.lines[0]
        assert dot.get_xdata().tolist() == own["position"].tolist()
        assert dot.get_ydata() == pytest.approx(own["mean"])
        assert drawn_interval(bar, 1) == pytest.approx(own[["low", "high"]].to_numpy())
        assert dot.get_color() == COLOURS[verdict]
        assert (dot.get_fillstyle() == "none") == (verdict == INCONCLUSIVE)
    assert [label.get_text() for label in ax.get_xticklabels()] == ["1", "2", "3"]
    levels = {tuple(line.get_ydata()) for line in ax.lines}
    assert {(0, 0), (0.012, 0.012)} <= levels


def test_all_parameters_have_the_same_axis_and_all_intervals_on_it(table):
    axes = [comparison.lead(table, field, 0.0).axes[0] for field in PARAMETERS]
    ((low, high),) = {ax.get_ylim() for ax in axes}
    assert low < table["low"].min() < table["high"].max() < high
    ahead = regions.along(missions_of(lambda t: 0.3))
    assert comparison.lead(ahead, "uavs", 0.3).axes[0].get_ylim()[0] < 0
    assert axes[-1].get_title(loc="left") == "Flying time [mission slots]"


def test_the_curve_is_the_share_of_missions_up_to_a_difference(missions):
    (ax,) = comparison.distribution(missions, PAIR).axes
    (curve,) = (line for line in ax.lines if line.get_gid() == "shares")
    x, y = curve.get_data()
    for value in (-0.05, 0.0, 0.03):
        at = y[np.searchsorted(x, value, side="right") - 1]
        assert at == pytest.approx((missions["difference"] <= value).mean())
    said = {text.get_gid(): text.get_text() for text in ax.texts}
    assert said == {
        BEHIND: f"ours behind: {(missions['difference'] < 0).mean():.1%}",
        AHEAD: f"ours ahead: {(missions['difference'] > 0).mean():.1%}",
    }


def test_the_band_holds_the_whole_curve(missions):
    """Of many samples, at most about 5 % leave the band of the distribution that they are of."""
    generator, outside = np.random.default_rng(1), 0
    for _ in range(40):
        sample = missions.head(60).assign(difference=generator.uniform(-0.2, 0.2, 60))
        (ax,) = comparison.distribution(sample, PAIR).axes
        (band,) = (c for c in ax.collections if c.get_gid() == "band")
        vertices = band.get_paths()[0].vertices
        half = len(vertices) // 2
        truth = np.clip((vertices[:, 0] + 0.2) / 0.4, 0, 1)
        middle = np.abs(vertices[:, 0]) < 0.19
        low, high = vertices[:half], vertices[half:]
        outside += (low[middle[:half], 1] > truth[:half][middle[:half]] + 1e-9).any() or (
            high[middle[half:], 1] < truth[half:][middle[half:]] - 1e-9
        ).any()
    assert outside <= 6


@pytest.fixture(scope="module")
def results(tmp_path_factory):
    return asked(tmp_path_factory.mktemp("what-if"), 5).results


def test_figures_show_the_means_and_the_gains(results):
    table, answers = answer.means(results), answer.answers(results)
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


def gap_rows() -> pd.DataFrame:
    """Rows as of ``gap.by_fleet``: two policies, one and two UAVs, and all."""
    rows = pd.DataFrame(
        [(uavs, policy) for uavs in (1, 2, "all") for policy in ("one", "two")],
        columns=["uavs", "policy"],
    )
    for number, metric in enumerate((PRODUCT, BOUND, GAP)):
        rows[metric] = 0.3 * number + np.linspace(0.1, 0.2, len(rows))
        rows[f"{metric}_low"], rows[f"{metric}_high"] = rows[metric] - 0.02, rows[metric] + 0.01
    return rows.assign(n=100)


def test_a_panel_per_fleet_shows_products_and_the_bound() -> None:
    table = gap_rows()
    figure = comparison.gaps(table)
    assert len(figure.axes) == 2
    for ax, uavs in zip(figure.axes, (1, 2), strict=True):
        rows = table[table["uavs"] == uavs]
        bars = [bar.lines[0].get_xdata()[0] for bar in ax.containers]
        assert bars == pytest.approx(rows[PRODUCT])
        (bound,) = (line for line in ax.lines if line.get_label() == "upper bound")
        assert bound.get_xdata()[0] == rows[BOUND].iloc[0]
        assert [label.get_text() for label in ax.get_yticklabels()] == ["one", "two"]
    assert figure.axes[1].get_title(loc="left").startswith("2 UAVs: bound")


def test_differences_are_beside_each_other_by_fleet() -> None:
    table = pd.DataFrame(
        {"policy": ["a", "a", "b", "b"], "uavs": [1, "all"] * 2, "baseline": "c"}
        | {"difference": [0.1, 0.2, 0.3, 0.4], "low": 0.0, "high": 0.5}
    )
    (ax,) = comparison.differences(table).axes
    drawn = [bar.lines[0].get_ydata().tolist() for bar in ax.containers]
    assert drawn == [[0.1, 0.2], [0.3, 0.4]]
    assert [label.get_text() for label in ax.get_xticklabels()] == ["1 UAV", "all"]
    assert ax.get_title(loc="left") == "Difference from c (paired)"
