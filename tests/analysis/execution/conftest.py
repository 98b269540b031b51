"""Policies that get into trouble, for the tests of pools."""

import pytest

from tests.analysis import troublesome


@pytest.fixture
def plugin(tmp_path, monkeypatch):
    troublesome.install(tmp_path / "plugin", monkeypatch)
    yield
    monkeypatch.undo()
