"""A headless Chromium, driven over its DevTools protocol: what a reader sees and does."""

import json
import shutil
import subprocess
import time
from base64 import b64decode
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.client import HTTPConnection
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from websocket import WebSocket, create_connection

CHROMIUM = next(
    filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome", "chrome"))),
    None,
)
PATIENCE = 60.0  # seconds after which what has not happened is taken for never happening
_OPTIONS = [
    "--headless",
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-sync",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-extensions",
    "--disable-dev-shm-usage",
    "--remote-debugging-port=0",
    "about:blank",
]


class Page:
    """The one page of a browser, and all that it has asked for and complained of.

    Attributes:
        requests: The URLs of all requests, data URLs excepted.
        complaints: Console errors and warnings of the page, and exceptions that nothing caught.
    """

    def __init__(self, socket: WebSocket):
        self._socket, self._calls = socket, 0
        self.requests: list[str] = []
        self.complaints: list[str] = []
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """A command of the protocol, and its result."""
        self._calls += 1
        command = {"id": self._calls, "method": method, "params": parameters}
        self._socket.send(json.dumps(command))
        while True:
            message = json.loads(self._socket.recv())
            if message.get("id") == self._calls:
                assert "error" not in message, message["error"]
                return message["result"]
            self._note(message)

    def _note(self, event: dict[str, Any]) -> None:
        name, about = event["method"], event["params"]
        if name == "Network.requestWillBeSent":
            url = about["request"]["url"]
            self.requests += [] if url.startswith("data:") else [url]
        elif name == "Network.webSocketCreated":
            self.requests.append(about["url"])
        elif name == "Runtime.exceptionThrown":
            details = about["exceptionDetails"]
            self.complaints.append(details.get("exception", {}).get("description", details["text"]))
        elif name == "Runtime.consoleAPICalled" and about["type"] in {"error", "warning", "assert"}:
            self.complaints.append(json.dumps(about["args"]))
        elif name == "Log.entryAdded" and about["entry"]["level"] in {"error", "warning"}:
            self.complaints.append(json.dumps(about["entry"]))

    def open(self, path: Path, width: int) -> None:
        """Open a file as a reader does, in a window of that width [px]."""
        self.resize(width)
        self.call("Page.navigate", url=path.as_uri())
        self.wait(f"location.href === {json.dumps(path.as_uri())}")
        self.wait("document.readyState === 'complete'")

    def resize(self, width: int) -> None:
        """Make the window that wide [px]; a narrow one is a phone."""
        size = {"width": width, "height": 900, "deviceScaleFactor": 1, "mobile": width < 600}
        self.call("Emulation.setDeviceMetricsOverride", **size)

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression; of a promise, the one that it comes to."""
        result = self.call(
            "Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True
        )
        assert "exceptionDetails" not in result, result["exceptionDetails"]
        return result["result"].get("value")

    def wait(self, condition: str) -> None:
        """Wait until a JavaScript expression is true."""
        end = time.monotonic() + PATIENCE
        while not self.evaluate(f"Boolean({condition})"):
            assert time.monotonic() < end, f"never true: {condition}"
            time.sleep(0.02)

    def press(self, element: str, across: float = 0.5) -> None:
        """Press the mouse on an element, a JavaScript expression, that far across it."""
        x, y = self.evaluate(
            f"(() => {{ const e = {element}; e.scrollIntoView({{block: 'center'}}); "
            f"const box = e.getBoundingClientRect(); "
            f"return [box.x + {across} * box.width, box.y + box.height / 2]; }})()"
        )
        for kind in ("mousePressed", "mouseReleased"):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def screenshot(self, path: Path) -> None:
        """Write what the whole page looks like as a PNG."""
        image = self.call("Page.captureScreenshot", captureBeyondViewport=True)
        path.write_bytes(b64decode(image["data"]))


@contextmanager
def page() -> Iterator[Page]:
    """An empty page of a browser of its own."""
    assert CHROMIUM is not None
    with TemporaryDirectory(ignore_cleanup_errors=True) as profile:
        process = subprocess.Popen(
            [CHROMIUM, f"--user-data-dir={profile}", *_OPTIONS],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )
        try:
            url = _target(_port(process, Path(profile)))
            socket = create_connection(url, timeout=PATIENCE, suppress_origin=True)
            try:
                yield Page(socket)
            finally:
                socket.close()
        finally:
            process.terminate()
            process.wait()


def _port(process: subprocess.Popen[bytes], profile: Path) -> int:
    """The port at which the browser listens, as it writes to its profile."""
    end = time.monotonic() + PATIENCE
    while process.poll() is None and time.monotonic() < end:
        with suppress(FileNotFoundError, IndexError):
            return int((profile / "DevToolsActivePort").read_text().split()[0])
        time.sleep(0.05)
    raise AssertionError("the browser does not listen")


def _target(port: int) -> str:
    """The socket of the browser's first page."""
    connection = HTTPConnection("127.0.0.1", port, timeout=PATIENCE)
    connection.request("GET", "/json/list")
    targets = json.loads(connection.getresponse().read())
    connection.close()
    return next(t["webSocketDebuggerUrl"] for t in targets if t["type"] == "page")
