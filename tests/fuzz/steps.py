"""Steps: what is done to the files of a case before its command runs.

Paths are relative to the folder of the case. Positions are numbers that are taken modulo the number
of places there are, so that a step fits any file.
"""

import json
import os
import re
import shutil
import stat
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any, Literal

import pyarrow as pa
import pyarrow.parquet as pq

from analysis.results.chunks import name_of, short_hash
from policies.ddqn import tensors
from policies.ddqn.session import CHECKPOINT
from reports.pages.verify import sealed
from tests.analysis.hostile import hostile_folder
from tests.fuzz.case import CWD, SECRET_FILE

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

Edit = tuple[int, Literal["replace", "remove", "rename", "insert"], str]


@dataclass(frozen=True)
class Copy:
    """Copy a ready input, a file or a folder."""

    name: str
    path: str

    def do(self, box: Path, ready: Path) -> None:
        source = ready / self.name
        if source.is_dir():
            shutil.copytree(source, box / self.path, dirs_exist_ok=True)
        else:
            shutil.copyfile(source, box / self.path)


@dataclass(frozen=True)
class Write:
    """Write a file."""

    path: str
    content: bytes

    def do(self, box: Path, ready: Path) -> None:
        (box / self.path).parent.mkdir(parents=True, exist_ok=True)
        _write(box / self.path, self.content)


@dataclass(frozen=True)
class Lines:
    """Change lines of a text, such as TOML: replace a value or a line, remove or repeat a line.

    A place is a number, or the key of a line; without such a line it is before the first one.
    """

    path: str
    edits: tuple[tuple[int | str, Literal["value", "line", "remove", "repeat"], str], ...]

    def do(self, box: Path, ready: Path) -> None:
        lines = read_text(box / self.path).splitlines()
        for place, action, text in self.edits:
            if isinstance(place, str):
                keys = [line.partition("=")[0].strip() for line in lines]
                if place not in keys:
                    lines.insert(0, f"{place} = 0")
                    keys.insert(0, place)
                place = keys.index(place)
            at = place % max(len(lines), 1)
            key = lines[at].partition("=")[0] if lines else "key "
            new = {"value": [f"{key}= {text}"], "line": [text], "remove": []}
            lines[at : at + 1] = new.get(action, lines[at : at + 1] * 2)
        text = "\n".join(lines) + "\n"
        _write(box / self.path, text.encode("utf-8", "surrogateescape"))


@dataclass(frozen=True)
class Bytes:
    """Change bytes of a file: each edit writes some at a place, or cuts the file there."""

    path: str
    edits: tuple[tuple[int, bytes | None], ...]

    def do(self, box: Path, ready: Path) -> None:
        content = read_bytes(box / self.path)
        for position, new in self.edits:
            at = position % max(len(content), 1)
            content = content[:at] + (b"" if new is None else new + content[at + len(new) :])
        _write(box / self.path, content)


@dataclass(frozen=True)
class Json:
    """Change a document by edits: places are counted in its text from the outside inwards.

    In a folder, the place of the first edit also says which of its documents is changed.
    """

    path: str
    edits: tuple[Edit, ...]

    def do(self, box: Path, ready: Path) -> None:
        path = box / self.path
        if path.is_dir() and (documents := sorted(path.rglob("*.json"))):
            path = documents[self.edits[0][0] % len(documents)]
        text = edited(read_text(path), self.edits)
        _write(path, text.encode("utf-8", "surrogateescape"))


@dataclass(frozen=True)
class Page:
    """Change the evidence in a page, and its checksum with it."""

    path: str
    block: int
    edits: tuple[Edit, ...]
    is_sealed: bool = True

    def do(self, box: Path, ready: Path) -> None:
        html = read_text(box / self.path)
        blocks = [
            *re.finditer(r'<script class="[^"]*" type="application/json">(.*?)</script>', html)
        ]
        begin, end = blocks[self.block % len(blocks)].span(1)
        html = html[:begin] + edited(html[begin:end], self.edits) + html[end:]
        html = html.encode("utf-8", "replace").decode()
        _write(box / self.path, (sealed(html) if self.is_sealed else html).encode())


