"""Where one policy is ahead of another in the space of scenario parameters, and where behind.

For studies of one design point that draws its scenarios: the missions themselves cover the space.
Two policies meet the same missions, so they are compared mission by mission.
"""

from collections.abc import Hashable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
from scipy import stats
from sklearn.tree import DecisionTreeRegressor

from analysis.names import METRICS, PRODUCT, parameter, value_text
from analysis.questions.summary import learners, ranked_policies
from analysis.results.tables import Results
from analysis.stats.correction import adjust, for_choice
from analysis.stats.intervals import LEVEL, Interval, wilson
from analysis.stats.paired import compare, paired
from analysis.stats.verdict import INCONCLUSIVE
from dess.errors import InputError
from dess.scenario import Scenario

PARAMETERS = ("uavs", "flying_time", "charge_start", "charge_complete", "initial_data")

AHEAD, EVEN, BEHIND = "ahead", "level", "behind"  # in one mission; of many it may be INCONCLUSIVE

BINS = 5  # of a parameter, at most
DEPTH, LEAST, SHARE = 3, 20, 0.05  # of the tree: its depth, and the missions in a leaf at least

_TINY = 1e-12  # a difference below is rounding
_OF_BASELINE = "_baseline"

Range = tuple[float, float]


class Pair(NamedTuple):
    """Two policies to compare.

    Attributes:
        policy: The one whose lead is told, over the other.
        baseline: The other one.
        candidates: Number of pairs that these data chose it from.
    """

    policy: str
    baseline: str
    candidates: int


def pair_of(results: Results, learned: str | None = None, heuristic: str | None = None) -> Pair:
    """The best learned policy of a study, and the best of the others.

    The best by collection ratio and communication. A learner of several trainings counts by their
    mean, and its first training stands for it: the best of several is not the learner. Where all
    have learned, or none has, the best two.

    Args:
        results: The study.
        learned: A policy to take for the first, whatever it is.
        heuristic: A policy to take for the second.

    Raises:
        InputError: If the study has no two policies, or not the ones that are named.
    """
    ranked = ranked_policies(results.missions)
    for name, given in (("learned", learned), ("heuristic", heuristic)):
        if given is not None and given not in ranked:
            allowed = ", ".join(ranked)
            raise InputError(f"{name}: {given!r} is not in the study; allowed: {allowed}")
    trained = learners(results).values()
    others = [policy for policy in ranked if not any(policy in own for own in trained)]
    taught = [own[0] for own in sorted(trained, key=lambda own: -_mean(results, own))]
    if not taught or not others:
        taught = others = ranked
    pairs = [
        (first, second)
        for first in ([learned] if learned else taught)
        for second in ([heuristic] if heuristic else others)
        if first != second
    ]
    if not pairs:
        raise InputError(
            f"learned, heuristic: no two policies to compare among {', '.join(ranked)}; "
            "allowed: two or more, and not one for both"
        )
    return Pair(*pairs[0], len({frozenset(pair) for pair in pairs}))


def duels(results: Results, pair: Pair) -> pd.DataFrame:
    """Two policies on the same missions.

    Returns:
        A row per mission that both have flown: ``replication``, the parameters (``initial_data`` is
        the mean of its nodes), ``METRICS`` of the policy, those of the baseline under names that
        end in ``_baseline``, and ``difference``, by how much the policy is ahead in collection
        ratio and communication.

    Raises:
        InputError: If the study has several design points.
    """
    if (points := len(results.store.manifest.points)) > 1:
        name = results.store.manifest.study["name"]
        raise InputError(f"study {name}: {points} design points; allowed: one for all missions")
    ours, theirs = (_flown(results, policy) for policy in (pair.policy, pair.baseline))
    both = ours.merge(theirs[["replication", *METRICS]], "inner", "replication",
                      suffixes=("", _OF_BASELINE))  # fmt: skip
    both["initial_data"] = both["initial"] / len(results.scenario().nodes)
    gap = both[PRODUCT] - both[PRODUCT + _OF_BASELINE]
    both["difference"] = gap.where(gap.abs() > _TINY, 0.0)
    metrics = [*METRICS, *(m + _OF_BASELINE for m in METRICS)]
    return both[["replication", *PARAMETERS, *metrics, "difference"]]


