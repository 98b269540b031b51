"""Which is better: paired comparisons on common random numbers, and comparisons of learners.

Replication r of two policies, or of two design points, meets the same sea, so missions are compared
pair by pair: what the sea gives or takes from both drops out of the difference.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, Literal, NamedTuple, get_args

import numpy as np
import pandas as pd
from scipy import optimize, stats

from analysis.names import MEANS, SHARES
from analysis.stats.intervals import (
    LEVEL,
    Interval,
    bootstrap_interval,
    check_columns,
    expanded_level,
    groups,
    mean_interval,
)
from dess.errors import InputError

Treatment = Literal["policy", "point"]
Correction = Literal["holm", "fdr"]

# What the row of a learner's comparison is about: trainings at large, or the one there is.
LEARNER, CHECKPOINT = "the learner", "this checkpoint"

_ENDS = ("low", "high", "new_low", "new_high")
_MISSION = ("policy", "point", "seed", "replication")  # what tells missions apart
_ROUNDING = 64 * np.finfo(float).eps  # relative; differences of differences below are none


class Paired(NamedTuple):
    """A comparison of n pairs: the mean difference with two intervals, and what pairing gained.

    ``variance_reduction`` is 1 - Var(A - B) / (Var A + Var B): of v, 1 / (1 - v) times as many
    missions would be needed without common random numbers. Below 0 pairing did harm.
    """

    difference: float
    low: float
    high: float
    bootstrap_low: float
    bootstrap_high: float
    p: float
    correlation: float
    variance_reduction: float
    n: int


class Crossed(NamedTuple):
    """A learner of S trainings on R missions: the mean difference with intervals, and its spread.

    ``low`` and ``high`` bound the expected difference of the learner's trainings, ``new_low`` and
    ``new_high`` that of one new training. The standard deviations are those of the trainings, of
    the missions, and of what is left.
    """

    difference: float
    low: float
    high: float
    new_low: float
    new_high: float
    p: float
    training_sd: float
    mission_sd: float
    rest_sd: float


def paired(
    a: np.ndarray,
    b: np.ndarray,
    generator: np.random.Generator,
    level: float = LEVEL,
    resamples: int = 9999,
    share: bool = False,
) -> Paired:
    """Compare two samples pair by pair; differences are A - B.

    Args:
        a: (n,) values of A.
        b: (n,) values of B; entry r belongs with entry r of A.
        generator: Draws the resamples.
        level: Confidence level.
        resamples: Number of bootstrap resamples.
        share: Whether the values are outcomes 0 or 1, or means of such: shares.

    Returns:
        The interval of Student's t, the BCa bootstrap interval over the pairs (at the level of
        ``expanded_level``), and the p-value of the paired t test. For shares one gain and one loss
        are added to the differences before t (as Bonett and Price 2012 do), so that few discordant
        pairs, or none, are not taken for certainty; outcomes have the exact test of McNemar.
        Nothing is ever nan:

        - All differences equal (up to rounding), n = 1 included: the intervals are degenerate (low
          = difference = high), save that of shares; p is that of the sign test, 2^(1 - n), which is
          1 for a single pair; 1 if there is no difference at all.
        - A or B constant: their correlation is 0. Both: so is the variance reduction.

    Raises:
        ValueError: If the samples are empty, differ in length, or are no shares but should be.
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    if a.shape != b.shape or not a.size:
        raise ValueError(f"paired: {a.size} and {b.size} values; allowed: as many, at least one")
    differences = _differences(a, b)
    if share and (min(a.min(), b.min()) < 0 or max(a.max(), b.max()) > 1):
        raise ValueError("paired: no shares; allowed: values from 0 to 1")
    mean, p = (_share_test if share else _t_test)(differences, level)
    expanded = expanded_level(level, a.size)
    bootstrap = bootstrap_interval(differences, np.mean, generator, expanded, resamples=resamples)
    of_a, of_b, of_differences = map(_variance, (a, b, differences))
    correlation = float(np.corrcoef(a, b)[0, 1]) if of_a and of_b else 0.0
    reduction = 1 - of_differences / (of_a + of_b) if of_a + of_b else 0.0
    return Paired(*mean, bootstrap.low, bootstrap.high, p, correlation, reduction, a.size)


