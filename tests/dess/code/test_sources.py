"""Hashes of code: statements count, comments and docstrings do not."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dess.code.sources import code_of, combined

ROOT = Path(__file__).parents[3]
ENGINES = ("dess.batch", "dess.mission")


@pytest.fixture
def tree(tmp_path: Path) -> Path:
    """A copy of the sources of ``dess`` and ``policies``."""
    for package in ("dess", "policies"):
        shutil.copytree(ROOT / package, tmp_path / package, ignore=shutil.ignore_patterns("__pyc*"))
    return tmp_path


def hashes(tree: Path, *modules: str) -> dict[str, str]:
    """``code_of`` the modules of a source tree, by a process of its own."""
    script = "import json, sys; from dess.code.sources import code_of; "
    script += "print(json.dumps(code_of(*sys.argv[1:])))"
    command = [sys.executable, "-c", script, *modules]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=True, env={})
    return json.loads(done.stdout)


def edit(path: Path, old: str, new: str) -> None:
    text = path.read_text("utf-8")
    assert text.count(old) == 1
    path.write_text(text.replace(old, new), "utf-8")


def test_comments_and_docstrings_change_nothing(tree: Path) -> None:
    before = hashes(tree, *ENGINES, "policies.heuristics")
    for name in ("dess/rules.py", "dess/env/render.py", "dess/observations/guard.py"):
        path = tree / name
        path.write_text(f"# A comment.\n\n{path.read_text('utf-8')}\n# And another.\n", "utf-8")
    text = (tree / "dess/rules.py").read_text("utf-8")
    (tree / "dess/rules.py").write_text(text.replace('    """', '    """Now: ', 1), "utf-8")
    assert hashes(tree, *ENGINES, "policies.heuristics") == before


def test_a_constant_changes_its_module_alone(tree: Path) -> None:
    before = hashes(tree, *ENGINES)
    edit(tree / "dess/state.py", "HOVER = ", "HOVER = 1 + ")
    after = hashes(tree, *ENGINES)
    assert {name for name in before if before[name] != after[name]} == {"dess.state"}
    assert combined(before) != combined(after)


def test_what_engines_do_not_import_does_not_count() -> None:
    code = code_of(*ENGINES)
    assert {"dess.rules", "dess.channel", "dess.scenario"} <= code.keys()
    assert not [name for name in code if name.startswith(("dess.env", "policies", "numpy"))]


def test_imports_of_all_forms_are_followed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    package = tmp_path / "pack" / "inner"
    package.mkdir(parents=True)
    (tmp_path / "pack" / "__init__.py").write_text("LIMIT = 1\n")
    (package / "__init__.py").write_text("")
    (package / "brain.py").write_text("from . import near\nfrom ..far import x\n")
    (package / "near.py").write_text("def late():\n    from pack import LIMIT\n")
    (tmp_path / "pack" / "far.py").write_text("import numpy\nimport pack.deep as deep\n")
    (tmp_path / "pack" / "deep.py").write_text("")
    (tmp_path / "pack" / "unused.py").write_text("")
    monkeypatch.syspath_prepend(tmp_path)
    followed = ["pack", "pack.deep", "pack.far", "pack.inner.brain", "pack.inner.near"]
    assert list(code_of("pack.inner.brain")) == followed
