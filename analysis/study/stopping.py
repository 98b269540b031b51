"""Sequential stopping: add replications until the confidence intervals are narrow enough."""

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, NamedTuple, Self, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    ValidationError,
    model_validator,
)

from dess import InputError
from dess.analysis.metric_ranges import metric_in_missions
from dess.analysis.metrics import NODES_BEHIND, Metric, metric_group, metric_of
from dess.analysis.stats.kinds import LEVEL, Sample, ends_of_means, skewness_of
from dess.analysis.stats.worst_node import worst_and_spread
from dess.base.errors import listed, shown, to_input_error, unknown_name
from dess.physics.section import Integer, Number, plain

_TARGETS = metric_group("paper", "reward", "operations")

# For each design point a mapping from metrics to their (n,) values in replications 0..n-1.
Samples = Sequence[Mapping[str, np.ndarray]]

# The largest number of missions that a rule may ask for.
MOST_MISSIONS = 1_000_000_000
# No round multiplies the number of missions of a cell by more than this.
_GROWTH = 2.0


def _check_printable(text: str) -> str:
    if not text.isprintable():  # also half a character, which no encoding can write
        raise InputError("", f"{shown(text)} has characters that cannot be printed", "a line")
    return text


def _check_metric(metric: str) -> str:
    if metric not in _TARGETS:
        raise unknown_name("", f"{shown(metric)} is unknown", metric, _TARGETS)
    return metric


# A metric of missions; those of operations only where the scenario measures them.
MetricName = Annotated[str, AfterValidator(_check_metric)]
# A line of text, such as a name.
Line = Annotated[str, AfterValidator(_check_printable)]
Text = Annotated[Line, Field(max_length=4000)]


class StrictTable(BaseModel):
    """A table of a study's TOML file: frozen, without unknown keys, strictly typed."""

    model_config = ConfigDict(frozen=True, extra="forbid", strict=True)

    @model_validator(mode="before")
    @classmethod
    def _numbers_of_numpy(cls, values: Any) -> Any:
        is_table = isinstance(values, dict)
        if is_table:
            return {key: plain(value) for key, value in values.items()}
        return values


def of_its_kind(key: str, *models: type[BaseModel]) -> BeforeValidator:
    """Read a table as the model that one of its keys names, so that errors name this model alone.

    Args:
        key: The key. Each model allows some values of it, such as ``kind = "grid"``.
        models: The models.
    """
    kinds = {name: m for m in models for name in get_args(m.model_fields[key].annotation)}

    def read(value: Any) -> Any:
        if not isinstance(value, dict):
            return value
        kind = value.get(key)
        if not isinstance(kind, str) or kind not in kinds:
            raise unknown_name(key, f"{shown(kind)} is unknown", kind, kinds)
        try:
            return kinds[kind].model_validate(value)
        except ValidationError as error:
            raise to_input_error(error, kind, kinds[kind]) from None

    return BeforeValidator(read)


class Target(StrictTable):
    """How narrow an interval must be; one of the two half-widths has to be reached."""

    absolute: Number | None = Field(
        None, ge=1e-9, le=10**9, description="half-width in units of the metric"
    )
    relative: Number | None = Field(
        None, ge=1e-9, le=10**9, description="half-width as a share of |mean|"
    )

    @model_validator(mode="after")
    def _is_given(self) -> Self:
        if self.absolute is None and self.relative is None:
            raise InputError("", "no target is given", "absolute, relative, or both")
        return self

    def width(self, means: np.ndarray) -> np.ndarray:
        """The largest half-widths that meet the target, for these means."""
        return np.maximum(self.absolute or 0.0, (self.relative or 0.0) * np.abs(means))


class Reached(NamedTuple):
    """The result of a stopping rule for one metric of a design point.

    Attributes:
        point: Number of the design point.
        metric: The metric.
        missions: Number of missions that the estimate is based on.
        mean: The estimate.
        half_width: Half the length of its 95 % interval.
        target: The half-width that meets the target at this mean.
        met: Whether the target was met throughout the look-ahead after the stopping point or, if
            there is none, throughout the last missions.
        stop: The stopping point of the cell [missions]; None if it was not reached.
    """

    point: int
    metric: str
    missions: int
    mean: float
    half_width: float
    target: float
    met: bool
    stop: int | None


