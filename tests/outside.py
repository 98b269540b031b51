"""Packages of others that are installed, as far as Python can tell."""

import sys
from pathlib import Path

import pytest


def install_package(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    module: str,
    source: str,
    group: str = "dess.policies",
    **values: str,
) -> None:
    """Install a package of one module in a folder, with its entry points of a group."""
    folder.mkdir(exist_ok=True)
    (folder / f"{module}.py").write_text(source)
    name, entries = module.replace("_", "-"), (f"{n} = {of}\n" for n, of in values.items())
    metadata = folder / f"{module}-1.dist-info"
    metadata.mkdir()
    (metadata / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1\n")
    (metadata / "entry_points.txt").write_text(f"[{group}]\n{''.join(entries)}")
    monkeypatch.syspath_prepend(str(folder))
    monkeypatch.delitem(sys.modules, module, raising=False)
