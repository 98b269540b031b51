"""What a cheapest fleet bears: the most wind, failures and data with which it is good enough.

    find_limits(results, "my-sea.toml")  # results of a search for the cheapest setting
    limit_facts(results)

Each condition is made harder until the fleet breaks a requirement, on missions of the check of the
fleet. The limits of data and wind are found by bisection, and the wind comes from eight directions.
Failures are rare: the means at any rate follow from missions without failures and from missions
with many, each weighed by how likely it is at that rate.
"""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy.optimize import brentq

from dess import InputError, simulate, simulate_batch
from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.requirements import requirements_of
from dess.analysis.facts import Fact
from dess.analysis.metrics import NODES_BEHIND, columns_in_units, metric_of
from dess.analysis.results.parquet import columns_of_nodes
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.verdict import Verdict, judge_margins
from dess.analysis.stats.weights import values_within
from dess.analysis.stats.worst_node import worst_node
from dess.analysis.study.study import CHECK
from dess.base.files.documents import Document
from dess.model.events import Event
from dess.model.record import Records
from dess.policies.registry import is_path, load_team
from dess.scenario.quantities import POINTS, measured, rounded, times, unit_of
from dess.scenario.scenario import ScenarioSpace, load_scenario

MISSIONS = 30  # of the check, at most; for failures three times as many
CLOSE = 0.05  # the width of the last interval, as a share of its end
MOST_DATA = 8.0  # times the data of the sheet
LEAST_WIND = 0.5  # that is tried [m/s]
PLACES = POINTS[::2]  # from which the wind comes
FAILURES = 1 / 100_000, 1.0  # the rarest and the most frequent that are tried [1/h of flying]
SHEET = "sheet"  # what ends a condition that the data sheet does not allow to be harder

_LOST = 8  # missions with a lost UAV that are looked at for the place of the loss
_RAREST = 1e-8  # failures that never happen [1/h of flying]
_MORE_FAILURES = 3  # times as many as those that are borne
_MORE_MISSIONS = 3  # times as many for failures

_DOCUMENT = "limits"  # in which they are kept
# In the order in which conditions of equal hardness are told.
_NAMES = {
    "data_sheet.data_rate": "data that it bears",
    "data_sheet.wind": "wind that it bears",
    "data_sheet.mtbf": "failures of a UAV in flight that it bears",
}


class Limit(Document):
    """How hard a condition may be.

    Attributes:
        field: The field of the scenario.
        present: Its value in the scenario; empty if it has none.
        last: The hardest value with which the fleet was found to meet its requirements, rounded to
            what the missions tell.
        is_rough: Whether they tell but one digit of it.
        small_zone: Where the success breaks, the zone with fewer cells than UAVs at which they are
            lost, in words; empty if not all are lost at such zones.
        harder: How many times as hard as at present this is; 0 if the scenario has no value.
        broken: The metric of the requirement that breaks beyond it; ``sheet`` if the data sheet
            allows no more, and empty if none breaks up to the hardest value that was tried.
    """

    field: str
    present: str
    last: str
    harder: float
    broken: str
    is_rough: bool = False
    small_zone: str = ""


class Limits(Document):
    """The limits of a fleet.

    Attributes:
        missions: The number of missions of the check on which they were found.
        limits: The limits, that which breaks something nearest to the present value first.
        has_wind: Whether the wind was asked about.
        broken: The metric whose requirement the fleet breaks in its check, so that no limits were
            sought; empty if it keeps all.
    """

    missions: int
    limits: tuple[Limit, ...]
    has_wind: bool
    broken: str = ""


@dataclass
class Bisection:
    """The search for the largest value of a condition with which nothing breaks.

    Attributes:
        low: The largest value known to be borne.
        high: The least known to be too hard; before ``is_tried``, the largest that is tried.
        floor: Where ``low`` is 0, the least value that is tried; 0 to halve the interval.
        is_tried: Whether ``high`` was tried.
        broken: What breaks at ``high``.
    """

    low: float
    high: float
    floor: float = 0.0
    is_tried: bool = False
    broken: str = ""

    @property
    def value(self) -> float | None:
        """The value to try next; None if the limit is known."""
        if not self.is_tried:
            return self.high
        if self.broken == "" or self.high - self.low <= CLOSE * self.high:
            return None
        if self.low > 0:
            middle = math.sqrt(self.low * self.high)
        elif self.floor > 0:
            middle = self.floor
        else:
            middle = self.high / 2
        value = _shortest_number(middle, self.low, self.high)
        if self.low < value < self.high:
            return value
        return None

    def learn(self, value: float, broken: str) -> None:
        """Take into account what breaks at a value; empty if nothing does."""
        if not self.is_tried:
            self.is_tried = True
            self.broken = broken
            if broken == "":
                self.low = value
        elif broken:
            self.high = value
            self.broken = broken
        else:
            self.low = value


