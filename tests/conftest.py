"""Set-up of the whole test session: one thread for torch, the hypothesis profiles, quick tests.

Tests run side by side, where the threads of one would be in the way of the other.

By default properties draw few examples, always the same. With ``--hypothesis-profile=verify`` they
draw many fresh ones, and count as slow tests, so that ``nox -s verify`` runs them too.

What opens a page in a browser is a brief proof, as the start of a browser takes a second or two.

``pytest -m quick`` runs the tests of ``QUICK`` and imports no other file, as that takes longest.
"""

import os
import signal
from functools import cache
from pathlib import Path

import pytest
from hypothesis import Phase, is_hypothesis_test, settings

from tests.installed import installed

__all__ = ["installed"]  # a fixture

HERE = Path(__file__).parent
# Files and folders whose tests take less than half a minute together.
QUICK = (
    *("dess/scenario/test_scenario.py", "dess/scenario/test_families.py"),
    *("dess/scenario/test_own_sea.py", "dess/scenario/test_sea_files.py"),
    *("dess/physics/test_failures.py", "dess/physics/test_streams.py"),
    *("dess/base/test_errors.py", "dess/base/test_files.py"),
    *("dess/model/test_missions.py", "dess/model/test_rules.py"),
    *("policies/test_registry.py", "analysis/stats", "test_doors.py"),
    "analysis/wasm/test_code.py",
)
# Files that compile most, each what those before it do not: two workers begin with them, so that
# seldom both compile the same.
COMPILING = ("reports/cli/study/test_diff.py", "analysis/bound/test_optimum.py")
COMPILING += ("reports/cli/test_evaluate.py",)
# The planner has the guard, so the process that compiles the engine should take it: a worker gets
# its next file when two tests of the present one are left, and the other one is sooner there.
COMPILING += ("policies/learner/test_session.py", "policies/planner/test_policy.py")
# Some that compile little, until what the last ones need of others is compiled.
COMPILING += ("analysis/execution", "analysis/test_coverage.py", "reports/pages/test_render.py")
COMPILING += ("policies/learner/test_policy.py", "dess/envs/observations/test_states.py")
# Of files that compile the same and would be run at the same time, one comes early.
COMPILING += ("dess/model/guard/test_guard.py", "dess/envs/test_parallel.py")
# Files that take longest; they come next, so that workers end together.
LONGEST = ("reports", "analysis/execution", "fuzz", "test_architecture.py", "test_docs.py")
LONGEST += ("test_extras.py",)

os.environ["OMP_NUM_THREADS"] = "1"
if signal.getsignal(signal.SIGHUP) is signal.SIG_IGN:  # by nohup; commands would ignore it, too
    signal.signal(signal.SIGHUP, lambda *_: None)
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # by a shell, for jobs in its background
    signal.signal(signal.SIGINT, signal.default_int_handler)

settings.register_profile("default", max_examples=30, deadline=None, derandomize=True)
settings.register_profile("verify", max_examples=1000, deadline=None, print_blob=True)
# Of a planted fault (benchmarks/faults.py), it is enough to know that it is caught.
FIRST = (Phase.explicit, Phase.generate)
settings.register_profile("planted", settings.get_profile("default"), phases=FIRST)
settings.load_profile("default")


@cache
def is_in(path: Path, places: tuple[str, ...]) -> bool:
    """Whether a path is one of some places in the folder of the tests, or in one of them."""
    return any(path.is_relative_to(HERE / place) for place in places)


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    is_test = collection_path.name.startswith("test_")
    asked_for_others = config.option.markexpr != "quick" or is_in(collection_path, QUICK)
    return None if asked_for_others or not is_test else True


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    items.sort(key=lambda item: rank_of(item.path))


@cache
def rank_of(path: Path) -> int:
    """The position of a file among those that come first; all others have the last one."""
    first = (*COMPILING, *LONGEST)
    return next((n for n, of in enumerate(first) if is_in(path, (of,))), len(first))


def pytest_itemcollected(item: pytest.Item) -> None:
    if "chromium" in getattr(item, "fixturenames", ()) and not item.get_closest_marker("slow"):
        item.add_marker(pytest.mark.slow)
        item.add_marker(pytest.mark.brief)
    deep = item.config.getoption("hypothesis_profile") == "verify"
    if deep and is_hypothesis_test(getattr(item, "obj", None)):
        item.add_marker(pytest.mark.slow)
    if is_in(item.path, QUICK) and item.get_closest_marker("slow") is None:
        item.add_marker(pytest.mark.quick)
