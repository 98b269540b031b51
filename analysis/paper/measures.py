"""What our results say on each claim of the paper: the evidence, and what is measured in it."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple, Self

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers import missions
from dess.analysis.answers.settings import shapes
from dess.analysis.answers.settings.effects import means_by_field
from dess.analysis.answers.training.curves import last_phase, settling_position, smooth_curves
from dess.analysis.answers.training.transfer import Transfer, compare_transfer
from dess.analysis.answers.training.variants import LEARNED, last_rows
from dess.analysis.metrics import RATIO, SUCCESS
from dess.analysis.names import field_named, value_text
from dess.analysis.paper import values
from dess.analysis.paper.rules import MARGIN
from dess.analysis.results.tables import Results
from dess.analysis.stats.groups import summary as means_of
from dess.analysis.stats.intervals import Interval, bounded_interval, mean_interval, share_interval
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import ABOVE, BELOW, HOLDS, IN_PART, INCONCLUSIVE, REFUTED


class MissingError(Exception):
    """Results that a claim needs are missing."""


class Pairs(NamedTuple):
    """The values of a parameter, compared with each other.

    Attributes:
        field: The parameter.
        changes: The result of ``shapes.compare_values``.
        positions: The position of every value, by its text.
    """

    field: str
    changes: pd.DataFrame
    positions: Mapping[str, int]

    @property
    def shape(self) -> shapes.Shape:
        """How the metric changes along the values."""
        return shapes.shape_of_changes(self.changes)

    @property
    def course(self) -> str:
        """The shape in words."""
        shape = self.shape
        tops = [value for value, position in self.positions.items() if position in shape.peaks]
        peak = ""
        if shape.words == shapes.PEAK:
            peak = f", highest at {' or '.join(tops)}"
        differ = self.changes["p_adjusted"] <= 1 - LEVEL
        sure = self.changes.loc[differ, "difference"]
        counts = f"{(sure > 0).sum()} rises and {(sure < 0).sum()} falls"
        return f"it {shape.words}{peak}: of {len(differ)} pairs of values, {counts} are sure"

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
        down = negate_changes(down).assign(other=down["second"])
        return pd.concat([up.assign(other=up["first"]), down])

    def change(self, first: str, second: str) -> pd.Series:
        """How much the metric changes from one value to another."""
        return self.leads(second).set_index("other").loc[self.position(first)]


def negate_changes(changes: pd.DataFrame) -> pd.DataFrame:
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
        return self.results.study.name

    @cached_property
    def effects(self) -> pd.DataFrame:
        """The result of ``effects.means_by_field``."""
        return means_by_field(self.results)

    def missions(self, uavs: int | None = None) -> pd.DataFrame:
        """The missions of the policy, or only those with a number of UAVs.

        For a study that selects a setting, these are the missions that check it, which were not
        used for the selection.
        """
        selects = self.results.study.selection is not None
        if selects:
            missions = self.results.checks
        else:
            missions = self.results.missions
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
        changes = shapes.compare_values(self.results, self.policy, field, metric, fewest_uavs)
        return Pairs(field, changes, dict(zip(values["value"], values["position"], strict=True)))

    def logs(self, uavs: int) -> list[tuple[pd.DataFrame, np.ndarray]]:
        """The stored event logs of missions with a number of UAVs, each with the (K, 2) nodes."""
        missions = self.missions(uavs)
        logged = self.results.study.logged
        missions = missions[missions["replication"] < logged]
        if missions.empty:
            raise MissingError(f"the study {self.study} stores no event logs")
        which = missions[["point", "replication"]].itertuples(index=False)
        results = self.results
        return [
            (results.events(self.policy, point, n), np.array(results.scenario(point).nodes))
            for point, n in which
        ]


class EvidenceOfTrainings(NamedTuple):
    """Learning curves, and the names of the variants with and without transfer learning."""

    trainings: pd.DataFrame
    using: str
    without: str
    policy: str = ""  # claims about trainings are about no policy

    def curves(self, metric: str) -> pd.DataFrame:
        """Smoothed curves of a metric."""
        return smooth_curves(self.trainings, metric)

    def transfer(self, metric: str) -> Transfer:
        """The trainings with transfer learning, compared with those without."""
        curves = self.curves(metric)
        return compare_transfer(curves, self.using, self.without, shortest=values.CROSSING)


NO_RESULTS = "no results"
TOO_SHORT = "; too short to tell"
VERDICTS = (HOLDS, IN_PART, INCONCLUSIVE, REFUTED, NO_RESULTS)
# The verdicts as pages write them. What holds matches the paper's number if the interval of the
# difference from it reaches 0, and exceeds it if all of it is above 0; without a number, or if all
# of it is below 0, it holds. What holds in part without such a number is inconclusive.
EXCEEDS, MATCHES, FALLS_SHORT = "exceeds", "matches", "falls short"
# A claim that something is lost is no merit: a policy has this weakness as well, or lacks it.
SHARED, ABSENT = "has it too", "does not have it"
NOT_APPLICABLE = "does not apply"
OUTCOMES = (EXCEEDS, MATCHES, HOLDS, FALLS_SHORT, SHARED, ABSENT, INCONCLUSIVE, NOT_APPLICABLE)

Unit = Literal["share", "points", "reward", "steps", "number", "p"]

# Number of random permutations of the nodes, for the share that is expected by chance.
SHUFFLES = 100


class Quantity(NamedTuple):
    """A quantity with its interval.

    Attributes:
        interval: The value and its interval, in its unit; without one, the ends are the value.
        n: Number of missions or trainings that it is computed from; 0 if it is not known.
        unit: ``share``, ``points`` (for a difference of shares), ``reward``, ``steps`` (of a
            training), ``number`` or ``p`` (of a test).
        name: What the quantity is, if the claim does not say so.
    """

    interval: Interval
    n: int = 0
    unit: Unit = "share"
    name: str = ""

    @classmethod
    def exact(cls, value: float, n: int = 0, unit: Unit = "share", name: str = "") -> Self:
        """A quantity without an interval."""
        return cls(Interval(value, value, value), n, unit, name)

    @property
    def text(self) -> str:
        """The quantity with its interval, in its unit: ``97.3 % [96.1, 98.1]``."""
        value, low, high = self.interval
        spread = low < high
        match self.unit:
            case "share":
                if spread:
                    return numbers.format_interval(value, low, high)
                return numbers.format_percent(value)
            case "points":
                if spread:
                    text = numbers.format_points(value, low, high)
                else:
                    text = numbers.format_difference(value, 0)
                return f"{text} points"
            case "reward":
                if spread:
                    return numbers.with_ends(numbers.format_signed, value, low, high)
                return numbers.format_signed(value)
            case "steps":
                return f"{value:,.0f} steps"
            case "p":
                return numbers.format_p_value(value)
        return f"{value:g}"


@dataclass(frozen=True)
class Finding:
    """What the results of a policy say about a claim.

    Attributes:
        verdict: One of ``VERDICTS``.
        quantities: The quantities that the verdict is based on; the first one is compared with the
            paper's number.
        note: A remark in words, or the reason why there are no results.
        policy: The policy; empty for a claim about trainings.
        against: Where the interval of the difference from the paper's number lies relative to 0
            (``stats.verdict.position_of``); empty if they cannot be compared.
        weakness: Whether the claim is that something is lost.
    """

    verdict: str
    quantities: tuple[Quantity, ...] = ()
    note: str = ""
    policy: str = ""
    against: str = ""
    weakness: bool = False

    @property
    def passes(self) -> bool:
        """Whether the policy passes the claim; no policy passes one about a weakness."""
        return self.verdict == HOLDS and not self.weakness

    @property
    def fails(self) -> bool:
        """Whether the policy is shown to fail the claim."""
        return self.outcome == FALLS_SHORT

    @property
    def outcome(self) -> str:
        """The verdict as pages write it: one of ``OUTCOMES``."""
        if self.verdict == HOLDS:
            if self.weakness:
                return SHARED
            return {ABOVE: EXCEEDS, INCONCLUSIVE: MATCHES}.get(self.against, HOLDS)
        if self.verdict == REFUTED or (self.verdict == IN_PART and self.against == BELOW):
            return ABSENT if self.weakness else FALLS_SHORT
        if self.verdict == NO_RESULTS:
            return NOT_APPLICABLE
        return INCONCLUSIVE


# The measures. Each gives what it finds in the evidence to the judge of a claim's rule.

Judge = Callable[..., str]


def _finding_of(judge: Judge, *quantities: Quantity) -> Finding:
    """What the intervals of quantities say to a judge."""
    return Finding(judge(*(quantity.interval for quantity in quantities)), quantities)


# Means.


def mean(judge: Judge, evidence: EvidenceOfPolicy, metric: str, uavs: int | None = None) -> Finding:
    """The mean of a metric over all missions, or over those with a number of UAVs."""
    return _finding_of(judge, _mean_of(evidence.missions(uavs), metric))


def missed_data(judge: Judge, evidence: EvidenceOfPolicy) -> Finding:
    """The mean collection ratio, and the share of missions that collected everything."""
    missions = evidence.missions()
    everything = missions[RATIO].to_numpy() >= 1
    name = "missions that collected everything"
    return _finding_of(judge, _mean_of(missions, RATIO), _share_of(everything, name))


# Event logs.


def single_charges(judge: Judge, evidence: EvidenceOfPolicy) -> Finding:
    """The share of missions in which a lone UAV charges once."""
    charges = [(events["event"] == "charge_start").sum() for events, _ in evidence.logs(uavs=1)]
    return _finding_of(judge, _share_of(np.array(charges) == 1, "missions with one charge"))


def ignored_nodes(judge: Judge, evidence: EvidenceOfPolicy) -> Finding:
    """The shares of nodes that a lone UAV ignores, on the far edges and elsewhere."""
    far, others = np.transpose([_left_behind(*log) for log in evidence.logs(uavs=1)])
    ignored = _mean_share(far, "ignored of these nodes")
    more = Quantity(mean_interval(far - others), len(far), "points", "more than of the others")
    return _finding_of(judge, ignored, more)


def reached_nodes(judge: Judge, evidence: EvidenceOfPolicy) -> Finding:
    """How many more nodes on the far edges two UAVs reach than one UAV, in the same missions."""
    with_one, with_two = ([_left_behind(*log)[0] for log in evidence.logs(uavs)] for uavs in (1, 2))
    more = np.array([alone - team for alone, team in zip(with_one, with_two, strict=False)])
    name = "more of these nodes than by a lone UAV"
    gain = Quantity(mean_interval(more), len(more), "points", name)
    reached = _mean_share(1 - np.array(with_two), "of these nodes not ignored")
    return Finding(judge(gain.interval), (gain, reached))


def sectors(judge: Judge, evidence: EvidenceOfPolicy) -> Finding:
    """The share of data that two UAVs collect on their own sides, and the share by chance."""
    generator = np.random.default_rng(evidence.results.store.manifest.seed)
    rows = [row for log in evidence.logs(uavs=2) if (row := _collection_shares(*log, generator))]
    if not rows:
        raise MissingError("no data was collected")
    sides, chance, most = np.transpose(rows)
    own_side = Quantity.exact(float(sides.mean()), name="data collected on the own side")
    by_chance = Quantity.exact(float(chance.mean()), name="by chance")
    more = Quantity(mean_interval(sides - chance), len(rows), "points", "more than by chance")
    division = _mean_share(most, "data by the UAV that serves the node most")
    return Finding(judge(more.interval, division.interval), (own_side, by_chance, more, division))


def _left_behind(events: pd.DataFrame, nodes: np.ndarray) -> tuple[float, float]:
    """The shares of nodes left behind: of those on the far edges, and of the others."""
    left = missions.left_behind(events, len(nodes))
    far = missions.far_edges(nodes)
    if far.all():
        raise MissingError("all nodes are on the edges")
    return float(left[far].mean()), float(left[~far].mean())


def _collection_shares(
    events: pd.DataFrame, nodes: np.ndarray, generator: np.random.Generator
) -> tuple[float, ...]:
    """The share on the own side, the share by chance, and that of the UAV that serves most."""
    data = missions.data_by_uav_and_node(events, 2, len(nodes))
    if not data.any():
        return ()
    shuffled = (generator.permutation(data, axis=1) for _ in range(SHUFFLES))
    chance = np.mean([missions.share_in_own_sector(by_chance, nodes) for by_chance in shuffled])
    return (
        missions.share_in_own_sector(data, nodes),
        float(chance),
        missions.share_of_main_uav(data),
    )


# The values of a parameter, compared mission by mission.


def change(judge: Judge, pairs: Pairs, first: str, second: str) -> Finding:
    """How much the metric changes from one value to another."""
    return _finding_of(judge, _points_of_row(pairs.change(first, second)))


def lead(judge: Judge, pairs: Pairs, value: str) -> Finding:
    """How much higher the metric is at a value than at all others."""
    return _decisive_lead(
        judge, pairs.leads(value), f"{setting_in_symbols(pairs.field, value)} above the next best"
    )


def lag(judge: Judge, pairs: Pairs, value: str) -> Finding:
    """How much lower the metric is at a value than at all others."""
    return _decisive_lead(judge, negate_changes(pairs.leads(value)), "the next lowest is higher by")


def _decisive_lead(judge: Judge, leads: pd.DataFrame, name: str) -> Finding:
    """The lead that decides: the surest one below 0, or else the least sure one."""
    below = leads[leads["difference"] < 0]
    order = (leads if below.empty else below).sort_values("p_adjusted", kind="stable")
    row = order.iloc[-1 if below.empty else 0]
    p = Quantity.exact(float(row["p_adjusted"]), unit="p", name="its p (Holm)")
    return Finding(judge(leads), (_points_of_row(row, name), p))


def least_lead(judge: Judge, pairs: Pairs, values: Sequence[str]) -> Finding:
    """How much higher the metric is at some values than at all others: the lowest intervals."""
    leads = pairs.leads(*values)
    lowest = leads.loc[leads["low"].idxmin()]
    widened = _widened_interval(leads.loc[leads["wide_high"].idxmin()])
    return Finding(judge(leads), (_points_of_row(lowest, "lowest interval"), widened))


def spread(judge: Judge, pairs: Pairs) -> Finding:
    """The differences between all values: the intervals that reach farthest."""
    changes = pairs.changes.reset_index(drop=True)
    farthest = changes[["low", "high"]].abs().max(axis="columns").idxmax()
    nearest = np.maximum(changes["wide_low"], -changes["wide_high"]).idxmax()
    quantity = _points_of_row(changes.loc[farthest], "farthest interval")
    return Finding(judge(pairs.changes), (quantity, _widened_interval(changes.loc[nearest])))


def course(judge: Judge, pairs: Pairs) -> Finding:
    """How the metric changes along the values, from the first to the last."""
    first, *_, last = pairs.positions
    quantity = _points_of_row(pairs.change(first, last), f"from {first} to {last}")
    return Finding(judge(pairs.shape), (quantity,), pairs.course)


def peak(judge: Judge, pairs: Pairs, value: str) -> Finding:
    """How the metric changes along the values, with the lead of a value over all others."""
    leads = pairs.leads(value)
    name = f"{setting_in_symbols(pairs.field, value)} above the best other"
    ahead = _points_of_row(leads.loc[leads["difference"].idxmin()], name)
    return Finding(judge(pairs.shape, pairs.position(value)), (ahead,), pairs.course)


def selected_uavs(judge: Judge, evidence: EvidenceOfPolicy) -> Finding:
    """The number of UAVs in the setting that a study selects."""
    choice = evidence.results.choice(evidence.policy)
    points = evidence.results.store.manifest.points
    if choice is None or "uavs" not in points[choice.best].values:
        raise MissingError(f"the study {evidence.study} selects no number of UAVs")
    best_points = [
        n for n, point in enumerate(points) if point.values.get("uavs") == values.BEST_UAVS
    ]
    best = points[choice.best].values
    uavs = Quantity.exact(best["uavs"], choice.missions, "number", "UAVs")
    note = ", ".join(setting_in_symbols(field, value_text(value)) for field, value in best.items())
    left = {choice.best, *choice.survivors}
    fleets = sorted({points[n].values["uavs"] for n in left})
    note += f"; settings not ruled out: {len(left)}, UAVs {numbers.join_words([*map(str, fleets)])}"
    return Finding(judge(choice, best_points), (uavs,), note)


def setting_in_symbols(field: str, value: str) -> str:
    """``C_S 30``."""
    return f"{field_named(field).short} {value}"


# Learning curves.


def final_lead(judge: Judge, evidence: EvidenceOfTrainings, metric: str, unit: Unit) -> Finding:
    """How much higher training with transfer learning ends than training without it."""
    transfer = evidence.transfer(metric)
    variants = f"trainings {evidence.using} and {evidence.without}"
    note = f"{variants}: {transfer.course}{_if_short(transfer)}"
    return Finding(judge(transfer), _at_the_end(transfer, unit), note)


def level_from(judge: Judge, evidence: EvidenceOfTrainings, metric: str) -> Finding:
    """The step from which on the mean curve without transfer learning stays near its end."""
    transfer = evidence.transfer(metric)
    curves = evidence.curves(metric)
    means = last_phase(curves, evidence.without).mean(axis="columns")
    since = int(means.index[settling_position(means, MARGIN)])
    level = Quantity.exact(since, unit="steps", name="level from")
    note = f"trainings {evidence.without}{_if_short(transfer)}"
    verdict = judge(since / means.index[-1], transfer)
    return Finding(verdict, (level, *_at_the_end(transfer, "points")), note)


def learning_to_charge(judge: Judge, evidence: EvidenceOfTrainings, variant: str) -> Finding:
    """The share of the trainings of a variant that learn to charge."""
    last = last_rows(evidence.trainings)
    of_variant = last[last["variant"] == variant]
    if of_variant.empty:
        raise MissingError(f"no trainings {variant}")
    learned = of_variant[f"final_{SUCCESS}"].to_numpy() > LEARNED
    share = _share_of(learned, "trainings that learn to charge")
    length = int(of_variant["updates"].max())
    quantities = share, Quantity.exact(length, unit="steps", name="length of the trainings")
    if length < values.CROSSING:
        return Finding(INCONCLUSIVE, quantities, f"trainings {variant}{TOO_SHORT}")
    return Finding(judge(share.interval), quantities, f"trainings {variant}")


def untested(judge: Judge, evidence: EvidenceOfTrainings, reason: str) -> Finding:
    """Nothing: what a claim would need has not been simulated, for a reason."""
    raise MissingError(f"not tested: {reason}")


def _at_the_end(transfer: Transfer, unit: Unit) -> tuple[Quantity, Quantity]:
    """The last difference, and how long the trainings are."""
    last = Quantity(transfer.last, min(transfer.trainings), unit, "with transfer, at the end")
    return last, Quantity.exact(transfer.length, unit="steps", name="length of the trainings")


def _if_short(transfer: Transfer) -> str:
    if transfer.length >= values.CROSSING:
        return ""
    return TOO_SHORT


# Figures.


def _mean_of(missions: pd.DataFrame, metric: str) -> Quantity:
    row = means_of(missions, by=[]).set_index("metric").loc[metric]
    return Quantity(Interval(*map(float, row[["mean", "low", "high"]])), int(row["n"]))


def _share_of(occurs: np.ndarray, name: str) -> Quantity:
    """The share of missions in which something occurs."""
    return Quantity(share_interval(int(occurs.sum()), len(occurs)), len(occurs), name=name)


def _mean_share(values: np.ndarray, name: str) -> Quantity:
    """The mean of a share per mission."""
    return Quantity(bounded_interval(values), len(values), name=name)


def _points_of_row(row: pd.Series, name: str = "") -> Quantity:
    """A row of ``shapes.compare_values``."""
    interval = Interval(*map(float, row[["difference", "low", "high"]]))
    return Quantity(interval, int(row["n"]), "points", name)


def _widened_interval(row: pd.Series) -> Quantity:
    """The interval of a row of ``shapes.compare_values`` that holds for all rows at once."""
    interval = Interval(*map(float, row[["difference", "wide_low", "wide_high"]]))
    return Quantity(interval, int(row["n"]), "points", "widened for their number")
