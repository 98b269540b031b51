"""Whether planning beats learning: a planner and a learner in the same missions of a study."""

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import pandas as pd
import seaborn as sns
from matplotlib.figure import Figure

from dess.analysis import numbers
from dess.analysis.answers.missions import data_by_node, data_by_uav_and_node
from dess.analysis.answers.optimality import ALL
from dess.analysis.answers.policies.decision_times import (
    Times,
    decision_time_front,
    plot_decision_times,
)
from dess.analysis.figures import Drawing, name_best_mean, style
from dess.analysis.figures import comparison as figures
from dess.analysis.figures import missions as maps
from dess.analysis.metrics import PRODUCT, RATIO, SUCCESS, metric_of
from dess.analysis.results.event_log import uav_slots
from dess.analysis.results.resimulate import LoggedMission
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import compare, difference_test, differences_of, t_test
from dess.analysis.stats.groups import summary
from dess.analysis.stats.intervals import column_intervals
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import (
    ABOVE,
    BELOW,
    BETTER,
    INCONCLUSIVE,
    NOT_RULED_OUT,
    SEEN_ABOVE,
    SEEN_BELOW,
    SEEN_BETTER,
    SEEN_WORSE,
    WORSE,
    better_or_worse,
    judge_difference,
    judge_intervals,
)
from dess.analysis.tables import BARS
from dess.policies.planner import Course, Planner, first_plan
from dess.policies.registry import load
from dess.scenario.scenario import ScenarioSpace

_CLAIMS = {
    BETTER: "The planner is better",
    SEEN_BETTER: f"The planner is better in what was seen; {NOT_RULED_OUT}",
    WORSE: "The learner is better",
    SEEN_WORSE: f"The learner is better in what was seen; {NOT_RULED_OUT}",
    INCONCLUSIVE: "The missions do not tell which is better",
}