def compare(
    missions: pd.DataFrame,
    baseline: str | int,
    generator: np.random.Generator,
    metrics: Sequence[str] = (*SHARES, *MEANS),
    by: Sequence[str] = (),
    level: float = LEVEL,
    correction: Correction | None = "holm",
    of: Treatment = "policy",
    resamples: int = 9999,
) -> pd.DataFrame:
    """Compare every other policy, or design point, with a baseline, mission by mission.

    Args:
        missions: A row per mission, with ``policy``, ``point``, ``seed`` and ``replication`` (those
            there are), the metrics and the fields of ``by``.
        baseline: The policy, or the number of the design point, to compare with.
        generator: Draws the resamples.
        metrics: Columns of numbers.
        by: Columns whose values form groups of missions, compared one by one.
        level: Confidence level of each interval.
        correction: Of the p-values, over all rows, as of ``adjust``.
        of: What is compared: ``policy`` or ``point``.
        resamples: Number of bootstrap resamples.

    Returns:
        A row per policy (in order of first appearance), group (in order of their values) and
        metric: ``policy`` (or ``point``), ``baseline``, the columns ``by``, ``metric``, the fields
        of ``Paired`` and, after ``p``, ``p_adjusted``. Differences are to the baseline, positive if
        more. Where a group holds several missions of a replication - at several points, which share
        its sea - their means are compared, and ``n`` counts replications.

    Raises:
        InputError: If a column is missing or not of numbers, the baseline is not there or alone, a
            mission is there twice or for one of a pair only, or an argument is not allowed.
    """
    if of not in get_args(Treatment):
        raise InputError(f"of: {of!r}; allowed: {', '.join(get_args(Treatment))}")
    tables = _tables(missions, of, metrics, by, level, correction)
    others = [name for name in tables if name != baseline]
    reference = _taken(tables, of, baseline)
    if not others:
        raise InputError(f"{of}: nothing to compare with {baseline}; allowed: two or more")
    rows = []
    for name in others:
        _check_same_missions(tables, name, baseline)
        for group, (a, b) in _grouped([tables[name], reference], by):
            for metric in metrics:
                share = metric in SHARES
                result = paired(a[metric], b[metric], generator, level, resamples, share)
                rows.append((name, baseline, *group, metric, *result))
    return _adjusted(rows, [of, "baseline", *by, "metric", *Paired._fields], correction)


def crossed(differences: np.ndarray, level: float = LEVEL) -> Crossed:
    """What the trainings of a learner say of it: two crossed random factors, training and mission.

    The layout d = mu + training + mission + rest has one observation per cell; the mean squares
    give the variance components, cut at 0. The half-width adds two parts in quadrature (as of
    Graybill and Wang 1980): Student's t on the means of the S trainings, which holds the rest as
    well, and that of the missions, which all trainings share. It is at least that of these very
    trainings. By simulation it covers at its level or above, whichever part dominates, from two
    trainings on.

    Args:
        differences: (S, R) of training s on mission r, to the same baseline.
        level: Confidence level.

    Returns:
        The intervals, the p-value of no expected difference, and the components as standard
        deviations. If all differences are equal the intervals are degenerate and p is that of the
        sign test over the trainings, 2^(1 - S). With a single training the interval is of this
        training alone (Student's t over the missions), the new one is unbounded, and the deviations
        of training and rest are nan: unknown. With a single mission the interval is degenerate,
        the new one unbounded, p is 1 and all deviations are nan.

    Raises:
        ValueError: If there are no values.
    """
    d = np.asarray(differences, float)
    if d.ndim != 2 or not d.size:
        raise ValueError("crossed: no values; allowed: trainings x missions")
    trainings, missions = d.shape
    of_missions, p = _t_test(d.mean(axis=0), level)  # of these very trainings
    mean = of_missions.mean
    if trainings == 1 or missions == 1:
        spread = float(d.std(ddof=1)) if missions > 1 else np.nan
        return Crossed(*of_missions, -np.inf, np.inf, p, np.nan, spread, np.nan)
    if np.ptp(d) == 0:
        return Crossed(*of_missions, mean, mean, _sign_p(d[:, 0]), 0.0, 0.0, 0.0)
    row, column = d.mean(axis=1, keepdims=True), d.mean(axis=0, keepdims=True)
    rest = float(np.sum((d - row - column + mean) ** 2)) / (trainings - 1) / (missions - 1)
    between = float(row.var(ddof=1))  # Var(training) + Var(rest) / R
    shared = max(float(column.var(ddof=1)) - rest / trainings, 0.0)  # Var(mission)
    sems = np.sqrt([between / trainings, shared / missions])
    new_sems = np.sqrt([between / trainings + between, shared / missions])

    def half(sems: np.ndarray, alpha: float) -> float:
        return float(np.hypot(*sems * stats.t.isf(alpha / 2, [trainings - 1, missions - 1])))

    ends = max(half(sems, 1 - level), of_missions.high - mean)
    new = max(half(new_sems, 1 - level), ends)
    if sems.any():
        p = max(p, _alpha_of(lambda alpha: half(sems, alpha), abs(mean)))
    deviations = np.sqrt([max(between - rest / missions, 0.0), shared, rest])
    return Crossed(mean, mean - ends, mean + ends, mean - new, mean + new, p, *deviations.tolist())


