"""A mission to play in its page, slot by slot: buttons, and a slider over the mission slots.

A page shows ``library()`` once, before its first ``player``, and then requests nothing. A player
is a plotly figure with a frame per mission slot: frame t shows the mission after t slots, frame 0
its start, the last one its end.

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
from reports.player import layout, mission_map, panels
from reports.player.playback import Playback
from reports.player.trace import Json

READING = (
    "A disc is the data that is left at a node, the ring around it the most that the node ever "
    "held. A numbered dot is a UAV with its last moves, and with a line to the node that it "
    "served in most of the slot's communication slots; it turns pale when its mission is over. A "
    "yellow square is a UAV that charges, an empty one a UAV that waits for a pad. The upright "
    "lines in the curves stand at the slot that is shown; a tick ends the row of a UAV that "
    "filled its quota, a cross that of one that did not."
)


def library() -> HTML:
    """The library plotly.js: once in a page, before its players."""
    # A paused animation rejects its promise without a reason, which the console would report.
    quiet = """window.addEventListener("unhandledrejection", (event) => {
        if (event.reason === undefined) event.preventDefault();
    });"""
    return HTML(f"<script>{get_plotlyjs()}</script><script>{quiet}</script>")


def player(
    events: Events, scenario: Scenario, name: str, title: str = "", caption: str = ""
) -> HTML:
    """A mission to play, to pause and to step through, slot by slot.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The mission's scenario.
        name: The player's id, unique in its page: letters, digits and hyphens.
        title: The text above the map.
        caption: The text below the figure; ``READING`` says how to read it.

    Raises:
        InputError: If the log is not that of a whole mission of this scenario.
    """
    html = to_html(
        _figure(Playback(pd.DataFrame(events), scenario)),
        config={"displayModeBar": False},
        auto_play=False,
        include_plotlyjs=False,
        post_script=layout.arranging(),
        full_html=False,
        default_height="auto",
        validate=False,  # a test does
        div_id=name,
    )
    below = f"<figcaption>{escape(caption)}</figcaption>" if caption else ""
    above = f"<h3>{escape(title)}</h3>" if title else ""
    return HTML(f'<figure class="player">{above}{html}{below}</figure>')


def _figure(playback: Playback) -> Json:
    """The figure as plotly's JSON; later traces lie above earlier ones."""
    still = [mission_map.rings(playback), *panels.at_rest(playback)]
    moving = [*mission_map.moving(playback), *panels.moving(playback)]
    numbers = list(range(len(still), len(still) + len(moving)))
    return {
        "data": still + [trace.at_start() for trace in moving],
        "frames": [
            {"name": str(t), "data": [trace.frames[t] for trace in moving], "traces": numbers}
            for t in range(playback.end + 1)
        ],
        "layout": layout.layout(playback),
    }