def overall(missions: pd.DataFrame, pair: Pair) -> pd.DataFrame:
    """The policy against the baseline in every metric, over all missions of ``duels``.

    Returns:
        A row per metric, as of ``stats.paired.compare``; ``p_adjusted`` also for the choice
        of the pair.
    """
    names = {pair.policy: "", pair.baseline: _OF_BASELINE}
    parts = [
        pd.DataFrame({m: missions[m + end] for m in METRICS}).assign(
            policy=policy, replication=missions["replication"]
        )
        for policy, end in names.items()
    ]
    return for_choice(compare(pd.concat(parts), pair.baseline, [*METRICS]), pair.candidates)


def varied(missions: pd.DataFrame) -> list[str]:
    """The parameters that differ between the missions of ``duels``."""
    return [field for field in PARAMETERS if missions[field].nunique() > 1]


def halves(missions: pd.DataFrame) -> tuple[pd.DataFrame, pd.DataFrame]:
    """The missions of even replications, and those of odd ones.

    What is found on the one half is told by the other, which had no part in it.
    """
    even = missions["replication"] % 2 == 0
    return missions[even], missions[~even]


def outcomes(missions: pd.DataFrame) -> pd.DataFrame:
    """In what share of the missions of ``duels`` the policy is ahead, level and behind.

    Returns:
        A row per outcome: ``outcome``, ``count``, ``share``, ``low``, ``high`` (Wilson), ``n``.
    """
    sign = np.sign(missions["difference"])
    rows = []
    for outcome, value in ((AHEAD, 1), (EVEN, 0), (BEHIND, -1)):
        count = int((sign == value).sum())
        rows.append((outcome, count, *wilson(count, len(missions)), len(missions)))
    return pd.DataFrame(rows, columns=["outcome", "count", "share", "low", "high", "n"])


def along(missions: pd.DataFrame, candidates: int = 1) -> pd.DataFrame:
    """The mean difference along every parameter that varies.

    Args:
        missions: Rows of ``duels``.
        candidates: Pairs that the two policies were chosen from.

    Returns:
        A row per parameter and bin, at most ``BINS`` of about as many missions each: ``field``,
        ``position``, ``value`` in words, and the columns of a comparison: ``mean``, ``low``,
        ``high`` (of Student's t, 95 % each), ``p``, ``p_adjusted`` (Holm over all rows, Bonferroni
        for the choice of the pair), ``verdict``, ``n``, and ``behind``, the share of missions in
        which the policy is behind, with ``behind_low`` and ``behind_high``.
    """
    parts = []
    for field in varied(missions):
        codes, names = bins(missions[field])
        parts += [((field, code, name), missions[codes == code]) for code, name in enumerate(names)]
    return _compared(parts, ["field", "position", "value"], candidates)


def across(missions: pd.DataFrame, first: str, second: str, candidates: int = 1) -> pd.DataFrame:
    """The mean difference over two parameters at once.

    Returns:
        A row per pair of bins with missions: ``position``, ``value`` (of the first), ``position_2``
        and ``value_2`` (of the second), and the columns of a comparison, as of ``along``.
    """
    (codes, names), (codes_2, names_2) = bins(missions[first]), bins(missions[second])
    parts = [
        ((code, name, code_2, name_2), missions[(codes == code) & (codes_2 == code_2)])
        for code, name in enumerate(names)
        for code_2, name_2 in enumerate(names_2)
    ]
    columns = ["position", "value", "position_2", "value_2"]
    return _compared([part for part in parts if len(part[1])], columns, candidates)


