"""Draw the gallery: pictures of rendered pages.

``python -m docs.pictures build/reports`` opens the pages that ``nox -s reports`` has made, in a
headless Chromium, and writes a picture of a part of each to ``docs/gallery``.
"""

import io
import sys
from pathlib import Path

from PIL import Image
from playwright.sync_api import sync_playwright

from tests.reports.browser import ARGUMENTS, CHROMIUM

OUT = Path(__file__).parent / "gallery"
SIZE = (1000, 720)
# What of a page is in its picture: the element at the top of the window.
PARTS = {
    "index": "h1",
    "mission": "h2",
    "performance": "figure",
    "learning": "figure",
    "parameters": "figure",
    "comparison": "figure",
    "what-if": "figure",
    "own-sea": "figure",
    "explorer": "h1",
    "verification": "figure",
}


def main(pages: Path) -> None:
    """Write a picture of every page of a folder of reports."""
    OUT.mkdir(exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        window = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        for name, part in PARTS.items():
            window.goto((pages / f"{name}.html").resolve().as_uri())
            window.locator(part).first.evaluate("element => element.scrollIntoView()")
            window.wait_for_timeout(500)  # until curves and players are drawn
            picture = Image.open(io.BytesIO(window.screenshot())).convert("RGB")
            picture.quantize(64).save(OUT / f"{name}.png", optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]))
