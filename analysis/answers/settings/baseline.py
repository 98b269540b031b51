"""Every design point of a study compared with one of them, on common replications."""

from collections.abc import Iterable

import numpy as np
import pandas as pd

from dess import InputError
from dess.analysis import numbers
from dess.analysis.answers.settings.points import (
    metrics_of_page,
    named_cells,
    points_in_words,
    values_of_points,
)
from dess.analysis.measured import check_metric
from dess.analysis.metric_ranges import metric_in_groups
from dess.analysis.metrics import METRICS, metric_of
from dess.analysis.results.tables import Results
from dess.analysis.stats.corrections import add_adjusted
from dess.analysis.stats.differences import column_tests
from dess.analysis.stats.kinds import level_after
from dess.analysis.stats.weights import by_replication
from dess.analysis.tables import (
    INTERVALS,
    MOST_ROWS,
    Table,
    format_counts,
)


def check_baseline(results: Results, point: int) -> None:
    """Refuse a baseline that is no design point of a study.

    Raises:
        InputError: If it is none.
    """
    points = len(results.store.manifest.points)
    if point not in range(points):
        raise InputError("baseline", f"{point!r} is not a design point", f"0..{points - 1}")


def baseline_in_words(results: Results, point: int) -> str:
    """The design point with which all others are compared, in words.

    Raises:
        InputError: If there is no such design point.
    """
    check_baseline(results, point)
    return points_in_words(results)[point]


def compare_with_baseline(
    results: Results, point: int = 0, metrics: Iterable[str] = METRICS
) -> pd.DataFrame:
    """Every design point compared with a baseline point, with the same policy and replications.

    Args:
        results: The study.
        point: The number of the baseline point.
        metrics: The metrics.

    Returns:
        A row per metric, policy and other design point: ``metric``, ``policy``, ``point``, the
        varied fields, ``difference`` (positive if more than at the baseline) with ``low`` and
        ``high`` (95 % each), ``p``, ``p_adjusted`` (Holm, over the rows of the metric) and ``n``
        pairs. Intervals and p-values allow for a search. A point without a replication of the
        baseline has no row.

    Raises:
        InputError: If there is no such point or metric.
    """
    check_baseline(results, point)
    tables = []
    for metric in metrics:
        check_metric(metric, results.missions)
        parts = []
        for policy, missions in results.missions.groupby("policy", sort=False):
            wide = by_replication(missions, metric, "point")
            measure = metric_in_groups(missions, metric, ["point"], wide.columns.to_frame())
            others = wide.drop(columns=point)
            analyses = results.analyses(str(policy))
            # The pairs end with the missions of the one that has fewer.
            seen = np.minimum(analyses[others.columns.to_numpy()], analyses[point])
            is_other = wide.columns != point
            ranges = (
                measure.at(is_other),
                level_after(seen),
                measure.at(wide.columns.get_loc(point)),
            )
            tests = column_tests(others, wide[point], *ranges)
            tests["p"] = (tests["p"] * np.maximum(seen * (seen + 1), 1)).clip(upper=1)
            tests = tests[tests["n"] > 0].join(values_of_points(results)).reset_index()
            parts.append(tests.assign(metric=metric, policy=policy))
        tables.append(add_adjusted(pd.concat(parts, ignore_index=True), "holm"))
    measured = ["difference", "low", "high", "p", "p_adjusted", "n"]
    columns = ["metric", "policy", "point", *values_of_points(results), *measured]
    return pd.concat(tables, ignore_index=True)[columns]


def baseline_table(results: Results, point: int, metric: str) -> Table:
    """Every design point compared with a baseline point."""
    data = compare_with_baseline(results, point, metrics_of_page(results, metric))
    measure = metric_of(metric)
    rows = data[data["metric"] == metric]
    order = rows["difference"].abs().sort_values(ascending=False, kind="stable").index
    top = rows.loc[order[:MOST_ROWS]].sort_values("difference", ascending=False, kind="stable")
    cells = named_cells(results, top)
    cells["Difference"] = [
        measure.change(*row) for row in top[["difference", "low", "high"]].to_numpy()
    ]
    cells["p (Holm)"] = top["p_adjusted"].map(numbers.format_p_value)
    cells["Pairs"] = format_counts(top["n"])
    unit = " in percentage points" if measure.in_percent else ""
    caption = (
        f"{measure.name}: paired difference from the baseline{unit} with {INTERVALS}; "
        f"the {len(top):,} largest of {len(rows):,} differences"
    )
    return Table(cells, caption, data)
