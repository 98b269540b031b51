"""The time that a study's policies take to decide, as tables and sentences to print.

The times were measured by ``execution.decision_time``; a page reads them and measures nothing.
"""

from collections.abc import Sequence

import pandas as pd

from analysis import numbers
from analysis.execution.decision_time import ROUNDS, Cost, Timing, unlike
from analysis.questions.head_to_head import Pair
from analysis.results.tables import Results

_SHORT = 12  # characters of a hash that are shown


def timed(times: Timing, policies: Sequence[str]) -> list[Cost]:
    """The times of the given policies, in their order; all times if none of them was measured."""
    costs = {cost.policy: cost for cost in times.costs}
    return [costs[policy] for policy in policies if policy in costs] or times.costs


def listed(times: Timing, costs: Sequence[Cost]) -> pd.DataFrame:
    """The measured times as a table to print, with a row per policy.

    The last column is the speed of a UAV that crosses one cell in the time of a slow call.
    """
    one, many, fast = "One mission, a call", "Many missions", "Fast enough up to"
    cell_size = times.space.cell_size
    return numbers.headed(
        {
            ("", "Policy"): cost.policy,
            (one, "median"): numbers.seconds(cost.median),
            (one, "95 % below"): numbers.seconds(cost.slow),
            (one, "UAVs"): f"{cost.rows / cost.calls:.2f}",
            (one, "calls"): f"{cost.calls:,}",
            (many, "per UAV"): numbers.seconds(cost.batch),
            (many, "UAVs"): f"{cost.batch_rows:,}",
            (fast, "m/s"): f"{float(f'{cell_size / cost.slow:.2g}'):,.0f}",
        }
        for cost in costs
    )


def remarks(times: Timing, results: Results, pair: Pair) -> str:
    """On what decisions were timed, which were not, and how the policies of a pair compare."""
    costs = {cost.policy: cost for cost in times.costs}
    missing = [policy for policy in results.policies if policy not in costs]
    changed = unlike(times, results.store.manifest)
    sentences = [
        f"{times.missions:,} missions of the scenario {times.scenario}, with cells of "
        f"{times.space.cell_size:g} m, were timed on a processor {times.processor} (number of "
        f"threads: {times.threads}); of {ROUNDS} rounds of the batch engine, the median counts."
    ]
    if pair.policy in costs and pair.baseline in costs:
        ratio = costs[pair.policy].median / costs[pair.baseline].median
        sentences.append(
            f"{pair.policy} takes {ratio:,.3g} times as long as {pair.baseline} for one mission, "
            "by the medians."
        )
    if missing:
        sentences.append(f"Not timed: {numbers.words(missing)}.")
    if changed:
        text = "Timed with other code or weights than those of the study"
        sentences.append(f"{text}: {numbers.words(changed)}.")
    return " ".join(sentences)


def origin(times: Timing) -> pd.DataFrame:
    """What the times were measured with, as a table to print."""
    rows = {
        "Scenario": times.scenario,
        "Missions": f"{times.missions:,}",
        "Seed": times.seed,
        "Processor": times.processor,
        "Cores": f"{times.cores:,}",
        "Threads": times.threads,
        "dess": times.version,
        "Code": times.code[:_SHORT],
        "Commit": (times.commit or "unknown")[:_SHORT],
        "Libraries": ", ".join(f"{name} {version}" for name, version in times.libraries.items()),
    }
    return pd.DataFrame(rows.items(), columns=["Timing", "of decisions"])