def compare_learners(
    missions: pd.DataFrame,
    learners: Mapping[str, Sequence[str]],
    baseline: str,
    metrics: Sequence[str] = (*SHARES, *MEANS),
    by: Sequence[str] = (),
    level: float = LEVEL,
    correction: Correction | None = "holm",
) -> pd.DataFrame:
    """Compare learners, each known by checkpoints of several trainings, with a baseline policy.

    How good a training turns out is chance as well, so a claim on the learner needs checkpoints of
    several training seeds; one checkpoint supports claims on this checkpoint only.

    Args:
        missions: As of ``compare``; the checkpoints and the baseline meet the same missions.
        learners: Name of each learner -> the policies that are its checkpoints, all that there are:
            the best of several trainings is not the learner.
        baseline: The policy to compare with, taken as it is.
        metrics: Columns of numbers.
        by: Columns whose values form groups of missions, compared one by one.
        level: Confidence level of each interval.
        correction: Of the p-values, over all rows, as of ``adjust``.

    Returns:
        A row per learner, group and metric: ``learner``, ``baseline``, the columns ``by``,
        ``metric``, ``about``, the fields of ``Crossed``, after ``p`` ``p_adjusted``, ``trainings``
        and ``n``, the number of missions (of replications, where ``compare`` would take means).
        ``about`` says what ``low``, ``high`` and ``p`` are about: ``the learner``, trainings to
        come included, or ``this checkpoint``, the only one there is. Shares have the intervals and
        the p-value with one gain and one loss added, as of ``paired``.

    Raises:
        InputError: As of ``compare``; if a learner has no checkpoint, or one twice.
    """
    tables = _tables(missions, "policy", metrics, by, level, correction)
    reference = _taken(tables, "policy", baseline)
    rows = []
    for learner, checkpoints in learners.items():
        if not checkpoints or len(set(checkpoints)) < len(checkpoints) or baseline in checkpoints:
            raise InputError(
                f"learner {learner}: checkpoints {', '.join(checkpoints) or 'none'}; "
                f"allowed: one or more, all distinct, without the baseline {baseline}"
            )
        trained = [_taken(tables, "policy", checkpoint) for checkpoint in checkpoints]
        for checkpoint in checkpoints:
            _check_same_missions(tables, checkpoint, baseline)
        for group, (b, *parts) in _grouped([reference, *trained], by):
            for metric in metrics:
                differences = _differences(np.stack([a[metric] for a in parts]), b[metric])
                result = crossed(differences, level)
                if metric in SHARES:
                    result = _as_share(result, differences, level)
                about = LEARNER if len(parts) > 1 else CHECKPOINT
                labels = (learner, baseline, *group, metric, about)
                rows.append((*labels, *result, *differences.shape))
    columns = ["learner", "baseline", *by, "metric", "about", *Crossed._fields, "trainings", "n"]
    return _adjusted(rows, columns, correction)


def adjust(p: np.ndarray, correction: Correction | None) -> np.ndarray:
    """Adjust p-values for their number; those up to alpha are the claims made at that level.

    Args:
        p: (m,) p-values.
        correction: ``holm`` (1979) bounds the chance of any false claim by alpha, ``fdr``
            (Benjamini and Hochberg 1995) the expected share of false claims; None: unadjusted.

    Returns:
        (m,) adjusted p-values, at most 1.
    """
    p = np.asarray(p, float)
    if correction == "fdr":
        return np.asarray(stats.false_discovery_control(p))
    if correction is None:
        return p
    order = np.argsort(p)
    adjusted = np.empty_like(p)
    steps = p[order] * np.arange(len(p), 0, -1)
    adjusted[order] = np.minimum(np.maximum.accumulate(steps), 1)
    return adjusted


def _tables(
    missions: pd.DataFrame,
    of: Treatment,
    metrics: Sequence[str],
    by: Sequence[str],
    level: float,
    correction: str | None,
) -> dict[Any, pd.DataFrame]:
    """The metrics of every policy (or point), by the keys of the missions that they are of."""
    if not 0 < level < 1:
        raise InputError(f"level: {level}; allowed: between 0 and 1")
    if correction not in (*get_args(Correction), None):
        raise InputError(
            f"correction: {correction!r}; allowed: {', '.join(get_args(Correction))}, or none"
        )
    check_columns(missions, [of, "replication", *metrics, *by])
    if of in by:
        raise InputError(f"by: {of} is what is compared; allowed: other columns")
    for metric in metrics:
        values = pd.to_numeric(missions[metric], errors="coerce")
        if odd := int(len(values) - np.isfinite(values).sum()):
            raise InputError(f"{metric}: no number in {odd} missions; allowed: finite numbers")
    keys = list(dict.fromkeys([*by, *(k for k in _MISSION if k in missions and k != of)]))
    twice = missions.duplicated([of, *keys])
    if twice.any():
        row = missions.loc[twice, [of, *keys]]
        raise InputError(f"missions: {_shown(row)} is there twice; allowed: every mission once")
    return {
        name: part.set_index(keys)[list(metrics)].astype(float)
        for (name,), part in groups(missions, [of])
    }


