"""Fixed cases keep the contract, and every command and option is among the cases."""

import signal
import sys

import pytest

from tests.fuzz import drawing, ready
from tests.fuzz.case import Case
from tests.fuzz.forks import Forks
from tests.fuzz.judge import _NEWS, findings
from tests.fuzz.strategies import commands

pytestmark = pytest.mark.skipif(sys.platform != "linux", reason="uses limits that Linux has")
SEED = 16
# Of these many need no ready results.
KINDS = ("odd field", "duplicate", "unfit", "own sea", "work")


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder of cases whose ready inputs are texts."""
    folder = tmp_path_factory.mktemp("fuzz")
    ready.write_texts(folder / "ready")
    return folder


@pytest.fixture
def ignored():
    """SIGINT is ignored, as in some jobs of a shell; cases have to heed it."""
    handler = signal.signal(signal.SIGINT, signal.SIG_IGN)
    yield
    signal.signal(signal.SIGINT, handler)


@pytest.mark.slow
@pytest.mark.brief
def test_fixed_cases_keep_the_contract(folder, ignored):
    drawn = [case for kind, _ in drawing.ROUND[-9:] for case in drawing.draw(kind, SEED, 20)]
    drawn = [case for case in drawn if case.kind in KINDS]
    cases = [drawn[n * len(drawn) // 50] for n in range(50)]
    assert {case.kind for case in cases} == {*KINDS}
    words = ("evaluate", "--scenario", f"../in/{ready.SCENARIO}", "--policy", "greedy")
    many, sent = ("--missions", "200000"), (0.5, int(signal.SIGINT))
    cases.append(Case("signal", (*words, *many), ready.INPUTS, signals=(sent,), code=130))
    outcomes = [outcome for _, outcome in Forks(folder).outcomes(enumerate(cases))]
    codes = {outcome.code for outcome in outcomes}
    assert 2 in codes
    assert codes & {0, 130}  # what has first to be compiled may be interrupted
    assert [(o.case.arguments, found) for o in outcomes if (found := findings(o))] == []


@pytest.mark.parametrize(
    "line",
    [
        "  2%|2         | 5/300 [00:10<09:50,  1.99s/tick, phase=harvest]",
        "tick:  40%|####      | 120/300 [00:10<00:15, 11.99tick/s]",
        "compiling:   0%|          | 0/300 [00:10<?, ?tick/s]",
        "57mission [1:00:10,  1.99mission/s]",
        "on this machine: 0.02 s a tick, about 2 minutes to go",
    ],
)
def test_progress_is_no_error(line):
    assert _NEWS.fullmatch(line.strip())


def test_a_line_that_names_a_path_is_no_progress():
    assert not _NEWS.fullmatch("interrupted: continue with dess study run 2/sweep --out 3/study")


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
    # Those of report are in strategies.reports; what is shown is one of the policies; tables of
    # nodes stand in scenarios, too; and a process is code of the user, which is run as it is.
    assert unread - commands.OUTPUTS == {"--results", "--shown", "--nodes", "--process"}
