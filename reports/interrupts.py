"""Signals that end a command: SIGTERM and SIGHUP interrupt it as Ctrl-C (SIGINT) does.

with Interrupts() as interrupts:
    ...                     # a signal raises KeyboardInterrupt here
"""

import os
import signal
import sys
import threading
import time
from contextlib import AbstractContextManager
from types import FrameType
from typing import Any

from dess.base.signals import ENDING, SOON, is_fragile

AGAIN = 0.25  # seconds until an interrupt that something has swallowed is raised again
UNNOTICED = 1.0  # seconds of CPU time until a signal that is not noticed ends the process
EXIT_CODE = 130  # after a signal, as shells and typer have it: 128 + SIGINT
LINE = "interrupted: run the same command again to complete it"


class Interrupts(AbstractContextManager["Interrupts"]):
    """Handlers of the signals during a ``with`` block in the main thread; none in other threads.

    A finalizer, a callback or a library may swallow the interrupt. So it is raised again and again
    until the block ends, but not while it is handled: a cleanup is left in peace, also by a second
    signal. It waits while compiled code or its compiler calls Python, where it might crash the
    process. A signal that was ignored before, as SIGHUP under ``nohup``, stays ignored.

    While functions are compiled, and in other code that is not Python, the main thread notices no
    signal for seconds. If the process is to end after the block, it then ends as after a kill,
    which results and pages survive; only its temporary files are removed.

    Attributes:
        received: Whether there was a signal.
        is_over: Whether the work of the block is done, which is said by whoever does it. A signal
            then comes too late, and raises nothing.
    """

    def __init__(self, is_last: bool = False):
        """Set up nothing yet.

        Args:
            is_last: Whether the process ends after the block. The signals are ignored from then on,
                so that a second signal does not disturb the end.
        """
        self.is_last = is_last
        self.received = False
        self.is_over = False
        self._hook = sys.unraisablehook
        self._handlers: dict[int, Any] = {}

    def __enter__(self) -> "Interrupts":
        if threading.current_thread() is threading.main_thread():
            sys.unraisablehook = self._ignore_unraisable
            for number in ENDING:
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._handlers[number] = signal.signal(number, self._receive_signal)
            if self.is_last and os.name == "posix":
                watched, wakeup = os.pipe()
                os.set_blocking(wakeup, False)
                signal.set_wakeup_fd(wakeup, warn_on_full_buffer=False)
                threading.Thread(
                    target=self._watch_main_thread, args=(watched,), daemon=True
                ).start()
        return self

    def __exit__(self, *_: object) -> None:
        if self.received and hasattr(signal, "setitimer"):
            signal.setitimer(signal.ITIMER_REAL, 0)
        for number, handler in self._handlers.items():
            if self.is_last and number in ENDING:
                handler = signal.SIG_IGN
            signal.signal(number, handler)
        if threading.current_thread() is threading.main_thread():
            sys.unraisablehook = self._hook

    def _receive_signal(self, number: int, frame: FrameType | None) -> None:
        has_timer = hasattr(signal, "setitimer")
        if not (self.received or self.is_over) and has_timer:
            self._handlers[signal.SIGALRM] = signal.signal(signal.SIGALRM, self._receive_signal)
            signal.setitimer(signal.ITIMER_REAL, AGAIN, AGAIN)
        self.received = True
        if self.is_over or _is_handled():
            return
        if has_timer and is_fragile(frame):
            signal.setitimer(signal.ITIMER_REAL, SOON, AGAIN)
            return
        raise KeyboardInterrupt

    def _watch_main_thread(self, seen: int) -> None:
        """End the process if the main thread does not notice a signal.

        A signal that came while it had another handler, such as that of a training, is noticed by
        this one.
        """
        while number := os.read(seen, 1):
            if signal.getsignal(number[0]) != self._receive_signal:
                continue
            end = time.process_time() + UNNOTICED
            while time.process_time() < end and not (self.received or self.is_over):
                time.sleep(0.05)
            is_noticed = self.received or self.is_over
            if not is_noticed and signal.getsignal(number[0]) == self._receive_signal:
                if writing := sys.modules.get("dess.base.files.writing"):
                    writing.remove_temporaries()
                os.write(2, f"\n{LINE}\n".encode())  # there may be a progress bar
                os._exit(EXIT_CODE)

    def _ignore_unraisable(self, error: Any) -> None:
        """Say nothing of an interrupt that came in a finalizer or callback: it comes again."""
        if not isinstance(error.exc_value, KeyboardInterrupt):
            self._hook(error)


def _is_handled() -> bool:
    """Whether the running code is in the ``finally``, ``except`` or ``with`` of an interrupt."""
    error = sys.exc_info()[1]
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__context__
    return error is not None
