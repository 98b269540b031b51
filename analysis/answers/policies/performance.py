"""How good policies are, in words and figures, beside the numbers that the paper prints."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.summary import means_of_points
from dess.analysis.figures import Drawing, name_best_mean
from dess.analysis.metrics import HOME, METRICS, PRODUCT, SUCCESS, metric_of
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import difference_of_intervals
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.verdict import MARKS, position_of
from dess.analysis.tables import (
    INTERVALS,
)

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure

# How the numbers of the paper are drawn.
PRINTED: dict[str, Any] = {"linestyle": "--", "linewidth": 1.3}
_ENDS = ["mean", "low", "high"]
UNGUARDED = "random-unguarded"  # the policy that acts without the return guard


def compare_with_paper(
    estimates: pd.DataFrame, printed: Mapping[Any, Mapping[str, Interval]]
) -> pd.DataFrame:
    """The metrics of every policy, with marks relative to the numbers that the paper prints.

    Args:
        estimates: Rows of ``dess.analysis.summary`` by ``policy``, and by ``uavs`` if needed.
        printed: The printed numbers by number of UAVs (None for all missions), then by metric;
            one whose number of missions is not known is its own interval.

    Returns:
        A row of the printed numbers and a row per policy, with a column of text per metric and
        number of UAVs, see ``format_with_mark``; of all missions, also the share with the battery
        for the way home, which the paper does not have.
    """
    policies = estimates["policy"].unique()
    of_home = estimates[estimates["metric"] == HOME]
    columns = {("", "Policy"): ["paper", *policies]}
    for metric in next(iter(printed.values())):
        of_metric = estimates[estimates["metric"] == metric]
        for uavs, figures in printed.items():
            if uavs is None:
                rows = of_metric
            else:
                rows = of_metric[of_metric["uavs"] == uavs]
            texts = [format_with_mark(row, figures[metric]) for row in rows.itertuples()]
            head = ""
            if uavs is not None:
                head = f"I = {uavs}"
            columns[METRICS[metric], head] = [format_printed(figures[metric]), *texts]
    if None in printed and len(of_home):
        texts = [numbers.format_estimate(row) for _, row in of_home.iterrows()]
        columns[metric_of(HOME).name, ""] = ["", *texts]
    return pd.DataFrame(columns)


def way_home_in_words(means: pd.DataFrame) -> str:
    """What the paper's success is, and how often the UAVs of a success could fly home.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
    """
    of_home = means[means["metric"] == HOME].itertuples()
    shares = [f"{numbers.format_percent(row.mean)} with `{row.policy}`" for row in of_home]
    return (
        "Success is the paper's: the mission of a UAV ends where its quota is filled. The share of "
        "missions in which every UAV ends with the battery for its way home is "
        f"{numbers.join_words(shares) or 'not known'}. With `landing = true`, missions end on the "
        "ground."
    )


def format_printed(printed: Interval) -> str:
    """A printed number, with its interval if it has one."""
    if printed.low < printed.high:
        return numbers.format_interval(*printed)
    return numbers.format_percent(printed.mean)


def format_with_mark(estimate: Any, printed: Interval) -> str:
    """An estimate and its difference from a printed number: ``97.3 % [96.1, 98.1] +7.4 ▲``.

    The mark tells whether the interval of this difference lies above 0 or below it.
    """
    ours = Interval(estimate.mean, estimate.low, estimate.high)
    mark = MARKS[position_of(difference_of_intervals(ours, printed))]
    difference = numbers.format_difference(estimate.mean, printed.mean)
    return f"{numbers.format_interval(*ours)} {difference} {mark}"


def metrics_of_policy(means: pd.DataFrame, policy: str) -> pd.Series:
    """The means of a policy by metric, as text with their intervals.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
        policy: The policy.
    """
    rows = means[means["policy"] == policy].set_index("metric")
    return rows.loc[[*METRICS]].apply(numbers.format_estimate, axis=1)


def paper_sentence(means: pd.DataFrame, policy: str, printed: Mapping[str, float]) -> str:
    """The success and the product of a policy, beside the paper's product, in a sentence.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
        policy: The policy.
        printed: The paper's numbers by metric.
    """
    texts = metrics_of_policy(means, policy)
    n = means["n"].min()
    count = means["policy"].nunique()
    return (
        f"The best of {count} policies, {policy}, succeeds in {texts[SUCCESS]} of {n:,} missions "
        f"with a product of {texts[PRODUCT]}; the paper prints "
        f"{numbers.format_percent(printed[SUCCESS])} and "
        f"{numbers.format_percent(printed[PRODUCT])}."
    )


def guard_sentences(means: pd.DataFrame) -> str:
    """How often policies succeed under the return guard, and what success is without it.

    Args:
        means: Rows of ``dess.analysis.summary`` by policy.
    """
    policies = {*means["policy"]}
    guarded_means = means[(means["metric"] == SUCCESS) & (means["policy"] != UNGUARDED)]["mean"]
    ends = dict.fromkeys(map(numbers.format_percent, (guarded_means.min(), guarded_means.max())))
    text = (
        f"All policies but `{UNGUARDED}` act under the return guard: they succeed in "
        f"{' to '.join(ends)} of the missions."
    )
    for policy, guarded in (("random", "under"), (UNGUARDED, "without")):
        if policy in policies:
            share = metrics_of_policy(means, policy)[SUCCESS]
            text += f" Random moves {guarded} the guard have a success of {share}."
    return text


def plot_performance(
    summary: pd.DataFrame, metric: str, printed: Interval | None = None
) -> "Figure":
    """A metric of every policy: means with intervals, and the paper's number as a line and a band.

    Args:
        summary: Rows of ``dess.analysis.summary`` by ``policy``.
        metric: The metric.
        printed: The paper's number with its interval.
    """
    from dess.analysis.figures import style

    rows = summary[summary["metric"] == metric]
    measure = metric_of(metric)
    with style.new_panels(1.3 + 0.42 * len(rows), values="x") as (figure, ax):
        style.plot_in_rows(rows, ax)
        for y, mean in enumerate(rows["mean"]):
            style.note_at_right(measure.write(mean), y, ax)
        if printed is not None:
            ax.axvspan(printed.low, printed.high, **style.band(style.MUTED))
            ax.axvline(
                printed.mean,
                color=style.INK,
                **PRINTED,
                label=f"paper {measure.write(printed.mean)}",
                zorder=1,
            )
        ax.set(xlabel=measure.label, xlim=(-0.02, 1.02) if measure.is_bounded else None)
        style.set_axis_unit(ax.xaxis, measure.axis, 5)
    return figure


def plot_by_fleet(
    summary: pd.DataFrame, metric: str, printed: Mapping[int, float] | None = None
) -> "Figure":
    """A metric of every policy against the number of UAVs, with intervals.

    Args:
        summary: Rows of ``dess.analysis.summary`` by ``policy`` and ``uavs``.
        metric: One of ``METRICS``.
        printed: The paper's numbers by number of UAVs.
    """
    from dess.analysis.figures import style

    rows = style.place_values(summary[summary["metric"] == metric], "uavs")
    with style.new_panels(3.9, values="y", legend=5) as (figure, ax):
        style.plot_along(rows, style.policy_colours(rows["policy"]), "%", ax)
        if printed:
            ax.plot(
                *zip(*sorted(printed.items()), strict=True),
                "D",
                label="paper",
                color=style.INK,
                **PRINTED,
            )
        ax.set(ylabel=METRICS[metric], xlabel="number of UAVs", ylim=(-0.03, 1.04))
    return figure


def draw_performance(results: Results, metric: str) -> Drawing:
    """A metric of every policy at the only design point."""
    table = means_of_points(results)
    data = table[table["metric"] == metric]
    caption = name_best_mean(data, metric, ["policy"])
    name = results.study.replication_name
    caption += f"n = {numbers.format_span(data['n'])} {name}s per policy; bars are {INTERVALS}."
    alt = f"{metric_of(metric).name} of every policy"
    return Drawing(plot_performance(table, metric), alt, caption, data)
