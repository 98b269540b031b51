"""The files of a results folder: their names and places.

A run writes and deletes only inside of its folder, also in one that somebody else has made.
"""

from pathlib import Path
from urllib.parse import quote

from analysis.results.chunks import short_hash
from dess import InputError
from dess.files.reading import paths_in

MANIFEST, LOCK = "manifest.json", ".lock"
LONG = 150  # largest number of characters of a policy's name in the name of a folder
BOUNDS = "bounds"  # the folder of the bounds of missions, which are the same for all policies
FOLDERS = ("missions", "uavs", "events", BOUNDS, "failures")


def partition(policy: str) -> str:
    """The name of the folder with the files of a team."""
    name = quote(policy, safe="", errors="surrogatepass")
    if len(name) > LONG:
        name = f"{name[:LONG]}~{short_hash(name.encode())}"
    return f"policy={name}"


def check_places(folder: Path) -> None:
    """Refuse links in the places of a run's own files: it would write and delete where they lead.

    Raises:
        InputError: If there are links, or files and folders in each other's place.
    """
    for path in (*(folder / name for name in FOLDERS), *paths_in(folder, "*/policy=*")):
        if path.is_symlink() or (path.exists() and not path.is_dir()):
            raise InputError(
                f"{path}: is a link, or not what a run would write there; allowed: another --out"
            )


def is_ours(path: Path) -> bool:
    """Whether a run may have made this file or folder before it wrote the manifest."""
    return path.name == LOCK or (path.name.startswith(".") and path.suffix == ".tmp")
