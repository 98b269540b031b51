"""The process of a case: it limits itself, and runs the command."""

import atexit
import os
import resource
import signal
import sys
import tempfile
import threading
from contextlib import nullcontext
from pathlib import Path

import matplotlib

from dess.reports.cli import main
from tests.fuzz.case import CWD, HOME, LOG, TEMPORARY, Case
from tests.reports.here import notebooks_here

STDOUT, STDERR, STARTED = "stdout", "stderr", "started"  # files in the folder ``log`` of the case
DATA = 1536 * 2**20  # bytes that a process may allocate, besides those of the loaded libraries

FILE = 2**30  # bytes of a file, if the case does not say


def run(case: Case, box: Path) -> None:
    """Run the command of a case, in a session of its own, and exit with its code."""
    if "tests.fuzz.preload" not in sys.modules:  # multiprocessing does not say why
        raise RuntimeError("tests.fuzz.preload was not loaded: import it to see why")
    os.setsid()
    # Under nohup the one is ignored, and by a shell the other, for jobs in its background.
    signal.signal(signal.SIGHUP, signal.SIG_DFL)
    signal.signal(signal.SIGINT, signal.default_int_handler)
    os.chdir(box / CWD)
    os.environ |= {"HOME": str(box / HOME), "TMPDIR": str(box / TEMPORARY)}
    os.environ["MPLCONFIGDIR"] = matplotlib.get_cachedir()  # fonts are not listed again
    tempfile.tempdir = None
    sys.argv = ["dess", *case.arguments]
    _redirect(case, box / LOG)
    _limit(resource.RLIMIT_DATA, _data_now() + DATA)
    _limit(resource.RLIMIT_CPU, int(case.seconds) + 1)
    _limit(resource.RLIMIT_CORE, 0)
    (box / LOG / STARTED).touch()
    _limit(resource.RLIMIT_FSIZE, case.file_size or FILE)
    with nullcontext() if case.kernels else notebooks_here():
        code = main()
    # The end of an interpreter, which a process of multiprocessing has in another order: workers
    # are stopped before anything waits for them.
    threading._shutdown()
    atexit._run_exitfuncs()
    sys.exit(code)


def _redirect(case: Case, log: Path) -> None:
    """Read nothing, and write into files, or into what takes nothing."""
    write = os.O_WRONLY | os.O_CREAT
    if case.stdout == "closed":
        reader, out = os.pipe()
        os.close(reader)
    else:
        out = os.open("/dev/full" if case.stdout == "full" else log / STDOUT, write)
    streams = (os.open(os.devnull, os.O_RDONLY), out, os.open(log / STDERR, write))
    for number, stream in enumerate(streams):
        os.dup2(stream, number)
        os.close(stream)


def _limit(what: int, value: int) -> None:
    hard = resource.getrlimit(what)[1]
    resource.setrlimit(what, (value if hard == resource.RLIM_INFINITY else min(value, hard), hard))


def _data_now() -> int:
    """The bytes of data that this process has, by the count that RLIMIT_DATA is about."""
    lines = Path("/proc/self/status").read_text().splitlines()
    return next(int(line.split()[1]) * 1024 for line in lines if line.startswith("VmData"))
