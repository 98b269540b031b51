"""Scenarios, studies and training configs: shipped and small ones that are changed, and bytes."""

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import Bytes, Copy, Lines, Write
from tests.fuzz.strategies.sections import odd_settings
from tests.fuzz.strategies.values import (
    byte_edits,
    long_texts,
    numbers,
    positions,
    texts,
    toml_values,
)

_SCENARIOS = (ready.SCENARIO, ready.SECTIONS, ready.SECTIONS, "paper.toml", "bay.toml")
_STUDIES = (ready.STUDY, ready.STUDIED, ready.SELECTION, "sweet-spot.toml", "sensitivity.toml")
_CONFIGS = (ready.TRAINING, ready.TRAINING, "ddqn-paper.toml")
_STUDIES += ("screening.toml", "precise.toml")
# Keys that no file may have, or only once.
_LINES = (
    "[",
    "[[",
    "a.b.c = 1",
    "[design]",
    "[[phases]]",
    "= 1",
    "\ufeff",
    "a = '''",
    "nodes = ''",
)
_line = st.sampled_from(_LINES) | texts
_FILE = "../in/file.toml"


def _commands(kind: tuple[str, ...]) -> tuple[tuple[str, ...], ...]:
    """What reads a file of this kind; it writes into ``../out/a``."""
    out = ("--out", "../out/a")
    if kind is _SCENARIOS:
        return (
            ("simulate", "--scenario", _FILE),
            ("simulate", "--scenario", _FILE, "--figure", "../out/a.png"),
            ("evaluate", "--scenario", _FILE, "--policy", "greedy", "--missions", "2"),
            ("scenarios", "show", _FILE),
            ("scenarios", "show", _FILE, "--json"),
        )
    if kind is _STUDIES:
        few = ("--missions", "1", "--policy", "greedy")
        return (
            ("study", "run", _FILE, "--dry-run"),
            ("study", "run", _FILE, *out),
            ("study", "run", _FILE, *out, *few),
            ("studies", "show", _FILE),
            ("studies", "show", _FILE, "--json"),
        )
    return (("train", _FILE, *out, "--device", "cpu"), ("train", _FILE, *out, "--seed", "1"))


@st.composite
def _lines(draw: st.DrawFn) -> Step:
    edits = []
    for _ in range(draw(st.integers(1, 3))):
        action = draw(st.sampled_from(["value", "value", "value", "line", "remove", "repeat"]))
        new = draw(toml_values if action == "value" else _line | odd_settings)
        edits.append((draw(positions), action, new))
    return Lines("in/file.toml", tuple(edits))


def _tables(path: str) -> st.SearchStrategy[Step]:
    """Changes of a CSV table: its bytes, or one of its lines."""
    lines = st.tuples(positions, st.just("line"), texts | numbers | _rows)
    return st.one_of(
        byte_edits().map(lambda edits: Bytes(path, edits)),
        lines.map(lambda edit: Lines(path, (edit,))),
    )


_rows = st.tuples(numbers, numbers).map(",".join)
_changes = st.one_of(
    _lines(),
    _lines(),
    byte_edits().map(lambda edits: Bytes("in/file.toml", edits)),
    st.binary(max_size=50).map(lambda content: Write("in/file.toml", content)),
    long_texts.map(lambda text: Write("in/file.toml", text.encode())),
)


@st.composite
def documents(draw: st.DrawFn) -> Case:
    """A TOML file that is changed, under a command that reads it."""
    kind = draw(st.sampled_from([_SCENARIOS, _STUDIES, _CONFIGS]))
    copy = Copy(draw(st.sampled_from(kind)), "in/file.toml")
    change = draw(_changes)
    files = (ready.SCENARIO, ready.SECTIONS, ready.STORM, "bay.csv")
    beside: tuple[Step, ...] = tuple(Copy(name, f"in/{name}") for name in files)
    if draw(st.integers(0, 4)) == 0:
        table = draw(st.sampled_from([f"in/{ready.STORM}", "in/bay.csv"]))
        beside += (draw(_tables(table)),)
    arguments = draw(st.sampled_from(_commands(kind)))
    return Case("document", arguments, (*beside, copy, change), lasting=2)
