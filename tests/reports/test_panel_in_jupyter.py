"""The what-if notebook in Jupyter, in a real browser: sliders are moved, and the answer is read."""

import re
import socket
import subprocess
import sys
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from pathlib import Path

import pytest
from playwright.sync_api import Browser, Locator, Page, expect

from analysis import what_if
from reports.pages.notebook import read
from tests.analysis.small import environment, write_scenario

pytestmark = pytest.mark.slow

NOTEBOOK, MISSIONS = "what-if.ipynb", 12
PATIENCE = 240_000.0  # ms; a kernel compiles the engine in its first mission


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the notebook, as it lies beside its page, about a small scenario."""
    folder = tmp_path_factory.mktemp("jupyter")
    scenario = write_scenario(folder)
    values = {
        "scenario": str(scenario),
        "policies": ["greedy"],
        "missions": MISSIONS,
        "settings": {"quota": 30},
        "baseline": {"uavs": 2},
    }
    text = read("what-if").for_jupyter(folder / "results", folder, values)
    (folder / NOTEBOOK).write_text(text, "utf-8")
    return folder


@pytest.fixture(scope="module")
def server(folder: Path, tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """The address of a Jupyter server that writes to a home of its own."""
    home = tmp_path_factory.mktemp("home")
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    own = {f"JUPYTER_{kind}_DIR": str(home) for kind in ("CONFIG", "RUNTIME", "DATA")}
    options = [f"--port={port}", "--no-browser", "--allow-root", "--IdentityProvider.token="]
    command = [sys.executable, "-m", "notebook", *options, "--ServerApp.port_retries=0"]
    with open(home / "log", "w") as log:
        running = subprocess.Popen(
            command,
            cwd=folder,
            env=environment() | own | {"HOME": str(home), "IPYTHONDIR": str(home)},
            stdout=log,
            stderr=subprocess.STDOUT,
        )
        try:
            address = f"http://127.0.0.1:{port}"
            _wait(f"{address}/api", running, home / "log")
            yield address
        finally:
            running.terminate()
            running.wait(30)


def _wait(address: str, running: subprocess.Popen, log: Path) -> None:
    for _ in range(600):
        assert running.poll() is None, log.read_text()
        try:
            urllib.request.urlopen(address).close()
            return
        except (urllib.error.URLError, OSError):
            time.sleep(0.1)
    pytest.fail(log.read_text())


@pytest.fixture
def page(chromium: Browser, server: str) -> Iterator[Page]:
    page = chromium.new_page(viewport={"width": 1280, "height": 1000})
    page.set_default_timeout(PATIENCE)
    page.goto(f"{server}/notebooks/{NOTEBOOK}")
    yield page
    page.close()


def run_all(page: Page) -> None:
    """Run all cells, as soon as the page is connected to an idle kernel."""
    kernels = f"{page.url.split('/notebooks/')[0]}/api/kernels"
    for _ in range(600):
        states = [
            (k["connections"], k["execution_state"]) for k in page.request.get(kernels).json()
        ]
        if states == [(1, "idle")]:
            break
        page.wait_for_timeout(100)
    page.get_by_role("menuitem", name="Run", exact=True).click()
    page.get_by_role("menuitem", name="Run All Cells", exact=True).click()


def drag(page: Page, slider: Locator, pixels: int) -> None:
    """Drag the handle of a slider to the right."""
    handle = slider.locator("[role=slider]")
    handle.scroll_into_view_if_needed()
    box = handle.bounding_box()
    assert box is not None
    x, y = box["x"] + box["width"] / 2, box["y"] + box["height"] / 2
    page.mouse.move(x, y)
    page.mouse.down()
    page.mouse.move(x + pixels, y, steps=5)
    page.mouse.up()


def test_a_slider_is_moved_and_the_question_answered(page: Page, folder: Path) -> None:
    run_all(page)
    button = page.get_by_role("button", name="Simulate")
    button.wait_for()
    slider = page.locator(".dess-variation-quota")
    readout = slider.locator(".widget-readout")
    assert readout.inner_text() == "30"
    drag(page, slider, 30)
    expect(readout).not_to_have_text("30")
    quota = int(readout.inner_text())
    button.click()
    answer = page.locator(".widget-html li").filter(has_text="collection ratio")
    answer.wait_for()
    question = {"quota": quota}, {"uavs": 2}, folder / "small.toml", ["greedy"], MISSIONS
    asked = what_if(*question, folder=folder / "results").answer()
    assert f"- {answer.inner_text()}" == asked.splitlines()[0].replace("**", "")
    assert re.search(r"by \S+ \[\S+, \S+\] points", answer.inner_text())
    expect(page.get_by_role("img", name="Paired differences of the metrics").last).to_be_visible()
