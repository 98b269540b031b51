"""Inputs that a stranger sends, under every parameter that reads them: changed, forged, odd."""

from pathlib import Path
from typing import Any

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import IN, OUT, Case, Step
from tests.fuzz.steps import copy, seal
from tests.fuzz.strategies import changes, commands

_STUDY_OF = {  # of results
    ready.RESULTS: ready.STUDY,
    ready.SELECTED: ready.SELECTION,
    ready.EXTENDED: ready.STUDIED,
}
_BAYS = ("bay.toml", "oresund.toml", "galway-bay.toml", "jade-bight.toml")
# The ready inputs of each kind.
_READY = {
    "scenario": (ready.SCENARIO, ready.SECTIONS, ready.SECTIONS, "paper.toml", *_BAYS),
    "study": (*_STUDY_OF.values(), "sweet-spot.toml", "screening.toml", "precise.toml"),
    "config": (ready.TRAINING, ready.TRAINING, "ddqn-paper.toml"),
    "results": (*_STUDY_OF, ready.EXTENDED),
    "page": (ready.PAGE,),
    "policy": (ready.POLICY,),
    "swept": (ready.SWEPT,),
    "asked": (ready.ASKED,),
}


@st.composite
def forged(
    draw: st.DrawFn, words: commands.Words, parameter: Any, special: changes.Changes | None = None
) -> Case:
    """A command with an input that is changed, in a special way or any."""
    name = commands.name_of(words, parameter)
    kind = draw(st.sampled_from(commands.kinds_of(words, parameter)))
    source = draw(st.sampled_from(_READY[kind]))
    place = OUT if name in ("--out", "--results") else IN
    path = f"{place}/changed{Path(source).suffix}"
    values: dict[str, str | None] = {name: f"../{path}"}
    if name == "--out" and kind == "results":
        values["study run names"] = f"../in/{_STUDY_OF[source]}"
    elif name == "--out" and kind == "policy":
        values["--resume"] = None
    flags = [p for _, all_ in commands.COMMANDS if _ == words for p in all_ if commands.is_flag(p)]
    flag = draw(st.none() | st.sampled_from(flags)) if flags else None
    if flag is not None:
        values.setdefault(commands.name_of(words, flag), None)
    changed = special(path) if special else _changes(kind, path, place)
    made = draw(st.lists(changed, min_size=1, max_size=1 if special else 2))
    seals = draw(st.sampled_from([(), (seal(path),)])) if kind == "policy" else ()
    arguments = commands.line(words, values)
    is_long = kind in ("scenario", "study", "config", "policy")
    steps = (*ready.INPUTS, copy(source, path), *made, *seals)
    return Case(f"forged {kind}", arguments, steps, lasting=4 if is_long else 0)


def _changes(kind: str, path: str, place: str) -> st.SearchStrategy[Step]:
    if kind in ("scenario", "study", "config"):
        tables = [
            changes.table_changes(f"in/{name}") for name in ready.SEAS if not name.endswith("json")
        ]
        polygons = changes.json_changes("in/oresund.geojson")
        return st.one_of(*[changes.document_changes(path)] * 5, st.one_of(*tables, polygons))
    if kind == "policy":
        return changes.training_changes(
            path, "model.safetensors" if place == IN else "checkpoint.safetensors"
        )
    if kind == "page":
        return changes.page_changes(path)
    return changes.results_changes(path) if kind == "results" else changes.json_changes(path)
