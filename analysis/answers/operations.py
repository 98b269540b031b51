"""Questions about the operation of a fleet: charging pads, the age of the data, failures.

table = changes_from_reference(results, "pads", 4, PRODUCT)  # of the study ``pads``
enough_pads_sentence(results, margin=0.01)  # the answer in words
"""

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.settings.effects import average_over_others
from dess.analysis.answers.settings.figures import plot_curves
from dess.analysis.answers.settings.points import values_of_points, varied_values
from dess.analysis.figures import Drawing, name_best_mean
from dess.analysis.figures.missions import plot_courses
from dess.analysis.measured import check_metric
from dess.analysis.metric_ranges import metric_in_groups
from dess.analysis.metrics import AGE, PRODUCT, RATIO, SUCCESS, metric_of
from dess.analysis.names import value_text
from dess.analysis.results.event_log import mission_length
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import compare_pairs, relative_change
from dess.analysis.stats.intervals import Interval
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.rows import check_share
from dess.analysis.stats.verdict import (
    ABOVE,
    BELOW,
    INCONCLUSIVE,
    SEEN_ABOVE,
    SEEN_BELOW,
    judge_intervals,
)
from dess.analysis.stats.weights import by_replication
from dess.analysis.tables import allowance_sentence, most_widened

# The published changes of the average age of information, from one UAV to this number, in another
# model of the same kind (Mathematics 13(21) 3564).
PUBLISHED = {2: -0.46, 10: -0.79}
RATE, REPAIR = "failures.uav_rate", "failures.uav_repair"
QUANTILES = (0.1, 0.9)  # the quantiles between which most queues are
# The events that begin and end the wait of a UAV for a pad.
_WAITS = (
    *("charge_request", "charge_start", "charge_withdrawal", "uav_failure", "quota_filled"),
    *("battery_empty", "landing", "mission_end"),
)
_ENDS = ["mean", "low", "high"]


def means_of_metrics(results: Results, metrics: Iterable[str]) -> pd.DataFrame:
    """The means of metrics at every design point.

    Returns:
        A row per metric, policy and design point: ``metric``, ``policy``, the varied fields,
        ``mean``, ``low``, ``high`` (95 %) and ``n``.

    Raises:
        InputError: If there is no such metric.
    """
    fields = [*varied_values(results)]
    tables = [average_over_others(results, fields, m).assign(metric=m) for m in metrics]
    return pd.concat(tables, ignore_index=True)[["metric", "policy", *fields, *_ENDS, "n"]]


def draw_means(
    means: pd.DataFrame, x: str, line: str, panel: str, against: str, linked: bool = False
) -> dict[str, Drawing]:
    """The means of metrics against a field, by metric.

    Args:
        means: Rows of ``means_of_metrics``.
        x: The field.
        line: The field with a curve for each value.
        panel: The column with a panel for each value.
        against: The two fields in words.
        linked: Whether pages link to the data.
    """
    counted = numbers.format_span(means["n"])
    caption = f"n = {counted} missions per dot; bars are {numbers.format_level(LEVEL)} intervals."
    return {
        str(metric): Drawing(
            plot_curves(rows, x, line, str(metric), panel),
            f"{metric_of(str(metric)).name} against {against}",
            name_best_mean(rows, str(metric), ["policy", x, line]) + caption,
            rows if linked else None,
        )
        for metric, rows in means.groupby("metric", sort=False)
    }


def changes_from_reference(
    results: Results, field: str, reference: Any, metric: str, relative: bool = False
) -> pd.DataFrame:
    """How a metric changes with a field, from a reference value and in the same replications.

    Args:
        results: The study.
        field: The field.
        reference: The value with which all others are compared.
        metric: The metric.
        relative: Whether changes are shares of the mean at the reference value.

    Returns:
        A row per policy and design point with another value: ``policy``, the varied fields,
        ``mean`` (the change) with ``low`` and ``high`` (95 %), ``student`` (as in
        ``stats.differences.Paired``), and ``n`` pairs. A point without a
        partner, the same but for the field, has no row.

    Raises:
        InputError: If there is no such metric, or the field never has the reference value.
    """
    check_metric(metric, results.missions)
    table = values_of_points(results)
    if field not in table or reference not in table[field].to_numpy():
        raise InputError(field, f"is never {reference!r} in the study", "one of its values")
    rows = []
    for policy, missions in results.missions.groupby("policy", sort=False):
        wide = by_replication(missions, metric, "point")
        measure = metric_in_groups(missions, metric, ["point"], wide.columns.to_frame())
        for point, partner in _pairs_of_points(table, field, reference):
            both = wide[[point, partner]].dropna()
            if both.empty:
                continue
            pairs = both[point].to_numpy(float), both[partner].to_numpy(float)
            metric_at_point, metric_at_partner = (
                measure.at(wide.columns.get_loc(name)) for name in (point, partner)
            )
            if relative:
                plain = relative_change(*pairs)
                change = (
                    *relative_change(*pairs, metric_at_point, metric_at_partner),
                    (plain.high - plain.low) / 2,
                )
            else:
                pair = compare_pairs(*pairs, metric=metric_at_point, metric_of_b=metric_at_partner)
                change = (*pair[:3], pair.student)
            rows.append((policy, *table.to_dict("records")[point].values(), *change, len(both)))
    return pd.DataFrame(rows, columns=["policy", *table, *_ENDS, "student", "n"])


