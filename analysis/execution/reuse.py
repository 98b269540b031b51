"""Find results folders from which a study can copy missions instead of simulating them."""

from collections.abc import Iterable
from pathlib import Path

from analysis.results.files import MANIFEST
from analysis.results.manifest import Manifest
from analysis.results.store import Store
from dess import InputError


def sources(folders: Iterable[Path], manifest: Manifest) -> list[Store]:
    """The folders that contain cells of a manifest: same code, scenario, policy and seed.

    A folder that is not a results folder is left out. So is a folder whose missions were simulated
    by several versions of the code, because the keys of its cells identify only the first version.
    """
    keys = _keys(manifest)
    return [store for folder in folders if (store := _source(folder, keys))]


def _source(folder: Path, keys: set[str]) -> Store | None:
    try:
        manifest = Manifest.read(folder / MANIFEST)
        if manifest.accepted or not keys & _keys(manifest):
            return None
        return Store.read(folder)
    except InputError:
        return None


def _keys(manifest: Manifest) -> set[str]:
    return {cell.key for cells in manifest.cells for cell in cells}
