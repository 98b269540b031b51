"""The judge finds planted faults, and finds nothing in commands that keep the contract."""

import sys

import pytest

from dess.reports.pages.notebook import NAMES
from tests.fuzz import drawing, ready
from tests.fuzz.case import Case
from tests.fuzz.forks import Forks
from tests.fuzz.judge import findings
from tests.fuzz.planted import FAULTS, LASTING
from tests.fuzz.planted import main as planted
from tests.fuzz.steps import change_bytes, change_json, node, rename, write
from tests.fuzz.strategies import commands
from tests.fuzz.strategies.changes import NODES

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="uses limits that Linux has")
SEED = 16
KINDS = ("odd field", "duplicate", "unfit", "work")  # of which many need no ready results


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of cases whose ready inputs are texts."""
    folder = tmp_path_factory.mktemp("fuzz")
    ready.write_texts(folder / "ready")
    return folder


@pytest.fixture
def box(folder):
    """The folder of a case."""
    (folder / "cases" / "box").mkdir(parents=True, exist_ok=True)
    return folder / "cases" / "box"


@pytest.mark.slow
def test_planted_faults_are_found(folder):
    steps = (write("in/a.toml", b""), node("out/device", "fifo"))
    cases = [Case("planted", (fault,), steps, seconds=2) for fault in FAULTS]
    cases += [Case("planted", (fault,), steps, seconds=10, lasting=1.5) for fault in LASTING]
    found = {
        n: findings(outcome) for n, outcome in Forks(folder, planted).outcomes(enumerate(cases))
    }
    for number, (fault, words) in enumerate((FAULTS | LASTING).items()):
        assert any(words in line for line in found[number]), (fault, found[number])
    only = {number for number, lines in found.items() if len(lines) == 1}
    assert len(only) >= len(cases) - 1, found  # a fault breaks one rule, or little more


@pytest.mark.slow
@pytest.mark.brief
def test_fixed_cases_keep_the_contract(folder):
    drawn = [case for kind, _ in drawing.ROUND[-8:] for case in drawing.draw(kind, SEED, 20)]
    drawn = [case for case in drawn if case.kind in KINDS]
    cases = [drawn[n * len(drawn) // 50] for n in range(50)]
    assert {case.kind for case in cases} == {*KINDS}
    outcomes = [outcome for _, outcome in Forks(folder).outcomes(enumerate(cases))]
    codes = {outcome.code for outcome in outcomes}
    assert 2 in codes
    assert codes & {0, 130}  # what has first to be compiled may be interrupted
    assert [(o.case.arguments, found) for o in outcomes if (found := findings(o))] == []


def test_every_parameter_of_every_command_is_known():
    """A new command or option needs a plain value, and the kinds of inputs that it reads."""
    known = [(words, parameter) for words, all_ in commands.COMMANDS for parameter in all_]
    assert all(commands.is_flag(p) or commands.plain(words, p) for words, p in known)
    files = ("FILE", "DIR", "PAGE", "P[,P...]", "P,P,...")
    unread = {
        commands.name_of(words, parameter)
        for words, parameter in known
        if any(word in (parameter.metavar or "") for word in files)
        and not commands.kinds_of(words, parameter)
    }
    # Those of report are in strategies.reports; what is shown is one of the policies; and tables of
    # nodes stand in scenarios, too.
    assert unread - commands.OUTPUTS == {"--results", "--shown", "--nodes"}


def test_a_round_has_every_command_and_every_report():
    drawn = [case for kind, _ in drawing.ROUND for case in drawing.draw(kind, SEED, 1)]
    lines = [" ".join(case.arguments) for case in drawn]
    names = {" ".join(words) for words, _ in commands.COMMANDS}
    assert not [name for name in names if not any(line.startswith(name) for line in lines)]
    asked = " ".join(line for line, case in zip(lines, drawn, strict=True) if case.kind == "report")
    assert not [name for name in NAMES if f" {name}" not in asked]


@pytest.mark.parametrize("kind", NODES)
def test_steps_neither_read_nor_write_what_is_no_file(kind, box):
    node("in/manifest.json", kind).do(box)
    refused = [
        change_json("in/manifest.json", ((0, "replace", "1"),)),
        change_bytes("in/manifest.json", ((0, b"a"),)),
    ]
    if kind != "dangling":  # a new file, where the link leads to
        refused.append(write("in/manifest.json", b"a"))
    for step in refused:
        with pytest.raises((OSError, ValueError)):
            step.do(box)
    rename("in", 0, "\0").do(box)  # no such name is possible, so it is removed
    assert not [*(box / "in").iterdir()]


def test_cases_depend_on_their_seed_and_number_only(monkeypatch):
    kind, most = drawing.ROUND[0][0], 20
    monkeypatch.setattr(drawing, "ROUND", ((kind, 2), (drawing.duplicates(), 2)))
    monkeypatch.setattr(drawing, "LENGTH", 4)
    assert drawing.draw(kind, 1, most) == drawing.draw(kind, 1, most)
    assert drawing.draw(kind, 1, most) != drawing.draw(kind, 2, most)
    some = [next(drawing.cases(1, number)) for number in (0, 7)]
    assert [number for number, _ in some] == [0, 7]
    assert next(drawing.cases(1, 7)) == some[1] != some[0]
