"""The main effects of scenario parameters: how metrics change with each parameter.

The functions are for designs that vary one parameter at a time, like the paper's Fig. 5. All values
of a parameter are simulated in the same replications, so they are compared mission by mission:

    table = means_by_field(results)
    pairs = compare_values(results, table, "greedy", "uavs", PRODUCT)
    shape_of_changes(pairs).words  # "rises"
"""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from textwrap import fill
from typing import NamedTuple

import pandas as pd
from matplotlib.figure import Figure

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers import summary
from dess.analysis.answers.settings.figures import counted_missions, panel_grid
from dess.analysis.figures import Drawing, style
from dess.analysis.metrics import METRICS, PRODUCT, metric_of
from dess.analysis.names import field_named, value_text
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import add_adjusted, compare_pairs
from dess.analysis.stats.intervals import LEVEL, by_replication
from dess.analysis.tables import BARS, INTERVALS

_ENDS = ["difference", "low", "high"]
LEVELS, RISES, FALLS = "stays level", "rises", "falls"
PEAK, VALLEY, IRREGULAR = "rises, then falls", "falls, then rises", "goes up and down"


ByField = Mapping[str, Mapping[str, pd.DataFrame]]  # ``compare_values`` by parameter and policy


class Shape(NamedTuple):
    """How a metric changes along the values of a parameter.

    Two values differ significantly if their Holm-adjusted p-value is at most 1 - ``LEVEL``. If no
    two values differ, the metric stays level. If all significant differences have the same sign, it
    rises or falls. If there is a value such that no significant difference before it is a fall and
    none after it is a rise, the metric rises, then falls; and correspondingly for a valley.

    Attributes:
        words: One of ``LEVELS``, ``RISES``, ``FALLS``, ``PEAK``, ``VALLEY``, ``IRREGULAR``.
        peaks: Positions of the values at which the maximum may lie.
    """

    words: str
    peaks: tuple[int, ...]


def means_by_field(results: Results) -> pd.DataFrame:
    """Means with intervals of every policy at every value of every parameter.

    Returns:
        A row per parameter, value, policy and metric: ``field``, ``value`` in words, ``position``
        (0, 1, ... in the order of the study), and the columns of ``summary.means_of_points``.

    Raises:
        InputError: If a design point sets more or less than one field.
    """
    design = [point.values for point in results.store.manifest.points]
    for number, values in enumerate(design):
        if len(values) != 1:
            fields = ", ".join(values) or "no field"
            raise InputError(f"point {number}", f"sets {fields}", "one field at a time")
    rows = [(field, value_text(value)) for values in design for field, value in values.items()]
    table = pd.DataFrame(rows, columns=["field", "value"]).rename_axis("point").reset_index()
    table["position"] = table.groupby("field").cumcount()
    return table.merge(summary.means_of_points(results), on="point")


def compare_values(
    results: Results,
    table: pd.DataFrame,
    policy: str,
    field: str,
    metric: str,
    fewest_uavs: int = 1,
) -> pd.DataFrame:
    """Compare every two values of a parameter on the same missions.

    Args:
        results: The study.
        table: Its ``means_by_field``.
        policy: The policy.
        field: The parameter.
        metric: The metric.
        fewest_uavs: Missions with fewer UAVs are left out.

    Returns:
        A row per pair: ``first`` and ``second`` (positions), ``difference`` (second - first) with
        ``low`` and ``high`` (95 % each), ``wide_low`` and ``wide_high`` (95 % for all pairs at
        once, by Bonferroni), ``p``, ``p_adjusted`` (Holm, over the pairs), ``n``, the number of
        replications, and ``student``, as in ``stats.differences.Paired``.
    """
    positions = table[table["field"] == field].groupby("point")["position"].first()
    missions = results.missions_of(policy)
    missions = missions[missions["point"].isin(positions.index)]
    missions = missions[missions["uavs"] >= fewest_uavs]
    values = by_replication(missions, metric, "point").dropna().rename(columns=positions)
    couples = [*combinations(sorted(values), 2)]
    at_once = 1 - (1 - LEVEL) / max(len(couples), 1)
    rows = []
    for first, second in couples:
        samples = values[second].to_numpy(), values[first].to_numpy()
        pair, wide = (compare_pairs(*samples, level, metric) for level in (LEVEL, at_once))
        ends = pair.difference, pair.low, pair.high, wide.low, wide.high
        rows.append((first, second, *ends, pair.p, pair.n, pair.student))
    columns = ["first", "second", *_ENDS, "wide_low", "wide_high", "p", "n", "student"]
    return add_adjusted(pd.DataFrame(rows, columns=columns), "holm")


