"""What a choice of the trainer is worth: variants of a training, compared by their results."""

import textwrap
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import scipy

from dess.analysis import numbers
from dess.analysis.answers.training.curves import BASELINE, SHIPPED
from dess.analysis.figures import Drawing
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS
from dess.analysis.stats.corrections import add_adjusted
from dess.analysis.stats.intervals import Interval, mean_interval
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import MARKS, position_of

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure

FINAL = f"final_{PRODUCT}"  # the product of the weights that a training has selected
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
# Variants that lack one of these methods, by what they lack.
ONE_LESS = {
    "no guard": "without the guard",
    "no low-battery starts": "without low-battery starts",
    "no early returns": "without early returns",
}
# A variant is off the axis if all of its trainings reach less than this share of the baseline.
OFF = 0.5


def last_rows(curves: pd.DataFrame) -> pd.DataFrame:
    """The last row of every training, which has the metrics of the selected weights."""
    return curves.groupby(["variant", "seed"], sort=False, as_index=False).last()


def of_equal_budget(last: pd.DataFrame, baseline: str) -> pd.DataFrame:
    """Those of ``last_rows`` that have made as many updates as the trainings of the baseline."""
    budget = last.loc[last["variant"] == baseline, "updates"].max()
    return last[last["updates"] == budget]


def rows_of_ladder(last: pd.DataFrame) -> pd.DataFrame:
    """Those of ``last_rows`` whose variants are in ``LADDER``, in its order, by what they add."""
    rungs = {variant: rung for rung, variant in LADDER.items()}
    named = last[last["variant"].isin(rungs)].replace({"variant": rungs})
    return named.sort_values("variant", key=lambda names: names.map([*LADDER].index), kind="stable")


def compare_variants(last: pd.DataFrame, baseline: str) -> pd.DataFrame:
    """The final product of every variant, and its difference from the baseline.

    Args:
        last: Rows of ``last_rows``.
        baseline: The variant with which the others are compared.

    Returns:
        A row per variant, the highest mean first: ``variant``, ``n`` trainings; ``mean``, ``low``,
        ``high`` of the expected result; ``new_low`` and ``new_high`` of one new training (nan with
        one training; the ends are cut at 0 and 1); ``difference``,
        ``difference_low``, ``difference_high``, ``p`` and ``p_adjusted`` (Holm), of
        ``difference_of_trainings``; nan for the baseline.
    """
    values = {v: part[FINAL].to_numpy() for v, part in last.groupby("variant", sort=False)}
    rows = []
    for variant, sample in values.items():
        mean, _, high = mean_interval(sample)
        alone = len(sample) == 1
        half = high - mean
        room = np.array([-half, half, *(np.sqrt(len(sample) + 1) * np.array([-half, half]))])
        if alone:
            ends = np.full(4, np.nan)
        else:
            ends = np.clip(mean + room, 0.0, 1.0)
        gap = Interval(np.nan, np.nan, np.nan)
        p = np.nan
        if variant != baseline:
            gap, p = difference_of_trainings(sample, values[baseline])
        rows.append((variant, len(sample), mean, *ends, *gap, p))
    columns = ["variant", "n", "mean", "low", "high", "new_low", "new_high"]
    columns += ["difference", "difference_low", "difference_high", "p"]
    table = add_adjusted(pd.DataFrame(rows, columns=columns), "holm")
    return table.sort_values("mean", ascending=False, kind="stable", ignore_index=True)


def draw_method_ladder(rungs: pd.DataFrame) -> Drawing:
    """The product that trainings reach with each further method.

    Args:
        rungs: Rows of ``rows_of_ladder``.
    """
    order = rungs["variant"].unique()
    table = compare_variants(rungs, order[-1]).set_index("variant").loc[order].reset_index()
    return draw_variants(
        table, rungs, order[-1], "The product that trainings reach, method by method"
    )


