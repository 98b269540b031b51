"""A player that shows a mission slot by slot in a page, with buttons and a slider.

A page contains ``library()`` once, before its first ``player``; then it needs no network. A player
is a plotly figure with a frame per mission slot: frame t shows the mission after t slots, from its
start at frame 0 to its end.

    display(library())
    display(player(log, scenario, "player-1", "One UAV"))
"""

from html import escape

import pandas as pd
from IPython.display import HTML
from plotly.io import to_html
from plotly.offline import get_plotlyjs

from analysis.results.event_log import Events
from dess.scenario import Scenario
from reports.player.layout import arranging, layout
from reports.player.playback import Playback
from reports.player.scene import Json, moving, still

READING = (
    "A disc shows the data that is left at a node, and the ring around it the largest amount that "
    "the node ever had. A numbered dot is a UAV. Its last moves are drawn behind it, and a line "
    "leads to the node that it served in most communication slots of the slot. The dot turns pale "
    "when the mission of the UAV is over. A full yellow square is a UAV that charges, an empty "
    "square a UAV that waits for a pad. The vertical lines in the panels mark the slot that is "
    "shown. At the end of the row of a UAV, a tick means that it filled its quota, a cross that it "
    "did not."
)

AGE_READING = (
    " The age of a node is the time since its newest collected data were generated; where data "
    "have no time stamps, it is the time since the node was last emptied. The length of a stem is "
    "the age of its node."
)


def reading(scenario: Scenario) -> str:
    """How to read the player of a mission of this scenario."""
    return READING + (AGE_READING if scenario.age.measured else "")


def library() -> HTML:
    """The library plotly.js, which a page needs once, before its players."""
    # A paused animation rejects its promise without a reason, which the console would report.
    quiet = """window.addEventListener("unhandledrejection", (event) => {
        if (event.reason === undefined) event.preventDefault();
    });"""
    return HTML(f"<script>{get_plotlyjs()}</script><script>{quiet}</script>")


def player(
    events: Events, scenario: Scenario, name: str, title: str = "", caption: str = ""
) -> HTML:
    """A player of a mission: it can be played, paused and shown slot by slot.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The scenario of the mission.
        name: The id of the player, unique in its page: letters, digits and hyphens.
        title: The text above the map.
        caption: The text below the figure; ``READING`` explains how to read it.

    Raises:
        InputError: If the log is not that of a complete mission of this scenario.
    """
    playback = Playback(pd.DataFrame(events), scenario)
    html = to_html(
        _figure(playback),
        config={"displayModeBar": False},
        auto_play=False,
        include_plotlyjs=False,
        post_script=arranging(playback),
        full_html=False,
        default_height="auto",
        validate=False,  # a test validates the figure
        div_id=name,
    )
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    above = f"<h3>{escape(title)}</h3>" if title else ""
    return HTML(f'<figure class="player">{above}{html}{below}</figure>')


def _figure(playback: Playback) -> Json:
    """The figure as plotly's JSON; later traces are drawn above earlier ones."""
    below, above = still(playback), moving(playback)
    numbers = list(range(len(below), len(below) + len(above)))
    return {
        "data": below + [trace.at(0) for trace in above],
        "frames": [
            {"name": str(t), "data": [trace.frames[t] for trace in above], "traces": numbers}
            for t in range(playback.end + 1)
        ],
        "layout": layout(playback),
    }
