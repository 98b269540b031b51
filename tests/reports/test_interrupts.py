"""SIGTERM and SIGHUP end a command as Ctrl-C does, whatever it is doing."""

import contextlib
import os
import signal
import subprocess
import sys
import threading
import time

import pytest
from numba.core import serialize

from dess.reports import cli
from dess.reports.interrupts import AGAIN, Interrupts
from tests.analysis.small import environment, files_of, small_study

pytestmark = pytest.mark.skipif(os.name != "posix", reason="sends signals")

LINE = "interrupted: run the same command again to complete it\n"
SIGNALS = [signal.SIGINT, signal.SIGTERM, signal.SIGHUP]


@pytest.fixture(autouse=True)
def heeded():
    """The signals are not ignored, as they are in some jobs of a shell."""
    handlers = [signal.signal(number, signal.default_int_handler) for number in SIGNALS]
    yield
    for number, handler in zip(SIGNALS, handlers, strict=True):
        signal.signal(number, handler)


def during(work, monkeypatch, capsys):
    """The exit code, the output and the errors of a command while something else is done."""
    monkeypatch.setattr("dess.model.mission.simulate", lambda *_, **__: work())
    return cli.main(["simulate"]), *capsys.readouterr()


@pytest.mark.parametrize("number", SIGNALS)
def test_a_signal_ends_a_command_with_one_line(number, monkeypatch, capsys):
    heeded = [*SIGNALS, signal.SIGALRM]
    before = [signal.getsignal(each) for each in heeded], sys.unraisablehook
    signalled = during(lambda: signal.raise_signal(number), monkeypatch, capsys)
    assert signalled == (130, "", LINE)
    assert ([signal.getsignal(each) for each in heeded], sys.unraisablehook) == before
    assert signal.getitimer(signal.ITIMER_REAL) == (0, 0)


def test_what_a_library_makes_of_a_signal_is_an_interruption(monkeypatch, capsys):
    def replaced():
        try:
            signal.raise_signal(signal.SIGTERM)
        except KeyboardInterrupt:
            raise SystemError("returned a result with an exception set") from None

    assert during(replaced, monkeypatch, capsys) == (130, "", LINE)


def test_a_second_signal_does_not_disturb_the_cleanup(monkeypatch, capsys):
    cleaned = []

    def twice():
        try:
            signal.raise_signal(signal.SIGHUP)
        finally:
            signal.raise_signal(signal.SIGTERM)
            time.sleep(2 * AGAIN)
            cleaned.append(True)

    assert during(twice, monkeypatch, capsys) == (130, "", LINE)
    assert cleaned == [True]


def in_a_finalizer():
    class Finalized:
        def __del__(self):
            signal.raise_signal(signal.SIGTERM)

    Finalized()


def swallowed():
    with contextlib.suppress(BaseException):
        signal.raise_signal(signal.SIGTERM)


@pytest.mark.parametrize("lose", [in_a_finalizer, swallowed])
def test_a_signal_is_not_lost(lose, monkeypatch, capsys):
    def lost():
        lose()
        threading.Event().wait(60)

    begin = time.monotonic()
    assert during(lost, monkeypatch, capsys) == (130, "", LINE)
    assert time.monotonic() - begin < 30


def test_a_signal_waits_while_compiled_code_calls_python(monkeypatch, capsys):
    class Signalling(dict):
        def __getitem__(self, key):
            signal.raise_signal(signal.SIGTERM)
            return "object"

    monkeypatch.setattr(serialize, "_unpickled_memo", Signalling())
    unpickled = []

    def call():
        unpickled.append(serialize._numba_unpickle(0, b"", b""))  # as what boxes an array does
        threading.Event().wait(60)

    assert during(call, monkeypatch, capsys) == (130, "", LINE)
    assert unpickled == ["object"]


