"""A player that shows a mission slot by slot in a page: with buttons, a slider or the keyboard.

A page contains ``library()`` once, before its first ``player``; then it needs no network. What is
drawn is in ``templates/player.js``.

    display(library())
    display(player(log, scenario, "player-1", "One UAV"))
"""

from collections.abc import Iterable

from IPython.display import HTML

from dess.analysis.figures import style
from dess.analysis.results.event_log import Events
from dess.reports.pages.html import Part, figures, template
from dess.reports.player.playback import Playback
from dess.scenario import Scenario

READING = (
    "A disc shows the data left at a node, and its ring the most that it ever had. A numbered dot "
    "is a UAV, with its last moves and a line to the node that it serves most; it turns pale when "
    "its mission is over. A full square is a UAV that charges, an empty one a UAV that waits for a "
    "pad. A tick means that the quota was filled. A click in the panels goes to another slot; "
    "space plays and pauses, the arrows, Home and End change the slot."
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
    """The script of all players, which a page needs once, before its players."""
    return HTML(f"<script>{template('player.js').render(style=style)}</script>")


def together(players: Iterable[Part]) -> Part:
    """Several players side by side, which show the same slot."""
    return figures([player.values["figures"][0] for player in players], "gallery together")


def player(
    events: Events, scenario: Scenario, name: str, title: str = "", caption: str = ""
) -> Part:
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
    playback = Playback(events, scenario)
    shown = {"name": name, "title": title, "end": playback.end}
    drawn = template("player.html").render(data=playback.data, **shown)
    return figures([{"name": name, "player": drawn, "caption": caption}])