def _shortest_number(value: float, low: float, high: float) -> float:
    """A number near a value with few digits, well inside of an interval if two digits do."""
    short = float(f"{value:.2g}")
    if 0.75 * low + 0.25 * value < short < 0.75 * high + 0.25 * value:
        return short
    return float(f"{value:.3g}")


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


def _digits_of_limit(trials: Mapping[float, Trial], broken: str) -> int:
    """The digits of a limit that trials tell, by the values at which a metric surely breaks or not.

    Args:
        trials: The trials of the values.
        broken: The metric.
    """
    if broken in ("", SHEET):
        return 3
    kept = [0.0]
    missed = [math.inf]
    for value, trial in trials.items():
        if broken in trial.margins:
            verdict = trial.judge(broken)
            if verdict == Verdict.MET:
                kept.append(value)
            elif verdict == Verdict.MISSED:
                missed.append(value)
    if min(missed) - max(kept) <= 2 * CLOSE * min(missed) < math.inf:
        return 2
    return 1


def find_limits(
    results: Results,
    scenario: str,
    workers: int = 1,
    progress: Callable[[int], object] | None = None,
    missions: int = MISSIONS,
) -> None:
    """Find the limits of the cheapest fleet, and keep them in its results folder (``Derived``).

    A fleet for several conditions is asked about under the last of them. Nothing happens without a
    data sheet or a check, or if no fleet is known to meet the requirements, its policy is a file,
    or only the SimPy engine can simulate it; or if the limits are kept already, or nothing can be.

    Args:
        results: A study that searches for the cheapest setting.
        scenario: The scenario of the study, with the path of its file.
        workers: Number of threads.
        progress: Called with the number of missions done since its last call.
        missions: The most missions of the check that are simulated for every value.
    """
    best = search_of(results).best
    if not best.points or is_path(best.policy) or results.checks.empty:
        return
    if results.store.is_read_only or results.store.derived.has(_DOCUMENT):
        return
    if results.store.manifest.processes:
        return
    fleet = _Fleet(results, scenario, workers, progress, missions)
    if not fleet.space.units or fleet.space.needs_events:
        return
    broken = fleet.trial_of(fleet.checks).broken
    limits: tuple[Limit, ...] = ()
    if not broken:
        limits = tuple(sorted(_search_limits(fleet), key=_order_of))
    has_wind = fleet.space.data_sheet.max_speed is not None
    document = Limits(missions=fleet.missions, limits=limits, has_wind=has_wind, broken=broken)
    results.store.derived.keep(_DOCUMENT, document)


def _order_of(limit: Limit) -> tuple[bool, float]:
    """What limits are sorted by: first those that break something, the nearest one first."""
    return limit.broken == "", limit.harder or math.inf


def _search_limits(fleet: "_Fleet") -> list[Limit]:
    """The limits of all conditions that the data sheet of the fleet's scenario has."""
    sheet = fleet.space.data_sheet
    limits = [_find_most_failures(fleet)]
    if sheet.data_rate:
        limits.append(_find_most_data(fleet, sheet.data_rate))
    if sheet.max_speed:
        limits.append(_find_strongest_wind(fleet))
    return limits


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


@dataclass(frozen=True)
class FailureModel:
    """The means of metrics at any rate of failures.

    A mission has no failure with probability exp(-rate * hours), and is then one of ``unfailed``.
    If it has some, it is one of those of ``failing`` that have, weighed by their likelihood ratio.

    Attributes:
        unfailed: Missions without failures.
        failing: The same missions with frequent failures.
    """

    unfailed: Flights
    failing: Flights

    def mean(self, column: str, rate: float) -> float:
        """The mean of a metric at a rate [1/h of flying]; of the worst node, if it is of one."""
        chances = np.exp(-rate * self.unfailed.hours)
        means = np.mean(chances[:, None] * self.unfailed.values(column), axis=0)
        has_failed = self.failing.failures > 0
        if has_failed.any():
            failures = self.failing.failures[has_failed]
            hours = self.failing.hours[has_failed]
            logarithms = failures * math.log(rate / self.failing.rate)
            logarithms -= (rate - self.failing.rate) * hours
            weights = np.exp(logarithms - logarithms.max())
            values = self.failing.values(column)[has_failed]
            means += (1 - chances.mean()) * np.average(values, axis=0, weights=weights)
        return float(means[worst_node(means, column)])

    def without(self, row: int) -> "FailureModel":
        """The same without one of the missions."""
        return FailureModel(self.unfailed.without(row), self.failing.without(row))


