"""Training: its curves, what a choice of the trainer is worth, and trained policies."""

import shlex
import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
import pandas as pd
import pyarrow as pa
import scipy

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.settings.points import points_in_words
from dess.analysis.figures import Drawing
from dess.analysis.metrics import ALWAYS, METRICS, PRODUCT, RATIO, SUCCESS
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import add_adjusted
from dess.analysis.stats.intervals import LEVEL, Interval, mean_interval
from dess.analysis.stats.verdict import INCONCLUSIVE, MARKS, judge_parts, position_of, verdict_above
from dess.base.errors import unknown_name
from dess.base.files.reading import paths_in
from dess.base.files.tables import read_table
from dess.policies.learner.config import TrainingConfig, learner_identifier, read_description

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

BASELINE = "quick"  # the variant with which the others of the shipped curves are compared
SHIPPED = "ddqn"  # the variant of the shipped policy, which is trained longer
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


# A variant is off the axis if all of its trainings reach less than this share of the baseline.
OFF = 0.5


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


# The metrics that are evaluated while training, and their names.
LEARNED_REWARD = "evaluation_reward"
LEARNED_PRODUCT = f"evaluation_{PRODUCT}"
SHOWN = {LEARNED_REWARD: "Cumulative reward", LEARNED_PRODUCT: METRICS[PRODUCT]}
# Pairs of variants of the shipped curves, with and without transfer learning, by what both have in
# common otherwise.
PAIRS = {
    "all methods of this project": ("quick", "no transfer"),
    "no return guard": ("no guard", "no guard, no transfer"),
    "the paper's methods alone": ("none of the three", "none of the three, no transfer"),
    "the paper's methods alone, long": (
        "none of the three, long",
        "none of the three, no transfer, long",
    ),
}
_SIDES = ("with transfer", "without")
# Weight of the newest evaluation in the exponential moving average.
ALPHA = 0.5
# Level of the intervals of the paper's Fig. 3.
BAND_LEVEL = 0.99


# What holds for all figures of trainings.
TRAININGS = (
    "A line is the exponential moving average of a training, n = 1 (weight of the newest "
    f"evaluation {ALPHA:g}); dotted: phase I."
)


@dataclass(frozen=True)
class Transfer:
    """How trainings with transfer learning compare with those without it.

    Attributes:
        verdict: Of ``verdicts``, whether the mean curve with transfer ends above, by the interval
            of the last difference; ``INCONCLUSIVE`` if the trainings are too short.
        since: The training step from which on the mean curve stays above; None if it ends below.
        throughout: Whether that is the first step that both have.
        last: Difference of the curves at the last step, with its interval.
        length: The last step that both reach.
        trainings: Numbers of trainings with and without transfer.
    """

    verdict: str
    since: int | None
    throughout: bool
    last: Interval
    length: int
    trainings: tuple[int, int]

    @property
    def course(self) -> str:
        """Where the mean curve with transfer is above, in words."""
        if self.since is None:
            return "ends below, or level"
        if self.throughout:
            where = "in all of phase II"
        else:
            where = f"from step {self.since:,} on"
        return f"is above {where}"


def smooth_curves(curves: pd.DataFrame, metric: str) -> pd.DataFrame:
    """The exponential moving average of every training, started again in every phase.

    For evaluations x(t) it is e(t) = (1 - ALPHA) e(t - 1) + ALPHA x(t). At the first evaluation of
    a phase e = x, because the missions of different phases cannot be compared.

    Returns:
        A row per evaluation: ``variant``, ``seed``, ``phase``, ``updates``, ``value``.
    """
    keys = ["variant", "seed", "phase"]
    averages = curves.groupby(keys, sort=False)[metric].transform(_moving_average)
    return curves[[*keys, "updates"]].assign(value=averages)


def pairs_in(curves: pd.DataFrame) -> dict[str, tuple[str, str]]:
    """Those of ``PAIRS`` that have trainings of both variants."""
    variants = {*curves["variant"]}
    return {name: pair for name, pair in PAIRS.items() if {*pair} <= variants}


def transfer_drawings(curves: pd.DataFrame) -> list[Drawing]:
    """Trainings with transfer learning and without it, as in Fig. 3: the first and the last pair.

    Args:
        curves: Rows of ``read_curves``.
    """
    pairs = pairs_in(curves)
    return [
        Drawing(
            plot_trainings(curves, metric, dict(zip(pairs[name], _SIDES, strict=True))),
            f"{SHOWN[metric]} against training step, {name}, with and without transfer",
            f"Trainings with {name}.",
            smooth_curves(curves[curves["variant"].isin(pairs[name])], metric),
        )
        for name in dict.fromkeys([[*pairs][0], [*pairs][-1]])
        for metric in SHOWN
    ]


