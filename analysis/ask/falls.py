"""Where one more UAV or pad collects less, and why: the policy's doing, not the fleet's.

fall_facts(results)  # results of a search, of which ``around.question_around`` was asked
draw_falls(results)
setting_fall_facts(results)  # of settings that differ in UAVs or pads

Of a search, event logs of few missions say what the UAVs do instead.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.settings.points import values_of_points
from dess.analysis.ask import around
from dess.analysis.facts import Fact, known_facts
from dess.analysis.figures import Drawing
from dess.analysis.flights.phases import ACTIVITIES, share_of_activities
from dess.analysis.metrics import NODE_RATIOS, RATIO, metric_of
from dess.analysis.names import field_named
from dess.analysis.results.resimulate import LoggedMission, resimulate
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.sheet import node_titles
from dess.analysis.stats.corrections import for_choice
from dess.analysis.stats.differences import Paired, compare, compare_pairs, differences_of, t_test
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.rows import group_rows
from dess.analysis.stats.verdict import (
    BELOW,
    INCONCLUSIVE,
    NOT_RULED_OUT,
    SEEN_WORSE,
    WORSE,
    better_or_worse,
    judge_by_tests,
    judge_difference,
    position_of,
)
from dess.analysis.stats.weights import by_replication
from dess.scenario.data_sheet import Units
from dess.scenario.fields import ZONE_PADS, is_number
from dess.scenario.quantities import printed

MISSIONS = 10  # of the fleet, and of each neighbour that collects less
LITTLE = 0.005  # a fall of the collection ratio in a sweep that is not worth a word
NAMED = 3  # the largest number of activities that a fact names


@dataclass(frozen=True, eq=False, kw_only=True)
class Fall:
    """A fleet that collects less than one that has fewer UAVs or pads.

    Attributes:
        fleet: What is more, as ``3 UAVs``.
        before: The same of the other fleet, as ``2 UAVs``.
        policy: Who flies.
        difference: The paired difference of the collection ratio, as ``compare`` returns it.
        is_certain: Whether a rare failure is ruled out as its cause.
        others: Of how many further settings the same is true.
    """

    fleet: str
    before: str
    policy: str
    difference: pd.Series
    is_certain: bool
    others: int = 0

    @property
    def where(self) -> str:
        """The two fleets in words."""
        return f"{self.fleet} instead of {self.before}"

    def facts(self) -> list[Fact]:
        """How much less is collected, what the UAVs do instead if it is known, and the cause."""
        metric = metric_of(RATIO)
        change = metric.change(*self.difference[["difference", "low", "high"]])
        text = f"{metric.within} {change} points"
        if not self.is_certain:
            text += f" in what was seen ({NOT_RULED_OUT})"
        if self.others:
            text += f"; less with more also in {numbers.format_count(self.others, 'other pair')}"
        cause = (
            f"{self.policy} and its return guard, not the fleet, which could leave unused what is "
            "added"
        )
        return known_facts(
            [
                Fact(f"{self.where}, with {self.policy}", text),
                *self._done_instead(),
                Fact(f"{self.where}: cause", cause),
            ]
        )

    def _done_instead(self) -> list[Fact]:
        """What the UAVs do instead; nothing without event logs."""
        return []


@dataclass(frozen=True, eq=False, kw_only=True)
class LoggedFall(Fall):
    """A neighbour of the cheapest fleet that collects less than the fleet, with event logs.

    Attributes:
        shares: (MISSIONS, activities) the shares of time.
        shares_before: The same of the fleet, in the same missions.
        last_data: (MISSIONS,) when the last data are collected [slots].
        last_data_before: The same of the fleet.
        nodes: (n, K) the share of the data of each node that is collected in each mission; none in
            results of earlier versions.
        nodes_before: The same of the fleet.
        titles: What the nodes are called.
        units: What a slot is, of missions with a data sheet.
    """

    shares: pd.DataFrame
    shares_before: pd.DataFrame
    last_data: np.ndarray
    last_data_before: np.ndarray
    nodes: np.ndarray
    nodes_before: np.ndarray
    titles: list[str]
    units: Units | None

    def _done_instead(self) -> list[Fact]:
        """What the UAVs do with their time, when they collect last, which node loses most."""
        return [
            Fact(f"{self.where}: time of a UAV", ", ".join(self._changes_of_time())),
            Fact(f"{self.where}: last data", self._last_data()),
            Fact(f"{self.where}: node that loses most", self._worst_node()),
        ]

    def _last_data(self) -> str:
        """When the last data of a mission are collected, if earlier than before.

        The shares of time do not tell it: UAVs may charge as long as before, but all at the end.
        """
        change, _ = t_test(differences_of(self.last_data, self.last_data_before), LEVEL)
        if position_of(change) != BELOW:
            return ""
        last = self._time_in_words(self.last_data.mean())
        return f"after {last}, not {self._time_in_words(self.last_data_before.mean())}"

    def _time_in_words(self, slots: float) -> str:
        if self.units is None:
            return f"{slots:.1f} mission slots"
        return printed(slots * self.units.slot, "s")

    def _worst_node(self) -> str:
        """The node that loses most, if the missions show that it does."""
        if not len(self.nodes):
            return ""
        node = int((self.nodes - self.nodes_before).mean(axis=0).argmin())
        metric = replace(metric_of(RATIO), among=self.nodes.shape[1])
        differences = differences_of(self.nodes[:, node], self.nodes_before[:, node])
        change, _ = t_test(differences, metric.level_of_each(LEVEL))
        if position_of(change) != BELOW:
            return ""
        share = numbers.format_percent(self.nodes[:, node].mean())
        share_before = numbers.format_percent(self.nodes_before[:, node].mean())
        return (
            f"{self.titles[node]}, {share} of its data, not {share_before} "
            f"({metric.change(*change)} points)"
        )

    def _changes_of_time(self) -> list[str]:
        """The activities whose shares of time differ most, with their means."""
        changes = []
        for activity in ACTIVITIES:
            now = self.shares[activity].to_numpy()
            before = self.shares_before[activity].to_numpy()
            change, _ = t_test(differences_of(now, before), LEVEL)
            if position_of(change) != INCONCLUSIVE:
                share = numbers.format_percent(now.mean())
                share_before = numbers.format_percent(before.mean())
                changes.append((abs(change.mean), f"{activity} {share}, not {share_before}"))
        changes.sort(reverse=True)
        return [text for _, text in changes[:NAMED]]


def find_falls(results: Results) -> list[LoggedFall]:
    """The neighbours that collect significantly less than the cheapest fleet.

    Args:
        results: The study; there are none if ``around.question_around`` was not asked about it.

    Raises:
        InputError: If a mission simulated again differs from the stored one.
    """
    if not around.is_known(results) or results.study.years:  # years have no event logs
        return []
    return _compare_neighbours(results)


@compute_once  # since the facts and the figure of a page need the same missions
def _compare_neighbours(results: Results) -> list[LoggedFall]:
    changed_results = around.load_around(results)
    space = changed_results.scenario(0)
    differences = compare(changed_results.missions, 0, [RATIO], correction=None, of="point")
    differences = differences.set_index("point")
    falls = []
    for point, change in enumerate(around.list_changes(changed_results), 1):
        verdict = better_or_worse(judge_difference(differences.loc[point]), RATIO)
        if verdict not in (WORSE, SEEN_WORSE):
            continue
        shares, last_data = _measure_times(changed_results, point)
        shares_before, last_data_before = _measure_times(changed_results, 0)
        falls.append(
            LoggedFall(
                fleet=around.change_in_words(space, change),
                before=around.change_in_words(space, _change_back(change)),
                policy=changed_results.policies[0],
                difference=differences.loc[point],
                is_certain=verdict == WORSE,
                shares=shares,
                shares_before=shares_before,
                last_data=last_data,
                last_data_before=last_data_before,
                nodes=_ratios_of_nodes(changed_results, point),
                nodes_before=_ratios_of_nodes(changed_results, 0),
                titles=node_titles(space, range(len(space.nodes))),
                units=space.units,
            )
        )
    return falls


def fall_facts(results: Results) -> list[Fact]:
    """The facts of each neighbour that collects less; none if there is no such neighbour."""
    return [fact for fall in find_falls(results) for fact in fall.facts()]


def setting_fall_facts(results: Results) -> list[Fact]:
    """The facts of the largest falls of each policy; none if nothing falls."""
    return [fact for fall in find_setting_falls(results) for fact in fall.facts()]


@compute_once
def find_setting_falls(results: Results) -> list[Fall]:
    """Where settings collect significantly less than those with the next fewer UAVs or pads.

    The p-values are corrected for all pairs of settings (Bonferroni), of which only those that fall
    are tested. Where missions have a quota, a UAV
    that is added cannot stay unused, so that nothing is said.

    Args:
        results: A study whose numbers of missions do not depend on their results.

    Returns:
        For each policy, and of UAVs, pads and the pads of further zones, the pair with the largest
        fall.
    """
    spaces = results.store.manifest.scenarios
    if results.study.selection or any(space.quota for space in spaces):
        return []
    pairs = _pairs_with_more(results)
    missions = results.missions
    rows = []
    for policy, of_policy in missions.groupby("policy", sort=False):
        wide = by_replication(of_policy, RATIO, "point")
        for field, fewer, more in pairs:
            values = wide.reindex(columns=[more, fewer]).dropna().to_numpy(float)
            if len(values) > 1 and values[:, 0].mean() < values[:, 1].mean() - LITTLE:
                change = compare_pairs(values[:, 0], values[:, 1], metric=RATIO)
                rows.append((policy, field, fewer, more, *change))
    columns = ["policy", "field", "fewer", "more", *Paired._fields]
    table = pd.DataFrame(rows, columns=columns)
    if table.empty:
        return []
    table = table.assign(p_adjusted=table["p"], p_student_adjusted=table["p_student"])
    table = for_choice(table, len(pairs) * missions["policy"].nunique())
    table["verdict"] = [better_or_worse(verdict, RATIO) for verdict in judge_by_tests(table)]
    worse = table[table["verdict"].isin([WORSE, SEEN_WORSE])]
    falls = []
    for (policy, _), of_field in worse.groupby(["policy", "field"], sort=False):
        row = of_field.loc[of_field["difference"].idxmin()]
        fleet, before = _settings_in_words(results, row)
        falls.append(
            Fall(
                fleet=fleet,
                before=before,
                policy=str(policy),
                difference=row,
                is_certain=row["verdict"] == WORSE,
                others=len(of_field) - 1,
            )
        )
    return falls


def _pairs_with_more(results: Results) -> list[tuple[str, int, int]]:
    """The field, and the design points with fewer and with the next more, all else the same."""
    table = values_of_points(results)
    pairs = []
    for field in ("uavs", "pads", ZONE_PADS):
        if field not in table or not table[field].map(is_number).all():
            continue
        for _, rows in group_rows(table, [other for other in table if other != field]):
            points = rows.sort_values(field, kind="stable").index
            pairs += [(field, *pair) for pair in pairwise(points)]
    return pairs


def _settings_in_words(results: Results, row: pd.Series) -> tuple[str, str]:
    """The two settings of a pair: with more, and with fewer and what both have beside it."""
    field = row["field"]
    values = values_of_points(results).to_dict("records")
    space = results.scenario(row["more"])
    more, fewer = (
        around.change_in_words(space, {field: values[row[point]][field]})
        for point in ("more", "fewer")
    )
    both = [
        field_named(str(name)).words(value)
        for name, value in values[row["more"]].items()
        if name != field
    ]
    if both:
        fewer += f" ({', '.join(both)})"
    return more, fewer


def draw_falls(results: Results) -> list[Drawing]:
    """The shares of time of the fleet and of its neighbours that collect less.

    Returns:
        One figure; none if no neighbour collects less.
    """
    falls = find_falls(results)
    if not falls:
        return []
    from dess.analysis.figures.style import plot_parts  # figures need the extra reports

    rows = {"the fleet": falls[0].shares_before.mean()}
    rows |= {fall.fleet: fall.shares.mean() for fall in falls}
    figure = plot_parts(pd.DataFrame(rows).T, "share of the time of a UAV")
    fleets = numbers.join_words([fall.fleet for fall in falls])
    caption = (
        f"What a UAV does with its time in the fleet of the answer and with {fleets}, which "
        f"collect{'s' if len(falls) == 1 else ''} less. Means of n = {MISSIONS} missions of each "
        "with common random numbers, from their event logs. Under repair, or after the end of its "
        "own mission, a UAV stands."
    )
    alt = "Bars of the shares of time, for the fleet and for each that collects less"
    return [Drawing(figure, alt, caption)]


def _change_back(change: dict[str, int]) -> dict[str, int]:
    """What the fleet has in the place of one more."""
    return {field: value - 1 for field, value in change.items()}


def _ratios_of_nodes(results: Results, point: int) -> np.ndarray:
    """(n, K) the share of the data of each node that is collected in each mission of a point."""
    missions = results.missions[results.missions["point"] == point]
    if NODE_RATIOS not in missions:
        return np.array([])
    return np.stack([*missions.sort_values("replication")[NODE_RATIOS]])


def _first_missions(results: Results, point: int) -> Iterator[LoggedMission]:
    """The first missions of a design point, simulated again."""
    policy = results.policies[0]
    missions = results.missions_of(policy)
    replications = sorted(missions.loc[missions["point"] == point, "replication"])[:MISSIONS]
    for replication in replications:
        yield resimulate(results, policy, point, replication)


@compute_once  # the fleet is compared with each of its neighbours
def _measure_times(results: Results, point: int) -> tuple[pd.DataFrame, np.ndarray]:
    """The shares of time in the first missions of a design point, and when they collect last."""
    shares = []
    last = []
    for mission in _first_missions(results, point):
        log = pd.DataFrame(mission.events)
        shares.append(share_of_activities(log, mission.scenario))
        last.append(log.loc[log["event"] == "communication", "time"].max())
    return pd.DataFrame(shares), np.array(last)
