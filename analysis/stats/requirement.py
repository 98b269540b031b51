"""A requirement: a bound that the mean of a metric has to keep, in words and by its interval."""

from dataclasses import dataclass
from typing import Any

from dess.analysis.metrics import Metric
from dess.analysis.stats.verdict import Verdict, judge_margins


@dataclass(frozen=True)
class Requirement:
    """A bound that the mean of a metric has to keep.

    Attributes:
        metric: The metric, as the missions have it: with a data sheet in its unit. It is told in
            the unit in which it was required.
        bound: The least mean, or the largest of a metric of which less is better.
    """

    metric: Metric
    bound: float

    @property
    def column(self) -> str:
        """The column of the metric in tables of missions."""
        return self.metric.column

    @property
    def in_words(self) -> str:
        """The requirement, as ``success of at least 99 %``."""
        return f"{self.metric.within} of {self.bound_in_words}"

    @property
    def bound_in_words(self) -> str:
        """The bound alone, as ``at least 99 %``."""
        if self.metric.less_is_better:
            side = "at most"
        else:
            side = "at least"
        return f"{side} {self.metric.amount(self.bound)}"

    def shifted(self, tolerance: float, horizon: float) -> "Requirement":
        """The requirement that is easier by the tolerance of a search.

        Args:
            tolerance: The tolerance, of an age as a share of the horizon.
            horizon: The largest age that data can have.
        """
        if self.metric.less_is_better:
            return Requirement(self.metric, self.bound + tolerance * horizon)
        return Requirement(self.metric, self.bound - tolerance)

    def margin(self, value: Any) -> Any:
        """How far a value, or each of an array, is on the right side; negative on the wrong one."""
        if self.metric.less_is_better:
            return self.bound - value
        return value - self.bound

    def judge(self, low: float, high: float) -> Verdict:
        """Whether a whole interval keeps the bound, breaks it, or neither."""
        return judge_margins(self.margin(low), self.margin(high))
