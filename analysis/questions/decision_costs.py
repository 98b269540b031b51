"""What the decisions of a study's policies cost in time, as tables and remarks to print.

The times were measured by ``execution.decision_time``: a page reads them, and measures nothing.
"""

from collections.abc import Sequence

import pandas as pd

from analysis import numbers
from analysis.execution.decision_time import Cost, Timing, unlike
from analysis.results.tables import Results

_SHORT = 12  # characters of a hash that are shown


def timed(times: Timing, policies: Sequence[str]) -> list[Cost]:
    """The costs of the policies, in their order; those of all that were timed if none of them was."""
    costs = {cost.policy: cost for cost in times.costs}
    return [costs[policy] for policy in policies if policy in costs] or times.costs


def listed(costs: Sequence[Cost]) -> pd.DataFrame:
    """Costs as a table to print, a row per policy."""
    one, many = "One mission, a call", "Many missions"
    lines = [
        {
            ("", "Policy"): cost.policy,
            (one, "median"): numbers.seconds(cost.median),
            (one, "95 % below"): numbers.seconds(cost.slow),
            (one, "UAVs"): f"{cost.rows / cost.calls:.2f}",
            (one, "calls"): f"{cost.calls:,}",
            (many, "per UAV"): numbers.seconds(cost.batch),
            (many, "UAVs"): f"{cost.batch_rows:,}",
        }
        for cost in costs
    ]
    return pd.DataFrame(lines, columns=pd.MultiIndex.from_tuples(lines[0]))


def ratio(times: Timing, policy: str, baseline: str) -> str:
    """How much longer a policy takes than another in one mission, in a sentence if both are timed."""
    medians = {cost.policy: cost.median for cost in times.costs}
    if not {policy, baseline} <= medians.keys():
        return ""
    factor = medians[policy] / medians[baseline]
    return (
        f"{policy} takes {factor:,.3g} times as long as {baseline} for one mission, by the medians."
    )


def caveats(times: Timing, results: Results) -> str:
    """Which policies of a study were not timed, or not with its code and weights, in sentences."""
    names = {cost.policy for cost in times.costs}
    missing = [policy for policy in results.policies if policy not in names]
    changed = unlike(times, results.store.manifest)
    sentences = {
        "Not timed": missing,
        "Timed with other code or weights than those of the study": changed,
    }
    return " ".join(f"{text}: {numbers.words(of)}." for text, of in sentences.items() if of)


def fastest_speed(cost: Cost, cell_size: float) -> float:
    """The speed [m/s] at which a UAV crosses a cell [m] in the time of a slow decision."""
    return float(f"{cell_size / cost.slow:.2g}")


def origin(times: Timing) -> pd.DataFrame:
    """With what the decisions were timed, as a table to print."""
    rows = {
        "Scenario": times.scenario,
        "Missions": f"{times.missions:,}",
        "Seed": times.seed,
        "Processor": f"{times.processor}, {times.cores:,} {'core' if times.cores == 1 else 'cores'}",
        "Threads": times.threads,
        "dess": times.version,
        "Code": times.code[:_SHORT],
        "Commit": (times.commit or "unknown")[:_SHORT],
        "Libraries": ", ".join(f"{name} {version}" for name, version in times.libraries.items()),
    }
    return pd.DataFrame(rows.items(), columns=["Timing", "of decisions"])
