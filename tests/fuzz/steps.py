"""Steps: what is done to the files of a case before its command runs.

Paths are relative to the folder of the case. Positions are numbers that are taken modulo the number
of places there are, so that a step fits any file.
"""

import json
import os
import re
import shutil
import stat
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from pyarrow.types import is_floating

from dess.analysis.results.chunks import name_of, short_hash
from dess.analysis.results.parquet import INDICES
from dess.policies.learner.arrays import hash_arrays, read_arrays
from dess.policies.learner.session import CHECKPOINT
from dess.reports.pages.page import Page
from tests.analysis.hostile import hostile_folder
from tests.fuzz.case import CWD, READY, SECRET_FILE

# A place in a document that is replaced by text which need not be JSON.
_HOLE = "the text of this value is replaced"
_BLOCK = re.compile(r'<script class="[^"]*" type="application/json">(.*?)</script>')
# Code that leaves a trace if anything imports or runs it.
PLANTED = "import pathlib; pathlib.Path(__file__).with_name('{name}.ran').touch()\n"
# A file of a policy, and the names of its classes: a number is added.
EVIL = "../in/evil.py"
_CLASSES = (
    "class Evil0:\n    name = 'e'\n    def act(self, view):\n        return [4] * len(view)\n"
)
_CLASSES += "Evil1 = Evil2 = Evil3 = Evil0\n"

Edits = tuple[tuple[int, str, str], ...]  # a place, what is done there, and the new text


@dataclass(frozen=True)
class Step:
    """Something that is done to the files of a case: a function of this module, and what it takes.

    Attributes:
        function: Takes the folder of the case, then the arguments.
        arguments: Plain values, so that equal steps can be told.
    """

    function: Callable[..., None]
    arguments: tuple[Any, ...]

    def do(self, box: Path) -> None:
        """Do it in the folder of a case."""
        self.function(box, *self.arguments)

    def __repr__(self) -> str:
        return f"{self.function.__name__}{self.arguments}"


def _step(function: Callable[..., None]) -> Callable[..., Step]:
    """Let a function return a step that calls it later."""
    return lambda *arguments: Step(function, arguments)


@_step
def copy(box: Path, name: str, path: str) -> None:
    """Copy a ready input, a file or a folder."""
    source = box / READY / name
    if source.is_dir():
        shutil.copytree(source, box / path, dirs_exist_ok=True)
    else:
        shutil.copyfile(source, box / path)


@_step
def write(box: Path, path: str, content: bytes) -> None:
    """Write a file."""
    (box / path).parent.mkdir(parents=True, exist_ok=True)
    _write(box / path, content)


@_step
def change_lines(box: Path, path: str, edits: tuple[tuple[int | str, str, str], ...]) -> None:
    """Change lines of a text, such as TOML: replace a value or a line, remove or repeat a line.

    A place is a number, or the key of a line; without such a line it is before the first one.
    """
    lines = _read(box / path).decode().splitlines()
    for place, action, text in edits:
        if isinstance(place, str):
            keys = [line.partition("=")[0].strip() for line in lines]
            if place not in keys:
                lines.insert(0, f"{place} = 0")
            place = keys.index(place) if place in keys else 0
        at = place % max(len(lines), 1)
        key = lines[at].partition("=")[0] if lines else "key "
        new = {"value": [f"{key}= {text}"], "line": [text], "remove": []}
        lines[at : at + 1] = new.get(action, lines[at : at + 1] * 2)
    _write(box / path, "\n".join(lines) + "\n")


@_step
def change_bytes(box: Path, path: str, edits: tuple[tuple[int, bytes | None], ...]) -> None:
    """Change bytes of a file: each edit writes some at a place, or cuts the file there."""
    content = _read(box / path)
    for position, new in edits:
        at = position % max(len(content), 1)
        content = content[:at] + (b"" if new is None else new + content[at + len(new) :])
    _write(box / path, content)


@_step
def change_json(box: Path, path: str, edits: Edits) -> None:
    """Change a document by edits: places are counted in its text from the outside inwards.

    In a folder, the place of the first edit also says which of its documents is changed.
    """
    document = box / path
    if document.is_dir() and (documents := sorted(document.rglob("*.json"))):
        document = documents[edits[0][0] % len(documents)]
    _write(document, edited(_read(document).decode(), edits))


