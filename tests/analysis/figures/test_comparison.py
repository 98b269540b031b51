"""What figures of a comparison show is in their tables."""

import numpy as np
import pytest

from analysis.figures import comparison as drawings
from analysis.figures.comparison import COLOURS
from analysis.names import PARAMETERS
from analysis.questions import regions
from analysis.questions.head_to_head import AHEAD, BEHIND, Pair
from analysis.stats.verdict import INCONCLUSIVE
from tests.analysis.questions.test_regions import missions_of

PAIR = Pair("ours", "theirs", 1)


@pytest.fixture(scope="module")
def missions():
    """Ahead with one UAV, level with two, behind with three."""
    return missions_of(lambda t: 0.05 * (2 - t["uavs"]))


@pytest.fixture(scope="module")
def table(missions):
    return regions.along(missions)


def test_a_dot_per_bin_with_its_interval_and_its_verdict(table):
    (ax,) = drawings.lead(table, "uavs", 0.012).axes
    rows = table[table["field"] == "uavs"]
    for bar, row in zip(ax.containers, rows.itertuples(), strict=True):
        (dot, _, (arm,)) = bar.lines
        assert (dot.get_xdata()[0], dot.get_ydata()[0]) == (row.position, pytest.approx(row.mean))
        assert arm.get_segments()[0][:, 1] == pytest.approx([row.low, row.high])
        assert dot.get_color() == COLOURS[row.verdict]
        assert (dot.get_markerfacecolor() == "white") == (row.verdict == INCONCLUSIVE)
    assert [COLOURS[v] for v in (AHEAD, INCONCLUSIVE, BEHIND)] == [b.lines[0].get_color()
                                                          for b in ax.containers]  # fmt: skip
    assert [label.get_text() for label in ax.get_xticklabels()] == ["1", "2", "3"]
    levels = {tuple(line.get_ydata()) for line in ax.lines}
    assert {(0, 0), (0.012, 0.012)} <= levels


def test_all_parameters_have_the_same_axis_and_all_intervals_on_it(table):
    axes = [drawings.lead(table, field, 0.0).axes[0] for field in PARAMETERS]
    ((low, high),) = {ax.get_ylim() for ax in axes}
    assert low < table["low"].min() < table["high"].max() < high
    assert axes[-1].get_title(loc="left") == "Flying time [mission slots]"


def test_the_axis_holds_0_however_far_ahead(missions):
    ahead = regions.along(missions_of(lambda t: 0.3))
    low, high = drawings.lead(ahead, "uavs", 0.3).axes[0].get_ylim()
    assert low < 0 < high


def test_a_cell_says_its_mean_and_shows_its_sign(missions):
    cells = regions.across(missions, "uavs", "charge_start")
    (ax,) = drawings.heat(cells, "uavs", "charge_start").axes
    said = {(n.xy[1] - 0.5, n.xy[0] - 0.5): n.get_text() for n in ax.texts}
    assert len(said) == len(cells)
    mesh = ax.collections[0]
    faces = mesh.to_rgba(mesh.get_array()).reshape(3, regions.BINS, 4)
    for row in cells.itertuples():
        text = said[row.position, row.position_2]
        assert float(text.strip("()").replace("−", "-")) == pytest.approx(100 * row.mean, abs=0.05)
        assert text.startswith("(") == (row.verdict == INCONCLUSIVE)
        red, _, blue, _ = faces[row.position, row.position_2]
        if row.verdict != INCONCLUSIVE:
            assert (blue > red) == (row.verdict == AHEAD)
    assert ax.get_ylim()[0] > ax.get_ylim()[1]  # the first on top
    assert ax.get_ylabel() == "Number of UAVs"
    assert ax.get_xlabel() == "Charging start capacity $C_S$ [%]"


def test_a_cell_without_missions_is_left_empty(missions):
    some = missions[(missions["uavs"] < 3) | (missions["flying_time"] < 75)]
    cells = regions.across(some, "uavs", "flying_time")
    assert len(cells) < 3 * regions.BINS
    (ax,) = drawings.heat(cells, "uavs", "flying_time").axes
    assert np.ma.getmaskarray(ax.collections[0].get_array()).sum() == 3 * regions.BINS - len(cells)


def test_the_curve_is_the_share_of_missions_up_to_a_difference(missions):
    (ax,) = drawings.distribution(missions, PAIR).axes
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
        (ax,) = drawings.distribution(sample, PAIR).axes
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


def test_no_difference_at_all_can_be_drawn(missions):
    (ax,) = drawings.distribution(missions.assign(difference=0.0), PAIR).axes
    low, high = ax.get_xlim()
    assert low < 0 < high
