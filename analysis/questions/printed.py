"""Estimates compared with the numbers that the paper prints, as tables of text.

A mark tells where the whole interval of an estimate lies relative to the printed number.
"""

from collections.abc import Mapping
from typing import Any

import pandas as pd

from analysis import numbers
from analysis.names import METRICS
from analysis.stats.verdict import MARKS, position

PAPER = "paper"


def with_mark(estimate: Any, printed: float) -> str:
    """An estimate (``mean``, ``low``, ``high``) with its mark: ``97.3 % [96.1, 98.1] ▲``."""
    return f"{_text(estimate)} {MARKS[position(estimate, printed)]}"


def beside(estimates: pd.DataFrame, printed: Mapping[str, float]) -> pd.DataFrame:
    """The metrics of every policy, and their differences from the printed numbers.

    Args:
        estimates: Rows of ``analysis.summary`` by ``policy``.
        printed: The printed numbers by metric.

    Returns:
        A row of the printed numbers and a row per policy, with two columns of text per metric: the
        mean with its interval, and the difference in percentage points with its mark.
    """
    columns = {("", "Policy"): [PAPER, *estimates["policy"].unique()]}
    for metric, figure in printed.items():
        rows = [*estimates[estimates["metric"] == metric].itertuples()]
        gaps = [numbers.difference(row.mean, figure) for row in rows]
        marks = [MARKS[position(row, figure)] for row in rows]
        name = METRICS[metric]
        columns[name, "mean"] = [numbers.percent(figure), *map(_text, rows)]
        columns[name, "to paper"] = ["", *map(" ".join, zip(gaps, marks, strict=True))]
    return pd.DataFrame(columns)


def beside_by_fleet(
    estimates: pd.DataFrame, printed: Mapping[int, Mapping[str, float]]
) -> pd.DataFrame:
    """The metrics of every policy by number of UAVs, with marks relative to the printed numbers.

    Args:
        estimates: Rows of ``analysis.summary`` by ``policy`` and ``uavs``.
        printed: The printed numbers by number of UAVs, then by metric.

    Returns:
        A row of the printed numbers and a row per policy, with a column of text per metric and
        number of UAVs.
    """
    columns = {("", "Policy"): [PAPER, *estimates["policy"].unique()]}
    for metric in next(iter(printed.values())):
        for uavs, figures in printed.items():
            figure = figures[metric]
            rows = estimates[(estimates["metric"] == metric) & (estimates["uavs"] == uavs)]
            texts = [with_mark(row, figure) for row in rows.itertuples()]
            columns[METRICS[metric], f"I = {uavs}"] = [numbers.percent(figure), *texts]
    return pd.DataFrame(columns)


def _text(estimate: Any) -> str:
    return numbers.interval(estimate.mean, estimate.low, estimate.high)
