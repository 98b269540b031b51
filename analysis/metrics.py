"""The metrics of missions: what they are called, measured in, and how they are written."""

from collections.abc import Callable, Container, Mapping
from dataclasses import dataclass, replace
from functools import cache
from math import inf
from typing import Any, Literal

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.scenario.data_sheet import Units
from dess.scenario.quantities import measured, printed
from dess.scenario.scenario import ScenarioSpace

Kind = Literal["outcome", "share", "number", "cost"]
# The metrics of the paper, of what else every mission has (reward, way home), of studies with
# bounds and with prices, of operations beyond the paper, and of amounts and times in records.
Group = Literal["paper", "reward", "home", "bounds", "prices", "operations", "amounts"]


@dataclass(frozen=True)
class Metric:
    """A metric, and all that is known of it wherever it is estimated, drawn or written.

    Attributes:
        column: Its column in a table of missions.
        name: What pages call it.
        unit: The unit; empty for shares and counts.
        kind: An ``outcome`` is 0 or 1 in each mission, and its mean has Wilson's interval. The
            values of a ``share`` lie between 0 and 1. How the interval of the mean of a ``number``
            and of a ``cost`` is computed depends on what is known of rare missions
            (``stats.kinds.ends_of_means``).
        less_is_better: Whether a lower value is better.
        is_neutral: Whether neither more nor less of it is better: it describes missions, and ranks
            nothing.
        in_percent: Whether it is written in percent, and its differences in percentage points.
        sheet_unit: The unit where there is a data sheet; empty if in the same.
        horizons: The largest value that a mission can have, as a share of the longest that it may
            last; 0 if it is not known.
        is_sum: Whether this is a time of each UAV, summed over all.
        least: The smallest value that a mission can have. Of a cost, ``metric_in_missions`` finds
            it.
        most: The largest value that a mission can have. Of a time, a cost and an amount of data,
            ``metric_in_missions`` finds it.
        failure: By how much a failure changes it, where the range is not known; 0 if that is not
            known either.
        fails: Whether a failure may move it to an end of its range.
        grows: Whether it grows with the length of the mission, so that only missions of the same
            length are to be compared by it.
        among: Of how many nodes it is that of the worst one; 1 if it is not of a node. Intervals
            and tests hold for so many at once (``level_of_each``).
        is_of_years: Whether its values are those of years with weather.
        told_unit: The unit in which a time is told that somebody has asked for in it, such as
            ``min``; empty for ``unit``. Its columns stay in ``unit``.
        group: The missions that have it (``metric_group``); None if nothing is known of it.
    """

    column: str
    name: str
    unit: str = ""
    kind: Kind = "number"
    less_is_better: bool = False
    is_neutral: bool = False
    in_percent: bool = False
    sheet_unit: str = ""
    horizons: float = 0.0
    is_sum: bool = False
    least: Any = -inf
    most: Any = inf
    failure: float = 0.0
    fails: bool = True
    grows: bool = False
    among: int = 1
    is_of_years: bool = False
    told_unit: str = ""
    group: Group | None = None

    def level_of_each(self, level: Any) -> Any:
        """The level of the interval of each node so that those of all hold together at a level.

        Without it, the interval of the node that did worst by chance would miss the mean of the
        worst node too often (Bonferroni's bound).
        """
        return 1 - (1 - level) / self.among

    @property
    def range(self) -> tuple[Any, Any]:
        """The smallest and the largest value that a mission, and so a mean, can have.

        They are arrays where samples with ranges of their own are estimated together.
        """
        if self.is_bounded:
            return (0.0, 1.0)
        return (self.least, self.most)

    @property
    def has_range(self) -> bool:
        """Whether both ends of the range are known, and a failure may lead there."""
        return self.fails and bool(
            np.isfinite(self.range[0]).all() and np.isfinite(self.range[1]).all()
        )

    def at(self, place: Any) -> "Metric":
        """The metric of some of the samples that are estimated together, with their ranges.

        Args:
            place: What indexes an array with an entry for each sample, such as a position.
        """
        least, most = (end if np.ndim(end) == 0 else end[place] for end in (self.least, self.most))
        return replace(self, least=least, most=most)

    @property
    def is_wait(self) -> bool:
        """Whether it is 0 in missions in which no UAV can wait for a pad."""
        return self.column in in_either("waiting", "waiting_per_uav")

    @property
    def in_units(self) -> "Metric":
        """The metric in the unit of a data sheet, which has a column of its own."""
        if self.sheet_unit:
            column = f"{self.column}_{self.sheet_unit}"
        else:
            column = self.column
        return replace(self, column=column, unit=self.sheet_unit or self.unit, sheet_unit="")

    @property
    def label(self) -> str:
        """The name with its unit."""
        return f"{self.name} [{self.told_unit or self.unit}]".removesuffix(" []")

    @property
    def scale(self) -> float:
        """What a value of its column is multiplied by to be told."""
        if self.told_unit:
            size = measured(f"1 {self.told_unit}", "s")[0]
            return SHEET_UNITS[self.unit][1] / size
        return 1.0

    @property
    def within(self) -> str:
        """The name as it is written inside a sentence."""
        return self.name.lower()

    @property
    def head(self) -> str:
        """The name above a column in the terminal."""
        if self.in_percent or self.is_in_sheet_unit:
            return self.within
        return self.label

    @property
    def is_in_sheet_unit(self) -> bool:
        """Whether it is in a unit of a data sheet, which is written behind every value."""
        return self.unit in SHEET_UNITS

    @property
    def is_outcome(self) -> bool:
        """Whether it is 0 or 1 in each mission."""
        return self.kind == "outcome"

    @property
    def is_bounded(self) -> bool:
        """Whether its values lie between 0 and 1."""
        return self.kind in ("outcome", "share")

    @property
    def axis(self) -> str:
        """The unit in which an axis of a figure is written: ``%``, or empty for plain numbers."""
        return "%" if self.in_percent else ""

    @property
    def write(self) -> Callable[[float], str]:
        """Writes a value."""
        return self._with_unit(
            numbers.format_percent if self.in_percent else numbers.format_quantity
        )

    @property
    def written(self) -> Callable[[float, float, float], str]:
        """Writes an estimate and the ends of its interval."""
        if self.kind == "cost":
            return numbers.format_amounts
        return self._with_unit(
            numbers.format_interval if self.in_percent else numbers.format_quantities
        )

    @property
    def amount(self) -> Callable[[float], str]:
        """Writes a value that somebody asks for, with its unit."""
        if self.in_percent:
            return numbers.format_level
        if self.is_in_sheet_unit:
            return self.write
        return lambda value: f"{numbers.format_quantity(value)} {self.unit}".rstrip()

    @property
    def change(self) -> Callable[[float, float, float], str]:
        """Writes a difference and the ends of its interval."""
        return self._with_unit(
            numbers.format_points if self.in_percent else numbers.format_quantities
        )

    def _with_unit(self, write: Callable[..., str]) -> Callable[..., str]:
        if self.is_in_sheet_unit:
            unit = self.told_unit or self.unit
            return lambda *ends: f"{write(*(self.scale * end for end in ends))} {unit}"
        return write


