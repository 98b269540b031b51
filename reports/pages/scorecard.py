"""The tables of claims on the page of the scorecard; their words stand in its template."""

from collections.abc import Sequence

from IPython.display import HTML

from dess.analysis.paper import scorecard
from dess.reports.pages.html import template


def as_html(rows: Sequence[scorecard.Row], caption: str) -> HTML:
    """A table of claims: the paper's number, and what every policy shows, with the rule."""
    page = template("scorecard.html")
    return HTML(page.render(rows=rows, caption=caption, columns=scorecard.names(rows)))