def allowance_in_words(changes: pd.DataFrame, what: str) -> str:
    """Why the intervals of changes are wider than the missions alone would make them.

    Args:
        changes: Rows of ``changes_from_reference``, which are shares.
        what: What has changed, in words.

    Returns:
        Sentences with the change that becomes wider by most; empty if none becomes much wider.
    """
    row = most_widened(changes)
    if row is None:
        return ""
    plain, wide = (f"±{100 * row[half]:.2g} points" for half in ("student", "half"))
    return allowance_sentence(
        f"the change of {what} with {row['policy']}", plain, wide, int(row["n"])
    )


def enough_pads(results: Results, margin: float) -> pd.DataFrame:
    """The fewest pads that are enough for every fleet, and the most that are too few.

    A number of pads is enough if with it, and with every larger number, the product is at most
    ``margin`` below that with most pads: the lower end of the 95 % interval says so. It is too few
    if the whole interval says that more is lost. What is neither is open.

    Args:
        results: The study ``pads``, or another one that varies ``uavs`` and ``pads``.
        margin: The difference that does not matter, as a share.

    Returns:
        A row per policy and fleet: ``policy``, ``uavs``, ``pads`` (the fewest that are enough),
        ``too_few`` (the most that are too few, 0 if none is), and ``open``, those in between.

    Raises:
        InputError: If the study does not vary these fields, or the margin is no share.
    """
    check_share("margin", margin)
    pads = varied_values(results).get("pads", [0])
    lost = changes_from_reference(results, "pads", max(pads), PRODUCT)
    rows = []
    for (policy, uavs), part in lost.groupby(["policy", "uavs"], sort=False):
        short = part.loc[part["low"] < -margin, "pads"].max()
        enough = min(n for n in (*part["pads"], max(pads)) if not n <= short)
        few = part.loc[(part["high"] < -margin) & (part["pads"] < enough), "pads"].max()
        few = 0 if np.isnan(few) else int(few)
        rows.append((policy, uavs, enough, few, [n for n in part["pads"] if few < n < enough]))
    return pd.DataFrame(rows, columns=["policy", "uavs", "pads", "too_few", "open"])


def short_of_pads(results: Results, margin: float) -> list[int]:
    """The design points with one pad, and with one pad less than is enough, for every fleet."""
    table = values_of_points(results)
    sufficient = enough_pads(results, margin)
    enough = sufficient[sufficient["policy"] == results.policies[0]].set_index("uavs")["pads"]
    fewer = table[table["pads"] < table["uavs"].map(enough)]
    fewest = table[table["pads"] == table["pads"].min()]
    return sorted({*fewest.index, *fewer.groupby("uavs")["pads"].idxmax()})


def _number_with_verb(number: int) -> str:
    """A number as ``1 is`` or ``3 are``."""
    return f"{number} are" if number > 1 else f"{number} is"


def enough_pads_sentence(results: Results, margin: float) -> str:
    """How many pads are enough for every fleet, by the first policy of the study."""
    sufficient = enough_pads(results, margin)
    most = max(varied_values(results).get("pads", [0]))
    parts = []
    for row in sufficient[sufficient["policy"] == results.policies[0]].itertuples():
        part = f"{_number_with_verb(row.pads)} enough for {row.uavs} UAVs"
        if row.too_few:
            part += f", {_number_with_verb(row.too_few)} too few"
        if row.open:
            part += f", {numbers.join_words([*map(str, row.open)])} open"
        parts.append(part)
    counted = numbers.format_span(changes_from_reference(results, "pads", most, PRODUCT)["n"])
    return (
        f"Of charging pads, {'; '.join(parts)} (policy {results.policies[0]}, at most "
        f"{numbers.format_margin(margin)} of the product lost, n = {counted} missions)."
    )


