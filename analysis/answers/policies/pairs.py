"""Two policies in the same missions: how they compare, and the missions they differ in."""

from collections.abc import Iterable
from itertools import product
from typing import NamedTuple

import numpy as np
import pandas as pd
from matplotlib.figure import Figure

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.policies.comparisons import correct_for_all_tests
from dess.analysis.answers.policies.ranks import rank_learned_and_others, rank_policies
from dess.analysis.figures import Drawing, style
from dess.analysis.figures.comparison import central_range
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS
from dess.analysis.names import PARAMETERS, field_named
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import compare
from dess.analysis.stats.intervals import share_interval
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import BETTER, INCONCLUSIVE, SEEN_BETTER, SEEN_WORSE, WORSE
from dess.analysis.stats.weights import by_replication
from dess.base.errors import unknown_name

OF_BASELINE = "_baseline"  # suffix of the names of the baseline's metrics
_ROUNDING = 1e-12  # the largest difference between equal results
EDGE = 0.005  # share of the missions that is beyond each end of the distribution's axis
COLOURS = {
    BETTER: style.BETTER,
    SEEN_BETTER: style.BETTER,
    WORSE: style.WORSE,
    SEEN_WORSE: style.WORSE,
    INCONCLUSIVE: style.MUTED,
}


class Pair(NamedTuple):
    """Two policies to compare.

    Attributes:
        policy: The policy that is compared with the other one.
        baseline: The other policy.
        candidates: Number of pairs among which this pair was chosen, by the same data.
    """

    policy: str
    baseline: str
    candidates: int

    @property
    def title(self) -> str:
        """The two policies, as in the title of their difference."""
        return f"{self.policy} − {self.baseline}"


def pair_of(results: Results, learned: str | None = None, heuristic: str | None = None) -> Pair:
    """The best learned policy of a study, and the best of the other policies.

    Policies are ranked by mean product. A learner with several trainings
    is ranked by their mean and represented by its first training, because the best of several
    trainings would give a biased picture of the learner. If all policies are learned, or none is,
    the best two policies are compared.

    Args:
        results: The study.
        learned: The first policy, in place of the best learned one.
        heuristic: The second policy, in place of the best of the others.

    Raises:
        InputError: If the study has fewer than two policies, or lacks a policy that is named.
    """
    for role, asked in (("learned", learned), ("heuristic", heuristic)):
        if asked is not None and asked not in results.policies:
            problem = f"{asked!r} is not in the study"
            raise unknown_name(role, problem, asked, results.policies)
    means = by_replication(results.missions, PRODUCT, ["policy", "point"]).mean()
    means = means.groupby("policy").mean()
    trained = sorted(
        trained_policies_by_learner(results).values(),
        key=lambda trainings: -means[trainings].mean(),
    )
    firsts = [trainings[0] for trainings in trained]
    _, others = rank_learned_and_others(results)
    if not firsts or not others:
        firsts = others = rank_policies(results.missions)
    candidates = product([learned] if learned else firsts, [heuristic] if heuristic else others)
    pairs = [pair for pair in candidates if pair[0] != pair[1]]
    if not pairs:
        raise InputError(
            "learned, heuristic",
            f"no two policies to compare among {', '.join(results.policies)}",
            "two or more, and not one for both",
        )
    return Pair(*pairs[0], len({frozenset(pair) for pair in pairs}))


def pair_sentence(comparison: pd.DataFrame, missions: pd.DataFrame, pair: Pair) -> str:
    """By how much a policy is ahead of the other one on average, and in how many missions.

    Args:
        comparison: The rows of ``compare_pair``.
        missions: The rows of ``pair_missions``.
        pair: The policies.
    """
    row = comparison.set_index("metric").loc[PRODUCT]
    share = numbers.format_percent((missions["difference"] > 0).mean())
    return (
        f"The product of {pair.policy} minus that of {pair.baseline} is "
        f"{numbers.format_points(*row[['difference', 'low', 'high']])} points on average over "
        f"{len(missions):,} missions; {pair.policy} is ahead in {share} of them."
    )


