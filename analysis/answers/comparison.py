"""Two policies in the same missions: wins, regions of the parameters, times of a decision."""

import platform
from collections.abc import Callable, Iterable, Mapping
from itertools import product
from pathlib import Path
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np
import pandas as pd
import scipy
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from threadpoolctl import threadpool_limits

from dess import InputError, simulate, simulate_batch
from dess.analysis import numbers
from dess.analysis.answers.missions import FOLDER
from dess.analysis.answers.summary import (
    correct_for_all_tests,
    rank_learned_and_others,
    rank_policies,
)
from dess.analysis.figures import Drawing, style
from dess.analysis.figures.comparison import central_range
from dess.analysis.figures.style import plot_front
from dess.analysis.metrics import METRICS, PRODUCT, RATIO, SUCCESS
from dess.analysis.names import PARAMETERS, field_named, value_text
from dess.analysis.results.learners import trained_policies_by_learner
from dess.analysis.results.tables import Results
from dess.analysis.stats.differences import add_adjusted, compare, compare_pairs, for_choice
from dess.analysis.stats.front import on_front
from dess.analysis.stats.intervals import LEVEL, by_replication, share_interval, values_within
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
from dess.analysis.study.stopping import Text
from dess.base.errors import unknown_name
from dess.base.files.documents import Document
from dess.base.files.reading import read_text
from dess.base.files.writing import check_target, write_file
from dess.model.view import View
from dess.policies.registry import Policy, load_team

OF_BASELINE = "_baseline"  # suffix of the names of the baseline's metrics

_ROUNDING = 1e-12  # the largest difference between equal results


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
    caption = (
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
        ``summary.correct_for_all_tests``.
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


BINS = 5  # largest number of bins of a parameter
LEAST = 10  # missions of a bin that is shown
EDGE = 0.005  # share of the missions that is beyond each end of the distribution's axis
COLOURS = {
    BETTER: style.BETTER,
    SEEN_BETTER: style.BETTER,
    WORSE: style.WORSE,
    SEEN_WORSE: style.WORSE,
    INCONCLUSIVE: style.MUTED,
}


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
            f"{note}n = {numbers.format_span(rows['n'])} missions per dot.",
        )
        for field, rows in lead.groupby("field", sort=False)
    ]


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


CALLS = 60  # calls of every policy that are timed at least: those of about one mission
# In batches: the most design points, and the missions of each that are simulated side by side; one
# of a policy that is too slow for many (``Policy.chunk``).
POINTS, SIDE_BY_SIDE = 20, 16
SLOW = 0.95  # the quantile that is reported for slow calls

Clock = Callable[[], float]
# Called with the number of policies done and of all policies.
Progress = Callable[[int, int], None]


class Cost(Document):
    """The time of a call of ``Policy.act``, which decides for all UAVs of a mission that must act.

    Attributes:
        policy: The team.
        calls: The number of calls.
        median: Their median time [s].
        slow: The ``SLOW`` quantile of their times [s].
        batch: The mean time of the decision for one UAV, where many missions are simulated side by
            side [s]; None where only the SimPy engine can simulate them.
    """

    policy: Text
    calls: int
    median: float
    slow: float
    batch: float | None = None


class Times(Document):
    """The measured times of a study's policies, and the processor on which they were measured."""

    processor: Text
    costs: list[Cost]


def ensure_decision_times(
    folder: str | Path, results: Results, progress: Progress | None = None
) -> None:
    """Measure the times and write them, unless the folder has those of this study.

    Args:
        folder: A folder that contains a results folder per study.
        results: The results of the study.
        progress: Called after every policy.

    Raises:
        InputError: If the times cannot be written.
    """
    path = _decision_times_file(folder, results)
    if not path.exists():
        check_target(path)
        write_file(
            path, measure_decision_times(results, progress=progress).model_dump_json(indent=1)
        )


def read_decision_times(folder: str | Path, results: Results) -> Times:
    """Read the times that ``ensure_decision_times`` has written.

    Raises:
        InputError: If there are none, or they are damaged.
    """
    return Times.load(_decision_times_file(folder, results), "what is made by: dess report")


def _decision_times_file(folder: str | Path, results: Results) -> Path:
    return Path(folder, FOLDER, f"times-{results.store.manifest.key}.json")


def measure_decision_times(
    results: Results, clock: Clock = perf_counter, progress: Progress | None = None
) -> Times:
    """Measure the times of a study's policies: one mission at a time, on one thread.

    Policies that cannot be loaded here are left out, and so are classes of Python files, since
    anybody may have made the results.

    Args:
        results: The results of the study.
        clock: Returns the time [s].
        progress: Called after every policy.
    """
    costs = []
    for done, policy in enumerate(results.policies, 1):
        try:
            team = load_team(policy)  # a policy of a Python file is not run
        except InputError:
            team = []
        if team:
            seconds = _time_calls(team, results, clock)
            median, slow = np.quantile(seconds, [0.5, SLOW]).tolist()
            batch = _in_batches(team, results, clock)
            costs.append(
                Cost(policy=policy, calls=len(seconds), median=median, slow=slow, batch=batch)
            )
        if progress:
            progress(done, len(results.policies))
    return Times(processor=_processor_model(), costs=costs)


