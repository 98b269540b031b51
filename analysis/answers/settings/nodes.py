"""How single nodes are served in the missions of a setting, where there is a data sheet.

A fleet may collect most of the data, and hardly any of one node.
"""

from collections.abc import Sequence

import numpy as np

from dess.analysis import numbers
from dess.analysis.metrics import NODE_RATIOS
from dess.analysis.results.tables import Results
from dess.analysis.sheet import node_titles

HARDLY = 0.1  # a node is hardly served if less than this share of its data is collected on average
MOST_NAMED = 3  # the largest number of nodes that are named


def hardly_served_nodes(results: Results, policy: str, points: Sequence[int]) -> str:
    """The nodes that are hardly served, with their collection ratios; empty if none is.

    Args:
        results: The study.
        policy: The policy.
        points: The design points of the setting, one for each condition. Of a node it is told what
            is collected under the worst of them.
    """
    ratios = _ratios_of_nodes(results, policy, points)
    hardly = np.flatnonzero(ratios < HARDLY)
    if not len(hardly):
        return ""
    order = hardly[np.argsort(ratios[hardly], kind="stable")]
    named = order[:MOST_NAMED]
    titles = node_titles(results.scenario(points[0]), named.tolist())
    parts = [
        f"{title} ({numbers.format_percent(ratio)} of its data)"
        for title, ratio in zip(titles, ratios[named], strict=True)
    ]
    if more := len(order) - len(named):
        parts.append(f"{more:,} more, each below {numbers.format_level(HARDLY)}")
    return numbers.join_words(parts)


def _ratios_of_nodes(results: Results, policy: str, points: Sequence[int]) -> np.ndarray:
    """The (K,) mean collection ratios of the nodes at the worst of some points; none if unknown.

    They are those of the check of a search, if there is one.
    """
    ratios = []
    for point in points:
        of_point = [
            missions[(missions["policy"] == policy) & (missions["point"] == point)]
            for missions in (results.checks, results.missions)
        ]
        missions = next((part for part in of_point if len(part)), of_point[-1])
        if NODE_RATIOS not in missions or missions.empty:
            return np.zeros(0)
        ratios.append(np.mean([*missions[NODE_RATIOS]], axis=0))
    if len({len(of_nodes) for of_nodes in ratios}) != 1:
        return np.zeros(0)
    return np.min(ratios, axis=0)
