"""Every policy on many seas: all together, by family, by number of nodes and of UAVs.

    results = load_results("results/seas")  # of a study whose design is a set of seas
    means_over_seas(results, "family")  # a row per policy and family
    differences_from_baseline(results, "greedy", "family")  # paired differences
    shares_of_reference(results, "planner", "family")  # products as shares of that of a policy

The seas are the sampling units: what a policy reaches on a sea is its mean over the missions there.
"""

from collections.abc import Callable

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.policies.decision_times import (
    Times,
    decision_time_front,
    plot_decision_times,
)
from dess.analysis.figures import Drawing, name_best_mean, style
from dess.analysis.metrics import BOUND, PRODUCT, SUCCESS
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import column_tests, relative_change
from dess.analysis.stats.intervals import Interval, column_intervals
from dess.policies.shipped import REFERENCES
from dess.scenario.scenario import SEA

# Groups of seas by their number of nodes: the largest number of each but the last.
_NODES = (15, 30, 60)
_NODES_IN_WORDS = ("1 to 15", "16 to 30", "31 to 60", "61 and more")
ALL = "all"

GROUPS = {"family": "Family", "nodes": "Nodes", "uavs": "UAVs"}
_ENDS = ["mean", "low", "high"]


def missions_by_sea(results: Results) -> pd.DataFrame:
    """The missions with the columns ``sea``, ``family``, ``nodes`` (a group in words) and ``all``.

    Raises:
        InputError: If the design of the study is not a set of seas.
    """
    names = _sea_names(results)
    if not all(":" in name for name in names):
        raise InputError(
            results.store.folder, "no study of seas", "one whose design is a set of seas"
        )
    counts = np.array([len(space.nodes) for space in results.store.manifest.scenarios])
    point = results.missions["point"].to_numpy()
    sea = pd.Series(names, dtype=str)[point].to_numpy()
    group = np.searchsorted(_NODES, counts)[point]
    return results.missions.assign(
        sea=sea, family=[name.partition(":")[0] for name in sea], all=ALL,
        nodes=np.array(_NODES_IN_WORDS)[group],
    )  # fmt: skip


def means_over_seas(results: Results, by: str = ALL, metric: str = PRODUCT) -> pd.DataFrame:
    """The means of every policy over seas.

    Args:
        results: The study.
        by: ``all``, ``family``, ``nodes`` or ``uavs``.
        metric: The metric.

    Returns:
        A row per group and policy: ``by``, ``policy``, ``metric``, ``mean``, ``low``, ``high`` and
        ``n`` seas.
    """
    table = _of_groups(results, by, metric, lambda values: column_intervals(values, metric))
    return table.assign(metric=metric)[[by, "policy", "metric", *_ENDS, "n"]]


def differences_from_baseline(results: Results, baseline: str, by: str = ALL) -> pd.DataFrame:
    """Paired differences of the product between every other policy and a baseline.

    Returns:
        A row per group and policy: ``by``, ``policy``, ``difference`` with ``low``, ``high`` and
        ``p``, and ``n`` seas.
    """

    def compared(values: pd.DataFrame) -> pd.DataFrame:
        return column_tests(values.drop(columns=baseline), values[baseline], PRODUCT)

    return _of_groups(results, by, PRODUCT, compared)


def reference_of(results: Results) -> str:
    """The slow policy of a study that others are compared with."""
    return next((name for name in REFERENCES if name in results.policies), REFERENCES[0])


def shares_of_reference(results: Results, reference: str, by: str = ALL) -> pd.DataFrame:
    """The product of every policy as a share of that of a reference.

    Returns:
        A row per group and policy: ``by``, ``policy``, ``mean``, ``low``, ``high`` and ``n`` seas.
    """

    def compared(values: pd.DataFrame) -> pd.DataFrame:
        reference_values = values[reference].to_numpy()
        changes = {
            name: relative_change(column.to_numpy(), reference_values, PRODUCT)
            for name, column in values.items()
        }
        changes[reference] = Interval(0.0, 0.0, 0.0)  # of itself, which is no estimate
        return (1 + pd.DataFrame(changes, index=_ENDS).T).assign(n=len(values))

    return _of_groups(results, by, PRODUCT, compared)[[by, "policy", *_ENDS, "n"]]


def by_group(results: Results, reference: str) -> list[Drawing]:
    """What every policy reaches in groups of seas, as a share of what a reference does."""
    drawings = []
    for by, name in GROUPS.items():
        table = shares_of_reference(results, reference, by)
        table = table[table["policy"] != reference]
        styles = style.policy_colours(table["policy"])
        with style.new_panels(4.2) as (figure, ax):
            style.plot_along(style.place_values(table, by), styles, "%", ax, linestyle="")
            ax.set(ylabel=f"product, share of {reference}")
        alt = f"The product as a share of that of {reference}, by {name.lower()}"
        caption = (
            f"n = {table['n'].min()} seas and more per dot; bars are 95 % intervals. Above 100 %, "
            f"a policy collects more than {reference}."
        )
        drawings.append(Drawing(figure, alt, caption, table))
    return drawings