def draw_variants(table: pd.DataFrame, last: pd.DataFrame, baseline: str, alt: str) -> Drawing:
    """The product of every variant: trainings as dots, their mean with interval as a diamond.

    Args:
        table: Rows of ``compare_variants``.
        last: Rows of ``last_rows``.
        baseline: The variant whose mean is drawn as a line. Variants of which no training reaches
            ``OFF`` times as much are an arrow at the edge, unless another has some that do.
        alt: What the figure shows.
    """
    caption = (
        "A dot is a training; a diamond is the mean of n trainings with its 95 % interval "
        f"(Student's t). Dashed: the mean of {baseline}. An arrow: all trainings are left of the "
        "axis."
    )
    return Drawing(_plot_variants(table, last, baseline), alt, caption, table)


def _plot_variants(table: pd.DataFrame, last: pd.DataFrame, baseline: str) -> "Figure":
    from dess.analysis.figures import style

    values = last.groupby("variant")[FINAL]
    level = table.loc[table["variant"] == baseline, "mean"].item()
    drawn = pd.concat([last[FINAL], table["low"], table["high"]])
    split = ((values.min() < OFF * level) & (values.max() >= OFF * level)).any()
    ends = drawn[drawn >= (0 if split else OFF * level)].agg(["min", "max"])
    room = 0.06 * (ends["max"] - ends["min"]) or 0.01
    left = max(ends["min"] - room, -0.02)
    right = min(ends["max"] + room, 1.02)
    with style.new_panels(0.9 + 0.42 * len(table), values="x") as (figure, ax):
        ax.axvline(level, color=style.INK, linestyle="--", linewidth=1, zorder=1, gid="baseline")
        for y, (_, row) in enumerate(table.iterrows()):
            name = row["variant"]
            reached = values.get_group(row["variant"])
            if reached.max() < left:
                ax.plot(left, y, "<", color=style.INK, markersize=7, clip_on=False, gid=name)
            else:
                ax.scatter(reached, np.full(len(reached), y + 0.18 * (row["n"] > 1)), s=18,
                           color=style.MUTED, zorder=3, gid=name)  # fmt: skip
                if row["n"] > 1:
                    look = style.dot_style((style.readable_palette()[0], "D"))
                    ax.errorbar(row["mean"], y - 0.14, xerr=style.error_bar_arms(row), **look)
            style.note_at_right(f"{row['mean']:.1%}, n = {row['n']}", y, ax)
        names = ["\n".join(textwrap.wrap(variant, 22)) for variant in table["variant"]]
        ax.set_yticks(range(len(table)), names)
        ax.set(xlabel=METRICS[PRODUCT], ylim=(len(table) - 0.4, -0.6))
        style.set_axis_unit(ax.xaxis, "%", 5)
        ax.set_xlim(left, right)
    return figure


def without_each(last: pd.DataFrame) -> str:
    """How many trainings that lack one of the methods learn to charge, in a sentence.

    What a method adds depends on those that are there before it. So the steps of ``rows_of_ladder``
    do not say which method matters most; this says whether any single one is needed.

    Args:
        last: Rows of ``last_rows``.
    """
    learned = (last[f"final_{SUCCESS}"] > LEARNED).groupby(last["variant"], sort=False)
    counts = learned.agg(learning="sum", trainings="size")
    counts = counts.loc[[variant for variant in ONE_LESS if variant in counts.index]]
    if counts.empty:
        return ""
    parts = [
        f"{row.learning} of {row.trainings} {ONE_LESS[row.Index]}" for row in counts.itertuples()
    ]
    text = f"Of the trainings that lack one method, {numbers.join_words(parts)} learn to charge"
    if (counts["learning"] == counts["trainings"]).all():
        return f"{text}: no single method is needed for it."
    return f"{text}."


def learning_to_charge(last: pd.DataFrame, variant: str) -> str:
    """How many trainings of a variant learn to charge, as ``1 of 3``."""
    successes = last.loc[last["variant"] == variant, f"final_{SUCCESS}"]
    return f"{(successes > LEARNED).sum()} of {len(successes)}"