# What a failure costs: the reward of a filled quota is not earned, that of an empty battery is.
_FIELDS = ScenarioSpace.model_fields
FAILURE_COST = _FIELDS["reward_quota"].default - _FIELDS["reward_depleted"].default

SUCCESS = "success"
RATIO = "collection_ratio"
HOME = "home"
PRODUCT = "collection_ratio_and_communication"
REWARD = "reward"
WINDOWS, LATE = "windows", "late"  # of a year with weather
AGE, COST = "age", "cost"  # a cost have the missions of a study with prices
LEAST, OLDEST = "least", "oldest"  # of the node that is served worst, with a data sheet
COLLECTED = "collected"
QUEUE = "queue"
# Of a study with bounds: the bound, and the bound minus the product.
BOUND = "upper_bound"
GAP = "optimality_gap"

_SLOTS = "mission slots"
_DATA = "data units"
# What a unit of a data sheet measures, and how large it is [s], [bit], [m].
SHEET_UNITS = {
    "min": ("slot", 60.0),
    "h": ("slot", 3600.0),
    "MB": ("data", 8e6),
    "km": ("cell", 1e3),
}
# The units of maps, of curves over time and of the player, where there is a data sheet.
DRAWN_UNITS = {"length": "km", "time": "h", "data": "MB"}
# The columns of the longest that each mission may last, and that a UAV may wait for a pad in it.
MOST_SLOTS = "most_slots"
MOST_WAITING = "most_waiting"
# The column of how long nodes were idle before each mission, which their ages begin with.
IDLE = "idle"
# The columns of the least and the most that each mission may cost.
LEAST_COST = "least_cost"
MOST_COST = "most_cost"


