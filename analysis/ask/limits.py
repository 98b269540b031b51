"""What a cheapest fleet bears: the most wind, failures and data with which it is good enough.

    limit_facts(results)

The limits are found by ``limit_search.py``, and kept with the results of the study.
"""

from dess.analysis import numbers
from dess.analysis.facts import Fact
from dess.analysis.metrics import metric_of
from dess.analysis.results.tables import Results
from dess.base.files.documents import Document
from dess.scenario.quantities import POINTS

LEAST_WIND = 0.5  # that is tried [m/s]
PLACES = POINTS[::2]  # from which the wind comes
FAILURES = 1 / 100_000, 1.0  # the rarest and the most frequent that are tried [1/h of flying]
SHEET = "sheet"  # what ends a condition that the data sheet does not allow to be harder
DOCUMENT = "limits"  # in which they are kept
# In the order in which conditions of equal hardness are told.
_NAMES = {
    "data_sheet.data_rate": "data that it bears",
    "data_sheet.wind": "wind that it bears",
    "data_sheet.mtbf": "failures of a UAV in flight that it bears",
}


class Limit(Document):
    """How hard a condition may be.

    Attributes:
        field: The field of the scenario.
        present: Its value in the scenario; empty if it has none.
        last: The hardest value with which the fleet was found to meet its requirements, rounded to
            what the missions tell.
        is_rough: Whether they tell but one digit of it.
        small_zone: Where the success breaks, the zone with fewer cells than UAVs at which they are
            lost, in words; empty if not all are lost at such zones.
        harder: How many times as hard as at present this is; 0 if the scenario has no value.
        broken: The metric of the requirement that breaks beyond it; ``sheet`` if the data sheet
            allows no more, and empty if none breaks up to the hardest value that was tried.
    """

    field: str
    present: str
    last: str
    harder: float
    broken: str
    is_rough: bool = False
    small_zone: str = ""


class Limits(Document):
    """The limits of a fleet.

    Attributes:
        missions: The number of missions of the check on which they were found.
        limits: The limits, that which breaks something nearest to the present value first.
        has_wind: Whether the wind was asked about.
        broken: The metric whose requirement the fleet breaks in its check, so that no limits were
            sought; empty if it keeps all.
    """

    missions: int
    limits: tuple[Limit, ...]
    has_wind: bool
    broken: str = ""


def limits_of(results: Results) -> Limits | None:
    """The limits that ``find_limits`` has kept; None if there are none.

    Raises:
        InputError: If the file is damaged.
    """
    derived = results.store.derived
    if not derived.has(DOCUMENT):
        return None
    return derived.load(DOCUMENT, Limits, "what dess sweep has written")


def limit_facts(results: Results) -> list[Fact]:
    """How much of each condition the fleet bears, that which breaks a requirement first first."""
    document = limits_of(results)
    if document is None:
        return []
    if document.broken:
        name = metric_of(document.broken).within
        return [Fact("limits", f"not sought: in its check, the {name} breaks its requirement")]
    missions = numbers.format_count(document.missions, "mission")
    facts = [Fact(_NAMES[limit.field], _limit_in_words(limit)) for limit in document.limits]
    if not document.has_wind:
        facts.append(Fact(_NAMES["data_sheet.wind"], "not asked: the sheet has no max_speed"))
    method = f"{missions} of the check, for failures three times as many"
    return [*facts, Fact("limits found on", method)]


def _limit_in_words(limit: Limit) -> str:
    """How hard a condition may be, what is assumed, and what ends it."""
    every = ""
    if limit.field == "data_sheet.mtbf":
        every = "one every "
    if limit.last:
        about = ""
        if limit.is_rough:
            about = "about "
        bears = f"{about}{every}{limit.last}"
        if limit.field == "data_sheet.wind":
            bears = f"{bears}, the worst of {len(PLACES)} directions"
    elif limit.field == "data_sheet.wind":
        bears = f"not even {LEAST_WIND:g} m/s"
    else:
        bears = f"not even {every}{1 / FAILURES[0]:g} h"
    assumed = limit.present or "none"
    if limit.broken == SHEET:
        end = "beyond it, UAVs cannot fly"
    elif limit.broken:
        end = f"beyond it, the {metric_of(limit.broken).within} breaks"
        if limit.small_zone:
            end = f"{end}, as UAVs are lost at {limit.small_zone}"
    else:
        end = "no more was tried"
    return f"{bears} ({assumed} assumed); {end}"
