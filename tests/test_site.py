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
    others = {
        site / "404.html",
        site / "live.html",
        *site.glob("reports/*"),
    }  # of a server alone; tested elsewhere
    pages = sorted({*site.rglob("*.html")} - others)
    assert len(pages) > 40
    for path in pages:
        visit = Visit(chromium, path, WIDTHS[0])
        for width in WIDTHS:
            visit.resize(width)
            assert visit.page.evaluate("document.documentElement.scrollWidth") == width, path
        assert all(url.startswith(site.as_uri()) for url in visit.requests), path
        assert not visit.complaints, path
        visit.page.close()


CONTRASTS = """(() => {
    const parts = (colour) => colour.match(/[\\d.]+/g).map(Number);
    const over = ([r, g, b, a = 1], ground) =>
        [r, g, b].map((part, n) => a * part + (1 - a) * ground[n]);
    const ground = (element) => {
        if (!element) return [255, 255, 255];
        const colour = parts(getComputedStyle(element).backgroundColor);
        const behind = ground(element.parentElement);
        return colour[3] === 0 ? behind : over(colour, behind);
    };
    const light = (colour) => {
        const [r, g, b] = colour.map((part) => part / 255)
            .map((c) => c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
        return 0.2126 * r + 0.7152 * g + 0.0722 * b;
    };
    const texts = ".md-content a:not(.headerlink), .md-header__title, .md-nav__link, "
        + ".highlight code span[class]";
    return [...document.querySelectorAll(texts)]
        .filter((element) => element.checkVisibility() && element.textContent.trim())
        .map((element) => {
            const behind = ground(element);
            const ink = over(parts(getComputedStyle(element).color), behind);
            const [a, b] = [light(ink), light(behind)].sort((a, b) => b - a);
            return [(a + 0.05) / (b + 0.05), element.textContent.trim()];
        });
})()"""


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_links_and_titles_are_readable(site, chromium, scheme):
    """The contrast with their ground is at least 4.5 to 1 (WCAG 2.1, 1.4.3)."""
    page = chromium.new_page(color_scheme=scheme, viewport={"width": WIDTHS[0], "height": 900})
    page.goto((site / "index.html").as_uri())
    found = page.evaluate(CONTRASTS)
    assert len(found) > 30
    assert [pair for pair in found if pair[0] < 4.5] == []
    page.close()


def test_the_search_finds_the_page_of_the_fleet_by_the_question(site, chromium):
    """Somebody who asks "which fleet should I buy" reads how to find the cheapest one."""
    page = Visit(chromium, site / "index.html", WIDTHS[0]).page
    page.locator(".md-search__input").click()
    page.keyboard.type("which fleet should I buy")
    first = page.locator(".md-search-result__item h1").first
    first.wait_for()
    assert first.text_content() == "Which fleet should I buy?"
    page.close()


def test_tables_have_heads_and_take_the_keyboard(site, chromium):
    """A table that is wide scrolls, so the keyboard has to reach it; links are underlined."""
    for name in ("environments.html", "architecture.html", "index.html"):
        page = Visit(chromium, site / name, WIDTHS[1]).page
        heads = page.locator("thead th").all_text_contents()
        assert heads and all(map(str.strip, heads)), name
        assert page.locator(".md-content table:not([tabindex])").count() == 0, name
        links = page.locator(".md-content :is(p, li, td) a:not(.headerlink, .md-icon)")
        lines = links.evaluate_all("all => all.map((a) => getComputedStyle(a).textDecorationLine)")
        assert lines and {*lines} == {"underline"}, name
        page.close()


def test_the_site_has_a_page_that_simulates(site, chromium):
    """Without rendered reports too, within the tutorial."""
    page = Visit(chromium, site / "tutorial.html", WIDTHS[0]).page
    frame = page.frame_locator("iframe.live")
    page.locator("iframe.live").scroll_into_view_if_needed()
    frame.get_by_role("button", name="Run").first.wait_for()
    page.close()