def _time_metric(
    column: str,
    name: str,
    sheet_unit: str = "h",
    horizons: float = 1.0,
    grows: bool = False,
    is_sum: bool = False,
) -> Metric:
    """A time of which less is better."""
    return Metric(
        column,
        name,
        _SLOTS,
        less_is_better=True,
        sheet_unit=sheet_unit,
        horizons=horizons,
        is_sum=is_sum,
        least=0.0,
        grows=grows,
    )


def _amount_metric(
    column: str,
    name: str,
    unit: str = "",
    sheet_unit: str = "",
    less: bool = False,
    neutral: bool = False,
) -> Metric:
    """A number that is not negative."""
    return Metric(
        column,
        name,
        unit,
        less_is_better=less,
        is_neutral=neutral,
        sheet_unit=sheet_unit,
        least=0.0,
    )


# A metric is declared once, in the group of the missions that have it: wherever metrics are chosen,
# they come from ``metric_group``. Every mission has the paper's metrics, in its order (Section
# VI-A). It calls them successful communication, collection ratio, and collection ratio and
# communication; the last is here the product of each mission.
_GROUPS: dict[Group, tuple[Metric, ...]] = {}
_GROUPS["paper"] = (
    Metric(SUCCESS, "Success", kind="outcome", in_percent=True),
    Metric(RATIO, "Collection ratio", kind="share", in_percent=True),
    Metric(PRODUCT, "Product", kind="share", in_percent=True),
)
_GROUPS["reward"] = (Metric(REWARD, "Reward", failure=FAILURE_COST),)
_GROUPS["home"] = (Metric(HOME, "Battery for the way home", kind="outcome", in_percent=True),)
_GROUPS["bounds"] = (
    Metric(BOUND, "Upper bound", least=0.0, most=1.0, fails=False),
    Metric(GAP, "Optimality gap", less_is_better=True, least=0.0, most=1.0),
)
_GROUPS["prices"] = (Metric(COST, "Cost", kind="cost", less_is_better=True, least=0.0, grows=True),)
# Numbers beyond the paper: those of ``OPERATIONS``, which only extended scenarios measure, and, if
# there are such, those of ``MISSION_RECORD`` that are shown like these.
_GROUPS["operations"] = (
    # An age grows with time, so the mean of a node that nothing reaches is half of the horizon.
    _time_metric(AGE, "Age of information", horizons=0.5, grows=True),
    _time_metric("peak_age", "Peak age of information", grows=True),
    _time_metric("age_p99", "99th percentile of the age", grows=True),
    # Of the node whose mean over the missions is the worst; each mission has the value of this
    # node. They follow from ``NODES_BEHIND``, not from a record.
    Metric(LEAST, "Collection ratio of the worst node", kind="share", in_percent=True),
    _time_metric(OLDEST, "Age of the oldest node", horizons=0.5, grows=True),
    _time_metric("latency", "Latency"),
    _time_metric("latency_p99", "99th percentile of the latency"),
    _amount_metric("generated", "Packets generated", neutral=True),
    _amount_metric("delivered", "Packets delivered"),
    _amount_metric("lost_packets", "Packets lost", less=True),
    _amount_metric("lost", "Data lost", _DATA, "MB", less=True),
    _amount_metric(QUEUE, "UAVs waiting for a pad", less=True),
    _time_metric("waiting", "Waiting time for a pad", "min"),
    _amount_metric("pad_requests", "Requests for a pad", neutral=True),
    Metric("utilisation", "Utilisation of the pads", kind="share", is_neutral=True),
    Metric("failures", "Failures of UAVs", less_is_better=True, least=0.0, failure=1.0),
    _time_metric("slots_grounded", "Time under repair", is_sum=True),
    # Of years with weather.
    Metric(LATE, "Late data", kind="share", less_is_better=True, in_percent=True),
    Metric("open", "Open hours", kind="share", is_neutral=True, in_percent=True),
    _amount_metric(WINDOWS, "Windows a year", neutral=True),
    _amount_metric("longest_gap", "Longest gap", "h", neutral=True),
)
# What records have in slots and data units; there is a metric of each in the units of a data sheet.
_GROUPS["amounts"] = (
    _time_metric("slots", "Length of the mission"),
    _time_metric(MOST_SLOTS, "Longest that the mission may last"),
    _time_metric(MOST_WAITING, "Longest that a UAV may wait for a pad"),
    _time_metric(IDLE, "How long nodes were idle before the mission"),
    _time_metric("uav_slots", "UAV-hours", is_sum=True),
    _amount_metric(COLLECTED, "Data collected", _DATA, "MB"),
    _amount_metric("collected_per_uav", "Data collected per UAV", _DATA, "MB"),
    _amount_metric("residual", "Data left", _DATA, "MB", less=True),
    _time_metric("charging_per_uav", "Charging per UAV", "min"),
    _time_metric("waiting_per_uav", "Waiting per UAV", "min"),
)
_ALL = tuple(replace(m, group=name) for name, group in _GROUPS.items() for m in group)
_IN_SHEET_UNIT = {metric.column: metric.in_units.column for metric in _ALL}
_KNOWN = {metric.column: metric for metric in _ALL}
_KNOWN |= {metric.in_units.column: metric.in_units for metric in _ALL}

