"""Cases that start further processes: kernels, workers, a scheduler that is not there; signals."""

import signal
from collections.abc import Sequence
from dataclasses import replace

from hypothesis import strategies as st

from dess.reports.pages.notebook import NAMES
from tests.fuzz import ready
from tests.fuzz.case import Case
from tests.fuzz.strategies.commands import READING, line
from tests.fuzz.strategies.forged import forged
from tests.fuzz.strategies.reports import reports

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
_SEA = ("--scenario", f"../in/{ready.SCENARIO}")
_RUN = ("study", "run", f"../in/{ready.STUDY}", "--out", "../out/a")
_MANY = ("--missions", "5000")
_WORKING = ((*_RUN, "--workers", "2"), (*_RUN, "--workers", "2", *_MANY))
_COMMANDS = (
    ("evaluate", "--policy", "greedy", "--missions", "20", "--workers", "2"),
    (*_RUN, "--scheduler", "tcp://127.0.0.1:1"),
    (*_RUN, "--scheduler", "tls://127.0.0.1:1"),
    line(("sweep",)),
    line(("report",)),
)
_PAGES = [(words, p) for words, p in READING if words in (("report",), ("study", "export"))]


_SHORT = (  # what a signal may meet at once, besides studies
    ("simulate", *_SEA, "--animation", "../out/a.gif"),
    ("evaluate", *_SEA, "--policy", "greedy", "--missions", "200000"),
    ("evaluate", *_SEA, "--policy", "greedy", "--missions", "3000", "--engine", "events"),
    ("train", f"../in/{ready.TRAINING}", "--out", "../out/a"),
    ("verify", f"../in/{ready.RESULTS}"),
)


@st.composite
def dear(draw: st.DrawFn) -> Case:
    """A page of changed results, workers that are killed, or a command that may get a signal."""
    what = draw(st.sampled_from(["page", "report", "killed", "signal"]))
    if what in ("page", "report"):
        page = forged(*draw(st.sampled_from(_PAGES)))
        drawn = page if what == "page" else reports(draw(st.sampled_from(NAMES)))
        return replace(draw(drawn), kind="dear", seconds=240, kernels=True)
    again = what == "killed"
    words = draw(st.sampled_from(_WORKING if again else (*_WORKING, *_COMMANDS)))
    sent = _sent(0.5, 10, [signal.SIGKILL] if again else _SIGNALS)
    signals = tuple(draw(st.lists(sent, max_size=1)))
    return Case("dear", words, ready.INPUTS, 240, signals=signals, again=again, kernels=True)


@st.composite
def signals(draw: st.DrawFn) -> Case:
    """One or two signals to a command; a killed study is completed by the same command."""
    is_study = draw(st.booleans())
    words = draw(st.sampled_from([_RUN, (*_RUN, *_MANY)] if is_study else _SHORT))
    sent = _sent(0.02, 1.0, [*_SIGNALS, signal.SIGKILL] if is_study else _SIGNALS)
    chosen = tuple(sorted(draw(st.lists(sent, min_size=1, max_size=2))))
    return Case("signal", words, ready.INPUTS, signals=chosen, again=is_study)


def _sent(
    first: float, last: float, numbers: Sequence[signal.Signals]
) -> st.SearchStrategy[tuple[float, int]]:
    """A moment between two [s], and the signal that is sent then."""
    moments = st.floats(first, last).map(lambda seconds: round(seconds, 3))
    return st.tuples(moments, st.sampled_from(numbers).map(int))
