"""The memory that is at hand, which large inputs are compared with before any of it is taken."""

import re
import sys
from contextlib import suppress
from math import inf
from pathlib import Path

import psutil

from dess.base.errors import InputError
from dess.base.files.reading import read_text

GIB = 2**30
# What limits the memory of a container: its limit, what it has taken and the parts of that.
GROUPS = Path("/sys/fs/cgroup")
_LIMITS = (
    ("memory.max", "memory.current", "memory.stat"),
    ("memory/memory.limit_in_bytes", "memory/memory.usage_in_bytes", "memory/memory.stat"),
)


def available_memory() -> int:
    """The memory [bytes] that this process can take without swapping, within all its limits."""
    available = int(min(psutil.virtual_memory().available, *map(_left_of, _LIMITS)))
    if sys.platform == "linux":
        process = psutil.Process()
        limit = process.rlimit(psutil.RLIMIT_DATA)[0]
        if limit != psutil.RLIM_INFINITY:
            return max(0, min(available, limit - process.memory_info().data))
    return available


def _left_of(names: tuple[str, str, str]) -> float:
    """What a container has left [bytes]; infinite without one, or without a limit."""
    with suppress(InputError, ValueError):  # no such file, or the limit is ``max``
        limit, taken, parts = (read_text(GROUPS / name) for name in names)
        cached = re.search(r"^(?:total_)?inactive_file (\d+)$", parts, re.M)  # given up at need
        return max(0, int(limit) - int(taken) + int(cached[1] if cached else 0))
    return inf


def check_memory(what: str, needed: float, allowed: str) -> None:
    """Refuse what takes more memory than is available.

    Args:
        what: What would take the memory, with its size, such as ``a network of 10^9 weights``.
        needed: The estimated memory [bytes].
        allowed: What is allowed instead.

    Raises:
        InputError: If more memory is needed than ``available_memory()``.
    """
    at_hand = available_memory()
    if needed > at_hand:
        problem = (
            f"about {needed / GIB:,.1f} GiB of memory, of which {at_hand / GIB:,.1f} are available"
        )
        raise InputError(what, problem, allowed)
