"""Commands that break the contract, each in one way, so that the judge has something to find."""

import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path
from textwrap import dedent

import pyarrow as pa
import pyarrow.parquet as pq

NAMES = {"Path": Path, "pa": pa, "pq": pq, "subprocess": subprocess, "suppress": suppress}
NAMES |= {"sys": sys, "time": time}


def _says(text: str, code: int) -> str:
    """The source of a command that prints a line on standard error and ends with a code."""
    return f"print({text!r}, file=sys.stderr); sys.exit({code})"


# The source of each fault, with what the judge says about it.
FAULTS = {
    "raise ValueError('planted')": "a traceback on stderr: ValueError: planted",
    "sys.exit(3)": "exit code 3",
    _says("one\nallowed: two", 2): "2 lines in place of one error",
    "sys.exit(1)": "without a line that says why",
    _says(f"allowed: {'x' * 292}", 2): "a line of 301 characters",
    "print('\\x1b[31mred')": "raw characters on stdout",
    _says("a name with \u202e in it; allowed: others", 2): "raw characters on stderr",
    "while True:\n with suppress(KeyboardInterrupt): time.sleep(100)": "did not end within 2 sec",
    "subprocess.Popen(['sleep', '30'], start_new_session=True)": "left a process: sleep 30",
    "Path('left').touch()": "cwd/left: was not there",
    "Path('~/.left').expanduser().touch()": "home/.left: was not there",
    "Path('../out/.a.parquet.1.tmp').touch()": ".tmp: was left behind",
    "Path('../out/.rendering-1').mkdir()": ".rendering-1: was left behind",
    "Path('../out/a.png').write_bytes(b'PNG')": "is only a part of a file",
    "Path('../in/a.toml').write_text('changed')": "in/a.toml: was file",
    "Path('../out/device').unlink(); Path('../out/device').touch()": "out/device: was node",
    "bytearray(2 * 2**30)": "a traceback on stderr: MemoryError",
    _says("/a/b.py:3: RuntimeWarning: overflow", 0): "a warning of Python",
    _says("report a: KeyError: 'missions'", 1): "a word of a library, KeyError",
    _says("this is not possible", 2): "a line without what is allowed",
    _says("1 of 0 differ", 1): "more than there are: 1 of 0 differ",
    "print(Path('~/secret.csv').expanduser().read_text())": "a file that the user has not named",
    "Path('../out/evil.py.ran').touch()": "code of the input was run",
    dedent("""
        Path('../out/a/missions').mkdir(parents=True)
        pq.write_table(pa.table({'a': [1]}), '../out/a/missions/a.parquet')
        print('unknown; allowed: others', file=sys.stderr)
        sys.exit(2)
    """): "missions were simulated before the input was refused",
}
# Those that are interrupted.
LASTING = {
    dedent("""
        with suppress(KeyboardInterrupt):
            time.sleep(100)
        print('interrupted', file=sys.stderr)
        sys.exit(130)
    """): "it waited for something",
    dedent("""
        with suppress(KeyboardInterrupt):
            while True: pass
        begun = time.process_time()
        while time.process_time() < begun + 3: pass
        print('interrupted', file=sys.stderr)
        sys.exit(130)
    """): "seconds of CPU time to end after a signal",
}


def main() -> int:
    """Break the contract as the first argument of the process says."""
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    exec(sys.argv[1], {**NAMES})
    return 0
