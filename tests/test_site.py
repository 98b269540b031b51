"""The documentation as a site: it builds strictly, and a browser opens it offline."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.reports.browser import Visit
from tests.reports.conftest import chromium

__all__ = ["chromium"]  # a fixture

ROOT = Path(__file__).parents[1]
WIDTHS = (1280, 390)

pytestmark = pytest.mark.slow


def build(config: Path, out: Path) -> subprocess.CompletedProcess[str]:
    """Build the site of a configuration into a folder."""
    command = [
        sys.executable,
        "-m",
        "mkdocs",
        "build",
        "--strict",
        "-f",
        str(config),
        "-d",
        str(out),
    ]
    return subprocess.run(command, cwd=config.parent, capture_output=True, text=True)


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The built site."""
    folder = tmp_path_factory.mktemp("site")
    built = build(ROOT / "mkdocs.yml", folder)
    assert built.returncode == 0, built.stderr
    return folder


def test_pages_ask_nothing_from_elsewhere_and_fit_the_window(site, chromium):
    pages = sorted({*site.rglob("*.html")} - {site / "404.html"})  # which only a server shows
    assert len(pages) > 40
    for path in pages:
        visit = Visit(chromium, path, WIDTHS[0])
        for width in WIDTHS:
            visit.resize(width)
            assert visit.page.evaluate("document.documentElement.scrollWidth") == width, path
        assert all(url.startswith(site.as_uri()) for url in visit.requests), path
        assert not visit.complaints, path
        visit.page.close()
