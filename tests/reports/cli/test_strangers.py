"""Studies, results and pages that a stranger made never run code, and are refused in one line."""

import json
import shutil
from pathlib import Path

import pytest

from dess.analysis.answers.diff import at_hand
from dess.analysis.results.evidence import Evidence
from dess.analysis.results.tables import load_results
from dess.reports.cli import main
from dess.reports.pages.page import Page
from dess.reports.pages.provenance import evidence_tables
from tests.analysis.hostile import hostile_folder
from tests.analysis.small import small_study

HOVER = """
class Evil0:
    name = "hover"

    def act(self, view):
        return [4] * len(view)


Evil1 = Evil0
"""


@pytest.fixture(scope="module")
def sound(studied):
    """Small results with event logs."""
    return studied(logged=1).store.folder


@pytest.fixture
def stranger(sound, tmp_path, monkeypatch):
    """Files whose policies are classes of a Python file that leaves a trace when it is run."""
    monkeypatch.chdir(tmp_path)
    small_study(tmp_path, policies=["greedy"])
    Path("evil_policy.py").write_text("open('trace', 'w').close()\n" + HOVER)
    Path("study.toml").write_text('scenario = "small.toml"\npolicies = ["evil_policy.py:Evil0"]\n')
    results = load_results(hostile_folder(sound, tmp_path / "results", "evil_policy.py:Evil"))
    Path("page.html").write_text(page_of(Evidence.of(results)), "utf-8")
    return tmp_path


def page_of(*evidence: Evidence) -> str:
    """A page with nothing but evidence, whose checksum is right."""
    seal = '<meta name="dess-checksum" content="">'
    return Page(seal + evidence_tables(evidence).data).sealed.text


def printed(capsys: pytest.CaptureFixture[str]) -> str:
    """The last line on stderr, which must be the only one on the error."""
    return capsys.readouterr().err.strip().splitlines()[-1]


@pytest.mark.parametrize(
    "command",
    [
        "study run study.toml --out out",
        "study run study.toml --dry-run",
        "studies show study.toml",
        "simulate --of one",
        "verify page.html",
        "verify results",
    ],
)
def test_a_python_file_that_only_data_name_is_not_run(command, stranger, capsys):
    manifest = json.loads(Path("results/manifest.json").read_text())
    for name in ("policies", "missions", "selected"):
        del manifest[name][1:]
    del manifest["study"]["policies"][1:]
    Path("one").mkdir()
    Path("one/manifest.json").write_text(json.dumps(manifest))
    assert main(command.split()) == 2
    line = printed(capsys)
    assert "evil_policy.py:Evil0" in line and len(line) <= 300
    assert not Path("trace").exists()


@pytest.mark.parametrize("command", ["study show results", "study show results --json"])
def test_results_of_a_python_file_are_shown_without_running_it(command, stranger, capsys):
    assert main(command.split()) == 0
    assert "evil_policy.py:Evil0" in capsys.readouterr().out
    assert "a Python file that was not read, of policy evil_policy" in at_hand(
        load_results("results")
    )
    assert not Path("trace").exists()


def test_a_python_file_is_run_once_the_user_names_it(sound, tmp_path, monkeypatch, capsys):
    """The file has a name of its own, because a process keeps the modules that it has imported."""
    monkeypatch.chdir(tmp_path)
    small_study(tmp_path, policies=["greedy"])
    Path("mine_policy.py").write_text(HOVER)
    policy = ["--policy", "mine_policy.py:Evil0"]
    assert main(["study", "run", "trial.toml", "--out", "out", *policy]) == 0
    assert main(["verify", "out"]) == 2
    assert "allowed: --policy FILE.py:CLASS" in printed(capsys)
    assert main(["verify", "out", *policy]) == 0
    assert main(["simulate", "--of", "out", *policy]) == 0
    assert "note" not in capsys.readouterr().err
    shutil.rmtree("out")


@pytest.mark.parametrize("copies", [1, 30])
def test_a_page_whose_missions_would_take_hours_is_refused_at_once(copies, sound, tmp_path, capsys):
    evidence = Evidence.of(load_results(sound)).data
    slots = 100_000 if copies == 1 else 20_000
    evidence["scenario"] |= {"max_slots": slots, "communication_slots": 64, "quota": 1_000_000}
    text = page_of(Evidence.parse(json.dumps(evidence), "page", ""))
    names = (f'"name": "trial-{number}"' for number in range(copies))
    page = tmp_path / "page.html"
    page.write_text("".join(text.replace('"name": "trial"', name) for name in names), "utf-8")
    assert main(["verify", str(page)]) == 2
    line = printed(capsys)
    assert "20 missions to simulate, about" in line and "allowed: --yes" in line
    assert len(line) <= 300


def test_a_page_that_no_memory_holds_is_not_read(tmp_path, capsys):
    with (tmp_path / "page.html").open("wb") as page:
        page.truncate(2**40)
    assert main(["verify", str(tmp_path / "page.html")]) == 2
    assert "is too large" in printed(capsys)
