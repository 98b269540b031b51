"""The memory that is at hand, which large inputs are compared with before any of it is taken."""

import sys

import psutil

from dess.errors import InputError

GIB = 2**30


def available_memory() -> int:
    """The memory [bytes] that this process can take without swapping, within its own limit."""
    available = psutil.virtual_memory().available
    if sys.platform == "linux":
        process = psutil.Process()
        limit = process.rlimit(psutil.RLIMIT_DATA)[0]
        if limit != psutil.RLIM_INFINITY:
            return max(0, min(available, limit - process.memory_info().data))
    return available


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
        raise InputError(
            f"{what}: about {needed / GIB:,.1f} GiB of memory, of which {at_hand / GIB:,.1f} are "
            f"available; allowed: {allowed}"
        )
