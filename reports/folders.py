"""The folder of pages: the files in it, and what is refused before the first page is rendered."""

from pathlib import Path

from dess.files.writing import check_lock, check_target

INDEX = "index.html"
LOCK = ".index.lock"  # held while the index is written, which shows the pages of all processes
PREFIX = "study-"  # of the names of the pages of studies
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
