"""Changes of inputs, by their kind: edits, forgeries with fitting checksums, odd nodes, code."""

import json
from collections.abc import Callable

from hypothesis import strategies as st

from tests.fuzz import steps
from tests.fuzz.case import Step
from tests.fuzz.strategies import values
from tests.fuzz.strategies.sections import odd_settings
from tests.fuzz.strategies.values import byte_edits, json_edits, positions, texts

Changes = Callable[[str], st.SearchStrategy[Step]]  # of a file or folder of a case

NODES = ("fifo", "zero", "full", "null", "folder", "loop", "dangling", "socket", "secret")
# Files that a folder may have beside those that are there.
_OTHERS = (".lock", ".index.lock", "manifest.json", "config.json", "derived/times.json")
# Modules that Python, Jupyter or a study might import from the folder that it works in.
_PLANTED = (
    *("pandas.py", "numpy.py", "sitecustomize.py", "usercustomize.py", "ipykernel_launcher.py"),
    *("ipykernel/__main__.py", "dess/__init__.py", "policies.py", "reports.py", "conftest.py"),
    *("json.py", "matplotlib/__init__.py", "torch.py", "startup.py", "greedy.py", "__main__.py"),
    *(".ipython/profile_default/startup/00.py", "ipython_config.py", "jupyter_config.py"),
    *("model.py", "policy.py", "config.py", "safetensors.py", "__init__.py"),
)
# Lines that no TOML file may have, or only once.
_LINES = ("[", "[[", "a.b.c = 1", "[design]", "[[phases]]", "= 1", "\ufeff")
_LINES += ("a = '''", "nodes = ''")
_BAD = [b"\x00\x00\xc0\x7f", b"\x00\x00\x80\x7f", b"\xff\xff\x7f\x7f"]  # NaN, infinity, huge
_line = st.sampled_from(_LINES) | texts
_nodes = st.sampled_from(NODES)
# Code that a document names, and tables that lie elsewhere.
_names = st.sampled_from(
    [("policies", f'["{steps.EVIL}:Evil0"]'), ("policies", f'["greedy", "{steps.EVIL}:Evil1"]')]
    + [("nodes", f'"{path}"') for path in ("../home/secret.csv", "/etc/passwd", "fifo.csv")]
    + [("no_fly", f'"{path}"') for path in ("../home/secret.csv", "/etc/passwd", "fifo.csv")]
    + [("scenario", f'"{path}"') for path in ("../home/secret.csv", "../in", "/dev/stdin")]
)


def _encoded(text: str) -> bytes:
    return text.encode("utf-8", "surrogateescape")


@st.composite
def _edits(draw: st.DrawFn, path: str) -> Step:
    edits = []
    for _ in range(draw(st.integers(1, 3))):
        action = draw(st.sampled_from(["value", "value", "value", "line", "remove", "repeat"]))
        new = draw(values.toml_values if action == "value" else _line | odd_settings)
        edits.append((draw(positions), action, new))
    return steps.change_lines(path, tuple(edits))


def document_changes(path: str) -> st.SearchStrategy[Step]:
    """Changes of a TOML file."""
    return st.one_of(
        *(_edits(path), _edits(path), _edits(path)),
        _names.map(lambda named: steps.change_lines(path, ((named[0], "value", named[1]),))),
        byte_edits().map(lambda edits: steps.change_bytes(path, edits)),
        st.binary(max_size=50).map(lambda content: steps.write(path, content)),
        values.long_texts.map(lambda text: steps.write(path, text.encode())),
        st.builds(steps.node, st.just(path), _nodes),
    )


def table_changes(path: str) -> st.SearchStrategy[Step]:
    """Changes of a CSV table: its bytes, one of its lines, or all of it."""
    rows = st.tuples(values.numbers, values.numbers).map(",".join)
    lines = st.tuples(positions, st.just("line"), texts | values.numbers | rows)
    return st.one_of(
        byte_edits().map(lambda edits: steps.change_bytes(path, edits)),
        lines.map(lambda edit: steps.change_lines(path, (edit,))),
        st.sampled_from([10**4, 10**6]).map(
            lambda n: steps.write(path, b"slot,factor\n" + b"1,1\n" * n)
        ),
        st.builds(steps.node, st.just(path), _nodes),
    )


def results_changes(folder: str) -> st.SearchStrategy[Step]:
    """Changes of a results folder."""
    here, manifest = st.just(folder), st.just(f"{folder}/manifest.json")
    kinds = st.sampled_from(["bytes", "parts", "rows", "values", "columns", "schema"])
    parts = st.tuples(texts, st.integers(-5, 10), st.integers(-5, 2**40)).map(list)
    names = texts.map(lambda text: text.replace("/", "_"))
    documents = st.builds(steps.change_json, manifest, json_edits())
    of_parts = values.json_values | st.lists(parts, max_size=3).map(json.dumps)
    records = st.builds(steps.forge, here, positions, kinds, of_parts)
    scripts = st.sampled_from(["<b>x</b>", "../../ran", "~/x"])
    return st.one_of(
        *(documents, documents, documents, records, records),
        st.builds(steps.change_bytes, manifest, byte_edits()),
        st.builds(steps.write, manifest, values.json_values.map(_encoded)),
        st.builds(steps.rename, here, positions, names),
        odd(folder),
        st.builds(steps.hostile, here, scripts),
    )


def page_changes(path: str) -> st.SearchStrategy[Step]:
    """Changes of a page: other evidence with a checksum that fits, bytes, nodes."""
    evidence = st.builds(steps.change_page, st.just(path), positions, json_edits(), st.booleans())
    return st.one_of(
        *(evidence, evidence, evidence),
        st.builds(steps.change_bytes, st.just(path), byte_edits()),
        st.builds(steps.node, st.just(path), _nodes),
    )


def training_changes(folder: str, tensors: str) -> st.SearchStrategy[Step]:
    """Changes of the folder of a training, above all of one of its files with tensors."""
    config, main = st.just(f"{folder}/config.json"), st.just(f"{folder}/{tensors}")
    files = (tensors, "config.json", "training.parquet")
    paths = st.sampled_from([f"{folder}/{name}" for name in files])
    bad = st.tuples(st.tuples(st.integers(10**4, 10**7), st.sampled_from(_BAD)))
    headers = st.builds(
        steps.change_header, main, json_edits(), st.sampled_from([True, True, False])
    )
    return st.one_of(
        *(headers, headers),
        st.builds(steps.change_json, config, json_edits()),
        st.builds(steps.change_bytes, main, bad),
        st.builds(steps.change_bytes, paths, byte_edits()),
        st.builds(steps.write, paths, values.json_values.map(_encoded)),
        odd(folder),
    )


def json_changes(folder: str) -> st.SearchStrategy[Step]:
    """Changes of the documents in a folder, whichever there are, and odd nodes among its files."""
    here = st.just(folder)
    documents = st.builds(steps.change_json, here, json_edits())
    return st.one_of(
        documents, documents, st.builds(steps.rename, here, positions, texts), odd(folder)
    )


def odd(path: str) -> st.SearchStrategy[Step]:
    """What is no file in the place of a file, be it one of a folder; and Python files beside it."""
    if "." in path:
        return st.builds(steps.node, st.just(path), _nodes)
    others = st.none() | st.none() | st.sampled_from(_OTHERS)
    nodes = st.builds(steps.node_in, st.just(path), positions, others, _nodes)
    return st.one_of(nodes, nodes, st.just(steps.plant(path, _PLANTED)))


def evil(path: str) -> st.SearchStrategy[Step]:
    """Data that name the policy of a Python file."""
    return st.just(steps.name_evil(path))
