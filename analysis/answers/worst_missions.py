"""The worst missions of a study, and how to see them."""

from pathlib import Path

import pandas as pd

from dess.analysis import numbers
from dess.analysis.answers.settings.points import points_in_words
from dess.analysis.metrics import PRODUCT, RATIO, metric_group
from dess.analysis.results.tables import Results
from dess.analysis.tables import (
    Table,
)


def worst_missions(
    results: Results,
    policy: str,
    missions: int = 5,
    point: int | None = None,
    folder: str | Path | None = None,
) -> pd.DataFrame:
    """The missions of a policy with the lowest product.

    Args:
        results: The study.
        policy: The policy.
        missions: Number of missions.
        point: The design point; by default all.
        folder: The results folder that the commands name; ``results/NAME`` by default.

    Returns:
        A row per mission, the worst first (among equal ones, the one with the lower collection
        ratio): ``policy``, ``point``, ``replication``, the metrics, and ``command``, which
        simulates the mission again.
    """
    of_policy = results.missions[results.missions["policy"] == policy]
    if point is not None:
        of_policy = of_policy[of_policy["point"] == point]
    table = of_policy.sort_values([PRODUCT, RATIO], kind="stable", ignore_index=True)[:missions]
    table = table[["policy", "point", "replication", *metric_group("paper", "reward")]]
    keys = zip(table["point"], table["replication"], strict=True)
    folder = folder or results.usual_folder
    return table.assign(command=[results.command(policy, *key, folder) for key in keys])


def worst_missions_table(results: Results, rows: pd.DataFrame) -> Table:
    """The worst missions of a policy.

    Args:
        results: The study.
        rows: The result of ``worst_missions``.
    """
    cells = {
        "Replication": rows["replication"],
        "Success": rows["success"].map(numbers.format_truth),
        "Collection ratio": rows["collection_ratio"].map(numbers.format_percent),
        "Reward": rows["reward"].map(numbers.format_quantity),
    }
    policy = rows["policy"].iloc[0]
    points = rows["point"].unique()
    caption = f"The worst missions of {policy}"
    words = points_in_words(results)[points[0]]
    if len(points) == 1 and words:
        caption += f", {words}"
    return Table(pd.DataFrame(cells), caption, rows)
