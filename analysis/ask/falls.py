"""Why one more UAV or pad of the cheapest fleet collects less, from event logs of few missions.

fall_facts(results)  # results of a search, of which ``around.question_around`` was asked
draw_falls(results)
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.ask import around
from dess.analysis.facts import Fact, known_facts
from dess.analysis.figures import Drawing
from dess.analysis.flights.phases import ACTIVITIES, share_of_activities
from dess.analysis.metrics import NODE_RATIOS, RATIO, metric_of
from dess.analysis.results.resimulate import LoggedMission, resimulate
from dess.analysis.results.tables import Results, compute_once
from dess.analysis.sheet import node_titles
from dess.analysis.stats.differences import compare, differences_of, t_test
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import (
    BELOW,
    INCONCLUSIVE,
    NOT_RULED_OUT,
    SEEN_WORSE,
    WORSE,
    better_or_worse,
    judge_difference,
    position_of,
)
from dess.scenario.data_sheet import Units
from dess.scenario.quantities import printed

MISSIONS = 10  # of the fleet, and of each neighbour that collects less
NAMED = 3  # the largest number of activities that a fact names


@dataclass(frozen=True, eq=False)
class Fall:
    """A neighbour of the cheapest fleet that collects less than the fleet.

    Attributes:
        fleet: What is one more, as ``3 UAVs``.
        before: The same of the fleet, as ``2 UAVs``.
        policy: Who flies.
        difference: The paired difference of the collection ratio, as ``compare`` returns it.
        is_certain: Whether a rare failure is ruled out as its cause.
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

    fleet: str
    before: str
    policy: str
    difference: pd.Series
    is_certain: bool
    shares: pd.DataFrame
    shares_before: pd.DataFrame
    last_data: np.ndarray
    last_data_before: np.ndarray
    nodes: np.ndarray
    nodes_before: np.ndarray
    titles: list[str]
    units: Units | None

    def facts(self) -> list[Fact]:
        """How much less is collected, what the UAVs do instead, which node loses most, and why."""
        metric = metric_of(RATIO)
        change = metric.change(*self.difference[["difference", "low", "high"]])
        doubt = ""
        if not self.is_certain:
            doubt = f" in what was seen ({NOT_RULED_OUT})"
        where = f"{self.fleet} instead of {self.before}"
        return known_facts(
            [
                Fact(f"{where}, with {self.policy}", f"{metric.within} {change} points{doubt}"),
                Fact(f"{where}: time of a UAV", ", ".join(self._changes_of_time())),
                Fact(f"{where}: last data", self._last_data()),
                Fact(f"{where}: node that loses most", self._worst_node()),
                Fact(
                    f"{where}: cause",
                    f"{self.policy} and its return guard, not the fleet, which could leave unused "
                    "what is added",
                ),
            ]
        )

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


def find_falls(results: Results) -> list[Fall]:
    """The neighbours that collect significantly less than the cheapest fleet.

    Args:
        results: The study; there are none if ``around.question_around`` was not asked about it.

    Raises:
        InputError: If a mission simulated again differs from the stored one.
    """
    if not around.is_known(results):
        return []
    return _compare_neighbours(results)


@compute_once  # since the facts and the figure of a page need the same missions
def _compare_neighbours(results: Results) -> list[Fall]:
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
            Fall(
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
