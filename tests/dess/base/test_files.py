"""Files: which are read, which are written, and what stays after an error."""

import errno
import os
import shutil
import socket
import subprocess
import sys
from pathlib import Path

import pytest
from filelock import FileLock

from dess.base.errors import InputError
from dess.base.files.locks import locked, temporary_folder
from dess.base.files.reading import (
    Missing,
    checked,
    parse_json,
    parse_toml,
    paths_in,
    read_bytes,
    read_text,
)
from dess.base.files.writing import (
    HOST,
    check_folder,
    check_new_folder,
    check_target,
    creating_folder,
    replacing,
    replacing_all,
    write_file,
    write_files,
)
from tests.analysis.small import files_of

ODD = ["pipe", "link", "zero", "socket", "folder", "device", "null", "long"]


@pytest.fixture
def odd(tmp_path, monkeypatch):
    """Paths in whose place something other than a regular file is."""
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "link").symlink_to(tmp_path / "pipe")
    (tmp_path / "zero").symlink_to("/dev/zero")
    monkeypatch.chdir(tmp_path)  # the names of sockets have at most 107 bytes
    with socket.socket(socket.AF_UNIX) as server:
        server.bind("socket")
    odd = {name: tmp_path / name for name in ODD} | {"folder": tmp_path}
    return odd | {"device": Path("/dev/full"), "null": Path("a\0b"), "long": Path("x" * 256)}


@pytest.mark.parametrize("name", ODD)
def test_only_regular_files_are_read_and_written(odd, tmp_path, name):
    for read in (read_bytes, read_text, lambda path: checked(path, 100)):
        with pytest.raises(InputError, match="cannot be read: .*$"):
            read(odd[name])
    if name == "device" and os.geteuid() == 0:  # root would replace the node by a file
        os.mknod(tmp_path / "device", 0o666 | 0o020000, os.makedev(1, 7))
        odd["device"] = tmp_path / "device"
    before = {path: os.lstat(path).st_ino for path in tmp_path.iterdir()}
    with pytest.raises(InputError, match="; allowed: "), replacing(odd[name]) as temporary:
        temporary.write_text("new")
    for refused in (check_target, lambda path: write_file(path, "new")):
        if name != "link":
            with pytest.raises(InputError, match="; allowed: "):
                refused(odd[name])
    assert {path: os.lstat(path).st_ino for path in tmp_path.iterdir()} == before


def test_regular_files_are_read_up_to_a_limit(tmp_path):
    path, link = tmp_path / "file", tmp_path / "link"
    path.write_bytes(b"\xef\xbb\xbfabc")
    link.symlink_to(path)
    assert read_bytes(link, 6) == path.read_bytes()
    assert read_text(link, encoding="utf-8-sig") == "abc"
    assert os.stat("/proc/cpuinfo").st_size == 0  # a file of the system has no size
    for read, large in ((read_bytes, path), (checked, path), (read_bytes, Path("/proc/cpuinfo"))):
        with pytest.raises(InputError, match="is too large; allowed: 5 bytes at most"):
            read(large, 5)
    path.write_bytes(b"\xff")
    with pytest.raises(InputError, match="it is not text"):
        read_text(path)
    for none in (tmp_path / "none", path / "none"):
        with pytest.raises(Missing, match="none: no such file; allowed: a page"):
            read_text(none, allowed="a page")


DIGITS = "9" * 5000
WRONG = [
    (parse_toml, f"quota = {DIGITS}", "too many digits"),
    (parse_toml, "quota = " + "[" * 10_000, "nested too deeply"),
    (parse_toml, ".".join(["a"] * 101) + " = 1", "nested too deeply"),
    (parse_toml, r'name = "\uD800"', "not a Unicode scalar"),
    (parse_toml, "quota", "Expected '='"),
    (parse_json, DIGITS, "too many digits"),
    (parse_json, "[" * 100_000, "nested too deeply"),
    (parse_json, r'{"name": "\ud800"}', "not text"),
    (parse_json, b"\xff", "not text"),
    (parse_json, "{", "line 1"),
]