@dataclass(frozen=True)
class Header:
    """Change the header of a safetensors file: the JSON in it, or that of its metadata."""

    path: str
    edits: tuple[Edit, ...]
    is_inner: bool

    def do(self, box: Path, ready: Path) -> None:
        header, content = _split(box / self.path)
        if self.is_inner and "dess" in header.get("__metadata__", {}):
            header["__metadata__"]["dess"] = edited(header["__metadata__"]["dess"], self.edits)
            text = json.dumps(header)
        else:
            text = edited(json.dumps(header), self.edits)
        _join(box / self.path, text, content)


@dataclass(frozen=True)
class Seal:
    """Write the checksums that fit into the files of a training, as a forger would."""

    folder: str

    def do(self, box: Path, ready: Path) -> None:
        description, path = box / self.folder / "config.json", box / self.folder / CHECKPOINT
        model = read_bytes(box / self.folder / "model.safetensors")
        content = json.loads(read_bytes(description))
        content["model_sha256"] = [sha256(model).hexdigest()]
        _write(description, json.dumps(content).encode())
        header, data = _split(path)
        inner = json.loads(header["__metadata__"]["dess"])
        inner.pop("sha256", None)
        values, _ = tensors.read(path, len(data) + 2**20)
        inner["sha256"] = tensors.digest(inner, values)
        header["__metadata__"]["dess"] = json.dumps(inner)
        _join(path, json.dumps(header), data)


@dataclass(frozen=True)
class Forged:
    """Change a parquet file below a folder and give it the name that fits: rows, cells, parts."""

    folder: str
    position: int
    change: Literal["bytes", "parts", "rows", "values", "columns", "schema"]
    text: str

    def do(self, box: Path, ready: Path) -> None:
        files = sorted((box / self.folder).rglob("*.parquet"))
        path = files[self.position % len(files)]
        name = path.stem.rpartition("-")[0]
        if self.change == "bytes":
            content = bytearray(read_bytes(path))
            content[self.position % len(content)] ^= 1 + self.position % 255
        else:
            table = pq.read_table(pa.BufferReader(read_bytes(path)))
            table, name = self._changed(table, name)
            sink = pa.BufferOutputStream()
            pq.write_table(table, sink)
            content = sink.getvalue().to_pybytes()
        path.unlink()
        (path.parent / f"{name}-{short_hash(bytes(content))}.parquet").write_bytes(content)

    def _changed(self, table: pa.Table, name: str) -> tuple[pa.Table, str]:
        if self.change == "parts":
            with suppress(ValueError, TypeError, RecursionError):
                name = name_of(json.loads(self.text))
            parts = self.text.encode("utf-8", "surrogateescape")
            return table.replace_schema_metadata({b"dess.parts": parts}), name
        if self.change == "rows":
            return pa.concat_tables([table] * (self.position % 3)) if self.position % 3 else table[
                :0
            ], name
        if self.change == "schema":
            return table.cast(pa.schema([(n, pa.string()) for n in table.schema.names])), name
        at = self.position % table.num_columns
        if self.change == "columns":
            return table.remove_column(at), name
        field = table.schema.field(at)
        bad = {"f": float("nan"), "i": -(self.position % 2**31), "u": 2**31 - 1}
        kind = "f" if pa.types.is_floating(field.type) else "i"
        try:
            column = pa.array([bad[kind]] * len(table), field.type)
        except (pa.ArrowException, OverflowError):
            return table.remove_column(at), name
        return table.set_column(at, field, column), name


@dataclass(frozen=True)
class Node:
    """Put something that is no regular file in the place of a path, or beside it."""

    path: str
    kind: str  # of strategies.changes.NODES, or locked

    def do(self, box: Path, ready: Path) -> None:
        path = box / self.path
        path.parent.mkdir(parents=True, exist_ok=True)
        if self.kind == "locked":  # a folder that cannot be written, nor read
            path.mkdir(exist_ok=True)
            path.chmod(0o500)
            return
        if path.is_dir() and not path.is_symlink():
            shutil.rmtree(path)
        path.unlink(missing_ok=True)
        links = {"loop": path.name, "dangling": "nowhere", "secret": str(box / SECRET_FILE)}
        if self.kind == "fifo":
            os.mkfifo(path)
        elif self.kind == "folder":
            path.mkdir()
        elif self.kind in links:
            path.symlink_to(links[self.kind])
        else:
            _device(path, self.kind)


