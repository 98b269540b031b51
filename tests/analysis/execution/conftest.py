"""A study that is divided, and the bytes that a single run of it leaves."""

import pytest

from dess.analysis import run_study
from dess.analysis.execution.runner import CHUNK
from tests.analysis.small import CHUNK_SIZE, divided_study, files_of


@pytest.fixture
def study(tmp_path, monkeypatch):
    """The study, with chunks of so few missions that there are some to divide."""
    monkeypatch.setitem(CHUNK, "batch", CHUNK_SIZE)
    return divided_study(tmp_path)


@pytest.fixture(scope="session")
def expected(tmp_path_factory):
    """The files that a single run of the study leaves."""
    folder = tmp_path_factory.mktemp("divided")
    with pytest.MonkeyPatch.context() as patch:
        patch.setitem(CHUNK, "batch", CHUNK_SIZE)
        run_study(divided_study(folder), folder / "whole")
    return files_of(folder / "whole")