def few_pads_sentence(results: Results) -> str:
    """What the fewest pads cost every fleet against the most, in success and in collected data.

    The policy is the first of the study. The means are those of ``means_of_metrics``, the
    differences those of ``changes_from_reference``.
    """
    pads = varied_values(results).get("pads", [0])
    fewest = min(pads)
    most = max(pads)
    lines = []
    for metric in (SUCCESS, RATIO):
        shares = means_of_metrics(results, [metric]).set_index(["policy", "uavs", "pads"])["mean"]
        lost = changes_from_reference(results, "pads", most, metric)
        lost = lost[(lost["policy"] == results.policies[0]) & (lost["pads"] == fewest)]
        for row in lost.itertuples():
            with_fewest, with_most = (
                numbers.format_percent(shares[row.policy, row.uavs, count])
                for count in (fewest, most)
            )
            lines.append(
                f"- The {metric_of(metric).within} of {numbers.format_count(row.uavs, 'UAV')} is "
                f"{with_fewest} with {numbers.format_count(fewest, 'pad')} and {with_most} with "
                f"{most}: {numbers.format_points(row.mean, row.low, row.high)} points, "
                f"n = {row.n:,}."
            )
    return "\n".join(lines)


def age_changes(results: Results) -> pd.DataFrame:
    """The change of the average age from one UAV to more, as a share, by arrival rate.

    Returns:
        The rows of ``changes_from_reference``, with the column ``published`` (nan where nothing
        is).
    """
    table = changes_from_reference(results, "uavs", 1, AGE, relative=True)
    return table.assign(published=table["uavs"].map(PUBLISHED))


def age_sentence(results: Results) -> str:
    """The mean age with the smallest and the third fleet, at the extreme arrival rates.

    Whether it falls is said by the interval of the relative change, which the page shows.
    """
    table = means_of_metrics(results, [AGE])
    table = table[table["policy"] == results.policies[0]].sort_values("uavs")
    few, more = table["uavs"].unique()[:3][[0, -1]]
    ends = table[table["uavs"].isin([few, more])].set_index("arrival_rate")[_ENDS]
    changed = changes_from_reference(results, "uavs", few, AGE, relative=True)
    changed = changed[(changed["policy"] == results.policies[0]) & (changed["uavs"] == more)]
    verbs = {
        ABOVE: "rises",
        SEEN_ABOVE: "rises in what was seen",
        INCONCLUSIVE: "does not surely change,",
        SEEN_BELOW: "falls in what was seen",
        BELOW: "falls",
    }
    parts = []
    for rate in dict.fromkeys([ends.index.min(), ends.index.max()]):
        (change,) = changed[changed["arrival_rate"] == rate].itertuples()
        rows = ends.loc[[rate]].to_numpy()
        ages = [numbers.format_decimals(mean, low, high, digits=1) for mean, low, high in rows]
        parts.append(
            f"{verbs[_judge_change(change)]} from {' to '.join(ages)} slots at an arrival rate of "
            f"{value_text(rate)}"
        )
    return (
        f"From {few} to {more} UAVs the mean age of the data {numbers.join_words(parts)} "
        f"(policy {results.policies[0]}, n = {numbers.format_span(changed['n'])} missions)."
    )


def _judge_change(change: Any) -> str:
    """The verdict on a row of ``changes_from_reference``."""
    seen = Interval(change.mean, change.mean - change.student, change.mean + change.student)
    return judge_intervals(change, seen)


def published_age_in_words() -> str:
    """The published changes of the age with the number of UAVs, in words."""
    parts = [
        f"{numbers.format_minus(f'{100 * change:.0f}')} % from one to {uavs} UAVs"
        for uavs, change in PUBLISHED.items()
    ]
    return numbers.join_words(parts)


def mission_lengths_sentence(results: Results) -> str:
    """How many mission slots the missions last, in a sentence."""
    slots = results.missions["slots"]
    longest = results.scenario().max_slots
    whole = int((slots == longest).sum())
    if whole == len(slots):
        return f"Every mission lasts to its last slot, {longest:,}."
    return f"{whole:,} of {len(slots):,} missions last to the last slot, {longest:,}."


