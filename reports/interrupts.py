"""Signals that end a command: SIGTERM and SIGHUP interrupt it as Ctrl-C (SIGINT) does.

with Interrupts() as interrupts:
    ...                     # a signal raises KeyboardInterrupt here
"""

import math
import signal
import sys
import threading
import time
from _thread import interrupt_main
from contextlib import AbstractContextManager
from typing import Any

NUMBERS = [
    getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)
]
CLEANUP = 5.0  # seconds that a command has to end; more signals within them are ignored
AGAIN = 0.05  # seconds until an interrupt that Python has dropped is raised again


class Interrupts(AbstractContextManager["Interrupts"]):
    """Handlers of the signals during a ``with`` block in the main thread; none in other threads.

    A signal that was ignored before, as SIGHUP under ``nohup``, stays ignored.

    Attributes:
        received: Whether there was a signal.
    """

    def __init__(self, is_last: bool = False):
        """Set up nothing yet.

        Args:
            is_last: Whether the process ends after the block. The signals are ignored from then on,
                so that a second signal does not disturb the end.
        """
        self.is_last, self.received = is_last, False
        self._number, self._ignored_until = int(signal.SIGINT), 0.0
        self._hook = sys.unraisablehook
        self._handlers: dict[int, Any] = {}

    def __enter__(self) -> "Interrupts":
        if threading.current_thread() is threading.main_thread():
            sys.unraisablehook = self._unraisable
            for number in NUMBERS:
                if signal.getsignal(number) not in (signal.SIG_IGN, None):
                    self._handlers[number] = signal.signal(number, self._receive)
        return self

    def __exit__(self, *_: object) -> None:
        self._ignored_until = math.inf
        for number, handler in self._handlers.items():
            signal.signal(number, signal.SIG_IGN if self.is_last else handler)
        if threading.current_thread() is threading.main_thread():
            sys.unraisablehook = self._hook

    def _receive(self, number: int, frame: Any) -> None:
        self.received, self._number = True, number
        if time.monotonic() >= self._ignored_until:
            self._ignored_until = time.monotonic() + CLEANUP
            raise KeyboardInterrupt

    def _unraisable(self, error: Any) -> None:
        """Raise an interrupt again that Python drops because it came in a finalizer or callback."""
        if not isinstance(error.exc_value, KeyboardInterrupt):
            self._hook(error)
            return
        self._ignored_until = 0.0
        again = threading.Timer(AGAIN, _send, [self._number])
        again.daemon = True
        again.start()


def _send(number: int) -> None:
    """Send a signal to the main thread, which may be waiting for something."""
    if hasattr(signal, "pthread_kill"):
        main = threading.main_thread().ident
        assert main is not None
        signal.pthread_kill(main, number)
    else:
        interrupt_main()