def methods_sentence(rungs: pd.DataFrame) -> str:
    """What the methods add up to, in a sentence.

    Args:
        rungs: Rows of ``rows_of_ladder``.
    """
    by_rung = rungs.groupby("variant", sort=False)
    means = by_rung[FINAL].mean()
    learned = by_rung[f"final_{SUCCESS}"].agg(lambda shares: int((shares > LEARNED).sum()))
    trainings = by_rung.size()
    reached = [f"{numbers.format_percent(mean)} ({rung})" for rung, mean in means.items()]
    if len(reached) == 1:
        return f"Trainings reach a product of {reached[0]}."
    counts = [f"{learned[rung]} of {trainings[rung]} ({rung})" for rung in means.index]
    ending = f"The mean product is {reached[-1]} in place of {reached[0]}."
    learning_all = np.flatnonzero((learned == trainings).to_numpy())
    if not len(learning_all):
        return f"With no method do all trainings learn to charge. {ending}"
    first = learning_all[0]
    fewer = ""
    if first:
        fewer = f", but only {numbers.join_words(counts[:first])}"
    return f"Of the trainings, {counts[first]} learn to charge{fewer}. {ending}"


def difference_of_trainings(
    a: Sequence[float] | np.ndarray, b: Sequence[float] | np.ndarray, level: float = LEVEL
) -> tuple[Interval, float]:
    """The mean of A minus the mean of B, over independent trainings (Welch's t).

    If one of the two is a single training, Student's t with the standard deviation of the other is
    used; the interval then contains 0 if the single value could be one more training of the other.

    Returns:
        The interval and the p-value. The ends are nan if both are single trainings, and equal to
        the difference if all trainings of each side agree. The p-value is 1 if it is unknown.
    """
    a = np.asarray(a, float)
    b = np.asarray(b, float)
    gap = float(a.mean() - b.mean())
    if a.size + b.size < 3:
        return Interval(gap, np.nan, np.nan), 1.0
    if np.ptp(a) == np.ptp(b) == 0:
        return Interval(gap, gap, gap), 1.0
    test = scipy.stats.ttest_ind(a, b, equal_var=min(a.size, b.size) == 1)
    ends = test.confidence_interval(level)
    return Interval(gap, float(ends.low), float(ends.high)), float(test.pvalue)


def ablation_table(table: pd.DataFrame, last: pd.DataFrame, baseline: str) -> pd.DataFrame:
    """The rows of ``compare_variants`` as a table of text.

    Args:
        table: Rows of ``compare_variants``.
        last: Rows of ``last_rows``, for the means of the other metrics.
        baseline: The variant with which the others are compared.
    """
    means = last.groupby("variant")[[f"final_{SUCCESS}", f"final_{RATIO}"]].mean()
    others = means.loc[table["variant"]].map(numbers.format_percent).to_numpy()
    gaps = table[["difference", "difference_low", "difference_high"]].to_numpy()
    columns = {
        "Variant": table["variant"],
        "n": table["n"],
        METRICS[PRODUCT]: [*map(_format_interval, table["mean"], table["low"], table["high"])],
        "One new training": [
            _format_interval(*ends).partition(" % ")[2]
            for ends in table[["mean", "new_low", "new_high"]].to_numpy()
        ],
        f"Difference from {baseline} [points]": [
            f"{numbers.format_points(*gap)} {MARKS[position_of(Interval(*gap))]}"
            if gap[0] == gap[0]
            else ""
            for gap in gaps
        ],
        "p (Holm)": table["p_adjusted"].map(numbers.format_p_value, na_action="ignore"),
        METRICS[SUCCESS]: others[:, 0],
        METRICS[RATIO]: others[:, 1],
    }
    return pd.DataFrame(columns)


def _format_interval(mean: float, low: float, high: float) -> str:
    """A mean with its interval, if it has one with a length."""
    if low < high:
        return numbers.format_interval(mean, low, high)
    return numbers.format_percent(mean)
