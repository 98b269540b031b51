"""Cases that start further processes: pages, workers, and a scheduler that is not there."""

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case
from tests.fuzz.steps import Copy
from tests.fuzz.strategies.folders import renderings

_RUN = ("study", "run", f"../in/{ready.STUDY}", "--out", "../out/a")
_COMMANDS = (
    (*_RUN, "--workers", "2"),
    ("evaluate", "--policy", "greedy", "--missions", "20", "--workers", "2"),
    (*_RUN, "--scheduler", "tcp://127.0.0.1:1"),
    (*_RUN, "--scheduler", "tls://127.0.0.1:1"),
    (
        "sweep",
        "--set",
        "uavs=1..2",
        "--missions",
        "2",
        "--results",
        "../out/r",
        "--out",
        "../out/p",
    ),
)


@st.composite
def dear(draw: st.DrawFn) -> Case:
    """A page of changed results, or one of a few commands that may get a signal."""
    if draw(st.integers(0, 2)):
        rendered = draw(renderings)
        return Case("dear", rendered.arguments, rendered.steps, seconds=240)
    moments = st.floats(0.5, 8).map(lambda seconds: round(seconds, 2))
    sent = draw(st.lists(st.tuples(moments, st.sampled_from([2, 15, 1])), max_size=1))
    steps = tuple(Copy(name, f"in/{name}") for name in (ready.SCENARIO, ready.STUDY))
    words = draw(st.sampled_from(_COMMANDS))
    return Case("dear", words, steps, seconds=240, signals=tuple(sent))