def compare_with_learner(results: Results, planners: Sequence[str], learner: str) -> pd.DataFrame:
    """Planners compared with a learner on the same missions, by number of UAVs and over all.

    Returns:
        A row per policy, number of UAVs (or ``ALL``) and metric (product, success), as
        ``dess.analysis.compare`` returns it, with the column ``uavs``.

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


def planner_sentences(table: pd.DataFrame, planner: str) -> tuple[str, str]:
    """Whether the planner is better than the learner, and by how many points over all missions.

    The number for the index is empty if the missions do not tell which is better.

    Args:
        table: Rows of ``compare_with_learner``.
        planner: The planner.
    """
    rows = table[(table["policy"] == planner) & (table["metric"] == PRODUCT)]
    (overall,) = rows[rows["uavs"] == ALL].itertuples()
    points = numbers.format_points(overall.difference, overall.low, overall.high)
    verdict = better_or_worse(judge_difference(overall), PRODUCT)
    sentence = (
        f"{_CLAIMS[verdict]}: the product of {planner} minus that of "
        f"{overall.baseline} is {points} points over {overall.n:,} missions."
    )
    if verdict == INCONCLUSIVE:
        return sentence, ""
    number = f"{numbers.format_difference(overall.difference, 0)} points"
    if verdict in (SEEN_BETTER, SEEN_WORSE):
        number += " in what was seen"
    return sentence, number


def by_fleet(table: pd.DataFrame) -> Drawing:
    """The differences of the product by number of UAVs.

    Args:
        table: Rows of ``compare_with_learner``.
    """
    rows = table[table["metric"] == PRODUCT]
    names = rows["uavs"].map(
        lambda uavs: uavs if uavs == ALL else numbers.format_count(uavs, "UAV")
    )
    baseline = rows["baseline"].iloc[0]
    return Drawing(
        figures.plot_differences(rows, names, f"Difference from {baseline}"),
        f"Paired differences from {baseline} in the product, by number of UAVs",
        f"{_largest_in_words(rows)} n = {numbers.format_span(rows['n'])} missions; {BARS}",
    )


def _largest_in_words(rows: pd.DataFrame) -> str:
    """The largest difference by number of UAVs, as a sentence."""
    by_fleet = rows[rows["uavs"] != ALL]
    if by_fleet.empty:
        by_fleet = rows
    row = by_fleet.loc[by_fleet["difference"].abs().idxmax()]
    points = numbers.format_points(row["difference"], row["low"], row["high"])
    fleet = "all fleets" if row["uavs"] == ALL else numbers.format_count(row["uavs"], "UAV")
    return f"The largest difference is that of {row['policy']} with {fleet}: {points} points."


def draw_decision_time_front(results: Results, times: Times) -> Drawing:
    """The product against the decision time of every policy whose decisions were timed.

    Its data have a row per policy, the fastest first: ``policy``, ``mean``, ``low`` and ``high`` of
    the product, ``seconds`` (median time of a call for one mission), and ``on_front``: whether no
    other policy is at least as fast and as good, and better in one of the two.
    """
    means = summary(results.missions, by=["policy"]).query("metric == @PRODUCT")
    seconds = {cost.policy: cost.median for cost in times.costs}
    points = decision_time_front(means[["policy", "mean", "low", "high"]], seconds)
    return Drawing(
        plot_decision_times(points),
        "Decision time against the product of all policies, and their Pareto front",
        f"{name_best_mean(points, PRODUCT, ['policy'])}No policy is both faster and better than "
        "one on the line. Medians on one core.",
        points,
    )


def collected_shares(results: Results, policy: str) -> np.ndarray:
    """The (n, K) shares of their data that the nodes lose to a policy, by kept event log."""
    nodes = len(results.scenario().nodes)
    data = [
        (data_by_uav_and_node(log, _count_uavs(log), nodes), data_by_node(log, nodes))
        for log in _event_logs(results, policy)
    ]
    return np.array([of_uavs.sum(axis=0) / of_nodes for of_uavs, of_nodes in data])


def draw_coverage(results: Results, planner: str, learner: str) -> list[Drawing]:
    """Maps of what two policies collect from every node, and of the difference.

    They are of few missions: so what one policy collects has pale colours, and a difference that
    these missions do not show has none.
    """
    shares = {policy: collected_shares(results, policy) for policy in (planner, learner)}
    space = results.scenario()
    missions = len(_logged_replications(results, planner))
    counted = f"means over n = {missions} missions, in percent of the node's data."
    drawings = []
    for policy, of_policy in shares.items():
        title = f"Collected by {policy}"
        figure = node_map(space, title, of_policy.mean(axis=0), depth=style.PALE)
        caption = f"{title}: {counted} {_widths_in_words(of_policy)}"
        drawings.append(Drawing(figure, title, caption))
    title = f"{planner} − {learner}"
    change = shares[planner].mean(axis=0) - shares[learner].mean(axis=0)
    verdicts = judge_nodes(shares[planner], shares[learner])
    depth = np.select([verdicts == INCONCLUSIVE, is_seen(verdicts)], [0.0, style.PALE], 1.0)
    figure = node_map(space, title, change, signed=True, depth=depth)
    caption = f"{title}: {counted} {_verdicts_in_words(verdicts, planner)}"
    return [*drawings, Drawing(figure, title, caption)]


def judge_nodes(shares: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The verdicts on the differences of what is collected from K nodes, which hold together.

    Args:
        shares: (n, K) shares in missions of a policy.
        others: (n, K) those of the policy that it is compared with, in the same missions.

    Returns:
        (K,) of the keys of ``MARKS``.
    """
    metric = replace(metric_of(RATIO), among=shares.shape[1])
    verdicts = []
    for ours, theirs in zip(shares.T, others.T, strict=True):
        whole, _ = difference_test(ours, theirs, metric, LEVEL)
        seen, _ = t_test(differences_of(ours, theirs), metric.level_of_each(LEVEL))
        verdicts.append(judge_intervals(whole, seen))
    return np.array(verdicts, object)


def is_seen(verdicts: np.ndarray) -> np.ndarray:
    """Which verdicts hold in what was seen alone."""
    return np.isin(verdicts.astype(str), (SEEN_ABOVE, SEEN_BELOW))