class _Fleet:
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


def _find_most_data(fleet: _Fleet, rate: str | tuple[str, ...]) -> Limit:
    """The most data for which the fleet is good enough, up to ``MOST_DATA`` times the sheet's."""

    def multiply(factor: float) -> Any:
        if isinstance(rate, str):
            return times(rate, factor)
        return [times(rate_of_node, factor) for rate_of_node in rate]

    def change(factor: float) -> dict[str, Any]:
        return {"data_sheet.data_rate": multiply(factor)}

    search = Bisection(1.0, MOST_DATA)
    trials = {}
    while (factor := search.value) is not None:
        [trials[factor]] = fleet.try_changes([change(factor)])
        search.learn(factor, trials[factor].broken)
    digits = _digits_of_limit(trials, search.broken)
    present = "the listed rates"
    last = present
    if isinstance(rate, str):
        present = rate
        last = max(rate, rounded(multiply(search.low), digits), key=_bits_per_second)
    elif search.low > 1:
        last = f"{rounded(f'{search.low:g} times', digits)} the listed rates"
    small_zone = ""
    if search.broken == "success":
        small_zone = fleet.small_zone_of_losses(change(search.high))
    return Limit(
        field="data_sheet.data_rate",
        present=present,
        last=last,
        harder=search.low,
        broken=search.broken,
        is_rough=digits == 1,
        small_zone=small_zone,
    )


def _bits_per_second(rate: str) -> float:
    return measured(rate, "bit/s")[0]


def _find_strongest_wind(fleet: _Fleet) -> Limit:
    """The strongest wind for which the fleet is good enough, from the worst of ``PLACES``.

    It is no stronger than what UAVs can fly in from all of them.
    """

    def wind(speed: float, place: str) -> dict[str, Any]:
        return {"data_sheet.wind": f"{speed:g} m/s from {place}"}

    sheet = fleet.space.data_sheet
    strongest = {
        place: sheet.strongest_wind(360 / len(PLACES) * number)
        for number, place in enumerate(PLACES)
    }
    worst = min(strongest, key=strongest.__getitem__)
    search = Bisection(0.0, strongest[worst], LEAST_WIND)
    places = PLACES
    trials = {}
    while (speed := search.value) is not None:
        winds = [wind(speed, place) for place in places]
        found = dict(zip(places, fleet.try_changes(winds), strict=True))
        hardest = min(places, key=lambda place: found[place].room)
        trials[speed] = found[hardest]
        search.learn(speed, trials[speed].broken)
        if trials[speed].broken:  # wind from the other places may be stronger than this
            places = [place for place in places if found[place].broken]
            worst = hardest
    digits = _digits_of_limit(trials, search.broken)
    last = ""
    if search.low > 0:
        speed_in_unit, unit = _in_unit_of(sheet.wind or "1 m/s from N", search.low, "m/s from deg")
        last = rounded(f"{speed_in_unit:.12g} {unit} from {worst}", digits)
    harder = 0.0
    if sheet.wind:
        present, _ = measured(sheet.wind, "m/s from deg")
        harder = search.low / max(present, 0.01)
    small_zone = ""
    if search.broken == "success":
        small_zone = fleet.small_zone_of_losses(wind(search.high, worst))
    return Limit(
        field="data_sheet.wind",
        present=sheet.wind or "",
        last=last,
        harder=harder,
        broken=search.broken or SHEET,
        is_rough=digits == 1,
        small_zone=small_zone,
    )


