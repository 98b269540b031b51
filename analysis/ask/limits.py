"""What a cheapest fleet bears: the most wind, failures and data with which it is good enough.

    find_limits(results, "my-sea.toml")  # results of a search for the cheapest setting
    limit_sentences(results)

Each condition is made harder until the fleet breaks a requirement, and its limit is found by
bisection, on missions of the check of the fleet.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import pandas as pd

from dess import InputError, simulate_batch
from dess.analysis import numbers
from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.answers.fleet.requirements import requirements_of
from dess.analysis.ask.around import place_beside
from dess.analysis.metrics import columns_in_units, metric_of
from dess.analysis.results.parquet import columns_of_nodes
from dess.analysis.results.tables import Results
from dess.analysis.stats.intervals import values_within
from dess.analysis.study.study import CHECK
from dess.base.files.documents import Document
from dess.base.files.writing import write_file
from dess.policies.registry import is_path, load_team
from dess.scenario.quantities import measured, times
from dess.scenario.scenario import ScenarioSpace, load_scenario

MISSIONS = 30  # of the check, at most
CLOSE = 0.05  # the width of the last interval, as a share of its end
MOST_DATA = 8.0  # times the data of the sheet
FAILURES = 1 / 1000, 1.0  # the rarest and the most frequent that are tried [1/h of flying]
SHEET = "sheet"  # what ends a condition that the data sheet does not allow to be harder

# In the order in which conditions of equal hardness are told.
_NAMES = {
    "data_sheet.data_rate": "the data",
    "data_sheet.wind": "the wind",
    "data_sheet.mtbf": "failures",
}


class Limit(Document):
    """How hard a condition may be.

    Attributes:
        field: The field of the scenario.
        present: Its value in the scenario; empty if it has none.
        last: The hardest value with which the fleet was found to meet its requirements.
        harder: How many times as hard as at present this is; 0 if the scenario has no value.
        broken: The metric of the requirement that breaks beyond it; ``sheet`` if the data sheet
            allows no more, and empty if none breaks up to the hardest value that was tried.
    """

    field: str
    present: str
    last: str
    harder: float
    broken: str


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


@dataclass
class _Condition:
    """A condition of a scenario that can be harder.

    Attributes:
        field: The field.
        present: Its value in the scenario, if there is one.
        base: The hardness of this value; 0 if there is none.
        search: The bisection over the hardness.
        write: Writes a hardness as a value of the field.
        end: What ends the condition at the largest hardness, if nothing breaks before.
    """

    field: str
    present: Any
    base: float
    search: Bisection
    write: Callable[[float], Any]
    end: str = ""

    @property
    def limit(self) -> Limit:
        """What the search has found."""
        search = self.search
        harder = 0.0
        if self.base:
            harder = search.low / self.base
        last = ""
        if search.low > 0:
            last = _in_words(self.write(search.low), search.low)
        present = ""
        if self.present:
            present = _in_words(self.present, self.base)
        return Limit(
            field=self.field,
            present=present,
            last=last,
            harder=harder,
            broken=search.broken or self.end,
        )


def _in_words(value: Any, factor: float) -> str:
    """A value of a field; of a list for the nodes, how many times the data of the sheet it is."""
    if isinstance(value, str):
        return value
    if factor == 1:
        return "what the sheet lists"
    return f"{factor:.3g} times what the sheet lists"


def place_of_limits(results: Results) -> Path:
    """The file of the limits, beside the results folder of the study."""
    return place_beside(results, "limits").with_suffix(".json")


def find_limits(
    results: Results,
    scenario: str,
    workers: int = 1,
    progress: Callable[[int], object] | None = None,
    missions: int = MISSIONS,
) -> None:
    """Find the limits of the cheapest fleet, and keep them beside its results.

    A fleet for several conditions is asked about under the last of them. Nothing happens without a
    data sheet or a check, or if no fleet is known to meet the requirements, its policy is a file,
    or only the SimPy engine can simulate it; or if the limits are kept already.

    Args:
        results: A study that searches for the cheapest setting.
        scenario: The scenario of the study, with the path of its file.
        workers: Number of threads.
        progress: Called with the number of missions done since its last call.
        missions: The most missions of the check that are simulated for every value.
    """
    best = search_of(results).best
    path = place_of_limits(results)
    if not best.points or is_path(best.policy) or results.checks.empty or path.exists():
        return
    fleet = _Fleet(results, scenario, workers, progress, missions)
    if not fleet.space.units or fleet.space.needs_events:
        return
    broken = fleet.find_broken(fleet.checks)
    limits: tuple[Limit, ...] = ()
    if not broken:
        limits = tuple(sorted(_search_limits(fleet), key=_order_of))
    has_wind = fleet.space.data_sheet.max_speed is not None
    document = Limits(missions=fleet.missions, limits=limits, has_wind=has_wind, broken=broken)
    write_file(path, document.model_dump_json(indent=1) + "\n")


def _order_of(limit: Limit) -> tuple[bool, float]:
    """What limits are sorted by: first those that break something, the nearest one first."""
    return limit.broken == "", limit.harder or math.inf


def _search_limits(fleet: "_Fleet") -> list[Limit]:
    """The limits of all conditions, whose bisections are simulated together."""
    conditions = [*_conditions_of(fleet)]
    while next_values := [
        (condition, value)
        for condition in conditions
        if (value := condition.search.value) is not None
    ]:
        changes = [{condition.field: condition.write(value)} for condition, value in next_values]
        results = fleet.try_changes(changes)
        for (condition, value), broken in zip(next_values, results, strict=True):
            condition.search.learn(value, broken)
    return [condition.limit for condition in conditions]


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
        self._requirements = requirements_of(results)
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

    def allows(self, change: dict[str, Any]) -> bool:
        """Whether the data sheet allows a change, such as a wind against which UAVs can fly."""
        try:
            self.load(change)
        except InputError:
            return False
        return True

    def try_changes(self, changes: Sequence[dict[str, Any]]) -> list[str]:
        """What breaks with each of these changes of the scenario; empty where nothing does."""
        spaces = {}
        for number, change in enumerate(changes):
            if self.allows(change):
                spaces[number] = self.load(change)
        records = simulate_batch(
            [space for space in spaces.values() for _ in range(self.missions)],
            self._team,
            self._seed,
            [*range(CHECK, CHECK + self.missions)] * len(spaces),
            workers=self._workers,
            progress=self._progress,
        )
        table = pd.DataFrame(records.missions).join(pd.DataFrame(records.operations))
        table = table.assign(**columns_of_nodes(records))
        broken = [SHEET] * len(changes)
        for place, (number, space) in enumerate(spaces.items()):
            rows = table[place * self.missions :][: self.missions]
            assert space.units
            in_units = columns_in_units(rows, space.units)
            broken[number] = self.find_broken(rows.assign(**in_units))
        return broken

    def find_broken(self, missions: pd.DataFrame) -> str:
        """The metric whose requirement breaks most; empty if all are kept.

        The means are those of the whole check, changed by the differences from the missions of the
        check with the same random numbers.
        """
        room = {}
        for requirement in self._requirements:
            column = requirement.column
            whole, same, changed = (
                values_within(rows, column, ()).mean()
                for rows in (self.checks, self.checks[: len(missions)], missions)
            )
            mean = whole + changed - same
            room[column] = float(requirement.margin(mean)) / abs(requirement.bound)
        worst = min(room, key=room.__getitem__)
        if room[worst] >= 0:
            return ""
        return worst


def _conditions_of(fleet: _Fleet) -> Iterator[_Condition]:
    """The conditions that the data sheet of a scenario has."""
    sheet = fleet.space.data_sheet
    rate = sheet.data_rate
    if rate:

        def write_rate(factor: float) -> Any:
            if isinstance(rate, str):
                return times(rate, factor)
            return [times(rate_of_node, factor) for rate_of_node in rate]

        yield _Condition("data_sheet.data_rate", rate, 1.0, Bisection(1.0, MOST_DATA), write_rate)
    if sheet.max_speed:
        yield _wind_of(fleet)
    base = 0.0
    if sheet.mtbf:
        base = 3600 / measured(sheet.mtbf, "s")[0]
    rarest, most = FAILURES
    search = Bisection(base, max(most, 2 * base), rarest)
    yield _Condition("data_sheet.mtbf", sheet.mtbf, base, search, _write_failures)


def _write_failures(per_hour: float) -> str:
    """A rate of failures as the mean time between them."""
    return f"{float(f'{1 / per_hour:.3g}'):g} h"


def _wind_of(fleet: _Fleet) -> _Condition:
    """The wind, from where it comes at present, up to the strongest that the sheet can fly."""
    sheet = fleet.space.data_sheet
    calm = f"{sheet.cruise} from W"
    speed = 0.0
    if sheet.wind:
        speed, _ = measured(sheet.wind, "m/s from deg")
    place = (sheet.wind or calm).partition(" from ")[2]

    def write(metres_per_second: float) -> str:
        return f"{metres_per_second:.4g} m/s from {place}"

    strongest = speed
    step = 64.0
    while step >= 0.01:
        if fleet.allows({"data_sheet.wind": write(strongest + step)}):
            strongest += step
        step /= 2
    strongest = math.floor(100 * strongest) / 100
    search = Bisection(speed, max(strongest, speed))
    return _Condition("data_sheet.wind", sheet.wind, speed, search, write, SHEET)


def limits_of(results: Results) -> Limits | None:
    """The limits that ``find_limits`` has kept; None if there are none.

    Raises:
        InputError: If the file is damaged.
    """
    path = place_of_limits(results)
    if not path.exists():
        return None
    return Limits.load(path, "what dess sweep has written")


def limit_sentences(results: Results) -> list[str]:
    """What breaks the requirements of the fleet first, and how much of each condition it bears."""
    document = limits_of(results)
    if document is None:
        return []
    if document.broken:
        name = metric_of(document.broken).within
        return [f"In its check, the {name} breaks its requirement, so that no limits were sought."]
    first, *others = document.limits
    missions = numbers.format_count(document.missions, "mission")
    method = f"Limits are found by bisection to 5 % on {missions} of the check."
    if first.broken:
        start = f"What breaks it first is {_NAMES[first.field]}"
    else:
        start = f"Nothing that was tried breaks it. {_NAMES[first.field].capitalize()}"
    lines = [f"{start}: {_limit_in_words(first)}. {method}"]
    lines += [f"{_NAMES[limit.field].capitalize()}: {_limit_in_words(limit)}." for limit in others]
    if not document.has_wind:
        lines.append("Wind was not asked: the sheet has no max_speed.")
    return lines


def _limit_in_words(limit: Limit) -> str:
    """How hard a condition may be, and what ends it."""
    if limit.field == "data_sheet.mtbf":
        form = "one every {} of a UAV's flying"
    else:
        form = "{}"
    if limit.last:
        bears = f"up to {form.format(limit.last)}"
    elif limit.field == "data_sheet.wind":
        bears = "none at all"
    else:
        bears = f"not even {form.format(_write_failures(FAILURES[0]))}"
    if limit.present:
        assumed = f"{limit.present} is assumed"
    else:
        assumed = "none is assumed"
    if limit.broken == SHEET:
        end = "in more wind, the UAVs of the data sheet cannot fly"
    elif limit.broken:
        end = f"beyond it, the {metric_of(limit.broken).within} breaks its requirement"
    else:
        end = "no more was tried"
    return f"{bears} ({assumed}); {end}"
