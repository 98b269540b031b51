"""Links in a page that save the data of a table or a figure: CSV and LaTeX."""

import re
from base64 import b64encode
from html import escape

import pandas as pd

from dess.analysis import numbers

DIGITS = "%.6g"  # format of numbers in files with data
# Characters that LaTeX cannot print directly.
_IN_LATEX = str.maketrans(
    {"−": "$-$", "–": "--", "▲": r"$\triangle$", "▼": r"$\nabla$", "≈": r"$\approx$", "±": r"$\pm$"}
    | {"△": r"($\triangle$)", "▽": r"($\nabla$)"}
)


def make_download_links(title: str, data: pd.DataFrame, shown: pd.DataFrame) -> str:
    """Links that save data as CSV and a table as LaTeX; the links contain the files."""
    name = re.sub(r"[^a-z0-9]+", "-", title.partition(":")[0].lower())[:80].strip("-")
    files = {
        "CSV": ("csv", "text/csv", numbers.write_csv(data, DIGITS)),
        "LaTeX": ("tex", "application/x-tex", format_latex(shown)),
    }
    links = [
        f'<a download="{name}.{suffix}" aria-label="{escape(f"{title}: {kind}")}" '
        f'href="data:{media};charset=utf-8;base64,{b64encode(text.encode()).decode()}">{kind}</a>'
        for kind, (suffix, media, text) in files.items()
    ]
    return f'<span class="data">Data: {" ".join(links)}</span>'


def format_latex(frame: pd.DataFrame) -> str:
    """A table in LaTeX; it needs the package booktabs."""
    text = frame.to_latex(index=False, escape=True, float_format=DIGITS.__mod__, na_rep="")
    return re.sub(r"\bC\\_([SC])\b", r"$C_\1$", text).translate(_IN_LATEX)
