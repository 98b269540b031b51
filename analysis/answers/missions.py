"""Missions of a study: which one is typical, its cost in words, and the data of its nodes."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.figures import Drawing
from dess.analysis.metrics import PRODUCT, RATIO
from dess.analysis.results.event_log import Events
from dess.analysis.results.resimulate import LoggedMission, resimulate
from dess.analysis.results.tables import Results
from dess.analysis.sheet import node_titles
from dess.analysis.stats.groups import summary

NEGLECTED = 3  # how many nodes are named of which the least is collected


def shared_collection_sentence(missions: Sequence[LoggedMission]) -> str:
    """What share of the data single missions of fleets collect, and how many UAVs run empty."""
    parts = [
        f"{numbers.format_percent(m.record[RATIO])} with {m.fleet} in {m.record.slots} slots"
        for m in missions
    ]
    empty = sum(int((mission.uavs["end"] == "battery").sum()) for mission in missions)
    run_empty = "No UAV runs"
    if empty:
        run_empty = f"{empty} of {sum(len(mission.uavs) for mission in missions)} UAVs run"
    return (
        f"Of the data, single missions of {missions[0].policy} collect "
        f"{numbers.join_words(parts)}. {run_empty} out of battery in them."
        f"{_left_in_the_air(missions)}"
    )


def _left_in_the_air(missions: Sequence[LoggedMission]) -> str:
    """How many UAVs of missions end without the battery for the way home, in a sentence."""
    stranded = [f"{stranded_uavs(mission)} of {len(mission.uavs)}" for mission in missions]
    if not any(stranded_uavs(mission) for mission in missions):
        return ""
    return (
        f" These missions end where the quotas are filled: {numbers.join_words(stranded)} UAVs end "
        "without the battery for the way home."
    )


def stranded_uavs(mission: LoggedMission) -> int:
    """How many UAVs of a mission end without the battery for the way home."""
    return int((mission.uavs["battery"] < mission.uavs["way_home"]).sum())


_ENDS_IN_WORDS = {
    "battery": "deplete their battery",
    "lost": "are lost",
    "truncated": "run out of time",
}


def end_in_words(mission: LoggedMission) -> str:
    """How the UAVs of a mission end: whether it is a success, and whether they could fly home.

    Args:
        mission: The mission.
    """
    ends = mission.uavs["end"].tolist()
    scenario = mission.scenario
    failures = [
        f"{ends.count(end)} of {len(ends)} UAVs {ended}"
        for end, ended in _ENDS_IN_WORDS.items()
        if end in ends
    ]
    if failures:
        return f"{numbers.join_words(failures)}, so it counts 0"
    text = f"all UAVs {scenario.aim}"
    if scenario.landing:
        return text
    stranded = stranded_uavs(mission)
    if not stranded:
        return f"{text} and have the battery for the way home"
    return f"{text}, but {stranded} of {len(ends)} have no battery left for the way home"


def map_caption(mission: LoggedMission, fleet: str) -> str:
    """The caption of the map of a mission.

    Args:
        mission: The mission.
        fleet: Its fleet in words.
    """
    return (
        f"A mission with the policy {mission.policy} and {fleet}, replication "
        f"{mission.replication}: {end_in_words(mission)}. n = 1."
    )


def neglected_sentence(mission: LoggedMission) -> str:
    """From which ``NEGLECTED`` nodes the least share of their data is collected, in a sentence.

    Args:
        mission: The mission.

    Returns:
        The sentence; empty if no node had data.
    """
    nodes = len(mission.scenario.nodes)
    had = data_by_node(mission.events, nodes)
    collected = of_nodes(mission.events, ["communication"], nodes)
    with_data = np.flatnonzero(had)
    shares = collected[with_data] / had[with_data]
    least = np.argsort(shares, kind="stable")[:NEGLECTED]
    titles = node_titles(mission.scenario, with_data[least].tolist())
    parts = [
        f"{title} ({numbers.format_percent(share)} of its data)"
        for title, share in zip(titles, shares[least], strict=True)
    ]
    if not parts:
        return ""
    return f"Least is collected from {numbers.join_words(parts)}."


def typical_replication(missions: pd.DataFrame, metric: str) -> int:
    """The replication of the mission whose metric is the median, or the next one above it.

    Args:
        missions: Missions of a policy at a design point.
        metric: The column of the metric.
    """
    ordered = missions.sort_values([metric, "replication"], kind="stable")
    return int(ordered["replication"].iloc[len(ordered) // 2])


def keep_logs(
    results: Results,
    wanted: Sequence[tuple[str, int]],
    progress: Callable[[int, int], None],
) -> None:
    """Simulate missions again whose event logs are not there, and keep the logs (``Derived``).

    If the new record of a mission differs from the stored one, because other code simulated it, no
    log is stored. Nor is one of a policy of a Python file, which may be anybody's code.

    Args:
        results: The study.
        wanted: Policies and replications of the missions, at the first design point.
        progress: Called with the number of missions done and of all missions.

    Raises:
        InputError: If a log cannot be written.
    """
    for done, (policy, replication) in enumerate(wanted, 1):
        if _kept_log(results, policy, replication) is None:
            _keep_log(results, policy, replication)
        progress(done, len(wanted))


def kept_missions(results: Results, wanted: Sequence[tuple[str, int]]) -> list[LoggedMission]:
    """Those of the missions whose event logs ``keep_logs`` has stored."""
    return [
        LoggedMission.of(results, policy, 0, replication, log)
        for policy, replication in wanted
        if (log := _kept_log(results, policy, replication)) is not None
    ]


def _keep_log(results: Results, policy: str, replication: int) -> None:
    try:
        events = resimulate(results, policy, 0, replication).events
    except InputError:  # the record is another one, or the policy is a Python file
        return
    results.store.derived.keep_log(results.cell(policy, 0), replication, events)


def _kept_log(results: Results, policy: str, replication: int) -> pd.DataFrame | None:
    return results.store.derived.load_log(results.cell(policy, 0), replication)


def estimate_metric(
    results: Results, policy: str, metric: str = PRODUCT, point: int | None = None
) -> Any:
    """The mean of a metric over the missions of a policy, at one design point or at all.

    Returns:
        A row of ``dess.analysis.summary``.
    """
    missions = results.missions_of(policy)
    if point is not None:
        missions = missions[missions["point"] == point]
    return summary(missions, by=["policy"]).query("metric == @metric").iloc[0]


def draw_mission(mission: LoggedMission, alt: str, caption: str) -> Drawing:
    """The map of a mission and its curves over time.

    Args:
        mission: The mission.
        alt: What the figure shows.
        caption: The text below it.
    """
    from dess.analysis.figures.missions import mission_figure  # figures need the extra reports

    return Drawing(mission_figure(mission.events, mission.scenario), alt, caption)


def beside_paper(results: Results, mission: LoggedMission, printed: float) -> Drawing:
    """A mission, with the mean collection ratio of its policy and the paper's number.

    Args:
        results: The study of the mission.
        mission: The mission.
        printed: The collection ratio that the paper prints.
    """
    mean = estimate_metric(results, mission.policy, RATIO, mission.record.point)
    caption = (
        f"n = 1 mission of {mission.record.slots} slots; {mission.collected}. The mean of this "
        f"policy, n = {mean['n']:,}, is {numbers.format_estimate(mean)}, the paper's "
        f"{numbers.format_percent(printed)}."
    )
    alt = f"Map of the mission with {mission.fleet}; battery, residual data and charging"
    return draw_mission(mission, alt, caption)


def outcome_table(missions: Sequence[LoggedMission]) -> pd.DataFrame:
    """A table to print with a row per mission; data are in data units."""
    return pd.DataFrame([_mission_outcome(mission) for mission in missions])


def _mission_outcome(mission: LoggedMission) -> dict[str, Any]:
    row, log = mission.record, mission.events
    served = log.loc[log["event"] == "communication", "node"].nunique()
    left = log[(log["event"] == "mission_end") & (log["node"] >= 0)]
    fullest = left.loc[left["value"].idxmax()]
    collected, _, total, *_ = mission.collected.split()
    return {
        "UAVs": row["uavs"],
        "Success": numbers.format_truth(row["success"]),
        "UAVs that can fly home": f"{len(mission.uavs) - stranded_uavs(mission)} of {row['uavs']}",
        "Collected": numbers.format_percent(row[RATIO]),
        "Mission slots": row["slots"],
        "Charging sessions": (log["event"] == "charge_start").sum(),
        "Nodes never served": f"{len(left) - served} of {len(left)}",
        "Data collected": f"{collected} of {total}",
        "Data left": f"{max(float(total) - float(collected), 0.0):.1f}",  # as they are printed
        "Fullest node left": f"{fullest['value']:.1f} at ({fullest['x']:.0f}, {fullest['y']:.0f})",
    }


# A node counts as left behind if less than this share of all its data was collected.
LEFT_BEHIND = 0.5


def data_by_uav_and_node(events: Events, uavs: int, nodes: int) -> np.ndarray:
    """The (I, K) data that every UAV collected from every node [data units]."""
    log = pd.DataFrame(events)
    served = log[log["event"] == "communication"]
    data = np.zeros((uavs, nodes))
    np.add.at(data, (served["uav"].to_numpy(int), served["node"].to_numpy(int)), served["value"])
    return data


def data_by_node(events: Events, nodes: int) -> np.ndarray:
    """The (K,) data of every node in the whole mission: initial and arrived [data units]."""
    return of_nodes(events, ["mission_start", "arrival"], nodes)


def left_behind(events: Events, nodes: int) -> np.ndarray:
    """For each of the K nodes, whether less than ``LEFT_BEHIND`` of its data was collected."""
    return np.asarray(
        of_nodes(events, ["communication"], nodes) < LEFT_BEHIND * data_by_node(events, nodes)
    )


def far_edges(nodes: np.ndarray) -> np.ndarray:
    """For each of the K nodes, whether it is in the leftmost column or the bottommost row.

    In the paper's layout these are x = 3 and y = 26, the edges far from the charging zone.

    Args:
        nodes: (K, 2) cells x, y; y grows south.
    """
    return np.asarray((nodes[:, 0] == nodes[:, 0].min()) | (nodes[:, 1] == nodes[:, 1].max()))


def share_of_main_uav(data: np.ndarray) -> float:
    """The share of the data that was collected by the UAV which serves the node most.

    It is 1 if every node is served by only one UAV, and 1 / I if all UAVs collect the same amount
    from every node. Nodes are weighted by the data collected from them. It is nan if nothing was
    collected.

    Args:
        data: (I, K) result of ``data_by_uav_and_node``.
    """
    total = data.sum()
    if total:
        return float(data.max(axis=0).sum() / total)
    return np.nan


def share_in_own_sector(data: np.ndarray, nodes: np.ndarray) -> float:
    """The share of the data that two UAVs collected, each from its own sector.

    The sectors are the two sides of the straight line that gives the highest share. The share is 1
    if a line separates the nodes of the two UAVs, and it is at least 0.5. It is nan if nothing was
    collected.

    Args:
        data: (2, K) result of ``data_by_uav_and_node``.
        nodes: (K, 2) cells x, y.
    """
    total = data.sum()
    if not total:
        return np.nan
    orders = np.array(
        [np.argsort(nodes @ way, kind="stable") for way in _ordering_directions(nodes)]
    )
    # What the first UAV collects before the line and the second behind it, for every line.
    lead = np.cumsum((data[0] - data[1])[orders], axis=1)
    own_side = data[1].sum() + np.concatenate([lead.ravel(), [0.0]])
    return float(max(own_side.max(), total - own_side.min()) / total)


def _ordering_directions(nodes: np.ndarray) -> np.ndarray:
    """The (D, 2) directions that order the nodes in all different ways.

    The order along a direction changes where two nodes have the same position on it; the returned
    directions lie between these changes.
    """
    first, second = np.triu_indices(len(nodes), 1)
    gaps = (nodes[second] - nodes[first])[(nodes[second] != nodes[first]).any(axis=1)]
    turns = np.unique(np.round(np.arctan2(gaps[:, 0], -gaps[:, 1]) % np.pi, 9))
    turns = turns if turns.size else np.zeros(1)
    between = turns + np.diff(turns, append=turns[0] + np.pi) / 2
    return np.column_stack([np.cos(between), np.sin(between)])


def of_nodes(events: Events, names: Sequence[str], nodes: int) -> np.ndarray:
    """The sum of the values of these events at each of the K nodes, (K,)."""
    log = pd.DataFrame(events)
    at_nodes = log[log["event"].isin(names) & (log["node"] >= 0)]
    return np.bincount(at_nodes["node"].to_numpy(int), at_nodes["value"], minlength=nodes)