def _taken(tables: Mapping[Any, pd.DataFrame], of: str, name: str | int) -> pd.DataFrame:
    if name not in tables:
        raise InputError(f"{of}: {name} has no missions; allowed: {', '.join(map(str, tables))}")
    return tables[name]


def _check_same_missions(tables: Mapping[Any, pd.DataFrame], name: Any, baseline: Any) -> None:
    for lacking, having in ((name, baseline), (baseline, name)):
        absent = tables[having].index.difference(tables[lacking].index)
        if len(absent):
            raise InputError(
                f"{lacking}: lacks {len(absent)} of the missions of {having}, the first at "
                f"{_shown(absent.to_frame())}; allowed: the same missions for both"
            )


def _shown(keys: pd.DataFrame) -> str:
    """The first row."""
    return ", ".join(f"{name} {keys[name].iloc[0]}" for name in keys)


def _grouped(
    tables: Sequence[pd.DataFrame], by: Sequence[str]
) -> Iterator[tuple[tuple, list[dict[str, np.ndarray]]]]:
    """Groups of units that share no sea: missions, or the means of a replication's missions.

    Yields the group and the metrics of each table, in the order of the units.
    """
    names = tables[0].index.names
    unit = [name for name in names if name in (*by, "seed", "replication")]
    means = [table.groupby(level=unit, dropna=False).mean() for table in tables]
    for group, part in groups(means[0].reset_index(), by):
        yield group, [{metric: m[metric].to_numpy()[part.index] for metric in m} for m in means]


def _adjusted(rows: list[tuple], columns: list[str], correction: Correction | None) -> pd.DataFrame:
    frame = pd.DataFrame(rows, columns=columns)
    adjusted = adjust(frame["p"].to_numpy(), correction)
    frame.insert(columns.index("p") + 1, "p_adjusted", adjusted)
    return frame


def _differences(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """A - B; all the same where they differ by rounding only."""
    differences = a - b
    rounding = _ROUNDING * max(np.abs(a).max(), np.abs(b).max())
    if np.ptp(differences) > rounding:
        return differences
    first = differences.flat[0]
    return np.full_like(differences, first if abs(first) > rounding else 0.0)


def _t_test(differences: np.ndarray, level: float) -> tuple[Interval, float]:
    mean = mean_interval(differences, level)
    if np.ptp(differences) == 0:
        return mean, _sign_p(differences)
    t = abs(mean.mean) / stats.sem(differences)
    return mean, float(2 * stats.t.sf(t, differences.size - 1))


def _share_test(differences: np.ndarray, level: float) -> tuple[Interval, float]:
    smooth, p = _t_test(_smoothed(differences), level)
    if np.isin(differences, (-1, 0, 1)).all():
        gains, losses = int(np.sum(differences > 0)), int(np.sum(differences < 0))
        p = float(stats.binomtest(gains, gains + losses).pvalue) if gains + losses else 1.0
    mean = float(differences.mean())
    return Interval(mean, max(smooth.low, -1.0), min(smooth.high, 1.0)), p


def _as_share(result: Crossed, differences: np.ndarray, level: float) -> Crossed:
    """The result with the intervals and the p-value of shares."""
    if len(differences) == 1:
        mean, p = _share_test(differences[0], level)
        return result._replace(low=mean.low, high=mean.high, p=p)
    smooth = crossed(_smoothed(differences), level)
    ends = {name: float(np.clip(getattr(smooth, name), -1, 1)) for name in _ENDS}
    return result._replace(**ends, p=smooth.p)


def _smoothed(differences: np.ndarray) -> np.ndarray:
    """One gain and one loss more, along the last axis."""
    more = np.broadcast_to([1.0, -1.0], (*differences.shape[:-1], 2))
    return np.concatenate([differences, more], axis=-1)


def _sign_p(equal: np.ndarray) -> float:
    """The two-sided sign test of n equal differences."""
    return min(1.0, 2 * 0.5 ** len(equal)) if equal[0] else 1.0


def _alpha_of(half: Callable[[float], float], distance: float) -> float:
    """Where a half-width, which falls with alpha, meets a distance: the p-value of an interval."""

    def excess(exponent: float) -> float:
        return half(10**exponent) - distance

    lowest = -100.0  # where quantiles of Student are exact still
    if excess(lowest) <= 0:
        return 0.0
    return float(10 ** optimize.brentq(excess, lowest, 0.0)) if distance else 1.0


def _variance(values: np.ndarray) -> float:
    return float(values.var()) if np.ptp(values) else 0.0
