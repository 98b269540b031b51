"""The help, and the names that commands accept."""

import subprocess
import sys

from policies.registry import trained_names
from tests.analysis.small import environment


def test_names_are_listed(dess):
    for command, names in {
        "policies": ["random", "nearest", "greedy", "tour", *trained_names()],
        "scenarios": ["bay", "fig1", "fig4", "paper"],
        "studies": [
            *("charge-limits", "comparison", "explorer", "fig1", "fig4", "fig5", "precise"),
            *("screening", "sensitivity", "sweet-spot", "table4", "verification"),
        ],
    }.items():
        code, out, err = dess(command)
        assert (code, err) == (0, "")
        assert [line.split()[0] for line in out.splitlines()] == names


def test_the_help_imports_nothing_heavy():
    script = (
        "import sys; from reports.cli import main; code = main(['--help']); "
        "heavy = {'numpy', 'numba', 'pandas', 'pyarrow', 'scipy', 'pydantic', 'matplotlib', "
        "'torch'}; print(*heavy & set(sys.modules), end='', file=sys.stderr); sys.exit(code)"
    )
    command = [sys.executable, "-c", script]
    done = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert (done.returncode, done.stderr) == (0, "")
    for command in ("simulate", "evaluate", "study", "report", "policies", "scenarios", "studies"):
        assert f"  {command}" in done.stdout
