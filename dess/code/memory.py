"""The memory that is at hand, which large inputs are compared with before any of it is taken."""

import psutil

from dess.errors import InputError

GIB = 2**30


def available_memory() -> int:
    """The memory [bytes] that processes can take without swapping."""
    return psutil.virtual_memory().available


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
