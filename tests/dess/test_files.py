"""Files: which are read, which are written, and what stays after an error."""

import errno
import os
import socket
import subprocess
import sys
from pathlib import Path

import pytest

from dess.errors import InputError
from dess.files.parsing import parse_json, parse_toml
from dess.files.reading import Missing, checked, paths_in, read_bytes, read_text
from dess.files.writing import (
    check_folder,
    check_target,
    replacing,
    replacing_all,
    write_file,
    write_files,
)
from tests.analysis.small import files_of


@pytest.fixture
def odd(tmp_path: Path) -> dict[str, Path]:
    """Paths in whose place something other than a regular file is."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    server = socket.socket(socket.AF_UNIX)
    here = Path.cwd()
    os.chdir(tmp_path)  # the names of sockets have at most 107 bytes
    server.bind("socket")
    os.chdir(here)
    server.close()
    names = ("pipe", "link", "zero", "socket")
    odd = {name: tmp_path / name for name in names} | {"folder": tmp_path}
    odd |= {"device": Path("/dev/full"), "null": tmp_path / "a\0b", "long": tmp_path / ("x" * 256)}
    return odd


ODD = ["pipe", "link", "zero", "socket", "folder", "device", "null", "long"]


@pytest.mark.parametrize("name", ODD)
@pytest.mark.parametrize("read", [read_bytes, read_text, lambda path: checked(path, 100)])
def test_only_regular_files_are_read(odd, name, read):
    with pytest.raises(InputError, match="cannot be read: ") as error:
        read(odd[name])
    assert "\n" not in str(error.value)


def test_regular_files_are_read_up_to_a_limit(tmp_path):
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_bytes(b"\xef\xbb\xbfabc")
    link.symlink_to(path)
    assert read_bytes(link, 6) == path.read_bytes()
    assert read_text(link, encoding="utf-8-sig") == "abc"
    with pytest.raises(InputError, match="is too large; allowed: 5 bytes at most"):
        read_bytes(path, 5)
    with pytest.raises(InputError, match="is too large"):
        checked(path, 5)
    path.write_bytes(b"\xff")
    with pytest.raises(InputError, match="it is not text"):
        read_text(path)


def test_a_file_of_the_system_has_no_size_but_a_limit():
    assert os.stat("/proc/cpuinfo").st_size == 0
    with pytest.raises(InputError, match="is too large; allowed: 10 bytes at most"):
        read_bytes(Path("/proc/cpuinfo"), 10)


@pytest.mark.parametrize("read", [read_bytes, read_text])
def test_callers_say_what_is_missing(tmp_path, read):
    (tmp_path / "file").touch()
    for path in (tmp_path / "none", tmp_path / "file" / "none"):
        with pytest.raises(Missing, match="none: no such file; allowed: a page"):
            read(path, allowed="a page")


DIGITS = "9" * 5000
WRONG_TOML = {
    "digits": (f"quota = {DIGITS}", "too many digits"),
    "deep": ("quota = " + "[" * 10_000, "nested too deeply"),
    "dots": (".".join(["a"] * 10_000) + " = 1", "nested too deeply"),
    "quoted dots": (".".join(['"a b"'] * 10_000) + " = 1", "nested too deeply"),
    "surrogate": (r'name = "\uD800"', "not a Unicode scalar"),
    "form": ("quota", "Expected '='"),
}
WRONG_JSON = {
    "digits": (DIGITS, "too many digits"),
    "deep": ("[" * 100_000, "nested too deeply"),
    "surrogate": (r'{"name": "\ud800"}', "not text"),
    "bytes": (b"\xff", "not text"),
    "form": ("{", "line 1"),
}


@pytest.mark.parametrize(("text", "reason"), WRONG_TOML.values(), ids=WRONG_TOML)
def test_what_is_no_toml_is_a_line(text, reason):
    with pytest.raises(InputError, match=f"^here: not valid TOML: .*{reason}"):
        parse_toml(text, "here")


@pytest.mark.parametrize(("text", "reason"), WRONG_JSON.values(), ids=WRONG_JSON)
def test_what_is_no_json_is_a_line(text, reason):
    with pytest.raises(InputError, match=f"^here: not valid JSON: .*{reason}"):
        parse_json(text, "here")


@pytest.mark.parametrize("name", ODD)
def test_only_new_and_regular_files_are_written(odd, tmp_path, name):
    if name == "device" and os.geteuid() == 0:  # root would replace the node by a file
        os.mknod(tmp_path / "device", 0o666 | 0o020000, os.makedev(1, 7))
        odd["device"] = tmp_path / "device"
    before = {path: os.lstat(path).st_ino for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match="; allowed: "), replacing(odd[name]) as temporary:
        temporary.write_text("new")
    assert {path: os.lstat(path).st_ino for path in tmp_path.iterdir()} == before


def test_a_link_is_replaced_and_its_target_stays(tmp_path):
    target, link = tmp_path / "target", tmp_path / "link"
    target.write_text("old")
    link.symlink_to(target)
    with replacing(link) as temporary:
        temporary.write_text("new")
    assert (target.read_text(), link.read_text()) == ("old", "new")


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), ValueError()])
def test_after_an_error_the_old_content_stays(tmp_path, error):
    path = tmp_path / "file"
    path.write_text("old")
    wanted = InputError if isinstance(error, OSError) else ValueError
    with pytest.raises(wanted), replacing(path) as temporary:
        temporary.write_text("half")
        raise error
    assert {p.name: p.read_text() for p in tmp_path.iterdir()} == {"file": "old"}


def test_files_of_one_command_come_together(tmp_path, monkeypatch):
    paths = [tmp_path / "old", tmp_path / "new", tmp_path / "other"]
    paths[0].write_text("before")
    replace, calls = os.replace, []

    def fail_at_third(*names):
        calls.append(names)
        if len(calls) == 3:
            raise PermissionError(errno.EPERM, "Operation not permitted")
        replace(*names)

    monkeypatch.setattr(os, "replace", fail_at_third)
    with pytest.raises(InputError, match="other: cannot be written"), replacing_all(paths) as files:
        for file in files:
            file.write_text("after")
    assert files_of(tmp_path) == {"old": b"after"}


def test_the_next_process_deletes_what_a_killed_one_has_left(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    for process in (dead.pid, os.getpid(), os.getppid()):
        (tmp_path / f".dess-{process}-12345678.tmp").touch()
    (tmp_path / f".notes-{dead.pid}.tmp").touch()
    with replacing(tmp_path / "file"):
        pass
    left = {path.name for path in tmp_path.iterdir() if path.name.startswith(".")}
    kept = {f".dess-{process}-12345678.tmp" for process in (os.getpid(), os.getppid())}
    assert left == kept | {f".notes-{dead.pid}.tmp"}


@pytest.mark.parametrize("name", ["a\0b", "x" * 256, "none/" + "x" * 256, "loop", "loop/a", "gone"])
@pytest.mark.parametrize("check", [check_folder, lambda path: check_target(path / "file")])
def test_a_folder_that_cannot_be_made_is_refused(tmp_path, name, check):
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "gone").symlink_to("nowhere")
    with pytest.raises(InputError):
        check(tmp_path / name)


@pytest.mark.parametrize("name", ["pipe", "zero", "socket", "folder", "device", "null", "long"])
def test_what_could_not_be_written_is_refused_before(odd, name):
    with pytest.raises(InputError, match="; allowed: "):
        check_target(odd[name])
    with pytest.raises(InputError, match="; allowed: "):
        write_file(odd[name], "new")


def test_what_is_listed_is_not_opened(odd, tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "file").touch()
    names = [path.relative_to(tmp_path).as_posix() for path in paths_in(tmp_path, "**/*")]
    assert names == ["a", "a/b", "a/b/file", "link", "pipe", "socket", "zero"]
    assert paths_in(tmp_path / "none") == paths_in(odd["pipe"]) == []


def test_files_are_written_with_their_folders_all_or_none(tmp_path):
    write_files({tmp_path / "a" / "one": "1", tmp_path / "b" / "two": b"2"})
    assert files_of(tmp_path) == {"a/one": b"1", "b/two": b"2"}
    (tmp_path / "b" / "three").mkdir()
    with pytest.raises(InputError, match="three: is a folder"):
        write_files({tmp_path / "a" / "one": "new", tmp_path / "b" / "three": "3"})
    assert files_of(tmp_path) == {"a/one": b"1", "b/two": b"2"}
