"""The queue for charging pads over time, from the event logs of a study."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from analysis.questions import settings
from analysis.results.event_log import duration
from analysis.results.tables import Results

BAND = (0.1, 0.9)  # the quantiles between which most missions are


# The events at which a UAV no longer waits.
_ENDS = (
    *("charge_start", "charge_withdrawal", "uav_failure", "quota_filled", "battery_empty"),
    "mission_end",
)


def waiting(events: pd.DataFrame) -> np.ndarray:
    """The number of UAVs that wait for a pad in every mission slot, (slots,)."""
    log = events[(events["uav"] >= 0) & events["event"].isin(("charge_request", *_ENDS))]
    steps, since = np.zeros(duration(events) + 1, int), dict[int, int]()
    for time, event, uav in zip(log["time"].astype(int), log["event"], log["uav"], strict=True):
        if event == "charge_request":
            since[uav] = time
        elif uav in since:
            steps[since.pop(uav)] += 1
            steps[time] -= 1
    return steps.cumsum()[:-1]


def over_time(results: Results, policy: str, points: Iterable[int]) -> pd.DataFrame:
    """The queue in every mission slot, over the missions whose event logs are kept.

    A mission that is over has no queue. The last slot is that of the longest mission.

    Args:
        results: The study.
        policy: The policy.
        points: Numbers of design points.

    Returns:
        A row per design point and slot: ``point``, the varied fields, ``slot``, the ``mean`` number
        of UAVs that wait, ``low`` and ``high`` (the quantiles ``BAND`` over missions), and ``n``
        missions.

    Raises:
        InputError: If no event log is kept.
    """
    table, tables = settings.points(results), []
    logged = results.manifest["study"]["logged"]
    for point in points:
        first = results.cell(policy, point).first
        numbers = range(first, first + max(logged, 1))
        queues = [waiting(results.events(policy, point, number)) for number in numbers]
        longest = max(map(len, queues))
        counts = np.array([np.pad(queue, (0, longest - len(queue))) for queue in queues])
        low, high = np.quantile(counts, BAND, axis=0)
        rows = {"slot": np.arange(longest), "mean": counts.mean(axis=0), "low": low, "high": high}
        fields = {str(name): column[point] for name, column in table.items()}
        tables.append(pd.DataFrame({"point": point, **fields, **rows, "n": len(queues)}))
    return pd.concat(tables, ignore_index=True)
