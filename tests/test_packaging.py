"""The distribution: what a wheel holds, what it asks for, and the versions that are pinned."""

import ast
import re
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml
from packaging.utils import canonicalize_name

from policies.registry import TRAINED, trained_names
from tests.distributions import EXTRAS, PROJECT, ROOT, asked, closure, homes, requirements

PACKAGES = ("dess", "policies", "analysis", "reports")
ASKED = asked("test", "lint", "docs", "examples")
APART = {"test", "lint", "docs", "examples"}  # extras that ``all`` does not include


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
    for kind in (
        "dess/scenarios/*.toml",
        "policies/ddqn/configs/*.toml",
        "analysis/study/shipped/*.toml",
        "reports/notebooks/*.py",
    ):
        assert any(Path(name).match(kind) for name in held), kind


def test_the_wheel_holds_trained_policies_with_their_curves_and_model_cards(wheel: ZipFile) -> None:
    kinds = {"model.safetensors", "config.json", "training.parquet", "README.md"}
    for name in trained_names():
        folder = (TRAINED / name).relative_to(ROOT).as_posix()
        assert {held for held in wheel.namelist() if held.startswith(f"{folder}/")} == {
            f"{folder}/{kind}" for kind in kinds
        }


def test_the_wheel_installs_the_command(wheel: ZipFile) -> None:
    points = next(name for name in wheel.namelist() if name.endswith("entry_points.txt"))
    assert "dess = reports.cli:main" in wheel.read(points).decode()


def test_every_library_that_is_imported_is_asked_for() -> None:
    imported = {
        (node.module if isinstance(node, ast.ImportFrom) else alias.name).split(".")[0]
        for package in PACKAGES
        for path in (ROOT / package).rglob("*.py")
        if path.parent.name != "integrations"  # the libraries of these modules are the user's
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    outside = imported - set(sys.stdlib_module_names) - set(PACKAGES)
    found = homes()
    wanted = {home for name in outside for home in found.get(name, {canonicalize_name(name)})}
    assert not wanted - set(requirements(*asked("all")))


def test_every_requirement_of_the_sessions_is_pinned_within_its_range() -> None:
    pinned = pins()
    wanted = requirements(*ASKED)
    assert set(wanted) <= set(pinned)
    for name, requirement in wanted.items():
        assert requirement.specifier.contains(pinned[name]), name


def test_what_the_requirements_require_is_pinned_too() -> None:
    needed_by_all = closure(*ASKED)
    assert len(needed_by_all) > len(requirements(*ASKED))
    assert not needed_by_all - set(pins())


def test_all_and_the_tests_have_every_extra_that_adds_something() -> None:
    everything = {line for extra in EXTRAS.keys() - APART for line in asked(extra)}
    assert set(asked("all")) == everything
    assert everything <= set(asked("test"))


def test_the_citation_names_this_version_and_the_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == PROJECT["version"]
    assert citation["license"] == PROJECT["license"]
    assert "Multi-UAV Trajectory Optimizer" in citation["references"][0]["title"]


def test_the_changelog_has_an_entry_for_this_version() -> None:
    entries = re.findall(r"^## \[(.+?)\]", (ROOT / "CHANGELOG.md").read_text("utf-8"), re.M)
    assert entries[0] == "Unreleased"
    assert entries[1] == PROJECT["version"]
