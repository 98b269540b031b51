"""Temporary folders: those of killed processes are removed, those of others are not."""

import os
from pathlib import Path

import pytest
from filelock import FileLock

from dess import InputError
from dess.files.locks import locked, temporary_folder

PREFIX = "dess-trial-"


def leave(parent: Path, name: str) -> Path:
    """A folder with a file, as a process leaves it that is killed; its lock is free."""
    folder = parent / f"{PREFIX}{name}"
    (folder / "deep").mkdir(parents=True)
    (folder / "deep" / "file").write_text("half")
    folder.with_suffix(".lock").touch()
    return folder


def test_a_folder_is_removed_at_the_end_also_after_an_error(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), temporary_folder(tmp_path, PREFIX) as folder:
        assert folder.stat().st_mode & 0o077 == 0  # of this user only
        (folder / "file").write_text("half")
        raise KeyboardInterrupt
    assert list(tmp_path.iterdir()) == []


def test_what_killed_processes_left_is_removed_and_nothing_else(tmp_path: Path) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere" / "file").write_text("of somebody")
    (tmp_path / f"{PREFIX}link").symlink_to(tmp_path / "elsewhere")
    (tmp_path / f"{PREFIX}link.lock").touch()
    living, _ = leave(tmp_path, "living"), leave(tmp_path, "dead")
    with FileLock(living.with_suffix(".lock")):
        first, second = (temporary_folder(tmp_path, PREFIX) for _ in range(2))
        with first as one, second as other:
            assert one.is_dir() and other.is_dir() and one != other
        assert (living / "deep" / "file").exists()
    assert not (tmp_path / f"{PREFIX}dead").exists()
    assert (tmp_path / "elsewhere" / "file").exists()


def test_processes_wait_for_each_other_but_not_for_ever(tmp_path: Path) -> None:
    folder = tmp_path / "new"
    refused = pytest.raises(InputError, match="new: busy")
    with locked(folder / ".lock", "busy"), refused, locked(folder / ".lock", "busy", 0.05):
        raise AssertionError("two at a time")
    with locked(folder / ".lock", "busy"):
        pass
    assert list(folder.iterdir()) == []


@pytest.mark.parametrize("kind", ["link", "loop", "dangling", "pipe", "folder"])
def test_a_lock_is_a_file_of_its_own(kind: str, tmp_path: Path) -> None:
    path, outside = tmp_path / ".lock", tmp_path / "outside"
    outside.write_text("of somebody")
    links = {"link": outside, "loop": path, "dangling": tmp_path / "none"}
    if kind in links:
        path.symlink_to(links[kind])
    else:
        os.mkfifo(path) if kind == "pipe" else path.mkdir()
    with pytest.raises(InputError, match=r"\.lock: .*; allowed: "), locked(path, "busy"):
        raise AssertionError("not locked")
    assert os.path.lexists(path) and outside.read_text() == "of somebody"