# The columns of the values of all nodes of a mission, of which a metric has those of the worst one.
NODE_RATIOS = "node_ratios"
NODE_AGES = "node_ages"
NODES_BEHIND = {
    LEAST: NODE_RATIOS,
    OLDEST: NODE_AGES,
    _IN_SHEET_UNIT[OLDEST]: f"{NODE_AGES}_{_KNOWN[OLDEST].sheet_unit}",
}
# Short names of metrics on the command line.
ALIASES = {"ratio": RATIO, "product": PRODUCT}


@cache
def metric_group(*groups: Group, in_units: bool = False) -> dict[str, Metric]:
    """The metrics of some groups by their columns, one group after the other.

    Args:
        *groups: The groups.
        in_units: Whether those in the units of data sheets are among them.
    """
    in_groups = {m.column: m for group in groups for m in _ALL if m.group == group}
    if in_units:
        return in_groups | {m.in_units.column: m.in_units for m in in_groups.values()}
    return in_groups


# The paper's metrics, with their names.
METRICS = {column: metric.name for column, metric in metric_group("paper").items()}


def metric_of(column: str | Metric) -> Metric:
    """The metric of a column of missions; one that nothing is known of is named after the column.

    Of such a metric more is better, and its values have no bounds. A metric is returned as it is.
    """
    if isinstance(column, Metric):
        return column
    return _KNOWN.get(column) or Metric(column, column.replace("_", " ").capitalize())


def are_years(missions: pd.DataFrame) -> bool:
    """Whether the rows of a table of missions are years with weather."""
    return WINDOWS in missions and not missions[WINDOWS].isna().all()


def without_nodes(missions: pd.DataFrame) -> pd.DataFrame:
    """A table of missions without the columns that have a list for every mission."""
    return missions.drop(columns=[*NODES_BEHIND.values()], errors="ignore")


def in_either(*columns: str) -> list[str]:
    """Metrics as they are measured and in the units of data sheets."""
    return [*columns, *(_IN_SHEET_UNIT[column] for column in columns)]


def column_in_sheet_unit(column: str, missions: Container[str]) -> str:
    """The column of a metric in a table of missions: in the unit of a data sheet if possible."""
    in_units = _IN_SHEET_UNIT.get(column, column)
    if in_units in missions:
        return in_units
    return column


def columns_in_units(missions: Mapping[str, Any], units: Units) -> dict[str, Any]:
    """The columns in the units of a data sheet, of missions that have one.

    Args:
        missions: The columns of the missions, as records have them.
        units: What a slot and a data unit are, numbers or an array of one for each mission.
    """
    metrics = [m for m in _ALL if m.sheet_unit and m.column in missions]
    columns = {
        m.in_units.column: missions[m.column] * size_of(m.sheet_unit, units) for m in metrics
    }
    if NODE_AGES in missions:
        oldest = metric_of(OLDEST).in_units
        columns[NODES_BEHIND[oldest.column]] = missions[NODE_AGES] * size_of(oldest.unit, units)
    return columns


def size_of(unit: str, units: Units) -> float:
    """A slot, a data unit or a cell in a unit of time, data or length."""
    quantity, size = SHEET_UNITS[unit]
    return getattr(units, quantity) / size


def choose_units(units: Units | None) -> dict[str, tuple[str, float]]:
    """The units in which a player tells lengths, times and data, and what 1 of the model is."""
    if not units:
        return {"length": ("cells", 1), "time": ("mission slots", 1), "data": ("data units", 1)}
    return {what: (unit, size_of(unit, units)) for what, unit in DRAWN_UNITS.items()}


def format_length(slots: int, units: Units | None) -> str:
    """The length of a mission, as ``215 mission slots`` or ``1.25 h``."""
    if units:
        return printed(slots * units.slot, "s")
    return f"{slots} mission slots"
