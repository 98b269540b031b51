"""Doors: what all parts of the program must go through, seen in the syntax trees of sources."""

import ast
from collections.abc import Iterator

from tests.test_architecture import SOURCES

DOOR = "dess.base.files"
# What opens, reads, writes or lists files, by the name that is called, or by its attribute.
OPENING = {
    *("open", "fdopen", "read_text", "read_bytes", "write_text", "write_bytes", "fromfile"),
    *("tofile", "memmap", "mmap", "loadtxt", "genfromtxt", "savetxt", "savez", "load_file"),
    *("glob", "rglob", "iglob", "iterdir", "listdir", "scandir", "walk", "fwalk"),
    *("touch", "unlink", "mkdir", "makedirs", "rmdir", "removedirs", "rmtree", "symlink_to"),
    *("hardlink_to", "copyfile", "copytree", "copy2", "truncate", "chmod", "chdir"),
    *("read_parquet", "read_table", "read_csv", "read_json", "read_pickle", "read_excel"),
    *("to_parquet", "to_pickle", "to_excel", "to_hdf", "write_table", "write_dataset"),
    *("ParquetFile", "ParquetWriter", "ParquetDataset", "safe_open", "save_file", "savefig"),
    *("ZipFile", "TarFile", "SummaryWriter", "FileLock", "SoftFileLock", "saving", "extractall"),
}
# Functions of modules whose names alone say little.
OPENING_OF = {
    "os": {"remove", "rename", "replace", "link", "symlink", "truncate", "mkfifo"},
    "json": {"load", "dump"},
    "tomllib": {"load"},
    "torch": {"load", "save"},
    "np": {"load", "save"},
    "pickle": {"load", "loads", "dump"},
    "shutil": {"copy", "move"},
    "Image": {"open"},
}
# What is no way past the door, by the module.
ALLOWED = {
    # A results folder, whose files the door reads and writes.
    "dess.analysis.execution.runner": {"open"},
    "dess.analysis.results.merge": {"open"},
    # Sources of our own code, and what numba keeps of it.
    "dess.base.kernels": {"read_bytes"},
    "dess.base.sources": {"read_bytes"},
    # A library that opens a file which the door has checked, or a temporary one of the door.
    "dess.policies.learner.arrays": {"safe_open", "save_file"},
    "dess.policies.learner.session": {"SummaryWriter"},
    "dess.reports.cli.mission_files": {"savefig"},
    "dess.reports.animation": {"saving"},
    # The null device in the place of a closed stream; the licence of the package.
    "dess.reports.cli.console": {"open"},
    "dess.reports.crate": {"read_text"},
}


def called(tree: ast.Module) -> Iterator[tuple[str, ast.Call]]:
    """The calls that open, read, write or list files, unless they are calls of the door."""
    doors = {
        alias.asname or alias.name
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and str(node.module).startswith(DOOR)
        for alias in node.names
    }
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        if isinstance(node.func, ast.Name) and node.func.id in OPENING - doors:
            yield node.func.id, node
        elif isinstance(node.func, ast.Attribute):
            owner = node.func.value.id if isinstance(node.func.value, ast.Name) else ""
            if node.func.attr in OPENING | OPENING_OF.get(owner, set()) and owner not in doors:
                yield node.func.attr, node


def in_memory(call: ast.Call) -> bool:
    """Whether a file format is read from, or written into, a buffer."""
    places = {ast.unparse(argument) for argument in call.args}
    return bool(places & {"buffer", "sink"}) or any("BufferReader(" in place for place in places)


def test_files_are_opened_read_written_and_listed_by_the_door_alone():
    """An exception that nothing needs any more goes."""
    past = {
        name: {what for what, call in called(tree) if not in_memory(call)}
        for name, tree in SOURCES.items()
        if not name.startswith(DOOR)
    }
    assert {name: found for name, found in past.items() if found} == ALLOWED