def pair_missions(results: Results, pair: Pair) -> pd.DataFrame:
    """Two policies in the same missions.

    Returns:
        A row per mission: ``replication``, the parameters (``initial_data`` is the mean over the
        nodes), ``METRICS`` of the policy, those of the baseline under names that end in
        ``_baseline``, and ``difference``, by how much the policy is ahead in collection ratio and
        communication.

    Raises:
        InputError: If the study has several design points.
    """
    if (points := len(results.store.manifest.points)) > 1:
        where = f"study {results.study.name}"
        raise InputError(where, f"{points} design points", "one for all missions")
    table = results.missions.assign(
        initial_data=results.missions["initial"] / len(results.scenario().nodes)
    )
    columns = ["replication", *PARAMETERS, *METRICS]
    of_policy = table.loc[table["policy"] == pair.policy, columns]
    of_baseline = table.loc[table["policy"] == pair.baseline, ["replication", *METRICS]]
    both = of_policy.merge(of_baseline, on="replication", suffixes=("", OF_BASELINE))
    difference = both[PRODUCT] - both[PRODUCT + OF_BASELINE]
    return both.assign(difference=difference.where(difference.abs() > _ROUNDING, 0.0))


def draw_difference_distribution(missions: pd.DataFrame, pair: Pair) -> Drawing:
    """The distribution function of the difference: the share of the missions up to each value.

    The 95 % band is for the complete curve (Dvoretzky, Kiefer and Wolfowitz). A share of ``EDGE``
    of the missions is beyond each end of the axis.

    Args:
        missions: Rows of ``pair_missions``.
        pair: The policies.
    """
    values = np.sort(missions["difference"].to_numpy(float))
    lowest, highest = (numbers.format_difference(end, 0) for end in values[[0, -1]])
    ahead = numbers.format_percent((values > 0).mean())
    behind = numbers.format_percent((values < 0).mean())
    caption = (
        f"{pair.policy} is ahead in {ahead} of the missions and behind in {behind}. "
        f"Share of the missions (n = {len(values):,}) with at most the difference on the axis, "
        f"with a 95 % band for the whole curve; from {lowest} to {highest} points."
    )
    title = f"Distribution of the difference {pair.title} of the product over the missions"
    return Drawing(_plot_distribution(values, pair), title, caption)


def _plot_distribution(values: np.ndarray, pair: Pair) -> Figure:
    half = float(np.sqrt(np.log(2 / (1 - LEVEL)) / (2 * len(values))))
    low, high = central_range([pd.Series(values)], EDGE)
    x = np.array([min(values[0], low) - 1, *values, max(values[-1], high) + 1])
    y = np.array([0, *np.arange(1, len(values) + 1) / len(values), 1])
    with style.new_panels(3.9) as (figure, ax):
        for start, end, outcome in ((x[0], 0, WORSE), (0, x[-1], BETTER)):
            ax.axvspan(start, end, color=COLOURS[outcome], alpha=0.11, linewidth=0, zorder=0)
        band = np.clip([y - half, y + half], 0, 1)
        ax.fill_between(x, *band, step="post", **style.band(style.INK), gid="band")
        ax.step(x, y, where="post", color=style.INK, linewidth=1.8, gid="shares")
        shares = {WORSE: (values < 0).mean(), BETTER: (values > 0).mean()}
        for place, (outcome, share) in enumerate(shares.items()):
            ax.annotate(f"{pair.policy} {outcome}: {share:.1%}", (place, 1.03),
                        ha=("left", "right")[place], xycoords="axes fraction",
                        color=COLOURS[outcome], gid=outcome)  # fmt: skip
        ax.set_title("Difference in every mission", pad=22)
        ax.set(xlim=(low, high), ylim=(0, 1), ylabel="share of the missions")
        ax.set_xlabel(f"{pair.title}, at most [points]")
        style.set_axis_unit(ax.xaxis, "points", 7)
        style.set_axis_unit(ax.yaxis, "%")
    return figure


def compare_pair(results: Results, pair: Pair) -> pd.DataFrame:
    """The policy compared with the baseline in every metric, over all missions.

    Returns:
        A row per metric, as ``dess.analysis.compare`` returns it,
        ``comparisons.correct_for_all_tests``.
    """
    missions = results.missions[results.missions["policy"].isin(pair[:2])]
    return correct_for_all_tests(
        results, compare(missions, pair.baseline, [*METRICS], correction=None)
    )


