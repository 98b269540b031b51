"""The small study of the tests of the analysis."""

from tests.analysis.conftest import studied

__all__ = ["studied"]  # a fixture
