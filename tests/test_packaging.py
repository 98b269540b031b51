"""The distribution: what a wheel holds, what it asks for, pinned versions, and what CI runs."""

import ast
import re
import shutil
import subprocess
import sys
from importlib.metadata import distributions
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml
from packaging.specifiers import SpecifierSet
from packaging.utils import canonicalize_name
from packaging.version import Version

from tests import release
from tests.distributions import EXTRAS, PROJECT, ROOT, asked, closure, homes, requirements
from tests.installed import built, environment, unpacked

CONSTRAINTS = ROOT / "constraints.txt"
ASKED = asked("test", "lint", "docs", "examples")
APART = {"test", "lint", "docs", "examples"}  # extras that ``all`` does not include


def pins(path: Path) -> dict[str, str]:
    """The exact versions in a file, by the canonical names of the distributions."""
    lines = [line for line in path.read_text("utf-8").splitlines() if not line.startswith("#")]
    pairs = [re.fullmatch(r"([\w.-]+)(?:\[[\w,]+\])?==([^\s=*]+)", line) for line in lines]
    assert all(pairs), path
    return {canonicalize_name(pair[1]): pair[2] for pair in pairs if pair}


def contents(archive: ZipFile) -> dict[str, bytes]:
    return {name: archive.read(name) for name in archive.namelist()}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """The wheel of this source tree."""
    return ZipFile(built("wheel", tmp_path_factory.mktemp("wheel")))


def test_the_wheel_holds_the_packages_with_all_their_files_and_nothing_else(wheel):
    held = set(wheel.namelist())
    assert release.faults_of_wheel(held, ROOT) == []
    folders = {name.split("/")[0] for name in held}
    assert {folder for folder in folders if not folder.endswith(".dist-info")} == {"dess"}


def test_files_that_a_release_lacks_and_caches_in_it_are_named():
    held = {*release.product_files(ROOT), *(path.name for path in ROOT.glob("LICENSE*"))}
    assert release.faults_of_sdist(held, ROOT) == []
    engine = next(name for name in held if name.endswith("engine.wasm"))
    faults = release.faults_of_sdist({*held, "tests/__pycache__/a.pyc"} - {engine}, ROOT)
    assert faults == [
        f"sdist: {engine} is missing",
        "sdist: engine.wasm is missing",
        "sdist: tests/__pycache__/a.pyc is not of the release",
    ]


def test_the_wheel_has_the_notice_of_the_coefficients_that_it_uses(wheel):
    [name] = [name for name in wheel.namelist() if name.endswith("licenses/LICENSE-fdlibm")]
    notice = wheel.read(name).decode().partition("\n\n")[2]
    source = wheel.read("dess/base/elementary.py").decode()
    assert "Sun Microsystems" in notice
    assert " ".join(notice.split()) in " ".join(source.split())


def test_the_wheel_has_the_attribution_of_the_weather_that_it_ships(wheel):
    [name] = [name for name in wheel.namelist() if name.endswith("licenses/LICENSE-era5")]
    notice = " ".join(wheel.read(name).decode().split())
    [shipped] = [name for name in wheel.namelist() if "/era5" in name]
    assert shipped in notice
    assert "contains modified Copernicus Climate Change Service information" in notice
    assert "CC BY 4.0" in notice


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """This source tree as an unpacked archive."""
    return unpacked(tmp_path_factory.mktemp("archive"))


@pytest.mark.slow
@pytest.mark.brief
def test_an_unpacked_archive_gives_the_same_wheel(tree, wheel, tmp_path):
    assert (tree / "dess/policies").read_text("utf-8") == "../policies"
    theirs = ZipFile(built("wheel", tmp_path, tree))
    assert contents(theirs) == contents(wheel)


USE = """
from dess.base.sources import code_of
from dess.reports.pages import kernels

print(kernels.PACKAGES, "dess.policies.network" in code_of("dess.policies.registry"))
"""


@pytest.mark.slow
@pytest.mark.brief
def test_an_unpacked_archive_runs_in_place(tree, tmp_path):
    """Its folders are found without the links, also in an editable installation."""
    editable = contents(ZipFile(built("wheel:editable", tmp_path, tree)))
    [path] = [name for name in editable if ".dist-info/" not in name]
    assert path.endswith(".pth") and editable[path].decode() == str(tree)
    variables = environment(tmp_path) | {"PYTHONPATH": str(tree)}
    for command in (("-m", "dess", "policies"), ("-c", USE)):
        done = subprocess.run(
            [sys.executable, *command], cwd=tmp_path, env=variables, capture_output=True, text=True
        )
        assert done.returncode == 0, done.stderr
    assert done.stdout.split() == [str(tree), "True"]


def test_a_copy_of_dess_alone_is_not_built(tmp_path):
    for name in ("pyproject.toml", "hatch_build.py", "README.md", "LICENSE"):
        shutil.copy(ROOT / name, tmp_path)
    shutil.copytree(ROOT / "dess", tmp_path / "dess", symlinks=True)
    for kind in ("wheel", "sdist"):
        command = [sys.executable, "-m", "hatchling", "build", "-t", kind]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode == 1
        assert "no policies and no analysis and no reports; allowed: the whole" in done.stderr
        assert done.stderr.count("\n") == 1
    assert not (tmp_path / "dist").exists() or not [*(tmp_path / "dist").iterdir()]