def compare_values_by_field(
    results: Results, table: pd.DataFrame, metric: str = PRODUCT
) -> ByField:
    """The changes of a metric, by parameter and policy.

    Args:
        results: The study.
        table: Its ``means_by_field``, of some policies. A parameter with one value has no changes.
    """
    policies = table["policy"].unique()
    fields = table.groupby("field", sort=False)["position"].nunique()
    return {
        str(field): {p: compare_values(results, table, p, str(field), metric) for p in policies}
        for field in fields.index[fields > 1]
    }


def shape_of_changes(pairs: pd.DataFrame) -> Shape:
    """The shape of a metric that follows from the differences of ``compare_values``."""
    sure = pairs[pairs["p_adjusted"] <= 1 - LEVEL]
    ups, downs = sure[sure["difference"] > 0], sure[sure["difference"] < 0]
    places = range(int(pairs["second"].max()) + 1)
    peaks = tuple(place for place in places if _rises_then_falls(place, ups, downs))
    if ups.empty or downs.empty:
        if sure.empty:
            words = LEVELS
        elif downs.empty:
            words = RISES
        else:
            words = FALLS
    elif peaks:
        words = PEAK
    else:
        if any(_rises_then_falls(place, downs, ups) for place in places):
            words = VALLEY
        else:
            words = IRREGULAR
    return Shape(words, peaks)


def _rises_then_falls(peak: int, ups: pd.DataFrame, downs: pd.DataFrame) -> bool:
    """Whether there is no fall before the peak, and no rise after it."""
    return bool((downs["second"] > peak).all() and (ups["first"] < peak).all())


def leading_policies(
    results: Results, learned: str | None = None, heuristic: str | None = None
) -> list[str]:
    """The best learned policy of a study, if it has one, and its best heuristic.

    Args:
        results: The study.
        learned: The learned policy to take instead of the best one.
        heuristic: The heuristic to take instead of the best one.

    Raises:
        InputError: If the study lacks a policy that is named.
    """
    for name in (learned, heuristic):
        if name is not None:
            results.check_policy(name)
    all_learned, others = summary.rank_learned_and_others(results)
    learned = learned or next(iter(all_learned), None)
    heuristic = heuristic or next(iter(others), None)
    return [policy for policy in (learned, heuristic) if policy]


def strongest_fields_sentence(
    table: pd.DataFrame, policies: Sequence[str], changes: ByField
) -> str:
    """Which parameters change the product of every policy most, in a sentence for each.

    A parameter may help one policy and hurt another one, so none of them stands for the others.

    Args:
        table: The ``means_by_field``.
        policies: The policies.
        changes: The changes of the product; where no two values differ significantly, it is said.
    """
    sentences = []
    for policy in policies:
        rows = table[(table["metric"] == PRODUCT) & (table["policy"] == policy)]
        by_field = rows.sort_values("position", kind="stable").groupby("field", sort=False)
        courses = []
        for field in strongest_fields(table, policy):
            values = by_field.get_group(field)
            extremes = [values["mean"].idxmin(), values["mean"].idxmax()]
            ends = values.loc[extremes].sort_values("position", kind="stable")
            first, last = [
                f"{numbers.format_percent(row.mean)} at {row.value}" for row in ends.itertuples()
            ]
            is_open = field in changes and shape_of_changes(changes[field][policy]).words == LEVELS
            doubt = ", inconclusive" if is_open else ""
            courses.append(f"{field_named(str(field)).within} (from {first} to {last}{doubt})")
        sentences.append(
            f"The product of {policy} depends most on the {' and on the '.join(courses)}."
        )
    counts = table.loc[table["policy"].isin(policies), "n"]
    return f"{' '.join(sentences)} n = {numbers.format_span(counts)} missions per value."


def strongest_fields(table: pd.DataFrame, policy: str, count: int = 2) -> list[str]:
    """The parameters along whose values the product of a policy changes most."""
    rows = table[(table["metric"] == PRODUCT) & (table["policy"] == policy)]
    by_field = rows.groupby("field", sort=False)["mean"]
    return [*(by_field.max() - by_field.min()).nlargest(count).index]


