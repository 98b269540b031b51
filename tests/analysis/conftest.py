import pytest

from dess.analysis.execution import runner


@pytest.fixture(autouse=True)
def _small_chunks(monkeypatch):
    """Ten missions make three chunks."""
    monkeypatch.setitem(runner.CHUNK, "batch", 4)
