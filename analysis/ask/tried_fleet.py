"""A cheapest fleet in its scenario made harder: what is left of its requirements there."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from dess import InputError, simulate, simulate_batch
from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.requirements import requirements_of
from dess.analysis.ask.limits import SHEET
from dess.analysis.metrics import NODES_BEHIND, columns_in_units
from dess.analysis.results.parquet import columns_of_nodes
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.verdict import Verdict, judge_margins
from dess.analysis.stats.weights import values_within
from dess.analysis.study.fields import CHECK
from dess.model.events import Event
from dess.model.record import Records
from dess.policies.registry import load_team
from dess.scenario.scenario import ScenarioSpace, load_scenario

_LOST = 8  # missions with a lost UAV that are looked at for the place of the loss
_MORE_MISSIONS = 3  # times as many for failures


@dataclass(frozen=True)
class Trial:
    """What is left of the requirements in a scenario, each as a share of its bound.

    Attributes:
        margins: How far the mean of every metric is on the right side of its bound; empty if the
            data sheet does not allow the scenario.
        errors: Half the 95 % intervals of the changes of the means.
    """

    margins: Mapping[str, float] = field(default_factory=dict)
    errors: Mapping[str, float] = field(default_factory=dict)

    @property
    def room(self) -> float:
        """The least margin."""
        return min(self.margins.values(), default=-math.inf)

    def judge(self, metric: str) -> Verdict:
        """Whether the requirement on a metric is met, by the interval of its change."""
        margin = self.margins[metric]
        error = self.errors[metric]
        return judge_margins(margin - error, margin + error)

    @property
    def broken(self) -> str:
        """The metric whose requirement breaks most; empty if all are kept."""
        if not self.margins:
            return SHEET
        if judge_margins(self.room, self.room) == Verdict.MET:
            return ""
        return min(self.margins, key=self.margins.__getitem__)


class Flights(NamedTuple):
    """Missions with a rate of failures.

    Attributes:
        rate: The rate [1/h of flying].
        hours: (N,) how long all UAVs of a mission were in the air together [h].
        failures: (N,) how many of them have failed.
        metrics: The metrics of the missions.
    """

    rate: float
    hours: np.ndarray
    failures: np.ndarray
    metrics: pd.DataFrame

    def values(self, column: str) -> np.ndarray:
        """(N, K) the values of a metric: of all K nodes, or one of each mission."""
        nodes = NODES_BEHIND.get(column)
        if nodes is None:
            return self.metrics[column].to_numpy(float)[:, None]
        return np.stack(self.metrics[nodes].to_numpy())

    def without(self, row: int) -> "Flights":
        """All missions but one."""
        hours, failures = (np.delete(values, row) for values in (self.hours, self.failures))
        return Flights(self.rate, hours, failures, self.metrics.drop(index=row))


class TriedFleet:
    """The cheapest fleet, and what breaks if its scenario changes.

    Attributes:
        space: Its scenario.
        checks: The missions that check it.
        missions: How many of them are simulated for every change.
    """

    def __init__(
        self,
        results: Results,
        scenario: str,
        workers: int,
        progress: Callable[[int], object] | None,
        missions: int,
    ):
        best = search_of(results).best
        point = best.points[-1]
        manifest = results.store.manifest
        checks = results.checks
        self.space = results.scenario(point)
        self.checks = checks[(checks["policy"] == best.policy) & (checks["point"] == point)]
        self.missions = min(missions, len(self.checks))
        self.requirements = requirements_of(results)
        self._scenario = scenario
        self._values = manifest.study.set | manifest.points[point].values
        self._seed = manifest.seed
        self._team = load_team(best.policy, self.space.uavs[1])
        self._workers = workers
        self._progress = progress

    def load(self, change: dict[str, Any]) -> ScenarioSpace:
        """The scenario with a change.

        Raises:
            InputError: If it is not allowed.
        """
        return load_scenario(self._scenario, **(self._values | change))

    def fly_with_failures(self, rate: float) -> Flights:
        """The first missions of the check with a rate of failures [1/h of flying]."""
        space = self.load({"data_sheet.mtbf": f"{1 / rate:.9f} h"})
        missions = min(_MORE_MISSIONS * self.missions, len(self.checks))
        [records] = self._fly_all([space], missions)
        assert space.units
        hours = records.uavs["slots_flying"].sum(axis=1) * space.units.slot / 3600
        failures = records.operations["failures"].astype(float)
        return Flights(rate, hours, failures, _table_of(space, records))

    def try_changes(self, changes: Sequence[dict[str, Any]]) -> list[Trial]:
        """What is left of the requirements with each of these changes of the scenario."""
        spaces = {}
        for number, change in enumerate(changes):
            try:
                spaces[number] = self.load(change)
            except InputError:  # such as a wind against which UAVs cannot fly
                continue
        trials = [Trial()] * len(changes)
        flown = self._fly_all([*spaces.values()], self.missions)
        for (number, space), records in zip(spaces.items(), flown, strict=True):
            trials[number] = self.trial_of(_table_of(space, records))
        return trials

    def small_zone_of_losses(self, change: dict[str, Any]) -> str:
        """The zone with fewer cells than UAVs at which a change loses UAVs, in words.

        It is empty if some UAV is lost nearer to a zone with a cell for each, or none is lost.
        """
        space = self.load(change)
        sizes = space.chart.sizes
        uavs = space.uavs[1]
        if sizes.min() >= uavs:
            return ""
        [records] = self._fly_all([space], self.missions)
        lost = np.flatnonzero(records.uavs["down"].any(axis=1))[:_LOST]
        zones = set()
        for number in lost:
            log = simulate(space, self._team, self._seed, CHECK + int(number), events=True).events
            assert log is not None
            zones |= {_nearest_zone(space, row) for row in log if row.event == "battery_empty"}
        if not zones or any(sizes[zone] >= uavs for zone in zones):
            return ""
        zone = min(zones)
        cells = numbers.format_count(int(sizes[zone]), "cell")
        return f"zones.{zone - 1}, which has {cells} for {uavs} UAVs"

    def _fly_all(self, spaces: Sequence[ScenarioSpace], missions: int) -> list[Records]:
        """The first missions of the check in each of these scenarios."""
        records = simulate_batch(
            [space for space in spaces for _ in range(missions)],
            self._team,
            self._seed,
            [*range(CHECK, CHECK + missions)] * len(spaces),
            workers=self._workers,
            progress=self._progress,
        )
        firsts = range(0, missions * len(spaces), missions)
        return [Records(*(part[first : first + missions] for part in records)) for first in firsts]

    def trial_of(self, missions: pd.DataFrame) -> Trial:
        """What is left of the requirements in missions that are those of the check, but changed.

        The means are those of the whole check, changed by the differences from the missions of the
        check with the same random numbers.
        """
        changes = {}
        errors = {}
        for requirement in self.requirements:
            column = requirement.column
            changed = values_within(missions, column, ())
            same = values_within(self.checks[: len(changed)], column, ())
            changes[column] = float(changed.mean() - same.mean())
            pairs = compare_pairs(changed, same, metric=column)
            error = pairs.student
            if requirement.metric.is_outcome:  # with the failures that were not seen
                error = (pairs.high - pairs.low) / 2
            errors[column] = error / abs(requirement.bound)
        return Trial(self.margins_after(changes), errors)

    def margins_after(self, changes: Mapping[str, float]) -> dict[str, float]:
        """What is left of the requirements if the means of the check change, as shares of them."""
        margins = {}
        for requirement in self.requirements:
            column = requirement.column
            mean = values_within(self.checks, column, ()).mean()
            margin = requirement.margin(mean + changes[column])
            margins[column] = float(margin) / abs(requirement.bound)
        return margins


def _nearest_zone(space: ScenarioSpace, event: Event) -> int:
    """The number of the zone that is nearest to the place of an event."""
    chart = space.chart
    x, y = chart.parking[chart.nearest[int(event.y), int(event.x)]]
    return int(chart.zones[y, x])


def _table_of(space: ScenarioSpace, records: Records) -> pd.DataFrame:
    """The metrics of missions, in the units of the data sheet."""
    assert space.units
    table = pd.DataFrame(records.missions).join(pd.DataFrame(records.operations))
    table = table.assign(**columns_of_nodes(records))
    return table.assign(**columns_in_units(table, space.units))
