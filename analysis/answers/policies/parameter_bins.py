"""How the difference of two policies depends on the parameters of the missions."""

from typing import Any

import numpy as np
import pandas as pd
import scipy
from matplotlib.figure import Figure

from dess.analysis import numbers
from dess.analysis.answers.policies.pairs import COLOURS, OF_BASELINE, Pair
from dess.analysis.figures import Drawing, style
from dess.analysis.metrics import PRODUCT
from dess.analysis.names import PARAMETERS, field_named, value_text
from dess.analysis.stats.corrections import add_adjusted, for_choice
from dess.analysis.stats.differences import compare_pairs
from dess.analysis.stats.verdict import (
    BETTER,
    INCONCLUSIVE,
    NOT_RULED_OUT,
    SEEN_BETTER,
    SEEN_WORSE,
    WORSE,
    better_or_worse,
    judge_by_tests,
)
from dess.analysis.stats.weights import values_within

BINS = 5  # largest number of bins of a parameter
LEAST = 10  # missions of a bin that is shown


def varying_parameters(missions: pd.DataFrame) -> list[str]:
    """The parameters that differ between the missions of ``pair_missions``."""
    return [field for field in PARAMETERS if missions[field].nunique() > 1]


def divide_into_bins(values: pd.Series, most: int = BINS) -> tuple[np.ndarray, list[str]]:
    """Divide values into at most ``most`` bins: one per value if possible, else by quantiles.

    Returns:
        (n,) the bin of each value, and the names of the bins, from the lowest on.
    """
    array = values.to_numpy()
    distinct = np.unique(array)
    edges = distinct[:-1]
    if len(distinct) > most:
        edges = np.quantile(array, np.arange(1, most) / most)
    _, codes = np.unique(np.searchsorted(edges, array), return_inverse=True)
    return codes, [_range_text(array[codes == code]) for code in range(codes.max() + 1)]