@pytest.mark.parametrize(("parse", "text", "reason"), WRONG, ids=range(len(WRONG)))
def test_what_is_no_toml_or_json_is_a_line(parse, text, reason):
    with pytest.raises(InputError, match=f"^here: not valid (TOML|JSON): .*{reason}"):
        parse(text, "here")


@pytest.mark.parametrize("error", [OSError(errno.ENOSPC, "No space left on device"), ValueError()])
def test_after_an_error_the_old_content_stays(tmp_path, error):
    (tmp_path / "file").write_text("old")
    wanted = InputError if isinstance(error, OSError) else ValueError
    with pytest.raises(wanted), replacing(tmp_path / "file") as temporary:
        temporary.write_text("half")
        raise error
    assert files_of(tmp_path) == {"file": b"old"}


@pytest.mark.parametrize(
    ("of", "name", "use"),
    [
        (Path, "touch", lambda path: write_file(path, "new")),
        (FileLock, "acquire", lambda path: locked(path, "in use", "wait").__enter__()),
    ],
)
def test_an_interrupt_as_soon_as_a_file_is_there_leaves_none(of, name, use, tmp_path, monkeypatch):
    done = getattr(of, name)

    def interrupted(*arguments, **options):
        done(*arguments, **options)
        assert [*tmp_path.iterdir()]
        raise KeyboardInterrupt

    monkeypatch.setattr(of, name, interrupted)
    with pytest.raises(KeyboardInterrupt):
        use(tmp_path / "file")
    assert not [*tmp_path.iterdir()]


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


def test_files_are_written_with_their_folders_all_or_none(tmp_path):
    """A link is replaced, and its target stays."""
    (tmp_path / "a").mkdir()
    (tmp_path / "target").touch()
    (tmp_path / "a" / "one").symlink_to(tmp_path / "target")
    write_files({tmp_path / "a" / "one": "1", tmp_path / "b" / "two": b"2"})
    (tmp_path / "b" / "three").mkdir()
    with pytest.raises(InputError, match="three: is a folder"):
        write_files({tmp_path / "a" / "one": "new", tmp_path / "b" / "three": "3"})
    assert files_of(tmp_path) == {"a/one": b"1", "b/two": b"2", "target": b""}


def test_the_next_process_deletes_what_a_killed_one_has_left(tmp_path):
    dead = subprocess.Popen([sys.executable, "-c", ""])
    dead.wait()
    names = [f".dess-{n}-{HOST}1234.tmp" for n in (dead.pid, os.getpid(), os.getppid())]
    elsewhere = f".dess-{dead.pid}-123456789012.tmp"  # of another computer
    for name in (*names, elsewhere, other := f".notes-{dead.pid}.tmp"):
        (tmp_path / name).touch()
    (folder := tmp_path / f".dess-{dead.pid}-{HOST}0.tmp").mkdir()
    (folder / "half").touch()
    write_file(tmp_path / "file", "")
    assert {*files_of(tmp_path)} == {"file", other, elsewhere, *names[1:]}


def test_a_folder_is_there_with_all_its_files_or_not_at_all(tmp_path):
    (tmp_path / "empty").mkdir()
    (tmp_path / "link").symlink_to("empty")
    for name in ("new", "empty"):
        with pytest.raises(KeyError), creating_folder(tmp_path / name) as folder:
            (folder / "half").touch()
            raise KeyError
    assert files_of(tmp_path) == {} and not (tmp_path / "new").exists()
    for name in ("new", "link"):
        with creating_folder(tmp_path / name) as folder:
            (folder / "file").touch()
    assert files_of(tmp_path) == {"new/file": b"", "empty/file": b""}
    for name, line in {"new": "with files", "none/a": "no folder", "new/file": "Not a dir"}.items():
        with pytest.raises(InputError, match=line):
            check_new_folder(tmp_path / name)


@pytest.mark.parametrize("leads_to", ["nowhere", "link"])
def test_a_link_that_leads_nowhere_is_replaced(tmp_path, leads_to):
    (tmp_path / "link").symlink_to(leads_to)
    write_file(tmp_path / "link", "content")
    assert files_of(tmp_path) == {"link": b"content"}


