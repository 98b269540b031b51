"""Running a study: rounds of jobs, workers that run them, estimates of time and memory.

A worker process ends when the process that started it is killed. It watches that process before it
loads the simulator, so what it loads first is here and imports next to nothing.
"""

import os
import signal
import sys
import time
from collections.abc import Iterator
from contextlib import contextmanager
from threading import Thread


def live_and_die_with(parent: int) -> None:
    """Ignore interrupts, which the parent process handles, and end when the parent is killed."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # joblib replaces a worker that has grown by 300 MB, which a learned policy takes.
    if loky := sys.modules.get("joblib.externals.loky.process_executor"):
        loky._MAX_MEMORY_LEAK_SIZE = 2**31  # type: ignore[attr-defined]

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(0.2)
        os._exit(1)

    Thread(target=watch, daemon=True).start()


@contextmanager
def set_variable(name: str, value: str) -> Iterator[None]:
    """Set an environment variable for the processes that start here."""
    before = os.environ.get(name)
    os.environ[name] = value
    try:
        yield
    finally:
        del os.environ[name]
        if before is not None:
            os.environ[name] = before
