"""The page of a single mission: its player alone, as a file to send."""

from analysis.results.event_log import Events
from dess.scenario import Scenario
from reports.pages.template import fill
from reports.player import library, player, reading


def mission_page(events: Events, scenario: Scenario, title: str, outcome: str) -> str:
    """A self-contained page with the player of a mission; the same mission gives the same bytes.

    Args:
        events: The event log (a data frame, or the columns, of ``dess.record.EventLog``).
        scenario: The mission's scenario.
        title: The heading of the page.
        outcome: What came of the mission, in a sentence.

    Raises:
        InputError: If the log is not that of a whole mission of this scenario.
    """
    played = player(events, scenario, "mission", caption=reading(scenario))
    parts = {"library": library().data, "player": played.data}
    return fill("mission.html", scripts=True, title=title, outcome=outcome, **parts)