def plot_trainings(curves: pd.DataFrame, metric: str, labels: Mapping[str, str]) -> "Figure":
    """A metric against the training step, a line for each training: Fig. 3.

    Phases before the last one are dotted, and a vertical line marks the beginning of the last
    phase. The axis at the top shows the UAV-slots that have been simulated.

    Args:
        curves: Rows of ``read_curves``, or of ``curves_by_learner``.
        metric: One of ``SHOWN``.
        labels: The variants to draw, with their names in the legend.
    """
    from dess.analysis.figures import style

    drawn = curves[curves["variant"].isin(labels)]
    averages = smooth_curves(drawn, metric)
    looks = zip(labels.items(), style.readable_palette(), style.LINES, strict=False)
    with style.new_panels(3.9, values="y", legend=2) as (figure, ax):
        for (variant, label), colour, line in looks:
            of_variant = averages[averages["variant"] == variant]
            last = of_variant["phase"].iloc[-1]
            n = of_variant["seed"].nunique()
            names = {last: f"{label}, n = {n}"}
            for (_, phase), curve in of_variant.groupby(["seed", "phase"], sort=False):
                ax.plot(curve["updates"], curve["value"], line if phase == last else ":",
                        color=colour, linewidth=1.6, label=names.pop(phase, ""))  # fmt: skip
            start = of_variant.loc[of_variant["phase"] != last, "updates"].max()
            if start > 0:  # not if it is nan
                ax.axvline(start, color=style.MUTED, linewidth=1, zorder=1, gid="last phase")
                ax.annotate("phase II", (start, 0), xycoords=("data", "axes fraction"),
                            xytext=(4, 12), textcoords="offset points", fontsize=8.5,
                            **style.OUTLINED)  # fmt: skip
        low = averages["value"].min()
        high = averages["value"].max()
        room = 0.12 * (high - low) or 0.1
        style.set_axis_unit(ax.yaxis, "%" if metric == LEARNED_PRODUCT else "")
        ax.set(ylabel=SHOWN[metric], ylim=(low - room, high + room))
        _steps_axis(drawn, ax)
    return figure


def _steps_axis(curves: pd.DataFrame, ax: "Axes") -> None:
    """The training step below the axes, and the UAV-slots simulated until then above them."""
    longest = curves.sort_values("updates").iloc[-1]
    ax.set(xlim=(0, longest["updates"] * 1.02), xlabel="training step [1000 updates]")
    ax.xaxis.set_major_formatter(lambda x, _: f"{x / 1000:g}")
    slots = longest["uav_slots"] / longest["updates"] / 1e6
    top = ax.secondary_xaxis("top", functions=(lambda x: x * slots, lambda x: x / slots))
    top.set_xlabel("UAV-slots [millions]")


def last_phase(averages: pd.DataFrame, variant: str) -> pd.DataFrame:
    """The (steps, trainings) averages of a variant in its last phase, at their common steps."""
    curves = averages[averages["variant"] == variant]
    curves = curves[curves["phase"] == curves["phase"].iloc[-1]]
    return curves.pivot(index="updates", columns="seed", values="value").dropna()


def compare_transfer(averages: pd.DataFrame, using: str, without: str, shortest: int) -> Transfer:
    """Whether a variant with transfer learning overtakes the one without it and ends higher.

    They are compared in the last phase of both, in which both train in missions with battery
    decrease.

    Args:
        averages: Rows of ``smooth_curves``.
        using: The variant with transfer learning.
        without: The variant without it.
        shortest: Trainings of fewer steps are inconclusive.
    """
    a, b = (last_phase(averages, variant) for variant in (using, without))
    steps = a.index.intersection(b.index)
    lead = a.loc[steps].mean(axis=1) - b.loc[steps].mean(axis=1)
    behind = np.flatnonzero(lead <= 0)
    first = behind[-1] + 1 if len(behind) else 0
    since = None
    if first < len(steps):
        since = int(steps[first])
    last = difference_of_trainings(
        a.loc[steps[-1]].to_numpy(), b.loc[steps[-1]].to_numpy(), BAND_LEVEL
    )[0]
    length = int(steps[-1])
    if length >= shortest:
        verdict = judge_parts(verdict_above(last))
    else:
        verdict = INCONCLUSIVE
    return Transfer(verdict, since, not len(behind), last, length, (a.shape[1], b.shape[1]))


def compare_all_transfers(
    curves: pd.DataFrame, metrics: Iterable[str], shortest: int
) -> dict[tuple[str, str], Transfer]:
    """``compare_transfer`` of all pairs of variants, by the name of the pair and the metric."""
    averages = {metric: smooth_curves(curves, metric) for metric in metrics}
    return {
        (name, metric): compare_transfer(averages[metric], *pair, shortest)
        for name, pair in pairs_in(curves).items()
        for metric in averages
    }


