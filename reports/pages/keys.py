"""The key of a page: a hash of all that it depends on, by which an unchanged page is known.

key = key_of(report, {"fig4": Path("results/fig4")})
has_key(Path("build/reports/performance.html"), key)   # it need not be rendered again
"""

import sys
from collections.abc import Mapping
from functools import lru_cache
from hashlib import sha256
from importlib import metadata
from pathlib import Path

import nbformat

from analysis.results.files import MANIFEST
from dess import InputError
from dess.code.sources import OURS
from dess.files.documents import LIMIT
from dess.files.reading import paths_in, read_bytes, read_text
from reports.pages.index import LARGEST
from reports.pages.notebook import Report
from reports.pages.verify import is_sealed

PACKAGES = Path(__file__).parents[2]


def key_of(report: Report, studies: Mapping[str, Path]) -> str:
    """The key of a page whose notebook has its default parameters.

    Args:
        report: The report.
        studies: The results folders that it reads, by the names that the page has for them.
    """
    parts = [_software(), nbformat.writes(report.original)]
    for name, folder in studies.items():
        files = [path.relative_to(folder).as_posix() for path in paths_in(folder, "**/*.parquet")]
        parts += [name, _hash(folder / MANIFEST), *files]  # the names of files have their hashes
    return sha256(repr(parts).encode()).hexdigest()


def has_key(page: Path, key: str) -> bool:
    """Whether a file is a page with this key that has not been altered."""
    try:
        content = read_text(page, LARGEST)
    except (OSError, InputError):
        return False
    return f'<meta name="dess-key" content="{key}">' in content and is_sealed(content)


@lru_cache
def _software() -> str:
    """A hash of the files of the four packages and of the versions of all libraries."""
    folders = [PACKAGES / name for name in (*sorted(OURS), "analysis", "reports")]
    paths = [path for folder in folders for path in paths_in(folder, "**/*.*") if path.is_file()]
    files = [
        (path.relative_to(PACKAGES).as_posix(), _hash(path))
        for path in paths
        if path.parent.name != "__pycache__"
    ]
    versions = sorted(f"{library.name} {library.version}" for library in metadata.distributions())
    return repr([sys.version, versions, files])


def _hash(path: Path) -> str:
    return sha256(read_bytes(path, LIMIT)).hexdigest()