@_step
def change_page(box: Path, path: str, block: int, edits: Edits, is_sealed: bool = True) -> None:
    """Change the evidence in a page, and its checksum with it."""
    html = _read(box / path).decode()
    blocks = [*_BLOCK.finditer(html)]
    begin, end = blocks[block % len(blocks)].span(1)
    html = html[:begin] + edited(html[begin:end], edits) + html[end:]
    html = html.encode("utf-8", "replace").decode()
    _write(box / path, Page(html).sealed.text if is_sealed else html)


@_step
def change_header(box: Path, path: str, edits: Edits, is_inner: bool) -> None:
    """Change the header of a safetensors file: the JSON in it, or that of its metadata."""
    header, content = _split(box / path)
    if is_inner and "dess" in header.get("__metadata__", {}):
        header["__metadata__"]["dess"] = edited(header["__metadata__"]["dess"], edits)
        _join(box / path, json.dumps(header), content)
    else:
        _join(box / path, edited(json.dumps(header), edits), content)


@_step
def seal(box: Path, folder: str) -> None:
    """Write the checksums that fit into the files of a training, as a forger would."""
    description, path = box / folder / "config.json", box / folder / CHECKPOINT
    content = json.loads(_read(description))
    model = _read(box / folder / "model.safetensors")
    content["model_sha256"] = [sha256(model).hexdigest()]
    _write(description, json.dumps(content))
    header, data = _split(path)
    inner = json.loads(header["__metadata__"]["dess"])
    inner.pop("sha256", None)
    values, _ = read_arrays(path, len(data) + 2**20)
    inner["sha256"] = hash_arrays(inner, values)
    header["__metadata__"]["dess"] = json.dumps(inner)
    _join(path, json.dumps(header), data)


@_step
def forge(box: Path, folder: str, position: int, change: str, text: str) -> None:
    """Change a parquet file below a folder and give it the name that fits: rows, cells, parts."""
    files = sorted((box / folder).rglob("*.parquet"))
    path = files[position % len(files)]
    name = path.stem.rpartition("-")[0]
    content = bytearray(_read(path))
    if change == "bytes":
        content[position % len(content)] ^= 1 + position % 255
    else:
        table = pq.read_table(pa.BufferReader(bytes(content)))
        if change == "parts":
            with suppress(ValueError, TypeError, RecursionError):
                name = name_of(json.loads(text))
        sink = pa.BufferOutputStream()
        pq.write_table(_changed(table, position, change, text), sink)
        content = bytearray(sink.getvalue())
    path.unlink()
    (path.parent / f"{name}-{short_hash(bytes(content))}.parquet").write_bytes(content)


def _changed(table: pa.Table, position: int, change: str, text: str) -> pa.Table:
    at = position % table.num_columns
    if change == "parts":
        parts = text.encode("utf-8", "surrogateescape")
        return table.replace_schema_metadata({b"dess.parts": parts})
    if change == "rows":
        return pa.concat_tables([table] * (position % 3)) if position % 3 else table[:0]
    if change == "schema":
        return table.cast(pa.schema([(name, pa.string()) for name in table.schema.names]))
    if change == "values":
        # Indices and floats: any other value of a file whose checksum fits is believed.
        checked = [f.name for f in table.schema if f.name in INDICES or is_floating(f.type)]
        name = (checked or table.schema.names)[position % len(checked or table.schema.names)]
        at, field = table.schema.get_field_index(name), table.schema.field(name)
        bad = float("nan") if is_floating(field.type) else -2 - position % 2**31
        with suppress(pa.ArrowException, OverflowError):
            return table.set_column(at, field, pa.array([bad] * len(table), field.type))
    return table.remove_column(at)


@_step
def node(box: Path, path: str, kind: str) -> None:
    """Put a node of a kind of ``strategies.changes.NODES``, or a locked folder, at a path."""
    place = box / path
    place.parent.mkdir(parents=True, exist_ok=True)
    if kind == "locked":  # a folder that cannot be written, nor read
        place.mkdir(exist_ok=True)
        place.chmod(0o500)
        return
    _remove(place)
    links = {"loop": place.name, "dangling": "nowhere", "secret": str(box / SECRET_FILE)}
    if kind == "fifo":
        os.mkfifo(place)
    elif kind == "folder":
        place.mkdir()
    elif kind == "socket":
        os.mknod(place, stat.S_IFSOCK | 0o600)
    elif kind in links:
        place.symlink_to(links[kind])
    else:  # a device of our own, as the machine's must survive; a link to it if that is refused
        device = Path("/dev", kind)
        try:
            os.mknod(place, stat.S_IFCHR | 0o666, device.stat().st_rdev)
        except PermissionError:
            place.symlink_to(device)


