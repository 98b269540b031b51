"""Signals at any moment to commands that run."""

import signal

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case
from tests.fuzz.steps import copy

_SEA = ("--scenario", f"../in/{ready.SCENARIO}")
_RUN = ("study", "run", f"../in/{ready.STUDY}", "--out", "../out/a")
_COMMANDS = (
    ("simulate", *_SEA, "--animation", "../out/a.gif"),
    ("evaluate", *_SEA, "--policy", "greedy", "--missions", "200000"),
    ("evaluate", *_SEA, "--policy", "greedy", "--missions", "3000", "--engine", "events"),
    ("train", f"../in/{ready.TRAINING}", "--out", "../out/a"),
    ("verify", f"../in/{ready.RESULTS}"),
)
_STUDIES = ((*_RUN,), (*_RUN, "--missions", "5000"))


@st.composite
def signals(draw: st.DrawFn) -> Case:
    """One or two signals to a command; a killed study is completed by the same command."""
    moments = st.floats(0.02, 1.0).map(lambda seconds: round(seconds, 3))
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    is_study = draw(st.booleans())
    words = draw(st.sampled_from(_STUDIES if is_study else _COMMANDS))
    allowed = (*numbers, signal.SIGKILL) if is_study else numbers
    sent = st.tuples(moments, st.sampled_from(allowed).map(int))
    chosen = tuple(sorted(draw(st.lists(sent, min_size=1, max_size=2))))
    inputs = (ready.SCENARIO, ready.STUDY, ready.TRAINING, ready.RESULTS)
    steps = tuple(copy(name, f"in/{name}") for name in inputs)
    return Case("signal", words, steps, signals=chosen, again=is_study)