@pytest.mark.parametrize("words", [["--version"], ["simulate", "--policy", "nobody"]])
def test_a_signal_after_a_command_comes_too_late(words, monkeypatch, capsys):
    expected = cli.main(words), *capsys.readouterr()
    leave = Interrupts.__exit__

    def leave_late(interrupts, *error):
        signal.raise_signal(signal.SIGTERM)
        time.sleep(2 * AGAIN)
        leave(interrupts, *error)

    monkeypatch.setattr(Interrupts, "__exit__", leave_late)
    assert (cli.main(words), *capsys.readouterr()) == expected


def test_a_signal_that_was_ignored_stays_ignored(monkeypatch, capsys):
    signal.signal(signal.SIGHUP, signal.SIG_IGN)  # as nohup does
    with Interrupts() as interrupts:
        signal.raise_signal(signal.SIGHUP)
    assert not interrupts.received
    assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN


def test_a_command_in_another_thread_has_no_handlers(monkeypatch, capsys):
    codes = []
    thread = threading.Thread(target=lambda: codes.append(cli.main(["--version"])))
    thread.start()
    thread.join()
    assert codes == [0]


def test_a_signal_during_the_imports_ends_the_command(tmp_path):
    small_study(tmp_path)
    before = files_of(tmp_path)
    script = (
        "import importlib.abc, os, sys\n"
        "class Signal(importlib.abc.MetaPathFinder):\n"
        "    def find_spec(self, name, path, target=None):\n"
        f"        if name == 'typer': os.kill(os.getpid(), {int(signal.SIGTERM)})\n"
        "from dess.reports.cli import main\n"
        "sys.meta_path.insert(0, Signal())\n"
        "sys.exit(main())\n"
    )
    command = [sys.executable, "-c", script, "study", "run", "trial.toml", "--out", "out"]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment(), capture_output=True, text=True, timeout=60
    )
    assert (done.returncode, done.stdout, done.stderr) == (130, "", LINE)
    assert files_of(tmp_path) == before


NOTICED = """
import hashlib, signal, sys, time, typer
import dess.model.mission
from dess.reports.cli import main

def noticed(*_, **__):
    before = signal.signal(signal.SIGTERM, lambda *_: None)
    signal.raise_signal(signal.SIGTERM)
    time.sleep(0.2)
    signal.signal(signal.SIGTERM, before)
    hashlib.pbkdf2_hmac("md5", b"", b"", 4_000_000)  # two seconds
    raise typer.Exit(7)

dess.model.mission.simulate, sys.argv = noticed, ["dess", "simulate"]
sys.exit(main())
"""


@pytest.mark.slow
@pytest.mark.brief
def test_a_signal_that_another_handler_has_noticed_does_not_end_the_process(tmp_path):
    """As that of a training, which ends after its tick and restores the handler of before."""
    words = [sys.executable, "-c", NOTICED]
    done = subprocess.run(words, cwd=tmp_path, capture_output=True, text=True, timeout=120)
    assert (done.returncode, done.stderr) == (7, "")


BUSY = """
import hashlib, pathlib, sys
import dess.model.mission
from dess.base.files.writing import replacing
from dess.reports.cli import main

def busy(*_, **__):
    with replacing(pathlib.Path("there")) as temporary:
        temporary.touch()
        print("busy", flush=True)
        hashlib.pbkdf2_hmac("md5", b"", b"", 2**31 - 1)

dess.model.mission.simulate, sys.argv = busy, ["dess", "simulate"]
sys.exit(main())
"""


@pytest.mark.slow
@pytest.mark.brief
def test_a_signal_ends_a_command_that_is_in_code_that_notices_none(tmp_path):
    """As the compiler of functions: the main thread runs no Python for a long time."""
    words, pipe = [sys.executable, "-c", BUSY], subprocess.PIPE
    with subprocess.Popen(words, cwd=tmp_path, stdout=pipe, stderr=pipe, text=True) as child:
        assert child.stdout.readline() == "busy\n"
        assert len([*tmp_path.iterdir()]) == 1
        time.sleep(0.5)  # until it is there
        child.send_signal(signal.SIGTERM)
        assert child.communicate()[1].lstrip() == LINE
    assert child.returncode == 130
    assert [*tmp_path.iterdir()] == []
