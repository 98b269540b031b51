"""The contract of every command, as a judge of what a case has done."""

import json
import re
import stat
import unicodedata
import zipfile
from collections.abc import Callable, Iterator
from io import BytesIO
from pathlib import Path

import pyarrow.parquet as pq
from PIL import Image

from tests.fuzz.case import SECRET
from tests.fuzz.child import STDERR, STDOUT
from tests.fuzz.forks import Outcome
from tests.reports.here import FOLDER

CODES = {0: "done", 1: "failed", 2: "bad input", 130: "interrupted"}
LINE = 300  # characters
ENDING = 2  # seconds of CPU time after a signal
# Words of Python or of a library in a line for a user.
_INNER = re.compile(
    r"\b(?!InputError)[A-Z]\w*(Error|Exception|Warning)\b|Input should be|validation error"
)
# What is allowed, or the words where there is no choice: of typer, of parsers, of damaged files.
_CHOICE = re.compile(r"allowed|\(see dess|not valid (TOML|JSON)|(are|is) made by|damaged")
_COUNT = re.compile(r"\b(\d[\d,]*) of (\d[\d,]*)\b")
_BIDI = {*map(chr, range(0x202A, 0x202F)), *map(chr, range(0x2066, 0x206A))}
_RAW = {"Cc", "Cs", "Zl", "Zp"}  # categories of characters that must not reach a terminal
# Lines on standard error that say what a command does, and no error.
_NEWS = re.compile(
    r"compiling the simulator .*|(at least )?[\d,]+ missions?(, [\d,]+ of them present)?"
    r"|.*\[\d+:[\d:]+[<,] ?.*\]|on this machine: .* to go|replay memory: .*|curves: tensorboard .*"
    r"|.*: this training is not finished .*|.*: there are no integers of these weights, .*"
)
# Folders of others: one that a library makes and uses again, which has the name of the user; and
# those in which the fuzzer runs notebooks, as a signal may come before one is removed.
_FOREIGN = ("tmp/torchinductor_", f"tmp/{FOLDER}")
# A page of numbers that nobody measured may fail, and then names the error of its notebook.
_OF_PAGE = re.compile(r"report [\w-]+: ")
_FORGING = ("forge(", "change_json(", "change_page(")  # steps that change numbers of results
_WARNING = re.compile(r"\.py:\d+: \w*Warning")


def findings(outcome: Outcome) -> list[str]:
    """How an outcome breaks the contract; none if it keeps it."""
    rules = (_ending, _output, _errors, _files, _nodes)
    return [finding for rule in rules for finding in rule(outcome)]


def _ending(outcome: Outcome) -> Iterator[str]:
    killed = [-number for _, number in outcome.case.signals if number == 9]
    if outcome.late:
        yield f"it did not end within {outcome.case.seconds:g} seconds"
    elif outcome.code not in (CODES if outcome.case.again else {*CODES, *killed}):
        yield f"exit code {outcome.code}"
    elif outcome.case.code not in (None, outcome.code):
        yield f"exit code {outcome.code} in place of {outcome.case.code}"
    if outcome.waited and outcome.code == 130:
        yield "it waited for something until it was interrupted"
    if outcome.ending > ENDING:
        yield f"it took {outcome.ending:.1f} seconds of CPU time to end after a signal"
    for name in outcome.left:
        yield f"left a process: {name}"


def _output(outcome: Outcome) -> Iterator[str]:
    for stream in (STDOUT, STDERR):
        text = outcome.text(stream)
        if "Traceback (most recent call last)" in text or "Exception ignored in" in text:
            yield f"a traceback on {stream}: {text.strip().splitlines()[-1][:LINE]}"
        elif _WARNING.search(text):
            yield f"a warning of Python on {stream}"
        if SECRET in text:
            yield f"the content of a file that the user has not named on {stream}"
        odd = {*text} - {"\n", "\r", "\t"}
        if raw := sorted(c for c in odd if unicodedata.category(c) in _RAW or c in _BIDI):
            yield f"raw characters on {stream}: {ascii(raw)[:LINE]}"