class Precision(StrictTable):
    """The rule that missions are added to a cell until its 95 % intervals are narrow enough.

    The half-widths are half the lengths of the intervals of ``stats.intervals.interval_of``:
    Wilson's interval for ``success``, and those of ``stats.kinds.ends_of_means`` for the
    others; that of the worst node holds whichever node it is (``worst_of_nodes``). They are not
    post-stratified by the number of UAVs, so where it is drawn, the printed intervals are narrower.
    The *stopping point* is the first n >= ``first`` at which all targets
    are met with n, n + 1, ..., n + ``look_ahead`` missions.
    Without the look-ahead, a sample whose interval is narrow by chance would stop too
    early. The cell keeps the missions of the look-ahead.

    The stopping point depends only on the values of the missions, not on the rounds in which they
    are simulated. The size of a round is an estimate of what is still needed, and a careful one, so
    that a cell seldom ends with more than ``look_ahead`` missions after its stopping point. If it
    does, these missions are kept as well. The number of missions is a function of the cell's values
    in the order of their replications, so it is the same whether or not a run was interrupted.

    After stopping, the coverage of the intervals is about as good as with a fixed number of
    missions. The intervals allow for failures that no mission has shown yet, so a narrow one takes
    many missions: a half-width of one percentage point takes about 100 to 200 missions even if none
    of them fails.

    Source: K. Hoad, S. Robinson, R. Davies, Automated selection of the number of replications for
    a discrete-event simulation, J. Oper. Res. Soc. 61 (2010) 1632-1644. In contrast to the article,
    relative half-widths are taken of |mean|, since a negative mean would meet any target at once.

    Raises:
        pydantic.ValidationError: If a field is not valid.
    """

    first: Integer = Field(
        30, ge=2, le=MOST_MISSIONS, description="missions of a cell before the first check"
    )
    look_ahead: Integer = Field(
        50,
        ge=0,
        le=MOST_MISSIONS,
        description="further missions in which the targets must hold as well",
    )
    budget: Integer = Field(5000, ge=2, le=MOST_MISSIONS, description="missions of a cell at most")
    targets: dict[MetricName, Target] = Field(
        min_length=1, description="metric -> { absolute = ..., relative = ... }"
    )

    @model_validator(mode="after")
    def _is_affordable(self) -> Self:
        if (least := self.first + self.look_ahead) > self.budget:
            raise InputError(
                "budget", f"{self.budget} is less than first + look_ahead", f"{least} or more"
            )
        return self

    def wanted(self, samples: Samples, settings: Sequence[Any] = ()) -> list[int]:
        """The number of missions that every design point needs.

        Args:
            samples: The missions of every design point.
            settings: The design points; this rule does not need them.

        Returns:
            For each design point at least the n missions given; exactly n if no more are needed.
        """
        return [self._wanted(sample) for sample in samples]

    def reached(self, samples: Samples) -> list[Reached]:
        """Whether the targets were met: a row per design point and metric.

        Args:
            samples: The missions of every design point, one or more of each.
        """
        return [row for point, sample in enumerate(samples) for row in self._rows(point, sample)]

    def _wanted(self, sample: Mapping[str, np.ndarray]) -> int:
        excess = np.max([self._excess(metric, sample) for metric in self.targets], axis=0)
        last_miss = self._last_miss(excess)
        stop = self._stop(last_miss)
        if stop is None:
            enough = self.budget
        else:
            enough = min(stop, self.budget)
        count = self.first
        while count < enough and count <= len(excess):
            # About count * excess^2 missions are needed. We ask for count * excess, which is less
            # and never too many for an absolute target, because sums of squares can only grow.
            ahead = int(count * min(excess[count - 1], _GROWTH))
            certain = int(last_miss[count - 1]) + 1 + self.look_ahead
            count = min(max(ahead, certain), self.budget)
        return max(count, len(excess))

    def _rows(self, point: int, sample: Mapping[str, np.ndarray]) -> list[Reached]:
        ratios = {metric: self._excess(metric, sample) for metric in self.targets}
        stop = self._stop(self._last_miss(np.max(list(ratios.values()), axis=0)))
        rows = []
        for metric, target in self.targets.items():
            means, widths = _running_interval_in(sample, metric)
            is_met = len(means) - int(self._last_miss(ratios[metric])[-1]) > self.look_ahead
            mean, width, allowed = (
                float(column[-1]) for column in (means, widths, target.width(means))
            )
            met = stop is not None or is_met
            rows.append(Reached(point, metric, len(means), mean, width, allowed, met, stop))
        return rows

    def _excess(self, metric: MetricName, sample: Mapping[str, np.ndarray]) -> np.ndarray:
        """Half-width / target after 1..n missions; at most 1 where the target is met."""
        means, widths = _running_interval_in(sample, metric)
        allowed = self.targets[metric].width(means)
        never = np.where(widths > 0, np.inf, 0.0)
        return np.divide(widths, allowed, out=never, where=allowed > 0)

    def _last_miss(self, excess: np.ndarray) -> np.ndarray:
        """The last count up to 1..n missions at which a target was missed or not checked."""
        counts = np.arange(1, len(excess) + 1)
        missed = (excess > 1) | (counts < self.first)
        return np.maximum.accumulate(np.where(missed, counts, 0))

    def _stop(self, last_miss: np.ndarray) -> int | None:
        counts = np.arange(1, len(last_miss) + 1)
        complete = np.flatnonzero(counts - last_miss > self.look_ahead)
        if complete.size:
            return int(counts[complete[0]]) - self.look_ahead
        return None


