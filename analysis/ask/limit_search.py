"""The search for what a cheapest fleet bears: the most wind, failures and data.

    find_limits(results, "my-sea.toml")  # results of a search for the cheapest setting

Each condition is made harder until the fleet breaks a requirement, on missions of the check of the
fleet.
"""

import math
from collections.abc import Callable

from dess.analysis.answers.fleet.cheapest import search_of
from dess.analysis.ask.bisection import find_most_data, find_strongest_wind
from dess.analysis.ask.failure_rates import find_most_failures
from dess.analysis.ask.limits import DOCUMENT, Limit, Limits
from dess.analysis.ask.tried_fleet import TriedFleet
from dess.analysis.results.tables import Results
from dess.policies.registry import is_path

MISSIONS = 30  # of the check, at most; for failures three times as many


def find_limits(
    results: Results,
    scenario: str,
    workers: int = 1,
    progress: Callable[[int], object] | None = None,
    missions: int = MISSIONS,
) -> None:
    """Find the limits of the cheapest fleet, and keep them in its results folder (``Derived``).

    A fleet for several conditions is asked about under the last of them. Nothing happens without a
    data sheet or a check, or if no fleet is known to meet the requirements, its policy is a file,
    or only the SimPy engine can simulate it; or if the limits are kept already, or nothing can be.

    Args:
        results: A study that searches for the cheapest setting.
        scenario: The scenario of the study, with the path of its file.
        workers: Number of threads.
        progress: Called with the number of missions done since its last call.
        missions: The most missions of the check that are simulated for every value.
    """
    best = search_of(results).best
    if not best.points or is_path(best.policy) or results.checks.empty:
        return
    if results.store.is_read_only or results.store.derived.has(DOCUMENT):
        return
    if results.store.manifest.processes:
        return
    fleet = TriedFleet(results, scenario, workers, progress, missions)
    if not fleet.space.units or fleet.space.needs_events:
        return
    broken = fleet.trial_of(fleet.checks).broken
    limits: tuple[Limit, ...] = ()
    if not broken:
        limits = tuple(sorted(_search_limits(fleet), key=_order_of))
    has_wind = fleet.space.data_sheet.max_speed is not None
    document = Limits(missions=fleet.missions, limits=limits, has_wind=has_wind, broken=broken)
    results.store.derived.keep(DOCUMENT, document)


def _order_of(limit: Limit) -> tuple[bool, float]:
    """What limits are sorted by: first those that break something, the nearest one first."""
    return limit.broken == "", limit.harder or math.inf


def _search_limits(fleet: TriedFleet) -> list[Limit]:
    """The limits of all conditions that the data sheet of the fleet's scenario has."""
    sheet = fleet.space.data_sheet
    limits = [find_most_failures(fleet)]
    if sheet.data_rate:
        limits.append(find_most_data(fleet, sheet.data_rate))
    if sheet.max_speed:
        limits.append(find_strongest_wind(fleet))
    return limits
