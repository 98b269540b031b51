"""Pages: notebooks are run and rendered as HTML files, which ``dess verify`` can check.

Here are the names of the files in a folder of pages, and what is refused before the first page.
"""

import sys
from pathlib import Path

from dess.base.files.locks import check_lock
from dess.base.files.writing import check_target

# nbformat imports jsonschema, which compiles grammars of web addresses if it finds rfc3987_syntax.
# That takes a second, and no schema of a notebook has an address.
sys.modules["rfc3987_syntax"] = None  # type: ignore[assignment]

INDEX = "index.html"
LOCK = ".index.lock"  # held while the index is written, which shows the pages of all processes
PREFIX = "study-"  # of the names of the pages of studies
PICTURES = ("svg", "pdf", "png")  # formats of the files with its figures
ASKED = "DESS_FIGURES"  # the variable with those that are asked for, in the process of notebooks
ENDINGS = (".html", ".partial.html", ".ipynb")  # of the files of a page


def check_pages(folder: Path, *names: str) -> None:
    """Refuse a folder that pages cannot be written into, before a long computation begins.

    Args:
        folder: The folder.
        *names: The names of the pages.

    Raises:
        InputError: If the folder cannot be made, or one of its files cannot be written.
    """
    check_lock(folder / LOCK)
    for file in (INDEX, *(f"{name}{ending}" for name in names for ending in ENDINGS)):
        check_target(folder / file)
