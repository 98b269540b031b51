"""What both the page of a study and the terminal show of it, as tables of text.

Every function turns rows of ``analysis.answers`` into text, with the same columns and words for
both; ``reports.pages.html.table`` and ``reports.cli.tables.print_frame`` write them.
"""

from collections.abc import Callable, Sequence

import numpy as np
import pandas as pd

from analysis import numbers
from analysis.names import COST, METRICS, PRODUCT, metric_name, parameter, value_text
from analysis.stats.verdict import MARKS, position_by_test

_HEADS = {"policy": "Policy", "n": "Missions", **METRICS}


def estimates(
    rows: pd.DataFrame,
    index: Sequence[str],
    columns: str = "metric",
    write: Callable[[float, float, float], str] = numbers.interval,
) -> pd.DataFrame:
    """Rows with ``mean``, ``low`` and ``high``: a cell per estimate, empty where there is none.

    Args:
        rows: The rows.
        index: The columns that name a row.
        columns: The column whose values name the columns.
        write: Writes a mean and the ends of its interval.
    """

    def cell(mean: float, low: float, high: float) -> str:
        return "" if np.isnan(mean) else write(mean, low, high)

    table = numbers.wide(rows, [*index], columns, cell).fillna("").reset_index()
    for name in index:
        table[name] = table[name].map("{:,}".format if name == "n" else value_text)
    heads = {field: parameter(field).name for field in index} | _HEADS
    return table.rename(columns=lambda name: heads.get(name) or value_text(name))


def means(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``analysis.summary`` by policy: a column per metric of the paper."""
    return estimates(rows[rows["metric"].isin(METRICS)], ["policy", "n"])


def compared(rows: pd.DataFrame, of: str) -> pd.DataFrame:
    """Rows of ``analysis.compare``: differences in every metric, and the p-value of the product.

    The mark of a difference says whether it is significant, by its adjusted p-value.

    Args:
        rows: The rows. Those of ``analysis.compare_learners`` have the prediction interval of the
            product of one new training as well; a single training has none.
        of: The column that tells what is compared.
    """
    sides = map(position_by_test, rows["difference"], rows["p_adjusted"])
    ends = rows[["difference", "low", "high"]].to_numpy()
    texts = [f"{numbers.points(*e)} {MARKS[s]}" for e, s in zip(ends, sides, strict=True)]
    heads = rows["metric"].map(METRICS)
    cells = rows.assign(text=texts, head=heads).pivot(index=of, columns="head", values="text")
    product = rows[rows["metric"] == PRODUCT].set_index(of)
    shown = cells.loc[product.index, heads.unique()].rename_axis(columns=None)
    if "trainings" in rows:
        new = product[["difference", "new_low", "new_high"]].to_numpy()
        texts = [numbers.points(*e).partition(" ")[2] for e in new]
        shown["One new training"] = np.where(product["trainings"] > 1, texts, "unknown")
        shown["Trainings"] = product["trainings"]
    shown["p of the product"] = product["p_adjusted"].map(numbers.p_value)
    return shown.reset_index(names=of.capitalize())


def precisions(rows: pd.DataFrame) -> pd.DataFrame:
    """Rows of ``summary.precisions``: the precision of each estimate beside its target."""
    columns = {
        "Policy": rows["policy"],
        "Point": rows["point"],
        "Metric": rows["metric"].map(metric_name),
        "Missions": rows["missions"].map("{:,}".format),
        "Mean": rows["mean"].map(numbers.quantity),
        "Half-width": rows["half_width"].map("{:.2g}".format),
        "Target": rows["target"].map("{:.2g}".format),
        "Reached": rows["met"].map({True: "yes", False: "no: the budget ended"}),
    }
    return pd.DataFrame(columns)


def spread(distributions: pd.DataFrame, metric: str) -> pd.DataFrame:
    """Rows of ``analysis.distribution``: quantiles of a metric, and means of the worst missions."""
    heads = [
        f"{numbers.level(row.share)} quantile"
        if row.view == "quantile"
        else f"Mean of the worst {numbers.level(row.share)}"
        for row in distributions.itertuples()
    ]
    rows = distributions.assign(head=heads).rename(columns={"value": "mean"})
    return numbers.wide(rows, "policy", "head", numbers.written(metric)).reset_index(names="Policy")


def priced(rows: pd.DataFrame, metrics: list[str]) -> pd.DataFrame:
    """Rows of ``costs.priced``: condition, fleet, policy, cost and metrics of settings."""
    columns = {"Condition": rows["condition"]} if rows["condition"].any() else {}
    columns |= {"Fleet": rows["fleet"], "Policy": rows["policy"]}
    write = {COST: numbers.amounts} | dict.fromkeys(metrics, numbers.interval)
    columns |= {metric_name(name): numbers.estimates(rows, name, write[name]) for name in write}
    return pd.DataFrame(columns)
