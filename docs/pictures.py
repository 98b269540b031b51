"""Draw the pictures of the documentation.

``python -m docs.pictures`` draws those of *The model*, to ``docs/model``. With a folder,
``python -m docs.pictures build/reports`` also opens the pages that ``nox -s reports`` has made, in
a headless Chromium, and writes a picture of the first screen of each to ``docs/gallery``.

A picture of a page keeps what the page said and how pages looked. ``outdated`` finds the pictures
that are older than the pages.
"""

import io
import sys
from collections.abc import Iterator
from hashlib import sha256
from pathlib import Path

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle
from PIL import Image
from PIL.PngImagePlugin import PngInfo

from dess import load_scenario, policies, simulate
from dess.analysis.figures import missions, style
from dess.analysis.results import event_log
from dess.base.errors import InputError
from dess.reports.pages import INDEX
from dess.reports.pages.figures import encode_figure
from dess.reports.pages.index import TILES
from dess.reports.pages.page import Page

HERE = Path(__file__).parent
GALLERY, MODEL = HERE / "gallery", HERE / "model"
TEMPLATES = HERE.parent / "reports" / "templates"
SIZE = (1280, 800)
PAGES = (
    *("index", "mission", "performance", "learning", "parameters"),
    *("comparison", "what-if", "own-sea"),
)
PANEL, ASKED = "panel", "what-if"  # the picture of a panel, and its page
# What the first screen of every page is made with.
LOOK = (
    *("layout.html", "report.html", "bar.html", "index.html", "part.html", "picture.html"),
    *("player.html", "player.js", "style.css"),
    *("panel.html", "panel.css", "panel_side.html", "panel_sliders.html", "panel_metrics.html"),
    *("panel_controls.js", "panel_view.js", "panel_runs.js", "panel.js", "try.html"),
)
FINDING, LOOKED = "Finding", "Look"  # what a picture keeps, as texts of a PNG file


def look() -> str:
    """A hash of what the first screen of every page is made with."""
    texts = [(TEMPLATES / name).read_bytes() for name in LOOK]
    return sha256(b"".join(texts)).hexdigest()


def outdated(pages: Path) -> list[str]:
    """The names of the pictures that are missing or older than the pages.

    Args:
        pages: The folder of the pages. Of pages that are missing, or whose questions are not the
            shipped ones, only the look is compared.
    """
    return [name for name in (*PAGES, PANEL) if not is_current(name, pages)]


def is_current(name: str, pages: Path) -> bool:
    """Whether the picture of a page shows how pages look and, if it is there, what it says."""
    file = GALLERY / f"{name}.png"
    if not file.exists():
        return False
    with Image.open(file) as picture:
        kept = picture.info
    said = finding_of(pages / f"{ASKED if name == PANEL else name}.html")
    return kept.get(LOOKED) == look() and said in ("", kept.get(FINDING))


def finding_of(path: Path) -> str:
    """The sentence of the page of a shipped question, if any; of the index those of its tiles."""
    if path.name == INDEX:
        tiles = [finding_of(path.with_name(page)) for page in TILES]
        return "; ".join(tiles) if all(tiles) else ""
    try:
        card = Page.read(path).card
    except InputError:  # there is no such page
        return ""
    return card.finding if card.key else ""


# --- the gallery ---


def draw_gallery(pages: Path) -> None:
    """Write a picture of every page of a folder of reports."""
    from playwright.sync_api import sync_playwright

    from tests.reports.browser import ARGUMENTS, CHROMIUM

    GALLERY.mkdir(exist_ok=True)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=ARGUMENTS)
        window = browser.new_page(viewport={"width": SIZE[0], "height": SIZE[1]})
        for name in PAGES:
            path = pages / f"{name}.html"
            window.goto(path.resolve().as_uri())
            window.wait_for_timeout(500)  # until curves and players are drawn
            _keep_picture(name, window.screenshot(), path)
        path = pages / f"{ASKED}.html"
        window.goto(path.resolve().as_uri())
        window.get_by_role("button", name="Run", exact=True).click()
        window.get_by_text("bit for bit").wait_for()
        window.get_by_role("button", name="Run", exact=True, disabled=False).wait_for()
        _keep_picture(PANEL, window.locator("#panel").screenshot(), path)


def _keep_picture(name: str, screenshot: bytes, page: Path) -> None:
    """Write a picture of a page, with what it says and how pages look."""
    kept = PngInfo()
    kept.add_text(FINDING, finding_of(page))
    kept.add_text(LOOKED, look())
    picture = Image.open(io.BytesIO(screenshot)).convert("RGB")
    picture.quantize(64).save(GALLERY / f"{name}.png", optimize=True, pnginfo=kept)


# --- the model ---


def draw_model() -> Iterator[tuple[str, bytes]]:
    """The pictures of *The model*, by file name; the same code draws the same bytes."""
    for draw in (sea, slot, battery):
        yield f"{draw.__name__}.svg", encode_figure(draw(), "svg")


