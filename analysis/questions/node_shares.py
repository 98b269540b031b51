"""How the UAVs of a team share the sensor nodes: what each collects where, and what is left.

From the event log of a mission (``dess.record.EventLog``):

    >>> data = collected(results.events("ddqn", point=1), uavs=2, nodes=25)  # (2, 25)
    >>> division(data), sectors(data, nodes)

Nodes and UAVs are in the order of their indices.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd

from analysis.results.event_log import Events

# A node counts as left behind if less than this share of all its data was collected.
LEFT_BEHIND = 0.5


def collected(events: Events, uavs: int, nodes: int) -> np.ndarray:
    """The (I, K) data that every UAV collected from every node [data units]."""
    log = pd.DataFrame(events)
    served = log[log["event"] == "communication"]
    data = np.zeros((uavs, nodes))
    np.add.at(data, (served["uav"].to_numpy(int), served["node"].to_numpy(int)), served["value"])
    return data


def held(events: Events, nodes: int) -> np.ndarray:
    """The (K,) data of every node in the whole mission: initial and arrived [data units]."""
    return _of_nodes(events, ["mission_start", "arrival"], nodes)


def left_behind(events: Events, nodes: int) -> np.ndarray:
    """For each of the K nodes, whether less than ``LEFT_BEHIND`` of its data was collected."""
    return np.asarray(
        _of_nodes(events, ["communication"], nodes) < LEFT_BEHIND * held(events, nodes)
    )


def far_edges(nodes: np.ndarray) -> np.ndarray:
    """For each of the K nodes, whether it is in the leftmost column or the bottommost row.

    In the paper's layout these are x = 3 and y = 26, the edges far from the charging zone.

    Args:
        nodes: (K, 2) cells x, y; y grows south.
    """
    return np.asarray((nodes[:, 0] == nodes[:, 0].min()) | (nodes[:, 1] == nodes[:, 1].max()))


def division(data: np.ndarray) -> float:
    """The share of the data that was collected by the UAV which serves the node most.

    It is 1 if every node is served by only one UAV, and 1 / I if all UAVs collect the same amount
    from every node. Nodes are weighted by the data collected from them. It is nan if nothing was
    collected.

    Args:
        data: (I, K) result of ``collected``.
    """
    total = data.sum()
    return float(data.max(axis=0).sum() / total) if total else np.nan


def sectors(data: np.ndarray, nodes: np.ndarray) -> float:
    """The share of the data that two UAVs collected, each from its own sector.

    The sectors are the two sides of the straight line that gives the highest share. The share is 1
    if a line separates the nodes of the two UAVs, and it is at least 0.5. It is nan if nothing was
    collected.

    Args:
        data: (2, K) result of ``collected``.
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
    """The (D, 2) directions that order the nodes in all different ways.

    The order along a direction changes where two nodes have the same position on it; the returned
    directions lie between these changes.
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