@dataclass(frozen=True)
class Odd:
    """Put something that is no regular file in the place of a file of a folder, or beside them."""

    folder: str
    position: int
    other: str | None  # a file that need not be there
    kind: str

    def do(self, box: Path, ready: Path) -> None:
        folder = box / self.folder
        paths = sorted(folder.rglob("*"))
        path = folder / self.other if self.other else paths[self.position % len(paths)]
        Node(str(path.relative_to(box)), self.kind).do(box, ready)


@dataclass(frozen=True)
class Hostile:
    """Put a text, such as the class of a Python file, into the free strings of results."""

    folder: str
    text: str

    def do(self, box: Path, ready: Path) -> None:
        sound = box / f"{self.folder}-sound"
        (box / self.folder).rename(sound)
        try:
            hostile_folder(sound, box / self.folder, self.text)
        finally:
            shutil.rmtree(sound)


@dataclass(frozen=True)
class Evil:
    """Let data name the policy of a Python file, wherever they name ``greedy``."""

    path: str

    def do(self, box: Path, ready: Path) -> None:
        path = box / self.path
        results = [manifest.parent for manifest in path.rglob("manifest.json")]
        for file in [path] if path.is_file() else path.rglob("*"):
            if file.suffix in (".json", ".toml", ".html") and not {*results} & {*file.parents}:
                text = read_text(file).replace('"greedy"', f'"{EVIL}:Evil0"')
                _write(file, (sealed(text) if file.suffix == ".html" else text).encode())
        for folder in results:
            Hostile(str(folder.relative_to(box)), f"{EVIL}:Evil").do(box, ready)


@dataclass(frozen=True)
class Rename:
    """Rename a file or folder, one of those below a folder."""

    folder: str
    position: int
    name: str

    def do(self, box: Path, ready: Path) -> None:
        paths = sorted((box / self.folder).rglob("*"))
        path = paths[self.position % len(paths)]
        try:
            path.rename(path.parent / self.name)
        except (OSError, ValueError):  # no such name is possible
            path.unlink() if path.is_file() else shutil.rmtree(path)


@dataclass(frozen=True)
class Plant:
    """Put Python files into a folder; if one of them is run, it leaves a file."""

    folder: str
    names: tuple[str, ...]

    def do(self, box: Path, ready: Path) -> None:
        for name in self.names:
            path = box / self.folder / name
            path.parent.mkdir(parents=True, exist_ok=True)
            _write(path, PLANTED.format(name=path.name).encode())


def plant_evil(box: Path) -> None:
    """The Python file that data may name; a command that imports it leaves a file."""
    path = box / CWD / EVIL
    path.write_text(PLANTED.format(name=path.name) + _CLASSES)


def _device(path: Path, kind: str) -> None:
    """A device node of our own, as the machine's must survive; a link to it if that is refused."""
    if kind == "socket":
        os.mknod(path, stat.S_IFSOCK | 0o600)
        return
    device = Path("/dev", kind)
    try:
        os.mknod(path, stat.S_IFCHR | 0o666, device.stat().st_rdev)
    except PermissionError:
        path.symlink_to(device)


def edited(text: str, edits: tuple[Edit, ...]) -> str:
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


def read_bytes(path: Path) -> bytes:
    """The content of a regular file; a pipe would block."""
    if not path.is_file():
        raise ValueError(f"{path} is no regular file")
    return path.read_bytes()


def read_text(path: Path) -> str:
    """The text of a regular file."""
    return read_bytes(path).decode()


def _write(path: Path, content: bytes) -> None:
    """Write a new or a regular file; a pipe would block, a device of the machine is not ours."""
    if path.exists() and not path.is_file():
        raise ValueError(f"{path} is no regular file")
    path.write_bytes(content)


def _split(path: Path) -> tuple[dict[str, Any], bytes]:
    """The header of a safetensors file, and the bytes after it."""
    content = read_bytes(path)
    end = 8 + int.from_bytes(content[:8], "little")
    return json.loads(content[8:end]), content[end:]


def _join(path: Path, header: str, content: bytes) -> None:
    new = header.encode("utf-8", "replace")
    _write(path, len(new).to_bytes(8, "little") + new + content)
