"""``dess`` as users have it: a wheel in an environment of its own, away from the source tree.

``installed`` is fast: its libraries are those of the environment of the tests, by path. Slow tests
install all libraries into an empty environment.
"""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
from pathlib import Path
from zipfile import ZipFile

import pytest

ROOT = Path(__file__).parents[1]


def built(kind: str, folder: Path, source: Path = ROOT) -> Path:
    """A ``wheel``, ``wheel:editable`` or ``sdist`` of a source tree, built into a folder."""
    command = [sys.executable, "-m", "hatchling", "build", "-t", kind, "-d", str(folder)]
    subprocess.run(command, cwd=source, check=True, capture_output=True)
    [file] = folder.glob("*.whl" if kind.startswith("wheel") else "*.tar.gz")
    return file


def archived(folder: Path, source: Path = ROOT) -> Path:
    """A source tree as a zip of git."""
    git = ["git", "--git-dir", str(folder / "git"), "--work-tree", str(source)]
    archive = folder / "dess.zip"
    subprocess.run([*git, "init", "--quiet"], check=True)
    subprocess.run([*git, "add", "--all"], check=True, cwd=source)
    files = subprocess.check_output([*git, "write-tree"], text=True).strip()
    subprocess.run([*git, "archive", "--format=zip", "-o", str(archive), files], check=True)
    return archive


def unpacked(folder: Path, source: Path = ROOT) -> Path:
    """A source tree as an unpacked archive of git has it, where links have become text files."""
    tree = folder / "dess-main"
    with ZipFile(archived(folder, source)) as zipped:
        zipped.extractall(tree)
    return tree


def environment(home: Path) -> dict[str, str]:
    """The variables of a user with an empty home: nothing leads to the source tree."""
    hidden = ("PYTHONPATH", "VIRTUAL_ENV", "XDG_", "JUPYTER", "IPYTHON", "MPLCONFIGDIR")
    kept = {name: value for name, value in os.environ.items() if not name.startswith(hidden)}
    return kept | {"HOME": str(home)}


def install(folder: Path, *packages: str) -> Path:
    """Make an environment in a folder, and install with pip; the folder of its commands."""
    venv.create(folder, symlinks=True)
    commands = folder / ("Scripts" if os.name == "nt" else "bin")
    pip = [sys.executable, "-m", "pip", "--python", str(commands / "python"), "install", "--quiet"]
    subprocess.run([*pip, *packages], check=True, capture_output=True, cwd=folder)
    return commands


@pytest.fixture(scope="session")
def installed(tmp_path_factory):
    """The command ``dess`` of an installed wheel; run it with the variables of ``environment``."""
    folder = tmp_path_factory.mktemp("installed")
    wheel = built("wheel", folder)
    commands = install(folder / "venv", "--no-deps", "--no-index", str(wheel))
    [libraries] = (folder / "venv").glob("lib/python*/site-packages")
    # A path in a .pth file is searched last, and the .pth files in it, of editable installations,
    # are not read.
    here = "\n".join(dict.fromkeys(map(sysconfig.get_path, ("purelib", "platlib"))))
    (libraries / "libraries-of-the-tests.pth").write_text(here, "utf-8")
    for package in ("dess", "dess/analysis", "dess/policies"):  # links, which ** does not follow
        for compiled in ROOT.glob(f"{package}/**/__pycache__/*.nb[ci]"):  # need not be made again
            target = libraries / compiled.relative_to(ROOT)
            if target.parents[1].is_dir():  # but of modules that another commit had
                target.parent.mkdir(exist_ok=True)
                shutil.copy(compiled, target)
    (folder / "venv" / "share").symlink_to(Path(sys.prefix, "share"))  # templates of nbconvert
    return commands / "dess"
