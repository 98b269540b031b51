"""What is in the folder of a case, before and after its command."""

import os
import stat
from hashlib import sha256
from pathlib import Path

from tests.fuzz.case import LOG

Snapshot = dict[str, str]  # a description of every entry, by its relative path


def taken(box: Path) -> Snapshot:
    """Everything in the folder of a case but for the output of the command itself."""
    entries = {}
    for folder, folders, files in os.walk(box):
        for name in folders + files:
            path = os.path.join(folder, name)
            entries[os.path.relpath(path, box)] = _described(path)
        if folder == str(box):
            folders.remove(LOG)
    del entries[LOG]
    return entries


def _described(path: str) -> str:
    status = os.lstat(path)
    kind = stat.S_IFMT(status.st_mode)
    if kind == stat.S_IFREG:
        with open(path, "rb") as file:
            return f"file of {status.st_size} bytes {sha256(file.read()).hexdigest()}"
    if kind == stat.S_IFLNK:
        return f"link to {os.readlink(path)}"
    return f"node {kind:o} {status.st_rdev}"
