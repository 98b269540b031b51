"""The door for files: all that is read, written or listed of users and of results goes through it.

    text = read_text(Path("sea.toml"), limit=2**20)
    manifests = paths_in(Path("results"), "*/manifest.json")
    write_file(Path("table.json"), text)

Only regular files are read, and up to a limit: a pipe, a device or a file without end in the place
of an input would block the program or fill the memory. Only new and regular files are written, each
completely or not at all. Everything else is refused in one line with its path.
"""

from dess.files.locks import check_lock, locked, temporary_folder
from dess.files.parsing import is_text, parse_json, parse_toml
from dess.files.reading import checked, paths_in, read_bytes, read_text
from dess.files.shipped import Shipped
from dess.files.writing import (
    check_folder,
    check_target,
    delete,
    fill,
    make_folder,
    making,
    replacing,
    replacing_all,
    writable,
    write_file,
    write_files,
)

__all__ = [
    "Shipped",
    "check_folder",
    "check_lock",
    "check_target",
    "checked",
    "delete",
    "fill",
    "is_text",
    "locked",
    "make_folder",
    "making",
    "parse_json",
    "parse_toml",
    "paths_in",
    "read_bytes",
    "read_text",
    "replacing",
    "replacing_all",
    "temporary_folder",
    "writable",
    "write_file",
    "write_files",
]
