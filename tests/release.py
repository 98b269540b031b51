"""Whether a release is whole and can be installed: ``python -m tests.release``.

Version, date and licence are the same wherever they stand; wheel and sdist hold what they must; and
wheel, sdist and an archive of the repository are installed into empty environments, in which the
README's first command finds the fleet that the README names. Nothing is uploaded.
"""

import re
import shutil
import subprocess
import sys
import tarfile
import time
import tomllib
from pathlib import Path
from tempfile import TemporaryDirectory
from zipfile import ZipFile

import yaml

from tests.installed import ROOT, archived, built, environment

# The oldest and the newest Python that the project promises, and one that is tried: it may fail.
PROMISED, TRIED = ("3.11", "3.13"), ("3.14",)
# The folders of the product, and what is before their names where they are installed.
FOLDERS = {"dess": "", "policies": "dess/", "analysis": "dess/", "reports": "dess/"}
CACHES = {"__pycache__", ".ipynb_checkpoints", ".pytest_cache", ".hypothesis", ".mypy_cache"}
CACHES |= {".ruff_cache", ".benchmarks", ".nox", ".venv"}
# What nobody would miss before a user does.
NEEDED = ("LICENSE", "LICENSE-era5", "LICENSE-fdlibm", "py.typed", "engine.wasm", "engine.json")
NEEDED += ("ddqn/model.safetensors", "generalist/model.safetensors", "jade-bight.toml")
NEEDED += ("era5-40.0N-72.5W-1990-2020.parquet",)
LIMIT = 1800  # seconds of an installation with the README's command


def disagreements(root: Path) -> list[str]:
    """What pyproject.toml, CITATION.cff, CHANGELOG.md and LICENSE tell differently, a line each."""
    project = tomllib.loads((root / "pyproject.toml").read_text("utf-8"))["project"]
    citation = yaml.safe_load((root / "CITATION.cff").read_text("utf-8"))
    version, date = next(heading for heading in headings(root) if heading[0] != "Unreleased")
    licence = (root / "LICENSE").read_text("utf-8").split(" License\n")[0]
    told = {
        "version": [project["version"], citation["version"], version],
        "date": [str(citation["date-released"]), date],
        "licence": [project["license"], citation["license"], licence],
    }
    return [
        f"{what}: {' and '.join(dict.fromkeys(values))}; allowed: the same in all files"
        for what, values in told.items()
        if len(set(values)) > 1
    ]


def headings(root: Path) -> list[tuple[str, str]]:
    """The versions of the changelog with their dates, the newest first."""
    changelog = (root / "CHANGELOG.md").read_text("utf-8")
    return re.findall(r"^## \[(.+?)\](?: - (\S+))?$", changelog, re.M)


def product_files(root: Path) -> dict[str, str]:
    """The files of the product in the repository, each with its name in a wheel."""
    paths = (path for folder in FOLDERS for path in (root / folder).rglob("*") if path.is_file())
    names = (path.relative_to(root).as_posix() for path in paths)
    own = (name for name in names if not CACHES & {*name.split("/")})
    return {name: f"{FOLDERS[name.split('/')[0]]}{name}" for name in own}


def faults_of_wheel(held: set[str], root: Path) -> list[str]:
    """What a wheel lacks, and what it has too much."""
    own = {name for name in held if not name.split("/")[0].endswith(".dist-info")}
    return _faults("wheel", held, own, set(product_files(root).values()))


def faults_of_sdist(held: set[str], root: Path) -> list[str]:
    """What an sdist lacks, and what it has too much; the names begin in its only folder."""
    own = {name for name in held if name.split("/")[0] in FOLDERS}
    return _faults("sdist", held, own, set(product_files(root)))


def _faults(kind: str, held: set[str], own: set[str], wanted: set[str]) -> list[str]:
    """A line for each file of a distribution that is missing, not of the product, or of a cache."""
    caches = {name for name in held if CACHES & {*name.split("/")}}
    needed = {end for end in NEEDED if not any(f"/{name}".endswith(f"/{end}") for name in held)}
    lines = [f"{kind}: {name} is missing" for name in sorted(needed | (wanted - own))]
    return lines + [
        f"{kind}: {name} is not of the release" for name in sorted(caches | own - wanted)
    ]


def names_in(file: Path) -> set[str]:
    """The files in a wheel, or in an sdist without its folder."""
    if file.suffix == ".whl":
        with ZipFile(file) as wheel:
            return set(wheel.namelist())
    with tarfile.open(file) as sdist:
        return {member.name.split("/", 1)[1] for member in sdist if member.isfile()}


