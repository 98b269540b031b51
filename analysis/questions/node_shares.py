"""How a team shares the sensor nodes: what every UAV collects where, and what is left behind.

From the event log of a mission (``dess.record.EventLog``):

    >>> data = collected(results.events("ddqn", point=1), uavs=2, nodes=25)  # (2, 25)
    >>> division(data), sectors(data, nodes)

Nodes and UAVs are in the order of their numbers.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.results.event_log import Events

# A node is left behind if less than this share of the data that it ever held was collected.
LEFT_BEHIND = 0.5


def collected(events: Events, uavs: int, nodes: int) -> np.ndarray:
    """Data that every UAV collected from every node [data units], (I, K)."""
    log = pd.DataFrame(events)
    served = log[log["event"] == "communication"]
    data = np.zeros((uavs, nodes))
    np.add.at(data, (served["uav"].to_numpy(int), served["node"].to_numpy(int)), served["value"])
    return data


def held(events: Events, nodes: int) -> np.ndarray:
    """Data that every node ever held: at the start, and what arrived [data units], (K,)."""
    return _of_nodes(events, ["mission_start", "arrival"], nodes)


def left_behind(events: Events, nodes: int) -> np.ndarray:
    """Whether less than ``LEFT_BEHIND`` of what a node ever held was collected, (K,)."""
    return np.asarray(
        _of_nodes(events, ["communication"], nodes) < LEFT_BEHIND * held(events, nodes)
    )


def far_edges(nodes: np.ndarray) -> np.ndarray:
    """Whether a node is of the leftmost column or the bottommost row, (K,).

    In the paper's layout that is x = 3 or y = 26, the edges away from the charging zone.

    Args:
        nodes: (K, 2) cells x, y; y grows south.
    """
    return np.asarray((nodes[:, 0] == nodes[:, 0].min()) | (nodes[:, 1] == nodes[:, 1].max()))


def division(data: np.ndarray) -> float:
    """The share of the data that came from the UAV which served the node most.

    1 if every node is served by one UAV alone; 1 / I if all UAVs take as much from every node.
    Nodes count by the data collected from them. Nan if nothing was collected.

    Args:
        data: (I, K) as of ``collected``.
    """
    total = data.sum()
    return float(data.max(axis=0).sum() / total) if total else np.nan


def sectors(data: np.ndarray, nodes: np.ndarray) -> float:
    """The share of the data that two UAVs collected each from a sector of its own.

    The sectors are the two sides of a straight line, the best one for the share. 1 if a line parts
    the nodes of the one from those of the other; 0.5 at least. Nan if nothing was collected.

    Args:
        data: (2, K) as of ``collected``.
        nodes: (K, 2) cells x, y.
    """
    total = data.sum()
    if not total:
        return np.nan
    orders = np.array([np.argsort(nodes @ way, kind="stable") for way in _directions(nodes)])
    # What the first UAV collects before the line and the second behind it, for every line.
    lead = np.cumsum((data[0] - data[1])[orders], axis=1)
    own_side = data[1].sum() + np.concatenate([lead.ravel(), [0.0]])
    return float(max(own_side.max(), total - own_side.min()) / total)


def _directions(nodes: np.ndarray) -> np.ndarray:
    """Directions (D, 2), one for every order in which lines across them meet the nodes.

    The order changes where two nodes are level; the directions lie between those changes.
    """
    one, other = np.triu_indices(len(nodes), 1)
    gaps = (nodes[other] - nodes[one])[(nodes[other] != nodes[one]).any(axis=1)]
    turns = np.unique(np.round(np.arctan2(gaps[:, 0], -gaps[:, 1]) % np.pi, 9))
    turns = turns if turns.size else np.zeros(1)
    between = turns + np.diff(turns, append=turns[0] + np.pi) / 2
    return np.column_stack([np.cos(between), np.sin(between)])


def _of_nodes(events: Events, names: Sequence[str], nodes: int) -> np.ndarray:
    """The sum of the values of these events at every node, (K,)."""
    log = pd.DataFrame(events)
    at_nodes = log[log["event"].isin(names) & (log["node"] >= 0)]
    return np.bincount(at_nodes["node"].to_numpy(int), at_nodes["value"], minlength=nodes)