def dependence(missions: pd.DataFrame) -> pd.DataFrame:
    """Whether the difference depends on each parameter.

    Returns:
        A row per parameter that varies, the one that explains most first: ``field``, ``explained``
        (share of the variance between the bins of ``along``), ``p`` (Alexander and Govern's test
        of equal means, which lets the variances differ; 1 where there is too little to test) and
        ``p_adjusted`` (Holm).
    """
    rows = []
    for field in varied(missions):
        codes, _ = bins(missions[field])
        own = missions["difference"].groupby(codes)
        total = float(missions["difference"].var(ddof=0))
        between = float(own.transform("mean").var(ddof=0))
        rows.append((field, between / total if total else 0.0, _equal_means(own)))
    table = pd.DataFrame(rows, columns=["field", "explained", "p"])
    table["p_adjusted"] = adjust(table["p"].to_numpy(float), "holm")
    return table.sort_values("explained", ascending=False, kind="stable", ignore_index=True)


def rules(missions: pd.DataFrame, candidates: int = 1) -> pd.DataFrame:
    """Regions of the space in which the difference differs, by a regression tree.

    The regions are found on the missions of even replications, and what is told of them comes from
    the odd ones, which had no part in it: else the regions that chance favours would look real.

    Args:
        missions: Rows of ``duels``.
        candidates: As of ``along``.

    Returns:
        A row per region that has missions to tell of, the lowest mean first: ``rule`` in words,
        ``found_on`` (number of missions), and the columns of a comparison, as of ``along``.
    """
    fields = varied(missions) or [*PARAMETERS[:1]]
    train, test = halves(missions)
    columns = ["rule", "found_on"]
    if train.empty or test.empty:
        return _compared([], columns, candidates)
    least = max(LEAST, int(np.ceil(SHARE * len(train))))
    tree = DecisionTreeRegressor(max_depth=DEPTH, min_samples_leaf=least, random_state=0)
    tree.fit(train[fields].to_numpy(float), train["difference"])
    found, met = (tree.apply(part[fields].to_numpy(float)) for part in (train, test))
    parts = [
        ((_rule(missions, box), int((found == leaf).sum())), test[met == leaf])
        for leaf, box in _leaves(tree.tree_, fields)
    ]
    table = _compared([part for part in parts if len(part[1])], columns, candidates)
    return table.sort_values("mean", kind="stable", ignore_index=True)