def failures_sentence(results: Results) -> str:
    """What the lowest failure rate costs the smallest fleet, by the first policy."""
    lost = changes_from_reference(results, RATE, 0.0, PRODUCT)
    rows = lost[lost["policy"] == results.policies[0]]
    rows = rows[(rows["uavs"] == rows["uavs"].min()) & (rows[RATE] == rows[RATE].min())]
    parts = [
        f"by {numbers.format_points(*row[_ENDS])} points if it is "
        + (f"repaired in {row[REPAIR]:g} slots" if row[REPAIR] else "lost")
        for _, row in rows.iterrows()
    ]
    return (
        f"If a UAV fails in each slot with probability {value_text(rows[RATE].iloc[0])}, the "
        f"product of {rows['uavs'].iloc[0]} UAVs changes {numbers.join_words(parts)} "
        f"(policy {results.policies[0]}, n = {numbers.format_span(rows['n'])} missions)."
    )


def format_relative_change(mean: float, low: float, high: float) -> str:
    """A relative change with its interval, as ``−46.0 % [−47.1, −44.9]``."""
    mean_text, *ends = [numbers.format_minus(f"{100 * value:+.1f}") for value in (mean, low, high)]
    return f"{mean_text} % [{ends[0]}, {ends[1]}]"


def count_waiting_uavs(events: pd.DataFrame) -> np.ndarray:
    """The number of UAVs that wait for a pad in every mission slot, (slots,)."""
    log = events[(events["uav"] >= 0) & events["event"].isin(_WAITS)]
    ends = log.groupby("uav")["time"].shift(-1)
    waits = log.assign(end=ends)[log["event"] == "charge_request"].dropna(subset="end")
    begin, end = waits[["time", "end"]].to_numpy(int).T[..., None]
    slots = np.arange(mission_length(events))
    return np.asarray(((begin <= slots) & (slots < end)).sum(axis=0))


def queues_over_time(results: Results, policy: str, points: Iterable[int]) -> pd.DataFrame:
    """The queue for pads in every mission slot, over the missions whose event logs are kept.

    A mission that is over has no queue. The last slot is that of the longest mission.

    Args:
        results: The study.
        policy: The policy.
        points: Numbers of design points.

    Returns:
        A row per design point and slot: ``point``, the varied fields, ``slot``, the ``mean`` number
        of UAVs that wait, ``low`` and ``high`` (their ``QUANTILES`` over missions), and ``n``
        missions.

    Raises:
        InputError: If no event log is kept.
    """
    tables = []
    for point in points:
        first = results.cell(policy, point).first
        logged = range(first, first + max(results.study.logged, 1))
        of_missions = [
            pd.Series(count_waiting_uavs(results.events(policy, point, n))) for n in logged
        ]
        counts = pd.concat(of_missions, axis=1).fillna(0)
        ends = dict(
            zip(("low", "high"), counts.quantile(QUANTILES, axis=1).to_numpy(), strict=True)
        )
        rows = pd.DataFrame({"slot": counts.index, "mean": counts.mean(axis=1), **ends})
        fields = values_of_points(results).loc[[point] * len(rows)].rename_axis("point")
        rows = pd.concat([fields.reset_index(), rows], axis=1)
        tables.append(rows.assign(n=len(logged)))
    return pd.concat(tables, ignore_index=True)


def draw_queues(results: Results, margin: float) -> Drawing:
    """The queues with the fewest pads, and with one pad less than is enough, by fleet."""
    rows = queues_over_time(results, results.policies[0], short_of_pads(results, margin))
    titles = {uavs: f"UAVs that wait for a pad: {uavs} UAVs" for uavs in rows["uavs"].unique()}
    panels = rows.assign(panel=rows["uavs"])
    low, high = map(numbers.format_level, QUANTILES)
    return Drawing(
        plot_courses(panels, "pads", "", titles, "Number of charging pads"),
        "The number of UAVs that wait for a pad over the slots of the mission",
        f"Mean of n = {rows['n'].min()} missions; the band is from the {low} to the {high} "
        "quantile.",
        rows,
    )


def _pairs_of_points(table: pd.DataFrame, field: str, reference: Any) -> Iterator[tuple[int, int]]:
    """Every design point, and the one that differs from it only by the reference value."""
    others = [name for name in table if name != field]
    for _, part in table.groupby(others, sort=False) if others else [((), table)]:
        partner = part.index[part[field] == reference]
        for point in part.index:
            if len(partner) and point != partner[0]:
                yield int(point), int(partner[0])