@_step
def node_in(box: Path, folder: str, position: int, other: str | None, kind: str) -> None:
    """Put a node in the place of a file of a folder, or of another that need not be there."""
    paths = sorted((box / folder).rglob("*"))
    path = box / folder / other if other else paths[position % len(paths)]
    node(str(path.relative_to(box)), kind).do(box)


@_step
def hostile(box: Path, folder: str, text: str) -> None:
    """Put a text, such as the class of a Python file, into the free strings of results."""
    sound = box / f"{folder}-sound"
    (box / folder).rename(sound)
    try:
        hostile_folder(sound, box / folder, text)
    finally:
        shutil.rmtree(sound)


@_step
def name_evil(box: Path, path: str) -> None:
    """Let data name the policy of a Python file, wherever they name ``greedy``."""
    results = [manifest.parent for manifest in (box / path).rglob("manifest.json")]
    for file in [box / path] if (box / path).is_file() else (box / path).rglob("*"):
        if file.suffix in (".json", ".toml", ".html") and not {*results} & {*file.parents}:
            text = _read(file).decode().replace('"greedy"', f'"{EVIL}:Evil0"')
            _write(file, Page(text).sealed.text if file.suffix == ".html" else text)
    for folder in results:
        hostile(str(folder.relative_to(box)), f"{EVIL}:Evil").do(box)


@_step
def rename(box: Path, folder: str, position: int, name: str) -> None:
    """Rename a file or folder, one of those below a folder, or else remove it."""
    paths = sorted((box / folder).rglob("*"))
    path = paths[position % len(paths)]
    try:
        path.rename(path.parent / name)
    except (OSError, ValueError):  # no such name is possible
        _remove(path)


@_step
def plant(box: Path, folder: str, names: tuple[str, ...]) -> None:
    """Put Python files into a folder; if one of them is run, it leaves a file."""
    for name in names:
        write(f"{folder}/{name}", PLANTED.format(name=Path(name).name).encode()).do(box)


def plant_evil(box: Path) -> None:
    """The Python file that data may name; a command that imports it leaves a file."""
    path = box / CWD / EVIL
    path.write_text(PLANTED.format(name=path.name) + _CLASSES)


def edited(text: str, edits: Edits) -> str:
    """A JSON text in which values are replaced, removed, renamed or added by any text."""
    document = json.loads(text)
    holes = []
    for position, action, new in edits:
        places = _places(document)
        if not places:
            return new
        holder, key = places[position % len(places)]
        hole = f"{_HOLE} {len(holes)}"
        if action == "remove":
            del holder[key]
            continue
        holes.append(new)
        if action == "replace":
            holder[key] = hole
        elif isinstance(holder, dict):
            holder[hole] = holder.pop(key) if action == "rename" else None
        else:
            holder.insert(key, hole)
    written = json.dumps(document)
    for number, new in enumerate(holes):
        written = written.replace(f'"{_HOLE} {number}"', new)
    return written


def _places(document: Any) -> list[tuple[Any, Any]]:
    """All values in a document, as their holder and key, the outer ones first."""
    places, level = [], [document]
    while level:
        holders = [value for value in level if isinstance(value, dict | list)]
        level = []
        for holder in holders:
            keys = range(len(holder)) if isinstance(holder, list) else list(holder)
            places += [(holder, key) for key in keys]
            level += [holder[key] for key in keys]
    return places


def _regular(path: Path) -> Path:
    """The path of a new or regular file; a pipe would block, a device is not ours."""
    if path.exists() and not path.is_file():
        raise ValueError(f"{path} is no regular file")
    return path


def _read(path: Path) -> bytes:
    return _regular(path).read_bytes()


def _write(path: Path, content: bytes | str) -> None:
    if isinstance(content, str):
        content = content.encode("utf-8", "surrogateescape")
    _regular(path).write_bytes(content)


def _remove(path: Path) -> None:
    """Remove whatever is there; ``shutil.rmtree`` opens what is no folder, and a pipe blocks it."""
    if path.is_dir() and not path.is_symlink():
        shutil.rmtree(path)
    else:
        path.unlink(missing_ok=True)


def _split(path: Path) -> tuple[dict[str, Any], bytes]:
    """The header of a safetensors file, and the bytes after it."""
    content = _read(path)
    end = 8 + int.from_bytes(content[:8], "little")
    return json.loads(content[8:end]), content[end:]


def _join(path: Path, header: str, content: bytes) -> None:
    new = header.encode("utf-8", "replace")
    _write(path, len(new).to_bytes(8, "little") + new + content)
