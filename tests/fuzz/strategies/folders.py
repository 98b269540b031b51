"""Results folders that a stranger sends: changed, forged, planted with code, full of odd nodes."""

import json

from hypothesis import strategies as st

from tests.fuzz import ready
from tests.fuzz.case import Case, Step
from tests.fuzz.steps import Bytes, Copy, Forged, Json, Node, Plant, Rename, Write
from tests.fuzz.strategies.values import byte_edits, json_edits, json_values, positions, texts

NODES = ("fifo", "zero", "full", "null", "folder", "loop", "dangling", "socket")
_MANIFEST = "manifest.json"
# Modules that Python, Jupyter or a study might import from the folder that it works in.
_PLANTED = (
    *("pandas.py", "numpy.py", "sitecustomize.py", "usercustomize.py", "ipykernel_launcher.py"),
    *("ipykernel/__main__.py", "dess/__init__.py", "policies.py", "reports.py", "conftest.py"),
    *("json.py", "matplotlib/__init__.py", "torch.py", "startup.py", "greedy.py", "__main__.py"),
    *(".ipython/profile_default/startup/00.py", "ipython_config.py", "jupyter_config.py"),
)
_PATHS = (_MANIFEST, "missions", "uavs", "events", "failures", "missions/policy=greedy", ".lock")
_READING = (
    ("study", "show", "{}"),
    ("study", "show", "{}", "--json"),
    ("study", "show", "{}", "--csv"),
    ("study", "show", "{}", "--target", "success=0.1"),
    ("study", "diff", "{}", f"../in/{ready.RESULTS}"),
    ("study", "diff", f"../in/{ready.RESULTS}", "{}", "--json"),
    ("verify", "{}", "--missions", "2"),
    ("verify", "{}", "--missions", "1", "--json"),
    ("simulate", "--of", "{}"),
    ("simulate", "--of", "{}", "--point", "1", "--json", "--policy", "random"),
    ("study", "export", "{}", "--crate", "../out/a.zip", "--page", f"../in/{ready.PAGE}"),
)
_WRITING = (
    ("study", "run", f"../in/{ready.STUDY}", "--out", "{}"),
    ("study", "run", f"../in/{ready.STUDY}", "--out", "{}", "--missions", "7", "--accept-code"),
    ("study", "run", f"../in/{ready.SELECTION}", "--out", "{}"),
    ("study", "run", f"../in/{ready.STUDIED}", "--out", "{}"),
)
_RENDERING = (
    ("report", "{}", "--out", "../out/pages"),
    ("report", "index", "--results", "{}/..", "--out", "../out/pages"),
    ("study", "export", "{}", "--crate", "../out/a.zip"),
)
_parts = st.one_of(
    json_values,
    st.lists(
        st.tuples(texts, st.integers(-5, 10), st.integers(-5, 2**40)).map(list), max_size=3
    ).map(json.dumps),
)


def _changes(folder: str) -> st.SearchStrategy[Step]:
    """Changes of a results folder."""
    here, manifest = st.just(folder), st.just(f"{folder}/{_MANIFEST}")
    kinds = st.sampled_from(["bytes", "parts", "rows", "values", "columns", "schema"])
    paths = st.sampled_from([f"{folder}/{path}" for path in _PATHS])
    names = texts.map(lambda text: text.replace("/", "_"))
    documents = st.builds(Json, manifest, json_edits())
    records = st.builds(Forged, here, positions, kinds, _parts)
    return st.one_of(
        *(documents, documents, documents, records, records),
        st.builds(Bytes, manifest, byte_edits()),
        st.builds(Write, manifest, json_values.map(_bytes)),
        st.builds(Rename, here, positions, names),
        st.builds(Node, paths, st.sampled_from(NODES)),
        st.just(Plant(folder, _PLANTED)),
    )


def _bytes(text: str) -> bytes:
    return text.encode("utf-8", "surrogateescape")


def _cases(commands: tuple[tuple[str, ...], ...], place: str) -> st.SearchStrategy[Case]:
    """A changed results folder under one of the commands."""
    folder = f"{place}/changed"
    plain = (ready.SCENARIO, ready.STUDY, ready.SELECTION, ready.RESULTS, ready.PAGE)
    plain += (ready.SECTIONS, ready.STORM, ready.STUDIED)
    inputs = tuple(Copy(one, f"in/{one}") for one in plain)
    lines = [tuple(word.replace("{}", f"../{folder}") for word in line) for line in commands]
    names = st.sampled_from([ready.RESULTS, ready.EXTENDED, ready.EXTENDED, ready.SELECTED])
    changes = st.lists(_changes(folder), min_size=1, max_size=2)

    def case(line: tuple[str, ...], name: str, changed: list[Step]) -> Case:
        return Case("results", line, (*inputs, Copy(name, folder), *changed))

    return st.builds(case, st.sampled_from(lines), names, changes)


readings = _cases(_READING, "in")
writings = _cases(_WRITING, "out")
renderings = _cases(_RENDERING, "in")
