from typing import Any

import pytest

from dess.analysis import run_study
from dess.analysis.execution import runner
from dess.analysis.results.tables import Results
from tests.analysis.small import small_study


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch):
    """Ten missions make three chunks."""
    monkeypatch.setitem(runner.CHUNK, "batch", 4)


@pytest.fixture(scope="session")
def studied(tmp_path_factory):
    """Runs the small study with some changes, once for all tests; its results."""
    kept: dict[str, Results] = {}

    def run(**changes: Any) -> Results:
        key = repr(changes)
        if key not in kept:
            folder = tmp_path_factory.mktemp("study")
            kept[key] = run_study(small_study(folder, **changes), folder / "out")
        return kept[key]

    return run
