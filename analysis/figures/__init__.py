"""Figures: what several answers draw with, and what a page shows of a figure."""

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

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


def best_place(rows: pd.DataFrame, metric: str) -> Any:
    """The label of the row with the best mean.

    Args:
        rows: Means in ``mean``. Where a column ``tied`` says which may be the best by what was
            seen, it is one of these, and where ``selected`` says which a study has selected, it is
            one of those.
        metric: The metric.

    Returns:
        The label; None if there is no mean.
    """
    candidates = rows.dropna(subset="mean")
    for column in ("tied", "selected"):
        if column in rows and candidates[column].any():
            candidates = candidates[candidates[column].astype(bool)]
    if candidates.empty:
        return None
    if metric_of(metric).less_is_better:
        return candidates["mean"].idxmin()
    return candidates["mean"].idxmax()


def name_best_mean(rows: pd.DataFrame, metric: str, fields: Iterable[str]) -> str:
    """What a figure of means finds: the best mean and where it is, in a sentence.

    Args:
        rows: The means of the figure, as ``best_place`` takes them, with a column for each field.
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
    farthest = means.max()
    if measure.less_is_better:
        extreme = "lowest"
        farthest = means.min()
    place = best_place(rows, metric)
    among = ""
    if means[place] != farthest:
        among = " of what is not ruled out"
        if "selected" in rows and rows.loc[place, "selected"]:
            among = " of what the study selects"
    words = [field_named(field).words(rows.loc[place, field]) for field in fields]
    return f"The {extreme} mean{among} is {measure.write(means[place])}, of {', '.join(words)}. "
