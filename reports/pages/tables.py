"""Tables in HTML: numbers are aligned, and an interval is not broken.

>>> table = make_table(pd.DataFrame({"Policy": ["greedy"]}), "Means with 95 % intervals")
>>> table.data.partition("</p>")[0]
'<p class="caption">Means with 95 % intervals'
"""

import re
from html import escape

import pandas as pd
from IPython.display import HTML
from markupsafe import Markup

from dess.analysis import numbers
from dess.reports.pages.downloads import make_download_links
from dess.reports.pages.templates import set_indices

FEW_WORDS = 18  # characters of a cell that is not broken
SENTENCES = 150  # characters of a cell from which on its column is wide
_CELL = re.compile(r"<td>(.*?)</td>", re.S)
# In a cell: the number at its beginning up to the decimal point; a number before its unit; an
# interval.
_NUMBER = re.compile(r"[-+−]?\d[\d,]*(?![\w–/-])")
_UNIT = re.compile(r"([\d\]]) (?=[%▲▼≈]|[^\W\d]+ \[|[^\W\d]+$)")
_BRACKETS = re.compile(r"\[[^\[\]]*\]")
_EMPTY_HEADER = re.compile(r"<th([^>]*)></th>")  # which is no header for a screen reader


def make_table(
    frame: pd.DataFrame, caption: str = "", data: pd.DataFrame | None = None, wrap: bool = False
) -> HTML:
    """A table below its caption, without its index; a wide table scrolls.

    Args:
        frame: The table.
        caption: The text above the table.
        data: The complete numbers of the table. If given, links below the table save them as CSV
            and the shown table as LaTeX.
        wrap: Whether long cells are broken into several lines.
    """
    look = ["table"]
    if wrap:
        look += ["wrap"]
    html = frame.to_html(index=False, border=0, classes=look, escape=True, na_rep="")
    html = _CELL.sub(_wrap_cell, html) if wrap else _align_numbers(html, len(frame.columns))
    html = str(set_indices(Markup(_EMPTY_HEADER.sub(r"<td\1></td>", html))))
    caption = ". ".join(
        filter(None, [caption, numbers.why_nan(frame.astype(object).fillna("").to_numpy().flat)])
    )
    above = ""
    if caption:
        above = f'<p class="caption">{set_indices(caption)}</p>'  # what scrolls would take it away
    below = ""
    if data is not None:
        below = make_download_links(caption, data, frame)
    label = escape(caption or "Table")
    html = html.replace("<table", f'<table aria-label="{label}"', 1)
    inside = f'<div class="scroll" role="region" tabindex="0" aria-label="{label}">{html}</div>'
    return HTML(f"{above}{inside}{below}")


def _align_numbers(table: str, columns: int) -> str:
    """A table in HTML with the numbers that begin its cells aligned at their decimal points.

    A cell breaks between an estimate and its interval, but within neither.
    """
    cells = _CELL.findall(table)
    indents = [0.0] * len(cells)
    for column in range(columns):
        places = range(column, len(cells), columns)
        widths = {
            place: _measure_digits(number[0])
            for place in places
            if (number := _NUMBER.match(cells[place]))
        }
        for place, width in widths.items():
            indents[place] = max(widths.values()) - width
    aligned = map(_indent_cell, cells, indents)
    return _CELL.sub(lambda _: next(aligned), table)


def _indent_cell(cell: str, indent: float) -> str:
    """A cell that begins so many digits to the right."""
    if indent:
        return f'<td style="--indent:{indent:g}">{_keep_together(cell)}</td>'
    return f"<td>{_keep_together(cell)}</td>"


def _wrap_cell(cell: re.Match[str]) -> str:
    """A cell that is broken into several lines; sentences get a column that is wide enough."""
    look = ' class="long"' if len(cell[1]) > SENTENCES else ""
    return f"<td{look}>{_keep_together(cell[1])}</td>"


def _measure_digits(digits: str) -> float:
    """The width of a number before its decimal point, in digits; a comma is half as wide."""
    return len(digits) - 0.5 * digits.count(",")


def _keep_together(cell: str) -> str:
    """The text of a cell without breaks in a few words, before a unit and within an interval."""
    if len(cell) <= FEW_WORDS and "[" not in cell:
        return cell.replace(" ", "\N{NO-BREAK SPACE}")
    together = _UNIT.sub("\\1\N{NO-BREAK SPACE}", cell)
    return _BRACKETS.sub(lambda found: found[0].replace(" ", "\N{NO-BREAK SPACE}"), together)