def differences_along_parameters(missions: pd.DataFrame, candidates: int = 1) -> pd.DataFrame:
    """The mean difference along every parameter that varies.

    Bins of fewer than ``LEAST`` missions would show nothing and are left out, and so is a parameter
    of which fewer than two bins are left.

    Args:
        missions: Rows of ``pair_missions``.
        candidates: Number of pairs among which the two policies were chosen.

    Returns:
        A row per parameter and bin; a parameter has at most ``BINS`` bins of about equally many
        missions. The columns are ``field``, ``position``, ``value`` in words, and those of a
        comparison: ``mean``, ``low``, ``high`` (by ``compare_pairs``, 95 %), ``p``, ``p_adjusted``
        (Holm over all rows, Bonferroni for the choice of the pair), ``n``, ``student``,
        ``p_student``, ``p_student_adjusted`` and ``verdict``.
    """
    rows = []
    for field in varying_parameters(missions):
        bin_of, names = divide_into_bins(missions[field], max(1, min(BINS, len(missions) // LEAST)))
        large = np.flatnonzero(np.bincount(bin_of) >= LEAST)
        for position, code in enumerate(large if len(large) > 1 else []):
            part = missions[bin_of == code]
            value = names[code]
            ours, theirs = (values_within(part, PRODUCT + end, ()) for end in ("", OF_BASELINE))
            comparison = compare_pairs(ours, theirs, metric=PRODUCT)
            without = comparison.student, comparison.p_student
            rows.append((field, position, value, *comparison[:4], comparison.n, *without))
    ends = ["difference", "low", "high", "p", "n", "student", "p_student"]
    table = pd.DataFrame(rows, columns=["field", "position", "value", *ends])
    table = for_choice(add_adjusted(table, "holm"), candidates)
    verdicts = [better_or_worse(side, PRODUCT) for side in judge_by_tests(table)]
    return table.rename(columns={"difference": "mean"}).assign(verdict=verdicts)


def colours_in_words(lead: pd.DataFrame, pair: Pair) -> str:
    """What the colours in ``draw_differences_along_parameters`` mean, of those that occur.

    Args:
        lead: Rows of ``differences_along_parameters``.
        pair: The policies.
    """
    meanings = {
        BETTER: f"{pair.policy} is better where a dot is blue",
        WORSE: f"{pair.policy} is worse where a dot is orange",
        SEEN_BETTER: f"a hollow blue dot is better in what was seen, where {NOT_RULED_OUT}",
        SEEN_WORSE: f"a hollow orange dot is worse in what was seen, where {NOT_RULED_OUT}",
        INCONCLUSIVE: "a hollow grey dot is inconclusive",
    }
    shown = [words for verdict, words in meanings.items() if verdict in {*lead["verdict"]}]
    if not shown:
        return ""
    verdicts = numbers.join_words(shown)
    return f"By Holm's test over all bins, {verdicts}. Dashed: the mean of all missions."


def draw_differences_along_parameters(
    missions: pd.DataFrame, lead: pd.DataFrame, pair: Pair, note: str = ""
) -> list[Drawing]:
    """The mean difference along each parameter: for each bin a dot with its interval.

    All have the same axis; the mean difference over all missions is a dashed line.

    Args:
        missions: Rows of ``pair_missions``.
        lead: Rows of ``differences_along_parameters``.
        pair: The policies.
        note: The beginning of the captions.
    """
    overall = values_within(missions, "difference", ()).mean()
    return [
        Drawing(
            _plot_difference_along(rows, overall, style.axis_ends(lead, zero=True)),
            f"Mean difference {pair.title} against {field}",
            f"{_range_in_words(rows)} {note}n = {numbers.format_span(rows['n'])} missions per dot.",
        )
        for field, rows in lead.groupby("field", sort=False)
    ]


def _range_in_words(rows: pd.DataFrame) -> str:
    """Where along a parameter the mean difference is the lowest, and where the highest."""
    ends = [
        f"{numbers.format_points(row['mean'], row['low'], row['high'])} points at {row['value']}"
        for row in (rows.loc[rows["mean"].idxmin()], rows.loc[rows["mean"].idxmax()])
    ]
    return f"From {' to '.join(ends)}."


def _plot_difference_along(rows: pd.DataFrame, overall: float, ends: tuple[float, float]) -> Figure:
    with style.new_panels(3.5, values="y") as (figure, ax):
        ax.axhline(0, **style.ZERO)
        ax.axhline(overall, color=style.MUTED, linestyle="--", zorder=1, gid="overall")
        for verdict, part in rows.groupby("verdict"):
            if verdict in (BETTER, WORSE):
                fillstyle = "full"
            else:
                fillstyle = "none"
            dot = style.dot_style((COLOURS[verdict], "o")) | {"fillstyle": fillstyle}
            style.plot_with_bars(part, part["position"], ax, linestyle="", **dot)
        ax.set_xlabel(field_named(rows["field"].iloc[0]).label, parse_math=True)
        ax.set(ylabel="mean difference [points]", ylim=ends)
        ax.set_xticks(rows["position"], rows["value"])
        style.set_axis_unit(ax.yaxis, "points")
    return figure


def dependence_on_parameters(missions: pd.DataFrame) -> pd.DataFrame:
    """Whether the difference depends on each parameter.

    Returns:
        A row per parameter that varies, the one that explains most first: ``field``, ``explained``
        (share of the variance between the bins of ``differences_along_parameters``), ``p``
        (Alexander and Govern's test of equal means, which lets the variances differ; 1 where the
        data are too few) and ``p_adjusted`` (Holm).
    """
    rows = []
    difference = missions["difference"]
    total = float(difference.var(ddof=0))
    for field in varying_parameters(missions):
        groups = difference.groupby(divide_into_bins(missions[field])[0])
        between = float(groups.transform("mean").var(ddof=0))
        rows.append((field, between / total if total else 0.0, _equal_means(groups)))
    table = pd.DataFrame(rows, columns=["field", "explained", "p"])
    return add_adjusted(table, "holm").sort_values(
        "explained", ascending=False, kind="stable", ignore_index=True
    )


def dependence_table(lead: pd.DataFrame, dependences: pd.DataFrame) -> pd.DataFrame:
    """How the difference depends on every parameter, as a table to print.

    Args:
        lead: Rows of ``differences_along_parameters``.
        dependences: Rows of ``dependence_on_parameters``.
    """
    lines = []
    for row in dependences[dependences["field"].isin(lead["field"])].itertuples():
        rows = lead[lead["field"] == row.field].sort_values("mean", kind="stable")
        bins_ = [f"{_format_points(bin_row)} at {bin_row.value}" for bin_row in rows.itertuples()]
        shown = numbers.format_percent(row.explained), numbers.format_p_value(row.p_adjusted)
        lines.append((field_named(row.field).name, bins_[0], bins_[-1], *shown))
    heads = ["Parameter", "Lowest difference", "Highest difference", "Variance explained"]
    return pd.DataFrame(lines, columns=[*heads, "p, adjusted"])


def _equal_means(groups: Any) -> float:
    """The p-value of equal means; 1 if fewer than two groups have different values."""
    samples = [group.to_numpy() for _, group in groups if np.ptp(group) > 0]
    if len(samples) > 1:
        return float(scipy.stats.alexandergovern(*samples).pvalue)
    return 1.0


def _range_text(values: np.ndarray) -> str:
    """The range of values: ``3``, ``70–72``, or ``11.7–12.1``, rounded."""
    ends = [float(f"{end:.3g}") for end in (values.min(), values.max())]
    return value_text(ends if ends[0] < ends[1] else ends[0])


def _format_points(row: Any) -> str:
    return numbers.format_points(row.mean, row.low, row.high)