def settling_position(averages: pd.Series, margin: float) -> int:
    """The position from which on the averages stay within a margin of the last one."""
    far = np.flatnonzero((averages - averages.iloc[-1]).abs() > margin)
    return int(far[-1]) + 1 if len(far) else 0


def transfer_table(
    transfers: Mapping[tuple[str, str], Transfer], verdicts: Mapping[tuple[str, str], str]
) -> pd.DataFrame:
    """Trainings with transfer learning compared with those without, as a table of text.

    Args:
        transfers: The result of ``transfers``, by the name of the pair and the metric.
        verdicts: The verdict on each.
    """
    rows = []
    for (name, metric), compared in transfers.items():
        last = compared.last
        if metric == LEARNED_REWARD:
            named = "Reward"
        else:
            named = "Product"
        if metric == LEARNED_PRODUCT:
            difference_at_end = numbers.format_points(*last)
        else:
            difference_at_end = _format_rewards(*last)
        if last.low == last.high:
            difference_at_end = f"{difference_at_end.split()[0]}, the same in all trainings"
        n = "{} and {}".format(*compared.trainings)
        cells = named, verdicts[name, metric], compared.course, difference_at_end
        rows.append((name[0].upper() + name[1:], n, *cells))
    head = ["Trainings with", "n", "Metric", "Verdict", "With transfer, the mean curve"]
    return pd.DataFrame(rows, columns=[*head, "Difference at the end"])


def _format_rewards(*ends: float) -> str:
    return numbers.with_ends(lambda value: numbers.format_signed(value, "+.0f"), *ends)


def _moving_average(values: pd.Series) -> pd.Series:
    return values.ewm(alpha=ALPHA, adjust=False).mean()


_COURSE = {"phase": pa.string(), "updates": pa.int64(), "uav_slots": pa.float64()}
_COURSE |= dict.fromkeys((LEARNED_REWARD, LEARNED_PRODUCT), pa.float64())
_EVALUATED = {f"evaluation_{metric}": pa.float64() for metric in METRICS}
_FINAL = {f"final_{metric}": pa.float64() for metric in METRICS}
_OF_TRAINING = {"tick": pa.int64(), "seconds": pa.float64(), "is_best": pa.bool_()}
CURVE = pa.schema(_COURSE | _OF_TRAINING | _EVALUATED)
CURVES = pa.schema(_COURSE | {"variant": pa.string(), "seed": pa.int64()} | _FINAL)


def read_curve(path: Path) -> pd.DataFrame:
    """The curve of a training, a row per evaluation.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curve.
    """
    return read_table(path, CURVE).to_pandas()


def read_curves(path: Path) -> pd.DataFrame:
    """The curves of trainings of several variants, with the metrics of the weights they selected.

    Raises:
        InputError: If the file is missing or damaged, or holds no such curves.
    """
    curves = read_table(path, CURVES).to_pandas()
    averages = curves.assign(value=0.0)
    pairs = pairs_in(curves).values()
    ends = [{*last_phase(averages, a).index} & {*last_phase(averages, b).index} for a, b in pairs]
    if BASELINE not in {*curves["variant"]} or not ends or not all(ends):
        pair = " and ".join(next(iter(PAIRS.values())))
        raise InputError(f"{path}: variant", "has no pair of trainings", pair)
    return curves


RUNS = 10  # where no learner has several trainings


def rliable_scores(results: Results, metric: str = PRODUCT) -> dict[str, np.ndarray]:
    """The scores that ``rliable.library.get_interval_estimates`` and its other functions take.

    Args:
        results: The study.
        metric: A metric of missions. Those with values between 0 and 1 need no normalisation.

    Returns:
        For every algorithm the mean of the metric over the missions of each run, (runs, tasks).

    Raises:
        InputError: If there is no such metric, a policy has fewer missions than there are runs, or
            learners have different numbers of trainings.
    """
    if metric not in ALWAYS:
        raise unknown_name("metric", f"{metric!r} is unknown", metric, ALWAYS)
    algorithms = _policies_of_runs(results)
    points = range(len(results.store.manifest.points))
    runs = len(next(iter(algorithms.values())))
    cells = results.missions.groupby(["policy", "point"], sort=False)[metric]
    size = int(cells.size().min()) // runs
    if not size:
        raise InputError("missions", f"{cells.size().min()} for {runs} runs", "at least one")
    means = {
        cell: values.to_numpy(float)[: runs * size].reshape(runs, size).mean(axis=1)
        for cell, values in cells
    }
    return {
        name: np.array([[means[p, point][run] for point in points] for run, p in enumerate(flown)])
        for name, flown in algorithms.items()
    }


