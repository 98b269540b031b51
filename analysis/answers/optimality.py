"""How near policies come to the upper bound, and to the planner."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.answers import comparison, summary
from analysis.answers.comparison import Times
from analysis.answers.missions import collected, held
from analysis.names import BOUND, GAP, PRODUCT, SUCCESS
from analysis.results.chunks import MANIFEST
from analysis.results.event_log import uav_slots
from analysis.results.resimulate import Mission
from analysis.results.tables import Results, load_results
from analysis.stats.differences import compare
from analysis.stats.intervals import summary as means_of
from analysis.stats.verdict import ABOVE, BELOW, INCONCLUSIVE, position
from policies.planner import Course, Planner, first_plan
from policies.registry import load

NOT_RUN = (
    "How far the policies are from the best possible is not known here: `dess study run gap` "
    "computes an upper bound of every mission."
)
ALL = "all"  # in place of a number of UAVs: the missions of fleets of any size
_SHOWN = {PRODUCT: "Product", BOUND: "Upper bound", GAP: "Gap [points]"}


_SAYS_NOTHING = 0.999  # a mean bound from which on it is not below 100 % as pages print it


def results_in(folder: Path) -> Results | None:
    """The results of the study in a folder; None if it has not been run."""
    return load_results(folder) if (folder / MANIFEST).exists() else None


def by_fleet(results: Results) -> pd.DataFrame:
    """The product, the upper bound and the gap of every policy, by number of UAVs and over all.

    Returns:
        A row per number of UAVs (or ``ALL``) and policy: ``uavs``, ``policy``, ``n`` missions, and
        for each of the columns ``collection_ratio_and_communication``, ``upper_bound`` and
        ``optimality_gap`` its mean, with its 95 % interval in ``NAME_low`` and ``NAME_high``. Empty
        if the study has no bounds.
    """
    if not results.bounds:
        return pd.DataFrame()
    overall = means_of(results.missions, by=["policy"]).assign(uavs=ALL)
    fleets = summary.by_fleet(results.missions).sort_values("uavs", kind="stable")
    rows = pd.concat([fleets, overall] if fleets["uavs"].nunique() > 1 else [fleets])
    keys = ["uavs", "policy", "n"]
    table = rows.drop_duplicates(keys)[keys]
    for metric in _SHOWN:
        names = {"mean": metric, "low": f"{metric}_low", "high": f"{metric}_high"}
        of_metric = rows[rows["metric"] == metric].rename(columns=names)
        table = table.merge(of_metric[[*keys, *names.values()]])
    return table.assign(**{f"{BOUND}_high": table[f"{BOUND}_high"].clip(upper=1.0)})


def listed(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of ``by_fleet`` as a table of text."""
    columns = {"Policy": table["policy"], "UAVs": table["uavs"].astype(str)}
    columns["Missions"] = table["n"].map("{:,}".format)
    for metric, head in _SHOWN.items():
        write = _points if metric == GAP else numbers.interval
        columns[head] = numbers.estimates(table, metric, write)
    return pd.DataFrame(columns)


def useful(table: pd.DataFrame) -> pd.DataFrame:
    """The rows of ``by_fleet`` of fleets whose bound says something: it is below 100 %."""
    return table[(table["uavs"] != ALL) & (table[BOUND] < _SAYS_NOTHING)]


def in_words(results: Results, policy: str | None = None) -> str:
    """How far a policy is from the best possible at most, for fleets with a useful bound.

    Args:
        results: A study with bounds.
        policy: The policy; by default the best of the study.
    """
    policy = policy or summary.best_policy(results.missions)
    table = by_fleet(results)
    found = useful(table)
    rows = found[found["policy"] == policy]
    parts = [
        f"{100 * row[f'{GAP}_high']:.1f} points with {numbers.counted(row['uavs'], 'UAV')} "
        f"(mean gap {_points(*row[[GAP, f'{GAP}_low', f'{GAP}_high']])})"
        for _, row in rows.iterrows()
    ]
    others = sorted({*table["uavs"]} - {*found["uavs"], ALL})
    text = f"`{policy}` is at most {numbers.words(parts)} from the best possible. " if parts else ""
    if others:
        fleets = numbers.words([numbers.counted(int(uavs), "UAV") for uavs in others])
        text += f"The upper bound is 100 % for {fleets}, so there is no useful bound."
    return text.strip()


def _points(mean: float, low: float, high: float) -> str:
    """A gap in points, as ``4.6 [4.1, 5.1]``."""
    return numbers.points(mean, low, high).replace("+", "")


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
        f"is {_difference(overall)} points over {overall.n:,} missions."
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
    return comparison.front(means[["policy", "mean", "low", "high"]], seconds)


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


def example(results: Results, policy: str) -> Mission:
    """The first mission of the smallest fleet whose event log is kept."""
    missions = results.missions[results.missions["policy"] == policy].set_index("replication")
    replication = int(missions.loc[[*_logged(results, policy)], "uavs"].idxmin())
    return Mission.of(results, policy, 0, replication)


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


def _difference(row: Any) -> str:
    return numbers.points(row.difference, row.low, row.high)
