"""Cases that start further processes: kernels, workers, and a scheduler that is not there."""

import signal
from dataclasses import replace

from hypothesis import strategies as st

from dess.reports.pages.notebook import NAMES
from tests.fuzz import ready
from tests.fuzz.case import Case
from tests.fuzz.steps import copy
from tests.fuzz.strategies.commands import READING, line
from tests.fuzz.strategies.forged import forged
from tests.fuzz.strategies.reports import reports

_RUN = ("study", "run", f"../in/{ready.STUDY}", "--out", "../out/a")
_WORKING = ((*_RUN, "--workers", "2"), (*_RUN, "--workers", "2", "--missions", "5000"))
_COMMANDS = (
    ("evaluate", "--policy", "greedy", "--missions", "20", "--workers", "2"),
    (*_RUN, "--scheduler", "tcp://127.0.0.1:1"),
    (*_RUN, "--scheduler", "tls://127.0.0.1:1"),
    line(("sweep",)),
    line(("report",)),
)
_PAGES = [(words, p) for words, p in READING if words in (("report",), ("study", "export"))]


@st.composite
def dear(draw: st.DrawFn) -> Case:
    """A page of changed results, workers that are killed, or a command that may get a signal."""
    steps = tuple(copy(name, f"in/{name}") for name in (ready.SCENARIO, ready.STUDY, ready.RESULTS))
    what = draw(st.sampled_from(["page", "report", "killed", "signal"]))
    if what == "page":
        case = draw(forged(*draw(st.sampled_from(_PAGES))))
        return replace(case, kind="dear", seconds=240, kernels=True)
    if what == "report":
        case = draw(reports(draw(st.sampled_from(NAMES))))
        return replace(case, kind="dear", seconds=240, kernels=True)
    moments = st.floats(0.5, 10).map(lambda seconds: round(seconds, 2))
    numbers = [signal.SIGKILL] if what == "killed" else [2, 15, 1]
    sent = draw(st.lists(st.tuples(moments, st.sampled_from([*map(int, numbers)])), max_size=1))
    words = draw(st.sampled_from(_WORKING if what == "killed" else (*_WORKING, *_COMMANDS)))
    again = what == "killed"
    return Case("dear", words, steps, 240, signals=tuple(sent), again=again, kernels=True)
