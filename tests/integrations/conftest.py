"""The report of a library's tests names the library with its version, for the matrix."""

from importlib.metadata import version

import pytest

# The distributions whose names are not those of the test files.
DISTRIBUTIONS = {"cleanrl": "torch", "rllib": "ray"}


@pytest.fixture(scope="module", autouse=True)
def library(request, record_testsuite_property):
    """Write the library that a test file is about into the report, with its version."""
    name = request.path.stem.removeprefix("test_").replace("_", "-")
    distribution = DISTRIBUTIONS.get(name, name)
    record_testsuite_property("library", f"{distribution} {version(distribution)}")