def values_in(sample: Mapping[str, np.ndarray], metric: str) -> np.ndarray:
    """The values of a metric of missions.

    Raises:
        InputError: If the scenario does not measure it.
    """
    if metric not in sample:
        present = [name for name in _TARGETS if name in sample]
        raise InputError(metric, "is not measured by the scenario", listed(present))
    return np.asarray(sample[metric], float)


def _running_interval_in(
    sample: Mapping[str, np.ndarray], metric: str
) -> tuple[np.ndarray, np.ndarray]:
    """The ``running_interval`` of a metric of missions, with the range that it has in them."""
    values = values_in(sample, metric)
    measure = metric_in_missions(sample, metric)
    nodes = NODES_BEHIND.get(metric, "")
    if nodes in sample:
        return running_interval_of_worst(measure, np.stack([*sample[nodes]]))
    return running_interval(measure, values)


def running_interval(metric: str | Metric, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Means of the first 1..n values, and the half-widths of their 95 % confidence intervals.

    Args:
        metric: Its interval is that of ``stats.intervals.interval_of``.
        values: (n,) values; nan where a mission has not measured the metric.

    Returns:
        (n,) means and (n,) half-widths. Without bounds, the half-width of a single value is
        infinite, and so is that of no value.
    """
    measure = metric_of(metric)
    sample = np.asarray(values, float)
    present = ~np.isnan(sample)
    if not present.all():
        means, widths = running_interval(measure, sample[present])
        place = np.cumsum(present)
        return np.append(0.0, means)[place], np.append(np.inf, widths)[place]
    running = _running_sample(sample, measure.is_outcome)
    return running.mean, _half_widths(ends_of_means(measure, running))


def running_interval_of_worst(metric: Metric, by_node: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The ``running_interval`` of the worst node, whose interval is that of ``worst_of_nodes``.

    Which node is the worst may change from one mission to the next. The interval holds whichever it
    is, so its length may be waited for like that of any other mean.

    Args:
        metric: The metric, of K nodes.
        by_node: (n, K) values.

    Returns:
        (n,) means and (n,) half-widths.
    """
    rows = np.arange(len(by_node))
    of_nodes = [_running_sample(values) for values in by_node.T]
    means, variances, skewness, counts = (
        np.stack([getattr(running, name) for running in of_nodes], axis=-1)
        for name in ("mean", "variance", "skewness", "n")
    )
    level = metric.level_of_each(LEVEL)
    ends = ends_of_means(metric, Sample(means, variances, skewness, counts), level)
    worst, farthest, scale = worst_and_spread(means, np.stack(ends, axis=-1), metric)
    spread = variances[rows, farthest] * scale**2
    skew = np.where(spread > 0, skewness[rows, farthest], 0.0)
    of_worst = Sample(means[rows, worst], spread, skew, rows + 1)
    return of_worst.mean, _half_widths(ends_of_means(metric, of_worst, level))


def _running_sample(values: np.ndarray, is_of_outcomes: bool = False) -> Sample:
    """The samples of the first 1..n values."""
    counts = np.arange(1, len(values) + 1)
    origin = values[:1]  # so that equal values give a width of exactly 0
    if is_of_outcomes:  # whose sums are exact
        origin = np.zeros(1)
    shifted = values - origin
    means = np.cumsum(shifted) / counts
    before = np.concatenate([[0.0], means[:-1]])[: len(values)]
    squares = np.cumsum((counts - 1) / counts * (shifted - before) ** 2)  # Welford
    sums = np.cumsum(shifted**3) - 3 * means * np.cumsum(shifted**2)
    skewness = skewness_of(squares, sums + 2 * counts * means**3, counts)
    return Sample(origin + means, squares / counts, skewness, counts, is_of_outcomes)


def _half_widths(ends: tuple[np.ndarray, np.ndarray]) -> np.ndarray:
    """Half the lengths of intervals; infinite where a single value has none."""
    low, high = ends
    widths = (high - low) / 2
    return np.where(np.isnan(widths), np.inf, widths)
