"""A browser for the tests of pages."""

from pathlib import Path

import pytest
from playwright.sync_api import sync_playwright

from tests.analysis.conftest import studied
from tests.reports import browser

__all__ = ["studied"]  # a fixture


@pytest.fixture(scope="module")
def chromium():
    """A headless Chromium; tests that need it are skipped on machines without one."""
    if browser.CHROMIUM is None:
        pytest.skip("no chromium on this machine to open a page in")
    with sync_playwright() as playwright:
        launched = playwright.chromium.launch(
            executable_path=browser.CHROMIUM, args=browser.ARGUMENTS
        )
        yield launched
        launched.close()


@pytest.fixture
def visit(chromium):
    """Opens a file in a window of a width [px]; its tab is closed after the test."""
    visits: list[browser.Visit] = []

    def open_page(path: Path, width: int) -> browser.Visit:
        visits.append(browser.Visit(chromium, path, width))
        return visits[-1]

    yield open_page
    for opened in visits:
        opened.page.close()