def draw_decision_time_front(results: Results, times: Times) -> Drawing:
    """The product over all seas against the time of a decision of every policy that was timed.

    Its data have a row per policy, the fastest first: ``policy``, ``mean``, ``low``, ``high``,
    ``n``, ``seconds`` (of a decision for a UAV, in batches), and ``on_front``.
    """
    points = decision_time_front(means_over_seas(results), {c.policy: c.batch for c in times.costs})
    return Drawing(
        plot_decision_times(points),
        "Time of a decision against the product over all seas, and the Pareto front",
        f"{name_best_mean(points, PRODUCT, ['policy'])}n = {points['n'].max()} seas; bars are 95 % "
        "intervals over seas. Times are those of a "
        "decision for a UAV on one core, many missions side by side.",
        points,
    )


def policies_table(results: Results, times: Times) -> pd.DataFrame:
    """Every policy over all seas, as a table of text: quality, as a share of others, and time.

    The bound counts in the missions in which it is below 100 %, if the study has bounds.
    """
    means = {
        m: means_over_seas(results, metric=m).set_index("policy")["mean"]
        for m in (SUCCESS, PRODUCT)
    }
    columns = {"Success": means[SUCCESS], "Product": means[PRODUCT]}
    for reference in REFERENCES:
        if reference in results.policies:
            share = shares_of_reference(results, reference).set_index("policy")["mean"]
            columns[f"Of {reference}"] = share
    if BOUND in results.missions:
        says = results.missions[results.missions[BOUND] < 1.0].groupby("policy")
        columns["Of the bound"] = says[PRODUCT].sum() / says[BOUND].sum()
    shares = pd.DataFrame(columns).loc[results.policies]
    table = shares.map(numbers.format_percent, na_action="ignore")
    seconds = {
        cost.policy: numbers.format_seconds(cost.batch) for cost in times.costs if cost.batch
    }
    return table.assign(Decision=table.index.map(seconds)).fillna("").reset_index(names="Policy")


def count_seas_in_words(results: Results) -> str:
    """The number of seas of a study and of the missions on each, as ``n = 28 seas, ...``."""
    of_sea = numbers.format_span(results.missions.groupby(["policy", "point"]).size())
    return f"n = {len(_sea_names(results))} seas, missions on each: {of_sea}"


def worst_seas_table(results: Results, policy: str, reference: str, count: int = 8) -> pd.DataFrame:
    """The seas on which a policy is the farthest behind another one, as a table of text."""
    ((_, values),) = _by_sea(results, ALL, PRODUCT)
    differences = values[policy] - values[reference]
    behind = differences[differences < 0].nsmallest(count)
    spaces = dict(zip(_sea_names(results), results.store.manifest.scenarios, strict=True))
    return pd.DataFrame(
        {
            "Sea": sea,
            "Nodes": len(spaces[sea].nodes),
            "UAVs": numbers.format_span(spaces[sea].uavs),
            policy: numbers.format_percent(values.loc[sea, policy]),
            reference: numbers.format_percent(values.loc[sea, reference]),
            "Points": numbers.format_difference(points, 0),
        }
        for sea, points in behind.items()
    ).reindex(columns=["Sea", "Nodes", "UAVs", policy, reference, "Points"])


def unseen_seas_sentence(
    results: Results, times: Times, policy: str, reference: str, baseline: str
) -> str:
    """What a policy reaches on unseen seas, beside a slow reference and a fast baseline."""
    share = shares_of_reference(results, reference).set_index("policy").loc[policy]
    gain = differences_from_baseline(results, baseline).set_index("policy").loc[policy]
    seconds = {cost.policy: cost.batch for cost in times.costs}
    slow = seconds.get(reference)
    fast = seconds.get(policy)
    faster = ""
    if slow and fast:
        faster = f" in 1/{slow / fast:,.0f} of its time"
    reached = numbers.format_interval(*share[_ENDS])
    more = numbers.format_points(*gain[["difference", "low", "high"]])
    return (
        f"On {share['n']} unseen seas, {policy} reaches {reached} of the product of "
        f"{reference}{faster}; its product minus that of {baseline} is {more} points."
    )


def _sea_names(results: Results) -> list[str]:
    return [str(values.get(SEA, "")) for values in results.store.manifest.values]


def _of_groups(
    results: Results, by: str, metric: str, estimate: Callable[[pd.DataFrame], pd.DataFrame]
) -> pd.DataFrame:
    """What is estimated of every group: the group and ``policy``, then the estimates."""
    tables = [
        estimate(values).reset_index(names="policy").assign(**{by: group})
        for group, values in _by_sea(results, by, metric)
    ]
    return pd.concat(tables, ignore_index=True)


def _by_sea(results: Results, by: str, metric: str) -> list[tuple[object, pd.DataFrame]]:
    """For each group: a row per sea and a column per policy, the means over its missions."""
    table = missions_by_sea(results)
    means = table.groupby([by, "policy", "sea"], sort=False)[metric].mean().reset_index()
    groups = [*means[by].unique()]
    if by in ("uavs", "nodes"):  # by the first number
        groups.sort(key=lambda group: int(str(group).partition(" ")[0]))
    return [
        (group, rows.pivot(index="sea", columns="policy", values=metric)[results.policies])
        for group in groups
        for rows in [means[means[by] == group]]
    ]
