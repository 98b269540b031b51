"""How the product is distributed over the missions of a policy: its quantiles."""

import numpy as np
import pandas as pd

from dess.analysis import numbers
from dess.analysis.metrics import PRODUCT, metric_of
from dess.analysis.results.tables import Results
from dess.analysis.stats.distribution import distribution
from dess.analysis.tables import (
    INTERVALS,
    Table,
)


def product_distributions(results: Results) -> pd.DataFrame:
    """The distribution of product over the missions of every policy.

    Returns:
        A row per policy and view, as ``dess.analysis.distribution`` returns it. Empty if there are
        several design points, whose missions have different distributions.
    """
    if len(results.store.manifest.points) > 1:
        return pd.DataFrame()
    generator = np.random.default_rng(results.store.manifest.seed)
    return distribution(results.missions, PRODUCT, generator)


def quantile_table(rows: pd.DataFrame, metric: str) -> Table:
    """Quantiles of a metric over the missions, and means of the worst ones.

    Args:
        rows: Rows of ``dess.analysis.distribution``.
        metric: The metric.
    """
    measure = metric_of(metric)
    heads = []
    for row in rows.itertuples():
        share = numbers.format_level(row.share)
        heads.append(
            f"{share} quantile" if row.view == "quantile" else f"Mean of the worst {share}"
        )
    long = rows.assign(head=heads).rename(columns={"value": "mean"})
    cells = numbers.estimates_as_text(long, "policy", "head", measure.written).reset_index(
        names="Policy"
    )
    return Table(cells, f"Quantiles of {measure.within} over missions, with {INTERVALS}", rows)