def interpreter(version: str) -> str | None:
    """The path of a Python with pip and venv, or none if the machine has it not."""
    found = shutil.which(f"python{version}")
    if found is None:
        return None
    ask = [found, "-c", "import ensurepip, sys, venv; print(sys.executable)"]
    done = subprocess.run(ask, capture_output=True, text=True)  # of pyenv, some only say where
    return None if done.returncode else done.stdout.strip()


def first_commands(python: str, package: str) -> str:
    """The README's first block for a Python and a package; without its browser."""
    readme = (ROOT / "README.md").read_text("utf-8")
    block = re.findall(r"^```sh\n(.*?)^```$", readme, re.M | re.S)[0]
    lines = [line for line in block.splitlines(keepends=True) if "webbrowser" not in line]
    commands = "".join(lines).replace('".[reports]"', f'"{package}[reports]"')
    return commands.replace("python3 -m venv", f"{python} -m venv")


def try_installation(file: Path, python: str, place: Path) -> None:
    """Do what the README says with a file, in a folder that is also the home.

    Raises:
        AssertionError: If a command fails, or answers something else than the README.
    """
    if file.suffix == ".zip":  # as an archive of the repository is used
        with ZipFile(file) as archive:
            archive.extractall(place)
        package = "."
    else:
        package = f"./{file.name}"
        for needed in (file, ROOT / "constraints.txt"):
            shutil.copy(needed, place)
    cache = subprocess.check_output([sys.executable, "-m", "pip", "cache", "dir"], text=True)
    variables = environment(place) | {"PIP_CACHE_DIR": cache.strip()}
    own = 'dess --version\npython -P -c "import dess; print(dess.__file__)"'
    words = ["bash", "-e", "-c", first_commands(python, package) + own]
    done = subprocess.run(
        words, cwd=place, env=variables, capture_output=True, text=True, timeout=LIMIT
    )
    assert done.returncode == 0, done.stderr[-2000:]
    headline = re.findall(r"^> \*\*(.*)\*\*$", (ROOT / "README.md").read_text("utf-8"), re.M)[0]
    version, _ = headings(ROOT)[0]
    for wanted in (headline, f"dess {version}", f"{place}/.venv/"):
        assert wanted in done.stdout, f"{wanted!r} is not in: {done.stdout[-2000:]}"
    assert (place / "build/reports/index.html").is_file(), "no build/reports/index.html"


def main() -> int:
    """Check everything, and print what was checked; the exit code is 1 if something fails."""
    wrong = disagreements(ROOT)
    if headings(ROOT)[0][0] == "Unreleased":
        wrong.append("CHANGELOG.md: begins with Unreleased; allowed: the version that is released")
    with TemporaryDirectory(prefix="dess-release-") as name:
        folder = Path(name).resolve()
        wheel, sdist = (built(kind, folder / kind) for kind in ("wheel", "sdist"))
        wrong += faults_of_wheel(names_in(wheel), ROOT) + faults_of_sdist(names_in(sdist), ROOT)
        for file in (wheel, sdist):
            print(f"{file.name}: {len(names_in(file))} files, {file.stat().st_size / 1e6:.1f} MB")
        print("\n".join(wrong) or "version, date, licences and contents agree", flush=True)
        if wrong:
            return 1
        files = {"wheel": wheel, "sdist": sdist, "zip": archived(folder)}
        failed = [v for v in (*PROMISED, *TRIED) if not try_python(v, files, folder)]
    return 1 if {*failed} & {*PROMISED} else 0


def try_python(version: str, files: dict[str, Path], folder: Path) -> bool:
    """Install each file with a Python, and print how that went, or that there is no such Python."""
    python = interpreter(version)
    if python is None:
        print(f"Python {version}: skipped, since PATH has no python{version} with pip and venv")
        return True
    works = True
    for kind, file in files.items():
        began, state, place = time.monotonic(), "works", folder / "place"
        place.mkdir()
        try:
            try_installation(file, python, place)
        except (AssertionError, subprocess.SubprocessError) as error:
            state, works = f"fails: {error}", False
        shutil.rmtree(place)  # more than a GB
        print(f"Python {version}, {kind}: {state} ({time.monotonic() - began:.0f} s)", flush=True)
    return works


if __name__ == "__main__":
    sys.exit(main())