def marl_eval_data(results: Results, metrics: Sequence[str] = (*METRICS,)) -> dict[str, Any]:
    """The data that ``marl_eval.utils.data_processing_utils.data_process_pipeline`` takes.

    Its levels are the study, the task, the algorithm, the run and the step. A study evaluates
    policies that are ready, so there is one step, ``step_1``, at ``step_count`` 0, and
    ``absolute_metrics`` has the same values. Commas in names of algorithms, which marl-eval does
    not allow, become plus signs.

    Args:
        results: The study.
        metrics: Metrics of missions.

    Returns:
        Plain data that ``json.dump`` writes, with the mean of each metric over the missions of
        each run.

    Raises:
        InputError: If a learner has no complete runs, as ``rliable_scores`` needs them.
    """
    study = results.study.name
    scores = {metric: rliable_scores(results, metric) for metric in metrics}
    runs = {name: range(len(rows)) for name, rows in scores[metrics[0]].items()}

    def steps(name: str, run: int, task: int) -> dict[str, Any]:
        values = {metric: [float(scores[metric][name][run, task])] for metric in metrics}
        return {"step_1": {"step_count": 0, **values}, "absolute_metrics": values}

    return {
        study: {
            setting or study: {
                name.replace(",", "+"): {f"run_{r + 1}": steps(name, r, task) for r in runs[name]}
                for name in runs
            }
            for task, setting in enumerate(points_in_words(results))
        }
    }


def _policies_of_runs(results: Results) -> dict[str, list[str]]:
    """For every algorithm the policy of each run."""
    trained = trained_policies_by_learner(results)
    others = set(results.policies).difference(*trained.values())
    algorithms = trained | {policy: [policy] for policy in results.policies if policy in others}
    counts = {len(policies) for policies in algorithms.values()} - {1}
    if len(counts) > 1:
        raise InputError("trainings", str(sorted(counts)), "as many of every learner")
    runs = max(counts, default=RUNS)
    return {
        name: names if len(names) == runs else names * runs for name, names in algorithms.items()
    }


class Trained(NamedTuple):
    """A trained policy.

    Attributes:
        name: The policy.
        config: Its training.
        curve: A row per evaluation while training.
    """

    name: str
    config: TrainingConfig
    curve: pd.DataFrame


def trained_policies(folder: Path) -> list[Trained]:
    """The trained policies in a folder that come with the curve of their training, by name.

    Curves on many seas are left out: they do not compare with those on one.

    Raises:
        InputError: If a policy or a curve is damaged.
    """
    paths = paths_in(folder, "*/training.parquet")
    trainings = [(path, read_description(path.parent).training) for path in paths]
    return [
        Trained(path.parent.name, config, read_curve(path))
        for path, config in trainings
        if not config.seas
    ]


def curves_by_learner(policies: Iterable[Trained]) -> pd.DataFrame:
    """The curves of trainings, as ``read_curves`` returns them.

    A variant is a learner, the trainings that differ in their seed alone, by its policies' names.
    """
    learners: dict[str, list[Trained]] = {}
    for policy in policies:
        learners.setdefault(learner_identifier(policy.config), []).append(policy)
    return pd.concat(
        policy.curve.assign(
            variant=numbers.join_words([p.name for p in group]), seed=policy.config.seed
        )
        for group in learners.values()
        for policy in group
    )


def shipped_drawings(policies: Iterable[Trained]) -> list[Drawing]:
    """The trainings of policies: their curves in the metrics that are evaluated."""
    curves = curves_by_learner(policies)
    labels = {name: name for name in curves["variant"].unique()}
    return [
        Drawing(plot_trainings(curves, metric, labels), f"{SHOWN[metric]} of the shipped policies")
        for metric in SHOWN
    ]


def course_in_words(policy: Trained, margin: float) -> str:
    """Where a training ends, and since when it has stayed within a margin: a Markdown item."""
    end = policy.curve.iloc[-1]
    averages = last_phase(smooth_curves(curves_by_learner([policy]), LEARNED_PRODUCT), policy.name)[
        policy.config.seed
    ]
    near = policy.curve.iloc[settling_position(averages, margin) - len(averages)]
    return (
        f"- **{policy.name}**: {numbers.format_percent(averages.iloc[-1])} after "
        f"{end['updates']:,} updates ({end['uav_slots'] / 1e6:.1f} million UAV-slots, "
        f"{end['seconds'] / 60:.0f} minutes); within {numbers.format_margin(margin)} of it from "
        f"update {near['updates']:,} on ({near['seconds'] / 60:.0f} minutes)."
    )


def training_commands(policies: Iterable[Trained]) -> list[str]:
    """The commands that train the policies again."""
    return [
        shlex.join(
            [
                *("dess", "train", policy.config.name),
                *("--seed", str(policy.config.seed), "--out", f"runs/{policy.name}"),
            ]
        )
        for policy in policies
    ]
