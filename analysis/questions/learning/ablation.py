"""Ablation: the effect of each method of learning, from the final metrics of training variants.

    table = ablation(finals(curves), "final_reward", "quick")

Curves are those of ``learning.curves``; trainings of a variant differ in their seed.
"""

from collections.abc import Sequence

import numpy as np
import pandas as pd
from scipy import stats

from analysis import numbers
from analysis.names import METRICS, PRODUCT, RATIO, SUCCESS
from analysis.stats.correction import adjust
from analysis.stats.intervals import LEVEL, Interval, mean_interval
from analysis.stats.verdict import MARKS, position

BASELINE = "quick"  # the variant with which the others of the shipped curves are compared
SHIPPED = "ddqn"  # the variant of the shipped policy, which is trained longer
LEARNED = 0.5  # a training with at least this success has learned to charge
# From the paper's methods to the shipped policy: variants, by what each adds to the one before.
LADDER = {
    "the paper's methods": "none of the three",
    "the same, 8 times the updates": "none of the three, long",
    "with the return guard": "no low-battery starts, no early returns",
    "and low-battery starts": "no early returns",
    "and early returns (quick)": BASELINE,
    f"{SHIPPED}, trained longer": SHIPPED,
}


def finals(curves: pd.DataFrame) -> pd.DataFrame:
    """The last row of every training, which has the metrics of the selected weights."""
    return curves.groupby(["variant", "seed"], sort=False, as_index=False).last()


def of_equal_budget(last: pd.DataFrame, baseline: str) -> pd.DataFrame:
    """Those of ``finals`` that have made as many updates as the trainings of the baseline."""
    budget = last.loc[last["variant"] == baseline, "updates"].max()
    return last[last["updates"] == budget]


def ladder(last: pd.DataFrame) -> pd.DataFrame:
    """Those of ``finals`` whose variants are in ``LADDER``, in its order, by what they add."""
    rungs = {variant: rung for rung, variant in LADDER.items()}
    named = last[last["variant"].isin(rungs)].replace({"variant": rungs})
    return named.sort_values("variant", key=lambda names: names.map([*LADDER].index), kind="stable")


def ablation(last: pd.DataFrame, metric: str, baseline: str, level: float = LEVEL) -> pd.DataFrame:
    """The final metric of every variant, and its difference from the baseline.

    Args:
        last: Rows of ``finals``.
        metric: The column of the final metric.
        baseline: The variant with which the others are compared.
        level: Confidence level.

    Returns:
        A row per variant, the highest mean first: ``variant``, ``n`` trainings; ``mean``, ``low``,
        ``high`` of the expected result; ``new_low`` and ``new_high`` of one new training (nan with
        one training; the ends for metrics from 0 to 1 are cut there); ``difference``,
        ``difference_low``, ``difference_high``, ``p`` and ``p_adjusted`` (Holm), of ``difference``;
        nan for the baseline.
    """
    values = {v: part[metric].to_numpy() for v, part in last.groupby("variant", sort=False)}
    limits = (0.0, 1.0) if metric.removeprefix("final_") in METRICS else (-np.inf, np.inf)
    rows = []
    for variant, sample in values.items():
        mean, _, high = mean_interval(sample, level)
        alone, half = len(sample) == 1, high - mean
        room = np.array([-half, half, *(np.sqrt(len(sample) + 1) * np.array([-half, half]))])
        ends = np.full(4, np.nan) if alone else np.clip(mean + room, *limits)
        gap, p = Interval(np.nan, np.nan, np.nan), np.nan
        if variant != baseline:
            gap, p = difference(sample, values[baseline], level)
        rows.append((variant, len(sample), mean, *ends, *gap, p))
    columns = ["variant", "n", "mean", "low", "high", "new_low", "new_high"]
    columns += ["difference", "difference_low", "difference_high", "p"]
    table = pd.DataFrame(rows, columns=columns)
    known = table["p"].notna()
    table.loc[known, "p_adjusted"] = adjust(table.loc[known, "p"].to_numpy(), "holm")
    return table.sort_values("mean", ascending=False, kind="stable", ignore_index=True)


def answer(rungs: pd.DataFrame) -> str:
    """What the methods add up to, and which adds most, in a sentence.

    Args:
        rungs: Rows of ``ladder``.
    """
    by_rung = rungs.groupby("variant", sort=False)
    means = by_rung[f"final_{PRODUCT}"].mean()
    reached = [f"{numbers.percent(mean)} ({rung})" for rung, mean in means.items()]
    if len(reached) == 1:
        return f"Trainings reach a product of {reached[0]}."
    learned = by_rung[f"final_{SUCCESS}"].agg(lambda shares: (shares > LEARNED).sum())
    counts = [
        f"{count} of {n} ({rung})"
        for rung, count, n in zip(means.index, learned, by_rung.size(), strict=True)
    ]
    return (
        f"The product rises from {reached[0]} to {reached[-1]}; the largest step: "
        f"{means.diff().idxmax()}. "
        f"Trainings that learn to charge: {numbers.words(counts[:3])}."
    )


def difference(
    a: Sequence[float] | np.ndarray, b: Sequence[float] | np.ndarray, level: float = LEVEL
) -> tuple[Interval, float]:
    """The mean of A minus the mean of B, over independent trainings (Welch's t).

    If one of the two is a single training, Student's t with the standard deviation of the other is
    used; the interval then contains 0 if the single value could be one more training of the other.

    Returns:
        The interval and the p-value. The ends are nan if both are single trainings, and equal to
        the difference if all trainings of each side agree. The p-value is 1 if it is unknown.
    """
    a, b = np.asarray(a, float), np.asarray(b, float)
    gap = float(a.mean() - b.mean())
    if a.size + b.size < 3:
        return Interval(gap, np.nan, np.nan), 1.0
    if np.ptp(a) == np.ptp(b) == 0:
        return Interval(gap, gap, gap), 1.0
    test = stats.ttest_ind(a, b, equal_var=min(a.size, b.size) == 1)
    ends = test.confidence_interval(level)
    return Interval(gap, float(ends.low), float(ends.high)), float(test.pvalue)


def ablation_table(table: pd.DataFrame, last: pd.DataFrame, baseline: str) -> pd.DataFrame:
    """The rows of ``ablation`` for product, as a table of text.

    Args:
        table: Rows of ``ablation``.
        last: Rows of ``finals``, for the means of the other metrics.
        baseline: The variant with which the others are compared.
    """
    means = last.groupby("variant")[[f"final_{SUCCESS}", f"final_{RATIO}"]].mean()
    others = means.loc[table["variant"]].map(numbers.percent).to_numpy()
    gaps = table[["difference", "difference_low", "difference_high"]].to_numpy()
    columns = {
        "Variant": table["variant"],
        "n": table["n"],
        METRICS[PRODUCT]: [*map(_interval, table["mean"], table["low"], table["high"])],
        "One new training": [
            _interval(*ends).partition(" % ")[2]
            for ends in table[["mean", "new_low", "new_high"]].to_numpy()
        ],
        f"Difference from {baseline} [points]": [
            f"{numbers.points(*gap)} {MARKS[position(Interval(*gap))]}" if gap[0] == gap[0] else ""
            for gap in gaps
        ],
        "p (Holm)": table["p_adjusted"].map(numbers.p_value, na_action="ignore"),
        METRICS[SUCCESS]: others[:, 0],
        METRICS[RATIO]: others[:, 1],
    }
    return pd.DataFrame(columns)


def _interval(mean: float, low: float, high: float) -> str:
    """A mean with its interval, if it has one with a length."""
    return numbers.interval(mean, low, high) if low < high else numbers.percent(mean)
