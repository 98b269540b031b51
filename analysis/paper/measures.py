"""What our results say on each claim of the paper, and the rules of its verdict."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import hypot
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from analysis.answers import learning, main_effects, missions, summary
from analysis.answers.learning import Transfer, last_phase, settled
from analysis.answers.main_effects import Shape
from analysis.metrics import RATIO
from analysis.names import parameter, value_text
from analysis.paper import values
from analysis.paper.values import CROSSING
from analysis.results.tables import Results
from analysis.stats.intervals import Interval, bounded_interval, mean_interval, wilson
from analysis.stats.intervals import summary as means_of
from analysis.stats.verdict import (
    ABOVE,
    BELOW,
    HOLDS,
    IN_PART,
    INCONCLUSIVE,
    REFUTED,
    above,
    judged,
    position_by_test,
)
from analysis.study.selection import Choice


class MissingError(Exception):
    """Results that a claim needs are missing."""


class Pairs(NamedTuple):
    """The values of a parameter, compared with each other.

    Attributes:
        changes: The result of ``main_effects.changes``.
        positions: The position of every value, by its text.
    """

    changes: pd.DataFrame
    positions: Mapping[str, int]

    def position(self, value: str) -> int:
        """The position of a value."""
        if value not in self.positions:
            raise MissingError(f"the study lacks the value {value}")
        return self.positions[value]

    def leads(self, *values: str) -> pd.DataFrame:
        """How much higher the metric is at these values than at every other value (``other``)."""
        chosen = [self.position(value) for value in values]
        first, second = (self.changes[end].isin(chosen) for end in ("first", "second"))
        up, down = self.changes[second & ~first], self.changes[first & ~second]
        down = negated(down).assign(other=down["second"])
        return pd.concat([up.assign(other=up["first"]), down])

    def change(self, first: str, second: str) -> pd.Series:
        """How much the metric changes from one value to another."""
        return self.leads(second).set_index("other").loc[self.position(first)]


def negated(changes: pd.DataFrame) -> pd.DataFrame:
    """The differences with the opposite sign."""
    turned = {"difference": "difference", "low": "high", "high": "low"}
    turned |= {"wide_low": "wide_high", "wide_high": "wide_low"}
    return changes.assign(**{end: -changes[other] for end, other in turned.items()})


@dataclass(frozen=True, eq=False)
class EvidenceOfPolicy:
    """The results of one policy in one study."""

    results: Results
    policy: str

    @property
    def study(self) -> str:
        """The name of the study."""
        return str(self.results.manifest["study"]["name"])

    @cached_property
    def effects(self) -> pd.DataFrame:
        """The result of ``main_effects.effects``."""
        return main_effects.effects(self.results)

    def missions(self, uavs: int | None = None) -> pd.DataFrame:
        """The missions of the policy, or only those with a number of UAVs.

        For a study that selects a setting, these are the missions that check it, which were not
        used for the selection.
        """
        selects = self.results.manifest["study"]["selection"] is not None
        missions = self.results.checks if selects else self.results.missions
        chosen = missions["policy"] == self.policy
        if uavs is not None:
            chosen &= missions["uavs"] == uavs
        if not chosen.any():
            raise MissingError(f"the study {self.study} has no such mission")
        return missions[chosen]

    def pairs(self, field: str, metric: str, fewest_uavs: int = 1) -> Pairs:
        """The values of a parameter, compared mission by mission."""
        values = self.effects[self.effects["field"] == field].drop_duplicates("position")
        if len(values) < 2:
            raise MissingError(f"the study {self.study} does not vary {field}")
        changes = main_effects.changes(
            self.results, self.effects, self.policy, field, metric, fewest_uavs
        )
        return Pairs(changes, dict(zip(values["value"], values["position"], strict=True)))

    def logs(self, uavs: int) -> list[tuple[pd.DataFrame, np.ndarray]]:
        """The stored event logs of missions with a number of UAVs, each with the (K, 2) nodes."""
        missions, logged = self.missions(uavs), self.results.manifest["study"]["logged"]
        missions = missions[missions["replication"] < logged]
        if missions.empty:
            raise MissingError(f"the study {self.study} stores no event logs")
        return [
            (
                self.results.events(self.policy, point, replication),
                np.array(self.results.scenario(point).nodes),
            )
            for point, replication in missions[["point", "replication"]].itertuples(index=False)
        ]


def evidence_of_policy(
    studies: Mapping[str, Results], study: str, learner: str = "", policy: str = ""
) -> EvidenceOfPolicy:
    """The results of one policy of a study, by default of its best learned policy.

    Args:
        studies: Results by the name of the study.
        study: The study.
        learner: A learner, to take its best policy.
        policy: A policy, to take this one.
    """
    if study not in studies:
        raise MissingError(f"the study {study} has not been run")
    if policy:
        if policy not in studies[study].policies:
            raise MissingError(f"the study {study} has no policy {policy}")
        return EvidenceOfPolicy(studies[study], policy)
    learners = summary.learners(studies[study])
    wanted = [learner] if learner else [*learners]
    among = [trained for name in wanted for trained in learners.get(name, [])]
    if not among:
        which = f"policy {learner}" if learner else "learned policy"
        raise MissingError(f"the study {study} has no {which}")
    return EvidenceOfPolicy(studies[study], summary.best_policy(studies[study].missions, among))


class EvidenceOfTrainings(NamedTuple):
    """Learning curves, and the names of the variants with and without transfer learning."""

    trainings: pd.DataFrame
    using: str
    without: str

    def curves(self, metric: str) -> pd.DataFrame:
        """Smoothed curves of a metric."""
        return learning.smoothed(self.trainings, metric)

    def transfer(self, metric: str) -> learning.Transfer:
        """The trainings with transfer learning, compared with those without."""
        curves = self.curves(metric)
        return learning.transfer(curves, self.using, self.without, shortest=CROSSING)


def evidence_of_trainings(
    trainings: pd.DataFrame, variants: tuple[str, str] | None
) -> EvidenceOfTrainings:
    """The trainings of two variants, with transfer learning and without."""
    if variants is None:
        raise MissingError("no trainings of this policy with and without transfer learning")
    if trainings.empty or not {*variants} <= {*trainings["variant"]}:
        raise MissingError(f"no trainings {' and '.join(variants)}")
    return EvidenceOfTrainings(trainings, *variants)


NO_RESULTS = "no results"
VERDICTS = (HOLDS, IN_PART, INCONCLUSIVE, REFUTED, NO_RESULTS)
# The verdicts as pages write them: of claims that hold, those with an interval above the paper's
# number exceed it; what holds in part without such a number is inconclusive.
EXCEEDS, MATCHES, FALLS_SHORT, NOT_APPLICABLE = (
    "exceeds",
    "matches",
    "falls short",
    "does not apply",
)
OUTCOMES = (EXCEEDS, MATCHES, FALLS_SHORT, INCONCLUSIVE, NOT_APPLICABLE)

# A value is near a printed number if its interval is above that number - NEAR; a change is small if
# it is less than NEAR.
NEAR = 0.05
# A smaller difference does not matter, unless the study of the sweet spot gives another margin.
MARGIN = 0.01


# Means, shares and differences.


def reached(mean: Interval, printed: Interval) -> str:
    """Whether a printed number is reached."""
    difference = gap(mean, printed)
    near = difference.low > -NEAR
    if difference.high < 0:
        return IN_PART if near else REFUTED
    return HOLDS if near else INCONCLUSIVE


def gap(mean: Interval, printed: Interval) -> Interval:
    """How much higher a mean is than a printed number, which may have its own interval.

    The interval of the difference is computed from the two intervals (R. G. Newcombe, Statistics in
    Medicine 17 (1998) 873-890, method 10).
    """
    difference = mean.mean - printed.mean
    below = hypot(mean.mean - mean.low, printed.high - printed.mean)
    beyond = hypot(mean.high - mean.mean, printed.mean - printed.low)
    return Interval(difference, difference - below, difference + beyond)


def gained(difference: Interval, printed: Interval) -> str:
    """Whether a metric rises, and by as much as the paper prints."""
    near = difference.low > printed.mean - NEAR or None
    return judged(above(difference), near if difference.high >= printed.mean else False)


def higher(difference: Interval) -> str:
    """Whether a metric is higher."""
    return judged(above(difference))


def lower(difference: Interval) -> str:
    """Whether a metric is lower."""
    return higher(Interval(-difference.mean, -difference.high, -difference.low))


def slightly_lower(difference: Interval) -> str:
    """Whether a metric falls, but only slightly."""
    if difference.low > 0 or difference.high <= -NEAR:
        return REFUTED
    if difference.high >= 0:
        return INCONCLUSIVE
    return HOLDS if difference.low > -NEAR else IN_PART


def kept(difference: Interval, margin: float) -> str:
    """Whether a metric does not fall by more than the margin."""
    return judged(above(difference, -margin))


def most(share: Interval) -> str:
    """Whether something occurs in most missions."""
    return judged(above(share, 0.5))


def never_all(ratio: Interval, whole: Interval) -> str:
    """Whether the collection ratio stays below 100 %, by the share of missions that reach it."""
    if whole.mean == 1:
        return REFUTED
    never = whole.mean == 0 and whole.high < NEAR
    return judged(never or None, ratio.high < 1 or None)


# Who serves which nodes.


def ignored(share: Interval, beyond_others: Interval) -> str:
    """Whether most nodes of a kind are ignored, and more of them than of the others."""
    return judged(above(share, 0.5), above(beyond_others))


def divided(beyond_chance: Interval, division: Interval) -> str:
    """Whether UAVs have sectors, and nodes of their own."""
    return judged(above(beyond_chance), above(division, 0.75))


# The values of a parameter. ``leads`` are rows of ``main_effects.changes``, with signs such that a
# difference is the value in question minus another value.


def best(leads: pd.DataFrame) -> str:
    """Whether the metric is highest at a value."""
    tests = zip(leads["difference"], leads["p_adjusted"], strict=True)
    positions = {position_by_test(difference, p) for difference, p in tests}
    if BELOW in positions:
        return REFUTED
    return HOLDS if positions == {ABOVE} else INCONCLUSIVE


lowest = best  # of differences with the other sign


def no_lower(leads: pd.DataFrame, margin: float) -> str:
    """Whether the metric at some values is not lower than at all others, up to a margin."""
    if (leads["wide_high"] < -margin).any():
        return REFUTED
    return HOLDS if (leads["low"] > -margin).all() else INCONCLUSIVE


def alike(changes: pd.DataFrame, margin: float) -> str:
    """Whether the metric is the same at all values, up to a margin."""
    if ((changes["wide_low"] > margin) | (changes["wide_high"] < -margin)).any():
        return REFUTED
    within = (changes["low"] >= -margin) & (changes["high"] <= margin)
    return HOLDS if within.all() else INCONCLUSIVE


def rises(shape: Shape) -> str:
    """Whether the metric rises along the values."""
    verdicts = {main_effects.RISES: HOLDS, main_effects.LEVELS: INCONCLUSIVE}
    return verdicts.get(shape.words, REFUTED)


def peaks(shape: Shape, wanted: int) -> str:
    """Whether the metric rises up to a value and falls after it."""
    if wanted not in shape.peaks:
        return REFUTED
    return HOLDS if shape.words == main_effects.PEAK else INCONCLUSIVE


def chosen(choice: Choice, wanted: Collection[int]) -> str:
    """Whether a selection has chosen one of the design points with these numbers."""
    left = {choice.best, *choice.survivors}
    return judged(left <= {*wanted} or (None if left & {*wanted} else False))


# Learning curves, with transfer learning and without.


def passes(transfer: Transfer) -> str:
    """Whether the curve with transfer learning is above from some step to the end."""
    return transfer.verdict


def throughout(transfer: Transfer) -> str:
    """Whether the curve with transfer learning is above at every step."""
    in_part = transfer.verdict == HOLDS and not transfer.throughout
    return IN_PART if in_part else transfer.verdict


def levels_off(settled: float, transfer: Transfer) -> str:
    """Whether training without transfer learning levels off early, and at a low value."""
    if transfer.length < CROSSING:
        return INCONCLUSIVE
    return judged(settled <= 0.5 or None, above(transfer.last))


Unit = Literal["share", "points", "reward", "steps", "number"]

# Number of random permutations of the nodes, for the share that is expected by chance.
SHUFFLES = 100


class Quantity(NamedTuple):
    """A quantity with its interval, if it has one.

    Attributes:
        value: The value, in its unit.
        low: Lower end of the interval, or None.
        high: Upper end of the interval, or None.
        n: Number of missions or trainings that it is computed from; 0 if it is not known.
        unit: ``share``, ``points`` (for a difference of shares), ``reward``, ``steps`` (of a
            training) or ``number``.
        name: What the quantity is, if the claim does not say so.
    """

    value: float
    low: float | None = None
    high: float | None = None
    n: int = 0
    unit: Unit = "share"
    name: str = ""

    @property
    def interval(self) -> Interval:
        """The value and the ends; without an interval, the ends are equal to the value."""
        low = self.value if self.low is None else self.low
        return Interval(self.value, low, self.value if self.high is None else self.high)


class Measured(NamedTuple):
    """What is measured for a claim.

    Attributes:
        arguments: The arguments for the judge of the claim's rule.
        quantities: The quantities to show; the first one is compared with the paper's number.
        note: A remark in words.
    """

    arguments: tuple[Any, ...]
    quantities: tuple[Quantity, ...]
    note: str = ""

    @classmethod
    def of(cls, *quantities: Quantity) -> "Measured":
        """Quantities whose intervals are the arguments of the judge."""
        return cls(tuple(quantity.interval for quantity in quantities), quantities)


# Means.


def mean(evidence: EvidenceOfPolicy, metric: str, uavs: int | None = None) -> Measured:
    """The mean of a metric over all missions, or over those with a number of UAVs."""
    return Measured.of(_mean_of(evidence.missions(uavs), metric))


def missed_data(evidence: EvidenceOfPolicy) -> Measured:
    """The mean collection ratio, and the share of missions that collected everything."""
    missions = evidence.missions()
    everything = missions[RATIO].to_numpy() >= 1
    name = "missions that collected everything"
    return Measured.of(_mean_of(missions, RATIO), _share_of(everything, name))


# Event logs.


def single_charges(evidence: EvidenceOfPolicy) -> Measured:
    """The share of missions in which a lone UAV charges once."""
    charges = [(events["event"] == "charge_start").sum() for events, _ in evidence.logs(uavs=1)]
    return Measured.of(_share_of(np.array(charges) == 1, "missions with one charge"))


def ignored_nodes(evidence: EvidenceOfPolicy) -> Measured:
    """The shares of nodes that a lone UAV ignores, on the far edges and elsewhere."""
    far, others = np.transpose([_left_behind(*log) for log in evidence.logs(uavs=1)])
    shares = _mean_share(far, "ignored of these nodes"), _mean_share(others, "of the others")
    return Measured((shares[0].interval, mean_interval(far - others)), shares)


def reached_nodes(evidence: EvidenceOfPolicy) -> Measured:
    """How many more nodes on the far edges two UAVs reach than one UAV, in the same missions."""
    one, two = ([_left_behind(*log)[0] for log in evidence.logs(uavs)] for uavs in (1, 2))
    more = np.array([alone - team for alone, team in zip(one, two, strict=False)])
    name = "more of these nodes than by a lone UAV"
    gain = Quantity(*mean_interval(more), len(more), "points", name)
    return Measured(
        (gain.interval,), (gain, _mean_share(1 - np.array(two), "of these nodes not ignored"))
    )


def sectors(evidence: EvidenceOfPolicy) -> Measured:
    """The share of data that two UAVs collect on their own sides, and the share by chance."""
    generator = np.random.default_rng(evidence.results.store.manifest.seed)
    rows = [row for log in evidence.logs(uavs=2) if (row := _division(*log, generator))]
    if not rows:
        raise MissingError("no data was collected")
    sides, chance, most = np.transpose(rows)
    quantities = (
        _mean_share(sides, "data collected on the own side"),
        Quantity(float(np.mean(chance)), name="by chance"),
        _mean_share(most, "data by the UAV that serves the node most"),
    )
    return Measured((mean_interval(sides - chance), quantities[2].interval), quantities)


def _left_behind(events: pd.DataFrame, nodes: np.ndarray) -> tuple[float, float]:
    """The shares of nodes left behind: of those on the far edges, and of the others."""
    left = missions.left_behind(events, len(nodes))
    far = missions.far_edges(nodes)
    if far.all():
        raise MissingError("all nodes are on the edges")
    return float(left[far].mean()), float(left[~far].mean())


def _division(
    events: pd.DataFrame, nodes: np.ndarray, generator: np.random.Generator
) -> tuple[float, ...]:
    """The share on the own side, the share by chance, and that of the UAV that serves most."""
    data = missions.collected(events, 2, len(nodes))
    if not data.any():
        return ()
    shuffled = (generator.permutation(data, axis=1) for _ in range(SHUFFLES))
    chance = np.mean([missions.sectors(by_chance, nodes) for by_chance in shuffled])
    return missions.sectors(data, nodes), float(chance), missions.division(data)


# The values of a parameter, compared mission by mission.


def change(
    evidence: EvidenceOfPolicy,
    field: str,
    metric: str,
    first: str,
    second: str,
    fewest_uavs: int = 1,
) -> Measured:
    """How much a metric changes from one value of a parameter to another."""
    pairs = evidence.pairs(field, metric, fewest_uavs)
    return Measured.of(_points(pairs.change(first, second)))


def lead(
    evidence: EvidenceOfPolicy, field: str, metric: str, values: Sequence[str], name: str = ""
) -> Measured:
    """How much higher a metric is at some values of a parameter than at all others."""
    leads = evidence.pairs(field, metric).leads(*values)
    name = name or f"{setting(field, values[0])} above the next best"
    return Measured((leads,), (_least(leads, name),))


def lag(evidence: EvidenceOfPolicy, field: str, metric: str, value: str) -> Measured:
    """How much lower a metric is at a value of a parameter than at all others."""
    lags = negated(evidence.pairs(field, metric).leads(value))
    return Measured((lags,), (_least(lags, "the next lowest is higher by"),))


def spread(evidence: EvidenceOfPolicy, field: str, metric: str) -> Measured:
    """The differences between all values of a parameter."""
    changes = evidence.pairs(field, metric).changes
    largest = changes.loc[changes["difference"].abs().idxmax()]
    return Measured((changes,), (_points(largest, "largest difference"),))


def course(evidence: EvidenceOfPolicy, field: str, metric: str) -> Measured:
    """How a metric changes along the values of a parameter, from the first to the last."""
    pairs = evidence.pairs(field, metric)
    first, *_, last = pairs.positions
    shape = main_effects.shape(pairs.changes)
    tops = [value for value, position in pairs.positions.items() if position in shape.peaks]
    peak = f", highest at {' or '.join(tops)}" if shape.words == main_effects.PEAK else ""
    quantity = _points(pairs.change(first, last), f"from {first} to {last}")
    return Measured((shape,), (quantity,), f"it {shape.words}{peak}")


def peak(evidence: EvidenceOfPolicy, field: str, metric: str, value: str) -> Measured:
    """The result of ``course``, with the lead of a value over all others."""
    pairs, along = evidence.pairs(field, metric), course(evidence, field, metric)
    ahead = _least(pairs.leads(value), f"{setting(field, value)} above the best other")
    return Measured((*along.arguments, pairs.position(value)), (ahead,), along.note)


def selected_uavs(evidence: EvidenceOfPolicy) -> Measured:
    """The number of UAVs in the setting that a study selects."""
    choice = evidence.results.choice(evidence.policy)
    points = evidence.results.store.manifest.points
    if choice is None or "uavs" not in points[choice.best].values:
        raise MissingError(f"the study {evidence.study} selects no number of UAVs")
    wanted = [n for n, point in enumerate(points) if point.values.get("uavs") == values.BEST_UAVS]
    best = points[choice.best].values
    uavs = Quantity(best["uavs"], n=choice.missions, unit="number", name="UAVs")
    note = ", ".join(setting(field, value_text(value)) for field, value in best.items())
    return Measured((choice, wanted), (uavs,), note)


def setting(field: str, value: str) -> str:
    """``C_S 30``."""
    return f"{parameter(field).short} {value}"


# Learning curves.


def final_lead(evidence: EvidenceOfTrainings, metric: str, unit: Unit) -> Measured:
    """How much higher training with transfer learning ends than training without it."""
    transfer = evidence.transfer(metric)
    variants = f"trainings {evidence.using} and {evidence.without}"
    note = f"{variants}: {transfer.course}{_if_short(transfer)}"
    return Measured((transfer,), _at_the_end(transfer, unit), note)


def level_from(evidence: EvidenceOfTrainings, metric: str) -> Measured:
    """The step from which on the mean curve without transfer learning stays near its end."""
    transfer, curves = evidence.transfer(metric), evidence.curves(metric)
    means = last_phase(curves, evidence.without).mean(axis="columns")
    since = int(means.index[settled(means, MARGIN)])
    level = Quantity(since, unit="steps", name="level from")
    quantities = level, *_at_the_end(transfer, "points")
    note = f"trainings {evidence.without}{_if_short(transfer)}"
    return Measured((since / means.index[-1], transfer), quantities, note)


def _at_the_end(transfer: Transfer, unit: Unit) -> tuple[Quantity, Quantity]:
    """The last difference, and how long the trainings are."""
    last = Quantity(*transfer.last, min(transfer.trainings), unit, "with transfer, at the end")
    return last, Quantity(transfer.length, unit="steps", name="length of the trainings")


def _if_short(transfer: Transfer) -> str:
    return "" if transfer.length >= values.CROSSING else "; too short to tell"


# Figures.


def _mean_of(missions: pd.DataFrame, metric: str) -> Quantity:
    row = means_of(missions, by=[]).set_index("metric").loc[metric]
    return Quantity(float(row["mean"]), float(row["low"]), float(row["high"]), int(row["n"]))


def _share_of(occurs: np.ndarray, name: str) -> Quantity:
    """The share of missions in which something occurs."""
    return Quantity(*wilson(int(occurs.sum()), len(occurs)), n=len(occurs), name=name)


def _mean_share(values: np.ndarray, name: str) -> Quantity:
    """The mean of a share per mission."""
    return Quantity(*bounded_interval(values), n=len(values), name=name)


def _points(row: pd.Series, name: str = "") -> Quantity:
    """A row of ``main_effects.changes``."""
    value, low, high = (float(row[column]) for column in ("difference", "low", "high"))
    return Quantity(value, low, high, int(row["n"]), "points", name)


def _least(leads: pd.DataFrame, name: str) -> Quantity:
    return _points(leads.sort_values("difference", kind="stable").iloc[0], name)
