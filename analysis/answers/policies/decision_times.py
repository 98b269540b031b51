"""How long policies take to decide: a benchmark, kept in the results folder of a study."""

import platform
from collections.abc import Callable, Mapping
from pathlib import Path
from time import perf_counter

import numpy as np
import pandas as pd
from matplotlib.figure import Figure
from matplotlib.ticker import NullLocator
from threadpoolctl import threadpool_limits

from dess import InputError, simulate, simulate_batch
from dess.analysis import numbers
from dess.analysis.answers.policies.pairs import Pair
from dess.analysis.figures import style
from dess.analysis.figures.style import plot_front
from dess.analysis.metrics import METRICS, PRODUCT
from dess.analysis.results.tables import Results
from dess.analysis.stats.front import on_front
from dess.analysis.study.stopping import Text
from dess.base.files.documents import Document
from dess.base.files.reading import read_text
from dess.model.view import View
from dess.policies.registry import Policy, load_team

CALLS = 60  # calls of every policy that are timed at least: those of about one mission
# In batches: the most design points, and the missions of each that are simulated side by side; one
# of a policy that is too slow for many (``Policy.chunk``).
POINTS, SIDE_BY_SIDE = 20, 16
_DOCUMENT = "times"  # in which they are kept
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


def ensure_decision_times(results: Results, progress: Progress | None = None) -> None:
    """Measure the times and keep them (``Derived``), unless they are there.

    Args:
        results: The results of the study.
        progress: Called after every policy.

    Raises:
        InputError: If the times cannot be written.
    """
    derived = results.store.derived
    if not derived.has(_DOCUMENT):
        derived.keep(_DOCUMENT, measure_decision_times(results, progress=progress))


def read_decision_times(results: Results) -> Times:
    """Read the times that ``ensure_decision_times`` has written.

    Raises:
        InputError: If there are none, or they are damaged.
    """
    return results.store.derived.load(_DOCUMENT, Times, "what is made by: dess report")


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
            # Policies and processes of Python files are not run.
            results.store.manifest.load_processes(())
            team = load_team(policy)
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
        table: Rows of ``decision_time_front``.
    """
    styles = style.policy_colours(table["policy"])
    best = table[table["on_front"]].sort_values("seconds")
    with style.new_panels(4.2) as (figure, ax):
        plot_front(best["seconds"], best["mean"], "Pareto front", ax)
        for _, row in table.iterrows():
            arms = style.error_bar_arms(row)
            ax.errorbar(row["seconds"], row["mean"], yerr=arms, label=row["policy"],
                        linestyle="", **style.dot_style(styles[row["policy"]]))  # fmt: skip
        ax.set(xscale="log", title="Decision time against quality", ylabel=METRICS[PRODUCT])
        ax.set_xlabel("time of a decision for one mission, median")
        ax.set_xlim(table["seconds"].min() / 2, table["seconds"].max() * 2)
        ax.xaxis.set_major_formatter(lambda time, _: numbers.format_seconds(time))
        ax.xaxis.set_minor_locator(NullLocator())
        style.set_axis_unit(ax.yaxis, "%")
        places = table.set_index("policy")[["seconds", "mean"]]
        style.name_lines({name: tuple(place) for name, place in places.iterrows()}, ax)
    return figure