def _find_most_failures(fleet: _Fleet) -> Limit:
    """The most frequent failures for which the fleet is good enough."""
    sheet = fleet.space.data_sheet
    present = _RAREST
    if sheet.mtbf:
        present = 3600 / measured(sheet.mtbf, "s")[0]
    least = max(FAILURES[0], present)
    most = min(max(FAILURES[1], 2 * present), 3600 / sheet.units.slot)

    def trial(model: FailureModel, rate: float) -> Trial:
        changes = {}
        for requirement in fleet.requirements:
            column = requirement.column
            changes[column] = model.mean(column, rate) - model.mean(column, present)
        return Trial(fleet.margins_after(changes))

    unfailed = fleet.fly_with_failures(_RAREST)
    rate = min(max(1 / max(unfailed.hours.mean(), _RAREST), 2 * least), most)  # one in a mission
    model = FailureModel(unfailed, fleet.fly_with_failures(rate))
    while rate < most and not trial(model, rate).broken:
        rate = min(_MORE_FAILURES * rate, most)
        model = FailureModel(unfailed, fleet.fly_with_failures(rate))

    limit = rate
    broken = trial(model, rate).broken
    digits = 3
    last = ""
    if trial(model, least).broken:
        limit = least
        broken = trial(model, least).broken
        if sheet.mtbf:
            last = sheet.mtbf
    else:
        if broken:
            exponent = brentq(
                lambda exponent: trial(model, math.exp(exponent)).room,
                math.log(least),
                math.log(rate),
            )
            limit = math.exp(exponent)
            broken = trial(model, 1.001 * limit).broken
            digits = _digits_of_rate(model, broken, limit)
        mean_time, unit = _in_unit_of(sheet.mtbf or "1 h", 3600 / limit, "s")
        last = rounded(f"{mean_time:.6g} {unit}", digits, is_up=True)
        if sheet.mtbf:
            last = min(last, sheet.mtbf, key=_seconds)
    harder = 0.0
    if sheet.mtbf:
        harder = limit / present
    return Limit(
        field="data_sheet.mtbf",
        present=sheet.mtbf or "",
        last=last,
        harder=harder,
        broken=broken,
        is_rough=digits == 1,
    )


def _digits_of_rate(model: FailureModel, broken: str, rate: float) -> int:
    """The digits that missions tell of the rate at which a metric breaks, by the jackknife."""
    missions = len(model.unfailed.hours)
    means = [model.without(row).mean(broken, rate) for row in range(missions)]
    error = 1.96 * np.std(means) * math.sqrt(missions - 1)
    change = 0.01  # of the rate
    slope = (model.mean(broken, (1 + change) * rate) - model.mean(broken, rate)) / change
    if error <= 0.2 * CLOSE * abs(slope):
        return 3
    if error <= 2 * CLOSE * abs(slope):
        return 2
    return 1


def _in_unit_of(text: str, value: float, units: str) -> tuple[float, str]:
    """A value in the unit in which a quantity was typed, and this unit.

    Args:
        text: The quantity.
        value: The value in the first unit of ``units``.
        units: What the quantity is measured in, of ``quantities.KINDS``.
    """
    unit = unit_of(text, units)
    size = measured(f"1 {unit}", units.split(" ")[0])[0]
    return value / size, unit


def _seconds(time: str) -> float:
    return measured(time, "s")[0]


def limits_of(results: Results) -> Limits | None:
    """The limits that ``find_limits`` has kept; None if there are none.

    Raises:
        InputError: If the file is damaged.
    """
    derived = results.store.derived
    if not derived.has(_DOCUMENT):
        return None
    return derived.load(_DOCUMENT, Limits, "what dess sweep has written")


def limit_facts(results: Results) -> list[Fact]:
    """How much of each condition the fleet bears, that which breaks a requirement first first."""
    document = limits_of(results)
    if document is None:
        return []
    if document.broken:
        name = metric_of(document.broken).within
        return [Fact("limits", f"not sought: in its check, the {name} breaks its requirement")]
    missions = numbers.format_count(document.missions, "mission")
    facts = [Fact(_NAMES[limit.field], _limit_in_words(limit)) for limit in document.limits]
    if not document.has_wind:
        facts.append(Fact(_NAMES["data_sheet.wind"], "not asked: the sheet has no max_speed"))
    method = f"{missions} of the check, for failures three times as many"
    return [*facts, Fact("limits found on", method)]


def _limit_in_words(limit: Limit) -> str:
    """How hard a condition may be, what is assumed, and what ends it."""
    every = ""
    if limit.field == "data_sheet.mtbf":
        every = "one every "
    if limit.last:
        about = ""
        if limit.is_rough:
            about = "about "
        bears = f"{about}{every}{limit.last}"
        if limit.field == "data_sheet.wind":
            bears = f"{bears}, the worst of {len(PLACES)} directions"
    elif limit.field == "data_sheet.wind":
        bears = f"not even {LEAST_WIND:g} m/s"
    else:
        bears = f"not even {every}{1 / FAILURES[0]:g} h"
    assumed = limit.present or "none"
    if limit.broken == SHEET:
        end = "beyond it, UAVs cannot fly"
    elif limit.broken:
        end = f"beyond it, the {metric_of(limit.broken).within} breaks"
        if limit.small_zone:
            end = f"{end}, as UAVs are lost at {limit.small_zone}"
    else:
        end = "no more was tried"
    return f"{bears} ({assumed} assumed); {end}"
