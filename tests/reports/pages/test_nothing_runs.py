"""Nothing in a results folder is ever code: neither for notebooks, nor for their templates."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from reports.cli import main
from reports.pages.render import render
from tests.reports.pages.test_render import MISSION, results, write_notebooks

__all__ = ["results"]

# What Python, IPython, Jupyter and the libraries would import or run in a working directory.
MODULES = ("pandas", "ipykernel_launcher", "sitecustomize", "matplotlib", "joblib")
STARTUP = ".ipython/profile_default/startup/00.py"
CONFIGS = ("ipython_config", "ipython_kernel_config", "jupyter_config")
TEMPLATES = ("index.html.j2", "base.html.j2", "base/null.j2")


@pytest.fixture
def trap(results: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The results folder, with files that would run; the working directory."""
    for name in (*(f"{module}.py" for module in (*MODULES, *CONFIGS)), STARTUP):
        file = results / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text(f"open({str(results / 'hit')!r}, 'a').write({name!r})\n")
    for name in TEMPLATES:
        file = results / "basic" / name
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_text("the template of a stranger")
    (results / "matplotlibrc").write_text("this is no setting\n")
    monkeypatch.chdir(results)
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    return results


def test_a_page_runs_nothing_of_the_results_folder(trap: Path, tmp_path: Path, caplog) -> None:
    """The results folder is the working directory as well."""
    notebooks = write_notebooks(tmp_path / "notebooks", mission=MISSION)
    index = render(["mission"], ".", tmp_path / "out", notebooks=notebooks)
    assert not (trap / "hit").exists()
    assert "of a stranger" not in (index.parent / "mission.html").read_text("utf-8")
    assert "matplotlibrc" not in caplog.text


def test_processes_of_a_command_import_nothing_from_the_working_directory(
    trap: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def start_a_process(*_: Any, **__: Any) -> int:
        return subprocess.run([sys.executable, "-c", "import joblib"], check=True).returncode

    monkeypatch.setattr("reports.cli.commands.app", start_a_process)
    assert main([]) == 0
    assert not (trap / "hit").exists()
    assert "PYTHONSAFEPATH" not in os.environ


def test_the_command_imports_nothing_from_the_working_directory(trap: Path) -> None:
    (trap / "typer.py").write_text((trap / "joblib.py").read_text())
    root = Path(__file__).parents[3]
    environment = os.environ | {"PYTHONPATH": str(root)}
    command = [sys.executable, "-m", "reports", "--version"]
    subprocess.run(command, check=True, env=environment)
    assert not (trap / "hit").exists()
