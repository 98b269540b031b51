"""Which pages are there already, and would be the same if they were made again.

A page depends on its notebook, on the results that it reads, on the code and on the libraries. Its
card has a hash of all of them, which is its key.
"""

import sys
from contextlib import suppress
from functools import lru_cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path

import nbformat

import dess
from dess import InputError
from dess.analysis.results.chunks import DERIVED, MANIFEST
from dess.base.files.documents import LIMIT
from dess.base.files.reading import hash_file, paths_in
from dess.base.floors import FLOORS
from dess.reports.pages.notebook import Report
from dess.reports.pages.page import has_key

PACKAGE = Path(dess.__file__).parent


def find_finished_page(report: Report, results: Path, out: Path) -> None:
    """Find out whether the page of a report is there and of its results, which are sound then.

    Args:
        report: The report, with the default parameters of its notebook.
        results: The folder of the results.
        out: The folder of the pages.
    """
    # If there are no results, what the report lacks is found out before it is run.
    with suppress(InputError):
        report.key = page_key(report)
        kept = not report.formats and has_key(out / report.page, report.key)
        report.is_current = kept and report.is_in(out, results)


def page_key(report: Report) -> str:
    """The key of a page whose notebook has its default parameters."""
    parts = [_hash_software(), nbformat.writes(report.original)]
    for name, folder in report.results.items():
        # The names of these files have their hashes. Those of ``DERIVED`` follow from them.
        files = [path.relative_to(folder) for path in paths_in(folder, "**/*.parquet")]
        records = [path.as_posix() for path in files if path.parts[0] != DERIVED]
        parts += [name, hash_file(folder / MANIFEST, LIMIT), *records]
    return sha256(repr(parts).encode()).hexdigest()


@lru_cache
def _hash_software() -> str:
    """A hash of the files of this package and of the versions of all libraries."""
    # In a checkout, folders of the package lie beside it, and ``**`` does not follow links to them.
    folders = [PACKAGE]
    for name in FLOORS:
        if (PACKAGE / name).is_symlink() or not (PACKAGE / name).is_dir():
            folders.append(PACKAGE.parent / name)
    files = sorted(
        (path.relative_to(folder).as_posix(), hash_file(path, LIMIT))
        for folder in folders
        for path in paths_in(folder, "**/*.*")
        if path.is_file() and path.parent.name != "__pycache__"
    )
    versions = sorted(f"{library.name} {library.version}" for library in metadata.distributions())
    return repr([sys.version, versions, files])
