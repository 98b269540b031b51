"""Tables of text with their captions, as a page, the terminal, CSV and LaTeX show them."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.metrics import METRICS, PRODUCT, metric_group, metric_of
from dess.analysis.names import field_named, value_text
from dess.analysis.stats.kinds import LEVEL
from dess.analysis.stats.verdict import MARKS, judge_by_tests

INTERVALS = f"{numbers.format_level(LEVEL)} intervals"
MARKED = (
    "▲ better, ▼ worse, △ and ▽ the same in what was seen, where a rare failure is not ruled out, "
    "≈ inconclusive"
)
BARS = (
    f"dark bars are {INTERVALS} of what was seen (Student's t), and their pale ends allow for rare "
    "failures."
)
CHECKED = f"The check of the selected settings: means with {INTERVALS}"
MOST_ROWS = 25  # the largest number of rows of a table; its data have all rows
WIDER = 1.5  # times as wide as without the allowance for failures: what is explained in words
_HEADS = {"policy": "Policy", "n": "Missions", **METRICS}
_HEADS |= {column: metric.name for column, metric in metric_group("home").items()}


class Table(NamedTuple):
    """A table: what is read of it, and the numbers behind it.

    Attributes:
        cells: Its cells as text, with its heads.
        caption: The text above it.
        data: The complete numbers, of which the cells may show the first.
    """

    cells: pd.DataFrame
    caption: str
    data: pd.DataFrame


def format_counts(numbers_of: pd.Series) -> pd.Series:
    """Whole numbers as text, as ``1,200``."""
    return numbers_of.map("{:,}".format)


def estimate_cells(
    rows: pd.DataFrame,
    index: Sequence[str],
    columns: str = "metric",
    write: Callable[[float, float, float], str] = numbers.format_interval,
) -> pd.DataFrame:
    """Rows with ``mean``, ``low`` and ``high``: a cell per estimate, empty where there is none.

    What was measured in no mission has a mean of nan, and makes no row of its own.

    Args:
        rows: The rows.
        index: The columns that name a row.
        columns: The column whose values name the columns.
        write: Writes a mean and the ends of its interval.
    """

    order = rows[columns].unique()
    estimated = rows[rows["mean"].notna()]
    table = numbers.estimates_as_text(estimated, [*index], columns, write)
    table = table[[name for name in order if name in table]].fillna("").reset_index()
    for name in index:
        if name == "n":
            table[name] = format_counts(table[name])
        else:
            table[name] = table[name].map(field_named(name).cell)
    heads = {field: field_named(field).name for field in index} | _HEADS
    return table.rename(columns=lambda name: heads.get(name) or value_text(name))


def means_table(
    rows: pd.DataFrame,
    caption: str = f"Means with {INTERVALS}",
    metrics: Sequence[str] = tuple(METRICS),
) -> Table:
    """Rows of ``dess.analysis.summary`` by policy: a column per metric, as those of the paper."""
    index = ["policy", "n"]
    shares = [metric for metric in metrics if metric_of(metric).in_percent]
    cells = estimate_cells(rows[rows["metric"].isin(shares)], index)
    for measure in map(metric_of, dict.fromkeys(metrics)):
        if not measure.in_percent:
            of_metric = rows[rows["metric"] == measure.column]
            texts = numbers.estimates_as_text(of_metric, index, write=measure.written)
            cells[measure.label] = texts[measure.column].to_numpy()
    return Table(cells, caption, rows)


def comparison_cells(rows: pd.DataFrame, of: str) -> pd.DataFrame:
    """Rows of ``dess.analysis.compare``: all differences, and the p-value of the product.

    The mark of a difference is the verdict of ``judge_by_tests``.

    Args:
        rows: The rows. Those of ``dess.analysis.compare_learners`` have the prediction interval of
            the product of one new training as well; a single training has none.
        of: The column that tells what is compared.
    """
    sides = judge_by_tests(rows)
    ends = rows[["difference", "low", "high"]].to_numpy()
    texts = [f"{numbers.format_points(*e)} {MARKS[s]}" for e, s in zip(ends, sides, strict=True)]
    heads = rows["metric"].map(METRICS)
    cells = rows.assign(text=texts, head=heads).pivot(index=of, columns="head", values="text")
    product = rows[rows["metric"] == PRODUCT].set_index(of)
    shown = cells.loc[product.index, heads.unique()].rename_axis(columns=None)
    if "trainings" in rows:
        new = product[["difference", "new_low", "new_high"]].to_numpy()
        texts = [numbers.format_points(*e).partition(" ")[2] for e in new]
        shown["One new training"] = np.where(product["trainings"] > 1, texts, "unknown")
        shown["Trainings"] = product["trainings"]
    shown["p of the product, corrected"] = product["p_adjusted"].map(numbers.format_p_value)
    return shown.reset_index(names=of.capitalize())


def most_widened(rows: pd.DataFrame) -> pd.Series | None:
    """The difference whose interval the allowance for failures makes wider by most.

    Args:
        rows: Rows of ``dess.analysis.compare``.

    Returns:
        Its row with ``half``, half the length of its interval; None if none becomes much wider.
    """
    halves = (rows["high"] - rows["low"]) / 2
    wider = rows.assign(half=halves)[halves > WIDER * rows["student"]]
    if wider.empty:
        return None
    return wider.loc[(wider["half"] / wider["student"].clip(lower=1e-12)).idxmax()]


def allowance_sentence(what: str, plain: str, wide: str, n: int) -> str:
    """That intervals allow for failures that the missions do not show, with an example.

    If none of n missions fails, a share of failures of 3 / n is just not ruled out at 95 %.

    Args:
        what: What is estimated.
        plain: Half the length of its interval without the allowance.
        wide: Half the length of its interval.
        n: Number of missions.
    """
    few = numbers.format_count(max(round(n / 3), 1), "mission")
    return (
        f"The intervals allow for failures that are too rare to be seen: {n:,} missions without a "
        f"failure do not rule out one in {few}. With this allowance, {what} is known to {wide}; "
        f"without it (Student's t), to {plain}."
    )


def stack_by_policy(tables: Mapping[Any, pd.DataFrame]) -> pd.DataFrame:
    """The rows of all policies, with the column ``policy``."""
    return pd.concat(tables, names=["policy"]).reset_index("policy").reset_index(drop=True)