def _errors(outcome: Outcome) -> Iterator[str]:
    lines = [line for line in re.split(r"[\n\r]+", outcome.text(STDERR)) if line.strip()]
    for line in lines:
        if "allowed: allowed:" in line:
            yield f"a line that says twice that something is allowed: {line[:LINE]}"
        if "not enough memory" in line:
            yield "the memory did not suffice; a refusal has to come first"
        if len(line) > LINE:
            yield f"a line of {len(line)} characters on stderr: {line[:60]}"
        for part, whole in _COUNT.findall(line):
            if int(part.replace(",", "")) > int(whole.replace(",", "")):
                yield f"more than there are: {line[:LINE]}"
    errors = [line for line in lines if not _NEWS.fullmatch(line.strip())]
    if outcome.code == 130:  # what is noted of a command that has begun
        errors = [line for line in errors if not line.startswith("note: ")]
    if outcome.code in (2, 130) and len(errors) != 1:
        yield f"{len(errors)} lines in place of one error: {' | '.join(errors)[:LINE]}"
    has_reader = outcome.case.stdout != "closed"  # one that has seen enough needs no line
    if outcome.code == 1 and not errors and has_reader:
        yield "exit code 1 without a line that says why"
    if outcome.case.file_size and len(errors) > 1:
        yield f"{len(errors)} lines in place of one error: {' | '.join(errors)[:LINE]}"
    if outcome.code == 2 and errors and not _CHOICE.search(errors[-1]):
        yield f"a line without what is allowed: {errors[-1]}"
    for line in errors:
        if "Traceback" in line or "(see dess" in line:
            return
        if _is_failed_page(outcome, line):
            continue
        if found := _INNER.search(line):
            yield f"a word of a library, {found[0]}: {line}"


def _is_failed_page(outcome: Outcome, line: str) -> bool:
    """Whether a line says that the notebook of a page has failed, on forged results."""
    is_forged = any(str(step).startswith(_FORGING) for step in outcome.case.steps)
    return outcome.code == 1 and is_forged and _OF_PAGE.search(line) is not None


def _files(outcome: Outcome) -> Iterator[str]:
    # A full disk may be noticed after missions have been simulated.
    is_refused = outcome.code == 2 and not (outcome.case.again or outcome.case.file_size)
    for path in sorted(outcome.before.keys() | outcome.after.keys()):
        before, after = outcome.before.get(path), outcome.after.get(path)
        is_allowed = any(_is_in(path, folder) for folder in outcome.case.allowed)
        if before == after or path.startswith(_FOREIGN):
            continue
        if path.endswith((".ran", ".pyc")):
            yield f"{path}: code of the input was run"
            continue
        is_of_missions = "/missions/" in path and path.endswith(".parquet")
        if is_refused and before is None and is_of_missions:
            yield f"{path}: missions were simulated before the input was refused"
        if not is_allowed:
            yield f"{path}: was {before or 'not there'}, is {after or 'not there'}"
        elif after is not None and _is_temporary(path):
            yield f"{path}: was left behind"
        elif after is not None and after.startswith("file") and not _is_whole(outcome.box / path):
            yield f"{path}: is only a part of a file"
        elif before is not None and before.startswith("node") and after != before:
            yield f"{path}: was {before}, is {after}"


def _is_in(path: str, folder: str) -> bool:
    """Whether it is below a folder, or one of the folders above it, which may be made."""
    return path.startswith(f"{folder}/") or folder.startswith(f"{path}/") or path == folder


def _is_temporary(path: str) -> bool:
    return any(p.endswith(".tmp") or p.startswith(".rendering-") for p in path.split("/"))


def _zip(content: bytes) -> None:
    with zipfile.ZipFile(BytesIO(content)) as archive:
        assert archive.testzip() is None


def _html(content: bytes) -> None:
    assert content.decode().rstrip().endswith("</html>")


_READERS: dict[str, Callable[[bytes], object]] = {
    ".parquet": lambda content: pq.read_table(BytesIO(content)),
    ".json": json.loads,
    ".png": lambda content: Image.open(BytesIO(content)).load(),
    ".gif": lambda content: Image.open(BytesIO(content)).load(),
    ".html": _html,
    ".zip": _zip,
}


def _is_whole(path: Path) -> bool:
    """Whether a file that a command has written can be read."""
    try:
        _READERS.get(path.suffix, lambda content: None)(path.read_bytes())
    except Exception:  # whatever the reader raises
        return False
    return True


def _nodes(outcome: Outcome) -> Iterator[str]:
    for name in ("null", "zero", "full"):
        if not stat.S_ISCHR(Path("/dev", name).stat().st_mode):
            yield f"/dev/{name} is no device any more"
