"""What figures of a comparison show is in their tables."""

import numpy as np
import pandas as pd
import pytest

from dess.analysis.answers.policies.performance import plot_by_fleet, plot_performance
from dess.analysis.figures import comparison, name_best_mean, style
from dess.analysis.metrics import AGE, BOUND, PRODUCT, SUCCESS


@pytest.mark.parametrize(
    ("draw", "axis"),
    [
        (lambda rows: plot_performance(rows.assign(policy=[*"abcd"]), SUCCESS), 0),
        (lambda rows: plot_by_fleet(rows, SUCCESS, {}), 1),
        (lambda rows: comparison.plot_sides(rows, SUCCESS, ["before", "after"]), 1),
    ],
    ids=["performance", "by fleet", "means"],
)
def test_bars_are_the_means_and_the_intervals_of_the_table(draw, axis):
    rows = pd.DataFrame({"policy": [*"aabb"], "uavs": [1, 2] * 2, "mean": [0.2, 0.5, 0.4, 0.7]})
    rows = rows.assign(point=rows["uavs"] - 1, metric=SUCCESS, n=9)
    rows = rows.assign(low=rows["mean"] - 0.03, high=rows["mean"] + 0.01)
    (ax,) = draw(rows).axes
    bars = [bar.lines for bar in ax.containers]
    means = np.concatenate([line.get_data()[axis] for line, *_ in bars])
    ends = np.array([arm[:, axis] for bar in bars for arm in bar[2][0].get_segments()])
    assert means == pytest.approx(rows["mean"].to_numpy())
    assert ends == pytest.approx(rows[["low", "high"]].to_numpy())


def test_the_spread_is_the_share_of_missions_up_to_a_difference():
    gaps = {
        "ours": pd.Series([0.0, 0.1, -0.5, 0.1]),
        "theirs": pd.Series(np.linspace(-0.02, 0.04, 100)),
    }
    above, below = comparison.plot_difference_spread(gaps).axes
    for ax in (above, below):
        for line, own in zip(ax.lines, gaps.values(), strict=False):
            for x, share in list(zip(line.get_xdata(), line.get_ydata(), strict=True))[1:]:
                assert share <= (own <= x).mean()
            assert line.get_ydata()[0] == 0 and line.get_ydata()[-1] == 1
    assert below.get_xlim()[0] > above.get_xlim()[0]

    comparison.plot_difference_spread({"ours": pd.Series([0.0, 0.0])}).canvas.draw()


def test_a_panel_per_fleet_shows_products_and_the_bound():
    fleets = [(uavs, policy) for uavs in (1, 2) for policy in ("one", "two")]
    table = pd.DataFrame(fleets, columns=["uavs", "policy"])
    for metric, least in ((PRODUCT, 0.1), (BOUND, 0.4)):
        table[metric] = np.linspace(least, least + 0.1, len(table))
        table[f"{metric}_low"], table[f"{metric}_high"] = table[metric] - 0.02, table[metric] + 0.01
    figure = comparison.plot_gaps(table)
    for ax, (_, rows) in zip(figure.axes, table.groupby("uavs"), strict=True):
        bars = [bar.lines[0].get_xdata()[0] for bar in ax.containers]
        assert bars == pytest.approx(rows[PRODUCT])
        (bound,) = (line for line in ax.lines if line.get_gid() == "bound")
        assert bound.get_xdata()[0] == rows[BOUND].iloc[0]
        assert [text.get_text() for text in ax.texts] == ["upper bound "]
        assert [label.get_text() for label in ax.get_yticklabels()] == ["one", "two"]
    assert figure.axes[1].get_title(loc="left").startswith("2 UAVs: bound")


def test_a_bar_is_dark_as_far_as_the_missions_tell_and_pale_beyond():
    """Student's interval, and the whole one; where nothing is added, both are the same."""
    rows = pd.DataFrame(
        {"policy": ["a", "b"], "difference": [0.014, -0.2], "student": [0.002, 0.1]}
        | {"low": [-0.01, -0.3], "high": [0.04, -0.1]}
    )
    (ax,) = comparison.plot_differences(rows, pd.Series(["product"] * 2), "A - B").axes
    bars = [bar.lines[2][0] for bar in ax.containers]
    ends = np.array([bar.get_segments()[0][:, 1] for bar in bars])
    assert ends == pytest.approx(
        np.array([[-0.01, 0.04], [0.012, 0.016], [-0.3, -0.1], [-0.3, -0.1]])
    )
    assert [bar.get_alpha() for bar in bars] == [style.PALE, None, style.PALE, None]


def test_the_caption_names_the_best_mean():
    """The highest one, or the lowest where less is better; nothing where all are equal."""
    rows = pd.DataFrame({"policy": ["greedy"] * 3, "uavs": [1, 2, 3], "mean": [0.6, 0.9, np.nan]})
    sentence = name_best_mean(rows, PRODUCT, ["policy", "uavs"])
    assert sentence == "The highest mean is 90.0 %, of policy greedy, 2 UAVs. "
    assert name_best_mean(rows, AGE, ["uavs"]).startswith("The lowest mean is 0.6")
    assert name_best_mean(rows.assign(mean=1.0), PRODUCT, ["uavs"]) == ""


def test_the_caption_names_no_setting_that_is_ruled_out():
    """A mean of few missions may be the highest although the setting is ruled out."""
    rows = pd.DataFrame({"uavs": [1, 2, 3], "mean": [0.6, 0.9, 0.7], "tied": [True, False, True]})
    left = "The highest mean of what is not ruled out is 70.0 %, of 3 UAVs. "
    assert name_best_mean(rows, PRODUCT, ["uavs"]) == left
    selected = rows.assign(selected=[True, False, False])
    own = "The highest mean of what the study selects is 60.0 %, of 1 UAV. "
    assert name_best_mean(selected, PRODUCT, ["uavs"]) == own


def test_few_lines_have_their_names_beside_them_and_many_a_legend():
    """Names of lines that end at the same place are moved apart."""
    rows = pd.DataFrame({"point": [0, 1] * 3, "policy": [*"aabbcc"], "metric": SUCCESS})
    rows = rows.assign(mean=[0.2, 0.5, 0.3, 0.5, 0.4, 0.9])
    rows = rows.assign(low=rows["mean"] - 0.03, high=rows["mean"] + 0.01)
    figure = comparison.plot_sides(rows, SUCCESS, ["before", "after"])
    (ax,) = figure.axes
    names = {text.get_text(): text for text in ax.texts}
    looks = style.policy_colours("abc")
    assert {*names} == {*"abc"} and not figure.legends
    assert {name: text.get_color() for name, text in names.items()} == {
        name: colour for name, (colour, _) in looks.items()
    }
    heights = sorted(text.xy[1] for text in names.values())
    assert min(np.diff(heights)) >= 0.059
    many = pd.concat([rows.assign(policy=rows["policy"] + str(n)) for n in range(2)])
    figure = comparison.plot_sides(many, SUCCESS, ["before", "after"])
    assert figure.legends and not figure.axes[0].texts
