"""Figures: what several answers draw with, and what a page shows of a figure."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

from dess.analysis.metrics import metric_of
from dess.analysis.names import field_named

if TYPE_CHECKING:  # figures need the extra reports
    from matplotlib.figure import Figure


class Drawing(NamedTuple):
    """A figure with what a page says of it.

    Attributes:
        figure: The figure.
        alt: What it shows, for readers who cannot see it.
        caption: The text below it.
        data: Its data, if the page links to them.
    """

    figure: "Figure"
    alt: str
    caption: str = ""
    data: pd.DataFrame | None = None


def name_best_mean(rows: pd.DataFrame, metric: str, fields: Iterable[str]) -> str:
    """What a figure of means finds: the best mean and where it is, in a sentence.

    Args:
        rows: The means of the figure, in ``mean``, with a column for each field.
        metric: The metric.
        fields: The fields, or ``policy``, that say which mean it is.

    Returns:
        The sentence with a space at its end; nothing where all means are equal.
    """
    means = rows["mean"].dropna()
    if means.nunique() < 2:
        return ""
    measure = metric_of(metric)
    extreme = "highest"
    place = means.idxmax()
    if measure.less_is_better:
        extreme = "lowest"
        place = means.idxmin()
    words = [field_named(field).words(rows.loc[place, field]) for field in fields]
    return f"The {extreme} mean is {measure.write(means[place])}, of {', '.join(words)}. "