def sea() -> Figure:
    """The paper's sea: the grid, the sensor nodes, the start and charging zone."""
    space = load_scenario("paper")
    figure = missions.sea_figure(space)
    (ax,) = figure.axes
    x, y, width, _ = space.zone
    with style.figure_look():
        note = {"fontsize": 9, "arrowprops": {"arrowstyle": "->", "color": style.INK}}
        zone = (x + width / 2 - 0.5, y - 0.5)
        ax.annotate("start and charging zone", zone, (x - 5, -2), ha="right", va="center",
                    annotation_clip=False, **note)  # fmt: skip
        ax.annotate("sensor node", space.nodes[0], (1, 1), ha="left", va="center", **note)
        ax.add_patch(Rectangle((9.5, 28.5), 1, 1, facecolor="white", edgecolor=style.INK))
        ax.annotate(f"a cell of {space.cell_size:g} m", (10, 29), (13, 29), va="center", **note)
    return figure


def slot() -> Figure:
    """A mission slot from t to t + 1: its phases, in their order."""
    count = load_scenario("paper").communication_slots
    at_start = "all UAVs act\nmoves are resolved\npads are granted"
    at_end = "data arrive at the nodes\nrewards are computed\nUAVs that are done end"
    with style.figure_look():
        figure = style.Picture(figsize=(7.2, 2.2), dpi=style.DPI, layout="constrained")
        ax = figure.subplots()
        for number in range(count):
            share = (number / count, (number + 1) / count)
            box = Rectangle((share[0], 0), 1 / count, 1, facecolor=style.SEA, edgecolor=style.MUTED)
            ax.add_patch(box)
            ax.text(np.mean(share), 0.5, f"communication\nslot {number + 1}", fontsize=8.5,
                    ha="center", va="center")  # fmt: skip
        for time, name, text in ((0, "t", at_start), (1, "t + 1", at_end)):
            ax.plot([time, time], [-0.5, 1.4], color=style.INK, linewidth=1.4)
            ax.text(time, 1.5, text, fontsize=9, ha="center", va="bottom")
            ax.text(time, -0.6, name, fontsize=10, ha="center", va="top")
        ax.text(0.5, -0.25, "every flying UAV collects data of the node with the best link",
                fontsize=9, ha="center", va="center")  # fmt: skip
        ax.set(xlim=(-0.18, 1.2), ylim=(-1.3, 3.6))
        ax.set_axis_off()
    return figure


def battery() -> Figure:
    """The battery of a UAV in a mission: it flies, its latch is set at C_S, it charges to C_C."""
    space = load_scenario("fig4", uavs=1)
    record = simulate(space, policies.load("greedy"), seed=2022, replication=0, events=True)
    assert record.events is not None  # as was asked for
    events = record.events.columns()
    curve, slots = event_log.battery_levels(events), event_log.uav_slots(events)
    low, high = space.charge_start[0], space.charge_complete[0]
    latched = curve.loc[curve["battery"] <= low, "time"].min()
    charging = slots.loc[slots["charging"], "slot"]
    with style.figure_look():
        figure = style.Picture(figsize=(7.2, 3.2), dpi=style.DPI, layout="constrained")
        ax = figure.subplots()
        style.grid_of("y", ax)
        ax.plot(curve["time"], curve["battery"], color=style.UAVS[0], linewidth=1.8)
        for level, name in ((low, "$C_S$"), (high, "$C_C$")):
            ax.axhline(level, color=style.MUTED, linewidth=1, linestyle="--")
            style.note_at_right(f"{name} = {level}", level, ax).set_parse_math(True)
        ax.axvspan(charging.min(), charging.max() + 1, color=style.ZONE, alpha=0.6, linewidth=0)
        _say("flies: 1 % a slot", (0.5 * latched, np.interp(0.5 * latched, *_points(curve))), ax)
        _say("may charge from here on:\nit flies to the zone", (latched, low), ax, (-140, -44))
        begun = charging.min() + 2
        _say(
            "charges in the zone,\n10 % a slot",
            (begun, np.interp(begun, *_points(curve))),
            ax,
            (30, -4),
        )
        ax.set(xlabel="time [mission slots]", ylabel="battery [%]", ylim=(0, 112))
        ax.set_xlim(0, curve["time"].max())
    return figure


def _points(curve: pd.DataFrame) -> tuple[np.ndarray, np.ndarray]:
    return curve["time"].to_numpy(), curve["battery"].to_numpy()


def _say(text: str, place: tuple[float, float], ax: Axes, shift: tuple[int, int] = (8, 8)) -> None:
    """A text near a place of the axes, shifted by so many points."""
    ax.annotate(text, place, shift, textcoords="offset points", fontsize=9,
                arrowprops={"arrowstyle": "->", "color": style.INK})  # fmt: skip


def main(arguments: list[str]) -> None:
    """Draw the pictures of the model and, if their folder is given, of the pages."""
    MODEL.mkdir(exist_ok=True)
    for name, content in draw_model():
        (MODEL / name).write_bytes(content)
    for folder in arguments:
        draw_gallery(Path(folder))


if __name__ == "__main__":
    main(sys.argv[1:])
