"""Figures: what several answers draw with, and what a page shows of a figure."""

from typing import TYPE_CHECKING, NamedTuple

import pandas as pd

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
