"""The judge finds planted faults, and finds nothing in commands that keep the contract."""

import sys

import pytest

from reports.pages.notebook import NAMES
from tests.fuzz import drawing, ready
from tests.fuzz.case import Case
from tests.fuzz.forks import Forks
from tests.fuzz.judge import findings
from tests.fuzz.planted import FAULTS, LASTING
from tests.fuzz.planted import main as planted
from tests.fuzz.steps import Bytes, Json, Node, Write
from tests.fuzz.strategies import commands
from tests.fuzz.strategies.changes import NODES

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="uses limits that Linux has")
SEED = 16
KINDS = ("odd field", "duplicate", "unfit", "work")  # of which many need no ready results


@pytest.fixture(scope="module")
def ready_texts(tmp_path_factory):
    folder = tmp_path_factory.mktemp("ready") / "ready"
    ready.write_texts(folder)
    return folder


def test_planted_faults_are_found(tmp_path, ready_texts):
    forks = Forks(tmp_path, ready_texts, planted)
    steps = (Write("in/a.toml", b""), Node("out/device", "fifo"))
    cases = [
        Case("planted", (fault.__name__,), steps, *((10, 1.5) if fault in LASTING else (2,)))
        for fault in FAULTS
    ]
    found = {number: findings(outcome) for number, outcome in forks.outcomes(enumerate(cases))}
    for number, (fault, words) in enumerate(FAULTS.items()):
        assert any(words in line for line in found[number]), (fault.__name__, found[number])
    only = {number for number, lines in found.items() if len(lines) == 1}
    assert len(only) >= len(FAULTS) - 1, found  # a fault breaks one rule, or little more


def test_fixed_cases_keep_the_contract(tmp_path, ready_texts):
    drawn = [case for kind, _ in drawing.ROUND[-7:] for case in drawing.draw(kind, SEED, 20)]
    cases = [case for case in drawn if case.kind in KINDS][:50]
    assert len(cases) == 50
    outcomes = [outcome for _, outcome in Forks(tmp_path, ready_texts).outcomes(enumerate(cases))]
    assert {outcome.code for outcome in outcomes} >= {0, 2}
    assert [(o.case.arguments, found) for o in outcomes if (found := findings(o))] == []


def test_every_parameter_of_every_command_is_known():
    """A new command or option needs a plain value, and the kinds of inputs that it reads."""
    unknown = [
        commands.name_of(words, parameter)
        for words, parameters in commands.COMMANDS
        for parameter in parameters
        if not commands.is_flag(parameter) and not commands.plain(words, parameter)
    ]
    assert unknown == []
    files = ("FILE", "DIR", "PAGE", "P[,P...]", "P,P,...")
    unread = [
        commands.name_of(words, parameter)
        for words, parameters in commands.COMMANDS
        for parameter in parameters
        if any(word in (parameter.metavar or "") for word in files)
        and not commands.kinds_of(words, parameter)
    ]
    assert {*unread} - commands.OUTPUTS == {"--results"}  # of report: see strategies.reports


def test_a_round_has_every_command_and_every_report():
    drawn = [case for kind, _ in drawing.ROUND for case in drawing.draw(kind, SEED, 1)]
    lines = [" ".join(case.arguments) for case in drawn]
    names = {" ".join(words) for words, _ in commands.COMMANDS}
    assert not [name for name in names if not any(line.startswith(name) for line in lines)]
    asked = " ".join(" ".join(case.arguments) for case in drawn if case.kind == "report")
    assert not [name for name in NAMES if f" {name}" not in asked]


@pytest.mark.parametrize("kind", NODES)
def test_steps_neither_read_nor_write_what_is_no_file(kind, tmp_path, ready_texts):
    Node("in/manifest.json", kind).do(tmp_path, ready_texts)
    edits = ((0, "replace", "1"),)
    for step in (Json("in/manifest.json", edits), Bytes("in/manifest.json", ((0, b"a"),))):
        with pytest.raises((OSError, ValueError)):
            step.do(tmp_path, ready_texts)
    if kind != "dangling":  # a new file, where the link leads to
        with pytest.raises((OSError, ValueError)):
            Write("in/manifest.json", b"a").do(tmp_path, ready_texts)


def test_cases_depend_on_their_seed_and_number_only():
    kind, most = drawing.ROUND[0][0], 20
    assert drawing.draw(kind, 1, most) == drawing.draw(kind, 1, most)
    assert drawing.draw(kind, 1, most) != drawing.draw(kind, 2, most)
    some = [next(drawing.cases(1, number)) for number in (0, 3)]
    assert [number for number, _ in some] == [0, 3]
    assert next(drawing.cases(1, 3)) == some[1] != some[0]
