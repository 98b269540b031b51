"""Set-up of the whole test session: one thread for torch, and the hypothesis profiles.

Tests run side by side, where the threads of one would be in the way of the other.

By default properties draw few examples, always the same. With ``--hypothesis-profile=verify`` they
draw many fresh ones, and count as slow tests, so that ``nox -s verify`` runs them too.
"""

import os
import signal

import pytest
from hypothesis import is_hypothesis_test, settings

from tests.installed import installed

__all__ = ["installed"]  # a fixture

os.environ["OMP_NUM_THREADS"] = "1"
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:  # by nohup; commands would ignore it, too
    signal.signal(signal.SIGHUP, lambda *_: None)

settings.register_profile("default", max_examples=50, deadline=None, derandomize=True)
settings.register_profile("verify", max_examples=1000, deadline=None, print_blob=True)
settings.load_profile("default")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Tests of reports have the longest files; they come first, so that workers end together."""
    items.sort(key=lambda item: "reports" not in item.path.parts)


def pytest_itemcollected(item: pytest.Item) -> None:
    deep = item.config.getoption("hypothesis_profile") == "verify"
    if deep and is_hypothesis_test(getattr(item, "obj", None)):
        item.add_marker(pytest.mark.slow)
