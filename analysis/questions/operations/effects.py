"""Means at every design point, and their changes from a reference value of a field."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from math import isnan
from typing import Any

import pandas as pd

from analysis import numbers
from analysis.names import parameter, value_text
from analysis.questions import settings
from analysis.results.tables import Results
from analysis.stats.differences import column_tests
from analysis.stats.paired import relative_change
from dess.errors import InputError


def means(results: Results, metrics: Iterable[str]) -> pd.DataFrame:
    """The means of metrics at every design point.

    Returns:
        A row per metric, policy and design point: ``metric``, ``policy``, the varied fields,
        ``mean``, ``low``, ``high`` (95 %) and ``n``.

    Raises:
        InputError: If there is no such metric.
    """
    fields = [*settings.varied(results)]
    tables = [settings.averaged(results, fields, m).assign(metric=m) for m in metrics]
    return pd.concat(tables, ignore_index=True)[
        ["metric", "policy", *fields, "mean", "low", "high", "n"]
    ]


def changes(
    results: Results, field: str, reference: Any, metric: str, relative: bool = False
) -> pd.DataFrame:
    """How a metric changes with a field, from a reference value and in the same replications.

    Args:
        results: The study.
        field: The field.
        reference: The value with which all others are compared.
        metric: The metric.
        relative: Whether changes are shares of the mean at the reference value.

    Returns:
        A row per policy and design point with another value: ``policy``, the varied fields,
        ``mean`` (the change) with ``low`` and ``high`` (95 %), and ``n`` pairs. A point without a
        partner, the same but for the field, has no row.

    Raises:
        InputError: If there is no such metric, or the field never has the reference value.
    """
    settings.check_metric(results, metric)
    table = settings.points(results)
    if field not in table or reference not in table[field].to_numpy():
        raise InputError(
            f"{field}: is never {reference!r} in the study; allowed: one of its values"
        )
    rows = []
    for policy in results.policies:
        missions = results.missions[results.missions["policy"] == policy]
        wide = missions.pivot(index="replication", columns="point", values=metric).astype(float)
        for point, partner in _pairs(table, field, reference):
            both = wide[[point, partner]].dropna()
            if both.empty:
                continue
            if relative:
                change = relative_change(both[point].to_numpy(), both[partner].to_numpy())
            else:
                tests = column_tests(both[[point]], both[partner], metric)
                change = tests[["difference", "low", "high"]].iloc[0]
            fields = (column[point] for _, column in table.items())
            rows.append((policy, *fields, *change, len(both)))
    return pd.DataFrame(rows, columns=["policy", *table, "mean", "low", "high", "n"])


def listed(
    rows: pd.DataFrame,
    metric: str | None,
    index: Sequence[str],
    columns: str,
    write: Callable[[float, float, float], str] | None = None,
) -> pd.DataFrame:
    """Estimates as a table of text; nothing stands where there is no estimate.

    Args:
        rows: Rows of ``means`` or ``changes``.
        metric: The metric to show; None if the rows are about one.
        index: The columns that name a row.
        columns: The column whose values name the columns.
        write: Writes a mean and the ends of its interval; by default as suits the metric.
    """
    if metric is not None:
        rows = rows[rows["metric"] == metric]
    write = write or numbers.written(metric or "")

    def cell(mean: float, low: float, high: float) -> str:
        return "" if isnan(mean) else write(mean, low, high)

    table = numbers.wide(rows, [*index], columns, cell).fillna("").reset_index()
    table[[*index]] = table[[*index]].map(value_text)
    heads = {field: parameter(field).name for field in index} | {"policy": "Policy"}
    values = {value: value_text(value) for value in table.columns[len(index) :]}
    return table.rename(columns=heads | values)


def _pairs(table: pd.DataFrame, field: str, reference: Any) -> Iterator[tuple[int, int]]:
    """Every design point, and the one that differs from it only by the reference value."""
    others = [name for name in table if name != field]
    for _, part in table.groupby(others, sort=False) if others else [((), table)]:
        partner = part.index[part[field] == reference]
        for point in part.index:
            if len(partner) and point != partner[0]:
                yield int(point), int(partner[0])
