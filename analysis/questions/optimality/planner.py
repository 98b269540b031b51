"""A planner beside a learner, in the same missions: who is ahead, where, and at what price in time.

table = differences(results, ["planner"], "ddqn")
answer(table, "planner")
"""

from collections.abc import Sequence
from typing import Any

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.names import PRODUCT, SUCCESS
from analysis.questions import decision_times
from analysis.questions.decision_times import Times
from analysis.questions.missions import LoggedMission, logged_mission
from analysis.questions.node_shares import collected, held
from analysis.questions.optimality.gap import ALL
from analysis.results.event_log import uav_slots
from analysis.results.tables import Results
from analysis.stats.intervals import summary as means_of
from analysis.stats.paired import compare
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE, position
from policies.planner import Course, Planner, first_plan
from policies.registry import load

_CLAIMS = {
    ABOVE: "The planner is better",
    BELOW: "The learner is better",
    INCONCLUSIVE: "The missions do not tell which is better",
}


def differences(results: Results, planners: Sequence[str], learner: str) -> pd.DataFrame:
    """Planners compared with a learner on the same missions, by number of UAVs and over all.

    Returns:
        A row per policy, number of UAVs (or ``ALL``) and metric (product, success), as
        ``analysis.compare`` returns it, with the column ``uavs``.

    Raises:
        InputError: If the study lacks one of the policies.
    """
    for policy in (*planners, learner):
        results.check_policy(policy)
    missions = results.missions[results.missions["policy"].isin([*planners, learner])]
    metrics = [PRODUCT, SUCCESS]
    by_fleet = compare(missions, learner, metrics, by=["uavs"])
    table = pd.concat([by_fleet, compare(missions, learner, metrics).assign(uavs=ALL)])
    order = {"kind": "stable", "key": lambda names: names.map(planners.index)}
    return table.sort_values("policy", ignore_index=True, **order)


def answer(table: pd.DataFrame, planner: str) -> str:
    """Whether the planner is better than the learner, and by how much.

    Args:
        table: Rows of ``differences``.
        planner: The planner.
    """
    rows = _of_product(table, planner)
    (overall,) = rows[rows["uavs"] == ALL].itertuples()
    return (
        f"{_CLAIMS[position(overall)]}: the product of {planner} minus that of {overall.baseline} "
        f"is {_points(overall)} points over {overall.n:,} missions."
    )


def ahead(table: pd.DataFrame, planner: str) -> str:
    """By how many points the planner is ahead over all missions."""
    rows = _of_product(table, planner)
    return f"{numbers.difference(rows.set_index('uavs').loc[ALL, 'difference'], 0)} points"


def _of_product(table: pd.DataFrame, planner: str) -> pd.DataFrame:
    return table[(table["policy"] == planner) & (table["metric"] == PRODUCT)]


def front(results: Results, times: Times) -> pd.DataFrame:
    """The product and the decision time of every policy whose decisions were timed.

    Returns:
        A row per policy, the fastest first: ``policy``, ``mean``, ``low`` and ``high`` of the
        product, ``seconds`` (median time of a call for one mission), and ``on_front``: whether no
        other policy is at least as fast and as good, and better in one of the two.
    """
    means = means_of(results.missions, by=["policy"]).query("metric == @PRODUCT")
    seconds = {cost.policy: cost.median for cost in times.costs}
    return decision_times.front(means[["policy", "mean", "low", "high"]], seconds)


def coverage(results: Results, policy: str) -> np.ndarray:
    """The (K,) mean shares of their data that the nodes lose to a policy, over kept event logs."""
    nodes = len(results.scenario().nodes)
    data = [(collected(log, _uavs(log), nodes), held(log, nodes)) for log in _logs(results, policy)]
    return np.mean([of_uavs.sum(axis=0) / of_nodes for of_uavs, of_nodes in data], axis=0)


def at_home(results: Results, policies: Sequence[str]) -> pd.DataFrame:
    """The share of the UAVs in the charging zone in every slot, over kept event logs.

    Returns:
        A row per policy and slot: ``policy``, ``slot``, ``share``, and ``n``, the number of UAVs
        whose mission is not over. Slots with less than half of the UAVs of slot 0 have no row.
    """
    zones, tables = results.scenario().chart.zones, []
    for policy in policies:
        slots = pd.concat([uav_slots(events) for events in _logs(results, policy)])
        inside = pd.Series(zones[slots["y"], slots["x"]] >= 0, slots.index)
        rows = inside.groupby(slots["slot"]).agg(share="mean", n="size").reset_index()
        tables.append(rows[rows["n"] >= rows["n"].iloc[0] / 2].assign(policy=policy))
    return pd.concat(tables, ignore_index=True)


def returns(results: Results, policies: Sequence[str]) -> pd.DataFrame:
    """When and how UAVs go home: their charging sessions in kept event logs, as a table of text.

    Returns:
        A row per policy: the sessions per UAV, mean slot and battery at the beginning of a session,
        and the number of UAVs.
    """
    rows = []
    for policy in policies:
        logs = _logs(results, policy)
        begun = pd.concat([events[events["event"] == "charge_start"] for events in logs])
        uavs, (slot, battery) = sum(map(_uavs, logs)), begun[["time", "battery"]].mean()
        sessions = f"{len(begun) / uavs:.2f}"
        rows.append((policy, sessions, f"{slot:.1f}", f"{battery:.1f} %", uavs))
    heads = ["Policy", "Sessions per UAV", "Begin in slot", "Battery then", "UAVs"]
    return pd.DataFrame(rows, columns=heads)


def example(results: Results, policy: str) -> LoggedMission:
    """The first mission of the smallest fleet whose event log is kept."""
    missions = results.missions[results.missions["policy"] == policy].set_index("replication")
    replication = int(missions.loc[[*_logged(results, policy)], "uavs"].idxmin())
    return logged_mission(results, policy, 0, replication)


def plan(results: Results, policy: str, replication: int) -> list[Course]:
    """What a planner plans for each UAV in the first slot of a mission; nothing is simulated.

    Empty if the policy is no planner.
    """
    planner = load(policy)
    if not isinstance(planner, Planner):
        return []
    return first_plan(results.scenario(), results.store.manifest.seed, replication, planner)


def node_prices(results: Results, replication: int) -> np.ndarray:
    """What one more initial data unit at each of the K nodes would add to the bound [data units].

    It is the sum of the prices of the node over all cuts, since data of the first slot count in
    every cut, and at most 1.
    """
    return results.bounds[0, replication].prices.sum(axis=0)


def _logged(results: Results, policy: str) -> range:
    """The replications whose event logs are kept."""
    first = results.cell(policy, 0).first
    return range(first, first + results.manifest["study"]["logged"])


def _logs(results: Results, policy: str) -> list[pd.DataFrame]:
    return [results.events(policy, 0, number) for number in _logged(results, policy)]


def _uavs(events: pd.DataFrame) -> int:
    return int(events["uav"].max()) + 1


def _points(row: Any) -> str:
    return numbers.points(row.difference, row.low, row.high)
