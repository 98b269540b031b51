"""Measures for the paper's claims: functions from evidence to the quantities that a rule judges.

A claim contains one of these functions, with the metric and values filled in:

    >>> partial(mean, metric="success")(evidence).quantities
"""

from collections.abc import Sequence
from typing import Any, Literal, NamedTuple

import numpy as np
import pandas as pd

from analysis.names import RATIO, parameter, value_text
from analysis.questions import main_effects, node_shares
from analysis.questions.learning.curves import Transfer, last_phase, settled
from analysis.replication import paper
from analysis.replication.evidence_of_policy import (
    EvidenceOfPolicy,
    EvidenceOfTrainings,
    MissingError,
    negated,
)
from analysis.replication.verdict_rules import MARGIN
from analysis.stats.intervals import Interval, bounded_interval, mean_interval, summary, wilson

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
    left = node_shares.left_behind(events, len(nodes))
    far = node_shares.far_edges(nodes)
    if far.all():
        raise MissingError("all nodes are on the edges")
    return float(left[far].mean()), float(left[~far].mean())


def _division(
    events: pd.DataFrame, nodes: np.ndarray, generator: np.random.Generator
) -> tuple[float, ...]:
    """The share on the own side, the share by chance, and that of the UAV that serves most."""
    data = node_shares.collected(events, 2, len(nodes))
    if not data.any():
        return ()
    shuffled = (generator.permutation(data, axis=1) for _ in range(SHUFFLES))
    chance = np.mean([node_shares.sectors(by_chance, nodes) for by_chance in shuffled])
    return node_shares.sectors(data, nodes), float(chance), node_shares.division(data)


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
    wanted = [n for n, point in enumerate(points) if point.values.get("uavs") == paper.BEST_UAVS]
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
    return "" if transfer.length >= paper.CROSSING else "; too short to tell"


# Figures.


def _mean_of(missions: pd.DataFrame, metric: str) -> Quantity:
    row = summary(missions, by=[]).set_index("metric").loc[metric]
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
