"""Colours tell nodes and policies apart, and tick labels are signed."""

import matplotlib as mpl
import pandas as pd
import pytest
from IPython.core.formatters import DisplayFormatter

from dess import load_scenario
from dess.analysis.figures import style
from dess.analysis.figures.missions import sea_figure
from dess.analysis.figures.style import node_colours, policy_colours, signed_points
from dess.policies.shipped import WITH_LOOK


@pytest.mark.parametrize("count", [1, 9, 25, 40])
def test_neighbouring_nodes_differ_in_colour(count):
    palette = node_colours(count)
    assert len(palette) == count
    assert len(set(palette)) == min(count, 27)
    assert all(a != b for a, b in zip(palette, palette[1:], strict=False))
    columns = 5
    assert all(a != b for a, b in zip(palette, palette[columns:], strict=False))


def test_policies_look_the_same_wherever_they_are_and_none_like_another():
    everywhere = policy_colours(WITH_LOOK)
    for names in (["ddqn", "mine", "greedy", "ddqn"], ["a", "b", "ddqn-paper"], ["b", "a"]):
        looks = policy_colours(names)
        assert [*looks] == [*dict.fromkeys(names)]
        assert len({*looks.values()}) == len(looks)
        assert all(looks[name] == everywhere[name] for name in looks if name in everywhere)


def test_differences_on_an_axis_are_signed_points():
    shares = (0.025, -0.1, 0.0, 0.0005)
    assert [signed_points(share) for share in shares] == ["+2.5", "−10", "0", "+0.05"]


def test_a_figure_has_the_look_and_leaves_no_state_behind():
    before = dict(mpl.rcParams)
    with pytest.raises(KeyError), style.new_panels(3) as (figure, _):
        assert figure.axes and not mpl.rcParams["text.parse_math"]
        raise KeyError
    assert dict(mpl.rcParams) == before


def test_an_axis_holds_all_intervals_and_has_a_least_length():
    rows = pd.DataFrame({"low": [0.5, 0.6], "high": [0.52, 0.9]})
    for length, zero in ((0.0, False), (0.0, True), (0.1, False), (0.8, False)):
        low, high = style.axis_ends(rows, length, zero)
        assert low < 0.5 and high > 0.9
        assert high - low >= length
        assert (low < 0) == zero


def test_a_notebook_shows_a_figure_though_nothing_has_imported_pyplot():
    """Without pyplot, IPython has no hook for figures and shows the name of their class."""
    with style.new_panels(2.0) as (figure, _):
        pass
    shown = DisplayFormatter().format
    for drawn in (figure, sea_figure(load_scenario("fig1"))):
        picture, _ = shown(drawn)
        assert picture["image/png"].startswith(b"\x89PNG")


@pytest.mark.parametrize("width", [style.WIDTH, 4.3])
def test_a_legend_is_no_wider_than_its_figure(width):
    with style.new_panels(3.0, legend=5) as (figure, ax):
        for name in ("random-unguarded", "ddqn-paper", "greedy", "nearest", "tour"):
            ax.plot([0, 1], label=name)
    figure.resize(width, 3.0)
    figure.canvas.draw()
    (legend,) = figure.legends
    box = legend.get_window_extent()
    assert box.x0 >= 0 and box.x1 <= figure.bbox.width
    assert len(legend.get_texts()) == 5
