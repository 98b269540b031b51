"""Zip files whose bytes depend on nothing but what is in them."""

from collections.abc import Iterable
from pathlib import Path
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

_EPOCH = (1980, 1, 1, 0, 0, 0)  # the earliest time that a zip file can store
_FILE, _FOLDER = 0o100644, 0o40755


def write_zip(path: Path, entries: Iterable[tuple[str, bytes]]) -> None:
    """Write a zip file.

    Args:
        path: The file, a temporary one of ``replacing``.
        entries: Names with their contents; the name of a folder ends with a slash.
    """
    with ZipFile(path, "w") as archive:
        for name, content in entries:
            entry = ZipInfo(name, _EPOCH)
            entry.compress_type = ZIP_DEFLATED
            entry.external_attr = (_FOLDER if entry.is_dir() else _FILE) << 16  # permissions
            archive.writestr(entry, content)
