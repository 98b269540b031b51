"""Colours tell nodes and policies apart, and tick labels are signed."""

import pytest

from analysis.figures.style import KNOWN_POLICIES, node_colours, policy_colours, signed_points
from policies.registry import SHIPPED


@pytest.mark.parametrize("count", [1, 9, 25, 40])
def test_neighbouring_nodes_differ_in_colour(count: int) -> None:
    palette = node_colours(count)
    assert len(palette) == count
    assert len(set(palette)) == min(count, 27)
    assert all(a != b for a, b in zip(palette, palette[1:], strict=False))
    columns = 5
    assert all(a != b for a, b in zip(palette, palette[columns:], strict=False))


def test_policies_look_the_same_wherever_they_are_and_none_like_another() -> None:
    everywhere = policy_colours(KNOWN_POLICIES)
    for names in (["ddqn", "mine", "greedy", "ddqn"], ["a", "b", "ddqn-paper"], ["b", "a"]):
        looks = policy_colours(names)
        assert [*looks] == [*dict.fromkeys(names)]
        assert len({*looks.values()}) == len(looks)
        assert all(looks[name] == everywhere[name] for name in looks if name in everywhere)


def test_shipped_policies_have_a_look_of_their_own() -> None:
    assert set(SHIPPED) <= set(KNOWN_POLICIES)


def test_differences_on_an_axis_are_signed_points() -> None:
    shares = (0.025, -0.1, 0.0, 0.0005)
    assert [signed_points(share) for share in shares] == ["+2.5", "−10", "0", "+0.05"]
