"""Hashes of code: statements count, comments and docstrings do not."""

import json
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from dess.base.sources import code_of, combined

ROOT = Path(__file__).parents[3]
ENGINES = ("dess.model.batch", "dess.model.mission")


@pytest.fixture
def tree(tmp_path):
    """A copy of the sources."""
    shutil.copytree(ROOT / "dess", tmp_path / "dess", ignore=shutil.ignore_patterns("__pyc*"))
    return tmp_path


def hashes(tree: Path, *modules: str) -> dict[str, str]:
    """``code_of`` the modules of a source tree, by a process of its own."""
    script = "import json, sys; from dess.base.sources import code_of; "
    script += "print(json.dumps(code_of(*sys.argv[1:])))"
    command = [sys.executable, "-c", script, *modules]
    done = subprocess.run(command, cwd=tree, capture_output=True, text=True, check=True, env={})
    return json.loads(done.stdout)


def test_comments_and_docstrings_change_nothing(tree):
    before = hashes(tree, *ENGINES)
    path = tree / "dess/model/rules.py"
    text = path.read_text("utf-8").replace('    """', '    """Now: ', 1)
    path.write_text(f"# A comment.\n\n{text}\n# And another.\n", "utf-8")
    assert hashes(tree, *ENGINES) == before


def test_a_constant_changes_its_module_alone(tree):
    before, path = hashes(tree, *ENGINES), tree / "dess/model/state.py"
    path.write_text(path.read_text("utf-8").replace("HOVER = ", "HOVER = 1 + ", 1), "utf-8")
    after = hashes(tree, *ENGINES)
    assert {name for name in before if before[name] != after[name]} == {"dess.model.state"}
    assert combined(before) != combined(after)


def test_what_engines_do_not_import_does_not_count():
    code = code_of(*ENGINES)
    assert {"dess.model.rules", "dess.model.channel", "dess.scenario.scenario"} <= code.keys()
    assert not [name for name in code if name.startswith(("dess.envs", "dess.policies", "numpy"))]


def test_imports_of_all_forms_are_followed(tmp_path, monkeypatch):
    sources = {
        **{"__init__": "LIMIT = 1", "deep": "", "unused": "", "inner/__init__": ""},
        "far": "import numpy\nimport pack.deep as deep",
        "inner/brain": "from . import near\nfrom ..far import x",
        "inner/near": "def late():\n    from pack import LIMIT",
    }
    (tmp_path / "pack" / "inner").mkdir(parents=True)
    for name, text in sources.items():
        (tmp_path / "pack" / f"{name}.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    followed = ["pack", "pack.deep", "pack.far", "pack.inner.brain", "pack.inner.near"]
    assert list(code_of("pack.inner.brain")) == followed