def _widths_in_words(shares: np.ndarray) -> str:
    """How far the interval of a node's mean reaches, as a sentence on (n, K) shares."""
    table = column_intervals(pd.DataFrame(shares), RATIO)
    below = (table["mean"] - table["low"]).max()
    above = (table["high"] - table["mean"]).max()
    return (
        f"The 95 % interval of a node reaches up to {100 * below:.0f} points below its mean and "
        f"{100 * above:.0f} above it, so the colours are pale."
    )


def _verdicts_in_words(verdicts: np.ndarray, planner: str) -> str:
    """From how many nodes a planner collects more and less, as a sentence on (K,) verdicts."""
    more = np.isin(verdicts.astype(str), (ABOVE, SEEN_ABOVE)).sum()
    less = np.isin(verdicts.astype(str), (BELOW, SEEN_BELOW)).sum()
    text = (
        f"These missions show that {planner} collects more from {more} and less from {less} of "
        f"{len(verdicts)} nodes (all together with 95 %); the others have no colour."
    )
    if is_seen(verdicts).any():
        text += f" Pale: in what was seen; {NOT_RULED_OUT}."
    return text


def node_map(
    space: ScenarioSpace,
    title: str,
    values: np.ndarray,
    signed: bool = False,
    write: Callable[[float], str] = "{:.0%}".format,
    depth: float | np.ndarray = 1.0,
) -> Figure:
    """A map with the nodes of a scenario in the colours of values, which are written at them.

    Args:
        space: The scenario.
        title: The title.
        values: (K,) values, from 0 to 1; or, if ``signed``, differences of any size.
        signed: Whether blue means above 0 and orange below 0, in percentage points.
        write: How other values are written.
        depth: How strong the colours are, or (K,) of each node: from 0, for values that mean
            nothing, to 1.
    """
    depths = np.broadcast_to(depth, len(values))
    if not signed:
        colours = ["white", style.BETTER]
    else:
        colours = [style.WORSE, "white", style.BETTER]
    most = 1.0
    if signed:
        most = max(float(np.abs(values).max()), 0.01)
    with style.new_panels(5.4) as (figure, ax):
        maps.plot_chart(space, ax)
        ax.scatter(*np.transpose(space.nodes), c=values * depths, s=420, zorder=3,
                   edgecolors=style.MUTED,
                   cmap=sns.blend_palette(colours, as_cmap=True), linewidths=0.8,
                   vmin=-most if signed else 0.0, vmax=most)  # fmt: skip
        for cell, value, strength in zip(space.nodes, values, depths, strict=True):
            if signed:
                text = numbers.format_difference(value, 0)
            else:
                text = write(value)
            ink = style.INK if strength else style.MUTED
            ax.annotate(text, cell, ha="center", va="center", fontsize=8.5, zorder=4, color=ink,
                        **style.OUTLINED)  # fmt: skip
        ax.set_title(title)
    return figure


def at_home(results: Results, policies: Sequence[str]) -> Drawing:
    """The share of the UAVs in the charging zone in every slot, over kept event logs.

    Its data have a row per policy and slot: ``policy``, ``slot``, ``share``, and ``n``, the number
    of UAVs whose mission is not over. Slots with less than half of the UAVs of slot 0 have no row.
    """
    zones = results.scenario().chart.zones
    tables = []
    for policy in policies:
        slots = pd.concat([uav_slots(events) for events in _event_logs(results, policy)])
        inside = pd.Series(zones[slots["y"], slots["x"]] >= 0, slots.index)
        rows = inside.groupby(slots["slot"]).agg(share="mean", n="size").reset_index()
        tables.append(rows[rows["n"] >= rows["n"].iloc[0] / 2].assign(policy=policy))
    table = pd.concat(tables, ignore_index=True)
    rows = table.assign(panel=0, **dict.fromkeys(("mean", "low", "high"), table["share"]))
    logged = len(_logged_replications(results, policies[0]))
    weighted = table.assign(inside=table["share"] * table["n"]).groupby("policy", sort=False)
    sums = weighted[["inside", "n"]].sum()
    shares = [
        f"{numbers.format_percent(row.inside / row.n)} with {row.Index}"
        for row in sums.itertuples()
    ]
    return Drawing(
        maps.plot_courses(rows, "policy", "%", {0: "Share of the UAVs in the charging zone"}),
        "The share of the UAVs in the charging zone over the slots",
        f"{numbers.join_words(shares)} of the UAVs are in the zone in a slot, in the mean. n = "
        f"{logged} missions. A UAV that has filled its quota has left the mission.",
        table,
    )


