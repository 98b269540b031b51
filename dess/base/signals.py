"""What handlers of signals share: which signals end a command, and where they must wait."""

import signal
import threading
from types import FrameType

# The signals that end a command; Windows has no SIGHUP.
ENDING = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
SOON = 0.01  # seconds until an interrupt that had to wait is raised

# Modules of Python that compiled code and its compiler call, and that share objects with them: an
# exception in one of them may crash the process.
_FRAGILE = ("numba.core.serialize", "llvmlite.binding")


def send_to_main_thread(number: int) -> None:
    """Send a signal from any thread so that it ends what the main thread waits for."""
    thread = threading.main_thread().ident
    if hasattr(signal, "pthread_kill") and thread:
        signal.pthread_kill(thread, number)
    else:  # Windows
        signal.raise_signal(number)


def is_fragile(frame: FrameType | None) -> bool:
    """Whether a frame, or one that has called it, must not be left by an exception."""
    while frame is not None:
        if str(frame.f_globals.get("__name__")).startswith(_FRAGILE):
            return True
        frame = frame.f_back
    return False