def main_effects_table(table: pd.DataFrame, changes: ByField, ratios: ByField) -> pd.DataFrame:
    """How product goes along every parameter, as a table to print.

    Beside the change of the product from the first to the last value stands that of the collection
    ratio alone, which no failed mission moves: a few failures can make most of a small change.

    Args:
        table: The ``means_by_field``.
        changes: ``compare_values_by_field``.
        ratios: The same of the collection ratio.
    """
    rows = table[table["metric"] == PRODUCT].set_index(["policy", "field", "position"]).sort_index()
    lines = []
    for field, pairs_of_field in changes.items():
        for policy, pairs in pairs_of_field.items():
            values = rows.loc[(policy, field)]
            along = shape_of_changes(pairs)
            ends = values.iloc[[0, -1]]
            first, last = [
                f"{numbers.format_percent(row.mean)} at {row.value}" for row in ends.itertuples()
            ]
            steps = [
                _format_total_change(changes_of_metric)
                for changes_of_metric in (pairs, ratios[field][policy])
            ]
            peaks = []
            if along.words == PEAK:
                peaks = values.loc[[*along.peaks], "value"]
            named = (field_named(field).name, policy, along.words, first, last)
            lines.append((*named, *steps, " or ".join(peaks)))
    heads = ["Parameter", "Policy", "Along the values", "First", "Last", "Last − first"]
    return pd.DataFrame(lines, columns=[*heads, "Of the ratio alone", "Highest at"])


def _format_total_change(pairs: pd.DataFrame) -> str:
    """The change from the first to the last value, in points."""
    ends = pairs[pairs["first"] == 0].sort_values("second").iloc[-1]
    return numbers.format_points(*ends[_ENDS])


def plot_effect(
    table: pd.DataFrame, field: str, changes: Mapping[str, pd.DataFrame], policies: list[str]
) -> Figure:
    """The metrics against a parameter: a part of Fig. 5.

    There is a panel per metric, with the same axis for every parameter of the table, and a panel
    with the differences from the first value, which has its own axis.

    Args:
        table: Rows of ``answers.main_effects.means_by_field``, of the policies to draw.
        field: The parameter.
        changes: For each policy to draw, its ``main_effects.compare_values`` in the last of
        ``METRICS``. policies: All policies of the study, so that every policy has the same colour
        on all pages.
    """
    rows = table[table["field"] == field]
    styles = style.policy_colours(policies, changes)
    first = rows[rows["position"] == 0]
    steps = pd.concat(
        [pairs[pairs["first"] == 0].assign(policy=name) for name, pairs in changes.items()]
    ).rename(columns={"difference": "mean", "second": "position"})
    steps = pd.concat([first.assign(mean=0.0, low=0.0, high=0.0).drop_duplicates("policy"), steps])
    steps["value"] = steps["position"].map(rows.set_index("position")["value"].to_dict())
    ratios: dict = {"sharex": True, "height_ratios": (1, 1.6, 1.6, 1.2)}
    with style.new_panels(7.6, 4, "y", **ratios) as (figure, axes):
        for ax, (metric, name) in zip(axes, METRICS.items(), strict=False):
            style.plot_along(rows[rows["metric"] == metric], styles, "%", ax)
            ax.set(
                ylabel=fill(name, 16), ylim=style.axis_ends(table[table["metric"] == metric], 0.1)
            )
        style.plot_along(steps, styles, "points", axes[-1])
        axes[-1].axhline(0, **style.ZERO)
        title = f"Paired difference from the value at {first['value'].iloc[0]}"
        axes[-1].set(title=title, ylabel="percentage\npoints")
        axes[-1].set_xlabel(field_named(field).label, parse_math=True)
    return figure


def draw_one_at_a_time(results: Results) -> Iterator[Drawing]:
    """The paper's metrics against every field, with all other fields as in the scenario."""
    table = means_by_field(results)
    for field, pairs in compare_values_by_field(results, table).items():
        data = table[table["field"] == field]
        caption = (
            f"n = {counted_missions(data)} missions per point; bars are {INTERVALS}. The lowest "
            "panel shows the paired difference from the first value, with an axis of its own: "
            f"{BARS}"
        )
        alt = f"The metrics against the {field_named(field).within}"
        yield Drawing(plot_effect(table, field, pairs, results.policies), alt, caption, data)


def plot_one_by_one(table: pd.DataFrame, policies: list[str]) -> Figure:
    """The product against every parameter, in panels side by side with the same axis.

    Args:
        table: Rows of ``answers.main_effects.means_by_field``, of the policies to draw.
        policies: All policies of the study, so that every policy has the same colour on all pages.
    """
    rows = table[table["metric"] == PRODUCT]
    fields = [*rows["field"].unique()]
    styles = style.policy_colours(policies, rows["policy"])
    with panel_grid(3.4, len(fields), len(fields)) as (figure, axes):
        for ax, field in zip(axes, fields, strict=True):
            style.plot_along(rows[rows["field"] == field], styles, "%", ax)
            ax.set_xlabel(fill(field_named(field).label, 24), parse_math=True)
            ax.tick_params(axis="x", labelsize=8)
        figure.supylabel(metric_of(PRODUCT).label, fontsize=10)
    return figure