@pytest.mark.parametrize("name", ["a\0b", "x" * 256, "none/" + "x" * 256, "loop", "loop/a", "gone"])
@pytest.mark.parametrize("check", [check_folder, lambda path: check_target(path / "file")])
def test_a_folder_that_cannot_be_made_is_refused(tmp_path, name, check):
    (tmp_path / "loop").symlink_to("loop")
    (tmp_path / "gone").symlink_to("nowhere")
    with pytest.raises(InputError):
        check(tmp_path / name)


def test_what_is_listed_is_not_opened(odd, tmp_path):
    (tmp_path / "a" / "b").mkdir(parents=True)
    (tmp_path / "a" / "b" / "file").touch()
    names = [path.relative_to(tmp_path).as_posix() for path in paths_in(tmp_path, "**/*")]
    assert names == ["a", "a/b", "a/b/file", "link", "pipe", "socket", "zero"]
    assert paths_in(tmp_path / "none") == paths_in(odd["pipe"]) == []


# --- locks ---


def test_a_file_system_without_locks_is_a_line_with_a_path(tmp_path, monkeypatch):
    def refuse(*_, **__):
        raise NotImplementedError("no flock")

    monkeypatch.setattr(FileLock, "acquire", refuse)
    lock = tmp_path / ".lock"
    with pytest.raises(InputError, match=rf"{lock}: its file system has no locks; allowed: "):
        locked(lock, "in use", "wait").__enter__()


def test_temporary_folders_are_removed_and_those_of_killed_processes(tmp_path):
    """A folder whose lock is free was left by a killed process; what is another's stays."""
    for name in ("other", "t-living", "t-dead"):
        write_file(tmp_path / name / "deep" / "file", "half")
        (tmp_path / f"{name}.lock").touch()
    (tmp_path / "t-link").symlink_to(tmp_path / "other")
    (tmp_path / "t-link.lock").touch()
    with FileLock(tmp_path / "t-living.lock"), temporary_folder(tmp_path, "t-") as one:
        with pytest.raises(KeyboardInterrupt), temporary_folder(tmp_path, "t-") as other:
            assert other.stat().st_mode & 0o077 == 0 and one != other  # of this user only
            (other / "file").write_text("half")
            raise KeyboardInterrupt
        assert one.is_dir() and not other.exists()
    assert {name for name in files_of(tmp_path) if not name.endswith(".lock")} == {
        *("other/deep/file", "t-living/deep/file")
    }


def test_an_interrupt_while_a_temporary_folder_is_removed_leaves_none(tmp_path, monkeypatch):
    remove, interrupts = shutil.rmtree, [KeyboardInterrupt]

    def interrupted(folder, **options):
        if interrupts:
            raise interrupts.pop()
        remove(folder, **options)

    monkeypatch.setattr("dess.base.files.locks.shutil.rmtree", interrupted)
    with pytest.raises(KeyboardInterrupt), temporary_folder(tmp_path, "t-") as folder:
        (folder / "file").write_text("half")
    assert not [*tmp_path.iterdir()]


def test_processes_wait_for_each_other_but_not_for_ever(tmp_path):
    lock = tmp_path / "new" / ".lock"
    refused = pytest.raises(InputError, match="new: busy; allowed: wait")
    with locked(lock, "busy", "wait"), refused, locked(lock, "busy", "wait", 0.05):
        raise AssertionError("two at a time")
    with locked(lock, "busy", "wait"):
        pass
    assert list(lock.parent.iterdir()) == []


@pytest.mark.parametrize("kind", ["link", "loop", "dangling", "pipe", "folder"])
def test_a_lock_is_a_file_of_its_own(kind, tmp_path):
    path, outside = tmp_path / ".lock", tmp_path / "outside"
    outside.write_text("another's")
    links = {"link": outside, "loop": path, "dangling": tmp_path / "none"}
    if kind in links:
        path.symlink_to(links[kind])
    else:
        os.mkfifo(path) if kind == "pipe" else path.mkdir()
    with pytest.raises(InputError, match=r"\.lock: .*; allowed: "), locked(path, "busy", "wait"):
        raise AssertionError("not locked")
    assert os.path.lexists(path) and outside.read_text() == "another's"