def worst(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``duels`` with the policy's lowest collection ratio and communication.

    The worst first; of those alike, first those that collected the smaller part.
    """
    return missions.sort_values([PRODUCT, "collection_ratio"], kind="stable").head(count)


def most_lost(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``duels`` in which the policy is furthest behind, if it is behind."""
    lost = missions[missions["difference"] < 0]
    return lost.sort_values("difference", kind="stable").head(count)


def quotas(results: Results, policy: str, replication: int) -> str:
    """How many UAVs of a mission filled their quota: ``2 of 3``."""
    uavs = results.uavs
    own = uavs[(uavs["policy"] == policy) & (uavs["replication"] == replication)]
    return f"{int((own['end'] == 'quota').sum())} of {len(own)}"


def stranded(events: pd.DataFrame, scenario: Scenario) -> pd.DataFrame:
    """The UAVs of a mission that ran dry without their quota.

    Args:
        events: The event log of the mission.
        scenario: Its scenario.

    Returns:
        A row per such UAV, the first first: ``uav``, ``time`` [mission slots], ``x``, ``y`` and
        ``moves``, how many it was away from the charging zone.
    """
    dry = events[events["event"] == "battery_empty"]
    left, top, width, height = scenario.zone
    away = [
        np.maximum(np.maximum(first - dry[axis], dry[axis] - (first + size - 1)), 0)
        for axis, first, size in (("x", left, width), ("y", top, height))
    ]
    table = dry[["uav", "time", "x", "y"]].assign(moves=away[0] + away[1])
    return table.astype({"x": int, "y": int, "moves": int}).reset_index(drop=True)


def bins(values: pd.Series, most: int = BINS) -> tuple[np.ndarray, list[str]]:
    """Values in at most so many bins: one each if they are that few, else by quantiles.

    Returns:
        (n,) the bin of each value, and the names of the bins, from the lowest on.
    """
    numbers = values.to_numpy()
    distinct = np.unique(numbers)
    edges = distinct[:-1]
    if len(distinct) > most:
        edges = np.quantile(numbers, np.arange(1, most) / most)
    _, codes = np.unique(np.searchsorted(edges, numbers), return_inverse=True)
    return codes, [_named(numbers[codes == code]) for code in range(codes.max() + 1)]


def _mean(results: Results, policies: Sequence[str]) -> float:
    """The mean over policies of their collection ratio and communication."""
    means = results.missions.groupby("policy")[PRODUCT].mean()
    return float(means[[*policies]].mean())


def _flown(results: Results, policy: str) -> pd.DataFrame:
    return results.missions[results.missions["policy"] == policy]


def _compared(
    parts: Sequence[tuple[tuple[Hashable, ...], pd.DataFrame]],
    columns: list[str],
    candidates: int,
) -> pd.DataFrame:
    """A row per part of the missions of ``duels``, which has some: its labels, its comparison."""
    rows = []
    for labels, part in parts:
        of = part[PRODUCT].to_numpy(float), part[PRODUCT + _OF_BASELINE].to_numpy(float)
        pair = paired(*of)
        behind = wilson(int((part["difference"] < 0).sum()), len(part))
        ends = Interval(pair.difference, pair.low, pair.high)
        rows.append((*labels, *ends, pair.p, len(part), *behind))
    names = ["mean", "low", "high", "p", "n", "behind", "behind_low", "behind_high"]
    table = pd.DataFrame(rows, columns=[*columns, *names])
    adjusted = np.minimum(adjust(table["p"].to_numpy(float), "holm") * candidates, 1)
    table.insert(table.columns.get_loc("n"), "p_adjusted", adjusted)
    table.insert(table.columns.get_loc("n"), "verdict", _verdicts(table))
    return table


def _verdicts(table: pd.DataFrame) -> list[str]:
    sure = table["p_adjusted"] <= 1 - LEVEL
    return [
        (AHEAD if mean > 0 else BEHIND) if told else INCONCLUSIVE
        for mean, told in zip(table["mean"], sure, strict=True)
    ]


def _equal_means(groups: Any) -> float:
    """The p-value of equal means; 1 where fewer than two groups have a spread."""
    samples = [own.to_numpy() for _, own in groups if np.ptp(own) > 0]
    return float(stats.alexandergovern(*samples).pvalue) if len(samples) > 1 else 1.0


def _leaves(
    tree: Any, fields: list[str], node: int = 0, box: Mapping[str, Range] | None = None
) -> Iterator[tuple[int, Mapping[str, Range]]]:
    """The leaves below a node, each with the range (low, high] of every field that is split."""
    box = box or {}
    left, right = tree.children_left[node], tree.children_right[node]
    if left == right:  # there are none
        yield node, box
        return
    field, split = fields[tree.feature[node]], float(tree.threshold[node])
    low, high = box.get(field, (-np.inf, np.inf))
    yield from _leaves(tree, fields, left, {**box, field: (low, split)})
    yield from _leaves(tree, fields, right, {**box, field: (split, high)})


def _rule(missions: pd.DataFrame, box: Mapping[str, Range]) -> str:
    """A box in words, by the values that missions have in it."""
    sides = []
    for field in (field for field in PARAMETERS if field in box):
        low, high = box[field]
        values = missions[field].to_numpy()
        inside = values[(values > low) & (values <= high)]
        sides.append(f"{parameter(field).short} {_named(inside)}")
    return ", ".join(sides) or "all missions"


def _named(values: np.ndarray) -> str:
    """The range of values: ``3``, ``70–72``, or ``11.7–12.1``, rounded."""
    ends = [float(f"{end:.3g}") for end in (values.min(), values.max())]
    return value_text(ends if ends[0] < ends[1] else ends[0])
