"""An installed ``dess``, without the repository: the wheel, the sdist, and their commands."""

import shutil
import subprocess
import sys
from pathlib import Path
from zipfile import ZipFile

import pytest

from tests.analysis.small import small_study
from tests.distributions import PROJECT
from tests.installed import ROOT, built, environment, install


def run(*command: object, folder: Path) -> str:
    """What a command prints in a folder that is also its home."""
    words, variables = [str(word) for word in command], environment(folder)
    done = subprocess.run(words, cwd=folder, env=variables, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def check_commands(dess: Path, folder: Path) -> None:
    """Run a study and render its page, from a folder that has modules with names of ours."""
    small_study(folder, missions=4)
    for name in ("policies.py", "analysis/__init__.py", "reports/__init__.py"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).write_text("raise AssertionError('not ours')", "utf-8")
    script = "import dess, dess.reports as r; print(dess.__version__, dess.__file__, r.__file__)"
    version, *files = run(dess.with_name("python"), "-c", script, folder=folder).split()
    assert version == PROJECT["version"]
    assert all(Path(file).is_relative_to(dess.parents[1]) for file in files)
    command = ("-m", "dess", "study", "run", "trial.toml", "--out", "trial")
    run(dess.with_name("python"), *command, folder=folder)
    page = folder / run(dess, "report", "./trial", folder=folder).strip()
    assert "trial" in page.read_text("utf-8")
    assert str(ROOT) not in page.read_text("utf-8")


@pytest.mark.slow
@pytest.mark.brief
def test_the_wheel_runs_without_the_repository(installed, tmp_path):
    check_commands(installed, tmp_path)


def test_a_copy_of_dess_alone_says_what_is_missing(tmp_path):
    shutil.copytree(ROOT / "dess", tmp_path / "dess", symlinks=True)
    simulate = "import dess; dess.simulate(dess.load_scenario('paper'), 'greedy', seed=1)"
    for command in (["-m", "dess", "policies"], ["-c", simulate]):
        command = [sys.executable, *command]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True)
        assert done.returncode
        assert "without policies and analysis and reports; allowed:" in done.stderr.splitlines()[-1]
        assert "ModuleNotFoundError" not in done.stderr
        assert ("Traceback" in done.stderr) == ("-c" in command)  # Python's own, of the script


@pytest.mark.slow
def test_the_sdist_builds_the_same_wheel(tmp_path):
    shutil.unpack_archive(built("sdist", tmp_path / "sdist"), tmp_path)
    [source] = tmp_path.glob("dess-*")
    ours, theirs = (built("wheel", tmp_path / to, at) for to, at in (("a", ROOT), ("b", source)))
    assert ours.name == theirs.name
    with ZipFile(ours) as a, ZipFile(theirs) as b:
        assert {n: a.read(n) for n in a.namelist()} == {n: b.read(n) for n in b.namelist()}


@pytest.mark.slow
def test_a_wheel_with_everything_runs_in_an_empty_environment(tmp_path):
    dess, folder = install_wheel(tmp_path, "[all]") / "dess", tmp_path
    check_commands(dess, folder)
    [page] = folder.glob("build/reports/*trial.html")
    run(dess, "verify", page, folder=folder)
    asked = ("--set", "uavs=2", "--parameter", "missions=8", "--parameter", "policies=['greedy']")
    run(dess, "report", "what-if", *asked, folder=folder)
    assert "ddqn" in run(dess, "policies", folder=folder)
    assert "success" in run(dess, "simulate", "--policy", "ddqn", folder=folder)


def install_wheel(folder: Path, extras: str = "") -> Path:
    """Install the wheel with its pinned libraries, as pip does it; the folder of its commands."""
    wheel = built("wheel", folder / "wheel")
    return install(folder / "venv", f"{wheel}{extras}", "-c", str(ROOT / "constraints.txt"))
