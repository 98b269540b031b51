"""A page in a headless Chromium: what a reader sees and does, what the page requests and logs."""

import shutil
from pathlib import Path
from typing import Any

from playwright.sync_api import Browser, ConsoleMessage

NAMES = ("chromium", "chromium-browser", "google-chrome", "chrome")
CHROMIUM = next(filter(None, map(shutil.which, NAMES)), None)
ARGUMENTS = ["--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"]
PATIENCE = 60_000.0  # ms after which a wait fails


class Visit:
    """A file opened in a tab of its own.

    Attributes:
        page: Playwright's page.
        requests: The URLs of all requests, data URLs excepted.
        complaints: Console errors and warnings, and uncaught exceptions.
    """

    def __init__(self, browser: Browser, path: Path, width: int):
        """Open a file in a window of a width [px]; a narrow one is a phone."""
        self.requests: list[str] = []
        self.complaints: list[str] = []
        size: Any = {"width": width, "height": 900}
        self.page = browser.new_page(viewport=size, is_mobile=width < 600)
        self.page.set_default_timeout(PATIENCE)
        self.page.on("request", lambda request: self.requests.append(request.url))
        self.page.on("websocket", lambda socket: self.requests.append(socket.url))
        self.page.on("pageerror", lambda error: self.complaints.append(str(error)))
        self.page.on("console", self._log)
        self.page.goto(path.as_uri())

    def _log(self, message: ConsoleMessage) -> None:
        if message.type in {"error", "warning", "assert"}:
            self.complaints.append(message.text)

    def resize(self, width: int) -> None:
        """Make the window that wide [px]."""
        self.page.set_viewport_size({"width": width, "height": 900})
