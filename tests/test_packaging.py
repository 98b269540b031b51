"""The distribution: what a wheel holds, what it asks for, and the versions that are pinned."""

import ast
import re
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parents[1]
PACKAGES = ("dess", "policies", "analysis", "reports")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text("utf-8"))["project"]
EXTRAS = PROJECT["optional-dependencies"]


def requirements(*lines: str) -> dict[str, Requirement]:
    """Requirements by the canonical name of the distribution."""
    return {canonicalize_name(Requirement(line).name): Requirement(line) for line in lines}


def pins() -> dict[str, str]:
    """The constraints file: distribution -> version."""
    lines = (ROOT / "constraints.txt").read_text("utf-8").splitlines()
    exact = [line.split("==") for line in lines if line and not line.startswith("#")]
    return {canonicalize_name(name): version for name, version in exact}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> ZipFile:
    """The wheel of this source tree."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    return ZipFile(next(folder.glob("*.whl")))


def test_the_wheel_holds_the_packages_with_all_their_files_and_nothing_else(wheel: ZipFile) -> None:
    files = {
        path.relative_to(ROOT).as_posix()
        for package in PACKAGES
        for path in (ROOT / package).rglob("*")
        if path.is_file() and not {"__pycache__", ".ipynb_checkpoints"} & set(path.parts)
    }
    held = {name for name in wheel.namelist() if not name.split("/")[0].endswith(".dist-info")}
    assert held == files
    for package in PACKAGES:
        assert f"{package}/py.typed" in held
    for kind in ("dess/scenarios/*.toml", "analysis/studies/*.toml", "reports/notebooks/*.py"):
        assert any(Path(name).match(kind) for name in held), kind


def test_the_wheel_installs_the_command(wheel: ZipFile) -> None:
    points = next(name for name in wheel.namelist() if name.endswith("entry_points.txt"))
    assert "dess = reports.cli:main" in wheel.read(points).decode()


def test_every_library_that_is_imported_is_asked_for() -> None:
    imported = {
        (node.module if isinstance(node, ast.ImportFrom) else alias.name).split(".")[0]
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    outside = imported - set(sys.stdlib_module_names) - set(PACKAGES)
    homes = packages_distributions()
    wanted = {canonicalize_name(home) for name in outside for home in homes.get(name, [name])}
    assert not wanted - set(requirements(*PROJECT["dependencies"], *EXTRAS["distributed"]))


def test_every_requirement_of_the_sessions_is_pinned_within_its_range() -> None:
    pinned = pins()
    asked = requirements(*PROJECT["dependencies"], *EXTRAS["test"], *EXTRAS["lint"])
    assert set(asked) <= set(pinned)
    for name, requirement in asked.items():
        assert requirement.specifier.contains(pinned[name]), name


def test_the_citation_names_this_version_and_the_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert "Multi-UAV Trajectory Optimizer" in citation["references"][0]["title"]


def test_the_changelog_has_an_entry_for_this_version() -> None:
    entries = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert entries[0] == "Unreleased"
    assert entries[1] == PROJECT["version"]
