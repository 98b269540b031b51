"""Commands that break the contract, each in one way, so that the judge has something to find."""

import signal
import subprocess
import sys
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq


def _traceback() -> int:
    raise ValueError("planted")


def _strange_code() -> int:
    return 3


def _two_lines() -> int:
    print("one\nallowed: two", file=sys.stderr)
    return 2


def _silent_failure() -> int:
    return 1


def _long_line() -> int:
    print(f"allowed: {'x' * 292}", file=sys.stderr)
    return 2


def _escape() -> int:
    print("\x1b[31mred")
    return 0


def _direction() -> int:
    print("a name with \u202e in it; allowed: others", file=sys.stderr)
    return 2


def _hang() -> int:
    while True:
        with suppress(KeyboardInterrupt):
            time.sleep(100)


def _process() -> int:
    subprocess.Popen(["sleep", "30"], start_new_session=True)
    return 0


def _file_elsewhere() -> int:
    Path("left").touch()
    return 0


def _file_at_home() -> int:
    Path("~/.left").expanduser().touch()
    return 0


def _temporary_file() -> int:
    Path("../out/.a.parquet.1.tmp").touch()
    return 0


def _temporary_folder() -> int:
    Path("../out/.rendering-1").mkdir()
    return 0


def _half_a_file() -> int:
    Path("../out/a.png").write_bytes(b"\x89PNG\r\n")
    return 0


def _changed_input() -> int:
    Path("../in/a.toml").write_text("changed")
    return 0


def _removed_device() -> int:
    Path("../out/device").unlink()
    Path("../out/device").touch()
    return 0


def _memory() -> int:
    return len(bytearray(2 * 2**30))


def _warning() -> int:
    print("/a/b.py:3: RuntimeWarning: overflow", file=sys.stderr)
    return 0


def _library() -> int:
    print("report verification: KeyError: 'missions'", file=sys.stderr)
    return 1


def _no_choice() -> int:
    print("this is not possible", file=sys.stderr)
    return 2


def _too_many() -> int:
    print("1 of 0 differ", file=sys.stderr)
    return 1


def _secret() -> int:
    print(Path("~/secret.csv").expanduser().read_text())
    return 0


def _code_that_runs() -> int:
    Path("../out/evil.py.ran").touch()
    return 0


def _late_refusal() -> int:
    folder = Path("../out/a/missions")
    folder.mkdir(parents=True)
    pq.write_table(pa.table({"a": [1]}), folder / "a.parquet")
    print("unknown; allowed: others", file=sys.stderr)
    return 2


def _wait() -> int:
    with suppress(KeyboardInterrupt):
        time.sleep(100)
    print("interrupted", file=sys.stderr)
    return 130


def _slow_end() -> int:
    with suppress(KeyboardInterrupt):
        while True:
            pass
    begun = time.process_time()
    while time.process_time() < begun + 3:
        pass
    print("interrupted", file=sys.stderr)
    return 130


# Each fault, with what the judge says about it.
FAULTS: dict[Callable[[], int], str] = {
    _traceback: "a traceback on stderr: ValueError: planted",
    _strange_code: "exit code 3",
    _two_lines: "2 lines in place of one error",
    _silent_failure: "without a line that says why",
    _long_line: "a line of 301 characters",
    _escape: "raw characters on stdout",
    _direction: "raw characters on stderr",
    _hang: "did not end within 2 seconds",
    _process: "left a process: sleep 30",
    _file_elsewhere: "cwd/left: was not there",
    _file_at_home: "home/.left: was not there",
    _temporary_file: ".tmp: was left behind",
    _temporary_folder: ".rendering-1: was left behind",
    _half_a_file: "is only a part of a file",
    _changed_input: "in/a.toml: was file",
    _removed_device: "out/device: was node",
    _memory: "a traceback on stderr: MemoryError",
    _warning: "a warning of Python",
    _library: "a word of a library, KeyError",
    _no_choice: "a line without what is allowed",
    _too_many: "more than there are: 1 of 0 differ",
    _secret: "the content of a file that the user has not named",
    _code_that_runs: "code of the input was run",
    _late_refusal: "missions were simulated before the input was refused",
    _wait: "it waited for something",
    _slow_end: "seconds of CPU time to end after a signal",
}
LASTING = (_wait, _slow_end)  # those that are interrupted


def main() -> int:
    """Break the contract as the first argument of the process says."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    return {fault.__name__: fault for fault in FAULTS}[sys.argv[1]]()
