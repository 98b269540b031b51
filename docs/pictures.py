"""Draw the gallery: pictures of rendered pages.

``python -m docs.pictures build/reports`` opens the pages that ``nox -s reports`` has made, in a
headless Chromium, and writes a picture of the first screen of each to ``docs/gallery``.
"""

import io
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from tests.reports.browser import ARGUMENTS, CHROMIUM

OUT = Path(__file__).parent / "gallery"
SIZE = (1280, 800)
PAGES = (
    *("index", "mission", "performance", "learning", "parameters"),
    *("comparison", "what-if", "own-sea", "explorer", "verification"),
)


def main(pages: Path) -> None:
    """Write a picture of every page of a folder of reports."""
    OUT.mkdir(exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        window = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        for name in PAGES:
            window.goto((pages / f"{name}.html").resolve().as_uri())
            window.wait_for_timeout(500)  # until curves and players are drawn
            picture = Image.open(io.BytesIO(window.screenshot())).convert("RGB")
            picture.quantize(64).save(OUT / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