def test_every_library_that_is_imported_is_asked_for():
    imported = {
        (node.module if isinstance(node, ast.ImportFrom) else alias.name).split(".")[0]
        for folder in release.FOLDERS
        for path in (ROOT / folder).rglob("*.py")
        if path.parent.name != "integrations"  # the libraries of these modules are the user's
        for node in ast.walk(ast.parse(path.read_text("utf-8")))
        if isinstance(node, ast.Import | ast.ImportFrom)
        for alias in node.names
    }
    outside = imported - set(sys.stdlib_module_names) - {"dess"}
    found = homes()
    wanted = {home for name in outside for home in found.get(name, {canonicalize_name(name)})}
    assert not wanted - set(requirements(*asked("all")))


def test_requirements_and_what_they_require_are_pinned_within_their_ranges():
    pinned, wanted, needed = pins(CONSTRAINTS), requirements(*ASKED), closure(*ASKED)
    assert len(needed) > len(wanted)
    assert needed | set(wanted) <= set(pinned)
    for name, requirement in wanted.items():
        assert requirement.specifier.contains(pinned[name]), name


def test_pins_run_on_the_oldest_python_that_is_promised():
    """Here are the pinned versions, as far as they are installed, so their metadata says it."""
    oldest = PROJECT["requires-python"].removeprefix(">=")
    here = {canonicalize_name(d.metadata["Name"]): d for d in distributions()}
    assert here.keys() >= requirements(*asked("test")).keys()
    for name, pin in pins(CONSTRAINTS).items():
        if name in here:
            # Absent is a KeyError where the backport of importlib.metadata has found the package.
            needed = SpecifierSet(here[name].metadata.get("Requires-Python") or "")
            assert (Version(here[name].version).public, needed.contains(oldest)) == (pin, True), (
                name
            )


def test_all_and_the_tests_have_every_extra_that_adds_something():
    everything = {line for extra in EXTRAS.keys() - APART for line in asked(extra)}
    assert set(asked("all")) == everything
    assert everything <= set(asked("test"))


def test_the_project_is_one_version_of_one_date_and_licence():
    assert release.disagreements(ROOT) == []
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text("utf-8"))
    assert "Multi-UAV Trajectory Optimizer" in citation["references"][0]["title"]


@pytest.mark.parametrize(
    ("name", "line", "other", "found"),
    [
        ("pyproject.toml", r"^version = .*", 'version = "9.9"', "version: 9.9 and"),
        ("CITATION.cff", r"^version: .*", "version: 9.9.9", "version: "),
        (
            "CITATION.cff",
            r"^date-released: .*",
            "date-released: 2020-02-02",
            "date: 2020-02-02 and",
        ),
        ("CITATION.cff", r"^license: .*", "license: ISC", "licence: MIT and ISC;"),
        ("CHANGELOG.md", r"^## \[\d", "## [9", "version: "),
        ("LICENSE", r"\A.*", "ISC License", "licence: MIT and ISC;"),
    ],
)
def test_a_version_date_or_licence_that_differs_is_found(tmp_path, name, line, other, found):
    for file in ("pyproject.toml", "CITATION.cff", "CHANGELOG.md", "LICENSE"):
        shutil.copy(ROOT / file, tmp_path)
    text, count = re.subn(line, other, (tmp_path / name).read_text("utf-8"), count=1, flags=re.M)
    assert count == 1
    (tmp_path / name).write_text(text, "utf-8")
    [disagreement] = release.disagreements(tmp_path)
    assert disagreement.startswith(found)


def test_ci_runs_every_nox_session():
    defined = re.findall(r"^@nox\.session.*\ndef (\w+)", (ROOT / "noxfile.py").read_text(), re.M)
    lines = re.findall(r"^ *nox .*-s ([\w ]+?)(?: --|$)", (ROOT / ".ci/run").read_text(), re.M)
    assert {"tests", "verify", "fuzz"} <= set(defined)
    apart = {"release"}  # up to an hour, for who releases
    assert sorted(" ".join(lines).split()) == sorted({*defined} - apart)


def test_the_hooks_before_a_commit_are_what_lint_runs():
    lint = (ROOT / "noxfile.py").read_text("utf-8").split("def lint(")[1].split("@nox")[0]
    commands = [words.replace('", "', " ") for words in re.findall(r'session\.run\("(.+)"\)', lint)]
    config = yaml.safe_load((ROOT / ".pre-commit-config.yaml").read_text("utf-8"))
    assert [hook["entry"] for hook in config["repos"][0]["hooks"]] == commands


def test_the_workflow_runs_every_python_that_is_promised():
    jobs = yaml.safe_load((ROOT / ".github/workflows/tests.yml").read_text("utf-8"))["jobs"]
    pythons = jobs["all-sessions"]["strategy"]["matrix"]["python"]
    claimed = re.findall(r"Python :: (3\.\d+)", " ".join(PROJECT["classifiers"]))
    assert pythons[0] == PROJECT["requires-python"].removeprefix(">=")
    assert {*claimed} <= {*pythons}