def _time_calls(team: list[Policy], results: Results, clock: Clock) -> list[float]:
    """The times of the calls of a team [s], in as many whole missions as ``CALLS`` calls take."""
    calls: list[float] = []
    timed = [_Timed(policy, clock, calls) for policy in team]
    space = results.scenario()
    seed = results.store.manifest.seed
    replication = 0
    with threadpool_limits(1):
        while len(calls) < CALLS:
            simulate(space, timed, seed, replication)
            replication += 1
    return calls


def _in_batches(team: list[Policy], results: Results, clock: Clock) -> float | None:
    """The mean time of a decision [s], over design points that are spread over the design."""
    scenarios, seed = results.store.manifest.scenarios, results.store.manifest.seed
    if any(space.needs_events for space in scenarios):
        return None
    calls: list[float] = []
    timed = [_Timed(policy, clock, calls) for policy in team]
    missions = 1
    if not any(hasattr(policy, "chunk") for policy in team):
        missions = SIDE_BY_SIDE
    with threadpool_limits(1):
        for space in scenarios[:: -(-len(scenarios) // POINTS)]:
            simulate_batch(space, timed, seed, range(missions))
    return sum(calls) / max(sum(policy.decisions for policy in timed), 1)


class _Timed:
    """A policy whose calls are timed; the first one is made twice, since it compiles and loads."""

    def __init__(self, policy: Policy, clock: Clock, calls: list[float]):
        self.name = policy.name
        self.policy = policy
        self.clock = clock
        self.calls = calls
        self.decisions = 0

    def act(self, view: View) -> np.ndarray:
        """Return the actions of the policy, and note the time."""
        if not self.calls:
            self.policy.act(view)
        begin = self.clock()
        actions = self.policy.act(view)
        self.calls.append(self.clock() - begin)
        self.decisions += len(view)
        return actions


def _processor_model() -> str:
    """The model of the processor, as the operating system names it."""
    try:
        lines = read_text(Path("/proc/cpuinfo")).splitlines()
    except (OSError, InputError):
        lines = []
    models = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return next(filter(None, [*models, platform.processor(), platform.machine()]), "unknown")


def decision_time_front(means: pd.DataFrame, seconds: Mapping[str, float | None]) -> pd.DataFrame:
    """The policies that were timed, the fastest first, with their times and the Pareto front.

    Args:
        means: A row per policy, with the ``mean`` of what it reaches.
        seconds: The time of a decision of policies [s].

    Returns:
        The rows of these policies, with ``seconds`` and ``on_front``: whether no other policy is at
        least as fast and as good, and better in one of the two.
    """
    table = means.assign(seconds=means["policy"].map(seconds)).dropna()
    table = table.sort_values("seconds", ignore_index=True)
    return table.assign(on_front=on_front(table["seconds"].to_numpy(), table["mean"].to_numpy()))


def time_table(times: Times) -> pd.DataFrame:
    """The times as a table to print, with a row per policy."""
    return pd.DataFrame(
        {
            "Policy": cost.policy,
            "Median": numbers.format_seconds(cost.median),
            "95 % below": numbers.format_seconds(cost.slow),
            "Calls": f"{cost.calls:,}",
            "In batches, per UAV": numbers.format_seconds(cost.batch) if cost.batch else "",
        }
        for cost in times.costs
    )


def decision_time_sentences(times: Times, results: Results, pair: Pair) -> str:
    """On what decisions were timed, how a pair of policies compares, and what was not timed."""
    medians = {cost.policy: cost.median for cost in times.costs}
    text = f"Measured once, on one core of a processor {times.processor}."
    if {pair.policy, pair.baseline} <= medians.keys():
        ratio = medians[pair.policy] / medians[pair.baseline]
        text += f" {pair.policy} takes {ratio:,.3g} times as long as {pair.baseline}."
    missing = [policy for policy in results.policies if policy not in medians]
    if missing:
        text += f" Not timed: {numbers.join_words(missing)}."
    return text


def plot_decision_times(table: pd.DataFrame) -> Figure:
    """Decision time against the product of all policies, and their Pareto front.

    Args:
        table: Rows of ``answers.comparison.decision_time_front``.
    """
    looks = style.policy_colours(table["policy"])
    best = table[table["on_front"]].sort_values("seconds")
    with style.new_panels(4.2) as (figure, ax):
        plot_front(best["seconds"], best["mean"], "Pareto front", ax)
        for _, row in table.iterrows():
            arms = style.error_bar_arms(row)
            ax.errorbar(row["seconds"], row["mean"], yerr=arms, label=row["policy"],
                        linestyle="", **style.dot_style(looks[row["policy"]]))  # fmt: skip
        ax.set(xscale="log", title="Decision time against quality", ylabel=METRICS[PRODUCT])
        ax.set_xlabel("time of a decision for one mission, median")
        ax.set_xlim(table["seconds"].min() / 2, table["seconds"].max() * 2)
        ax.xaxis.set_major_formatter(lambda time, _: numbers.format_seconds(time))
        ax.xaxis.set_minor_locator(NullLocator())
        style.set_axis_unit(ax.yaxis, "%")
    return figure
