"""What ``.ci/run`` runs: every nox session."""

import re

from tests.distributions import ROOT


def test_ci_runs_every_nox_session() -> None:
    defined = re.findall(r"^@nox\.session.*\ndef (\w+)", (ROOT / "noxfile.py").read_text(), re.M)
    lines = re.findall(r"^\S*nox .*-s ([\w ]+?)(?: --|$)", (ROOT / ".ci/run").read_text(), re.M)
    assert {"tests", "verify", "fuzz"} <= set(defined)
    assert sorted(" ".join(lines).split()) == sorted(defined)
