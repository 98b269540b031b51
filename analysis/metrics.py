"""The metrics of missions: what they are called, measured in, and how they are written."""

from collections.abc import Callable, Container
from dataclasses import dataclass
from typing import Literal

from dess.analysis import numbers
from dess.record import OPERATIONS

Kind = Literal["outcome", "share", "number", "cost"]


@dataclass(frozen=True)
class Metric:
    """A metric, and all that is known of it wherever it is estimated, drawn or written.

    Attributes:
        column: Its column in a table of missions.
        name: What pages call it.
        unit: The unit; empty for shares and counts.
        kind: An ``outcome`` is 0 or 1 in each mission, and its mean has Wilson's interval. The
            values of a ``share`` lie between 0 and 1, and so do the ends of its intervals. The
            mean of a ``number`` and of a ``cost`` has Student's interval.
        less_is_better: Whether a lower value is better.
        in_percent: Whether it is written in percent, and its differences in percentage points.
    """

    column: str
    name: str
    unit: str = ""
    kind: Kind = "number"
    less_is_better: bool = False
    in_percent: bool = False

    @property
    def label(self) -> str:
        """The name with its unit."""
        return f"{self.name} [{self.unit}]".removesuffix(" []")

    @property
    def within(self) -> str:
        """The name as it is written inside a sentence."""
        return self.name.lower()

    @property
    def head(self) -> str:
        """The name above a column in the terminal."""
        return self.within if self.in_percent else self.label

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
        """The unit in which an axis of a figure is written, as for ``style.in_units``."""
        return "%" if self.in_percent else ""

    @property
    def write(self) -> Callable[[float], str]:
        """Writes a value."""
        return numbers.percent if self.in_percent else numbers.quantity

    @property
    def written(self) -> Callable[[float, float, float], str]:
        """Writes an estimate and the ends of its interval."""
        if self.kind == "cost":
            return numbers.amounts
        return numbers.interval if self.in_percent else numbers.quantities

    @property
    def change(self) -> Callable[[float, float, float], str]:
        """Writes a difference and the ends of its interval."""
        return numbers.points if self.in_percent else numbers.quantities


SUCCESS, RATIO, HOME = "success", "collection_ratio", "home"
PRODUCT, REWARD = "collection_ratio_and_communication", "reward"
AGE, COST = "age", "cost"  # a cost have the missions of a study with prices
# Of a study with bounds: the bound, and the bound minus the product.
BOUND, GAP = "upper_bound", "optimality_gap"

_SLOTS = "mission slots"
# The paper's metrics, in its order (Section VI-A). It calls them successful communication,
# collection ratio, and collection ratio and communication; the last is here the product of each
# mission.
_PAPER = (
    Metric(SUCCESS, "Success", kind="outcome", in_percent=True),
    Metric(RATIO, "Collection ratio", kind="share", in_percent=True),
    Metric(PRODUCT, "Product", kind="share", in_percent=True),
)
_OTHERS = (
    Metric(HOME, "Battery for the way home", kind="outcome", in_percent=True),
    Metric(REWARD, "Reward"),
    Metric(BOUND, "Upper bound"),
    Metric(GAP, "Optimality gap", less_is_better=True),
    Metric(COST, "Cost", kind="cost", less_is_better=True),
)
# Those of ``OPERATIONS``, which only extended scenarios measure.
_MEASURED = (
    Metric(AGE, "Age of information", _SLOTS, less_is_better=True),
    Metric("peak_age", "Peak age of information", _SLOTS, less_is_better=True),
    Metric("age_p99", "99th percentile of the age", _SLOTS, less_is_better=True),
    Metric("latency", "Latency", _SLOTS, less_is_better=True),
    Metric("latency_p99", "99th percentile of the latency", _SLOTS, less_is_better=True),
    Metric("generated", "Packets generated"),
    Metric("delivered", "Packets delivered"),
    Metric("lost_packets", "Packets lost", less_is_better=True),
    Metric("lost", "Data lost", "data units", less_is_better=True),
    Metric("queue", "UAVs waiting for a pad", less_is_better=True),
    Metric("waiting", "Waiting time for a pad", _SLOTS, less_is_better=True),
    Metric("pad_requests", "Requests for a pad"),
    Metric("utilisation", "Utilisation of the pads", kind="share"),
    Metric("failures", "Failures of UAVs", less_is_better=True),
    Metric("slots_grounded", "Time under repair", _SLOTS, less_is_better=True),
)
_KNOWN = {metric.column: metric for metric in (*_PAPER, *_OTHERS, *_MEASURED)}

METRICS = {metric.column: metric.name for metric in _PAPER}  # the paper's metrics, with their names
MEASURES = {metric.column: metric for metric in _MEASURED}
ALWAYS = (*METRICS, REWARD)  # the metrics of every mission
# Short names of metrics on the command line.
ALIASES = {"ratio": RATIO, "product": PRODUCT}


def metric_of(column: str) -> Metric:
    """The metric of a column of missions; one that nothing is known of is named after the column.

    Of such a metric more is better, and its values have no bounds.
    """
    return _KNOWN.get(column) or Metric(column, column.replace("_", " ").capitalize())


def measured_in(missions: Container[str]) -> list[str]:
    """The metrics of extended scenarios that a table of missions, or a row of it, has."""
    return [name for name in OPERATIONS.names or () if name in missions]


def metrics_in(missions: Container[str]) -> list[str]:
    """The metrics that a table of missions has: those of the paper, then all others."""
    others = [name for name in (HOME, BOUND, GAP) if name in missions]
    return [*ALWAYS, *others, *measured_in(missions)]