def return_table(results: Results, policies: Sequence[str]) -> pd.DataFrame:
    """When and how UAVs go home: their charging sessions in kept event logs, as a table of text.

    Returns:
        A row per policy: the sessions per UAV, mean slot and battery at the beginning of a session,
        and the number of UAVs.
    """
    rows = []
    for policy in policies:
        logs = _event_logs(results, policy)
        begun = pd.concat([events[events["event"] == "charge_start"] for events in logs])
        uavs = sum(map(_count_uavs, logs))
        slot, battery = begun[["time", "battery"]].mean()
        sessions = f"{len(begun) / uavs:.2f}"
        rows.append((policy, sessions, f"{slot:.1f}", f"{battery:.1f} %", uavs))
    heads = ["Policy", "Sessions per UAV", "Begin in slot", "Battery then", "UAVs"]
    return pd.DataFrame(rows, columns=heads)


def first_logged_mission(results: Results, policy: str) -> LoggedMission:
    """The first mission of the smallest fleet whose event log is kept."""
    missions = results.missions_of(policy).set_index("replication")
    replication = int(missions.loc[[*_logged_replications(results, policy)], "uavs"].idxmin())
    return LoggedMission.of(results, policy, 0, replication)


def draw_plan(results: Results, mission: LoggedMission) -> Drawing:
    """What a planner plans in the first slot of a mission, over the mission as simulated.

    Nothing is simulated. If the policy is no planner, no plan is drawn.
    """
    planner = load(mission.policy)
    courses = list[Course]()
    if isinstance(planner, Planner):
        place = results.store.manifest.seed, mission.replication
        courses = first_plan(results.scenario(), *place, planner)
    with style.new_panels(6.0) as (figure, ax):
        maps.plot_trajectories(mission.events, mission.scenario, ax)
        for uav, course in enumerate(courses):
            colour = style.uav_colours(len(courses))[uav]
            ax.plot(*course.path.T, color=colour, linestyle=(0, (3, 1.5)), linewidth=1.6, zorder=7,
                    gid=f"plan-{uav}", label=f"plan of UAV {uav + 1}")  # fmt: skip
            for number, cell in enumerate(course.waypoints, 1):
                ax.annotate(str(number), cell, xytext=(6, 6), textcoords="offset points",
                            color=colour, fontsize=8, fontweight="bold", zorder=10,
                            **style.OUTLINED)  # fmt: skip
        ax.set_title("The first plan (dashed), and the mission as simulated")
    alt = "The plan of the first slot, over the mission as simulated"
    return Drawing(figure, alt, mission.caption)


def node_prices(results: Results, replication: int) -> np.ndarray:
    """What one more initial data unit at each of the K nodes would add to the bound [data units].

    It is the sum of the prices of the node over all cuts, since data of the first slot count in
    every cut, and at most 1.
    """
    return results.bounds[0, replication].prices.sum(axis=0)


def draw_prices(results: Results, replication: int) -> Drawing:
    """A map of the prices of the nodes' data in the upper bound of a mission.

    Args:
        results: A study with bounds.
        replication: The mission; if it has no bound, the first one that has is taken.
    """
    replications = [number for _, number in results.bounds]
    if replication not in replications:
        replication = replications[0]
    values = node_prices(results, replication)
    return Drawing(
        node_map(results.scenario(), "Price of a node's data", values, write="{:.2f}".format),
        "The price of every node's data in the upper bound",
        f"The highest price is {values.max():.2f}. n = 1, mission {replication}: what one more "
        "data unit would add to the upper bound.",
    )


def _logged_replications(results: Results, policy: str) -> range:
    """The replications whose event logs are kept."""
    first = results.cell(policy, 0).first
    return range(first, first + results.study.logged)


def _event_logs(results: Results, policy: str) -> list[pd.DataFrame]:
    return [results.events(policy, 0, number) for number in _logged_replications(results, policy)]


def _count_uavs(events: pd.DataFrame) -> int:
    return int(events["uav"].max()) + 1
