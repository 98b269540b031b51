"""Notes on a valid scenario, which a user should know; each is told once."""

import logging
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache

# Notes that are kept until a scenario is known to be valid: a refusal is told alone.
_held: ContextVar[list[str] | None] = ContextVar("held", default=None)


@contextmanager
def notes_after() -> Iterator[None]:
    """Tell the notes of a block at its end, and none if it raises an error."""
    token = _held.set([])
    try:
        yield
        notes = _held.get() or []
    finally:
        _held.reset(token)
    for line in notes:
        tell(line)


def tell(line: str) -> None:
    """Tell once what a user should know, or keep it for the end of ``notes_after``."""
    notes = _held.get()
    if notes is None:
        _tell_once(line)
    else:
        notes.append(line)


@cache
def _tell_once(line: str) -> None:
    logging.getLogger(__name__).warning("note: %s", line)
