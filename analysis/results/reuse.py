"""Results folders whose missions another study may take over, so that it need not simulate them."""

from collections.abc import Iterable
from pathlib import Path

from analysis.results.manifest import Manifest
from analysis.results.store import MANIFEST, Store
from dess import InputError


def sources(folders: Iterable[Path], manifest: Manifest) -> list[Store]:
    """Those of the folders that have cells of a manifest: of the same code, scenarios and seed.

    A folder that is no results folder is left out, and so is one whose missions were simulated by
    several versions of the code: the keys of its cells tell of the first version alone.
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
