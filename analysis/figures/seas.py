"""Figures of many seas."""

import pandas as pd
from matplotlib.figure import Figure

from analysis.figures import drawings, style


def groups(table: pd.DataFrame, by: str, title: str) -> Figure:
    """What every policy reaches in groups of seas, with intervals.

    Args:
        table: Rows of ``analysis.questions.optimality.seas.quality`` or ``shares``.
        by: The column of the groups.
        title: Of the vertical axis.
    """
    looks = style.policy_colours(table["policy"])
    with style.panels(4.2) as (figure, ax):
        drawings.along(drawings.placed(table, by), looks, "%", ax, linestyle="")
        ax.set(ylabel=title)
        ax.legend(loc="lower left", ncols=4)
    return figure
