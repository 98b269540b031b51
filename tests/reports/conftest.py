"""A browser for the tests of pages."""

from collections.abc import Iterator

import pytest

from tests.reports import browser


@pytest.fixture(scope="module")
def chromium() -> Iterator[browser.Page]:
    """An empty page of a headless Chromium."""
    if browser.CHROMIUM is None:
        pytest.skip("there is no chromium on this machine to open a page in")
    with browser.page() as tab:
        yield tab