def pairing_sentence(comparison: pd.DataFrame) -> str:
    """How many independent missions would give equally narrow intervals, as a sentence.

    Args:
        comparison: The rows of ``compare_pair``.
    """
    reduction = comparison.set_index("metric").loc[PRODUCT, "variance_reduction"]
    many = "infinitely many"
    if reduction < 1:
        times = f"{1 / (1 - reduction):.1f}"
        if times == "1.0":
            many = "as many"
        else:
            many = f"{times} times as many"
    return f"{many} independent missions would be as precise"


def pair_outcome_table(missions: pd.DataFrame, pair: Pair) -> pd.DataFrame:
    """A table to print: in how many missions each policy is ahead, and fails alone."""
    gap = missions["difference"]
    more = missions[SUCCESS] - missions[SUCCESS + OF_BASELINE]
    cases = {
        f"{pair.policy} ahead": gap > 0,
        "level": gap == 0,
        f"{pair.policy} behind": gap < 0,
        f"only {pair.policy} fails": more < 0,
        f"only {pair.baseline} fails": more > 0,
    }
    counts = pd.DataFrame(cases).sum()
    shares = [numbers.format_interval(*share_interval(count, len(missions))) for count in counts]
    columns = {"Outcome": counts.index, "Missions": counts.map("{:,}".format), "Share": shares}
    return pd.DataFrame(columns).reset_index(drop=True)


def worst_pair_missions(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``pair_missions`` with the policy's lowest product.

    The worst mission is first; among equal ones, the one with the lowest collection ratio.
    """
    return missions.sort_values([PRODUCT, RATIO], kind="stable").head(count)


def missions_to_draw(missions: pd.DataFrame, pair: Pair) -> list[tuple[str, int]]:
    """The missions to draw: the worst two of ``pair_missions``, each with both policies."""
    replications = worst_pair_missions(missions, 2)["replication"]
    return [(policy, int(n)) for n in replications for policy in (pair.policy, pair.baseline)]


def most_lost(missions: pd.DataFrame, count: int) -> pd.DataFrame:
    """The missions of ``pair_missions`` in which the policy is furthest behind, if it is behind."""
    lost = missions[missions["difference"] < 0]
    return lost.sort_values("difference", kind="stable").head(count)


def count_depleted_uavs(results: Results, policy: str, replications: Iterable[int]) -> int:
    """The number of UAVs of a policy whose battery is depleted in the air."""
    return int(_count_mission_ends(results, policy, replications)["battery"].sum())


def mission_commands(results: Results, policy: str, replications: Iterable[int]) -> list[str]:
    """The commands that simulate missions again, from the usual results folder, and draw them."""
    folder = results.usual_folder
    return [
        f"{results.command(policy, 0, number, folder)} --figure mission-{number}.png"
        for number in replications
    ]


def outcome_table(missions: pd.DataFrame, results: Results, pair: Pair) -> pd.DataFrame:
    """Missions of ``pair_missions`` as a table to print: parameters, and how both policies fared.

    The column that tells how many UAVs ended well has what they had to do as its head: to fill
    their quota, or to land.
    """
    done = results.scenario().aim.capitalize()
    table = missions.reset_index(drop=True)
    columns = {("", "Mission"): table["replication"].astype(str)}
    for field in PARAMETERS:
        columns["", field_named(field).short] = table[field].map("{:.3g}".format)
    columns["", "Points"] = table["difference"].map(lambda gap: numbers.format_difference(gap, 0))
    for policy, end in ((pair.policy, ""), (pair.baseline, OF_BASELINE)):
        ends = _count_mission_ends(results, policy, table["replication"])
        ended_well = [f"{count} of {n}" for count, n in ends[["quota", "all"]].to_numpy()]
        columns[policy, "Success"] = table[SUCCESS + end].map(numbers.format_truth)
        columns[policy, done] = pd.Series(ended_well, dtype=object)
        columns[policy, "Collected"] = table[RATIO + end].map(numbers.format_percent)
    return pd.DataFrame(columns)


def _count_mission_ends(results: Results, policy: str, replications: Iterable[int]) -> pd.DataFrame:
    """How the UAVs of missions end: a row per mission, and a column of counts per kind of end."""
    uavs = results.uavs[results.uavs["policy"] == policy]
    end = uavs["end"].replace("landed", "quota")  # who has landed has filled the quota
    ends = pd.crosstab(uavs["replication"], end, margins=True, margins_name="all")
    return ends.reindex([*replications], columns=["quota", "battery", "all"], fill_value=0)
